//! Gaussian estimates for a fixed sensing matrix.

use super::gaussian::{smallest_variance, variance};
use super::nnqp::{self, Hessian, Lowered};
use super::prior::Gaussian;
use crate::kernels::{adjoint, axpy, dot};
use crate::matrix::MatrixView;
use crate::problem::RecoverError;
use crate::problem::{divide_into, operator_scale, power_of_two};
use crate::recover::prior::{Noise, ParameterError};
use nalgebra::{DMatrix, SymmetricEigen};
use std::sync::Arc;

/// The estimates of [`super::Lmmse`] and [`super::NnLmmse`] for one sensing matrix A (M × N) that is used for every
/// window, as by cells in pattern mode. All work that needs no sample is done once.
///
/// With A C Aᵀ = U Λ Uᵀ, x̂ = μ + Σₖ vₖ uₖᵀ(y − A μ) / (λₖ + σ²) with the images vₖ = C Aᵀ uₖ, for any noise σ². If the
/// noise is known in advance, x̂ = x₀ + G y. A sample then costs M or N products. After the last sample, the image
/// costs N M further ones or none. The largest numbers of A and y must lie between 1e-100 and 1e100.
/// Source: as [`super::Lmmse`]; Λ and U by the symmetric QR algorithm.
///
/// ```
/// use spts_recon::Matrix;
/// use spts_recon::recover::{Fixed, Gaussian, Noise};
/// use std::sync::Arc;
///
/// let rows = Matrix::from_rows(2, 3, vec![1.0, 1.0, -1.0, 1.0, -1.0, 1.0])?;
/// let fixed = Fixed::new(rows.view(), Arc::new(Gaussian::white(3, 1.0)?), Noise::Relative(0.1))?;
/// let mut window = fixed.window();
/// for sample in [1.0, 1.0] {
///     window.push(sample);
/// }
/// let image = window.image()?;
/// assert!(image[0] > 0.9 && image[1].abs() < 0.1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Fixed {
    prior: Arc<Gaussian>,
    noise: Noise,
    m: usize,
    /// Power of two that A is divided by.
    scale: f64,
    /// A, M × N.
    rows: Vec<f64>,
    smallest_variance: f64,
    linear: Linear,
}

/// How x̂ depends on the samples.
#[derive(Debug, Clone)]
enum Linear {
    /// x₀ + Σᵢ yᵢ gᵢ.
    Gain {
        variance: f64,
        /// x₀
        start: Vec<f64>,
        /// gᵢ, M × N.
        gain: Vec<f64>,
        /// Posterior covariance P, N × N.
        posterior: Vec<f64>,
    },
    /// μ + Σₖ vₖ tₖ / (λₖ + σ²), t = t₀ + Σᵢ yᵢ Uᵢ.
    Spectrum {
        /// t₀ = −Uᵀ A μ
        start: Vec<f64>,
        /// U, M × M.
        basis: Vec<f64>,
        /// Λ
        spectrum: Vec<f64>,
        /// vₖ, M × N.
        images: Vec<f64>,
    },
}

/// Most measurements: their spectrum takes O(M³).
const MOST_MEASUREMENTS: usize = 4096;
/// Why a [`Fixed`] estimate cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FixedError {
    /// An operator that does not fit the prior, has no rows, or an entry that is not finite.
    #[error(transparent)]
    Operator(#[from] RecoverError),
    /// A noise level outside its range, or too many measurements.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
}

/// Share of the largest pixel by which a pixel is below zero that the first guess lifts.
const HARDLY: f64 = 0.04;

impl Fixed {
    /// Estimates under `prior` from measurements with `operator` (M × N) and `noise`.
    ///
    /// # Errors
    /// [`FixedError`] if the operator has another number of columns than the prior, no row, more than 4096 rows or an
    /// entry that is not finite, or if the noise is outside its range.
    pub fn new(operator: MatrixView<'_>, prior: Arc<Gaussian>, noise: Noise) -> Result<Self, FixedError> {
        let (m, n) = (operator.nrows(), operator.ncols());
        let noise = noise.checked()?;
        if n != prior.len() {
            let expected = prior.len();
            return Err(RecoverError::Columns { cols: n, expected }.into());
        }
        if m == 0 {
            return Err(RecoverError::Empty { rows: m, cols: n }.into());
        }
        if m > MOST_MEASUREMENTS {
            return Err(ParameterError {
                field: "measurements",
                value: m as f64,
                range: "[1, 4096]",
            }
            .into());
        }
        let scale = operator_scale(operator)?;
        let mut rows = Vec::new();
        divide_into(operator.values(), scale, &mut rows);
        let smallest_variance = smallest_variance(&rows, m, &prior);
        let mut linear = Linear::spectrum(&rows, m, &prior);
        if let Noise::Absolute(deviation) = noise {
            linear = linear.at(variance(deviation / scale, smallest_variance), &rows, &prior);
        }
        Ok(Self {
            prior,
            noise,
            m,
            scale,
            rows,
            smallest_variance,
            linear,
        })
    }

