//! Pressure of the cover of a bent skin on the electrodes.

use crate::mechanics::{Mechanics, Task};
use spts_contact::{ContactField, Frame};

/// Pressure of the cover in one press.
#[derive(Debug, Clone)]
pub(super) struct Cover {
    /// Pressure on every taxel without a touch, Pa.
    rest_pa: Vec<f64>,
    /// Decrease of its logarithm at the full force, where a taxel is not touched.
    slack: Vec<f64>,
    /// The full force, N.
    force_n: f64,
}

impl Cover {
    /// The cover in press `index` of `scene`; puts `field` under its preload. `None` for a flat skin.
    pub(super) fn new(scene: &Mechanics, field: &mut dyn ContactField, index: u64) -> Option<Self> {
        let bend = scene.config().bend.as_ref()?;
        let Task::Press(press) = scene.task() else { return None };
        Some(Self {
            rest_pa: scene.preload(field, index)?,
            slack: bend.slack(scene.skin(), scene.seed(), index),
            force_n: press.force_n,
        })
    }

    /// `frame` with the cover's pressure on its electrodes. Under the body the cover is as taut as without it.
    pub(super) fn over(&self, mut frame: Frame) -> Frame {
        let share = frame.wrench.force_n[2] / self.force_n;
        let touched = frame.pressure.values().iter().map(|p| *p > 0.0);
        let covered = self.rest_pa.iter().zip(&self.slack).zip(touched);
        for (p, ((rest_pa, slack), touched)) in frame.electrode_pressure.values_mut().iter_mut().zip(covered) {
            *p += if touched {
                *rest_pa
            } else {
                rest_pa * (-slack * share).exp()
            };
        }
        frame
    }
}
