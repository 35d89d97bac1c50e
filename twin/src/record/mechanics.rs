//! The mechanics of one press or drop.

use super::error::TwinError;
use crate::scene::{Scene, Task};
use spts_contact::Frame;
use spts_sim::World;
use spts_sim::world::{Bounce, PressCourse};

/// Frames of one press or drop, and what the mechanics did.
#[derive(Debug, Clone)]
pub struct PressFrames {
    /// Frames in time order.
    pub frames: Vec<Frame>,
    /// Time course of the force, for a press that reached its target.
    pub course: Option<PressCourse>,
    /// Bounces, for a drop.
    pub bounces: Vec<Bounce>,
}

impl PressFrames {
    /// Largest relative difference |force − Σ p·A| / force over all frames; see [`Frame::imbalance`].
    #[must_use]
    pub fn imbalance(&self, cell_area_m2: f64) -> f64 {
        self.frames
            .iter()
            .map(|f| f.imbalance(cell_area_m2))
            .fold(0.0, f64::max)
    }
}

/// Runs press or drop number `index` of `scene`.
///
/// # Errors
/// [`TwinError`] if the mechanics fail.
pub fn press_frames(scene: &Scene, index: usize) -> Result<PressFrames, TwinError> {
    let mut world = World::repeat(scene.mechanics(), index)?;
    let frames = world.frames().collect::<Result<Vec<Frame>, _>>()?;
    let course = match scene.task() {
        Task::Press(press) => PressCourse::of(&frames, press.force_n, press.plateau_s(), scene.skin().cell_area_m2()),
        Task::Drop(_) => None,
    };
    Ok(PressFrames {
        course,
        bounces: world.bounces().to_vec(),
        frames,
    })
}
