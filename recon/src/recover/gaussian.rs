//! Estimates of images under a Gaussian prior: linear, and non-negative.

use crate::checks::{not_positive_definite, other_columns, overflow};
use crate::cholesky;
use crate::kernels::{add_gram, adjoint, axpy, dot, norm};
use crate::matrix::MatrixView;
use crate::problem::{Problem, Recover, Solution, Workspace, divide_into, operator_scale, power_of_two};
use crate::recover::nnqp::{self, Hessian};
use crate::recover::prior::{Gaussian, Noise};
use spts_input::Refusal;
use std::sync::Arc;

/// Smallest noise variance, as a share of ‖A‖² tr(C) / (M N), the mean variance that the signal gives a measurement
/// when its entries are independent: keeps the normal equations well posed in double precision.
pub(super) const SMALLEST_VARIANCE: f64 = 1e-12;
/// Largest noise deviation; its square is still finite.
const LARGEST_DEVIATION: f64 = 1e150;

/// Memory of the Gaussian estimators.
#[derive(Debug, Default)]
pub(super) struct GaussianScratch {
    /// The operator, divided by its scale, M × N.
    pub(super) operator: Vec<f64>,
    /// Its columns, one after the other.
    columns: Vec<f64>,
    /// y in the same units.
    pub(super) y: Vec<f64>,
    /// y − A μ
    pub(super) innovation: Vec<f64>,
    /// A C, M × N.
    pub(super) cross: Vec<f64>,
    /// A C Aᵀ + σ² I (M × M) or Aᵀ A + σ² C⁻¹ (N × N).
    pub(super) system: Vec<f64>,
    /// Solution of the system.
    pub(super) weights: Vec<f64>,
    pub(super) x: Vec<f64>,
    /// C Aᵀ (y − A μ)
    pub(super) direction: Vec<f64>,
    residual: Vec<f64>,
    pub(super) pivoting: super::nnqp::Buffers,
}

/// A problem with its prior, divided by the scale of the operator.
pub(super) struct Model<'p, 'w> {
    pub(super) m: usize,
    pub(super) n: usize,
    pub(super) prior: &'p Gaussian,
    /// Noise variance σ² of the scaled measurements.
    pub(super) variance: f64,
    scale: f64,
    pub(super) work: &'w mut GaussianScratch,
}

impl<'p, 'w> Model<'p, 'w> {
    pub(super) fn new(
        problem: &Problem<'_>,
        prior: &'p Gaussian,
        noise: Noise,
        work: &'w mut GaussianScratch,
    ) -> Result<Self, Refusal> {
        let (a, y) = (problem.matrix(), problem.y());
        let (m, n) = (a.nrows(), a.ncols());
        if n != prior.len() {
            return Err(other_columns(n, prior.len()));
        }
        let scale = operator_scale(a)?;
        divide_into(a.values(), scale, &mut work.operator);
        work.innovation.clear();
        divide_into(y, scale, &mut work.y);
        for (index, (&y, row)) in work.y.iter().zip(work.operator.chunks_exact(n)).enumerate() {
            let value = y - dot(row, prior.mean());
            if !value.is_finite() {
                return Err(Refusal::new(format!(
                    "`y[{index}]` minus the prior mean's prediction exceeds the range of 64-bit numbers"
                )));
            }
            work.innovation.push(value);
        }
        let smallest = smallest_variance(&work.operator, m, prior);
        let variance = variance(noise.deviation(y) / scale, smallest);
        Ok(Self { m, n, prior, variance, scale, work })
    }

    /// A C → `cross` and A C Aᵀ + σ² I → upper triangle of `system`.
    pub(super) fn data_space(&mut self) {
        let (m, n, work) = (self.m, self.n, &mut *self.work);
        let covariance = self.prior.covariance().view().values();
        work.cross.resize(m * n, 0.0);
        work.system.resize(m * m, 0.0);
        for i in 0..m {
            let cross = &mut work.cross[i * n..(i + 1) * n];
            // C is symmetric
            adjoint(covariance, &work.operator[i * n..(i + 1) * n], cross);
            for j in i..m {
                work.system[i * m + j] = dot(cross, &work.operator[j * n..(j + 1) * n]);
            }
            work.system[i * m + i] += self.variance;
        }
    }

    /// Aᵀ A + σ² C⁻¹ → upper triangle of `system`.
    pub(super) fn parameter_space(&mut self) {
        let (m, n, work) = (self.m, self.n, &mut *self.work);
        work.system.clear();
        let precision = self.prior.precision().view().values();
        work.system.extend(precision.iter().map(|p| self.variance * p));
        if let Ok(operator) = MatrixView::new(m, n, &work.operator) {
            operator.copy_columns(&mut work.columns);
        }
        add_gram(&work.operator, &work.columns, n, &mut work.system);
    }