    /// Number of measurements in a window.
    #[must_use]
    pub fn measurements(&self) -> usize {
        self.m
    }

    /// Number of pixels in an image.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.prior.len()
    }

    /// A window whose samples are added one by one.
    #[must_use]
    pub fn window(&self) -> FixedWindow<'_> {
        let mut window = FixedWindow {
            fixed: self,
            samples: Vec::with_capacity(self.m),
            sums: Vec::new(),
            shares: Vec::new(),
            image: vec![0.0; self.pixels()],
            linear_part: vec![0.0; self.pixels()],
            forces: Vec::new(),
            work: nnqp::Buffers::default(),
        };
        window.clear();
        window
    }
}

impl Linear {
    fn spectrum(rows: &[f64], m: usize, prior: &Gaussian) -> Self {
        let n = prior.len();
        let mut cross = vec![0.0; m * n];
        for (cross, row) in cross.chunks_exact_mut(n).zip(rows.chunks_exact(n)) {
            // C is symmetric
            adjoint(prior.covariance().view().values(), row, cross);
        }
        let system = DMatrix::from_fn(m, m, |i, j| {
            let (i, j) = (i.min(j), i.max(j));
            dot(&cross[i * n..(i + 1) * n], &rows[j * n..(j + 1) * n])
        });
        let eigen = SymmetricEigen::new(system);
        let mut images = vec![0.0; m * n];
        for (k, image) in images.chunks_exact_mut(n).enumerate() {
            for (row, &share) in cross.chunks_exact(n).zip(eigen.eigenvectors.column(k).iter()) {
                axpy(share, row, image);
            }
        }
        let basis: Vec<f64> = (0..m * m).map(|e| eigen.eigenvectors[(e / m, e % m)]).collect();
        let mut start = vec![0.0; m];
        for (row, basis) in rows.chunks_exact(n).zip(basis.chunks_exact(m)) {
            axpy(-dot(row, prior.mean()), basis, &mut start);
        }
        Self::Spectrum {
            start,
            basis,
            spectrum: eigen.eigenvalues.iter().map(|v| v.max(0.0)).collect(),
            images,
        }
    }

    /// The same at one noise.
    fn at(self, variance: f64, rows: &[f64], prior: &Gaussian) -> Self {
        let Self::Spectrum {
            basis,
            spectrum,
            images,
            ..
        } = self
        else {
            return self;
        };
        let (m, n) = (spectrum.len(), prior.len());
        let mut gain = vec![0.0; m * n];
        for (gain, basis) in gain.chunks_exact_mut(n).zip(basis.chunks_exact(m)) {
            for ((image, u), lambda) in images.chunks_exact(n).zip(basis).zip(&spectrum) {
                axpy(u / (lambda + variance), image, gain);
            }
        }
        let mut start = prior.mean().to_vec();
        for (row, gain) in rows.chunks_exact(n).zip(gain.chunks_exact(n)) {
            axpy(-dot(row, prior.mean()), gain, &mut start);
        }
        let mut posterior = prior.covariance().view().values().to_vec();
        for (image, lambda) in images.chunks_exact(n).zip(&spectrum) {
            for (row, v) in posterior.chunks_exact_mut(n).zip(image) {
                axpy(-v / (lambda + variance), image, row);
            }
        }
        Self::Gain {
            variance,
            start,
            gain,
            posterior,
        }
    }
}

/// A window measured with a [`Fixed`] sensing matrix, sample by sample. Memory is kept from window to window.
#[derive(Debug)]
pub struct FixedWindow<'a> {
    fixed: &'a Fixed,
    /// Samples so far, divided by the scale.
    samples: Vec<f64>,
    /// Sum over the samples: the image, or t.
    sums: Vec<f64>,
    /// 1/(λₖ + σ²).
    shares: Vec<f64>,
    image: Vec<f64>,
    /// x̂ or h, with the sign and scale of the quadratic program.
    linear_part: Vec<f64>,
    /// Forces that raise pixels to zero.
    forces: Vec<f64>,
    work: nnqp::Buffers,
}

