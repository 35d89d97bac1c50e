//! Sparse Bayesian learning.

use super::cholesky;
use super::parameter::{Noise, ParameterError, Stopping};
use super::scaling::{divide_into, operator_scale, power_of_two};
use crate::kernels::{axpy, dot, norm};
use crate::problem::{Problem, Recover, RecoverError, Solution};
use crate::workspace::Workspace;

/// Sparse Bayesian learning by fast maximisation of the marginal likelihood. Model: y = A w + n with w_k ~ N(0, γₖ) and
/// n ~ N(0, σ² I). The variances γ maximise log p(y) = −½ (log det C + yᵀ C⁻¹ y) + const, C = σ² I + A Γ Aᵀ, and most
/// of them become zero. The solution is the posterior mean wₖ = γₖ aₖᵀ C⁻¹ y.
///
/// With sₖ = aₖᵀ C₋ₖ⁻¹ aₖ and qₖ = aₖᵀ C₋ₖ⁻¹ y (C without column k), the best variance of one column is (qₖ² − sₖ)/sₖ²
/// if qₖ² > sₖ, and zero otherwise. Each step assigns its best variance to the column that gains most: the column is
/// added, re-estimated or removed, and C⁻¹ is changed by a rank-one update. The iteration ends when no column gains
/// more than `stopping.tol` nats. Noise deviations below 1e-6 of the root mean square of `y` are raised to that value.
/// Source: M. E. Tipping, A. C. Faul, "Fast marginal likelihood maximisation for sparse Bayesian models", AISTATS 2003,
/// eqs. 17–24; the noise is given instead of estimated.
///
/// ```
/// use spts_recon::recover::{Noise, Sbl};
/// use spts_recon::{Matrix, Problem, Recover as _, Workspace};
///
/// let a = Matrix::from_rows(2, 3, vec![1.0, 0.0, 0.6, 0.0, 1.0, 0.8])?;
/// let sbl = Sbl::new(Noise::Relative(0.01))?;
/// let solution = sbl.recover(&Problem::new(a.view(), &[0.6, 0.8])?, &mut Workspace::default())?;
/// assert_eq!(solution.support, [2]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sbl {
    noise: Noise,
    /// Smallest gain of a step, nats, and largest number of steps; default [`Self::STOPPING`].
    pub stopping: Stopping,
}

/// Smallest noise deviation, as a share of the root mean square of y: 1e-12 in variance keeps C well posed.
const SMALLEST_NOISE: f64 = 1e-6;
/// Steps between two fresh factorisations of C, which stop rounding from piling up.
const REFRESH: usize = 32;

impl Sbl {
    /// Default of `stopping`.
    pub const STOPPING: Stopping = Stopping {
        tol: 1e-6,
        max_iter: 10_000,
    };

    /// Sparse Bayesian learning for samples whose noise has the standard deviation `noise`, with the default
    /// [`Self::STOPPING`].
    ///
    /// # Errors
    /// [`ParameterError`] if `noise` is outside its range.
    pub fn new(noise: Noise) -> Result<Self, ParameterError> {
        Ok(Self {
            noise: noise.checked()?,
            stopping: Self::STOPPING,
        })
    }
}

impl Recover for Sbl {
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), RecoverError> {
        let (a, y) = (problem.matrix(), problem.y());
        let (a_scale, y_scale) = (operator_scale(a)?, power_of_two(y));
        if y.iter().all(|v| *v == 0.0) {
            solution.set_zero(0.0);
            return Ok(());
        }
        let (m, k) = (a.nrows(), a.ncols());
        let work = workspace.scratch::<SblScratch>();
        a.copy_columns(&mut work.columns);
        work.columns.iter_mut().for_each(|v| *v /= a_scale);
        divide_into(y, y_scale, &mut work.y);
        work.variances.clear();
        work.variances.resize(k, 0.0);
        let smallest = Noise::Relative(SMALLEST_NOISE).deviation(&work.y);
        // the square of the largest is still finite
        let deviation = (self.noise.deviation(y) / y_scale).clamp(smallest, 1e150);
        let mut evidence = Evidence {
            m,
            noise_variance: deviation * deviation,
            work,
        };
        evidence.maximise(self.stopping)?;
        evidence.write(y_scale / a_scale, y_scale, solution)
    }
}

/// Memory of the maximisation.
#[derive(Debug, Default)]
struct SblScratch {
    /// Columns of the scaled operator, one after the other, K × M.
    columns: Vec<f64>,
    y: Vec<f64>,
    /// γ
    variances: Vec<f64>,
    /// C⁻¹, M × M.
    inverse: Vec<f64>,
    factor: Vec<f64>,
    /// aₖᵀ C⁻¹ aₖ of every column.
    sparsity: Vec<f64>,
    /// aₖᵀ C⁻¹ y of every column.
    quality: Vec<f64>,
    direction: Vec<f64>,
    x: Vec<f64>,
}

struct Evidence<'w> {
    m: usize,
    noise_variance: f64,
    work: &'w mut SblScratch,
}

