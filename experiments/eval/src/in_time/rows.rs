//! Lines of results.

use super::tally::InTimeScores;
use serde::{Deserialize, Serialize};

/// What is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactKind {
    /// A press, from the touch to the hold.
    Press,
    /// A bouncing ball, from the touch to the end of the contact.
    Drop,
}

impl ContactKind {
    /// Name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Press => "press",
            Self::Drop => "drop",
        }
    }
}

/// One decoder with windows of one size at one moment: means over the objects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InTimeRow {
    /// Algorithm of windows alone, whose prior is followed in time.
    pub decoder: String,
    /// Whether the scored object was kept out of what the algorithm learned from.
    pub left_out: bool,
    /// What it learned from, as on the board.
    pub learned_from: String,
    /// What is followed.
    pub contact: ContactKind,
    /// Samples of a window.
    pub m: usize,
    /// Time from the touch to the end of the window, s. `None`: while the contact is steady.
    pub since_touch_s: Option<f64>,
    /// Scores, means over the objects.
    #[serde(flatten)]
    pub scores: InTimeScores,
    /// Presses or drops that are scored.
    pub contacts: usize,
}

/// The same of one object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InTimeObject {
    /// Object.
    pub object: String,
    /// Its line.
    #[serde(flatten)]
    pub row: InTimeRow,
}

/// Everything `spts score --in-time` prints.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct InTimeBoard {
    /// Means over the objects.
    pub rows: Vec<InTimeRow>,
    /// Object by object, of presses.
    pub objects: Vec<InTimeObject>,
}
