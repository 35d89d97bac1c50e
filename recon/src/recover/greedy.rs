//! Parts that all greedy pursuits share: scratch memory, and writing the solution.

use super::batch_omp::GramScratch;
use super::factor::{CONVERGED, Factor};
use super::scaling::{Scaled, Scaling};
use crate::kernels;
use crate::problem::{Problem, RecoverError, Solution};

/// Scratch memory of the greedy pursuits.
#[derive(Debug, Default)]
pub(crate) struct Greedy {
    pub(crate) scaling: Scaling,
    pub(crate) state: State,
    pub(crate) gram: GramScratch,
}

impl Greedy {
    /// The problem scaled, the memory beside it, and the columns that a pursuit may use at most.
    ///
    /// # Errors
    /// [`RecoverError::OperatorNotFinite`].
    pub(crate) fn begin<'a>(
        &'a mut self,
        problem: &Problem<'a>,
        n_nonzero_coefs: usize,
    ) -> Result<(Scaled<'a>, &'a mut State, usize), RecoverError> {
        let problem = self.scaling.apply(problem)?;
        let limit = n_nonzero_coefs.min(problem.a.nrows()).min(problem.a.ncols());
        Ok((problem, &mut self.state, limit))
    }
}

/// Scratch memory beside the scaled problem.
#[derive(Debug, Default)]
pub(crate) struct State {
    pub(crate) factor: Factor,
    /// Weight of every column in the selection; 0 for columns that must not be selected.
    pub(crate) weights: Vec<f64>,
    /// Aᵀ r.
    pub(crate) correlation: Vec<f64>,
    pub(crate) alpha: Vec<f64>,
    pub(crate) previous: Vec<f64>,
    pub(crate) atoms: Vec<usize>,
}

impl State {
    /// `correlation = Aᵀ r` with the residual of the factorisation.
    pub(crate) fn correlate(&mut self, problem: &Scaled<'_>) {
        self.correlation.resize(problem.a.ncols(), 0.0);
        let residual = self.factor.residual(problem.a.nrows());
        kernels::adjoint(problem.a.values(), residual, &mut self.correlation);
    }

    /// True when the residual is nothing but rounding.
    pub(crate) fn converged(&self, problem: &Scaled<'_>) -> bool {
        self.factor.residual_norm() <= CONVERGED * problem.y_norm
    }

    /// True when the correlation of `atom` with the residual is nothing but rounding.
    pub(crate) fn uncorrelated(&self, problem: &Scaled<'_>, atom: usize) -> bool {
        self.correlation[atom].abs() <= CONVERGED * problem.y_norm * problem.squares[atom].sqrt()
    }

    /// Writes the least-squares solution on the columns of the factorisation.
    ///
    /// # Errors
    /// [`RecoverError::Overflow`].
    pub(crate) fn finish(&self, problem: &Scaled<'_>, solution: &mut Solution) -> Result<(), RecoverError> {
        solution.support.clear();
        solution.support.extend_from_slice(self.factor.atoms());
        self.factor.coefficients_into(&mut solution.coefficients);
        solution.residual_norm = self.factor.residual_norm();
        problem.unscale(solution)
    }
}
