//! What is shown of one update.

use serde::Serialize;

/// One update of the page.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "type", rename = "frame")]
pub struct Frame {
    /// Number of the update, from 1.
    pub number: u64,
    /// Force on the object, N.
    pub force_n: f64,
    /// Why the object is not pressed as asked.
    pub note: Option<String>,
    /// Mean pressure over every taxel, kPa, row by row.
    pub pressure_kpa: Vec<f64>,
    /// Taxels in the support of the pressure: above the published share of its maximum.
    pub touched: Vec<usize>,
    /// The wire, once for every kind of rows that is shown.
    pub lines: Vec<LineFrame>,
    /// The two images.
    pub panels: Vec<PanelFrame>,
    /// Time that the update took, ms.
    pub work_ms: f64,
}

/// A frame of measurements of one wire.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LineFrame {
    /// Name of its rows.
    pub rows: String,
    /// Output of the amplifier, V.
    pub volts: Vec<f64>,
    /// Output while nothing touches the skin, V.
    pub idle_v: f64,
    /// Measurements a second, Hz.
    pub sample_rate_hz: f64,
}

/// One of the two images.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct PanelFrame {
    /// The image, V, row by row; empty when there is none.
    pub image: Vec<f64>,
    /// Intersection over union of its support with that of the pressure; none while nothing touches the skin.
    pub iou: Option<f64>,
    /// Share of taxels on the right side of the support.
    pub support: Option<f64>,
    /// Time of the decoding, µs.
    pub decode_us: f64,
    /// Why there is no image.
    pub waits_for: Option<String>,
}

/// `values` with so many digits behind the point.
pub(crate) fn rounded(values: impl IntoIterator<Item = f64>, digits: i32) -> Vec<f64> {
    let scale = 10_f64.powi(digits);
    values.into_iter().map(|v| (scale * v).round() / scale).collect()
}
