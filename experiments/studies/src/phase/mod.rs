//! Where in the plane of undersampling and sparsity each recovery algorithm works, beside the theory.

mod error;
mod methods;
mod study;
mod text;

pub use error::PhaseError;
pub use methods::{Method, Theory, methods};
pub use study::{CELLS, Crossing, PhaseReport, PhaseStudy, RatePoint};
