//! Sparse recovery, dictionaries, classification, localisation and metrics for compressive measurements `y = Φ x`.
//!
//! The crate knows nothing about skins or circuits: its inputs are matrices and slices of `f64`, its outputs images and
//! labels. [`recover`] reconstructs images, [`dictionary`] learns their atoms, [`classify`] identifies objects,
//! [`localise`] finds contacts, and [`rows`] designs measurements. Two algorithms work while measurements arrive:
//! [`recover::SequentialEstimate`] and [`classify::EvidenceClassifier`]. A [`StopRule`] ends them as soon as they are
//! confident enough.
//!
//! ```
//! use spts_recon::{Matrix, Problem, Recover as _, Workspace, recover::Omp};
//!
//! // y = A·(0, 3, 0): one atom is enough
//! let a = Matrix::from_rows(2, 3, vec![1.0, 0.0, 0.6, 0.0, 1.0, 0.8]).unwrap();
//! let y = [0.0, 3.0];
//! let solution = Omp::new(1).recover(&Problem::new(a.view(), &y)?, &mut Workspace::default())?;
//! assert_eq!(solution.support, [1]);
//! assert!((solution.coefficients[0] - 3.0).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod amplitude;
mod checks;
mod cholesky;
pub mod classify;
pub mod dictionary;
mod kernels;
mod kernels32;
pub mod localise;
mod matrix;
pub mod matrix_free;
pub mod metrics;
pub mod operator;
mod posterior;
mod problem;
pub mod raster;
pub mod recover;
pub mod rows;
mod sign_tables;
pub mod statistics;
mod stop;

pub use amplitude::AmplitudeRange;
pub use matrix::{Matrix, MatrixView};
pub use operator::LinearOperator;
pub use problem::{Problem, Recover, Solution, Workspace};
pub use sign_tables::{SignTables, TableFloat};
pub use stop::{StopRule, Stopped};
