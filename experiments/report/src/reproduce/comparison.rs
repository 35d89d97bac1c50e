//! The readout beside the recordings it is fitted to: the skin's own images through the twin's electronics.

use super::ReproduceError;
use crate::{PageFigure, PageTable, Section, compare};
use spts::output::OutputError;
use spts::progress::Progress;
use spts_eval::PublishedSkin;
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
    pub(super) fn write(&self, tables: &Path, figures: &Path) -> Result<(), OutputError> {
        compare::statistics(self.0.all_statistics()).write_csv(&tables.join("readout_statistics_real.csv"))?;
        compare::curves(&self.0).write_csv(&tables.join("readout_curves_real.csv"))?;
        compare::draw(&self.0, figures)
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
            tables: vec![
                PageTable::new(
                    "Statistics of the even presses, ± standard error",
                    &compare::statistics(self.0.all_statistics()),
                    "readout_statistics_real.csv",
                ),
                PageTable::new(
                    "|twin − real| of the score curves over M = 7 … 100",
                    &compare::curves(&self.0),
                    "readout_curves_real.csv",
                ),
            ],
        }
    }
}
