//! Estimates from one press.

use super::cells::Overdriven;
use super::late::{Counts, Late};
use super::statistics::{kurtosis, mean, robust_sd, sd};
use super::windows::{FitWindow, OUTLIER_SD, Reseeded, TAPS, WINDOW_FRAMES, fit_windows, taps, without_memory};
use serde::Serialize;
use spts_circuit::Recording;
use spts_recon::metrics::median;
use std::collections::BTreeMap;
use std::ops::Range;

/// Every number of a press: its name and its unit.
///
/// "Residual" is the residual of a least-squares fit of image and constant on the plateau. "Clean" is the residual
/// minus memory, and minus the contributions of cells that are not binary. The numbers of the drive offset and the
/// contact's noise are NaN without contact.
pub const NUMBERS: [(&str, &str); 22] = [
    // mean and standard deviation with nothing on the skin
    ("idle_mean", "V"),
    ("idle_sd", "V"),
    // the latter after subtracting image, constant and parity of the row: the noise floor
    ("idle_noise", "V"),
    // half the difference between even and odd rows, and Σx, with nothing on the skin
    ("idle_parity", "V"),
    ("idle_sum", "V"),
    // root mean squares
    ("residual", "V"),
    ("clean_residual", "V"),
    // standard deviation of the clean residual's core, from the median absolute value
    ("core_residual", "V"),
    // taps of the memory
    ("h1", ""),
    ("h2", ""),
    ("h3", ""),
    // the constant c of the fit, half the difference between even and odd rows, Σx and ‖x‖₂
    ("offset", "V"),
    ("parity", "V"),
    ("sum", "V"),
    ("norm", "V"),
    // the drive offset: c = (1 + h1 + h2)·(constant + asymmetry·Σx), with and without contact; 1 + h1 + h2 is the
    // memory's gain for constant signals
    ("constant", "V"),
    ("asymmetry", ""),
    // share of clean residuals beyond 5 standard deviations of the core, and the residuals' kurtosis
    ("outliers_5sd", ""),
    ("kurtosis", ""),
    // late updates divided by flips, and the share of outliers that are no late updates
    ("late_per_flip", ""),
    ("unexplained_outliers", ""),
    // noise that grows with the contact, relative to ‖x‖₂: √(core² − idle noise²)/‖x‖₂
    ("contact_fraction", ""),
];

/// One press, analysed.
#[derive(Debug, Clone)]
pub(super) struct PressAnalysis {
    /// The values of [`NUMBERS`].
    pub(super) numbers: BTreeMap<&'static str, f64>,
    /// Mean image of the plateau, V.
    pub(super) image: Vec<f64>,
    /// Flips and late flips of every taxel.
    pub(super) late: Vec<Counts>,
    /// Late flips: taxel and row.
    pub(super) events: Vec<(usize, u64)>,
    /// Clean residual, V.
    pub(super) clean_v: Vec<f64>,
}

