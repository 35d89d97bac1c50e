//! Iterative hard thresholding.

use super::greedy::{Greedy, largest};
use super::scaling::Scaled;
use crate::kernels;
use crate::problem::{Problem, Recover, RecoverError, Solution};
use crate::workspace::Workspace;

/// Normalised iterative hard thresholding: x ← H_S(x + μ Âᵀ(y − Â x)). H_S keeps the S = `n_nonzero_coefs` largest
/// entries, and Â has the columns of A scaled to length 1.
///
/// The step is μ = ‖g_Γ‖² / ‖Â_Γ g_Γ‖² with the gradient g on the support Γ. If the support changes, the step is
/// reduced until μ ≤ (1 − c)‖Δx‖² / ‖Â Δx‖², so that the residual decreases. The iteration ends when x changes by less
/// than 1e-8 of its length, or after 500 iterations. The coefficients are the least-squares solution on the final
/// support.
/// Source: T. Blumensath, M. E. Davies, "Normalized iterative hard thresholding: Guaranteed stability and performance",
/// IEEE J. Sel. Topics Signal Process. 4 (2010).
///
/// ```
/// use spts_recon::recover::{Cosamp, Iht, Omp};
/// use spts_recon::{Matrix, Problem, Recover, Workspace};
///
/// // every pursuit of the table solves the same problem
/// let a = Matrix::from_rows(4, 4, vec![
///     1.0, 1.0, 1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, -1.0, -1.0, 1.0,
/// ])?;
/// let problem = Problem::new(a.view(), &[2.0, -2.0, 2.0, -2.0])?; // twice the second atom
/// let pursuits: [&dyn Recover; 3] = [&Omp::new(1), &Cosamp::new(1), &Iht::new(1)];
/// for pursuit in pursuits {
///     assert_eq!(pursuit.recover(&problem, &mut Workspace::default())?.support, [1]);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Iht {
    n_nonzero_coefs: usize,
}

/// Most iterations.
const MAX_ITER: usize = 500;

/// Relative change ‖Δx‖₂ / ‖x‖₂ at which the iteration ends.
const TOL: f64 = 1e-8;

/// c of the step rule.
const MARGIN: f64 = 0.01;

/// κ of the step rule: a step that is too long is divided by κ(1 − c).
const SHORTER: f64 = 2.0;

impl Iht {
    /// A pursuit of `n_nonzero_coefs` atoms.
    #[must_use]
    pub fn new(n_nonzero_coefs: usize) -> Self {
        Self { n_nonzero_coefs }
    }
}

/// x, a sparse vector: entries at `atoms`, the indices rising.
#[derive(Debug, Default)]
struct Sparse {
    atoms: Vec<usize>,
    values: Vec<f64>,
}

impl Sparse {
    fn clear(&mut self) {
        self.atoms.clear();
        self.values.clear();
    }

    /// The `sparsity` largest entries of `dense`.
    fn threshold(&mut self, dense: &[f64], sparsity: usize, magnitudes: &mut Vec<f64>) {
        magnitudes.clear();
        magnitudes.extend(dense.iter().map(|v| v.abs()));
        largest(magnitudes, sparsity, &mut self.atoms);
        self.atoms.sort_unstable();
        self.values.clear();
        self.values.extend(self.atoms.iter().map(|&k| dense[k]));
    }

    /// ‖x‖₂².
    fn square(&self) -> f64 {
        kernels::dot(&self.values, &self.values)
    }

    /// `out = self − other`.
    fn minus(&self, other: &Self, out: &mut Self) {
        out.clear();
        let (mut i, mut j) = (0, 0);
        while i < self.atoms.len() || j < other.atoms.len() {
            let (a, b) = (self.atoms.get(i).copied(), other.atoms.get(j).copied());
            let take_a = a.is_some_and(|a| b.is_none_or(|b| a <= b));
            let take_b = b.is_some_and(|b| a.is_none_or(|a| b <= a));
            let atom = if take_a { self.atoms[i] } else { other.atoms[j] };
            let mut value = 0.0;
            if take_a {
                value += self.values[i];
                i += 1;
            }
            if take_b {
                value -= other.values[j];
                j += 1;
            }
            out.atoms.push(atom);
            out.values.push(value);
        }
    }

