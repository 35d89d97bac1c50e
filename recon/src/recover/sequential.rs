//! The linear Gaussian estimate sample by sample, with its posterior covariance.

use super::expected_iou::expected_iou;
use super::gaussian::SMALLEST_VARIANCE;
use super::parameter::{Noise, ParameterError};
use super::prior::Gaussian;
use crate::checks::{RangeError, within};
use crate::kernels::{adjoint, axpy, dot};
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
    /// P after the last row, N × N.
    covariance: Vec<f64>,
    /// P a, and later the same divided by √q.
    product: Vec<f64>,
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

/// Why a row or a sample is refused. Nothing has changed then.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SequentialError {
    /// The noise is outside its range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A prior with a mean, while the scale of the image is unknown.
    #[error("a prior of unknown scale has mean 0, but `mean[{index}]` = {value}")]
    Mean {
        /// Index of the first entry that is not zero.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// The number of weights in a row differs from the number of pixels.
    #[error("the row has {cols} weights, expected {expected}")]
    Columns {
        /// Weights of the row.
        cols: usize,
        /// Pixels of the image.
        expected: usize,
    },
    /// A weight or a sample that is not a number, or too large.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// A variance or a squared innovation exceeds the range of numbers.
    #[error("row {index} makes {what} overflow")]
    Overflow {
        /// Number of the row.
        index: usize,
        /// Which quantity.
        what: &'static str,
    },
    /// A sample arrived before its row.
    #[error("sample {index} arrived, but only {prepared} rows are there")]
    NotPrepared {
        /// Number of the sample.
        index: usize,
        /// Number of rows.
        prepared: usize,
    },
}

/// Largest weight and largest sample: their squares stay finite.
pub(super) const LARGEST: f64 = 1e100;

impl SequentialGains {
    /// Gains under `prior`, without rows.
    ///
    /// # Errors
    /// [`SequentialError`] if `noise` is outside its range, or relative while the prior has a mean.
    pub fn new(prior: Arc<Gaussian>, noise: Noise) -> Result<Self, SequentialError> {
        let noise = noise.checked()?;
        if let (Noise::Relative(_), Some(index)) = (noise, prior.mean().iter().position(|v| *v != 0.0)) {
            let value = prior.mean()[index];
            return Err(SequentialError::Mean { index, value });
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
            covariance: prior.covariance().view().values().to_vec(),
            product: vec![0.0; n],
            prior,
        })
    }

    /// Adds the weights of the next measurement, each in ±1e100.
    ///
    /// # Errors
    /// [`SequentialError`] if the row does not fit the image, a weight is not a number or out of range, or a variance
    /// overflows.
    pub fn push(&mut self, row: &[f64]) -> Result<(), SequentialError> {
        let n = self.prior.len();
        if row.len() != n {
            return Err(SequentialError::Columns {
                cols: row.len(),
                expected: n,
            });
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
        // P is symmetric
        adjoint(&self.covariance, row, &mut self.product);
        let variance = dot(row, &self.product).max(0.0) + noise.max(SMALLEST_VARIANCE * signal);
        if !variance.is_finite() {
            let what = "the variance of its measurement";
            return Err(SequentialError::Overflow { index, what });
        }
        // a row without a weight says nothing
        let precision = if variance > 0.0 { 1.0 / variance.sqrt() } else { 0.0 };
        self.product.iter_mut().for_each(|u| *u *= precision);
        for (line, &u) in self.covariance.chunks_exact_mut(n).zip(&self.product) {
            axpy(-u, &self.product, line);
        }
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
        for (gain, u) in self.gains[at * n..][..n].iter_mut().zip(&self.product) {
            *gain = u * precision;
        }
        let variances = &mut self.variances[(at + 1) * n..][..n];
        for (i, (variance, line)) in variances.iter_mut().zip(self.covariance.chunks_exact(n)).enumerate() {
            *variance = line[i];
        }
        self.count += 1;
    }

    /// Removes all rows and keeps the memory.
    pub fn clear(&mut self) {
        self.count = 0;
        self.covariance.copy_from_slice(self.prior.covariance().view().values());
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.count
    }

    /// Posterior covariance after the last row at scale 1, N × N.
    #[must_use]
    pub fn covariance(&self) -> &[f64] {
        &self.covariance
    }

    /// Posterior variances of the pixels after the first `rows` rows, at scale 1.
    fn variances(&self, rows: usize) -> &[f64] {
        let n = self.prior.len();
        &self.variances[rows * n..][..n]
    }
}

impl SequentialEstimate {
    /// An estimate without samples, for `gains`.
    #[must_use]
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
    /// [`SequentialError`] if there is no row for the sample, the gains belong to another image, `y` is not a number or
    /// out of range, or its squared innovation overflows.
    pub fn observe(&mut self, gains: &SequentialGains, y: f64) -> Result<(), SequentialError> {
        let (n, at) = (self.mean.len(), self.count);
        if gains.prior.len() != n {
            return Err(SequentialError::Columns {
                cols: gains.prior.len(),
                expected: n,
            });
        }
        if at >= gains.count {
            return Err(SequentialError::NotPrepared {
                index: at,
                prepared: gains.count,
            });
        }
        let y = within("y", y, -LARGEST, LARGEST)?;
        let innovation = y - dot(&gains.rows[at * n..][..n], &self.mean);
        let squares = self.squares + (innovation * gains.precisions[at]).powi(2);
        if !squares.is_finite() {
            let what = "the squared innovation of its sample";
            return Err(SequentialError::Overflow { index: at, what });
        }
        axpy(innovation, &gains.gains[at * n..][..n], &mut self.mean);
        self.squares = squares;
        self.count += 1;
        Ok(())
    }

    /// Number of samples.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.count
    }

    /// Posterior mean x̂, length N, in the unit of the prior.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Scale ŝ of image and noise: the standard deviation of pixel i is ŝ √Pᵢᵢ. 1 if the scale is known, and before the
    /// first sample.
    #[must_use]
    pub fn scale(&self) -> f64 {
        if self.unknown_scale && self.count > 0 {
            (self.squares / self.count as f64).sqrt()
        } else {
            1.0
        }
    }

    /// Expected intersection over union, in [0, 1], of the support of x̂ with the true one. The support is the set of
    /// taxels above `threshold` times the maximum, with the normal marginals of the posterior. 0 before the first
    /// sample.
    ///
    /// E\[IoU\] ≈ Σ_{i ∈ S} pᵢ / (|S| + Σ_{i ∉ S} pᵢ) with S the support of x̂ and pᵢ = P(xᵢ > `threshold`·max x̂).
    ///
    /// # Panics
    /// If `gains` holds fewer rows than there are samples.
    #[must_use]
    pub fn expected_iou(&self, gains: &SequentialGains, threshold: f64) -> f64 {
        self.expected_iou_of(&self.mean, gains, threshold)
    }

    /// As [`Self::expected_iou`], for the support of `image`, which may be another estimate from the same samples.
    ///
    /// # Panics
    /// As [`Self::expected_iou`].
    #[must_use]
    pub fn expected_iou_of(&self, image: &[f64], gains: &SequentialGains, threshold: f64) -> f64 {
        if self.count == 0 {
            return 0.0;
        }
        expected_iou(image, &self.mean, gains.variances(self.count), self.scale(), threshold)
    }
}
