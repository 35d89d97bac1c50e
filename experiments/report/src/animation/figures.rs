//! The two animations of the report.

use super::Animation;
use spts::output::write_bytes;
use spts::scene::Assignment;
use spts::simulate::{Request, run};
use spts_eval::training::TrainingData;
use spts_input::Refusal;
use spts_models::Streams;
use std::path::Path;

/// One animation of the report: what a page shows of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MotionFigure {
    /// Scene, as `spts simulate` names it.
    pub scene: &'static str,
    /// File of the animation.
    pub file: &'static str,
    /// File of one picture of it, for readers who want nothing to move.
    pub still: &'static str,
    /// What it shows, for those who cannot see it.
    pub alt: &'static str,
    /// Caption.
    pub caption: &'static str,
}

/// Every animation of the report, in the order of the page.
pub const MOTION_FIGURES: [MotionFigure; 2] = [
    MotionFigure {
        scene: "press/T",
        file: "press.gif",
        still: "press_still.png",
        alt: "A T is pressed on the skin: the pressure on every taxel, the voltage on the one wire, and the image decoded \
              from it, side by side.",
        caption: "A press of the T. Left: the pressure on the taxels. Middle: the last samples of the one wire. Right: \
                  the image, decoded in time from the wire alone by a decoder that has never seen a T.",
    },
    MotionFigure {
        scene: "bounce",
        file: "bounce.gif",
        still: "bounce_still.png",
        alt: "A ball bounces on the skin for eight milliseconds: the pressure on every taxel, the voltage on the one wire, \
              and the image decoded from it, side by side.",
        caption: "A ball that is dropped from half a metre touches the skin for some eight milliseconds. Left: the \
                  pressure on the taxels. Middle: the last samples of the one wire. Right: the image, decoded in time \
                  from the wire alone by a decoder that has never seen a ball.",
    },
];

/// Simulates the scenes of [`MOTION_FIGURES`] with the root `seed` and writes their files into `folder`.
///
/// # Errors
/// [`Refusal`] when a scene cannot be simulated or records nothing, or a file cannot be written.
pub fn simulate_motion(seed: u64, folder: &Path) -> Result<(), Refusal> {
    for figure in MOTION_FIGURES {
        let assignment: Assignment = format!("seed={seed}").parse()?;
        let request = Request { scene: figure.scene.to_owned(), assignments: vec![assignment] };
        let prepared = request.prepare()?;
        let mut frames = Vec::new();
        let simulation = run(&prepared, true, &|| (), |piece| {
            frames.extend(piece.presses.iter().take(1).flat_map(|press| press.frames.clone()));
            Ok(())
        })?;
        let unrecorded = || Refusal::new("nothing was recorded").at(figure.scene);
        let session = simulation.first.as_ref().ok_or_else(unrecorded)?;
        let training = TrainingData::for_layout(prepared.scene.skin(), Streams::new(1))?;
        let animation = Animation::new(&prepared, &frames, session, Some(&training))?;
        let [moving, still] = [figure.file, figure.still].map(|name| folder.join(name));
        write_bytes(&moving, &animation.gif(&moving)?)?;
        write_bytes(&still, &animation.still(&still)?)?;
    }
    Ok(())
}
