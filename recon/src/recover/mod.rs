//! Sparse-recovery algorithms. A new one is a file here and a line in [`RECOVER`]; [`conformance`] runs on all of them.

mod conformance;
mod omp;

pub use conformance::conformance;
pub use omp::Omp;

use crate::problem::Recover;

/// Builds an algorithm for a target sparsity (`n_nonzero_coefs`).
pub type Build = fn(usize) -> Box<dyn Recover>;

/// Every algorithm by name.
pub const RECOVER: &[(&str, Build)] = &[("reference", |n_nonzero_coefs| Box::new(Omp::new(n_nonzero_coefs)))];