/// Analyses one press, steady in the frames `hold`; `None` when they do not determine an image.
pub(super) fn analyse(
    recording: &Recording,
    hold: &Range<usize>,
    block: usize,
    reseeded: &[Reseeded],
    overdriven: &[Overdriven],
) -> Option<PressAnalysis> {
    let fit = |frames, window| fit_windows(recording, block, reseeded, true, frames, window);
    let idle_frames = recording.blocks()[block].idle_frames?;
    let idle = fit(0..idle_frames, idle_frames).pop()?;
    let windows = fit(hold.clone(), WINDOW_FRAMES);
    let taxels = windows.first()?.image.len();
    let whole = |window: &FitWindow| {
        let left_over = window.left_over;
        // what the fit took out of the noise is put back: every window then has the noise's own standard deviation
        move |v: f64| v / left_over
    };
    let residual_v: Vec<f64> = windows.iter().flat_map(|w| w.residual_v.iter().copied().map(whole(w))).collect();
    let windows: Vec<FitWindow> = windows.into_iter().map(|w| without_overdriven(w, overdriven)).collect();
    let taps = taps(&windows);
    let mut clean_v = Vec::new();
    for window in &windows {
        let whole = whole(window);
        clean_v.extend(without_memory(window, taps).into_iter().map(whole));
    }
    let core_v = robust_sd(&clean_v)?;
    let over_windows = |get: &dyn Fn(&FitWindow) -> f64| mean(&windows.iter().map(get).collect::<Vec<_>>());
    let image: Vec<f64> = (0..taxels).map(|k| over_windows(&|w| w.image[k])).collect();
    let mut late = Late::new(core_v, taxels);
    let mut rest = clean_v.as_slice();
    for window in &windows {
        let (of_window, after) = rest.split_at(window.residual_v.len() - TAPS);
        late.add(window, of_window);
        rest = after;
    }
    let idle_volts = &recording.blocks()[block].volts[..idle_frames * recording.measurements_per_frame()];
    let (idle_noise_v, idle_sum_v) = (sd(&idle.residual_v) / idle.left_over, idle.image.iter().sum::<f64>());
    let (sum_v, norm_v) = (image.iter().sum::<f64>(), image.iter().map(|x| x * x).sum::<f64>().sqrt());
    let (offset_v, parity_v) = (over_windows(&|w| w.offset_v), over_windows(&|w| w.parity_v));
    let [h1, h2, h3] = taps;
    // the press must raise Σx, and reach an ‖x‖₂, by more than the noise of one measurement
    let raised_v = sum_v - idle_sum_v;
    let [constant_v, asymmetry, contact_fraction] = if raised_v > core_v && norm_v > core_v {
        // the drive's offset comes before the memory, c after it
        let passed = 1.0 + h1 + h2;
        let asymmetry = (offset_v - idle.offset_v) / (passed * raised_v);
        let constant_v = idle.offset_v / passed - asymmetry * idle_sum_v;
        let beyond_idle = (core_v.powi(2) - idle_noise_v.powi(2)).max(0.0).sqrt();
        [constant_v, asymmetry, beyond_idle / norm_v]
    } else {
        [f64::NAN; 3]
    };
    let numbers = BTreeMap::from([
        ("idle_mean", mean(idle_volts)),
        ("idle_sd", sd(idle_volts)),
        ("idle_noise", idle_noise_v),
        ("idle_parity", idle.parity_v),
        ("idle_sum", idle_sum_v),
        ("residual", sd(&residual_v)),
        ("clean_residual", sd(&clean_v)),
        ("core_residual", core_v),
        ("h1", h1),
        ("h2", h2),
        ("h3", h3),
        ("offset", offset_v),
        ("parity", parity_v),
        ("sum", sum_v),
        ("norm", norm_v),
        ("constant", constant_v),
        ("asymmetry", asymmetry),
        ("outliers_5sd", share_beyond(&clean_v, OUTLIER_SD * core_v)),
        ("kurtosis", kurtosis(&clean_v)),
        ("late_per_flip", late.per_flip()),
        ("unexplained_outliers", late.unexplained()),
        ("contact_fraction", contact_fraction),
    ]);
    Some(PressAnalysis { numbers, image, late: late.cells(), events: late.events, clean_v })
}

/// The window less what `cells` add beyond ±1.
fn without_overdriven(mut window: FitWindow, cells: &[Overdriven]) -> FitWindow {
    for cell in cells {
        let binary_v = window.image[cell.taxel as usize];
        let extra = cell.beyond_binary(binary_v, window.first_row, window.residual_v.len());
        window.residual_v.iter_mut().zip(extra).for_each(|(r, e)| *r -= e);
    }
    window
}

/// Share of the finite `values` whose absolute value is beyond `limit`.
fn share_beyond(values: &[f64], limit: f64) -> f64 {
    let beyond: Vec<f64> = values.iter().filter(|v| v.is_finite()).map(|v| f64::from(v.abs() > limit)).collect();
    mean(&beyond)
}

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

impl std::fmt::Display for MissedPress {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "press {} missed and is left out: Σx {:.2} V where the session's median is {:.2} V, ‖x‖₂ {:.2} V where it is {:.2} V",
            self.press, self.raised_v, self.usual_raised_v, self.norm_v, self.usual_norm_v
        )
    }
}

/// Those of `presses` (block and numbers) that missed: Σx above idle, or ‖x‖₂, is below a third of the session's
/// median. None where the median press has no contact: it must raise either by more than the noise of one measurement.
pub(super) fn missed(presses: &[(usize, PressAnalysis)]) -> Vec<MissedPress> {
    let middle = |get: &dyn Fn(&PressAnalysis) -> f64| {
        let values: Vec<f64> = presses.iter().map(|(_, p)| get(p)).collect();
        median(&values).unwrap_or(0.0)
    };
    let raised = |p: &PressAnalysis| p.numbers["sum"] - p.numbers["idle_sum"];
    let norm = |p: &PressAnalysis| p.numbers["norm"];
    let noise_v = middle(&|p| p.numbers["core_residual"]);
    let (usual_raised_v, usual_norm_v) = (middle(&raised), middle(&norm));
    if usual_raised_v <= noise_v || usual_norm_v <= noise_v {
        return Vec::new();
    }
    let weak = |p: &PressAnalysis| raised(p) < LEAST_SHARE * usual_raised_v || norm(p) < LEAST_SHARE * usual_norm_v;
    let each = presses.iter().filter(|(_, p)| weak(p));
    each.map(|(block, p)| MissedPress {
        press: block + 1,
        raised_v: raised(p),
        usual_raised_v,
        norm_v: norm(p),
        usual_norm_v,
    })
    .collect()
}
