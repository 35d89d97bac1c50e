//! Sessions: press after press, as the published recordings were made.

use super::error::TwinError;
use super::hold::hold_s;
use super::press::{PressFrames, press_frames};
use crate::chain::{Chain, ChainError, Take, press_facts};
use crate::scene::Scene;
use crate::session::Recorded;
use rayon::prelude::*;
use spts_circuit::{Interpolated, Mode};
use spts_sim::Frame;

/// A recording and the mechanics behind it, press by press.
pub type RecordedSession = (Recorded, Vec<PressFrames>);

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
    let presses: Vec<PressFrames> = presses
        .into_par_iter()
        .map(|index| {
            let frames = press_frames(scene, index);
            done();
            frames
        })
        .collect::<Result<_, _>>()?;
    let slices: Vec<&[Frame]> = presses.iter().map(|p| p.frames.as_slice()).collect();
    let recorded = recorded(scene.chain(), scene, &slices, take)?;
    Ok((recorded, presses))
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
        return Err(ChainError::from(spts_circuit::SourceError::Empty).into());
    };
    let recorded = recorded(first.chain(), first, &slices, &Take::drops(Mode::Compressive, session))?;
    Ok((recorded, drops))
}

/// `presses`, recorded one after the other, with what the simulation knows of each.
///
/// # Errors
/// [`ChainError`] when the readout refuses the conductance, or a press is too long to record.
pub fn recorded(chain: &Chain, scene: &Scene, presses: &[&[Frame]], take: &Take) -> Result<Recorded, ChainError> {
    let mut sources = chain.conductance(presses, take)?;
    recorded_from(chain, scene, presses, &mut sources, take)
}

/// The same where the conductance of the presses, `sources`, is known.
///
/// # Errors
/// As for [`recorded`].
pub fn recorded_from(
    chain: &Chain,
    scene: &Scene,
    presses: &[&[Frame]],
    sources: &mut [Interpolated],
    take: &Take,
) -> Result<Recorded, ChainError> {
    let hold_s = hold_s(scene);
    let facts = presses.iter().zip(sources.iter());
    let facts = facts
        .map(|(frames, source)| press_facts(frames, source.maps(), hold_s))
        .collect();
    Ok(Recorded {
        presses: facts,
        ..Recorded::new(chain.record_sources(sources, scene.duration_s(), take)?)
    })
}
