//! Sparse-recovery algorithms. A new one is a file here and a line in [`RECOVER`]; [`conformance`] runs on all of them.

mod batch_omp;
mod conformance;
mod cosamp;
mod factor;
mod greedy;
mod iht;
mod nn_omp;
mod ols;
mod omp;
mod phase;
mod reference;
mod scaling;

pub use batch_omp::BatchOmp;
pub use conformance::conformance;
pub use cosamp::Cosamp;
pub(crate) use greedy::Greedy;
pub use iht::Iht;
pub use nn_omp::NnOmp;
pub use ols::Ols;
pub use omp::Omp;
pub use phase::{PhasePoint, Signs};
pub use reference::ReferenceOmp;

use crate::problem::Recover;

/// Builds an algorithm for a target sparsity (`n_nonzero_coefs`).
pub type Build = fn(usize) -> Box<dyn Recover>;

/// Every algorithm by name.
pub const RECOVER: &[(&str, Build)] = &[
    ("reference", |n_nonzero_coefs| {
        Box::new(ReferenceOmp::new(n_nonzero_coefs))
    }),
    ("omp", |n_nonzero_coefs| Box::new(Omp::new(n_nonzero_coefs))),
    ("ols", |n_nonzero_coefs| Box::new(Ols::new(n_nonzero_coefs))),
    ("nn_omp", |n_nonzero_coefs| Box::new(NnOmp::new(n_nonzero_coefs))),
    ("cosamp", |n_nonzero_coefs| Box::new(Cosamp::new(n_nonzero_coefs))),
    ("iht", |n_nonzero_coefs| Box::new(Iht::new(n_nonzero_coefs))),
];
