//! The board: compares algorithms on the same windows, with ground truth, majority votes and decoding time.
//!
//! [`BoardSettings::learn`] trains, [`TrainedBoard::score`] decodes and scores, and [`regressions`] compares a board
//! with an earlier one.

mod difference;
mod files;
mod in_time;
mod regression;
mod rows;
mod run;
mod settings;
mod stops;
mod text;
mod trainer;
mod training_sets;

pub use difference::{Difference, differences};
pub use files::{FILES, write};
pub use regression::{Regression, regressions};
pub use rows::{BoardRow, ObjectRow, ScoreBoard};
pub use settings::{BoardSettings, TrainedBoard};
pub use text::table;

pub use crate::decoders::{DECODERS, find};
pub use crate::windows::{Press, Window};
