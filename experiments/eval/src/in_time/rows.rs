//! Rows of the results.

use super::tally::InTimeScores;
use serde::{Deserialize, Serialize};

/// Kind of contact.
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
    /// Algorithm for single windows, whose prior is used for tracking.
    pub decoder: String,
    /// Whether the scored object was excluded from the training data.
    pub left_out: bool,
    /// Training data, named as on the board.
    pub learned_from: String,
    /// Kind of contact.
    pub contact: ContactKind,
    /// Number of samples in a window.
    pub m: usize,
    /// Time from the touch to the end of the window, s; `None` while the contact is steady.
    pub since_touch_s: Option<f64>,
    /// Scores, means over the objects.
    #[serde(flatten)]
    pub scores: InTimeScores,
    /// Number of presses or drops that are scored.
    pub contacts: usize,
}

/// Results of `spts score --in-time` for one decoder on one object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InTimeObject {
    /// Object.
    pub object: String,
    /// Its results.
    #[serde(flatten)]
    pub row: InTimeRow,
}

/// Results of `spts score --in-time`: images of contacts that are followed in time, at set times after the touch.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct InTimeBoard {
    /// Means over the objects.
    pub rows: Vec<InTimeRow>,
    /// Single objects, for presses.
    pub objects: Vec<InTimeObject>,
}
