//! The simulation of one press of the arm or one drop of the ball, as a stream of frames.

mod ball;
mod course;
mod cover;
mod drop;
mod dynamics;
mod error;
pub mod ik;
pub(crate) mod model;
mod press;
mod quasi_static;
#[cfg(test)]
mod quasi_static_tests;
#[cfg(test)]
mod tests;
pub mod ur5;
pub(crate) mod visual;

pub use course::PressCourse;
pub use drop::Bounce;
pub use error::{MAX_PIXELS, SimError};
pub use model::MUJOCO_VERSION;

use crate::mechanics::{Mechanics, Task};
use cover::Cover;
use dynamics::Dynamics;
use quasi_static::QuasiStaticPress;
use spts_contact::Frame;

/// A press or drop of a scene, simulated from frame to frame.
///
/// MuJoCo simulates the dynamics, with the contact field's wrench as an external force. A contact field that computes
/// the pose under a given force ([`spts_contact::QuasiStatic`]) needs no dynamics: the force follows the same course in
/// time as in a press with dynamics, the field computes the pose at every frame, and there are no time steps.
pub struct World {
    scene: Mechanics,
    engine: Engine,
    cover: Option<Cover>,
    failed: bool,
}

enum Engine {
    Dynamics(Box<Dynamics>),
    QuasiStatic(Box<QuasiStaticPress>),
}

impl std::fmt::Debug for World {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("World")
            .field("time_s", &self.time_s())
            .finish_non_exhaustive()
    }
}

impl World {
    /// The first press or drop of the scene.
    ///
    /// # Errors
    /// As [`World::repeat`].
    pub fn new(scene: &Mechanics) -> Result<Self, SimError> {
        Self::repeat(scene, 0)
    }

    /// Press or drop `index` of the scene. It depends only on the scene and `index`, so repeats can run in any order
    /// and in parallel.
    ///
    /// # Errors
    /// [`SimError`] if there is no such repeat, the arm cannot reach the place, or MuJoCo rejects the model.
    pub fn repeat(scene: &Mechanics, index: usize) -> Result<Self, SimError> {
        if index >= scene.repeats() {
            return Err(SimError::NoSuchPress {
                index,
                repeats: scene.repeats(),
            });
        }
        let mut field = scene.build_contact()?;
        let index = index as u64;
        let cover = Cover::new(scene, field.as_mut(), index);
        let engine = match (field.quasi_static().is_some(), scene.task()) {
            // a scene with such a field has a press
            (true, Task::Press(press)) => {
                Engine::QuasiStatic(Box::new(QuasiStaticPress::new(scene, press, index, field)?))
            }
            _ => Engine::Dynamics(Box::new(Dynamics::new(scene, index, field)?)),
        };
        Ok(Self {
            scene: scene.clone(),
            engine,
            cover,
            failed: false,
        })
    }

    /// The scene.
    #[must_use]
    pub fn scene(&self) -> &Mechanics {
        &self.scene
    }

    /// Time since the start, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        match &self.engine {
            Engine::Dynamics(dynamics) => dynamics.time_s(),
            Engine::QuasiStatic(press) => press.time_s(),
        }
    }

    /// Bounces of the ball so far; empty for a press.
    #[must_use]
    pub fn bounces(&self) -> &[Bounce] {
        match &self.engine {
            Engine::Dynamics(dynamics) => dynamics.bounces(),
            Engine::QuasiStatic(_) => &[],
        }
    }

    /// The first bounce of the ball, finished or not; `None` for a press. During the bounce only its start, speed and
    /// present peak are known.
    #[must_use]
    pub fn first_bounce(&self) -> Option<Bounce> {
        match &self.engine {
            Engine::Dynamics(dynamics) => dynamics.first_bounce(),
            Engine::QuasiStatic(_) => None,
        }
    }

    /// Generalised positions: of the arm, joint angles, rad; of the ball, centre, m, and quaternion. Without dynamics
    /// the joint angles are computed on request.
    #[must_use]
    pub fn positions(&self) -> Vec<f64> {
        match &self.engine {
            Engine::Dynamics(dynamics) => dynamics.data.qpos().to_vec(),
            Engine::QuasiStatic(press) => press.joints_rad().to_vec(),
        }
    }

    /// The remaining frames. The iterator ends after the last frame or the first error.
    pub fn frames(&mut self) -> impl Iterator<Item = Result<Frame, SimError>> + '_ {
        std::iter::from_fn(move || {
            if self.failed {
                return None;
            }
            let item = match &mut self.engine {
                Engine::Dynamics(dynamics) => dynamics.advance(),
                Engine::QuasiStatic(press) => press.advance(),
            }
            .transpose();
            let item = match &self.cover {
                None => item,
                Some(cover) => item.map(|frame| frame.map(|frame| cover.over(frame))),
            };
            self.failed = matches!(item, Some(Err(_)));
            item
        })
        .fuse()
    }
}

/// The dynamics of a scene as MuJoCo's XML (MJCF), for MuJoCo's own tools. Shapes are omitted, because the contact
/// field does not need them.
#[must_use]
pub fn mjcf(scene: &Mechanics) -> String {
    model::mjcf(scene, None)
}
