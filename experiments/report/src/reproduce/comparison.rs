//! The readout beside the recordings it is fitted to: the skin's own images through the twin's electronics.

use super::ReproduceError;
use crate::{ReportError, Section, Table, compare};
use spts::output::write_table;
use spts::progress::Progress;
use spts_eval::PublishedSkin;
use spts_studies::calibrate::read;
use spts_studies::compare::{CompareReport, CompareStudy, CurveDistance, Images, Statistic, with_error};
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
        let figure = |file: &str, caption: &str| (file.to_owned(), caption.to_owned());
        Section {
            id: "readout".to_owned(),
            title: "The readout".to_owned(),
            lead: "The skin's own images, measured by least squares, sent through the twin's readout at the same rows of weights. The readout is \
                   calibrated on the odd presses of each session, compared on the even ones with the same estimators, and scored on the even ones of presses 6 to 15."
                .to_owned(),
            figures: vec![
                figure("residuals", "Residual of the least-squares fit, the memory taken out: share of samples a bin."),
                figure("quantiles", "Quantiles of the output, and of ten times that residual, twin against skin."),
                figure("scores", "Score curves with the published dictionary and library, the skin's raster image as the truth for both."),
            ],
            tables: vec![self.statistics_table(), self.curves_table()],
        }
    }

    fn statistics_table(&self) -> Table {
        let row = |s: &Statistic| {
            vec![
                s.session.clone(),
                s.name.replace('_', " "),
                with_error(s.real, s.real_standard_error, 4),
                with_error(s.twin, s.twin_standard_error, 4),
                s.tolerance.to_owned(),
                s.ok.map_or_else(String::new, met),
            ]
        };
        Table {
            caption: "Statistics of the even presses, V where they have a unit".to_owned(),
            header: ["session", "statistic", "real", "twin", "allowed", "met"]
                .map(str::to_owned)
                .to_vec(),
            rows: self.0.all_statistics().iter().map(row).collect(),
            file: Some("readout_statistics_real.csv".to_owned()),
        }
    }

    fn curves_table(&self) -> Table {
        let row = |c: &CurveDistance| {
            vec![
                c.decode.to_owned(),
                c.metric.to_owned(),
                format!("{:.4}", c.mean_abs_difference),
                format!("{:.4}", c.max_abs_difference),
                format!("{:.2}", c.tolerance),
                met(c.ok),
            ]
        };
        let header = ["decode", "score", "mean", "largest", "mean allowed", "met"];
        Table {
            caption: "|twin − real| of the score curves over M = 7 … 100".to_owned(),
            header: header.map(str::to_owned).to_vec(),
            rows: self.0.distances().iter().map(row).collect(),
            file: Some("readout_curves_real.csv".to_owned()),
        }
    }
}

fn met(ok: bool) -> String {
    if ok { "yes" } else { "no" }.to_owned()
}
