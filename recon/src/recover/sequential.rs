//! Linear Gaussian estimates with their posterior covariance: sample by sample, and of an image that changes in time.

use crate::checks::within;
use crate::kernels::{axpy, dot};
use crate::matrix::MatrixView;
use crate::posterior::GaussianPosterior;
use crate::recover::gaussian::SMALLEST_VARIANCE;
use crate::recover::prior::{Gaussian, Noise, positive};
use libm::erfc;
use spts_input::Refusal;
use std::f64::consts::FRAC_1_SQRT_2;
use std::sync::Arc;

/// Gains and posterior variances for [`SequentialEstimate`], row by row: everything that needs no sample.
///
/// A row a of weights is a rank-one update, starting from P = C: u = P a, q = aᵀ u + ν, gain g = u / q, P ← P − u uᵀ /
/// q. It costs O(N²). If every window has its own rows, [`Self::push`] each row before its sample, and [`Self::clear`]
/// at the end of the window. For a fixed sensing matrix, push all rows once: every window uses them, and a sample costs
/// O(N).
///
/// With [`Noise::Absolute`] the prior is x ~ N(μ, C), and the noise variance is ν = σ². With [`Noise::Relative`] image
/// and noise have a common unknown scale s: x ~ N(0, s² C), and the noise is N(0, s² ν) with ν = share² ‖a‖² tr C / N.
/// This is the share of the measurements' root mean square, with the mean square estimated from the prior instead of
/// the samples, so that P does not depend on the samples. The scale is estimated from the samples: ŝ² = Σ ε²/q / M with
/// the innovations ε, under the prior density 1/s.
///
/// Source: R. E. Kalman, "A new approach to linear filtering and prediction problems", J. Basic Eng. 82 (1960), with a
/// constant state; for the unknown scale, A. Gelman and others, *Bayesian Data Analysis* (2013), §14.2.
///
/// ```
/// use spts_recon::recover::{Gaussian, Noise, SequentialEstimate, SequentialGains};
/// use std::sync::Arc;
///
/// let mut gains = SequentialGains::new(Arc::new(Gaussian::white(3, 1.0)?), Noise::Relative(0.1))?;
/// let mut estimate = SequentialEstimate::new(&gains);
/// for (row, y) in [([1.0, 1.0, -1.0], 2.0), ([1.0, -1.0, 1.0], 2.0), ([-1.0, 1.0, 1.0], -2.0)] {
///     gains.push(&row)?;
///     estimate.observe(&gains, y)?;
/// }
/// assert!(estimate.mean()[0] > 1.9 && estimate.mean()[1].abs() < 0.1);
/// assert!(estimate.expected_iou(&gains, 0.23) > 0.99);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct SequentialGains {
    prior: Arc<Gaussian>,
    noise: Noise,
    /// tr C / N.
    mean_variance: f64,
    count: usize,
    /// Rows a, M × N.
    rows: Vec<f64>,
    /// Gains g, M × N.
    gains: Vec<f64>,
    /// 1/√q of every row.
    precisions: Vec<f64>,
    /// Diagonals of P: before the first row, and after each. (M + 1) × N.
    variances: Vec<f64>,
    /// P after the last row, and P a divided by √q.
    posterior: GaussianPosterior,
}

/// The estimate from the samples so far. Memory is kept from window to window, and a sample allocates nothing.
#[derive(Debug, Clone)]
pub struct SequentialEstimate {
    /// μ, the initial estimate.
    start: Vec<f64>,
    mean: Vec<f64>,
    /// Σ ε²/q.
    squares: f64,
    count: usize,
    unknown_scale: bool,
}

/// Largest weight and largest sample: their squares stay finite.
pub(super) const LARGEST: f64 = 1e100;

impl SequentialGains {
    /// Gains under `prior`, without rows.
    ///
    /// # Errors
    /// [`Refusal`] if `noise` is outside its range, or relative while the prior has a mean.
    pub fn new(prior: Arc<Gaussian>, noise: Noise) -> Result<Self, Refusal> {
        let noise = noise.checked()?;
        if let (Noise::Relative(_), Some(index)) = (noise, prior.mean().iter().position(|v| *v != 0.0)) {
            let value = prior.mean()[index];
            return Err(with_mean(index, value));
        }
        let n = prior.len();
        let diagonal: Vec<f64> = (0..n).map(|i| prior.covariance().row(i)[i]).collect();
        Ok(Self {
            noise,
            mean_variance: diagonal.iter().sum::<f64>() / n as f64,
            count: 0,
            rows: Vec::new(),
            gains: Vec::new(),
            precisions: Vec::new(),
            variances: diagonal,
            posterior: GaussianPosterior::new(prior.covariance().view().values().to_vec(), n),
            prior,
        })
    }

