//! Statistics of a recording of touches: preload and touches.

use serde::Serialize;
use spts_circuit::Recording;
use spts_eval::place::{RecordedTouch, find_touches, touch_errors_px};
use spts_recon::metrics::{median, pearson};
use spts_recon::statistics::mean;

/// Output above which a taxel of an untouched skin counts as loaded, V: five times the error of a taxel estimated from
/// 2000 measurements with a noise of 0.15 V, and a fifth of the largest value on the published skin.
pub const LOADED_V: f64 = 0.1;

/// Numbers of measurements for locating touches.
pub const MEASUREMENTS: [usize; 3] = [7, 10, 25];

/// How a bent skin, recorded while a finger touches it, answers: its output without a touch, the size of a touch, and
/// how far from the touched taxel the touch is located.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TouchStatistics {
    /// Number of touches found.
    pub touches: usize,
    /// Number of taxels above [`LOADED_V`] without a touch, mean over the blocks.
    pub loaded_taxels: f64,
    /// Sum of the image without a touch, V, mean over the blocks.
    pub rest_sum_v: f64,
    /// Largest taxel without a touch, V, mean over the blocks.
    pub rest_largest_v: f64,
    /// Correlation of the images without a touch of consecutive blocks, mean over the blocks.
    pub rest_correlation: f64,
    /// Share of `rest_sum_v` that the loaded taxels lose during a touch, median over the touches.
    pub rest_lost: f64,
    /// Largest taxel of a touch minus the preload, V, median over the touches.
    pub touch_v: f64,
    /// Share of the largest taxel in the sum of squares of a touch, median over the touches.
    pub touch_in_one: f64,
    /// Distance of the located from the touched taxel, taxels, mean over the windows, for each of [`MEASUREMENTS`].
    pub errors_px: [f64; MEASUREMENTS.len()],
}

/// Label, unit and value of a statistic.
pub type StatisticOf = (&'static str, &'static str, fn(&TouchStatistics) -> f64);

/// All statistics that are compared.
pub const STATISTICS: [StatisticOf; 10] = [
    ("loaded taxels at rest", "", |s| s.loaded_taxels),
    ("sum at rest", "V", |s| s.rest_sum_v),
    ("largest taxel at rest", "V", |s| s.rest_largest_v),
    ("rest, block to block", "r", |s| s.rest_correlation),
    ("rest, lost in a touch", "share", |s| s.rest_lost),
    ("touch, largest taxel", "V", |s| s.touch_v),
    ("touch in one taxel", "share", |s| s.touch_in_one),
    ("located at M = 7", "px", |s| s.errors_px[0]),
    ("located at M = 10", "px", |s| s.errors_px[1]),
    ("located at M = 25", "px", |s| s.errors_px[2]),
];

impl TouchStatistics {
    /// Statistics of `recording`, whose blocks must begin without a touch; `None` if no touch of a skin under preload
    /// is found.
    #[must_use]
    pub fn of(recording: &Recording) -> Option<Self> {
        let touches = find_touches(recording);
        let rest: Vec<&Vec<f64>> = touches.iter().filter_map(|t| t.untouched.image.as_ref()).collect();
        let changes: Vec<Vec<f64>> = touches
            .iter()
            .filter_map(|t: &RecordedTouch| t.image(recording))
            .collect();
        let over_rest = |of: &dyn Fn(&Vec<f64>) -> f64| mean(rest.iter().map(|image| of(image)));
        let over_touches = |of: &dyn Fn(&Vec<f64>) -> f64| median(&changes.iter().map(of).collect::<Vec<_>>());
        let lost: Vec<f64> = touches.iter().filter_map(|touch| lost(touch, recording)).collect();
        let errors = touch_errors_px(recording, &touches, &MEASUREMENTS);
        let errors: Vec<f64> = errors.into_iter().collect::<Option<_>>()?;
        Some(Self {
            touches: touches.len(),
            loaded_taxels: over_rest(&|image| image.iter().filter(|v| **v > LOADED_V).count() as f64)?,
            rest_sum_v: over_rest(&|image| image.iter().sum())?,
            rest_largest_v: over_rest(&|image| largest(image))?,
            rest_correlation: mean(rest.windows(2).filter_map(|pair| pearson(pair[0], pair[1])))?,
            rest_lost: median(&lost)?,
            touch_v: over_touches(&|image| largest(image))?,
            touch_in_one: over_touches(&|image| largest(image).powi(2) / image.iter().map(|v| v * v).sum::<f64>())?,
            errors_px: errors.try_into().ok()?,
        })
    }
}

/// Share of the sum of the loaded taxels that those which are not touched lose in `touch`.
fn lost(touch: &RecordedTouch, recording: &Recording) -> Option<f64> {
    let (rest, change) = (touch.untouched.image.as_ref()?, touch.image(recording)?);
    let touched = touch.taxel(recording)?;
    let loaded = |k: &usize| *k != touched && rest[*k] > LOADED_V;
    let sum = |of: &[f64]| (0..of.len()).filter(loaded).map(|k| of[k]).sum::<f64>();
    let loaded_v = sum(rest);
    (loaded_v > 0.0).then(|| -sum(&change) / loaded_v)
}

fn largest(image: &[f64]) -> f64 {
    image.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}
