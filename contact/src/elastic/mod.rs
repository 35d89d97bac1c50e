//! Elastic contact: a bonded layer of finite thickness, and the half-space.
//!
//! Stages: kernel → influence coefficients of square cells → convolution by fast Fourier transforms → contact without
//! tension.

mod convolution;
mod field;
#[cfg(test)]
mod field_tests;
mod forces;
mod influence;
mod pcg;
mod solver;
#[cfg(test)]
mod tests;

pub use field::{ElasticConfig, ElasticField};
pub use influence::{ElasticKernel, Influence, confined_stiffness_pa_per_m, modulus_of_confined_pa};
pub use pcg::Outcome;
pub use solver::ElasticSolver;
