//! Signs of cosines.

use super::error::RowError;
use super::headroom::take;
use super::task::{DesignRows, RowTask};
use crate::matrix::Matrix;

/// Signs of the functions cos(π(r + ½)u/R) · cos(π(c + ½)v/C) of the two-dimensional cosine transform, low frequencies
/// first. Of the images, this design assumes only that low frequencies are strong.
/// Source: N. Ahmed, T. Natarajan, K. R. Rao, IEEE Trans. Comput. C-23 (1974) 90.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CosineSigns;

impl DesignRows for CosineSigns {
    fn design(&self, task: &RowTask<'_>) -> Result<Matrix, RowError> {
        let shape = task.expected.shape();
        let reason = "a sheet has as many cosines as taxels, and some of them may not keep to the headroom";
        task.check(task.expected.taxels(), reason)?;
        let axes = shape.map(|n| (0..n).map(|u| (0..n).map(|i| sign(n, u, i)).collect()).collect());
        take(task, products(shape, &axes, by_frequency(shape)), reason)
    }
}

/// Sign of cos(π(2i + 1)u/2n) in whole numbers; +1 where it is zero.
fn sign(n: usize, u: usize, i: usize) -> f64 {
    // quarter turns are n of these
    let angle = (2 * i + 1) * u % (4 * n);
    if angle <= n || angle >= 3 * n { 1.0 } else { -1.0 }
}

/// All pairs of frequencies of a grid, those of low frequency first: by (u/R)² + (v/C)², then by u.
pub(super) fn by_frequency(shape: [usize; 2]) -> Vec<(usize, usize)> {
    let mut pairs: Vec<(usize, usize)> = (0..shape[0]).flat_map(|u| (0..shape[1]).map(move |v| (u, v))).collect();
    // both over the common denominator R² C²
    pairs.sort_by_key(|(u, v)| ((u * shape[1]).pow(2) + (v * shape[0]).pow(2), *u));
    pairs
}

/// The products of functions along the two axes, in the order of `pairs`.
pub(super) fn products<'a>(
    shape: [usize; 2],
    axes: &'a [Vec<Vec<f64>>; 2],
    pairs: Vec<(usize, usize)>,
) -> impl Iterator<Item = Vec<f64>> + 'a {
    pairs.into_iter().map(move |(u, v)| {
        let along = axes[0][u].iter().flat_map(|a| axes[1][v].iter().map(move |b| a * b));
        let row: Vec<f64> = along.collect();
        debug_assert_eq!(row.len(), shape[0] * shape[1]);
        row
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the cosine itself, where it is not zero.
    #[test]
    fn signs_are_those_of_the_cosine() {
        for n in [1, 2, 3, 7, 10, 32] {
            for u in 0..n {
                for i in 0..n {
                    let cosine = (std::f64::consts::PI * (i as f64 + 0.5) * u as f64 / n as f64).cos();
                    let expected = if cosine.abs() < 1e-9 { 1.0 } else { cosine.signum() };
                    assert!((sign(n, u, i) - expected).abs() < 0.5, "{n} {u} {i}");
                }
            }
        }
    }

    #[test]
    fn low_frequencies_come_first() {
        let pairs = by_frequency([4, 8]);
        assert_eq!(&pairs[..5], &[(0, 0), (0, 1), (0, 2), (1, 0), (1, 1)]);
        assert_eq!(pairs.len(), 32);
    }
}
