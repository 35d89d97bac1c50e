//! Estimates from one press.

use super::design::Reseeded;
use super::fit::{FitRequest, FitWindow, WINDOW_FRAMES, fit_windows};
use super::late::{Counts, Late};
use super::memory::{TAPS, taps, without_memory};
use super::overdriven::Overdriven;
use super::statistics::{OUTLIER_SD, kurtosis, mean, robust_sd, sd};
use spts_circuit::Recording;
use std::ops::Range;

/// Estimates from one press, in V unless stated otherwise. "Residual" is the residual of a least-squares fit of image
/// and constant on the plateau. "Clean" is the residual minus memory, and minus the contributions of cells that are not
/// binary.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct PressNumbers {
    /// Mean with nothing on the skin.
    pub idle_mean_v: f64,
    /// Standard deviation with nothing on the skin.
    pub idle_sd_v: f64,
    /// Noise floor: standard deviation with nothing on the skin, after subtracting image, constant and parity of the
    /// row.
    pub idle_noise_v: f64,
    /// Half the difference between even and odd rows with nothing on the skin.
    pub idle_parity_v: f64,
    /// Σx with nothing on the skin.
    pub idle_sum_v: f64,
    /// Root mean square of the residual.
    pub residual_v: f64,
    /// Root mean square of the clean residual.
    pub clean_v: f64,
    /// Standard deviation of the clean residual's core, from the median absolute value.
    pub core_v: f64,
    /// First tap of the memory.
    pub h1: f64,
    /// Second tap.
    pub h2: f64,
    /// Third tap.
    pub h3: f64,
    /// Constant c of the fit.
    pub offset_v: f64,
    /// Half the difference between even and odd rows.
    pub parity_v: f64,
    /// Σx.
    pub sum_v: f64,
    /// ‖x‖₂.
    pub norm_v: f64,
    /// Constant part of the drive offset: c = (1 + h1 + h2)·(constant + asymmetry·Σx), with and without contact; 1 + h1
    /// + h2 is the memory's gain for constant signals. NaN without contact.
    pub constant_v: f64,
    /// Part of the drive offset that is proportional to Σx: (c − idle c)/((1 + h1 + h2)·(Σx − idle Σx)). NaN without
    /// contact.
    pub asymmetry: f64,
    /// Share of clean residuals beyond 5 standard deviations of the core.
    pub outliers: f64,
    /// Kurtosis of the clean residual.
    pub kurtosis: f64,
    /// Late updates divided by flips.
    pub late_per_flip: f64,
    /// Share of outliers that are not late updates.
    pub unexplained: f64,
    /// Noise that grows with the contact, relative to ‖x‖₂: √(core² − idle noise²)/‖x‖₂. NaN without contact.
    pub contact_fraction: f64,
}

/// One press, analysed.
#[derive(Debug, Clone)]
pub(super) struct PressAnalysis {
    /// Its numbers.
    pub(super) numbers: PressNumbers,
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
    let ask = FitRequest {
        block,
        reseeded,
        parity: true,
    };
    let idle_frames = recording.blocks()[block].idle_frames?;
    let idle = fit_windows(recording, ask, 0..idle_frames, idle_frames).pop()?;
    let windows = fit_windows(recording, ask, hold.clone(), WINDOW_FRAMES);
    let taxels = windows.first()?.image.len();
    let whole = |window: &FitWindow| {
        let left_over = window.left_over;
        // what the fit took out of the noise is put back: every window then has the noise's own standard deviation
        move |v: f64| v / left_over
    };
    let residual_v: Vec<f64> = windows
        .iter()
        .flat_map(|w| w.residual_v.iter().copied().map(whole(w)))
        .collect();
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
    let idle_noise_v = sd(&idle.residual_v) / idle.left_over;
    let numbers = PressNumbers {
        idle_mean_v: mean(idle_volts),
        idle_sd_v: sd(idle_volts),
        idle_noise_v,
        idle_parity_v: idle.parity_v,
        idle_sum_v: idle.image.iter().sum(),
        residual_v: sd(&residual_v),
        clean_v: sd(&clean_v),
        core_v,
        h1: taps[0],
        h2: taps[1],
        h3: taps[2],
        offset_v: over_windows(&|w| w.offset_v),
        parity_v: over_windows(&|w| w.parity_v),
        sum_v: image.iter().sum(),
        norm_v: image.iter().map(|x| x * x).sum::<f64>().sqrt(),
        constant_v: f64::NAN,
        asymmetry: f64::NAN,
        outliers: share_beyond(&clean_v, OUTLIER_SD * core_v),
        kurtosis: kurtosis(&clean_v),
        late_per_flip: late.per_flip(),
        unexplained: late.unexplained(),
        contact_fraction: f64::NAN,
    };
    Some(PressAnalysis {
        numbers: with_ratios(numbers, &idle),
        image,
        late: late.cells(),
        events: late.events,
        clean_v,
    })
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

/// Fills in the numbers that need contact: the press must raise Σx, and reach an ‖x‖₂, by more than the noise of one
/// measurement.
fn with_ratios(n: PressNumbers, idle: &FitWindow) -> PressNumbers {
    let raised_v = n.sum_v - n.idle_sum_v;
    if raised_v <= n.core_v || n.norm_v <= n.core_v {
        return n;
    }
    // the drive's offset comes before the memory, c after it
    let passed = 1.0 + n.h1 + n.h2;
    let asymmetry = (n.offset_v - idle.offset_v) / (passed * raised_v);
    PressNumbers {
        asymmetry,
        constant_v: idle.offset_v / passed - asymmetry * n.idle_sum_v,
        contact_fraction: (n.core_v.powi(2) - n.idle_noise_v.powi(2)).max(0.0).sqrt() / n.norm_v,
        ..n
    }
}

/// Share of the finite `values` whose absolute value is beyond `limit`.
fn share_beyond(values: &[f64], limit: f64) -> f64 {
    let beyond: Vec<f64> = values
        .iter()
        .filter(|v| v.is_finite())
        .map(|v| f64::from(v.abs() > limit))
        .collect();
    mean(&beyond)
}
