//! What is recorded of a touch, and when.

use crate::spec::Spec;
use serde::Deserialize;

/// Section `[record]`: which windows are recorded, and what is stored of them.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RecordConfig {
    /// When windows are recorded. Default: "hold".
    pub what: RecordKind,
    /// Number of windows of a press or drop, one a row; [1, 10000]. Default: 1 for "hold", the whole press for
    /// "course", 16 for "drop".
    pub windows: Option<u64>,
    /// Time from the start of one window to the start of the next, s; at least the duration of a window, at most 10.
    /// Default: 0.02 for "course", 0.001 for "drop"; the windows of a "hold" follow each other without a gap.
    pub interval_s: Option<f64>,
    /// Time from the start of the first window to the touch, s; [0, 10]. Not for "hold". Default: 0.1 for "course",
    /// 0.004 for "drop".
    pub before_s: Option<f64>,
    /// M, number of measurements in a window; [1, 10^6]. Default 20.
    pub measurements: usize,
    /// Ground truth of every taxel, one column each. Default: all three; fewer give smaller files.
    pub labels: Vec<Label>,
    /// Whether the raster scan of the press is recorded. Default true.
    pub raster: bool,
    /// Whether the rows of Φ are stored, in addition to generator, seeds and first row. Default false.
    pub phi: bool,
    /// Whether samples are stored as codes of the converter instead of volts. Default false.
    pub codes: bool,
}

/// A ground truth of every taxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Label {
    /// Mean pressure over the taxel's area: `pressure_pa`.
    Pressure,
    /// Its conductance: `conductance_s`.
    Conductance,
    /// Whether the taxel is touched: `support`.
    Support,
}

impl Label {
    /// All.
    pub const ALL: [Self; 3] = [Self::Pressure, Self::Conductance, Self::Support];

    /// Whether `spec` asks for it.
    pub(crate) fn is_in(self, spec: &Spec) -> bool {
        spec.config().record.labels.contains(&self)
    }
}

/// When windows are recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RecordKind {
    /// While the object is held: from `press.hold_s` after the touch on.
    Hold,
    /// During the whole press: from before the touch, through rise, plateau and fall of the force.
    Course,
    /// During the fall of a ball: from before its touch on.
    Drop,
}

impl Default for RecordConfig {
    fn default() -> Self {
        Self {
            what: RecordKind::Hold,
            windows: None,
            interval_s: None,
            before_s: None,
            measurements: 20,
            labels: Label::ALL.to_vec(),
            raster: true,
            phi: false,
            codes: false,
        }
    }
}
