//! The limit of a row's sum.

use super::error::RowError;
use super::expected::Expected;
use super::task::RowTask;
use crate::kernels::{adjoint, dot};
use crate::matrix::Matrix;

/// Mean square aᵀS a of the sum of a row a over the expected images, kept up to date while single levels change.
#[derive(Debug, Clone)]
pub(super) struct Headroom {
    second: Matrix,
    limit: f64,
    sa: Vec<f64>,
    square: f64,
}

impl Headroom {
    /// The limit of `task`, if it has one.
    pub(super) fn of(task: &RowTask<'_>) -> Option<Self> {
        Some(Self {
            limit: task.largest_square()?,
            second: task.expected.second(),
            sa: vec![0.0; task.expected.taxels()],
            square: 0.0,
        })
    }

    pub(super) fn start(&mut self, row: &[f64]) {
        adjoint(self.second.view().values(), row, &mut self.sa);
        self.square = dot(row, &self.sa);
    }

    /// Mean square after level i has changed by `delta`.
    pub(super) fn after(&self, i: usize, delta: f64) -> f64 {
        self.square + delta * (2.0 * self.sa[i] + delta * self.second.row(i)[i])
    }

    pub(super) fn change(&mut self, i: usize, delta: f64) {
        self.square = self.after(i, delta);
        crate::kernels::axpy(delta, self.second.row(i), &mut self.sa);
    }

    pub(super) fn square(&self) -> f64 {
        self.square
    }

    pub(super) fn limit(&self) -> f64 {
        self.limit
    }

    pub(super) fn kept(&self) -> bool {
        self.square <= self.limit
    }
}

/// Largest root mean square of a row's sum over the expected images, among `rows` (M × N), relative to that of a random
/// row. It is compared with the limit [`RowTask::largest_sum`].
///
/// # Panics
/// If the rows have another number of taxels than the images.
#[must_use]
pub fn largest_sum(expected: &Expected, rows: &Matrix) -> f64 {
    assert_eq!(rows.ncols(), expected.taxels(), "taxels");
    let squares = (0..rows.nrows()).map(|r| expected.square_of_sum(rows.row(r)));
    (squares.fold(0.0, f64::max) / expected.random_square()).sqrt()
}

/// The first `task.rows` of `candidates` that keep to the headroom and are not like one before them but for the sign;
/// `reason` says what limits the number of candidates.
pub(super) fn take(
    task: &RowTask<'_>,
    candidates: impl Iterator<Item = Vec<f64>>,
    reason: &'static str,
) -> Result<Matrix, RowError> {
    let n = task.expected.taxels();
    let limit = task.largest_square();
    let (mut kept, mut least): (Vec<Vec<f64>>, f64) = (Vec::new(), f64::INFINITY);
    for row in candidates {
        if kept.len() == task.rows {
            break;
        }
        if let Some(limit) = limit {
            let square = task.expected.square_of_sum(&row);
            least = least.min(square);
            if square > limit {
                continue;
            }
        }
        let like = |other: &Vec<f64>| dot(other, &row).abs() >= dot(&row, &row) * (1.0 - 1e-12);
        if !kept.iter().any(like) {
            kept.push(row);
        }
    }
    if kept.len() < task.rows {
        return Err(match task.largest_sum {
            Some(limit) if kept.is_empty() => RowError::Headroom {
                limit,
                least: (least / task.expected.random_square()).sqrt(),
            },
            _ => RowError::Rows {
                rows: task.rows,
                most: kept.len(),
                reason,
            },
        });
    }
    let mut rows = Matrix::zeros(task.rows, n);
    for (r, row) in kept.iter().enumerate() {
        rows.row_mut(r).copy_from_slice(row);
    }
    Ok(rows)
}
