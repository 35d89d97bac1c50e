//! The readout beside the recordings it is fitted to: the skin's own images through the twin's electronics.

use super::page::section;
use crate::{PageTable, Section, compare};
use spts::progress::Progress;
use spts_eval::PublishedSkin;
use spts_input::Refusal;
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
    ) -> Result<Self, Refusal> {
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
    pub(super) fn write(&self, tables: &Path, figures: &Path) -> Result<(), Refusal> {
        compare::statistics(self.0.all_statistics()).write_csv(&tables.join("readout_statistics_real.csv"))?;
        compare::curves(&self.0).write_csv(&tables.join("readout_curves_real.csv"))?;
        compare::draw(&self.0, figures)
    }

    /// Section of the page.
    pub(super) fn section(&self) -> Section {
        Section {
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
            ..section("readout", true)
        }
    }
}
