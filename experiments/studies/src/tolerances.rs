//! `spts fidelity --tolerances`: whether the errors that were asked for are kept, on scenes that no table was measured
//! on.

use super::fidelity::{run_contact, taxel_error};
use rand::seq::SliceRandom;
use rayon::prelude::*;
use serde::Serialize;
use spts::progress::Progress;
use spts::provenance::{Provenance, combined_hash};
use spts::scene::{PressConfig, Scene, SceneConfig, Timestep, Tolerance};
use spts_contact::objects::pressable;
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams};
use spts_sim::fidelity::{FidelityLevel, finest};
use std::path::Path;
use std::time::Instant;

/// Settings of the study.
#[derive(Debug, Clone)]
pub struct ToleranceStudy {
    /// Errors of the taxels' pressures that are asked for; each [0.03, 1].
    pub tolerances: Vec<f64>,
    /// Number of scenes.
    pub scenes: usize,
    /// Seed of the choice of scenes.
    pub seed: u64,
}

/// Foams: thickness, m; and stiffnesses, Pa/m.
const THICKNESS_M: [f64; 3] = [2e-3, 6e-3, 30e-3];
const STIFFNESS_PA_PER_M: [f64; 3] = [1e6, 1.5e7, 1e8];
/// Skins: taxels along a side, and pitch, m.
const SKINS: [(usize, f64); 3] = [(10, 15e-3), (20, 5e-3), (30, 3e-3)];
/// Forces, N.
const FORCE_N: [f64; 3] = [1.0, 20.0, 100.0];

/// Most steps of a press on the finest level; beyond that it is solved for frames alone, which differs by less than 1 %
/// in every press of the shipped table.
const MOST_STEPS: f64 = 1600.0;
const FOR_FRAMES: &str = "layer_after";

/// One scene with one tolerance.
#[derive(Debug, Clone, Serialize)]
pub struct ToleranceRow {
    /// Object that is pressed on the middle of the skin.
    pub object: String,
    /// Thickness of the foam, m.
    pub thickness_m: f64,
    /// Stiffness of the foam, Pa/m.
    pub stiffness_pa_per_m: f64,
    /// Taxels along a side.
    pub rows: usize,
    /// Pitch, m.
    pub pitch_m: f64,
    /// Force, N.
    pub force_n: f64,
    /// The error that was asked for.
    pub tolerance: f64,
    /// Contact model that was chosen.
    pub contact: String,
    /// Cells along a taxel that were chosen.
    pub cells_per_taxel: usize,
    /// The error that was expected.
    pub expected: f64,
    /// Error of the taxels' pressures over the whole press, against the finest level.
    pub error: f64,
    /// How far the pressures of the finest level moved when its cells were halved.
    pub finest_error: f64,
    /// Wall time of the choice and the press, s.
    pub cost_s: f64,
    /// Wall time of the press on the finest level, s; `None` where a stiff contact needs steps so short that the finest
    /// level was solved for frames alone.
    pub finest_cost_s: Option<f64>,
}

/// Results of the study.
#[derive(Debug, Clone, Serialize)]
pub struct ToleranceReport {
    /// A row for each scene and tolerance.
    pub rows: Vec<ToleranceRow>,
    /// Scenes that cannot be, and why: a force that the foam does not carry, an object beside a small skin.
    pub refused: Vec<[String; 2]>,
    /// Provenance of the rows.
    #[serde(skip)]
    pub provenance: Provenance,
}

/// The hash of a scene and its rows; or the scene and why it cannot be.
type SceneRows = Result<(String, Vec<ToleranceRow>), [String; 2]>;

