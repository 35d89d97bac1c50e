//! Gaussian estimates for a fixed sensing matrix.

use super::gaussian::{smallest_variance, variance};
use super::nnqp::{self, Hessian, Lowered};
use super::prior::Gaussian;
use crate::checks::{empty, not_finite, other_columns, shape_mismatch};
use crate::kernels::{adjoint, axpy, dot};
use crate::matrix::MatrixView;
use crate::problem::{divide_into, operator_scale, power_of_two};
use crate::recover::prior::Noise;
use nalgebra::{DMatrix, SymmetricEigen};
use spts_input::Refusal;
use std::sync::Arc;

/// The estimates of [`super::Lmmse`] and [`super::NnLmmse`] for one sensing matrix A (M × N) that is used for every
/// window, as by cells in pattern mode. All work that needs no sample is done once.
///
/// With A C Aᵀ = U Λ Uᵀ, x̂ = μ + Σₖ vₖ uₖᵀ(y − A μ) / (λₖ + σ²) with the images vₖ = C Aᵀ uₖ, for any noise σ². A
/// sample then costs M products, and the image N M further ones after the last sample. The largest numbers of A and y
/// must lie between 1e-100 and 1e100.
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
    /// t₀ = −Uᵀ A μ
    start: Vec<f64>,
    /// U, M × M.
    basis: Vec<f64>,
    /// Λ
    spectrum: Vec<f64>,
    /// vₖ, M × N.
    images: Vec<f64>,
}

/// Most measurements: their spectrum takes O(M³).
const MOST_MEASUREMENTS: usize = 4096;
/// Share of the largest pixel by which a pixel is below zero that the first guess lifts.
const HARDLY: f64 = 0.04;

impl Fixed {
    /// Estimates under `prior` from measurements with `operator` (M × N) and `noise`.
    ///
    /// # Errors
    /// [`Refusal`] if the operator has another number of columns than the prior, no row, more than 4096 rows or an
    /// entry that is not finite, or if the noise is outside its range.
    pub fn new(operator: MatrixView<'_>, prior: Arc<Gaussian>, noise: Noise) -> Result<Self, Refusal> {
        let (m, n) = (operator.nrows(), operator.ncols());
        let noise = noise.checked()?;
        if n != prior.len() {
            let expected = prior.len();
            return Err(other_columns(n, expected));
        }
        if m == 0 {
            return Err(empty(m, n));
        }
        if m > MOST_MEASUREMENTS {
            return Err(Refusal::range("measurements", m as f64, "[1, 4096]"));
        }
        let scale = operator_scale(operator)?;
        let mut rows = Vec::new();
        divide_into(operator.values(), scale, &mut rows);
        let smallest_variance = smallest_variance(&rows, m, &prior);
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
        Ok(Self {
            prior,
            noise,
            m,
            scale,
            rows,
            smallest_variance,
            start,
            basis,
            spectrum: eigen.eigenvalues.iter().map(|v| v.max(0.0)).collect(),
            images,
        })
    }

    /// Number of measurements in a window.
    pub fn measurements(&self) -> usize {
        self.m
    }

    /// Number of pixels in an image.
    pub fn pixels(&self) -> usize {
        self.prior.len()
    }

    /// A window whose samples are added one by one.
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

/// A window measured with a [`Fixed`] sensing matrix, sample by sample. Memory is kept from window to window.
#[derive(Debug)]
pub struct FixedWindow<'a> {
    fixed: &'a Fixed,
    /// Samples so far, divided by the scale.
    samples: Vec<f64>,
    /// t = t₀ + Σᵢ yᵢ Uᵢ over the samples.
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
        self.sums.extend_from_slice(&self.fixed.start);
    }

    /// Adds the next sample, V. Samples after the last measurement are ignored.
    pub fn push(&mut self, sample: f64) {
        let (k, sample) = (self.samples.len(), sample / self.fixed.scale);
        if k == self.fixed.m {
            return;
        }
        self.samples.push(sample);
        let m = self.fixed.m;
        axpy(sample, &self.fixed.basis[k * m..(k + 1) * m], &mut self.sums);
    }

    /// Adds samples up to the last measurement.
    pub fn extend(&mut self, samples: &[f64]) {
        samples.iter().for_each(|sample| self.push(*sample));
    }

    /// The linear estimate, as [`super::Lmmse`] gives it.
    ///
    /// # Errors
    /// [`Refusal`] before the last sample, [`Refusal`] if a sample is not finite.
    pub fn image(&mut self) -> Result<&[f64], Refusal> {
        self.estimate()?;
        Ok(&self.image)
    }

    /// x̂ → `image`; the noise variance.
    fn estimate(&mut self) -> Result<f64, Refusal> {
        let fixed = self.fixed;
        if self.samples.len() < fixed.m {
            return Err(shape_mismatch(fixed.m, self.samples.len()));
        }
        // deviations are shares of the samples, or divided by the scale as these are
        let deviation = match fixed.noise {
            Noise::Absolute(deviation) => deviation / fixed.scale,
            relative => relative.deviation(&self.samples),
        };
        let variance = variance(deviation, fixed.smallest_variance);
        self.shares.clear();
        self.shares.extend(fixed.spectrum.iter().map(|lambda| 1.0 / (lambda + variance)));
        self.forces.clear();
        self.forces.extend(self.sums.iter().zip(&self.shares).map(|(t, share)| t * share));
        adjoint(&fixed.images, &self.forces, &mut self.image);
        axpy(1.0, fixed.prior.mean(), &mut self.image);
        if self.image.iter().all(|x| x.is_finite()) {
            return Ok(variance);
        }
        let index = self.samples.iter().position(|v| !v.is_finite()).unwrap_or_default();
        Err(not_finite(index, self.samples[index] * fixed.scale))
    }

    /// The most probable image without negative pixels, as [`super::NnLmmse`] gives it: x̂ + P f with the posterior
    /// covariance P and the smallest forces f ≥ 0 that raise every pixel to zero. If most pixels would have to be
    /// raised, the program of [`super::NnLmmse`] itself is solved.
    ///
    /// # Errors
    /// As [`FixedWindow::image`], and [`Refusal`].
    pub fn non_negative(&mut self) -> Result<&[f64], Refusal> {
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
        let posterior =
            Lowered { matrix: fixed.prior.covariance().view().values(), rows: &fixed.images, shares: &self.shares };
        if nnqp::minimise(&posterior, &self.linear_part, &mut self.forces, &mut self.work).is_err() {
            return false;
        }
        for ((x, force), lift) in self.image.iter_mut().zip(&self.forces).zip(self.work.product()) {
            *x = if *force > 0.0 { 0.0 } else { (*x + lift * scale).max(0.0) };
        }
        true
    }

    /// The program of [`super::NnLmmse`], from the x̂ in `image`.
    fn solve(&mut self, variance: f64) -> Result<(), Refusal> {
        let fixed = self.fixed;
        // h = Aᵀ y + σ² C⁻¹ μ
        adjoint(&fixed.rows, &self.samples, &mut self.linear_part);
        axpy(variance, fixed.prior.natural(), &mut self.linear_part);
        let scale = power_of_two(&self.linear_part);
        self.linear_part.iter_mut().for_each(|h| *h /= scale);
        let hessian = Hessian { rows: &fixed.rows, variance, precision: fixed.prior.precision().view().values() };
        nnqp::minimise(&hessian, &self.linear_part, &mut self.image, &mut self.work)?;
        self.image.iter_mut().for_each(|x| *x *= scale);
        Ok(())
    }
}
