//! Settling time of a second-order step response.

use super::decay::Decay;
use super::root::crossing;
use std::f64::consts::PI;

/// Time from which on the error of the step response stays within `fraction` in (0, 1): the last solution of |e(t)| =
/// fraction for e″ − 2σe′ + (σ² − δ)e = 0, e(0) = 1, e′(0) = 0.
///
/// Where it rings, the error has its extrema at kπ/ω with the sizes e^(σkπ/ω), and the time follows the last extremum
/// that is too large; where it does not, the error falls steadily.
pub(super) fn settle_s(decay: &Decay, fraction: f64) -> f64 {
    let error = |t: f64| decay.value(1.0, 0.0, t);
    // not a shrinking fraction, or one that has no logarithm
    let time_constants = (1.0 / fraction.clamp(f64::MIN_POSITIVE, 1.0)).ln();
    if let Some(turning) = decay.turning() {
        let half_turn_s = PI / turning;
        let last = (time_constants / (-decay.sigma() * half_turn_s)).floor();
        let sign = error(last * half_turn_s).signum();
        return crossing(
            &|t| sign * error(t) - fraction,
            last * half_turn_s,
            (last + 1.0) * half_turn_s,
        );
    }
    // e(t) ≤ (1 + |slow| t) e^(−|slow| t), which is below e^(−x) from |slow| t = 2x + 2 on
    let longest_s = (2.0 * time_constants + 2.0) / decay.slowest_per_s();
    crossing(&|t| error(t) - fraction, 0.0, longest_s)
}
