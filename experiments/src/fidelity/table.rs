//! The study's results and their files.

use super::run::Fine;
use super::{Outcome, Refusal, sheet, text};
use crate::cli::CliError;
use crate::figures::{save_charts, save_sheet};
use crate::output::{Staged, write_bytes, write_json, write_table};
use crate::provenance::{Machine, Provenance};
use serde::Serialize;
use spts_sim::ladder::{Measured, RUNGS};

/// Everything a study found.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Report {
    /// One line a scene, rung, resolution and time step; the references have errors of zero.
    pub rows: Vec<Measured>,
    /// What could not be run: a step beyond the scene's limit, most of all.
    pub refusals: Vec<Refusal>,
    /// Fine pressures, one a row.
    #[serde(skip)]
    pub(super) fine: Vec<Fine>,
}

/// A line without what depends on the machine.
#[derive(Debug, Serialize)]
struct ErrorRow<'a> {
    scene: &'a str,
    rung: &'a str,
    cells: &'a str,
    timestep_s: f64,
    pressure_rms_rel: f64,
    taxel_rms_rel: f64,
    support_delta: f64,
    iou_delta: f64,
    class_delta: f64,
}

#[derive(Debug, Serialize)]
struct Origin {
    #[serde(flatten)]
    provenance: Provenance,
    #[serde(flatten)]
    machine: Machine,
}

impl Report {
    /// Takes one outcome in. Rows stay sorted: scene by scene as they come, rungs from cheap to dear, then resolution and
    /// step.
    pub(super) fn add(&mut self, outcome: Outcome) {
        match outcome {
            Outcome::Refused(refusal) => self.refusals.push(refusal),
            Outcome::Measured(row, fine) => {
                let scenes: Vec<&str> = self.rows.iter().map(|r| r.scene.as_str()).collect();
                let key = |r: &Measured| {
                    (
                        scenes.iter().position(|s| *s == r.scene).unwrap_or(usize::MAX),
                        RUNGS.iter().position(|rung| rung.name == r.rung),
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

    /// Means over the scenes, as a table to read.
    #[must_use]
    pub fn text(&self) -> String {
        text::markdown(self)
    }

    /// Writes tables, pictures and provenance.
    pub(super) fn write(&self, staged: &Staged, seed: u64, scene_hash: &str) -> Result<(), CliError> {
        let errors: Vec<ErrorRow<'_>> = self.rows.iter().map(ErrorRow::from).collect();
        write_table(&staged.path("errors.csv"), &errors)?;
        write_table(&staged.path("fidelity.csv"), &self.rows)?;
        write_table(&staged.path("refused.csv"), &self.refusals)?;
        write_bytes(&staged.path("summary.md"), text::markdown(self).as_bytes())?;
        let figures = staged.folder("figures")?;
        save_charts(&sheet::pareto(&self.rows), &figures, "pareto")?;
        save_sheet(&sheet::pressures(&self.rows, &self.fine), &figures, "pressure")?;
        let origin = Origin {
            provenance: Provenance::new(seed, scene_hash.to_owned()),
            machine: Machine::here(),
        };
        write_json(&staged.path("provenance.json"), &origin)?;
        Ok(())
    }
}

impl<'a> From<&'a Measured> for ErrorRow<'a> {
    fn from(row: &'a Measured) -> Self {
        Self {
            scene: &row.scene,
            rung: &row.rung,
            cells: &row.cells,
            timestep_s: row.timestep_s,
            pressure_rms_rel: row.pressure_rms_rel,
            taxel_rms_rel: row.taxel_rms_rel,
            support_delta: row.support_delta,
            iou_delta: row.iou_delta,
            class_delta: row.class_delta,
        }
    }
}
