//! Results of a fidelity study.

use super::run::FinePressure;
use super::{Refusal, SettingResult};
use serde::Serialize;
use spts::provenance::Provenance;
use spts_sim::fidelity::{LEVELS, MeasuredSetting};

/// Results of `spts fidelity`: cost and error of every setting of every scene.
#[derive(Debug, Clone, Serialize)]
pub struct FidelityReport {
    /// One row for each scene, level, resolution and time step. The references have zero error.
    pub rows: Vec<MeasuredSetting>,
    /// Settings that could not be run, mostly because of a time step beyond the scene's limit.
    pub refusals: Vec<Refusal>,
    /// Pressure on the contact's grid in the middle of the scored span, one map for each row of `rows`.
    #[serde(skip)]
    pub fine: Vec<FinePressure>,
    /// Provenance of the rows.
    #[serde(skip)]
    pub provenance: Provenance,
}

impl FidelityReport {
    /// A report without rows.
    pub(super) fn new(provenance: Provenance) -> Self {
        Self {
            rows: Vec::new(),
            refusals: Vec::new(),
            fine: Vec::new(),
            provenance,
        }
    }

    /// Takes the result of one setting in. Rows stay sorted: scene by scene as they come, levels from cheap to dear,
    /// then resolution and step.
    pub(super) fn add(&mut self, result: SettingResult) {
        match result {
            SettingResult::Refused(refusal) => self.refusals.push(refusal),
            SettingResult::Measured(row, fine) => {
                let scenes: Vec<&str> = self.rows.iter().map(|r| r.scene.as_str()).collect();
                let key = |r: &MeasuredSetting| {
                    (
                        scenes.iter().position(|s| *s == r.scene).unwrap_or(usize::MAX),
                        LEVELS.iter().position(|level| level.name == r.level),
                        r.cells_per_taxel,
                        r.timestep_s.to_bits(),
                    )
                };
                let at = self.rows.partition_point(|r| key(r) <= key(&row));
                self.rows.insert(at, *row);
                self.fine.insert(at, fine);
            }
        }
    }
}
