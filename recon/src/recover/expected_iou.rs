//! Expected quality of an image under a Gaussian posterior.

use libm::erfc;
use std::f64::consts::FRAC_1_SQRT_2;

/// Intersection over union that the support of an image is expected to have with the true one.
///
/// The support S of the image holds the taxels above τ = `threshold`·max(image). With pᵢ = P(xᵢ > τ) by the normal
/// marginals of mean `mean` and deviation `scale`·√`variances`,
///
/// E\[IoU\] ≈ Σ_{i ∈ S} pᵢ / (|S| + Σ_{i ∉ S} pᵢ):
///
/// the expected intersection over the expected union. Three things are approximate: the ratio of expectations stands
/// for the expectation of the ratio, τ is that of the image and not of the true one, and the noise is Gaussian. An
/// image without a positive taxel has the answer 0.
pub(super) fn expected_iou(image: &[f64], mean: &[f64], variances: &[f64], scale: f64, threshold: f64) -> f64 {
    let level = threshold * image.iter().copied().fold(0.0, f64::max);
    let (mut both, mut union) = (0.0, 0.0);
    for ((&pixel, &mean), &variance) in image.iter().zip(mean).zip(variances) {
        let above = probability_above(level, mean, scale * variance.max(0.0).sqrt());
        if pixel > level {
            both += above;
            union += 1.0;
        } else {
            union += above;
        }
    }
    if both > 0.0 { both / union } else { 0.0 }
}

/// P(x > `level`) for x ~ N(`mean`, `deviation`²).
fn probability_above(level: f64, mean: f64, deviation: f64) -> f64 {
    let distance = level - mean;
    if deviation > 0.0 {
        0.5 * erfc(FRAC_1_SQRT_2 * (distance / deviation))
    } else if distance < 0.0 {
        1.0
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two taxels in the support, two outside; every probability from a table of the normal distribution
    /// (M. Abramowitz, I. Stegun, *Handbook of Mathematical Functions* (1964), table 26.1, ten digits).
    #[test]
    fn a_case_by_hand() {
        let (one, two) = (0.841_344_746_068_5, 0.977_249_868_051_8);
        let mean = [3.0, 2.0, 0.0, -1.0];
        // the level is 1: distances of two, one, one and two deviations
        let found = expected_iou(&mean, &mean, &[0.25; 4], 2.0, 1.0 / 3.0);
        let expected = (two + one) / (2.0 + (1.0 - one) + (1.0 - two));
        assert!((found - expected).abs() < 1e-10, "{found}, expected {expected}");
    }

    #[test]
    fn without_doubt_it_is_one_and_without_an_image_zero() {
        let image = [1.0, 0.2, 0.0];
        assert!((expected_iou(&image, &image, &[0.0; 3], 1.0, 0.23) - 1.0).abs() < 1e-15);
        assert!((expected_iou(&image, &image, &[1e-20; 3], 1e-3, 0.23) - 1.0).abs() < 1e-15);
        for image in [[0.0; 3], [-1.0; 3], [f64::NAN; 3]] {
            assert!(expected_iou(&image, &image, &[1.0; 3], 1.0, 0.23) <= 0.0);
        }
    }

    /// The answer depends on ratios alone.
    #[test]
    fn the_unit_of_the_image_does_not_matter() {
        let image = [1.0, 0.7, 0.2, -0.1];
        let variances = [0.1, 0.2, 0.1, 0.3];
        let one = expected_iou(&image, &image, &variances, 1.0, 0.23);
        for unit in [1e-100, 1e100] {
            let scaled = image.map(|v| v * unit);
            let found = expected_iou(&scaled, &scaled, &variances, unit, 0.23);
            assert!((found - one).abs() < 1e-14, "{found}, expected {one}");
        }
    }
}
