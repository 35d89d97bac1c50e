//! Rows that need little: random signs, signs of cosines, and products of rows along the two axes.

use crate::matrix::Matrix;
use crate::rows::expected::{Expected, Moments, take};
use crate::rows::greedy::{Greedy, random_signs};
use crate::rows::{DesignRows, RowTask};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use spts_input::Refusal;

/// Independent random signs, the reference for all other designs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Random;

/// Rows that are drawn for each that is asked for, before a limit of the sums counts as out of reach.
const DRAWS: usize = 1000;

impl DesignRows for Random {
    fn design(&self, task: &RowTask<'_>) -> Result<Matrix, Refusal> {
        task.check_without_kinds("random", 1 << 20, "so many rows are of no use")?;
        let n = task.expected.taxels();
        let mut rng = ChaCha8Rng::seed_from_u64(task.seed);
        if task.largest_sum.is_none() {
            let mut rows = Matrix::zeros(task.rows, n);
            (0..task.rows).for_each(|r| rows.row_mut(r).copy_from_slice(&random_signs(n, &mut rng)));
            return Ok(rows);
        }
        let draws = task.rows * DRAWS;
        take(
            task,
            (0..draws).map(|_| random_signs(n, &mut rng)),
            "no more of the rows that were drawn keep to the headroom",
        )
    }
}

/// Signs of the functions cos(π(r + ½)u/R) · cos(π(c + ½)v/C) of the two-dimensional cosine transform, low frequencies
/// first. Of the images, this design assumes only that low frequencies are strong.
/// Source: N. Ahmed, T. Natarajan, K. R. Rao, IEEE Trans. Comput. C-23 (1974) 90.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CosineSigns;

impl DesignRows for CosineSigns {
    fn design(&self, task: &RowTask<'_>) -> Result<Matrix, Refusal> {
        let shape = task.expected.shape();
        let reason = "a sheet has as many cosines as taxels, and some of them may not keep to the headroom";
        task.check_without_kinds("cosine_signs", task.expected.taxels(), reason)?;
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

/// Signs a ⊗ b, products of a row along the rows and one along the columns of the sheet. [`Greedy`] designs each for
/// the covariance along its axis; pairs that explain most variance come first. Memory and time grow with the sides of
/// the sheet, not with the square of its taxels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Separable;

impl DesignRows for Separable {
    fn design(&self, task: &RowTask<'_>) -> Result<Matrix, Refusal> {
        let shape = task.expected.shape();
        let reason = "a sheet has as many products of rows as taxels, and some of them may not keep to the headroom";
        task.check_without_kinds("separable", task.expected.taxels(), reason)?;
        let mut rows: [Vec<Vec<f64>>; 2] = Default::default();
        let mut worth: [Vec<f64>; 2] = Default::default();
        for (axis, covariance) in task.expected.axes().into_iter().enumerate() {
            let n = covariance.nrows();
            let along = Expected {
                shape: [1, n],
                moments: Moments::Dense { second: covariance.clone(), covariance: covariance.clone() },
            };
            let designed = Greedy.design(&RowTask {
                rows: n.min(task.rows),
                expected: &along,
                classes: &[],
                largest_sum: None,
                // an axis has far fewer rows than are asked for
                row_found: &|| (),
                ..*task
            })?;
            for r in 0..designed.nrows() {
                worth[axis].push(along.square_of_sum(designed.row(r)));
                rows[axis].push(designed.row(r).to_vec());
            }
        }
        let mut pairs: Vec<(usize, usize)> =
            (0..rows[0].len()).flat_map(|i| (0..rows[1].len()).map(move |j| (i, j))).collect();
        // aᵀA a · bᵀB b is the variance of the sum; the first of equals
        pairs.sort_by(|x, y| (worth[0][y.0] * worth[1][y.1]).total_cmp(&(worth[0][x.0] * worth[1][x.1])));
        take(task, products(shape, &rows, pairs), reason)
    }
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
