//! `spts fidelity`: cost and error of every fidelity level of the contact, up to the error of the scores.
//!
//! Every scene is run with every level, at several resolutions and time steps (`settings`), and compared with the
//! reference level at its finest: pressures (`compare`) and, after transducer, readout and decoder, scores (`scores`).

mod compare;
mod error;
mod report;
mod run;
mod scenes;
mod scores;
mod settings;
#[cfg(test)]
mod tests;
mod text;

pub use error::FidelityError;
pub use report::FidelityReport;
pub use run::FinePressure;
pub use scenes::{FidelityScene, SCENES};
pub use settings::SettingGrid;
pub use text::{SettingMeans, setting_means};

use rayon::prelude::*;
use run::ContactRun;
use scores::{ChainScores, ReferenceScores};
use serde::Serialize;
use settings::ContactSetting;
use spts::progress::Progress;
use spts::provenance::{Provenance, combined_hash};
use spts::record::TwinError;
use spts::scene::Scene;
use spts_sim::fidelity::MeasuredSetting;
use std::path::Path;

/// Settings of `spts fidelity`, which measures cost and error of every contact model, resolution and time step.
#[derive(Debug, Clone)]
pub struct FidelityStudy {
    /// Names of built-in scenes, or scene files; empty for all built-in ones.
    pub scenes: Vec<String>,
    /// Levels, resolutions and time steps.
    pub grid: SettingGrid,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// A setting of a scene that could not be run, and why.
#[derive(Debug, Clone, Serialize)]
pub struct Refusal {
    /// Name of the scene.
    pub scene: String,
    /// Name of the fidelity level.
    #[serde(rename = "rung")]
    pub level: &'static str,
    /// Fine cells along one side of a taxel.
    pub cells_per_taxel: usize,
    /// Time step of the dynamics, s.
    pub timestep_s: f64,
    /// Why.
    pub reason: String,
}

/// The reference of one scene: the press or drop that is learned from, and the one that is compared.
struct Reference {
    scene: FidelityScene,
    at_reference: Scene,
    learned: ContactRun,
    scored: ContactRun,
}

impl FidelityStudy {
    /// Runs every scene with every setting. Meshes that only this study uses are written to the folder `meshes`, which
    /// must exist.
    ///
    /// # Errors
    /// [`FidelityError`] if a scene is not usable, a reference cannot be run, or a mesh cannot be written.
    pub fn run(&self, meshes: &Path, progress: &dyn Progress) -> Result<FidelityReport, FidelityError> {
        let scenes = scenes::build(&self.scenes, self.seed, meshes)?;
        let runs: usize = scenes.iter().map(|s| self.grid.settings(s.is_drop()).len()).sum();
        progress.stage("running contact models", Some(scenes.len() + runs));
        let references = scenes
            .into_par_iter()
            .map(|scene| {
                let setting = self.grid.reference(scene.is_drop());
                let at_reference = scene.at(setting)?;
                let [learned, scored] =
                    [(0, run::ONCE), (1, run::TIMED)].map(|(index, runs)| run::run(&at_reference, index, runs));
                progress.step();
                Ok(Reference {
                    learned: learned?,
                    scored: scored?,
                    at_reference,
                    scene,
                })
            })
            .collect::<Result<Vec<_>, TwinError>>()?;
        let others: Vec<(Scene, ContactRun)> = scenes::others(&references, self.seed, meshes)?
            .into_par_iter()
            .filter_map(|scene| {
                let run = run::run(&scene, 0, run::ONCE).ok()?;
                Some((scene, run))
            })
            .collect();
        let learned = ReferenceScores::learn(&references, &others, self.seed)?;
        let jobs: Vec<(usize, ContactSetting)> = (0..references.len())
            .flat_map(|i| {
                let settings = self.grid.settings(references[i].scene.is_drop());
                settings.into_iter().map(move |setting| (i, setting))
            })
            .collect();
        let results: Vec<SettingResult> = jobs
            .into_par_iter()
            .map(|(i, setting)| {
                let result = measure(&references[i], i, setting, &learned);
                progress.step();
                result
            })
            .collect::<Result<_, FidelityError>>()?;
        progress.end();
        let hash = provenance_hash(&references)?;
        let mut report = FidelityReport::new(Provenance::new(self.seed, hash));
        for result in results {
            report.add(result);
        }
        for reference in &references {
            let setting = self.grid.reference(reference.scene.is_drop());
            let scored = &reference.scored;
            let taxel_rms_rel = compare::taxel_error(scored, scored);
            report.add(row(reference, scored, setting, taxel_rms_rel, [0.0; 3]));
        }
        Ok(report)
    }
}

/// Hash of the references' scenes: what every other setting follows from.
fn provenance_hash(references: &[Reference]) -> Result<String, TwinError> {
    let hashes = references.iter().map(|r| Ok(r.at_reference.hash()?));
    Ok(combined_hash(&hashes.collect::<Result<Vec<_>, TwinError>>()?))
}

enum SettingResult {
    Measured(Box<MeasuredSetting>, FinePressure),
    Refused(Refusal),
}

/// Runs one setting of the scene with the index `label` and compares it with its reference.
fn measure(
    reference: &Reference,
    label: usize,
    setting: ContactSetting,
    learned: &ReferenceScores,
) -> Result<SettingResult, FidelityError> {
    let refused = |error: &dyn std::fmt::Display| {
        SettingResult::Refused(Refusal {
            scene: reference.scene.name.clone(),
            level: setting.level.name,
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
    let ChainScores { support, iou, class } = learned.score(&scene, &found, label)?;
    let truth = learned.reference(label);
    let deltas = [support - truth.support, iou - truth.iou, class - truth.class];
    Ok(row(reference, &found, setting, taxel_rms_rel, deltas))
}

/// The line of the table for `found`, with the error of the taxels' pressures and the changes of support accuracy, IoU
/// and classification.
fn row(
    reference: &Reference,
    found: &ContactRun,
    setting: ContactSetting,
    taxel_rms_rel: f64,
    [support_delta, iou_delta, class_delta]: [f64; 3],
) -> SettingResult {
    let row = MeasuredSetting {
        scene: reference.scene.name.clone(),
        task: if reference.scene.is_drop() { "drop" } else { "press" }.to_owned(),
        level: setting.level.name.to_owned(),
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
    SettingResult::Measured(Box::new(row), found.fine.clone())
}
