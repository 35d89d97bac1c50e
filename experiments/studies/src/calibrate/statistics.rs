//! Robust statistics, moments, quantiles and the error of a mean.

use serde::Serialize;
use spts_circuit::Recording;
use spts_recon::metrics::median;
use spts_recon::statistics::quantile;

/// 1/Φ⁻¹(3/4): the median absolute value of a centred Gaussian times this is its standard deviation.
const MAD_TO_SD: f64 = 1.482_602_218_505_602;

/// Standard deviation of the core of `values` about 0, from the median absolute value; NaN does not count. `None`
/// without a finite value.
pub(super) fn robust_sd(values: &[f64]) -> Option<f64> {
    let absolute: Vec<f64> = values.iter().filter(|v| v.is_finite()).map(|v| v.abs()).collect();
    median(&absolute).map(|m| MAD_TO_SD * m)
}

/// Mean of the finite values of `values`; 0 without one.
pub(super) fn mean(values: &[f64]) -> f64 {
    let finite = values.iter().filter(|v| v.is_finite());
    finite.clone().sum::<f64>() / finite.count().max(1) as f64
}

/// Root mean square of the finite values about their mean.
pub(super) fn sd(values: &[f64]) -> f64 {
    let centre = mean(values);
    let squares: Vec<f64> = values.iter().map(|v| (v - centre).powi(2)).collect();
    mean(&squares).sqrt()
}

/// Fourth moment about the mean over the squared second; 3 for a Gaussian, 0 for a constant.
pub(super) fn kurtosis(values: &[f64]) -> f64 {
    let (centre, spread) = (mean(values), sd(values));
    let fourth: Vec<f64> = values.iter().map(|v| (v - centre).powi(4)).collect();
    if spread > 0.0 { mean(&fourth) / spread.powi(4) } else { 0.0 }
}

/// Quantiles of the finite values at (k + ½)/`count`, by linear interpolation between order statistics. Empty without
/// values.
pub fn quantiles(values: &[f64], count: usize) -> Vec<f64> {
    let mut sorted = finite(values);
    sorted.sort_unstable_by(f64::total_cmp);
    (0..count).filter_map(|k| quantile(&sorted, (k as f64 + 0.5) / count as f64)).collect()
}

/// A number with its uncertainty.
///
/// ```
/// use spts_studies::calibrate::Estimated;
///
/// let lsb_mv = Estimated::median_of(&[21.5, 21.4, 21.6, 21.5, 90.0]); // one press went wrong
/// assert_eq!(lsb_mv.value, 21.5);
/// assert!(lsb_mv.standard_error.expect("five presses") < 0.2);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimated {
    /// Median over the presses of a session, or mean over sessions.
    pub value: f64,
    /// Standard error of the value; `None` for fewer than two presses or sessions.
    pub standard_error: Option<f64>,
    /// Number of presses (or sessions).
    pub n: usize,
}

impl Estimated {
    /// Mean of `values` and its standard error s/√n, with the standard deviation s (n − 1 degrees of freedom). Values
    /// that are not finite are ignored.
    pub fn mean_of(values: &[f64]) -> Self {
        let values = finite(values);
        let n = values.len();
        Self {
            value: if n == 0 { f64::NAN } else { mean(&values) },
            standard_error: (n > 1).then(|| sd(&values) / (n as f64 - 1.0).sqrt()),
            n,
        }
    }

    /// Median of `values`, which is robust against a few outliers, and its standard error √(π/2)·s/√n for Gaussian
    /// values, with s from the median distance to the median. Values that are not finite are ignored.
    pub fn median_of(values: &[f64]) -> Self {
        let values = finite(values);
        let n = values.len();
        let middle = median(&values).unwrap_or(f64::NAN);
        let distances: Vec<f64> = values.iter().map(|v| v - middle).collect();
        let error = |s: f64| std::f64::consts::FRAC_PI_2.sqrt() * s / (n as f64).sqrt();
        Self { value: middle, standard_error: robust_sd(&distances).filter(|_| n > 1).map(error), n }
    }
}

/// The finite ones of `values`.
fn finite(values: &[f64]) -> Vec<f64> {
    values.iter().copied().filter(|v| v.is_finite()).collect()
}

/// Median of the finite ones of `values`; 0 without one.
pub(super) fn middle(values: &[f64]) -> f64 {
    median(&finite(values)).unwrap_or(0.0)
}

/// Grid of the values of a recording: y = `origin_v` + k·`step_v`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ConverterSteps {
    /// LSB, V: the largest step such that every difference of two values is a multiple of it.
    pub step_v: f64,
    /// One of the values, V.
    pub origin_v: f64,
}

