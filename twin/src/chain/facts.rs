//! What a simulation knows about a press beside its recording.

use crate::session::{PressFacts, PressPose};
use spts_contact::Frame;
use spts_models::ConductanceMap;

/// Facts about one press or drop at the middle of its hold or, without a hold, at the instant of the largest force.
/// `maps` are the conductances at `frames`.
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
