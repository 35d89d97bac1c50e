//! What a fidelity study found.

use super::run::FinePressure;
use super::{Refusal, SettingResult};
use serde::Serialize;
use spts::provenance::Provenance;
use spts_sim::fidelity::{LEVELS, MeasuredSetting};

/// Cost and error of every setting of every scene.
#[derive(Debug, Clone, Serialize)]
pub struct FidelityReport {
    /// One line a scene, level, resolution and time step; the references have errors of zero.
    pub rows: Vec<MeasuredSetting>,
    /// What could not be run: a step beyond the scene's limit, most of all.
    pub refusals: Vec<Refusal>,
    /// Fine pressure in the middle of the span that is scored, one field a row.
    #[serde(skip)]
    pub fine: Vec<FinePressure>,
    /// What the rows depend on.
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
