//! The linear Gaussian model y = A x + n after scaling, and the matrices that its estimators share.

use super::parameter::Noise;
use super::prior::Gaussian;
use super::scaling::{divide_into, operator_scale};
use crate::kernels::{add_gram, adjoint, dot, norm};
use crate::matrix::MatrixView;
use crate::problem::{Problem, RecoverError};

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
    ) -> Result<Self, RecoverError> {
        let (a, y) = (problem.matrix(), problem.y());
        let (m, n) = (a.nrows(), a.ncols());
        if n != prior.len() {
            return Err(RecoverError::Columns {
                cols: n,
                expected: prior.len(),
            });
        }
        let scale = operator_scale(a)?;
        divide_into(a.values(), scale, &mut work.operator);
        work.innovation.clear();
        divide_into(y, scale, &mut work.y);
        for (index, (&y, row)) in work.y.iter().zip(work.operator.chunks_exact(n)).enumerate() {
            let value = y - dot(row, prior.mean());
            if !value.is_finite() {
                return Err(RecoverError::InnovationOverflow { index });
            }
            work.innovation.push(value);
        }
        let smallest = smallest_variance(&work.operator, m, prior);
        let variance = variance(noise.deviation(y) / scale, smallest);
        Ok(Self {
            m,
            n,
            prior,
            variance,
            scale,
            work,
        })
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
        work.residual
            .extend(work.y.iter().zip(rows).map(|(y, row)| y - dot(row, &work.x)));
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
