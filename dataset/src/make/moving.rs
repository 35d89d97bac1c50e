//! Contacts that are simulated in time: an object pressed by the arm, or a falling ball.

use super::touch::Touch;
use spts_contact::Frame;
use spts_models::PressureMap;

/// One object or ball over time.
pub(super) struct Moving {
    pub(super) touch: Touch,
    /// Frames in order of time, which counts from the start of the simulation.
    pub(super) frames: Vec<Frame>,
    /// Time of the touch, s.
    pub(super) touch_s: f64,
}

impl Moving {
    /// Mean pressure over every taxel's cell at `time_s`, Pa, and the height of the object's origin, m; between two
    /// frames on a straight line, as the conductance is.
    pub(super) fn at(&self, time_s: f64) -> (PressureMap, f64) {
        let after = self.frames.partition_point(|frame| frame.time_s <= time_s);
        let first = &self.frames[after.saturating_sub(1)];
        let second = &self.frames[after.min(self.frames.len() - 1)];
        let apart_s = second.time_s - first.time_s;
        let share = if apart_s > 0.0 {
            ((time_s - first.time_s) / apart_s).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let mut pressure = first.pressure.clone();
        for (from, to) in pressure.values_mut().iter_mut().zip(second.pressure.values()) {
            *from += share * (to - *from);
        }
        let [from_m, to_m] = [first, second].map(|frame| frame.pose.position_m[2]);
        (pressure, from_m + share * (to_m - from_m))
    }
}

#[cfg(not(feature = "mujoco"))]
impl Moving {
    /// Refuses: there is no engine to follow anything with.
    pub(super) fn new(
        _: &crate::spec::Spec,
        _: &crate::spec::Choice,
        _: spts_models::Streams,
        _: u64,
    ) -> Result<Self, super::error::RowCause> {
        Err(super::error::RowCause::Engine)
    }
}