/// Two differences agree when they are closer than this share of the range: rounding of the file's numbers.
const RELATIVE: f64 = 1e-9;
/// Most codes a converter may span.
const MOST_CODES: f64 = 16_777_216.0;

/// Steps of the values of the given blocks; `None` when they are not on a grid, or are all equal.
pub(super) fn steps(recording: &Recording, blocks: &[usize]) -> Option<ConverterSteps> {
    let mut values: Vec<f64> =
        blocks.iter().flat_map(|&block| &recording.blocks()[block].volts).copied().filter(|v| v.is_finite()).collect();
    values.sort_unstable_by(f64::total_cmp);
    values.dedup();
    let (first, last) = (*values.first()?, *values.last()?);
    let range = last - first;
    let rounding = RELATIVE * first.abs().max(last.abs());
    // Euclid's algorithm on the differences, rounding errors taken for 0
    let mut divisor = 0.0_f64;
    for pair in values.windows(2) {
        let (mut a, mut b) = (pair[1] - pair[0], divisor);
        while b > rounding {
            (a, b) = (b, a % b);
            b = if divisor > 0.0 && a - b < rounding { 0.0 } else { b };
        }
        if a > rounding {
            divisor = a;
        }
    }
    let codes = (range / divisor).round();
    // the whole range over its number of steps: the rounding of one difference does not matter
    (divisor > 0.0 && (1.0..=MOST_CODES).contains(&codes))
        .then(|| ConverterSteps { step_v: range / codes, origin_v: first })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use spts_circuit::{Block, RecordingInfo, Seeding, WeightMode, Weights};
    use spts_models::SkinLayout;

    #[test]
    fn moments_of_a_hand_counted_list() {
        let values = [1.0, -1.0, 1.0, -1.0, f64::NAN];
        assert_relative_eq!(sd(&values), 1.0);
        assert_relative_eq!(kurtosis(&values), 1.0);
        assert_relative_eq!(robust_sd(&values).unwrap(), MAD_TO_SD);
        for (found, expected) in quantiles(&[3.0, 1.0, 2.0], 3).into_iter().zip([4.0 / 3.0, 2.0, 8.0 / 3.0]) {
            assert_relative_eq!(found, expected);
        }
        assert!(quantiles(&[f64::NAN], 3).is_empty());
    }

    #[test]
    fn the_error_of_a_mean_has_one_degree_of_freedom_less() {
        // s² = ((−1)² + 0 + 1²)/2 = 1
        let estimate = Estimated::mean_of(&[1.0, 2.0, 3.0, f64::NAN]);
        assert_relative_eq!(estimate.value, 2.0);
        assert_relative_eq!(estimate.standard_error.unwrap(), 1.0 / 3_f64.sqrt(), max_relative = 1e-15);
        assert_eq!(Estimated::mean_of(&[2.0]).standard_error, None, "one value has no uncertainty");
        assert!(Estimated::mean_of(&[]).value.is_nan());
    }
    #[test]
    fn a_value_that_is_far_off_does_not_move_a_median() {
        let estimate = Estimated::median_of(&[1.0, 2.0, 3.0, f64::NAN, 4.0, -560.0]);
        assert_relative_eq!(estimate.value, 2.0);
        assert_eq!(estimate.n, 5);
        // distances 1, 0, 1, 2, 562: their median is 1
        let expected = (std::f64::consts::FRAC_PI_2 / 5.0).sqrt() * MAD_TO_SD;
        assert_relative_eq!(estimate.standard_error.unwrap(), expected, max_relative = 1e-15);
        assert_eq!(Estimated::median_of(&[2.0]).standard_error, None);
        assert!(Estimated::median_of(&[]).value.is_nan());
    }

    #[test]
    fn the_step_is_found_where_no_two_values_are_neighbours() {
        let lsb = 3.3 / 1023.0 * 11140.0 / 570.0;
        let volts: Vec<f64> = [10, 16, 25, 31, 100, 40].iter().map(|k| 32.0 - f64::from(*k) * lsb).collect();
        let block = |frame_position, volts| Block { frame_position, idle_frames: None, volts };
        // a press that is not asked for does not matter
        let other = (0..6).map(|k| 0.1 * lsb * f64::from(k)).collect();
        let blocks = vec![block(1, other), block(2, volts)];
        let layout = SkinLayout::new(2, 3, 15e-3, 10e-3).unwrap();
        let weights = Weights::new(WeightMode::Binary, Seeding::Address, 6);
        let recording = Recording::new(RecordingInfo::new(layout, weights, 64_300.0), blocks).unwrap();
        let found = steps(&recording, &[1]).unwrap();
        // differences 6, 9, 6, 9, 60 steps: gcd 3. Seven roundings of numbers near 32
        assert!((found.step_v - 3.0 * lsb).abs() < 1e-13, "{found:?}");
    }
}
