//! Presses that missed: almost no contact, while the others of the session have one.

use super::press::PressNumbers;
use serde::Serialize;
use spts_recon::metrics::median;
use std::fmt;

/// A press below this share of the session's median has missed. A first press, whose sheet is not conditioned yet, has
/// 0.64 and more of the later ones.
const LEAST_SHARE: f64 = 1.0 / 3.0;

/// A press that is left out of the calibration, because the object has almost missed the skin, while the other presses
/// of the session have a contact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MissedPress {
    /// Number of the press, from 1.
    pub press: usize,
    /// Σx minus the idle Σx, V.
    pub raised_v: f64,
    /// Median of `raised_v` over the presses of the session, V.
    pub usual_raised_v: f64,
    /// ‖x‖₂, V.
    pub norm_v: f64,
    /// Median of `norm_v` over the presses of the session, V.
    pub usual_norm_v: f64,
}

impl fmt::Display for MissedPress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "press {} missed and is left out: Σx {:.2} V where the session's median is {:.2} V, ‖x‖₂ {:.2} V where it is {:.2} V",
            self.press, self.raised_v, self.usual_raised_v, self.norm_v, self.usual_norm_v
        )
    }
}

/// Those of `presses` (block and numbers) that missed: Σx above idle, or ‖x‖₂, is below a third of the session's
/// median. None where the median press has no contact: it must raise either by more than the noise of one measurement.
pub(super) fn missed(presses: &[(usize, PressNumbers)]) -> Vec<MissedPress> {
    let middle = |get: fn(&PressNumbers) -> f64| {
        let values: Vec<f64> = presses.iter().map(|(_, p)| get(p)).collect();
        median(&values).unwrap_or(0.0)
    };
    let raised = |p: &PressNumbers| p.sum_v - p.idle_sum_v;
    let (usual_raised_v, usual_norm_v, noise_v) = (middle(raised), middle(|p| p.norm_v), middle(|p| p.core_v));
    if usual_raised_v <= noise_v || usual_norm_v <= noise_v {
        return Vec::new();
    }
    let weak = |p: &PressNumbers| raised(p) < LEAST_SHARE * usual_raised_v || p.norm_v < LEAST_SHARE * usual_norm_v;
    let each = presses.iter().filter(|(_, p)| weak(p));
    each.map(|(block, p)| MissedPress {
        press: block + 1,
        raised_v: raised(p),
        usual_raised_v,
        norm_v: p.norm_v,
        usual_norm_v,
    })
    .collect()
}