    /// Adds the weights of the next measurement, each in ±1e100.
    ///
    /// # Errors
    /// [`Refusal`] if the row does not fit the image, a weight is not a number or out of range, or a variance
    /// overflows.
    pub fn push(&mut self, row: &[f64]) -> Result<(), Refusal> {
        let n = self.prior.len();
        if row.len() != n {
            return Err(other_weights(row.len(), n));
        }
        for &weight in row {
            within("weight", weight, -LARGEST, LARGEST)?;
        }
        let index = self.count;
        let signal = self.mean_variance * dot(row, row);
        let noise = match self.noise {
            Noise::Absolute(deviation) => deviation * deviation,
            Noise::Relative(share) => share * share * signal,
        };
        let variance = self.posterior.project(row).max(0.0) + noise.max(SMALLEST_VARIANCE * signal);
        if !variance.is_finite() {
            let what = "the variance of its measurement";
            return Err(row_overflow(index, what));
        }
        // a row without a weight says nothing
        let precision = if variance > 0.0 { 1.0 / variance.sqrt() } else { 0.0 };
        self.posterior.lower_scaled(precision);
        self.keep(row, precision);
        Ok(())
    }

    /// Stores what samples need of the row that P was updated with.
    fn keep(&mut self, row: &[f64], precision: f64) {
        let (n, at) = (row.len(), self.count);
        if self.precisions.len() == at {
            self.rows.resize((at + 1) * n, 0.0);
            self.gains.resize((at + 1) * n, 0.0);
            self.variances.resize((at + 2) * n, 0.0);
            self.precisions.push(0.0);
        }
        self.precisions[at] = precision;
        self.rows[at * n..][..n].copy_from_slice(row);
        for (gain, u) in self.gains[at * n..][..n].iter_mut().zip(&self.posterior.product) {
            *gain = u * precision;
        }
        let variances = self.variances[(at + 1) * n..][..n].iter_mut();
        variances.zip(self.posterior.variances()).for_each(|(to, variance)| *to = variance);
        self.count += 1;
    }

    /// Removes all rows and keeps the memory.
    pub fn clear(&mut self) {
        self.count = 0;
        self.posterior.covariance.copy_from_slice(self.prior.covariance().view().values());
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.count
    }

    /// Posterior covariance after the last row at scale 1, N × N.
    pub fn covariance(&self) -> &[f64] {
        &self.posterior.covariance
    }

    /// Posterior variances of the pixels after the first `rows` rows, at scale 1.
    fn variances(&self, rows: usize) -> &[f64] {
        let n = self.prior.len();
        &self.variances[rows * n..][..n]
    }
}

impl SequentialEstimate {
    /// An estimate without samples, for `gains`.
    pub fn new(gains: &SequentialGains) -> Self {
        Self {
            start: gains.prior.mean().to_vec(),
            mean: gains.prior.mean().to_vec(),
            squares: 0.0,
            count: 0,
            unknown_scale: matches!(gains.noise, Noise::Relative(_)),
        }
    }

    /// Removes all samples and keeps the memory.
    pub fn clear(&mut self) {
        self.mean.copy_from_slice(&self.start);
        self.squares = 0.0;
        self.count = 0;
    }

    /// Adds the sample `y`, in ±1e100, of the first row in `gains` without one: x̂ ← x̂ + g (y − aᵀ x̂).
    ///
    /// # Errors
    /// [`Refusal`] if there is no row for the sample, the gains belong to another image, `y` is not a number or
    /// out of range, or its squared innovation overflows.
    pub fn observe(&mut self, gains: &SequentialGains, y: f64) -> Result<(), Refusal> {
        let (n, at) = (self.mean.len(), self.count);
        if gains.prior.len() != n {
            return Err(other_weights(gains.prior.len(), n));
        }
        if at >= gains.count {
            return Err(row_missing(at, gains.count));
        }
        let y = within("y", y, -LARGEST, LARGEST)?;
        let innovation = y - dot(&gains.rows[at * n..][..n], &self.mean);
        let squares = self.squares + (innovation * gains.precisions[at]).powi(2);
        if !squares.is_finite() {
            let what = "the squared innovation of its sample";
            return Err(row_overflow(at, what));
        }
        axpy(innovation, &gains.gains[at * n..][..n], &mut self.mean);
        self.squares = squares;
        self.count += 1;
        Ok(())
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.count
    }

