//! What a recording of touches says of the preload and of the touches.

use serde::Serialize;
use spts_circuit::Recording;
use spts_eval::place::{RecordedTouch, find_touches, touch_errors_px};
use spts_recon::metrics::{median, pearson};

/// A taxel of which an untouched skin gives more than this is loaded, V: five times what 2000 measurements with a noise
/// of 0.15 V leave of a taxel, and a fifth of the largest of the published skin.
pub const LOADED_V: f64 = 0.1;

/// Numbers of measurements at which touches are located.
pub const MEASUREMENTS: [usize; 3] = [7, 10, 25];

/// Numbers of one recording.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TouchStatistics {
    /// Touches that were found.
    pub touches: usize,
    /// Taxels above [`LOADED_V`] without a touch, mean over the blocks.
    pub loaded_taxels: f64,
    /// Sum of the image without a touch, V, mean over the blocks.
    pub rest_sum_v: f64,
    /// Its largest taxel, V, mean over the blocks.
    pub rest_largest_v: f64,
    /// Correlation of the images without a touch of a block and the next, mean over the blocks.
    pub rest_correlation: f64,
    /// Share of that sum that the loaded taxels lose in a touch, median over the touches.
    pub rest_lost: f64,
    /// Largest taxel of a touch, V, without the preload; median over the touches.
    pub touch_v: f64,
    /// Share of the sum of squares of a touch that its largest taxel has, median over the touches.
    pub touch_in_one: f64,
    /// Distance of the located from the touched taxel, taxels, mean over windows of the numbers of [`MEASUREMENTS`].
    pub errors_px: [f64; MEASUREMENTS.len()],
}

/// Label, unit and value of a number.
pub type StatisticOf = (&'static str, &'static str, fn(&TouchStatistics) -> f64);

/// Every number that is compared.
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
    /// Numbers of `recording`, whose blocks begin without a touch; `None` when no touch of a skin under preload is
    /// found.
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

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}
