//! What decoders learn from, by its name on the command line.

use crate::context::progress;
use crate::error::CliError;
use crate::extras::simulated_presses;
use crate::skin::skin_gains;
use spts_contact::objects::OBJECTS;
use spts_eval::training::{
    CALIBRATED, PUBLISHED, PoseKnowledge, PosedObject, RASTER, SHAPES, TrainingSource, simulated_gain_sd,
};
use spts_eval::{ScoredSession, Source};
use spts_models::SkinLayout;
use std::path::Path;

/// Name of what is learned from the objects in all their poses.
const SIMULATION: &str = "simulation";
/// Name of what is learned from simulated skins on which the objects lie as in the published recordings.
const SIMULATION_FITTED: &str = "simulation_fitted";

/// Simulated presses, made once for all sources that need them.
#[derive(Debug, Default)]
pub(super) struct SimulatedSkins {
    usual: Option<Vec<ScoredSession>>,
    median: Option<Vec<ScoredSession>>,
}

/// The source `name` for decoders that are scored on `scored`; simulated skins are pressed once and kept in `skins`.
///
/// # Errors
/// [`CliError`] when a folder cannot be opened or nothing can be simulated on the skin.
pub(super) fn training_source(
    name: &str,
    scored: &Source,
    seed: u64,
    skins: &mut SimulatedSkins,
) -> Result<TrainingSource, CliError> {
    let mut presses = |median: bool| -> Result<Vec<ScoredSession>, CliError> {
        let skins = if median { &mut skins.median } else { &mut skins.usual };
        if let Some(sessions) = skins {
            return Ok(sessions.clone());
        }
        let sessions = simulated_presses(scored.layout, median, seed)?;
        Ok(skins.insert(sessions).clone())
    };
    Ok(match name {
        PUBLISHED => TrainingSource::Published,
        RASTER => TrainingSource::Raster,
        SHAPES => TrainingSource::Shapes,
        SIMULATION => TrainingSource::Poses {
            name: SIMULATION.to_owned(),
            objects: posed_objects(&scored.layout, seed)?,
        },
        SIMULATION_FITTED => TrainingSource::Other {
            name: SIMULATION_FITTED.to_owned(),
            sessions: presses(false)?,
            all: true,
            gain_sd: simulated_gain_sd(),
        },
        CALIBRATED => TrainingSource::Calibrated {
            name: CALIBRATED.to_owned(),
            simulated: presses(true)?,
            gains: None,
        },
        file if Path::new(file).extension().is_some_and(|e| e == "toml") => TrainingSource::Calibrated {
            name: file.to_owned(),
            gains: Some(skin_gains(Path::new(file), &scored.layout)?),
            simulated: presses(true)?,
        },
        dir => {
            let source = Source::open(Path::new(dir))?;
            // of the scored sessions themselves, the presses that are not scored
            let all = source.simulated && !source.shares_raster(scored);
            TrainingSource::Other {
                name: dir.to_owned(),
                sessions: source.sessions,
                all,
                gain_sd: if all { simulated_gain_sd() } else { 0.0 },
            }
        }
    })
}

/// The objects in all the poses that they may have.
fn posed_objects(layout: &SkinLayout, seed: u64) -> Result<Vec<PosedObject>, CliError> {
    let bar = progress(OBJECTS.len(), "simulated objects");
    let objects = PoseKnowledge::default().press(layout, seed, &|| bar.inc(1));
    bar.finish_and_clear();
    objects.map_err(|e| CliError::usage(format!("simulated objects: {e}")))
}
