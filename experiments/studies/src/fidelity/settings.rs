//! Levels, resolutions and time steps to be measured.

use spts_sim::fidelity::{FidelityLevel, LEVELS, REFERENCE};

/// Resolutions and time steps at which `spts fidelity` runs every contact model.
///
/// ```
/// use spts_studies::fidelity::SettingGrid;
///
/// let (quick, full) = (SettingGrid::quick(), SettingGrid::full());
/// assert!(quick.cells_per_taxel.len() <= full.cells_per_taxel.len());
/// assert!(full.reference_cells > *full.cells_per_taxel.first().expect("resolutions"));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SettingGrid {
    /// Resolutions: grid squares along one side of a taxel.
    pub cells_per_taxel: Vec<usize>,
    /// Time steps of a press, s.
    pub press_steps_s: Vec<f64>,
    /// Time steps of a drop, s.
    pub drop_steps_s: Vec<f64>,
    /// Resolution of the reference.
    pub reference_cells: usize,
}

/// A level at a resolution and a time step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ContactSetting {
    pub(super) level: &'static FidelityLevel,
    pub(super) cells_per_taxel: usize,
    pub(super) timestep_s: f64,
}

/// Time between the frames of a press, s: the one step of a level without dynamics.
pub(super) const FRAME_S: f64 = 2e-3;

impl SettingGrid {
    /// The settings of the shipped table.
    #[must_use]
    pub fn full() -> Self {
        Self {
            cells_per_taxel: vec![2, 3, 6, 12, 24],
            press_steps_s: vec![2.5e-4, 5e-4, 1e-3, 2e-3],
            drop_steps_s: vec![5e-5, 1e-4, 2e-4],
            reference_cells: 24,
        }
    }

    /// Settings that take less than a minute.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            cells_per_taxel: vec![2, 6],
            press_steps_s: vec![5e-4],
            drop_steps_s: vec![1e-4],
            reference_cells: 6,
        }
    }

    fn steps_s(&self, drop: bool) -> &[f64] {
        if drop { &self.drop_steps_s } else { &self.press_steps_s }
    }

    /// The reference: its level at its finest.
    pub(super) fn reference(&self, drop: bool) -> ContactSetting {
        ContactSetting {
            level: FidelityLevel::named(REFERENCE).unwrap_or(&LEVELS[0]),
            cells_per_taxel: self.reference_cells,
            timestep_s: self.steps_s(drop).iter().copied().fold(f64::INFINITY, f64::min),
        }
    }

    /// Everything that is compared with the reference: that itself is left out, and a drop has no level without
    /// dynamics.
    pub(super) fn settings(&self, drop: bool) -> Vec<ContactSetting> {
        let mut settings = Vec::new();
        for level in LEVELS {
            let steps_s = if level.dynamic { self.steps_s(drop) } else { &[FRAME_S] };
            if drop && !level.dynamic {
                continue;
            }
            for &cells_per_taxel in &self.cells_per_taxel {
                settings.extend(steps_s.iter().map(|&timestep_s| ContactSetting {
                    level,
                    cells_per_taxel,
                    timestep_s,
                }));
            }
        }
        settings.retain(|setting| *setting != self.reference(drop));
        settings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four dynamic levels and one without, counted by hand; one of them is the reference.
    #[test]
    fn every_level_resolution_and_step() {
        let grid = SettingGrid::full();
        assert_eq!(grid.settings(false).len(), 4 * 5 * 4 + 5 - 1);
        assert_eq!(grid.settings(true).len(), 4 * 5 * 3 - 1);
        assert!(grid.settings(true).iter().all(|s| s.level.dynamic));
    }
}
