//! Sessions that commands simulate before they learn from them or score them.

use crate::context::progress;
use crate::error::CliError;
use spts_contact::objects::OBJECTS;
use spts_eval::training::Skins;
use spts_eval::{ScoredSession, Source, TwinSessions};
use spts_models::SkinLayout;

/// Sessions of `scenes`, simulated now.
pub(crate) fn simulated_sessions(scenes: &[String], seed: u64, quick: bool) -> Result<Source, CliError> {
    let scenes = scenes.to_vec();
    let twin = TwinSessions { scenes, seed, quick };
    let bar = progress(twin.steps(), "simulating presses");
    let set = twin.simulate(&|| bar.inc(1));
    bar.finish_and_clear();
    Ok(Source::new(set?)?)
}

/// Simulated presses of every object on as many skins as the default says, made once for all sources that need them.
/// The skins have the `layout` of the scored one, and usual gains; with `median`, gain 1 everywhere.
pub(crate) fn simulated_presses(layout: SkinLayout, median: bool, seed: u64) -> Result<Vec<ScoredSession>, CliError> {
    let skins = if median { Skins::median(layout) } else { Skins { layout, ..Skins::default() } };
    let bar = progress(skins.skins * OBJECTS.len(), "simulated presses");
    let sessions = skins.press(seed, &|| bar.inc(1));
    bar.finish_and_clear();
    sessions.map_err(|e| CliError::usage(format!("simulated presses: {e}")))
}
