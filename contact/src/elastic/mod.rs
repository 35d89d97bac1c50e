//! Elastic contact: a bonded layer of finite thickness, and the half-space.
//!
//! Stages: kernel → influence coefficients of square cells → convolution by fast Fourier transforms → contact without
//! tension.

mod coefficients;
mod config;
mod convolution;
#[cfg(test)]
mod cylinder_tests;
mod deficit;
#[cfg(test)]
mod extremes_tests;
mod field;
#[cfg(test)]
mod field_tests;
mod kernel;
#[cfg(test)]
mod kernel_tests;
mod level;
mod memory;
mod pcg;
mod pyramid;
mod quadrature;
mod skin;
mod solver;
mod system;
mod tables;
#[cfg(test)]
mod tests;

pub use coefficients::Influence;
pub use config::ElasticConfig;
pub use field::ElasticField;
pub use kernel::{ElasticKernel, confined_stiffness_pa_per_m, modulus_of_confined_pa};
pub use pcg::Outcome;
pub use solver::ElasticSolver;
