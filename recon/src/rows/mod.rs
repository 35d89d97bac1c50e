//! Designs rows of the sensing matrix for expected images, in place of random rows.
//!
//! A [`RowTask`] states how many rows are needed, with which levels, and for which images. A designer in [`DESIGNERS`]
//! computes the sensing matrix. [`choose_for_images`] and [`choose_for_classes`] select among given rows, such as those
//! with which a press was recorded. A designer has a file here and a line in [`DESIGNERS`]; [`conformance`] runs on all
//! of them.
//!
//! ```
//! use spts_recon::rows::{DESIGNERS, Expected, RowTask, posterior_trace};
//!
//! // eight measurements of a sheet of 6 × 6 taxels on which contacts are about two taxels wide
//! let expected = Expected::smooth([6, 6], 2.0)?;
//! let task = RowTask::new(8, &expected);
//! let build = |name: &str| DESIGNERS.iter().find(|d| d.name == name).unwrap().build;
//! let designed = build("greedy")().design(&task)?;
//! let random = build("random")().design(&task)?;
//! let left = |rows| posterior_trace(&task, rows).unwrap();
//! assert!(left(&designed) < 0.7 * left(&random));
//! # Ok::<(), spts_recon::rows::RowError>(())
//! ```

mod ascent;
mod choose;
mod classes;
mod conformance;
mod cosine;
mod covariance;
mod error;
mod expected;
mod greedy;
mod headroom;
mod order;
mod random;
mod separable;
mod table;
mod task;

pub use choose::{choose_for_classes, choose_for_images};
pub use classes::Classes;
pub use conformance::conformance;
pub use cosine::CosineSigns;
pub use covariance::posterior_trace;
pub use error::RowError;
pub use expected::{Expected, Tolerances};
pub use greedy::Greedy;
pub use headroom::largest_sum;
pub use order::fewest_flips;
pub use random::Random;
pub use separable::Separable;
pub use table::{DESIGNERS, Designer, RowNeeds, designer};
pub use task::{DesignRows, RowTask};
