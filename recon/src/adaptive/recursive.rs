//! Gaussian posterior of an image, updated measurement by measurement.

use crate::checks::{RangeError, within};
use crate::classify::Stopped;
use crate::kernels::{axpy, dot};
use crate::matrix::Matrix;
use crate::problem::RecoverError;
use crate::recover::Gaussian;

/// Mean x̂ and covariance P of x ~ N(μ, C) after the measurements y = φᵀ x + n, n ~ N(0, σ²), one at a time:
///
/// w = P φ, q = φᵀ w + σ², x̂ += w (y − φᵀ x̂)/q, P −= w wᵀ/q.
///
/// Exactly the posterior of all measurements at once ([`crate::recover::Lmmse`]), whatever their order, at O(N²) a measurement. P does not
/// depend on the samples: how sure the image will be after M measurements is known before they are taken.
/// Noise variances below 1e-12 ‖φ‖² tr(C)/N, a share of what the prior gives the measurement, are raised to it.
/// Source: S. M. Kay, "Fundamentals of Statistical Signal Processing: Estimation Theory" (1993), §12.6.
#[derive(Debug, Clone)]
pub struct RecursiveLmmse<'p> {
    prior: &'p Gaussian,
    variance: f64,
    /// tr(C)/N.
    prior_variance: f64,
    mean: Vec<f64>,
    covariance: Matrix,
    /// P φ of the measurement at hand.
    gain: Vec<f64>,
    measurements: usize,
}

/// Smallest noise variance, as a share of the prior's: rounding of P stays far below it.
const SMALLEST_SHARE: f64 = 1e-12;

/// Largest |φᵢ| and |y|: products of three of them and N² terms stay finite.
const LARGEST: f64 = 1e80;

impl<'p> RecursiveLmmse<'p> {
    /// Posterior without a measurement, that is `prior`, for measurements with a noise of standard deviation `noise`, in the unit of y.
    ///
    /// # Errors
    /// [`RangeError`] when `noise` is outside [1e-60, 1e60].
    pub fn new(prior: &'p Gaussian, noise: f64) -> Result<Self, RangeError> {
        Ok(Self {
            prior,
            variance: within("noise", noise, 1e-60, 1e60)?.powi(2),
            prior_variance: trace(prior.covariance()) / prior.len() as f64,
            mean: prior.mean().to_vec(),
            covariance: prior.covariance().clone(),
            gain: vec![0.0; prior.len()],
            measurements: 0,
        })
    }

    /// Forgets all measurements.
    pub fn clear(&mut self) {
        self.mean.copy_from_slice(self.prior.mean());
        self.covariance.clone_from(self.prior.covariance());
        self.measurements = 0;
    }

    /// Takes the measurement `y` with the weights φ.
    ///
    /// # Errors
    /// [`RecoverError`] when there are not as many `weights` as unknowns, a weight is beyond ±1e80 or not finite, or so is `y`. The posterior
    /// is then as before.
    pub fn observe(&mut self, weights: &[f64], y: f64) -> Result<(), RecoverError> {
        if weights.len() != self.mean.len() {
            return Err(RecoverError::Columns {
                cols: weights.len(),
                expected: self.mean.len(),
            });
        }
        let fine = |v: f64| v.abs() <= LARGEST;
        if let Some(col) = weights.iter().position(|&w| !fine(w)) {
            return Err(RecoverError::OperatorNotFinite {
                row: self.measurements,
                col,
                value: weights[col],
            });
        }
        if !fine(y) {
            return Err(RecoverError::NotFinite {
                index: self.measurements,
                value: y,
            });
        }
        for (i, w) in self.gain.iter_mut().enumerate() {
            *w = dot(self.covariance.row(i), weights);
        }
        let smallest = SMALLEST_SHARE * self.prior_variance * dot(weights, weights);
        // rounding must not take the signal's share below zero
        let variance = dot(&self.gain, weights).max(0.0) + self.variance.max(smallest);
        let innovation = y - dot(weights, &self.mean);
        axpy(innovation / variance, &self.gain, &mut self.mean);
        for i in 0..self.gain.len() {
            axpy(-self.gain[i] / variance, &self.gain, self.covariance.row_mut(i));
        }
        self.measurements += 1;
        Ok(())
    }

    /// Observes `samples`, rows of weights and measurements, until [`Self::deviation`] is at most `deviation`.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn observe_until<'s>(
        &mut self,
        deviation: f64,
        samples: impl IntoIterator<Item = (&'s [f64], f64)>,
    ) -> Result<Stopped, RecoverError> {
        let (mut samples, mut measurements) = (samples.into_iter(), 0);
        while self.deviation() > deviation {
            let Some((weights, y)) = samples.next() else {
                return Ok(Stopped {
                    measurements,
                    reached: false,
                });
            };
            self.observe(weights, y)?;
            measurements += 1;
        }
        Ok(Stopped {
            measurements,
            reached: true,
        })
    }

