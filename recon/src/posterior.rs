//! Covariance of Gaussian unknowns after measurements.

use crate::kernels::{adjoint, axpy, dot};

/// Posterior covariance P of Gaussian unknowns, measurement by measurement. A row a with the noise variance ν is a
/// rank-one update: u = P a, q = aᵀ u + ν, P ← P − u uᵀ/q, at O(N²).
/// Source: R. E. Kalman, J. Basic Eng. 82 (1960), with a constant state.
#[derive(Debug, Clone)]
pub(crate) struct GaussianPosterior {
    /// P, N × N, symmetric.
    pub(crate) covariance: Vec<f64>,
    /// u, of the last row.
    pub(crate) product: Vec<f64>,
}

impl GaussianPosterior {
    /// Before any measurement: P = `covariance`, N × N.
    pub(crate) fn new(covariance: Vec<f64>, n: usize) -> Self {
        let product = vec![0.0; n];
        Self { covariance, product }
    }

    /// u for the row `a`; returns aᵀ u.
    pub(crate) fn project(&mut self, a: &[f64]) -> f64 {
        adjoint(&self.covariance, a, &mut self.product);
        dot(a, &self.product)
    }

    /// P ← P − u uᵀ/`q`.
    pub(crate) fn lower(&mut self, q: f64) {
        let u = &self.product;
        for (line, &share) in self.covariance.chunks_exact_mut(u.len().max(1)).zip(u) {
            axpy(-share / q, u, line);
        }
    }

    /// As [`Self::lower`] at q = 1/`precision`²; u becomes u · `precision`.
    pub(crate) fn lower_scaled(&mut self, precision: f64) {
        self.product.iter_mut().for_each(|u| *u *= precision);
        self.lower(1.0);
    }

    /// Diagonal of P.
    pub(crate) fn variances(&self) -> impl Iterator<Item = f64> {
        self.covariance.iter().step_by(self.product.len() + 1).copied()
    }
}
