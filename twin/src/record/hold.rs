//! The span of a simulated press in which the contact is steady.

use crate::scene::{PressConfig, Scene, Task};

/// Span of a recorded press in which the published evaluation takes the contact as steady, s: frames 500 to 700 of 100
/// measurements at 64.3 kHz.
const PUBLISHED_HOLD_S: [f64; 2] = [50_000.0 / 64_300.0, 70_000.0 / 64_300.0];

/// Span [start, end) of a press of `scene` in which the contact is steady, s; `None` for a drop. A press with the
/// default time course, which is that of the recorded presses, has the published span, so that skin and twin are scored
/// at the same instants.
#[must_use]
pub fn hold_s(scene: &Scene) -> Option<[f64; 2]> {
    let Task::Press(press) = scene.task() else {
        return None;
    };
    let course = |p: &PressConfig| {
        [
            p.duration_s,
            p.onset_s,
            p.onset_spread_s,
            p.rise_s,
            p.lift_s,
            p.lift_spread_s,
        ]
    };
    let default = course(&PressConfig::default()).map(f64::to_bits);
    if course(press).map(f64::to_bits) == default {
        Some(PUBLISHED_HOLD_S)
    } else {
        Some(press.plateau_s())
    }
}
