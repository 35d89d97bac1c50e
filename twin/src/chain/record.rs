//! Sessions: press after press, as the published recordings were made.

use super::chain::{Chain, Take};
use super::error::TwinError;
use super::press::{PressFrames, press_frames};
use rayon::prelude::*;
use spts_circuit::{Mode, Recording};
use spts_sim::Frame;
use spts_sim::scene::Scene;

/// A recording and the mechanics behind it, press by press.
pub type RecordedSession = (Recording, Vec<PressFrames>);

/// The given presses of `scene`, recorded as `take` says. The mechanics of the presses run in parallel; `done` is called
/// after each.
///
/// # Errors
/// [`TwinError`] when the mechanics or the readout fail.
pub fn press_session(
    scene: &Scene,
    presses: std::ops::Range<usize>,
    take: &Take,
    done: &(dyn Fn() + Sync),
) -> Result<RecordedSession, TwinError> {
    let chain = Chain::new(scene)?;
    let presses: Vec<PressFrames> = presses
        .into_par_iter()
        .map(|index| {
            let frames = press_frames(scene, index);
            done();
            frames
        })
        .collect::<Result<_, _>>()?;
    let slices: Vec<&[Frame]> = presses.iter().map(|p| p.frames.as_slice()).collect();
    let recording = chain.record(&slices, scene.duration_s(), take)?;
    Ok((recording, presses))
}

/// All drops of `scenes` (one or more drops each), recorded compressively in one session. Blocks follow each other as in
/// the published session.
///
/// # Errors
/// [`TwinError`] when the mechanics or the readout fail, or there is no scene.
pub fn bounce_session(scenes: &[Scene], session: u64) -> Result<RecordedSession, TwinError> {
    let jobs: Vec<(&Scene, usize)> = scenes
        .iter()
        .flat_map(|scene| (0..scene.repeats()).map(move |index| (scene, index)))
        .collect();
    let drops: Vec<PressFrames> = jobs
        .par_iter()
        .map(|(scene, index)| press_frames(scene, *index))
        .collect::<Result<_, _>>()?;
    let slices: Vec<&[Frame]> = drops.iter().map(|p| p.frames.as_slice()).collect();
    let Some(first) = scenes.first() else {
        return Err(spts_circuit::SourceError::Empty.into());
    };
    let recording = Chain::new(first)?.record(&slices, first.duration_s(), &Take::drops(Mode::Compressive, session))?;
    Ok((recording, drops))
}
