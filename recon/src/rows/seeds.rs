//! The best rows that generators with one seed a taxel can put out.

use super::error::RowError;
use super::exchange::{Exchange, exchange};
use super::task::{DesignRows, RowTask};
use crate::coherence;
use crate::matrix::Matrix;
use crate::operator::SignGenerator;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Rows of pseudorandom generators, one a taxel. Seeds are searched for the smallest mean square coherence between
/// rows, so that rows measure different things.
///
/// ```
/// use spts_recon::operator::SignGenerator;
/// use spts_recon::rows::{Expected, RowTask, SeedsSearch};
///
/// let images = Expected::smooth([4, 4], 1.0)?;
/// let search = SeedsSearch { generator: SignGenerator::NUMERICAL_RECIPES, budget: 50 };
/// let (seeds, rows) = search.search(&RowTask::new(6, &images))?;
/// assert_eq!((seeds.len(), rows.nrows(), rows.ncols()), (16, 6, 16));
/// # Ok::<(), spts_recon::rows::RowError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeedsSearch {
    /// Generator of the taxels. The first row is one step after the seed.
    pub generator: SignGenerator,
    /// Number of sets of seeds that are tried.
    pub budget: usize,
}

impl SeedsSearch {
    /// The seeds, one a taxel, and their M × N signs.
    ///
    /// # Errors
    /// As [`DesignRows::design`].
    pub fn search(&self, task: &RowTask<'_>) -> Result<(Vec<u32>, Matrix), RowError> {
        task.check(1 << 20, "so many rows are of no use")?;
        let n = task.expected.taxels();
        let draw = |salt: u32| {
            let mut rng = ChaCha8Rng::seed_from_u64(task.seed);
            rng.set_stream(u64::from(salt));
            (0..n).map(|_| rng.random()).collect::<Vec<u32>>()
        };
        let limit = task.largest_square();
        let excess = |rows: &Matrix| {
            let over = |r| (task.expected.square_of_sum(rows.row(r)) / limit.unwrap_or(f64::INFINITY) - 1.0).max(0.0);
            (0..rows.nrows()).map(over).sum::<f64>()
        };
        let cost = |seeds: &[u32]| {
            let rows = self.rows(seeds, task.rows);
            let coherence = coherence::rows(rows.view())?;
            // coherence is at most 1: a sum that is too large is worse than any
            Ok::<f64, RowError>(coherence.rms.powi(2) + 1e3 * excess(&rows))
        };
        let search = Exchange {
            budget: self.budget,
            salted: &draw,
            cost: &cost,
        };
        let [mut salts, mut exchanges] = [1, 2].map(|stream| {
            let mut rng = ChaCha8Rng::seed_from_u64(task.seed);
            rng.set_stream(u64::MAX - stream);
            rng
        });
        let (seeds, _) = exchange(&search, draw(0), [&mut salts, &mut exchanges])?;
        let rows = self.rows(&seeds, task.rows);
        if excess(&rows) > 0.0 {
            let largest = (0..rows.nrows()).map(|r| task.expected.square_of_sum(rows.row(r)));
            return Err(RowError::Headroom {
                limit: task.largest_sum.unwrap_or_default(),
                least: (largest.fold(0.0, f64::max) / task.expected.random_square()).sqrt(),
            });
        }
        Ok((seeds, rows))
    }

    /// `nrows` rows of generators with `seeds`.
    fn rows(&self, seeds: &[u32], nrows: usize) -> Matrix {
        let mut rows = Matrix::zeros(nrows, seeds.len());
        for (taxel, &seed) in seeds.iter().enumerate() {
            for (r, sign) in (0..nrows).zip(self.generator.signs(seed)) {
                rows.row_mut(r)[taxel] = sign;
            }
        }
        rows
    }
}

impl DesignRows for SeedsSearch {
    fn design(&self, task: &RowTask<'_>) -> Result<Matrix, RowError> {
        self.search(task).map(|(_, rows)| rows)
    }
}

#[cfg(test)]
mod tests {
    use super::super::expected::Expected;
    use super::*;
    use crate::operator::{LinearOperator as _, SignOperator};

    /// The rows are those of the generators, and say more different things than the first seeds' do.
    #[test]
    fn the_rows_are_the_generators_and_less_coherent() {
        let expected = Expected::smooth([5, 5], 1.0).unwrap();
        let task = RowTask::new(6, &expected);
        let search = SeedsSearch {
            generator: SignGenerator::new(1_664_525, 1_013_904_223, 31).unwrap(),
            budget: 60,
        };
        let (seeds, rows) = search.search(&task).unwrap();
        let operator = SignOperator::new(search.generator, seeds, 0, 6);
        let (mut unit, mut column) = (vec![0.0; 25], vec![0.0; 6]);
        for taxel in 0..25 {
            unit[taxel] = 1.0;
            operator.apply(&unit, &mut column);
            assert_eq!(column, rows.column(taxel));
            unit[taxel] = 0.0;
        }
        let first = SeedsSearch { budget: 0, ..search }.search(&task).unwrap().1;
        let rms = |rows: &Matrix| coherence::rows(rows.view()).unwrap().rms;
        assert!(rms(&rows) < 0.9 * rms(&first), "{} {}", rms(&rows), rms(&first));
    }
}
