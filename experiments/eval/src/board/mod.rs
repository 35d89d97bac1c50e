//! The board: algorithms side by side on the same windows, truth, votes and time.
//!
//! [`Plan::learn`] trains, [`Ready::score`] decodes and scores, and [`regressions`] holds a board against an earlier one.

mod plan;
mod regression;
mod rows;
mod run;
mod text;
mod trainer;

pub use plan::{Plan, Ready};
pub use regression::{Regression, regressions};
pub use rows::{ObjectRow, Row, ScoreBoard};
pub use text::table;

pub use crate::decoders::{DECODERS, find};
pub use crate::windows::{Press, Window};
