//! The linear Gaussian estimate of an image that changes with time, window by window.

use super::expected_iou::expected_iou;
use super::gaussian::SMALLEST_VARIANCE;
use super::parameter::{ParameterError, positive};
use super::prior::Gaussian;
use super::sequential::{LARGEST, SequentialError};
use crate::checks::within;
use crate::kernels::{adjoint, axpy, dot};
use crate::matrix::MatrixView;
use std::sync::Arc;

/// Motion model of an image in [`TrackedImage`]. Times may have any unit, such as samples or seconds, but all the same.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// τ: correlation time of the contact's shape, in (0, ∞). Two images at a time difference t have the correlation
    /// exp(−t/τ).
    pub memory: f64,
    /// T: averaging time of the contact's strength, in (0, ∞). It should be shorter than the rise of a contact and
    /// include some tens of samples.
    pub strength_memory: f64,
    /// Noise of a sample that grows with the contact, relative to the root mean square of the samples, in (0, ∞).
    pub noise: f64,
    /// Noise of a sample without a contact, in the unit of the samples, in [0, ∞).
    pub idle_noise: f64,
}

/// An image tracked in time: each window of samples improves on the estimate of earlier windows.
///
/// The image is x = s u. Its shape u is a stationary Gauss–Markov process with the prior N(0, C). Between two windows
/// with the time difference t, with ρ = exp(−t/τ),
///
/// û ← ρ û, P ← ρ² P + (1 − ρ²) C,
///
/// and every sample y = aᵀ x + n is a rank-one update of û and P, as in [`super::SequentialGains`], at O(N²).
///
/// The strength s grows with the contact and is not filtered. It is computed from the mean square of the samples,
/// weighted by exp(−age/T): s² = (⟨y²⟩ − σ₀²) / (⟨‖a‖²⟩ tr C / N), where σ₀ is the idle noise. A growing contact
/// therefore keeps its shape. The noise of a sample is σ² = (`noise`)² ⟨y²⟩ + σ₀². Without a contact, s is small and
/// σ/s large, so P returns to C: the next contact is not biased by the one before.
///
/// Source: R. E. Kalman, "A new approach to linear filtering and prediction problems", J. Basic Eng. 82 (1960); for the
/// process, S. Särkkä, *Bayesian Filtering and Smoothing* (2013), §4.3.
///
/// ```
/// use spts_recon::Matrix;
/// use spts_recon::recover::{Gaussian, Motion, TrackedImage};
/// use std::sync::Arc;
///
/// let motion = Motion { memory: 50.0, strength_memory: 10.0, noise: 0.1, idle_noise: 0.0 };
/// let mut image = TrackedImage::new(Arc::new(Gaussian::white(3, 1.0)?), motion)?;
/// // one sample a window; the image is (2, 0, 0)
/// for (row, y) in [([1.0, 1.0, -1.0], 2.0), ([1.0, -1.0, 1.0], 2.0), ([-1.0, 1.0, 1.0], -2.0)] {
///     image.observe(1.0, Matrix::from_rows(1, 3, row.to_vec())?.view(), &[y])?;
/// }
/// assert!(image.image()[0] > 1.5 && image.image()[1].abs() < 0.2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct TrackedImage {
    prior: Arc<Gaussian>,
    motion: Motion,
    /// tr C / N.
    mean_variance: f64,
    /// û.
    shape: Vec<f64>,
    /// P, N × N.
    covariance: Vec<f64>,
    /// Diagonal of P.
    variances: Vec<f64>,
    /// s û.
    image: Vec<f64>,
    /// s.
    strength: f64,
    sums: Sums,
    /// P a, and later the same divided by √q.
    product: Vec<f64>,
}

/// Sums over the samples, weighted by exp(−age/T).
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    /// Of 1.
    count: f64,
    /// Of y².
    squares: f64,
    /// Of ‖a‖².
    weights: f64,
}

/// Least square of the strength, as a share of the one that gives samples of the size of the idle noise.
const LEAST_STRENGTH: f64 = 0.02;

impl TrackedImage {
    /// An image with the prior only.
    ///
    /// # Errors
    /// [`SequentialError`] if a field of `motion` is outside its range, or the prior has a mean.
    pub fn new(prior: Arc<Gaussian>, motion: Motion) -> Result<Self, SequentialError> {
        positive("memory", motion.memory)?;
        positive("strength_memory", motion.strength_memory)?;
        positive("noise", motion.noise)?;
        if !(motion.idle_noise >= 0.0 && motion.idle_noise <= LARGEST) {
            let (field, value, range) = ("idle_noise", motion.idle_noise, "[0, 1e100]");
            return Err(ParameterError { field, value, range }.into());
        }
        if let Some(index) = prior.mean().iter().position(|v| *v != 0.0) {
            let value = prior.mean()[index];
            return Err(SequentialError::Mean { index, value });
        }
        let n = prior.len();
        let variances: Vec<f64> = (0..n).map(|i| prior.covariance().row(i)[i]).collect();
        Ok(Self {
            motion,
            mean_variance: variances.iter().sum::<f64>() / n as f64,
            shape: vec![0.0; n],
            covariance: prior.covariance().view().values().to_vec(),
            variances,
            image: vec![0.0; n],
            strength: 0.0,
            sums: Sums::default(),
            product: vec![0.0; n],
            prior,
        })
    }

    /// Removes all samples and keeps the memory.
    pub fn clear(&mut self) {
        self.shape.fill(0.0);
        self.covariance.copy_from_slice(self.prior.covariance().view().values());
        self.image.fill(0.0);
        self.strength = 0.0;
        self.sums = Sums::default();
        self.keep_variances();
    }

