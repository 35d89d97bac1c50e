//! Rows of independent random signs.

use super::error::RowError;
use super::headroom::take;
use super::task::{DesignRows, RowTask};
use crate::matrix::Matrix;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Independent random signs, the reference for all other designs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Random;

/// Rows that are drawn for each that is asked for, before a limit of the sums counts as out of reach.
const DRAWS: usize = 1000;

impl DesignRows for Random {
    fn design(&self, task: &RowTask<'_>) -> Result<Matrix, RowError> {
        task.check(1 << 20, "so many rows are of no use")?;
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

/// `n` independent random signs.
pub(super) fn random_signs(n: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    (0..n).map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 }).collect()
}