    /// Aᵀ (y − A μ) → `weights`.
    pub(super) fn project(&mut self) {
        let work = &mut *self.work;
        work.weights.resize(self.n, 0.0);
        adjoint(&work.operator, &work.innovation, &mut work.weights);
    }

    /// ‖y − A x‖₂ of the answer in `x`.
    pub(super) fn residual_norm(&mut self) -> f64 {
        let work = &mut *self.work;
        work.residual.clear();
        let rows = work.operator.chunks_exact(self.n);
        work.residual.extend(work.y.iter().zip(rows).map(|(y, row)| y - dot(row, &work.x)));
        norm(&work.residual) * self.scale
    }
}

/// Smallest variance of measurements by `operator` at which the normal equations are well posed.
pub(super) fn smallest_variance(operator: &[f64], m: usize, prior: &Gaussian) -> f64 {
    let trace: f64 = (0..prior.len()).map(|i| prior.covariance().row(i)[i]).sum();
    let signal = dot(operator, operator) / m as f64 * trace / prior.len() as f64;
    (SMALLEST_VARIANCE * signal).max(f64::MIN_POSITIVE)
}

/// σ², at least `smallest`.
pub(super) fn variance(deviation: f64, smallest: f64) -> f64 {
    deviation.min(LARGEST_DEVIATION).powi(2).max(smallest)
}

/// Linear minimum mean-square error estimate of x from y = A x + n with x ~ N(μ, C) and n ~ N(0, σ² I). It is also the
/// mean of the Gaussian posterior:
///
/// x̂ = μ + C Aᵀ (A C Aᵀ + σ² I)⁻¹ (y − A μ) = μ + (Aᵀ A + σ² C⁻¹)⁻¹ Aᵀ (y − A μ). The smaller of the two systems is
/// solved.
///
/// Noise variances below 1e-12 ‖A‖² tr(C) / (M N) are raised to that value.
/// Source: S. M. Kay, "Fundamentals of Statistical Signal Processing: Estimation Theory" (1993), §10.6 and §12.5.
///
/// ```
/// use spts_recon::recover::{Gaussian, Lmmse, Noise};
/// use spts_recon::{Matrix, Problem, Recover as _, Workspace};
/// use std::sync::Arc;
///
/// // two taxels that are alike; only their sum is measured
/// let prior = Gaussian::new(vec![0.0; 2], Matrix::from_rows(2, 2, vec![1.0, 0.8, 0.8, 1.0])?)?;
/// let a = Matrix::from_rows(1, 2, vec![1.0, 1.0])?;
/// let lmmse = Lmmse::new(Arc::new(prior), Noise::Absolute(1e-3))?;
/// let image = lmmse.recover(&Problem::new(a.view(), &[4.0])?, &mut Workspace::default())?;
/// assert!(image.coefficients.iter().all(|x| (x - 2.0).abs() < 1e-3));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Lmmse {
    prior: Arc<Gaussian>,
    noise: Noise,
}

impl Lmmse {
    /// The estimate under `prior` for measurements with `noise`.
    ///
    /// # Errors
    /// [`Refusal`] if `noise` is outside its range.
    pub fn new(prior: Arc<Gaussian>, noise: Noise) -> Result<Self, Refusal> {
        Ok(Self { prior, noise: noise.checked()? })
    }
}

impl Recover for Lmmse {
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), Refusal> {
        let mut model = Model::new(problem, &self.prior, self.noise, workspace.scratch::<GaussianScratch>())?;
        estimate(&mut model)?;
        let residual_norm = model.residual_norm();
        solution.set_dense(&model.work.x, 1.0, residual_norm)
    }
}

/// x̂ → `x`.
fn estimate(model: &mut Model<'_, '_>) -> Result<(), Refusal> {
    let in_data_space = model.m <= model.n;
    if in_data_space {
        model.data_space();
        let work = &mut *model.work;
        work.weights.clear();
        work.weights.extend_from_slice(&work.innovation);
    } else {
        model.parameter_space();
        model.project();
    }
    let (size, n, work) = (model.m.min(model.n), model.n, &mut *model.work);
    cholesky::factor(&mut work.system, size).map_err(|e| not_positive_definite(e.pivot))?;
    cholesky::solve(&work.system, size, &mut work.weights);
    work.x.clear();
    work.x.extend_from_slice(model.prior.mean());
    if in_data_space {
        for (&weight, row) in work.weights.iter().zip(work.cross.chunks_exact(n)) {
            axpy(weight, row, &mut work.x);
        }
    } else {
        axpy(1.0, &work.weights, &mut work.x);
    }
    Ok(())
}

