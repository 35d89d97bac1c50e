//! Quality of a reconstructed image: support accuracy, IoU, F1 and balanced accuracy.
//!
//! ```
//! use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
//!
//! let (mut found, mut truth) = (Vec::new(), Vec::new());
//! support(&[0.9, 0.3, 0.1, 0.0], SUPPORT_THRESHOLD, &mut found);
//! support(&[1.0, 0.1, 0.1, 0.0], SUPPORT_THRESHOLD, &mut truth);
//! // two taxels found, one of them pressed
//! assert!((SupportScore::new(&found, &truth).iou - 0.5).abs() < 1e-15);
//! ```

/// Threshold of the published evaluation, relative to each image's maximum.
pub const SUPPORT_THRESHOLD: f64 = 0.23;

/// Marks the taxels above `threshold` · max. An image without a positive value has an empty support.
pub fn support(image: &[f64], threshold: f64, out: &mut Vec<bool>) {
    let max = image.iter().copied().fold(0.0_f64, f64::max);
    out.clear();
    out.extend(image.iter().map(|&v| max > 0.0 && v > threshold * max));
}

/// Agreement of a support with the ground truth.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SupportScore {
    /// Share of correctly classified taxels, called "support accuracy" in the publication.
    pub accuracy: f64,
    /// Intersection over union; 1 if both supports are empty.
    pub iou: f64,
    /// Harmonic mean of precision and recall; 1 if both supports are empty.
    pub f1: f64,
    /// Mean of the true-positive and the true-negative rate; a rate without members counts as 1.
    pub balanced_accuracy: f64,
}

impl SupportScore {
    /// Scores `found` against `truth`, which must have the same length.
    pub fn new(found: &[bool], truth: &[bool]) -> Self {
        let (mut both, mut only_found, mut only_truth, mut neither) = (0.0, 0.0, 0.0, 0.0);
        for (&f, &t) in found.iter().zip(truth) {
            match (f, t) {
                (true, true) => both += 1.0,
                (true, false) => only_found += 1.0,
                (false, true) => only_truth += 1.0,
                (false, false) => neither += 1.0,
            }
        }
        let share = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 1.0 };
        Self {
            accuracy: share(both + neither, both + neither + only_found + only_truth),
            iou: share(both, both + only_found + only_truth),
            f1: share(2.0 * both, 2.0 * both + only_found + only_truth),
            balanced_accuracy: 0.5 * (share(both, both + only_truth) + share(neither, neither + only_found)),
        }
    }
}

impl SupportScore {
    /// Scores the support of `image` against that of `truth`, both above [`SUPPORT_THRESHOLD`] of their largest value:
    /// one value a taxel, in any unit.
    ///
    /// ```
    /// use spts_recon::metrics::SupportScore;
    ///
    /// let score = SupportScore::of_images(&[0.9, 0.3, 0.1, 0.0], &[1.0, 0.1, 0.1, 0.0]);
    /// assert!((score.iou - 0.5).abs() < 1e-15);
    /// ```
    pub fn of_images(image: &[f64], truth: &[f64]) -> Self {
        let (mut found, mut touched) = (Vec::new(), Vec::new());
        support(image, SUPPORT_THRESHOLD, &mut found);
        support(truth, SUPPORT_THRESHOLD, &mut touched);
        Self::new(&found, &touched)
    }
}

/// Adds up support scores and gives their mean.
#[derive(Debug, Clone, Copy, Default)]
pub struct MeanScore {
    sum: SupportScore,
    count: f64,
}

impl MeanScore {
    /// Adds one score.
    pub fn add(&mut self, s: SupportScore) {
        self.sum.accuracy += s.accuracy;
        self.sum.iou += s.iou;
        self.sum.f1 += s.f1;
        self.sum.balanced_accuracy += s.balanced_accuracy;
        self.count += 1.0;
    }

    /// Mean of all scores added; `None` without scores.
    pub fn mean(&self) -> Option<SupportScore> {
        (self.count > 0.0).then(|| SupportScore {
            accuracy: self.sum.accuracy / self.count,
            iou: self.sum.iou / self.count,
            f1: self.sum.f1 / self.count,
            balanced_accuracy: self.sum.balanced_accuracy / self.count,
        })
    }
}

/// Pearson correlation of two images; `None` if one of them is constant.
pub fn pearson(a: &[f64], b: &[f64]) -> Option<f64> {
    let n = a.len() as f64;
    let (ma, mb) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        let (dx, dy) = (x - ma, y - mb);
        ab += dx * dy;
        aa += dx * dx;
        bb += dy * dy;
    }
    let scale = (aa * bb).sqrt();
    (scale > 0.0).then(|| ab / scale)
}

/// Median (for an even count the mean of the middle two); `None` without values. NaN sorts last.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => None,
        n if n % 2 == 1 => Some(sorted[middle]),
        _ => Some(0.5 * (sorted[middle - 1] + sorted[middle])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_of_a_hand_counted_case() {
        let truth = [true, true, true, false, false, false, false, false, false, false];
        let found = [true, true, false, true, false, false, false, false, false, false];
        let s = SupportScore::new(&found, &truth);
        for (got, expected) in
            [(s.accuracy, 0.8), (s.iou, 0.5), (s.f1, 2.0 / 3.0), (s.balanced_accuracy, 0.5 * (2.0 / 3.0 + 6.0 / 7.0))]
        {
            assert!((got - expected).abs() < 1e-15, "{got} against {expected}");
        }
    }

    #[test]
    fn an_empty_image_has_no_support() {
        let mut mask = Vec::new();
        for image in [[0.0; 4], [-1.0; 4], [f64::NAN; 4]] {
            support(&image, SUPPORT_THRESHOLD, &mut mask);
            assert_eq!(mask, [false; 4]);
        }
    }

    #[test]
    fn correlation_ignores_scale_and_offset() {
        let a = [0.0, 1.0, 4.0, 2.0];
        let b: Vec<f64> = a.iter().map(|v| 3.0 * v - 1.0).collect();
        assert!((pearson(&a, &b).unwrap() - 1.0).abs() < 1e-15);
        assert_eq!(pearson(&a, &[1.0; 4]), None);
    }
}
