//! Rows of the results.

use super::tally::StopScores;
use crate::algorithm::Subject;
use crate::sensing::Sensing;
use serde::{Deserialize, Serialize};

/// One decoder with one stopping rule: means over the objects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AnytimeRow {
    /// Algorithm.
    pub decoder: String,
    /// The property to which the confidence refers, and of which `attained` is the score.
    pub subject: Subject,
    /// How the rows of a window are obtained.
    pub sensing: Sensing,
    /// Whether the scored object was excluded from the training data.
    pub left_out: bool,
    /// Training data, named as on the board.
    pub learned_from: String,
    /// Confidence at which the decoder stops; `None` for a fixed number of samples.
    pub confidence: Option<f64>,
    /// Largest number of samples in a window.
    pub most: usize,
    /// Scores, means over the objects.
    #[serde(flatten)]
    pub scores: StopScores,
    /// 95 % confidence interval of `samples`, by resampling presses within every object.
    pub samples_ci: Option<[f64; 2]>,
    /// 95 % confidence interval of `attained`, by the same resampling.
    pub attained_ci: Option<[f64; 2]>,
    /// Number of windows of all objects.
    pub windows: usize,
    /// Number of windows that the algorithm could not process to the end. They count as never confident and wrong.
    pub failed: usize,
}

/// Results of `spts score --anytime` for one object, decoder and confidence.
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
    /// Number of windows of the object.
    pub windows: usize,
}

/// Results of `spts score --anytime`: how many samples decoders need to be sure, and how often they are right then.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct AnytimeBoard {
    /// Means over the objects.
    pub rows: Vec<AnytimeRow>,
    /// Object by object.
    pub objects: Vec<AnytimeObject>,
}
