//! Rows of the board.

use crate::alignment::SessionSlip;
use crate::place::PlaceRow;
use crate::sensing::Sensing;
use crate::tally::Scores;
use serde::{Deserialize, Serialize};

/// A row of the score table: one decoder at one M, means over the objects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BoardRow {
    /// Algorithm.
    pub decoder: String,
    /// Number of measurements, M.
    pub m: usize,
    /// Whether the scored object was excluded from the training data.
    pub left_out: bool,
    /// Training data: "published", "raster" (raster presses of the same recordings that are not scored), "nothing", or
    /// the name of another source.
    pub learned_from: String,
    /// How the rows of a window are obtained.
    #[serde(default)]
    pub sensing: Sensing,
    /// Scores, means over the objects.
    #[serde(flatten)]
    pub scores: Scores,
    /// 95 % confidence interval of `support`, by resampling presses within every object.
    pub support_ci: Option<[f64; 2]>,
    /// 95 % confidence interval of `iou`, by the same resampling.
    pub iou_ci: Option<[f64; 2]>,
    /// 95 % confidence interval of `class_single`, by the same resampling.
    pub class_single_ci: Option<[f64; 2]>,
    /// Median time of a decode on one thread, µs, from rows of weights and samples to image or class, including Φ·D.
    /// Only this column and `too_slow` differ between runs. `None` if times were not requested.
    pub decode_us: Option<f64>,
    /// Time in which the M measurements arrive, µs.
    pub acquire_us: f64,
    /// Whether a decode takes longer than `acquire_us`; `None` if times were not requested.
    pub too_slow: Option<bool>,
    /// Number of windows that the algorithm could not solve. They score as empty images without a class.
    pub failed: usize,
}

/// A row of the score table of single objects: one decoder at one M on one object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObjectRow {
    /// Algorithm.
    pub decoder: String,
    /// Number of measurements, M.
    pub m: usize,
    /// As in [`BoardRow`].
    pub left_out: bool,
    /// As in [`BoardRow`].
    pub learned_from: String,
    /// As in [`BoardRow`].
    #[serde(default)]
    pub sensing: Sensing,
    /// Object.
    pub object: String,
    /// Scores.
    #[serde(flatten)]
    pub scores: Scores,
    /// 95 % confidence interval of `iou`, by resampling the object's presses.
    #[serde(default)]
    pub iou_ci: Option<[f64; 2]>,
    /// 95 % confidence interval of `class_single`, by the same resampling.
    #[serde(default)]
    pub class_single_ci: Option<[f64; 2]>,
}

/// The score table, what `spts score` prints and saves: decoders side by side on the same windows.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ScoreBoard {
    /// Means over the objects.
    pub rows: Vec<BoardRow>,
    /// Localisation of the bouncing ball, and of touches.
    pub localisation: Vec<PlaceRow>,
    /// Object by object.
    pub objects: Vec<ObjectRow>,
    /// Slips of the recordings, which were realigned before scoring.
    #[serde(default)]
    pub slips: Vec<SessionSlip>,
}

impl ScoreBoard {
    /// The row of `decoder`, `m`, `left_out` and `learned_from` with consecutive measurements.
    #[must_use]
    pub fn row(&self, decoder: &str, m: usize, left_out: bool, learned_from: &str) -> Option<&BoardRow> {
        let same = |r: &&BoardRow| {
            let conditions = r.left_out == left_out && r.learned_from == learned_from;
            r.decoder == decoder && r.m == m && conditions && r.sensing == Sensing::Random
        };
        self.rows.iter().find(same)
    }

    /// The row with the same decoder and conditions as `other`.
    #[must_use]
    pub fn row_like(&self, other: &BoardRow) -> Option<&BoardRow> {
        let key = |r: &BoardRow| (r.m, r.left_out, r.sensing);
        let same =
            |r: &&BoardRow| key(r) == key(other) && r.decoder == other.decoder && r.learned_from == other.learned_from;
        self.rows.iter().find(same)
    }
}