    /// Posterior mean x̂, length N, in the unit of the prior.
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Scale ŝ of image and noise: the standard deviation of pixel i is ŝ √Pᵢᵢ. 1 if the scale is known, and before the
    /// first sample.
    pub fn scale(&self) -> f64 {
        if self.unknown_scale && self.count > 0 { (self.squares / self.count as f64).sqrt() } else { 1.0 }
    }

    /// Expected intersection over union, in [0, 1], of the support of x̂ with the true one. The support is the set of
    /// taxels above `threshold` times the maximum, with the normal marginals of the posterior. 0 before the first
    /// sample.
    ///
    /// E\[IoU\] ≈ Σ_{i ∈ S} pᵢ / (|S| + Σ_{i ∉ S} pᵢ) with S the support of x̂ and pᵢ = P(xᵢ > `threshold`·max x̂).
    ///
    /// # Panics
    /// If `gains` holds fewer rows than there are samples.
    pub fn expected_iou(&self, gains: &SequentialGains, threshold: f64) -> f64 {
        if self.count == 0 {
            return 0.0;
        }
        expected_iou(&self.mean, gains.variances(self.count), self.scale(), threshold)
    }
}

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
    /// P, and P a divided by √q.
    posterior: GaussianPosterior,
    /// s û.
    image: Vec<f64>,
    /// s.
    strength: f64,
    sums: Sums,
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
    /// [`Refusal`] if a field of `motion` is outside its range, or the prior has a mean.
    pub fn new(prior: Arc<Gaussian>, motion: Motion) -> Result<Self, Refusal> {
        positive("memory", motion.memory)?;
        positive("strength_memory", motion.strength_memory)?;
        positive("noise", motion.noise)?;
        if !(motion.idle_noise >= 0.0 && motion.idle_noise <= LARGEST) {
            let (field, value, range) = ("idle_noise", motion.idle_noise, "[0, 1e100]");
            return Err(Refusal::range(field, value, range));
        }
        if let Some(index) = prior.mean().iter().position(|v| *v != 0.0) {
            let value = prior.mean()[index];
            return Err(with_mean(index, value));
        }
        let n = prior.len();
        let variances = (0..n).map(|i| prior.covariance().row(i)[i]);
        Ok(Self {
            motion,
            mean_variance: variances.sum::<f64>() / n as f64,
            shape: vec![0.0; n],
            posterior: GaussianPosterior::new(prior.covariance().view().values().to_vec(), n),
            image: vec![0.0; n],
            strength: 0.0,
            sums: Sums::default(),
            prior,
        })
    }

    /// Removes all samples and keeps the memory.
    pub fn clear(&mut self) {
        self.shape.fill(0.0);
        self.posterior.covariance.copy_from_slice(self.prior.covariance().view().values());
        self.image.fill(0.0);
        self.strength = 0.0;
        self.sums = Sums::default();
    }

    /// Adds the samples `y` of the rows of weights `phi` (M × N), at the time `elapsed`, in [0, ∞), after the previous
    /// window. Weights and samples are in ±1e100.
    ///
    /// # Errors
    /// [`Refusal`] if the window does not fit the image, holds a value that is not a number or out of range, or
    /// a variance overflows. In the last case the image must be cleared; otherwise it is unchanged.
    pub fn observe(&mut self, elapsed: f64, phi: MatrixView<'_>, y: &[f64]) -> Result<(), Refusal> {
        let n = self.prior.len();
        if phi.ncols() != n {
            let (cols, expected) = (phi.ncols(), n);
            return Err(other_weights(cols, expected));
        }
        if phi.nrows() != y.len() {
            let (index, prepared) = (y.len(), phi.nrows());
            return Err(row_missing(index, prepared));
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
        for (p, c) in self.posterior.covariance.iter_mut().zip(covariance.values()) {
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
    fn take(&mut self, phi: MatrixView<'_>, y: &[f64]) -> Result<(), Refusal> {
        let inverse = 1.0 / self.strength;
        // without an output there is nothing to learn of the shape
        if !inverse.is_finite() {
            return Ok(());
        }
        let n = self.prior.len();
        let noise = self.motion.noise.powi(2) * (self.sums.squares / self.sums.count) + self.motion.idle_noise.powi(2);
        let noise = noise * inverse * inverse;
        for (index, (row, y)) in phi.values().chunks_exact(n).zip(y).enumerate() {
            let least = SMALLEST_VARIANCE * self.mean_variance * dot(row, row);
            let variance = self.posterior.project(row).max(0.0) + noise.max(least);
            let innovation = y * inverse - dot(row, &self.shape);
            if !(variance.is_finite() && innovation.is_finite()) {
                let what = "the variance of its measurement";
                return Err(row_overflow(index, what));
            }
            // a row without a weight says nothing
            let precision = if variance > 0.0 { 1.0 / variance.sqrt() } else { 0.0 };
            self.posterior.lower_scaled(precision);
            axpy(innovation * precision, &self.posterior.product, &mut self.shape);
        }
        Ok(())
    }

    /// Image s û, length N, in the unit of the samples. It may have negative values.
    pub fn image(&self) -> &[f64] {
        &self.image
    }

    /// Posterior covariance P of the shape, N × N.
    pub fn covariance(&self) -> &[f64] {
        &self.posterior.covariance
    }
}

/// Intersection over union that the support of an image is expected to have with the true one.
///
/// The support S of the image holds the taxels above τ = `threshold`·max(image). With pᵢ = P(xᵢ > τ) by the normal
/// marginals of mean `mean` and deviation `scale`·√`variances`,
///
/// E\[IoU\] ≈ Σ_{i ∈ S} pᵢ / (|S| + Σ_{i ∉ S} pᵢ):
///
/// the expected intersection over the expected union. Three things are approximate: the ratio of expectations stands
/// for the expectation of the ratio, τ is that of the image and not of the true one, and the noise is Gaussian. An
/// image without a positive taxel has the answer 0.
fn expected_iou(mean: &[f64], variances: &[f64], scale: f64, threshold: f64) -> f64 {
    let level = threshold * mean.iter().copied().fold(0.0, f64::max);
    let (mut both, mut union) = (0.0, 0.0);
    for (&mean, &variance) in mean.iter().zip(variances) {
        let above = probability_above(level, mean, scale * variance.max(0.0).sqrt());
        if mean > level {
            both += above;
            union += 1.0;
        } else {
            union += above;
        }
    }
    if both > 0.0 { both / union } else { 0.0 }
}

/// P(x > `level`) for x ~ N(`mean`, `deviation`²).
fn probability_above(level: f64, mean: f64, deviation: f64) -> f64 {
    let distance = level - mean;
    if deviation > 0.0 {
        0.5 * erfc(FRAC_1_SQRT_2 * (distance / deviation))
    } else if distance < 0.0 {
        1.0
    } else {
        0.0
    }
}

fn with_mean(index: usize, value: f64) -> Refusal {
    Refusal::new(format!("a prior of unknown scale has mean 0, but `mean[{index}]` = {value}"))
}

fn other_weights(cols: usize, expected: usize) -> Refusal {
    Refusal::new(format!("the row has {cols} weights, expected {expected}"))
}

fn row_missing(index: usize, prepared: usize) -> Refusal {
    Refusal::new(format!("sample {index} arrived, but only {prepared} rows are there"))
}

fn row_overflow(index: usize, what: &str) -> Refusal {
    Refusal::new(format!("row {index} makes {what} overflow"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two taxels in the support, two outside; every probability from a table of the normal distribution
    /// (M. Abramowitz, I. Stegun, *Handbook of Mathematical Functions* (1964), table 26.1, ten digits).
    #[test]
    fn a_case_by_hand() {
        let (one, two) = (0.841_344_746_068_5, 0.977_249_868_051_8);
        let mean = [3.0, 2.0, 0.0, -1.0];
        // the level is 1: distances of two, one, one and two deviations
        let found = expected_iou(&mean, &[0.25; 4], 2.0, 1.0 / 3.0);
        let expected = (two + one) / (2.0 + (1.0 - one) + (1.0 - two));
        assert!((found - expected).abs() < 1e-10, "{found}, expected {expected}");
    }

    #[test]
    fn without_doubt_it_is_one_and_without_an_image_zero() {
        let image = [1.0, 0.2, 0.0];
        assert!((expected_iou(&image, &[0.0; 3], 1.0, 0.23) - 1.0).abs() < 1e-15);
        assert!((expected_iou(&image, &[1e-20; 3], 1e-3, 0.23) - 1.0).abs() < 1e-15);
        for image in [[0.0; 3], [-1.0; 3], [f64::NAN; 3]] {
            assert!(expected_iou(&image, &[1.0; 3], 1.0, 0.23) <= 0.0);
        }
    }
}
