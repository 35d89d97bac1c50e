//! Finds places where a residual looks like a contact.

use crate::kernels::norm;
use crate::operator::{Atom, LinearOperator as _, ShiftedDictionary};

/// Matched filters: blobs at every place.
pub(super) struct Detector {
    blobs: ShiftedDictionary,
    /// The same with every value squared.
    squares: ShiftedDictionary,
    taxels: usize,
}

/// A place, and how far its correlation stands out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Detection {
    pub(super) place: usize,
    /// Value in standard deviations of what chance gives.
    pub(super) score: f64,
}

impl Detector {
    /// Filters for `blobs` in images of `rows` × `cols`.
    pub(super) fn new(rows: usize, cols: usize, blobs: &[Atom]) -> Self {
        let squares: Vec<Atom> = blobs.iter().map(Atom::squared).collect();
        Self {
            blobs: ShiftedDictionary::new(rows, cols, blobs),
            squares: ShiftedDictionary::new(rows, cols, &squares),
            taxels: rows * cols,
        }
    }

    /// Score that chance reaches `false_alarms` times in all places and blobs together: the z of a normal tail,
    /// P(Z > z) ≤ e^(−z²/2)/2.
    pub(super) fn threshold(&self, false_alarms: f64) -> f64 {
        (2.0 * (0.5 * self.blobs.ncols() as f64 / false_alarms).ln())
            .max(0.0)
            .sqrt()
    }

    /// Places whose best blob scores more than `threshold`, in increasing order. `correlation` is Φᵀ r of a residual,
    /// `variance` what chance gives its entries
    /// ([`SelectColumns::chance_variance`](crate::operator::SelectColumns::chance_variance)).
    pub(super) fn detect(&self, correlation: &[f64], variance: &[f64], threshold: f64) -> Vec<Detection> {
        let (mut scores, mut variances) = (vec![0.0; self.blobs.ncols()], vec![0.0; self.blobs.ncols()]);
        self.blobs.apply_adjoint(correlation, &mut scores);
        self.squares.apply_adjoint(variance, &mut variances);
        let largest = variances.iter().copied().fold(0.0, f64::max);
        let mut best = vec![0.0_f64; self.taxels];
        for (scores, variances) in scores
            .chunks_exact(self.taxels)
            .zip(variances.chunks_exact(self.taxels))
        {
            for (best, (score, variance)) in best.iter_mut().zip(scores.iter().zip(variances)) {
                // where the edge leaves next to nothing of a blob, or a wire next to nothing of the residual, there is
                // but rounding
                if *variance > ROUNDING * largest {
                    *best = best.max(score / variance.sqrt());
                }
            }
        }
        let above = best.iter().enumerate().filter(|(_, score)| **score > threshold);
        above.map(|(place, &score)| Detection { place, score }).collect()
    }

    /// Numbers of bytes that the filters and one detection hold: both sets of spectra, and two numbers a place and
    /// blob.
    pub(super) fn bytes(&self) -> usize {
        4 * self.blobs.ncols() * size_of::<f64>() + 3 * self.taxels * size_of::<f64>()
    }
}

/// Variance over the largest one below which transforms leave but rounding.
const ROUNDING: f64 = 1e-10;

/// Adds every place within `reach` taxels of one that is `marked`; with a reach of 2.5, the 21 places of a rounded
/// square.
pub(super) fn dilate((rows, cols): (usize, usize), marked: &[usize], reach: f64, out: &mut [bool]) {
    #[expect(clippy::cast_possible_truncation, reason = "a reach is a few taxels")]
    let side = reach.max(0.0).floor() as isize;
    let near = |dr: isize, dc: isize| (dr * dr + dc * dc) as f64 <= reach * reach;
    for &place in marked {
        let (r, c) = (place / cols, place % cols);
        for (dr, dc) in (-side..=side).flat_map(|dr| (-side..=side).map(move |dc| (dr, dc))) {
            if let (Some(r), Some(c)) = (r.checked_add_signed(dr), c.checked_add_signed(dc))
                && r < rows
                && c < cols
                && near(dr, dc)
            {
                out[r * cols + c] = true;
            }
        }
    }
}

/// Length of a residual beyond which it counts as nothing: rounding of the measurements.
pub(super) fn is_nothing(residual: &[f64], y: &[f64]) -> bool {
    norm(residual) <= 1e-12 * norm(y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blob_is_found_where_it_is() {
        let blobs = [Atom::cap(1.0), Atom::cap(3.0)];
        let detector = Detector::new(12, 9, &blobs);
        let mut image = vec![0.0; 12 * 9];
        let mut x = vec![0.0; 2 * 12 * 9];
        x[108 + 4 * 9 + 5] = 2.0;
        ShiftedDictionary::new(12, 9, &blobs).apply(&x, &mut image);
        let found = detector.detect(&image, &[1.0; 108], 0.5);
        let best = found.iter().max_by(|a, b| a.score.total_cmp(&b.score)).unwrap();
        // the score of the blob itself is its length times 2
        let length = norm(blobs[1].values());
        assert_eq!(best.place, 4 * 9 + 5);
        assert!(
            (best.score - 2.0 * length).abs() < 1e-9,
            "{} against {}",
            best.score,
            2.0 * length
        );
    }

    #[test]
    fn chance_stays_below_the_threshold() {
        let detector = Detector::new(100, 100, &[Atom::cap(0.0)]);
        // P(Z > z) = 1e-2/1e4: z = 4.75; the bound is above it
        let z = detector.threshold(0.01);
        assert!((4.75..5.2).contains(&z), "{z}");
    }

    #[test]
    fn dilation_is_round() {
        let mut out = vec![false; 49];
        dilate((7, 7), &[24], 2.5, &mut out);
        assert_eq!(out.iter().filter(|v| **v).count(), 21);
        let mut out = vec![false; 49];
        dilate((7, 7), &[0], 1.0, &mut out);
        assert_eq!(out.iter().filter(|v| **v).count(), 3);
    }
}