    /// Posterior mean: the image.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Posterior covariance.
    #[must_use]
    pub fn covariance(&self) -> &Matrix {
        &self.covariance
    }

    /// Root mean square of the taxels' posterior standard deviations, √(tr P / N).
    #[must_use]
    pub fn deviation(&self) -> f64 {
        (trace(&self.covariance).max(0.0) / self.mean.len() as f64).sqrt()
    }

    /// Measurements so far.
    #[must_use]
    pub fn measurements(&self) -> usize {
        self.measurements
    }
}

fn trace(matrix: &Matrix) -> f64 {
    (0..matrix.nrows()).map(|i| matrix.row(i)[i]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix::MatrixView;
    use crate::problem::{Problem, Workspace};
    use crate::recover::{Lmmse, Noise};
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;
    use std::sync::Arc;

    const N: usize = 12;

    fn prior() -> Gaussian {
        let mean = (0..u8::try_from(N).unwrap()).map(|i| 0.1 * f64::from(i)).collect();
        let mut covariance = Matrix::zeros(N, N);
        for i in 0..N {
            for j in 0..N {
                covariance.row_mut(i)[j] = 0.8_f64.powi(i32::try_from(i.abs_diff(j)).unwrap());
            }
        }
        Gaussian::new(mean, covariance).unwrap()
    }

    fn measurements(m: usize) -> (Vec<f64>, Vec<f64>) {
        let mut rng = ChaCha8Rng::seed_from_u64(12);
        let rows = (0..m * N)
            .map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 })
            .collect();
        (rows, (0..m).map(|_| rng.random_range(-3.0..3.0)).collect())
    }

    /// After every measurement, fewer and more than there are unknowns, mean and covariance are those of the batch.
    #[test]
    fn equals_the_batch_estimate() {
        let (prior, (rows, y)) = (prior(), measurements(30));
        let batch = Lmmse::new(Arc::new(prior.clone()), Noise::Absolute(0.3)).unwrap();
        let mut recursive = RecursiveLmmse::new(&prior, 0.3).unwrap();
        for (m, row) in rows.chunks(N).enumerate() {
            recursive.observe(row, y[m]).unwrap();
            let operator = MatrixView::new(m + 1, N, &rows[..(m + 1) * N]).unwrap();
            let problem = Problem::new(operator, &y[..=m]).unwrap();
            let expected = batch.posterior(&problem, &mut Workspace::default()).unwrap();
            // 30 updates of numbers near 1 at a condition of about 12·12/0.09
            for (got, e) in recursive.mean().iter().zip(&expected.mean) {
                assert!((got - e).abs() < 1e-11, "M = {}: mean {got}, batch {e}", m + 1);
            }
            let entries = recursive.covariance().view().values().iter();
            for (got, e) in entries.zip(expected.covariance.view().values()) {
                assert!((got - e).abs() < 1e-11, "M = {}: covariance {got}, batch {e}", m + 1);
            }
        }
        recursive.clear();
        assert_eq!((recursive.mean(), recursive.measurements()), (prior.mean(), 0));
    }

    #[test]
    fn stops_at_the_wanted_deviation() {
        let (prior, (rows, y)) = (prior(), measurements(30));
        let samples = || rows.chunks(N).zip(y.iter().copied());
        let mut recursive = RecursiveLmmse::new(&prior, 0.3).unwrap();
        assert!((recursive.deviation() - 1.0).abs() < 1e-15);
        let stopped = recursive.observe_until(0.5, samples()).unwrap();
        assert!(stopped.reached && recursive.deviation() <= 0.5);
        // the last measurement was needed
        let mut again = RecursiveLmmse::new(&prior, 0.3).unwrap();
        let fewer = samples().take(stopped.measurements - 1);
        assert!(!again.observe_until(0.5, fewer).unwrap().reached);
        // beyond reach: σ/√M a taxel with 30 independent rows
        let all = again.observe_until(1e-3, samples()).unwrap();
        assert_eq!((all.measurements, all.reached), (30, false));
    }

    #[test]
    fn refuses_what_it_cannot_use() {
        let prior = prior();
        assert!(RecursiveLmmse::new(&prior, 0.0).is_err() && RecursiveLmmse::new(&prior, f64::NAN).is_err());
        let mut recursive = RecursiveLmmse::new(&prior, 1e-60).unwrap();
        assert!(recursive.observe(&[1.0; N - 1], 0.0).is_err());
        assert!(recursive.observe(&[f64::NAN; N], 0.0).is_err());
        assert!(recursive.observe(&[1.0; N], f64::INFINITY).is_err());
        assert_eq!((recursive.mean(), recursive.measurements()), (prior.mean(), 0));
        // without noise, rows that repeat or say nothing change nothing more, and everything stays finite
        for y in [1.0, 1.0, 1e79] {
            recursive.observe(&[1.0; N], y).unwrap();
            recursive.observe(&[0.0; N], y).unwrap();
            assert!(recursive.mean().iter().all(|v| v.is_finite()));
        }
    }
}
