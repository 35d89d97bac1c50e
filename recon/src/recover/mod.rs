//! Recovery algorithms: images from measurements. An algorithm with a given number of atoms has a file here and a line
//! in [`RECOVER`]; one with a prior has a line in [`REGULARISED`]. [`conformance`] and [`conformance_regularised`] run
//! on all of them.
//!
//! Three have another interface: [`SequentialEstimate`] accepts rows one by one, [`TrackedImage`] follows a changing
//! image from window to window, and [`LeastSquares`] fits one image to many measurements.

mod conformance;
mod fixed;
mod gaussian;
mod least_squares;
mod nn_lasso;
mod nnqp;
mod prior;
mod pursuit;
mod reference;
mod sequential;
mod tv;
mod unrolled;

pub use conformance::{conformance, conformance_regularised};
pub use fixed::{Fixed, FixedWindow};
pub use gaussian::{Lmmse, NnLmmse};
pub use least_squares::LeastSquares;
pub use nn_lasso::NnLasso;
pub(crate) use prior::no_images;
pub use prior::{Gaussian, ImagePrior, Noise, Penalty, Stopping};
pub(crate) use pursuit::{CONVERGED, back_substitute};
pub use pursuit::{NnOmp, Omp};
pub use reference::ReferenceOmp;
pub use sequential::{Motion, SequentialEstimate, SequentialGains, TrackedImage};
pub use tv::Tv;
pub use unrolled::{Touched, Unrolled, UnrolledBlock, UnrolledWeights};

use crate::problem::Recover;
use spts_input::Refusal;
use std::sync::Arc;

/// Builds an algorithm for a target sparsity (`n_nonzero_coefs`).
pub type Build = fn(usize) -> Box<dyn Recover>;

/// Every algorithm with a given number of atoms, by name.
pub const RECOVER: &[(&str, Build)] = &[
    ("reference", |n_nonzero_coefs| Box::new(ReferenceOmp::new(n_nonzero_coefs))),
    ("omp", |n_nonzero_coefs| Box::new(Omp::new(n_nonzero_coefs))),
    ("nn_omp", |n_nonzero_coefs| Box::new(NnOmp::new(n_nonzero_coefs))),
];

/// Builds an algorithm for K unknowns, with weak regularisation.
///
/// # Errors
/// A message, if K or a parameter is outside its range.
pub(crate) type BuildRegularised = fn(usize) -> Result<Box<dyn Recover>, Refusal>;

/// Share of the largest correlation that the penalties of [`REGULARISED`] have, and of the root mean square of `y` or
/// of the prior deviation that its noises have.
const WEAK: f64 = 1e-3;

/// Every algorithm with a prior, by name, here with weak and neutral settings: unit deviation, a grid of one row.
pub const REGULARISED: &[(&str, BuildRegularised)] = &[
    ("nn_lasso", |_| Ok(Box::new(NnLasso::new(Penalty::Relative(WEAK))?))),
    ("lmmse", |k| Ok(Box::new(Lmmse::new(Arc::new(Gaussian::white(k, 1.0)?), Noise::Absolute(WEAK))?))),
    ("nn_lmmse", |k| Ok(Box::new(NnLmmse::new(Arc::new(Gaussian::white(k, 1.0)?), Noise::Absolute(WEAK))?))),
    ("unrolled", |k| Ok(Box::new(Unrolled::new(UnrolledWeights::plain(0.01 * WEAK)?, [1, k])?))),
    ("tv", |k| Ok(Box::new(Tv::new(1, k, Penalty::Relative(WEAK))?))),
];
