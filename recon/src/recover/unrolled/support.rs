//! The support with the largest expected IoU, and an image with that support.

use crate::metrics::SUPPORT_THRESHOLD;

/// Share of the largest value that the weakest taxel of a support has at least, and that the strongest outside it has
/// at most: on either side of [`SUPPORT_THRESHOLD`].
const INSIDE: f64 = SUPPORT_THRESHOLD + 0.01;
const OUTSIDE: f64 = SUPPORT_THRESHOLD - 0.01;

/// Chooses the support of largest expected intersection over union for taxels that are touched with the probabilities
/// `touched`: the k most probable ones, with the k that maximises
///
/// E\[IoU\] ≈ Σ_{i ∈ S} pᵢ / (|S| + Σ_{i ∉ S} pᵢ),
///
/// the ratio of the expectations. `order` becomes the taxels, most probable first, the first of equals; returned are k,
/// at least 1, and the expected value.
pub(super) fn best_support(touched: &[f64], order: &mut Vec<usize>) -> (usize, f64) {
    order.clear();
    order.extend(0..touched.len());
    order.sort_by(|&a, &b| touched[b].total_cmp(&touched[a]));
    let total: f64 = touched.iter().sum();
    let (mut inside, mut best) = (0.0, (1, 0.0));
    for (k, &taxel) in order.iter().enumerate() {
        inside += touched[taxel];
        let expected = inside / ((k + 1) as f64 + (total - inside).max(0.0));
        if expected > best.1 {
            best = (k + 1, expected);
        }
    }
    best
}

/// Changes `image` (no value below zero) least so that its support, the taxels above [`SUPPORT_THRESHOLD`] of its
/// maximum, is the first `count` of `order`.
pub(super) fn agree(image: &mut [f64], order: &[usize], count: usize) {
    let (inside, outside) = order.split_at(count);
    let most = inside.iter().fold(0.0_f64, |m, &i| m.max(image[i]));
    // a support without a value has the same one everywhere
    let peak = if most > 0.0 { most } else { 1.0 };
    for &i in inside {
        image[i] = if most > 0.0 { image[i].max(INSIDE * peak) } else { peak };
    }
    for &i in outside {
        image[i] = image[i].min(OUTSIDE * peak);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::support;

    /// Against all subsets of six taxels.
    #[test]
    fn no_other_support_is_expected_to_be_better() {
        for touched in [
            [0.9, 0.8, 0.3, 0.2, 0.05, 0.6],
            [0.1, 0.1, 0.05, 0.2, 0.02, 0.1],
            [1.0; 6],
        ] {
            let mut order = Vec::new();
            let (count, expected) = best_support(&touched, &mut order);
            let total: f64 = touched.iter().sum();
            for set in 1..64_u32 {
                let inside: f64 = (0..6).filter(|i| set >> i & 1 == 1).map(|i| touched[i]).sum();
                let other = inside / (f64::from(set.count_ones()) + total - inside);
                assert!(other <= expected + 1e-12, "{set:b}: {other} of {expected} for {count}");
            }
        }
    }

    #[test]
    fn the_image_has_the_support() {
        for image in [[0.0; 5], [1.0, 0.1, 0.5, 0.0, 0.2], [0.0, 0.0, 0.0, 3.0, 1.0]] {
            let mut image = image;
            let order = [1, 2, 4, 0, 3];
            agree(&mut image, &order, 3);
            let mut mask = Vec::new();
            support(&image, SUPPORT_THRESHOLD, &mut mask);
            assert_eq!(mask, [false, true, true, false, true], "{image:?}");
        }
    }
}
