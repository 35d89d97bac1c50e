//! Rows for large sheets: products of one row along each axis.

use super::cosine::products;
use super::error::RowError;
use super::expected::{Expected, Moments};
use super::greedy::Greedy;
use super::headroom::take;
use super::task::{DesignRows, RowTask};
use crate::matrix::Matrix;

/// Signs a ⊗ b, products of a row along the rows and one along the columns of the sheet. [`Greedy`] designs each for
/// the covariance along its axis; pairs that explain most variance come first. Memory and time grow with the sides of
/// the sheet, not with the square of its taxels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Separable;

impl DesignRows for Separable {
    fn design(&self, task: &RowTask<'_>) -> Result<Matrix, RowError> {
        let shape = task.expected.shape();
        let reason = "a sheet has as many products of rows as taxels, and some of them may not keep to the headroom";
        task.check(task.expected.taxels(), reason)?;
        let mut rows: [Vec<Vec<f64>>; 2] = Default::default();
        let mut worth: [Vec<f64>; 2] = Default::default();
        for (axis, covariance) in task.expected.axes().into_iter().enumerate() {
            let n = covariance.nrows();
            let along = Expected {
                shape: [1, n],
                moments: Moments::Dense {
                    second: covariance.clone(),
                    covariance: covariance.clone(),
                },
            };
            let designed = Greedy::default().design(&RowTask {
                rows: n.min(task.rows),
                expected: &along,
                classes: &[],
                largest_sum: None,
                ..*task
            })?;
            for r in 0..designed.nrows() {
                worth[axis].push(along.square_of_sum(designed.row(r)));
                rows[axis].push(designed.row(r).to_vec());
            }
        }
        let mut pairs: Vec<(usize, usize)> = (0..rows[0].len())
            .flat_map(|i| (0..rows[1].len()).map(move |j| (i, j)))
            .collect();
        // aᵀA a · bᵀB b is the variance of the sum; the first of equals
        pairs.sort_by(|x, y| (worth[0][y.0] * worth[1][y.1]).total_cmp(&(worth[0][x.0] * worth[1][x.1])));
        take(task, products(shape, &rows, pairs), reason)
    }
}