/// A column, its new variance and the log-evidence that this gains, nats.
struct Step {
    column: usize,
    variance: f64,
    gain: f64,
}

impl Evidence<'_> {
    fn maximise(&mut self, Stopping { tol, max_iter }: Stopping) -> Result<(), RecoverError> {
        self.refresh()?;
        for iteration in 1..=max_iter {
            let step = self.best_step();
            if step.gain <= tol {
                return self.refresh();
            }
            self.update(&step);
            if iteration % REFRESH == 0 {
                self.refresh()?;
            }
        }
        let gain = self.best_step().gain;
        if gain <= tol {
            return self.refresh();
        }
        Err(RecoverError::NotConverged {
            iterations: max_iter,
            error: gain,
            tol,
        })
    }

    /// C⁻¹, aᵀ C⁻¹ a and aᵀ C⁻¹ y from the variances.
    fn refresh(&mut self) -> Result<(), RecoverError> {
        let (m, work) = (self.m, &mut *self.work);
        work.factor.clear();
        work.factor.resize(m * m, 0.0);
        for i in 0..m {
            work.factor[i * m + i] = self.noise_variance;
        }
        for (column, &variance) in work.columns.chunks_exact(m).zip(&work.variances) {
            if variance > 0.0 {
                for (i, &v) in column.iter().enumerate() {
                    axpy(variance * v, &column[i..], &mut work.factor[i * m + i..(i + 1) * m]);
                }
            }
        }
        cholesky::factor(&mut work.factor, m).map_err(|e| RecoverError::NotPositiveDefinite { pivot: e.pivot })?;
        work.inverse.clear();
        work.inverse.resize(m * m, 0.0);
        for (i, row) in work.inverse.chunks_exact_mut(m).enumerate() {
            row[i] = 1.0;
            cholesky::solve(&work.factor, m, row);
        }
        work.sparsity.clear();
        work.quality.clear();
        work.direction.resize(m, 0.0);
        for column in work.columns.chunks_exact(m) {
            for (d, row) in work.direction.iter_mut().zip(work.inverse.chunks_exact(m)) {
                *d = dot(row, column);
            }
            work.sparsity.push(dot(column, &work.direction));
            work.quality.push(dot(&work.y, &work.direction));
        }
        Ok(())
    }

    /// The step that gains most.
    fn best_step(&self) -> Step {
        let work = &*self.work;
        let mut best = Step {
            column: 0,
            variance: 0.0,
            gain: 0.0,
        };
        for (column, &variance) in work.variances.iter().enumerate() {
            // C without this column
            let rest = 1.0 - variance * work.sparsity[column];
            let (s, q) = (work.sparsity[column] / rest, work.quality[column] / rest);
            if !(rest > 0.0 && s.is_normal()) {
                continue;
            }
            let wanted = ((q / s).powi(2) - 1.0 / s).max(0.0);
            let gain = gain(wanted, s, q) - gain(variance, s, q);
            if gain > best.gain && wanted.is_finite() {
                best = Step {
                    column,
                    variance: wanted,
                    gain,
                };
            }
        }
        best
    }

    /// Gives a column its new variance: C ← C + δ a aᵀ.
    fn update(&mut self, step: &Step) {
        let (m, work) = (self.m, &mut *self.work);
        let change = step.variance - work.variances[step.column];
        work.variances[step.column] = step.variance;
        let column = &work.columns[step.column * m..(step.column + 1) * m];
        for (d, row) in work.direction.iter_mut().zip(work.inverse.chunks_exact(m)) {
            *d = dot(row, column);
        }
        let factor = change / (1.0 + change * work.sparsity[step.column]);
        for (row, &d) in work.inverse.chunks_exact_mut(m).zip(&work.direction) {
            axpy(-factor * d, &work.direction, row);
        }
        let chosen = work.quality[step.column];
        for (k, column) in work.columns.chunks_exact(m).enumerate() {
            let overlap = dot(column, &work.direction);
            work.sparsity[k] -= factor * overlap * overlap;
            work.quality[k] -= factor * overlap * chosen;
        }
    }

    fn write(&mut self, x_scale: f64, y_scale: f64, solution: &mut Solution) -> Result<(), RecoverError> {
        let work = &mut *self.work;
        work.x.clear();
        work.x
            .extend(work.variances.iter().zip(&work.quality).map(|(g, q)| g * q));
        let residual = &mut work.direction;
        residual.copy_from_slice(&work.y);
        for (column, &x) in work.columns.chunks_exact(self.m).zip(&work.x) {
            axpy(-x, column, residual);
        }
        let residual_norm = norm(residual) * y_scale;
        solution.set_dense(&work.x, x_scale, residual_norm)
    }
}

/// Part of the log-evidence that depends on the variance γ of a column: ½ (q² γ/(1 + γ s) − log(1 + γ s)).
fn gain(variance: f64, s: f64, q: f64) -> f64 {
    let spread = variance * s;
    0.5 * (q * q * variance / (1.0 + spread) - spread.ln_1p())
}
