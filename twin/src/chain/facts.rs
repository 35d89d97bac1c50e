//! What a simulation knows of a press beside its recording.

use crate::session::{PressFacts, PressPose};
use spts_models::ConductanceMap;
use spts_sim::Frame;
use spts_sim::scene::{PressConfig, Scene, Task};

/// Span of a recorded press in which the published evaluation takes the contact as steady, s: frames 500 to 700 of 100 measurements at
/// 64.3 kHz.
const PUBLISHED_HOLD_S: [f64; 2] = [50_000.0 / 64_300.0, 70_000.0 / 64_300.0];

/// Span of a press of `scene` in which the contact is steady, s; `None` for a drop. A press with the default course, which is the
/// recorded one, has the published span, so that skin and twin are scored on the same instants.
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

/// Facts of one press or drop at the middle of its hold, or at the instant of its largest force. `maps` are the conductances at the
/// frames.
#[must_use]
pub fn press_facts(frames: &[Frame], maps: &[ConductanceMap], hold_s: Option<[f64; 2]>) -> PressFacts {
    let at = match hold_s {
        Some([start_s, end_s]) => frames.iter().position(|f| f.time_s >= 0.5 * (start_s + end_s)),
        None => {
            let force = |k: &usize| frames[*k].wrench.force_n[2];
            // the first of several
            (0..frames.len()).rev().max_by(|a, b| force(a).total_cmp(&force(b)))
        }
    };
    let Some(frame) = at.and_then(|at| frames.get(at)) else {
        return PressFacts::default();
    };
    PressFacts {
        time_s: Some(frame.time_s),
        pose: Some(PressPose {
            position_m: frame.pose.position_m,
            quaternion: frame.pose.quaternion,
        }),
        force_n: Some(frame.wrench.force_n[2]),
        pressure: Some(frame.pressure.clone()),
        conductance: at.and_then(|at| maps.get(at)).cloned(),
    }
}
