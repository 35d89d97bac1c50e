//! Lines of results.

use super::tally::StopScores;
use crate::algorithm::Subject;
use crate::sensing::Sensing;
use serde::{Deserialize, Serialize};

/// One decoder with one way to stop: means over the objects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AnytimeRow {
    /// Algorithm.
    pub decoder: String,
    /// What it is sure of, and what `attained` is the score of.
    pub subject: Subject,
    /// How the rows of a window come about.
    pub sensing: Sensing,
    /// Whether the scored object was kept out of what the algorithm learned from.
    pub left_out: bool,
    /// What it learned from, as on the board.
    pub learned_from: String,
    /// Confidence at which it stops. `None`: it takes a fixed number of samples.
    pub confidence: Option<f64>,
    /// Most samples of a window.
    pub most: usize,
    /// Scores, means over the objects.
    #[serde(flatten)]
    pub scores: StopScores,
    /// 95 % confidence interval of `samples`, by drawing presses anew within every object.
    pub samples_ci: Option<[f64; 2]>,
    /// The same of `attained`.
    pub attained_ci: Option<[f64; 2]>,
    /// Windows of all objects.
    pub windows: usize,
    /// Windows that the algorithm could not follow to their end; they count as never sure and wrong.
    pub failed: usize,
}

/// The same on one object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AnytimeObject {
    /// Algorithm.
    pub decoder: String,
    /// As in [`AnytimeRow`].
    pub subject: Subject,
    /// As in [`AnytimeRow`].
    pub sensing: Sensing,
    /// As in [`AnytimeRow`].
    pub left_out: bool,
    /// As in [`AnytimeRow`].
    pub learned_from: String,
    /// As in [`AnytimeRow`].
    pub confidence: Option<f64>,
    /// Object.
    pub object: String,
    /// Scores.
    #[serde(flatten)]
    pub scores: StopScores,
    /// Windows of the object.
    pub windows: usize,
}

/// Everything `spts score --anytime` prints.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct AnytimeBoard {
    /// Means over the objects.
    pub rows: Vec<AnytimeRow>,
    /// Object by object.
    pub objects: Vec<AnytimeObject>,
}
