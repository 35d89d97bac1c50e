//! The mechanics of one press or drop.

use super::error::TwinError;
use spts_sim::scene::{Scene, Task};
use spts_sim::world::{Bounce, PressCourse};
use spts_sim::{Frame, World};

/// Frames of one press or drop, and what the mechanics did in it.
#[derive(Debug, Clone)]
pub struct PressFrames {
    /// Frames in time order.
    pub frames: Vec<Frame>,
    /// Course of the force, for a press that reached its target.
    pub course: Option<PressCourse>,
    /// Bounces, for a drop.
    pub bounces: Vec<Bounce>,
}

/// Plateau of a press with the default course: frames 500 to 650 of the recordings, as shares of the duration.
const PLATEAU: [f64; 2] = [0.5, 0.65];

/// Runs press or drop number `index` of `scene`.
///
/// # Errors
/// [`TwinError`] when the mechanics fail.
pub fn press_frames(scene: &Scene, index: usize) -> Result<PressFrames, TwinError> {
    let mut world = World::repeat(scene, index)?;
    let frames = world.frames().collect::<Result<Vec<Frame>, _>>()?;
    let course = match scene.task() {
        Task::Press(press) => {
            let plateau_s = PLATEAU.map(|share| share * press.duration_s);
            PressCourse::of(&frames, press.force_n, plateau_s, scene.skin().cell_area_m2())
        }
        Task::Drop(_) => None,
    };
    Ok(PressFrames {
        course,
        bounces: world.bounces().to_vec(),
        frames,
    })
}