impl FixedWindow<'_> {
    /// Starts another window.
    pub fn clear(&mut self) {
        self.samples.clear();
        self.sums.clear();
        let (Linear::Gain { start, .. } | Linear::Spectrum { start, .. }) = &self.fixed.linear;
        self.sums.extend_from_slice(start);
    }

    /// Adds the next sample, V. Samples after the last measurement are ignored.
    pub fn push(&mut self, sample: f64) {
        let (k, sample) = (self.samples.len(), sample / self.fixed.scale);
        if k == self.fixed.m {
            return;
        }
        self.samples.push(sample);
        let (Linear::Gain { gain: shares, .. } | Linear::Spectrum { basis: shares, .. }) = &self.fixed.linear;
        let width = self.sums.len();
        axpy(sample, &shares[k * width..(k + 1) * width], &mut self.sums);
    }

    /// Adds samples up to the last measurement.
    pub fn extend(&mut self, samples: &[f64]) {
        samples.iter().for_each(|sample| self.push(*sample));
    }

    /// The linear estimate, as [`super::Lmmse`] gives it.
    ///
    /// # Errors
    /// [`RecoverError::ShapeMismatch`] before the last sample, [`RecoverError::NotFinite`] if a sample is not finite.
    pub fn image(&mut self) -> Result<&[f64], RecoverError> {
        self.estimate()?;
        Ok(&self.image)
    }

    /// x̂ → `image`; the noise variance.
    fn estimate(&mut self) -> Result<f64, RecoverError> {
        let fixed = self.fixed;
        if self.samples.len() < fixed.m {
            return Err(RecoverError::ShapeMismatch {
                rows: fixed.m,
                len: self.samples.len(),
            });
        }
        let variance = match &fixed.linear {
            Linear::Gain { variance, .. } => {
                self.image.copy_from_slice(&self.sums);
                *variance
            }
            Linear::Spectrum { spectrum, images, .. } => {
                // deviations are shares of the samples, which are scaled
                let variance = variance(fixed.noise.deviation(&self.samples), fixed.smallest_variance);
                self.shares.clear();
                self.shares
                    .extend(spectrum.iter().map(|lambda| 1.0 / (lambda + variance)));
                self.forces.clear();
                self.forces
                    .extend(self.sums.iter().zip(&self.shares).map(|(t, share)| t * share));
                adjoint(images, &self.forces, &mut self.image);
                axpy(1.0, fixed.prior.mean(), &mut self.image);
                variance
            }
        };
        if self.image.iter().all(|x| x.is_finite()) {
            return Ok(variance);
        }
        let index = self.samples.iter().position(|v| !v.is_finite()).unwrap_or_default();
        Err(RecoverError::NotFinite {
            index,
            value: self.samples[index] * fixed.scale,
        })
    }

    /// The most probable image without negative pixels, as [`super::NnLmmse`] gives it: x̂ + P f with the posterior
    /// covariance P and the smallest forces f ≥ 0 that raise every pixel to zero. If most pixels would have to be
    /// raised, the program of [`super::NnLmmse`] itself is solved.
    ///
    /// # Errors
    /// As [`FixedWindow::image`], and [`RecoverError::NotConverged`].
    pub fn non_negative(&mut self) -> Result<&[f64], RecoverError> {
        let variance = self.estimate()?;
        let most = self.image.iter().fold(0.0_f64, |most, v| most.max(*v));
        self.forces.clear();
        let lifts = |x: &f64| if *x < -HARDLY * most { 1.0 } else { 0.0 };
        self.forces.extend(self.image.iter().map(lifts));
        let lifted = self.forces.iter().filter(|f| **f > 0.0).count();
        let negative = self.image.iter().any(|x| *x < 0.0);
        if negative && (2 * lifted > self.image.len() || !self.lifted()) {
            self.solve(variance)?;
        }
        Ok(&self.image)
    }

    /// Lifts the pixels of x̂ below zero, with a guess in `forces` of which have to be; whether that is done, which it
    /// is not where P is singular to rounding.
    fn lifted(&mut self) -> bool {
        let fixed = self.fixed;
        let scale = power_of_two(&self.image);
        for (linear, x) in self.linear_part.iter_mut().zip(&self.image) {
            *linear = -x / scale;
        }
        let posterior = match &fixed.linear {
            Linear::Gain { posterior, .. } => Lowered {
                matrix: posterior,
                rows: &[],
                shares: &[],
            },
            Linear::Spectrum { images, .. } => Lowered {
                matrix: fixed.prior.covariance().view().values(),
                rows: images,
                shares: &self.shares,
            },
        };
        if nnqp::minimise(&posterior, &self.linear_part, &mut self.forces, &mut self.work).is_err() {
            return false;
        }
        for ((x, force), lift) in self.image.iter_mut().zip(&self.forces).zip(self.work.product()) {
            *x = if *force > 0.0 {
                0.0
            } else {
                (*x + lift * scale).max(0.0)
            };
        }
        true
    }

    /// The program of [`super::NnLmmse`], from the x̂ in `image`.
    fn solve(&mut self, variance: f64) -> Result<(), RecoverError> {
        let fixed = self.fixed;
        // h = Aᵀ y + σ² C⁻¹ μ
        adjoint(&fixed.rows, &self.samples, &mut self.linear_part);
        axpy(variance, fixed.prior.natural(), &mut self.linear_part);
        let scale = power_of_two(&self.linear_part);
        self.linear_part.iter_mut().for_each(|h| *h /= scale);
        let hessian = Hessian {
            rows: &fixed.rows,
            variance,
            precision: fixed.prior.precision().view().values(),
        };
        nnqp::minimise(&hessian, &self.linear_part, &mut self.image, &mut self.work)?;
        self.image.iter_mut().for_each(|x| *x *= scale);
        Ok(())
    }
}
