//! Images of a press by least squares, window by window: y = Φx + c.

use super::design::{Design, Reseeded};
use super::statistics::{OUTLIER_SD, robust_sd};
use spts_circuit::Recording;
use std::ops::Range;

/// Number of frames in a window. An image of 100 taxels from 2500 measurements has a noise of σ/√2500 a taxel, which
/// adds 4 % to the variance of the predicted output. During 25 frames (39 ms) creep changes the image by less than
/// that.
pub const WINDOW_FRAMES: usize = 25;

/// One window and what was fitted to it.
#[derive(Debug, Clone)]
pub(crate) struct FitWindow {
    /// Row of its first measurement.
    pub(crate) first_row: u64,
    /// Weights.
    pub(crate) design: Design,
    /// Image, V a taxel.
    pub(crate) image: Vec<f64>,
    /// Constant c, V.
    pub(crate) offset_v: f64,
    /// Half the difference between even and odd rows, V; 0 if it was not fitted.
    pub(crate) parity_v: f64,
    /// y − Φx − c, V; NaN for a lost sample.
    pub(crate) residual_v: Vec<f64>,
    /// Φx, V.
    pub(crate) model_v: Vec<f64>,
    /// √(1 − p/n): share of the noise that remains in the residual when p coefficients are fitted to n measurements.
    pub(crate) left_over: f64,
}

/// What is fitted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FitRequest<'a> {
    /// Block of the recording.
    pub(crate) block: usize,
    /// Cells with another seed.
    pub(crate) reseeded: &'a [Reseeded],
    /// Whether even and odd rows may differ.
    pub(crate) parity: bool,
}

/// Fits windows of `window` frames within `frames`; twice, the second time without the outliers of the first. A window
/// that does not determine its image is left out.
pub(crate) fn fit_windows(
    recording: &Recording,
    ask: FitRequest<'_>,
    frames: Range<usize>,
    window: usize,
) -> Vec<FitWindow> {
    let per_frame = recording.measurements_per_frame();
    let volts = &recording.blocks()[ask.block].volts;
    let starts = frames
        .clone()
        .step_by(window.max(1))
        .filter(|start| start + window <= frames.end);
    starts
        .filter_map(|start| {
            let measurements = start * per_frame..(start + window) * per_frame;
            let rows = recording.rows(ask.block, measurements.clone());
            let design = Design::new(rows, ask.reseeded, ask.parity)?;
            fit(design, &volts[measurements], recording.taxels(), rows.first_row())
        })
        .collect()
}

fn fit(design: Design, y: &[f64], taxels: usize, first_row: u64) -> Option<FitWindow> {
    let finite: Vec<bool> = y.iter().map(|v| v.is_finite()).collect();
    let first = design.solve(y, &finite)?;
    let residual = |coefficients: &[f64]| -> Vec<f64> {
        let model = design.apply(coefficients);
        y.iter().zip(model).map(|(y, m)| y - m).collect()
    };
    let rough = residual(&first);
    let limit = OUTLIER_SD * robust_sd(&rough)?;
    // a residual of exactly 0 is kept: a noiseless recording has a limit of 0
    let kept: Vec<bool> = rough.iter().map(|r| r.abs() <= limit.max(f64::MIN_POSITIVE)).collect();
    let coefficients = design.solve(y, &kept).unwrap_or(first);
    let left_over = (1.0 - design.columns() as f64 / design.len() as f64).max(0.0).sqrt();
    Some(FitWindow {
        first_row,
        residual_v: residual(&coefficients),
        model_v: design.apply(&coefficients[..taxels]),
        image: coefficients[..taxels].to_vec(),
        offset_v: coefficients[taxels],
        parity_v: coefficients.get(taxels + 1).copied().unwrap_or(0.0),
        left_over,
        design,
    })
}
