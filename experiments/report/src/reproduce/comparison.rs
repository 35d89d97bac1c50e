//! The readout beside the recordings it is fitted to: the skin's own images through the twin's electronics.

use super::ReproduceError;
use crate::compare::with_error;
use crate::labels::{object_label, statistic_label};
use crate::{PageFigure, PageTable, ReportError, Section, compare};
use spts::output::write_table;
use spts::progress::Progress;
use spts_eval::decoders::label;
use spts_eval::{PublishedSkin, Table};
use spts_studies::calibrate::read;
use spts_studies::compare::{CompareReport, CompareStudy, Images};
use std::path::Path;

/// What `spts compare` finds, as a section of the report.
pub(super) struct ReadoutSection(CompareReport);

impl ReadoutSection {
    /// Calibrates, replays and scores the sessions in `recordings`, which `real` was loaded from.
    pub(super) fn run(
        recordings: &Path,
        real: &PublishedSkin,
        seed: u64,
        progress: &dyn Progress,
    ) -> Result<Self, ReproduceError> {
        let study = CompareStudy {
            recordings,
            pairs: &read(recordings)?,
            real: Some(real),
            images: Images::Recorded,
            prediction: None,
            seed,
        };
        Ok(Self(study.run(progress)?))
    }

    /// Writes the tables into `tables` and the figures into `figures`.
    pub(super) fn write(&self, tables: &Path, figures: &Path) -> Result<(), ReportError> {
        write_table(&tables.join("readout_statistics_real.csv"), &self.0.all_statistics())?;
        write_table(&tables.join("readout_curves_real.csv"), self.0.distances())?;
        compare::draw(&self.0, figures)?;
        Ok(())
    }

    /// Section of the page.
    pub(super) fn section(&self) -> Section {
        Section {
            id: "readout".to_owned(),
            title: "The readout".to_owned(),
            lead: "The electronics alone: images of the real skin, found from its recordings by least squares, go through the twin's readout with the \
                   same weights. The readout is fitted to the odd presses of each recording, and compared and scored on the even ones."
                .to_owned(),
            figures: vec![
                PageFigure::new(
                    "residuals",
                    "Histograms of the residuals of twin and real skin, one panel a recording.",
                    "What the fitted image does not explain of the wire, without the memory of earlier samples: share of samples in each bin.",
                ),
                PageFigure::new(
                    "quantiles",
                    "Quantiles of the twin over those of the real skin, one panel a recording, close to the diagonal.",
                    "Quantiles of the wire's voltage, and of ten times the residual. Equal distributions lie on the dotted line.",
                ),
                PageFigure::new(
                    "scores",
                    "Score curves over the number of measurements for twin and real skin, one panel a published decoder.",
                    "Scores of the published decoders, mean over the objects, with the published dictionary and library. The real skin's raster \
                     image is the truth for both.",
                ),
            ],
            tables: vec![self.statistics_table(), self.curves_table()],
        }
    }

    fn statistics_table(&self) -> PageTable {
        let all = self.0.all_statistics();
        let table = Table::new("", &all)
            .shown("recording", |s| object_label(&s.session))
            .shown("statistic", |s| statistic_label(s.name))
            .shown("real skin", |s| with_error(s.real, s.real_standard_error, 4))
            .shown("twin", |s| with_error(s.twin, s.twin_standard_error, 4))
            .shown("allowed difference", |s| s.tolerance)
            .shown("met", |s| s.ok.map_or("", met));
        let caption = "Statistics of the even presses, ± standard error";
        PageTable::new(caption, &table, "readout_statistics_real.csv")
    }

    fn curves_table(&self) -> PageTable {
        let table = Table::new("", self.0.distances())
            .shown("decoder", |c| label(c.decode))
            .shown("score", |c| score_label(c.metric))
            .shown("mean", |c| c.mean_abs_difference)
            .digits(4)
            .shown("largest", |c| c.max_abs_difference)
            .digits(4)
            .shown("mean allowed", |c| c.tolerance)
            .digits(2)
            .shown("met", |c| c.ok);
        let caption = "|twin − real| of the score curves over M = 7 … 100";
        PageTable::new(caption, &table, "readout_curves_real.csv")
    }
}

/// What a score is called.
fn score_label(name: &str) -> String {
    match name {
        "support" => "support accuracy".to_owned(),
        "iou" => "IoU".to_owned(),
        "f1" => "F1".to_owned(),
        "class_single" => "single windows classified".to_owned(),
        "class_vote20" => "votes of 20 classified".to_owned(),
        other => other.replace('_', " "),
    }
}

fn met(ok: bool) -> &'static str {
    if ok { "yes" } else { "no" }
}
