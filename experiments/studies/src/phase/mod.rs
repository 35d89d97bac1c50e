//! Phase diagrams: for which undersampling and sparsity each recovery algorithm works, compared with theory.

mod error;
mod methods;
mod study;
mod text;

pub use error::PhaseError;
pub use methods::{Method, Theory, methods};
pub use study::{CELLS, Crossing, PhaseReport, PhaseStudy, RatePoint};
