//! The task of a row designer.

use super::error::RowError;
use super::expected::Expected;
use crate::checks::within;
use crate::classify::Component;
use crate::matrix::Matrix;

/// What a designer of rows is asked for: how many rows, for which images, with which noise and limit.
#[derive(Debug, Clone, Copy)]
pub struct RowTask<'a> {
    /// Number of rows M: the period of a repeated pattern, at least 1.
    pub rows: usize,
    /// Expected images.
    pub expected: &'a Expected,
    /// Gaussian classes, for designers that distinguish classes; empty for all others.
    pub classes: &'a [Component],
    /// Standard deviation of a measurement's noise relative to the root mean square of a random row's sum, in [1e-6,
    /// 1e3].
    pub noise: f64,
    /// Headroom: largest root mean square of a row's sum over the expected images, relative to a random row's, in
    /// [0.05, 1000]. `None` for no limit.
    pub largest_sum: Option<f64>,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// A way to choose rows of the sensing matrix for images that are expected.
///
/// ```
/// use spts_recon::rows::{Expected, RowTask, designer, posterior_trace};
///
/// let smooth = Expected::smooth([6, 6], 1.5)?;
/// let task = RowTask::new(8, &smooth);
/// let design = |name| (designer(name).expect("in the table").build)().design(&task);
/// let (designed, random) = (design("greedy")?, design("random")?);
/// assert!(posterior_trace(&task, &designed)? < posterior_trace(&task, &random)?);
/// # Ok::<(), spts_recon::rows::RowError>(())
/// ```
pub trait DesignRows: Send + Sync {
    /// Designs an M × N sensing matrix with every level in [−1, 1]. The most useful rows come first, so that the first
    /// few are a design of their own. Equal tasks have equal results for any number of threads.
    ///
    /// # Errors
    /// [`RowError`] if the task is out of range, or no row respects its headroom.
    fn design(&self, task: &RowTask<'_>) -> Result<Matrix, RowError>;
}

impl<'a> RowTask<'a> {
    /// Default noise of a measurement: contact noise, and what a prior does not describe.
    pub const NOISE: f64 = 0.15;

    /// A task for `rows` rows and the images `expected`, without a limit of the sums.
    #[must_use]
    pub fn new(rows: usize, expected: &'a Expected) -> Self {
        Self {
            rows,
            expected,
            classes: &[],
            noise: Self::NOISE,
            largest_sum: None,
            seed: 1,
        }
    }

    /// Checks all numbers; at most `most` rows, because of `reason`.
    pub(super) fn check(&self, most: usize, reason: &'static str) -> Result<(), RowError> {
        within("noise", self.noise, 1e-6, 1e3)?;
        if let Some(limit) = self.largest_sum {
            within("largest_sum", limit, 0.05, 1e3)?;
        }
        if self.rows == 0 || self.rows > most {
            return Err(RowError::Rows {
                rows: self.rows,
                most,
                reason,
            });
        }
        Ok(())
    }

    /// σ²: variance of a measurement's noise, in the unit of the images.
    pub(super) fn variance(&self) -> f64 {
        self.noise * self.noise * self.expected.random_square()
    }

    /// The largest mean square of a row's sum, in the unit of the images.
    pub(super) fn largest_square(&self) -> Option<f64> {
        self.largest_sum
            .map(|limit| limit * limit * self.expected.random_square())
    }
}