    /// Adds the samples `y` of the rows of weights `phi` (M × N), at the time `elapsed`, in [0, ∞), after the previous
    /// window. Weights and samples are in ±1e100.
    ///
    /// # Errors
    /// [`SequentialError`] if the window does not fit the image, holds a value that is not a number or out of range, or
    /// a variance overflows. In the last case the image must be cleared; otherwise it is unchanged.
    pub fn observe(&mut self, elapsed: f64, phi: MatrixView<'_>, y: &[f64]) -> Result<(), SequentialError> {
        let n = self.prior.len();
        if phi.ncols() != n {
            let (cols, expected) = (phi.ncols(), n);
            return Err(SequentialError::Columns { cols, expected });
        }
        if phi.nrows() != y.len() {
            let (index, prepared) = (y.len(), phi.nrows());
            return Err(SequentialError::NotPrepared { index, prepared });
        }
        within("elapsed", elapsed, 0.0, f64::MAX)?;
        for &weight in phi.values() {
            within("weight", weight, -LARGEST, LARGEST)?;
        }
        for &y in y {
            within("y", y, -LARGEST, LARGEST)?;
        }
        self.advance(elapsed);
        self.follow_strength(elapsed, phi, y);
        self.take(phi, y)?;
        self.keep_variances();
        for (x, u) in self.image.iter_mut().zip(&self.shape) {
            *x = self.strength * u;
        }
        Ok(())
    }

    /// Lets the shape move for the time `elapsed`.
    fn advance(&mut self, elapsed: f64) {
        let kept = (-elapsed / self.motion.memory).exp();
        // 1 − ρ², without cancellation where the memory is long
        let forgotten = -(-2.0 * elapsed / self.motion.memory).exp_m1();
        self.shape.iter_mut().for_each(|u| *u *= kept);
        let covariance = self.prior.covariance().view();
        for (p, c) in self.covariance.iter_mut().zip(covariance.values()) {
            *p = kept * kept * *p + forgotten * c;
        }
    }

    /// Sets the strength after the samples `y`.
    fn follow_strength(&mut self, elapsed: f64, phi: MatrixView<'_>, y: &[f64]) {
        let kept = (-elapsed / self.motion.strength_memory).exp();
        let weights = phi.values();
        self.sums = Sums {
            count: kept * self.sums.count + y.len() as f64,
            squares: kept * self.sums.squares + dot(y, y),
            weights: kept * self.sums.weights + dot(weights, weights),
        };
        let idle = self.motion.idle_noise.powi(2) * self.sums.count;
        let above = (self.sums.squares - idle).max(LEAST_STRENGTH * idle);
        let unit = self.sums.weights * self.mean_variance;
        self.strength = if unit > 0.0 { (above / unit).sqrt() } else { 0.0 };
    }

    /// Updates the shape with every sample.
    fn take(&mut self, phi: MatrixView<'_>, y: &[f64]) -> Result<(), SequentialError> {
        let inverse = 1.0 / self.strength;
        // without an output there is nothing to learn of the shape
        if !inverse.is_finite() {
            return Ok(());
        }
        let n = self.prior.len();
        let noise = self.motion.noise.powi(2) * (self.sums.squares / self.sums.count) + self.motion.idle_noise.powi(2);
        let noise = noise * inverse * inverse;
        for (index, (row, y)) in phi.values().chunks_exact(n).zip(y).enumerate() {
            adjoint(&self.covariance, row, &mut self.product);
            let least = SMALLEST_VARIANCE * self.mean_variance * dot(row, row);
            let variance = dot(row, &self.product).max(0.0) + noise.max(least);
            let innovation = y * inverse - dot(row, &self.shape);
            if !(variance.is_finite() && innovation.is_finite()) {
                let what = "the variance of its measurement";
                return Err(SequentialError::Overflow { index, what });
            }
            // a row without a weight says nothing
            let precision = if variance > 0.0 { 1.0 / variance.sqrt() } else { 0.0 };
            self.product.iter_mut().for_each(|u| *u *= precision);
            axpy(innovation * precision, &self.product, &mut self.shape);
            for (line, &u) in self.covariance.chunks_exact_mut(n).zip(&self.product) {
                axpy(-u, &self.product, line);
            }
        }
        Ok(())
    }

    fn keep_variances(&mut self) {
        let n = self.prior.len();
        for (i, (variance, line)) in self
            .variances
            .iter_mut()
            .zip(self.covariance.chunks_exact(n))
            .enumerate()
        {
            *variance = line[i];
        }
    }

    /// Image s û, length N, in the unit of the samples. It may have negative values.
    #[must_use]
    pub fn image(&self) -> &[f64] {
        &self.image
    }

    /// Strength s of the contact: the standard deviation of pixel i is s √Pᵢᵢ. 0 before the first sample.
    #[must_use]
    pub fn strength(&self) -> f64 {
        self.strength
    }

    /// Posterior covariance P of the shape, N × N.
    #[must_use]
    pub fn covariance(&self) -> &[f64] {
        &self.covariance
    }

    /// Expected intersection over union, in [0, 1], of the image's support with the true one, as
    /// [`super::SequentialEstimate::expected_iou`]: pixels above `threshold` times the maximum.
    #[must_use]
    pub fn expected_iou(&self, threshold: f64) -> f64 {
        expected_iou(&self.image, &self.image, &self.variances, self.strength, threshold)
    }
}