    /// `out = Â x`.
    fn image(&self, problem: &Scaled<'_>, weights: &[f64], out: &mut Vec<f64>) {
        out.clear();
        let entries = self.atoms.iter().zip(&self.values);
        let rows = problem.a.values().chunks_exact(problem.a.ncols());
        out.extend(rows.map(|row| entries.clone().map(|(&k, v)| row[k] * weights[k] * v).sum::<f64>()));
    }
}

/// Scratch memory of the pursuit.
#[derive(Debug, Default)]
struct IhtScratch {
    greedy: Greedy,
    thresholding: Thresholding,
}

/// Scratch memory of the thresholding.
#[derive(Debug, Default)]
struct Thresholding {
    x: Sparse,
    next: Sparse,
    change: Sparse,
    residual: Vec<f64>,
    image: Vec<f64>,
    gradient: Vec<f64>,
    dense: Vec<f64>,
    magnitudes: Vec<f64>,
}

impl Thresholding {
    /// `next = H_S(x + μ g)` and `change = next − x`.
    fn propose(&mut self, step: f64, sparsity: usize) {
        self.dense.clear();
        self.dense.extend(self.gradient.iter().map(|g| step * g));
        for (&k, v) in self.x.atoms.iter().zip(&self.x.values) {
            self.dense[k] += v;
        }
        self.next.threshold(&self.dense, sparsity, &mut self.magnitudes);
        self.next.minus(&self.x, &mut self.change);
    }

    /// `gradient = Âᵀ(y − Â x)`.
    fn differentiate(&mut self, problem: &Scaled<'_>, weights: &[f64]) {
        self.x.image(problem, weights, &mut self.image);
        self.residual.clear();
        self.residual
            .extend(problem.y.iter().zip(&self.image).map(|(y, v)| y - v));
        self.gradient.resize(problem.a.ncols(), 0.0);
        kernels::adjoint(problem.a.values(), &self.residual, &mut self.gradient);
        self.gradient.iter_mut().zip(weights).for_each(|(g, w)| *g *= w);
    }

    /// μ = ‖g_Γ‖² / ‖Â_Γ g_Γ‖² on the support of x, of the largest entries of g while x is zero; `None` when g is zero
    /// there.
    fn step(&mut self, problem: &Scaled<'_>, weights: &[f64], sparsity: usize) -> Option<f64> {
        if self.x.atoms.is_empty() {
            self.change.threshold(&self.gradient, sparsity, &mut self.magnitudes);
        } else {
            self.change.clear();
            self.change.atoms.extend_from_slice(&self.x.atoms);
            let on_support = self.x.atoms.iter().map(|&k| self.gradient[k]);
            self.change.values.extend(on_support);
        }
        self.change.image(problem, weights, &mut self.image);
        let step = self.change.square() / kernels::dot(&self.image, &self.image);
        (step.is_finite() && step > 0.0).then_some(step)
    }

    /// One iteration; returns ‖Δx‖₂² / ‖x‖₂², or `None` when nothing moves any more.
    fn iterate(&mut self, problem: &Scaled<'_>, weights: &[f64], sparsity: usize) -> Option<f64> {
        self.differentiate(problem, weights);
        let mut step = self.step(problem, weights, sparsity)?;
        self.propose(step, sparsity);
        while self.next.atoms != self.x.atoms {
            self.change.image(problem, weights, &mut self.image);
            let longest = (1.0 - MARGIN) * self.change.square() / kernels::dot(&self.image, &self.image);
            if longest.is_nan() || step <= longest {
                break;
            }
            step /= SHORTER * (1.0 - MARGIN);
            self.propose(step, sparsity);
        }
        std::mem::swap(&mut self.x, &mut self.next);
        let size = self.x.square();
        (size > 0.0).then(|| self.change.square() / size)
    }
}

impl Recover for Iht {
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), RecoverError> {
        let IhtScratch { greedy, thresholding } = workspace.scratch();
        let (problem, state, sparsity) = greedy.begin(problem, self.n_nonzero_coefs)?;
        problem.weights_into(&mut state.weights);
        let weights = &state.weights;
        thresholding.x.clear();
        if sparsity > 0 {
            for _ in 0..MAX_ITER {
                match thresholding.iterate(&problem, weights, sparsity) {
                    Some(change) if change > TOL * TOL => {}
                    _ => break,
                }
            }
        }
        state.factor.restart(&problem, &thresholding.x.atoms);
        state.finish(&problem, solution)
    }
}
