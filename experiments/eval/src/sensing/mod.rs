//! Which measurements of a recording make a window: those that follow each other, or rows that are chosen.
//!
//! A held press streams thousands of random rows at a constant image, so that any set of rows that a rule chooses
//! without a look at the samples can be scored on real samples. The order of time is lost: what a cell remembers of the
//! row before, and what changes during the press, is that of the press and not of the window.

mod chosen;

pub use chosen::RowChooser;
pub(crate) use chosen::chosen_places;

use serde::{Deserialize, Serialize};

/// How the rows of a window come about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sensing {
    /// Consecutive measurements, at the rows that the cells put out.
    #[default]
    Random,
    /// Rows chosen from those of a press for what the decoder has learned, before any sample is seen.
    Chosen,
}

impl Sensing {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Random, Self::Chosen];

    /// Name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Chosen => "chosen",
        }
    }
}
