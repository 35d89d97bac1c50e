//! `spts fidelity`: what every rung of the contact ladder costs, and how wrong it is, down to the scores a user sees.
//!
//! Every scene is run on every rung, at several resolutions and time steps, and compared with the reference rung at its
//! finest (`plan`): the pressures (`compare`) and, after transducer, readout and decoder, the scores (`chain`).

mod chain;
mod compare;
mod plan;
mod run;
mod scenes;
mod sheet;
mod table;
#[cfg(test)]
mod tests;
mod text;

pub use plan::Plan;
pub use scenes::{SCENES, StudyScene};
pub use table::Report;

use crate::cli::{CliError, progress};
use crate::output::OutputFolder;
use crate::provenance::{combined_hash, scene_hash};
use crate::twin::TwinError;
use chain::{Judged, Yardstick};
use plan::Setting;
use rayon::prelude::*;
use run::{Fine, Run};
use serde::Serialize;
use spts_sim::ladder::Measured;
use spts_sim::scene::Scene;
use std::path::PathBuf;

/// What to measure, and where to.
#[derive(Debug, Clone)]
pub struct Study {
    /// Names of built-in scenes, or scene files; empty for all built-in ones.
    pub scenes: Vec<String>,
    /// Rungs, resolutions and time steps.
    pub plan: Plan,
    /// Root of every random number.
    pub seed: u64,
    /// Folder of the results.
    pub out: PathBuf,
}

/// A setting of a scene that could not be run, and why.
#[derive(Debug, Clone, Serialize)]
pub struct Refusal {
    /// Name of the scene.
    pub scene: String,
    /// Name of the rung.
    pub rung: &'static str,
    /// Fine cells along one side of a taxel.
    pub cells_per_taxel: usize,
    /// Step of the dynamics, s.
    pub timestep_s: f64,
    /// Why.
    pub reason: String,
}

/// The reference of one scene: the press or drop that is learned from, and the one that is compared.
struct Reference {
    scene: StudyScene,
    on_rung: Scene,
    learned: Run,
    scored: Run,
}

impl Study {
    /// Runs everything and writes tables and pictures.
    ///
    /// # Errors
    /// [`CliError`] when a scene cannot be used, a reference cannot be run, or a file cannot be written.
    pub fn run(&self) -> Result<Report, CliError> {
        OutputFolder::check(&self.out)?;
        let staged = OutputFolder::create(&self.out)?.stage()?;
        let folder = staged.folder("scenes")?;
        let scenes = scenes::build(&self.scenes, self.seed, &folder)?;
        let runs: usize = scenes.iter().map(|s| self.plan.settings(s.is_drop()).len()).sum();
        let bar = progress(scenes.len() + runs, "climbing the ladder");
        let references = scenes
            .into_par_iter()
            .map(|scene| {
                let setting = self.plan.reference(scene.is_drop());
                let on_rung = scene.at(setting)?;
                let [learned, scored] =
                    [(0, run::ONCE), (1, run::TIMED)].map(|(index, runs)| run::run(&on_rung, index, runs));
                bar.inc(1);
                Ok(Reference {
                    learned: learned?,
                    scored: scored?,
                    on_rung,
                    scene,
                })
            })
            .collect::<Result<Vec<_>, TwinError>>()?;
        let others: Vec<(Scene, Run)> = scenes::others(&references, self.seed, &folder)?
            .into_par_iter()
            .filter_map(|scene| {
                let run = run::run(&scene, 0, run::ONCE).ok()?;
                Some((scene, run))
            })
            .collect();
        let yardstick = Yardstick::learn(&references, &others, self.seed)?;
        let jobs: Vec<(usize, Setting)> = (0..references.len())
            .flat_map(|i| {
                let settings = self.plan.settings(references[i].scene.is_drop());
                settings.into_iter().map(move |setting| (i, setting))
            })
            .collect();
        let outcomes: Vec<Outcome> = jobs
            .into_par_iter()
            .map(|(i, setting)| {
                let outcome = measure(&references[i], i, setting, &yardstick);
                bar.inc(1);
                outcome
            })
            .collect::<Result<_, TwinError>>()?;
        bar.finish_and_clear();
        let hash = provenance_hash(&references)?;
        let mut report = Report::default();
        for outcome in outcomes {
            report.add(outcome);
        }
        for reference in &references {
            let setting = self.plan.reference(reference.scene.is_drop());
            let scored = &reference.scored;
            let taxel_rms_rel = compare::taxel_error(scored, scored);
            report.add(row(reference, scored, setting, taxel_rms_rel, [0.0; 3]));
        }
        report
            .write(&staged, self.seed, &hash)
            .map_err(|error| error.unstaged(&staged))?;
        staged.commit()?;
        Ok(report)
    }
}

/// Hash of the references' scenes: what every other setting follows from.
fn provenance_hash(references: &[Reference]) -> Result<String, TwinError> {
    let hashes = references.iter().map(|r| Ok(scene_hash(&r.on_rung)?));
    Ok(combined_hash(&hashes.collect::<Result<Vec<_>, TwinError>>()?))
}

enum Outcome {
    Measured(Box<Measured>, Fine),
    Refused(Refusal),
}

/// Runs one setting of the scene with the index `label` and compares it with its reference.
fn measure(reference: &Reference, label: usize, setting: Setting, yardstick: &Yardstick) -> Result<Outcome, TwinError> {
    let refused = |error: &dyn std::fmt::Display| {
        Outcome::Refused(Refusal {
            scene: reference.scene.name.clone(),
            rung: setting.rung.name,
            cells_per_taxel: setting.cells_per_taxel,
            timestep_s: setting.timestep_s,
            reason: error.to_string(),
        })
    };
    let scene = match reference.scene.at(setting) {
        Ok(scene) => scene,
        Err(error) => return Ok(refused(&error)),
    };
    let found = match run::run(&scene, 1, run::TIMED) {
        Ok(found) => found,
        Err(error) => return Ok(refused(&error)),
    };
    let taxel_rms_rel = compare::taxel_error(&found, &reference.scored);
    if !taxel_rms_rel.is_finite() {
        return Ok(refused(&"the ball meets nothing, or the reference nothing like it"));
    }
    let Judged { support, iou, class } = yardstick.judge(&scene, &found, label)?;
    let truth = yardstick.reference(label);
    let deltas = [support - truth.support, iou - truth.iou, class - truth.class];
    Ok(row(reference, &found, setting, taxel_rms_rel, deltas))
}

/// The line of the table for `found`, with the error of the taxels' pressures and the changes of support accuracy, IoU and classification.
fn row(
    reference: &Reference,
    found: &Run,
    setting: Setting,
    taxel_rms_rel: f64,
    [support_delta, iou_delta, class_delta]: [f64; 3],
) -> Outcome {
    let row = Measured {
        scene: reference.scene.name.clone(),
        task: if reference.scene.is_drop() { "drop" } else { "press" }.to_owned(),
        rung: setting.rung.name.to_owned(),
        cells: found.fine.shape(),
        cells_per_taxel: setting.cells_per_taxel,
        timestep_s: setting.timestep_s,
        cost_us_per_step: found.cost_us_per_step,
        cost_s_per_s: found.cost_s_per_s,
        pressure_rms_rel: compare::fine_error(&found.fine, &reference.scored.fine),
        taxel_rms_rel,
        support_delta,
        iou_delta,
        class_delta,
    };
    Outcome::Measured(Box::new(row), found.fine.clone())
}
