//! The board's lines.

use crate::alignment::SessionSlip;
use crate::place::PlaceRow;
use crate::sensing::Sensing;
use crate::tally::Scores;
use serde::{Deserialize, Serialize};

/// One decoder at one M: means over the objects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BoardRow {
    /// Algorithm.
    pub decoder: String,
    /// Number of measurements, M.
    pub m: usize,
    /// Whether the scored object was kept out of what the algorithm learned from.
    pub left_out: bool,
    /// What it learned from: "published", "raster" (raster presses of the same recordings that are not scored),
    /// "nothing", or the name of another source.
    pub learned_from: String,
    /// How the rows of a window come about.
    #[serde(default)]
    pub sensing: Sensing,
    /// Scores, means over the objects.
    #[serde(flatten)]
    pub scores: Scores,
    /// 95 % confidence interval of `support`, by drawing presses anew within every object.
    pub support_ci: Option<[f64; 2]>,
    /// The same of `iou`.
    pub iou_ci: Option<[f64; 2]>,
    /// The same of `class_single`.
    pub class_single_ci: Option<[f64; 2]>,
    /// Median time of a decode on one thread, µs: rows of weights and samples in, image or class out, Φ·D included. The
    /// only columns that differ from run to run are this one and `too_slow`. `None` when times were not asked for.
    pub decode_us: Option<f64>,
    /// Time in which M measurements arrive, µs.
    pub acquire_us: f64,
    /// Whether a decode takes longer than that.
    pub too_slow: Option<bool>,
    /// Windows that the algorithm could not solve; they score as empty images of no class.
    pub failed: usize,
}

/// One decoder at one M on one object.
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
    /// 95 % confidence interval of `iou`, by drawing the object's presses anew.
    #[serde(default)]
    pub iou_ci: Option<[f64; 2]>,
    /// The same of `class_single`.
    #[serde(default)]
    pub class_single_ci: Option<[f64; 2]>,
}

/// Everything `spts score` prints.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ScoreBoard {
    /// Means over the objects.
    pub rows: Vec<BoardRow>,
    /// The bouncing ball, and touches.
    pub localisation: Vec<PlaceRow>,
    /// Object by object.
    pub objects: Vec<ObjectRow>,
    /// Where samples lagged behind their rows, on which they were put back before they were scored.
    #[serde(default)]
    pub slips: Vec<SessionSlip>,
}

impl ScoreBoard {
    /// The row of `decoder`, `m`, `left_out` and `learned_from`, of windows that follow each other.
    #[must_use]
    pub fn row(&self, decoder: &str, m: usize, left_out: bool, learned_from: &str) -> Option<&BoardRow> {
        let same = |r: &&BoardRow| {
            let conditions = r.left_out == left_out && r.learned_from == learned_from;
            r.decoder == decoder && r.m == m && conditions && r.sensing == Sensing::Random
        };
        self.rows.iter().find(same)
    }

    /// The row of the same decoder and conditions as `other`.
    #[must_use]
    pub fn row_like(&self, other: &BoardRow) -> Option<&BoardRow> {
        let key = |r: &BoardRow| (r.m, r.left_out, r.sensing);
        let same =
            |r: &&BoardRow| key(r) == key(other) && r.decoder == other.decoder && r.learned_from == other.learned_from;
        self.rows.iter().find(same)
    }
}
