//! What was designed, and what it promises.

use super::band::Promise;
use super::objects::DesignObjects;
use super::rows::RowSource;
use super::wire::WireDesign;
use serde::{Deserialize, Serialize};

/// A designed skin: all that simulates it once more, and what is expected of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Design {
    /// Rows of taxels.
    pub rows: usize,
    /// Columns of taxels.
    pub cols: usize,
    /// Number of taxels N.
    pub taxels: usize,
    /// Distance of neighbouring taxels, m.
    pub pitch_m: f64,
    /// Side of an electrode, m.
    pub electrode_m: f64,
    /// What it is designed for.
    pub objects: DesignObjects,
    /// Wires, each with a sub-array, an amplifier and a converter, read at the same time.
    pub wires: usize,
    /// Taxels of every wire's sub-array, a band of whole rows of the skin.
    pub sub_arrays: Vec<usize>,
    /// Electronics of a wire.
    pub wire: WireDesign,
    /// Where the rows of the sensing matrix come from.
    pub row_source: RowSource,
    /// Measurements of every wire.
    pub m_per_wire: usize,
    /// Measurements of all wires, M.
    pub m: usize,
    /// Decoder.
    pub decoder: DecoderDesign,
    /// What is expected.
    pub expected: Expectation,
    /// Root of every random number of the design.
    pub seed: u64,
}

/// The decoder of a design.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DecoderDesign {
    /// Name: `spts_recon::matrix_free::SheetDecoder`.
    pub name: String,
    /// Taxels that are solved for at most.
    pub places: usize,
    /// Covariance of two taxels of a row at a distance of 0, 1, 2, … taxels, over that at 0: the images that are
    /// expected.
    pub covariance_along_rows: Vec<f64>,
    /// The same for two taxels of a column.
    pub covariance_along_cols: Vec<f64>,
    /// Bytes that the prepared decoder holds.
    pub bytes: usize,
    /// Multiplications of an image, about.
    pub products: usize,
}

/// What a check of the design is expected to find.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expectation {
    /// Intersection over union of image and touch.
    pub iou: Promise,
    /// Distance of image and touch, median, taxels.
    pub place_px: Promise,
    /// The same, mm.
    pub place_mm: Promise,
    /// Share of the seventeen objects that are recognised; `None` where that cannot be said.
    pub class: Option<Promise>,
    /// Why it cannot be said.
    pub no_class: Option<String>,
    /// Repetitions, each with a specimen, parts, touches and noise of its own.
    pub repetitions: usize,
    /// Touches of a repetition.
    pub touches: usize,
    /// Probability that the check of a design that is as it says finds a quantity outside of its band.
    pub outside: f64,
}

/// Where the time from touch to image goes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LatencyParts {
    /// Latency asked for, s.
    pub limit_s: f64,
    /// All measurements of a wire, s: what counts against the limit.
    pub acquisition_s: f64,
    /// Part of every measurement in which the output settles, s.
    pub settle_s: f64,
    /// Time of the decoder for the largest image at 10⁹ multiplications a second, s; an estimate beside the limit.
    pub decode_estimate_s: f64,
}

/// What drives the cost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CostDrivers {
    /// Cells, one a taxel.
    pub cells: usize,
    /// Wires.
    pub wires: usize,
    /// Summing amplifiers.
    pub amplifiers: usize,
    /// Converters.
    pub converters: usize,
    /// Buses of at most 112 cells, which load side by side.
    pub buses: usize,
    /// Bits of every cell's pattern; none for generators.
    pub pattern_bits: Option<usize>,
    /// Bytes that are written to a cell before the start.
    pub bytes_a_cell: usize,
    /// Time to write them to all cells at 400 kHz, s.
    pub load_s: f64,
}

/// The constraint that binds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Binding {
    /// The image decides how many measurements are needed, and there is time for more.
    Iou,
    /// There is no time for more measurements on a wire.
    Latency,
    /// No more wires are allowed, or there are none.
    Wires,
    /// The amplifier needs longer to settle than the published clock leaves.
    AmplifierSettling,
    /// More measurements than taxels, or than a decoder holds, would be needed.
    Measurements,
}

impl Binding {
    /// In words.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Iou => "IoU",
            Self::Latency => "latency",
            Self::Wires => "wires",
            Self::AmplifierSettling => "amplifier settling",
            Self::Measurements => "measurements",
        }
    }
}

/// Another way to build it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alternative {
    /// What is different, in words.
    pub what: String,
    /// Taxels.
    pub taxels: usize,
    /// Distance of neighbouring taxels, m.
    pub pitch_m: f64,
    /// Wires.
    pub wires: usize,
    /// Where rows come from.
    pub rows: String,
    /// Measurements of every wire.
    pub m_per_wire: usize,
    /// Time of all measurements, s.
    pub acquisition_s: f64,
    /// Mean IoU, simulated with fewer touches than the design itself; `None` where nothing was simulated.
    pub iou: Option<f64>,
    /// Median place error, mm.
    pub place_mm: Option<f64>,
}

/// IoU against the number of measurements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DesignCurve {
    /// Wires.
    pub wires: usize,
    /// Where rows come from.
    pub rows: RowSource,
    /// Points, M a wire rising.
    pub points: Vec<DesignPoint>,
}

/// One number of measurements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DesignPoint {
    /// Measurements of every wire.
    pub m_per_wire: usize,
    /// IoU with the band that its mean lies in, of the repetitions of the search.
    pub iou: crate::touches::Band,
    /// Median place error, taxels.
    pub place_px: f64,
}

/// The answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DesignReport {
    /// Whether the design is expected to have the IoU that was asked for within the latency.
    pub reached: bool,
    /// IoU asked for.
    pub iou_wanted: f64,
    /// The design: the one with the fewest wires and then the fewest measurements, or the best that there is.
    #[serde(flatten)]
    pub design: Design,
    /// Time from touch to image.
    pub latency: LatencyParts,
    /// Cost drivers.
    pub cost: CostDrivers,
    /// The constraint that binds.
    pub binding: Binding,
    /// Why, in a sentence.
    pub binding_reason: String,
    /// Most taxels on one wire as designed with the pressed skin of `spts circuit`, as `spts circuit` and `spts
    /// explore` print it.
    pub one_wire_taxels: Option<u32>,
    /// Other ways to build it.
    pub alternatives: Vec<Alternative>,
    /// IoU against M for everything that was tried.
    pub curves: Vec<DesignCurve>,
    /// Readout profile, TOML.
    #[serde(skip)]
    pub profile: String,
    /// Pattern of a sub-array, one line a row; `None` for generators.
    #[serde(skip)]
    pub pattern: Option<String>,
    /// Scene that `spts simulate` takes.
    #[serde(skip)]
    pub scene: String,
}