/// Most probable x ≥ 0 given y = A x + n, with x ~ N(μ, C) truncated to x ≥ 0, and n ~ N(0, σ² I):
///
/// min ‖y − A x‖² / (2σ²) + ½ (x − μ)ᵀ C⁻¹ (x − μ) subject to x ≥ 0.
///
/// Solved exactly by block principal pivoting on (Aᵀ A + σ² C⁻¹) x − (Aᵀ y + σ² C⁻¹ μ) ≥ 0 ⊥ x ≥ 0. Every solution is
/// checked for these conditions, to 1e-12 of the largest term. If no entry would be negative, the solution is that of
/// [`super::Lmmse`]. Noise variances below 1e-12 ‖A‖² tr(C) / (M N) are raised to that value.
/// Source: C. L. Lawson, R. J. Hanson, "Solving Least Squares Problems" (1974), ch. 23, for the problem. The prior adds
/// further rows to it.
///
/// ```
/// use spts_recon::recover::{Gaussian, NnLmmse, Noise};
/// use spts_recon::{Matrix, Problem, Recover as _, Workspace};
/// use std::sync::Arc;
///
/// let a = Matrix::from_rows(2, 2, vec![1.0, 0.0, 0.0, 1.0])?;
/// let estimate = NnLmmse::new(Arc::new(Gaussian::white(2, 10.0)?), Noise::Absolute(0.1))?;
/// let solution = estimate.recover(&Problem::new(a.view(), &[3.0, -0.2])?, &mut Workspace::default())?;
/// let mut image = [0.0; 2];
/// solution.scatter(&mut image);
/// assert!((image[0] - 3.0).abs() < 0.01 && image[1] == 0.0, "pressure is never negative");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct NnLmmse {
    prior: Arc<Gaussian>,
    noise: Noise,
}

/// Share of the largest entry below which an entry of the first guess counts as zero.
const HARDLY: f64 = 0.05;

impl NnLmmse {
    /// The estimate under `prior` for measurements with `noise`.
    ///
    /// # Errors
    /// [`Refusal`] if `noise` is outside its range.
    pub fn new(prior: Arc<Gaussian>, noise: Noise) -> Result<Self, Refusal> {
        Ok(Self { prior, noise: noise.checked()? })
    }
}

/// μ + t d → `x`: the first step of steepest descent in the metric of the prior, d = C Aᵀ (y − A μ) with the best t. It
/// is nearly right about which entries are above zero; those that are hardly so are set to zero.
fn guess(model: &mut Model<'_, '_>) {
    model.project();
    let (n, prior, work) = (model.n, model.prior, &mut *model.work);
    let (slope, direction) = (&work.weights, &mut work.direction);
    direction.resize(n, 0.0);
    // C is symmetric
    adjoint(prior.covariance().view().values(), slope, direction);
    let (mut along, mut square) = (0.0, model.variance * dot(slope, direction));
    for (e, row) in work.innovation.iter().zip(work.operator.chunks_exact(n)) {
        let image = dot(row, direction);
        along += e * image;
        square += image * image;
    }
    work.x.clear();
    work.x.extend_from_slice(prior.mean());
    axpy(along / square, direction, &mut work.x);
    let least = HARDLY * work.x.iter().fold(0.0_f64, |most, v| most.max(*v));
    work.x.iter_mut().filter(|v| **v < least).for_each(|v| *v = 0.0);
}

impl Recover for NnLmmse {
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), Refusal> {
        let mut model = Model::new(problem, &self.prior, self.noise, workspace.scratch::<GaussianScratch>())?;
        guess(&mut model);
        let (variance, work) = (model.variance, &mut *model.work);
        // h = Aᵀ y + σ² C⁻¹ μ
        work.weights.resize(model.n, 0.0);
        adjoint(&work.operator, &work.y, &mut work.weights);
        axpy(variance, self.prior.natural(), &mut work.weights);
        // the answer scales with h, and squares and tolerances want numbers near 1
        let scale = power_of_two(&work.weights);
        if !scale.is_finite() {
            let atom = work.weights.iter().position(|h| !h.is_finite()).unwrap_or_default();
            return Err(overflow(atom));
        }
        work.weights.iter_mut().for_each(|h| *h /= scale);
        let hessian = Hessian { rows: &work.operator, variance, precision: self.prior.precision().view().values() };
        nnqp::minimise(&hessian, &work.weights, &mut work.x, &mut work.pivoting)?;
        work.x.iter_mut().for_each(|x| *x *= scale);
        let residual_norm = model.residual_norm();
        solution.set_dense(&model.work.x, 1.0, residual_norm)
    }
}
