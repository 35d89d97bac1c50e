//! The simulation of one press of the arm or one drop of the ball, as a stream of frames.

pub mod arm;
mod drop;
mod dynamics;
pub(crate) mod model;
mod press;
mod quasi_static;
/// How far `of` the frames of the first press of `found` are from those of `expected`, the same press otherwise: the
/// root mean square of the differences over all frames, relative to that of `expected`.
///
/// # Errors
/// [`Refusal`] if either cannot be run.
pub(crate) fn apart(found: &Mechanics, expected: &Mechanics, of: fn(&Frame) -> &[f64]) -> Result<f64, Refusal> {
    let (mut found, mut expected) = (World::repeat(found, 0)?, World::repeat(expected, 0)?);
    let (mut off, mut whole) = (0.0, 0.0);
    for (found, expected) in found.frames().zip(expected.frames()) {
        let (found, expected) = (found?, expected?);
        for (p, q) in of(&found).iter().zip(of(&expected)) {
            off += (p - q).powi(2);
            whole += q * q;
        }
    }
    Ok(if whole > 0.0 { (off / whole).sqrt() } else { f64::INFINITY })
}

#[cfg(test)]
mod tests;

use crate::mechanics::{Mechanics, Task};
use dynamics::Dynamics;
use quasi_static::QuasiStaticPress;
use spts_contact::{ContactField, Frame};
use spts_input::Refusal;

pub use drop::Bounce;
pub use dynamics::no_pressure;
pub use press::{PressCourse, no_touch};

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
        f.debug_struct("World").field("time_s", &self.time_s()).finish_non_exhaustive()
    }
}

impl World {
    /// The first press or drop of the scene.
    ///
    /// # Errors
    /// As [`World::repeat`].
    pub fn new(scene: &Mechanics) -> Result<Self, Refusal> {
        Self::repeat(scene, 0)
    }

    /// Press or drop `index` of the scene. It depends only on the scene and `index`, so repeats can run in any order
    /// and in parallel.
    ///
    /// # Errors
    /// [`Refusal`] if there is no such repeat, the arm cannot reach the place, or MuJoCo rejects the model.
    pub fn repeat(scene: &Mechanics, index: usize) -> Result<Self, Refusal> {
        if index >= scene.repeats() {
            return Err(Refusal::new(format!("press {index} is outside [0, {})", scene.repeats())));
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
        Ok(Self { scene: scene.clone(), engine, cover, failed: false })
    }

    /// The scene.
    pub fn scene(&self) -> &Mechanics {
        &self.scene
    }

    /// Time since the start, s.
    pub fn time_s(&self) -> f64 {
        match &self.engine {
            Engine::Dynamics(dynamics) => dynamics.time_s(),
            Engine::QuasiStatic(press) => press.time_s(),
        }
    }

    /// Bounces that the ball has finished so far, in order of time; empty for a press.
    pub fn bounces(&self) -> &[Bounce] {
        match &self.engine {
            Engine::Dynamics(dynamics) => dynamics.bounces(),
            Engine::QuasiStatic(_) => &[],
        }
    }

    /// The first bounce of the ball, finished or not; `None` for a press. During the bounce only its start, speed and
    /// present peak are known.
    pub fn first_bounce(&self) -> Option<Bounce> {
        match &self.engine {
            Engine::Dynamics(dynamics) => dynamics.first_bounce(),
            Engine::QuasiStatic(_) => None,
        }
    }

    /// Generalised positions: of the arm, joint angles, rad; of the ball, centre, m, and quaternion. Without dynamics
    /// the joint angles are computed on request.
    pub fn positions(&self) -> Vec<f64> {
        match &self.engine {
            Engine::Dynamics(dynamics) => dynamics.data.qpos().to_vec(),
            Engine::QuasiStatic(press) => press.joints_rad().to_vec(),
        }
    }

    /// The remaining frames. The iterator ends after the last frame or the first error.
    pub fn frames(&mut self) -> impl Iterator<Item = Result<Frame, Refusal>> + '_ {
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

/// Pressure of the cover in one press.
#[derive(Debug, Clone)]
struct Cover {
    /// Pressure on every taxel without a touch, Pa.
    rest_pa: Vec<f64>,
    /// Decrease of its logarithm at the full force, where a taxel is not touched.
    slack: Vec<f64>,
    /// The full force, N.
    force_n: f64,
}

impl Cover {
    /// The cover in press `index` of `scene`; puts `field` under its preload. `None` for a flat skin.
    fn new(scene: &Mechanics, field: &mut dyn ContactField, index: u64) -> Option<Self> {
        let bend = scene.config().bend.as_ref()?;
        let Task::Press(press) = scene.task() else { return None };
        Some(Self {
            rest_pa: scene.preload(field, index)?,
            slack: bend.slack(scene.skin(), scene.seed(), index),
            force_n: press.force_n,
        })
    }

    /// `frame` with the cover's pressure on its electrodes. Under the body the cover is as taut as without it.
    fn over(&self, mut frame: Frame) -> Frame {
        let share = frame.wrench.force_n[2] / self.force_n;
        let touched = frame.pressure.values().iter().map(|p| *p > 0.0);
        let covered = self.rest_pa.iter().zip(&self.slack).zip(touched);
        for (p, ((rest_pa, slack), touched)) in frame.electrode_pressure.values_mut().iter_mut().zip(covered) {
            *p += if touched { *rest_pa } else { rest_pa * (-slack * share).exp() };
        }
        frame
    }
}

/// The dynamics of a scene as MuJoCo's XML (MJCF), for MuJoCo's own tools. Shapes are omitted, because the contact
/// field does not need them.
pub fn mjcf(scene: &Mechanics) -> String {
    model::mjcf(scene, None)
}