impl ToleranceStudy {
    /// Runs every scene on the finest level, and with every tolerance. Scenes are drawn from all objects on all foams,
    /// skins and forces of the study.
    ///
    /// # Errors
    /// [`Refusal`] if a scene that the finest level can have cannot be run with a tolerance.
    pub fn run(&self, progress: &dyn Progress) -> Result<ToleranceReport, Refusal> {
        for tolerance in &self.tolerances {
            Tolerance::Pressure(*tolerance).checked("--tolerances")?;
        }
        let mut all: Vec<SceneConfig> = Vec::new();
        for object in pressable() {
            for (thickness_m, stiffness) in THICKNESS_M.iter().flat_map(|h| STIFFNESS_PA_PER_M.map(|k| (*h, k))) {
                for ((side, pitch_m), force_n) in SKINS.iter().flat_map(|skin| FORCE_N.map(|f| (*skin, f))) {
                    let middle = Some(0.5 * (side - 1) as f64);
                    let press = PressConfig { row: middle, col: middle, force_n, ..PressConfig::default() };
                    let foam = [("thickness_m", thickness_m), ("stiffness_pa_per_m", stiffness)];
                    all.push(SceneConfig {
                        skin: SkinLayout::with_pitch(side, side, pitch_m)?,
                        contact: foam.into_iter().map(|(key, value)| (key.to_owned(), value.into())).collect(),
                        press: Some(PressConfig { object: Some(object.name.to_owned()), ..press }),
                        ..SceneConfig::default()
                    });
                }
            }
        }
        all.shuffle(&mut Streams::new(self.seed).rng("tolerances", 0));
        all.truncate(self.scenes);
        progress.stage("pressing", Some(all.len()));
        let runs: Vec<_> = all
            .into_par_iter()
            .map(|config| {
                let run = self.scene(&config);
                progress.step();
                run
            })
            .collect::<Result<_, Refusal>>()?;
        progress.end();
        let (mut rows, mut refused, mut hashes) = (Vec::new(), Vec::new(), Vec::new());
        for run in runs {
            match run {
                Ok((hash, own)) => {
                    hashes.push(hash);
                    rows.extend(own);
                }
                Err(refusal) => refused.push(refusal),
            }
        }
        Ok(ToleranceReport { rows, refused, provenance: Provenance::new(self.seed, combined_hash(&hashes)) })
    }

    /// The scene on the finest level and with every tolerance.
    fn scene(&self, config: &SceneConfig) -> Result<SceneRows, Refusal> {
        let Some(press) = &config.press else {
            return Err(Refusal::new("a scene of the study has no press"));
        };
        let object = press.object.clone().unwrap_or_default();
        let pitch_mm = 1e3 * config.skin.pitch_m();
        let foam = config.contact.to_string().trim().replace('\n', ", ");
        let name = format!("{object}, {} N, pitch of {pitch_mm} mm, {foam}", press.force_n);
        let run = |config: SceneConfig| {
            let start = Instant::now();
            let scene = Scene::new(config, Path::new(""))?;
            let found = run_contact(&scene, 0, 1)?;
            Ok::<_, Refusal>((scene, found, start.elapsed().as_secs_f64()))
        };
        let auto = SceneConfig { timestep_s: Some(Timestep::Auto), ..config.clone() };
        let reference = || {
            let columns = Scene::new(auto.clone(), Path::new(""))?;
            let (finest, cells) = finest(columns.mechanics());
            let many = columns.duration_s() / columns.mechanics().timestep_s() > MOST_STEPS;
            let level = FidelityLevel::named(FOR_FRAMES).filter(|_| many).unwrap_or(finest);
            let mut config = auto.clone();
            level.apply(&mut config.contact, cells);
            let (scene, found, cost_s) = run(config)?;
            Ok::<_, Refusal>((scene, found, (!many).then_some(cost_s)))
        };
        let (scene, finest, finest_cost_s) = match reference() {
            Ok(found) => found,
            Err(refusal) => return Ok(Err([name, refusal.to_string()])),
        };
        let of = |key: &str| config.contact.get(key).and_then(toml::Value::as_float).unwrap_or(f64::NAN);
        let rows = self.tolerances.iter().map(|&tolerance| {
            let asked = SceneConfig { tolerance: Some(Tolerance::Pressure(tolerance)), ..config.clone() };
            let (scene, found, cost_s) = run(asked).map_err(|e| e.at(format!("{name}, tolerance of {tolerance}")))?;
            let chosen = scene.mechanics().config();
            let contact = chosen.contact.get("model").and_then(toml::Value::as_str).unwrap_or_default();
            Ok(ToleranceRow {
                object: object.clone(),
                thickness_m: of("thickness_m"),
                stiffness_pa_per_m: of("stiffness_pa_per_m"),
                rows: config.skin.rows(),
                pitch_m: config.skin.pitch_m(),
                force_n: press.force_n,
                tolerance,
                contact: contact.to_owned(),
                cells_per_taxel: scene.mechanics().build_contact()?.cells_per_taxel(),
                expected: chosen.chosen.map_or(f64::NAN, |expected| expected.error),
                finest_error: chosen.chosen.map_or(f64::NAN, |expected| expected.finest_error),
                error: taxel_error(&found, &finest),
                cost_s,
                finest_cost_s,
            })
        });
        Ok(Ok((scene.hash()?, rows.collect::<Result<_, Refusal>>()?)))
    }
}
