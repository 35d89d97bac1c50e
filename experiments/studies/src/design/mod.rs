//! Designs a skin for given requirements. Input: area, resolution, latency and image quality. Output: taxels, wires,
//! electronics, rows and decoder, with a promise that a simulation of other touches can check.
//!
//! [`DesignStudy`] searches. [`DesignCheck`] simulates a [`Design`] with touches, specimens and parts that were not
//! used in the search, and reports whether the promise holds.

use crate::electronics::ElectronicsStudy;
use crate::touches::Touch;
use search::{best, draw};
use serde::{Deserialize, Serialize};
use spts::progress::Progress;
use spts_eval::training::TrainingData;
use spts_input::Refusal;
use spts_models::{SkinLayout, within};
use spts_recon::matrix_free::SheetPrior;
use spts_recon::statistics::Band;

mod answer;
mod check;
mod objects;
mod search;
mod wire;

pub use answer::counted;
pub use check::{CheckReport, CheckedQuantity, DesignCheck};
pub use objects::DesignObjects;
pub use search::OUTSIDE;
pub(crate) use wire::BandRows;
pub use wire::{FeedbackLimit, RowSource, WireDesign};

/// How many wires a designed skin may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WireChoice {
    /// Exactly this number.
    Exactly(usize),
    /// As few as necessary, and at most this number.
    UpTo(usize),
}

/// What `spts design` is asked for: area, pitch, latency, image quality, wires and objects of a skin.
///
/// ```
/// use spts_studies::design::{DesignObjects, DesignStudy, WireChoice};
///
/// let study = DesignStudy {
///     area_m: [0.16, 0.16],
///     pitch_m: 5e-3,
///     latency_s: 5e-3,
///     iou: 0.8,
///     wires: WireChoice::UpTo(4),
///     objects: DesignObjects::named("small")?,
///     seed: 1,
/// };
/// assert_eq!(study.layout()?.taxels(), 32 * 32);
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct DesignStudy {
    /// Width and height of the sheet, m.
    pub area_m: [f64; 2],
    /// Distance between neighbouring taxels, m.
    pub pitch_m: f64,
    /// Time from touch to image, s.
    pub latency_s: f64,
    /// Required mean IoU of the images.
    pub iou: f64,
    /// Number of wires.
    pub wires: WireChoice,
    /// The objects for which it is designed.
    pub objects: DesignObjects,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Most taxels along a side.
const MOST_SIDE: f64 = 256.0;
/// Repetitions that the decoder learns from.
const LEARNED: usize = 8;

/// What all designs of one skin share.
pub(super) struct Ground {
    pub(super) layout: SkinLayout,
    pub(super) electronics: ElectronicsStudy,
    pub(super) prior: SheetPrior,
    pub(super) learned: Vec<Touch>,
    /// Objects that are pressed at once.
    pub(super) contacts: usize,
}

impl Ground {
    fn by_patches(&self) -> bool {
        by_patches(self.layout.taxels(), self.contacts)
    }
}

impl DesignStudy {
    /// Designs the skin. The result depends only on the settings, not on the number of threads.
    ///
    /// # Errors
    /// [`Refusal`] for an input outside its range, or if touches cannot be drawn, measured or decoded.
    pub fn run(&self, progress: &dyn Progress) -> Result<DesignReport, Refusal> {
        let layout = self.layout()?;
        progress.stage("learning", None);
        let ground = self.ground(layout)?;
        progress.stage("searching", None);
        let mut tried = self.search(&ground)?;
        progress.stage("promising", None);
        let best = best(&tried);
        let chosen = tried.swap_remove(best);
        let (chosen, design) = self.promised(&ground, chosen)?;
        progress.stage("comparing", None);
        let report = self.report(&ground, chosen, tried, design)?;
        progress.end();
        Ok(report)
    }

    /// Layout of the skin.
    ///
    /// # Errors
    /// [`Refusal`] for an input outside its range, or a skin that is too small, too large or has fewer rows than wires.
    pub fn layout(&self) -> Result<SkinLayout, Refusal> {
        for side_m in self.area_m {
            within("area", side_m, 1e-3, 10.0, "[0.001, 10] m a side")?;
        }
        within("resolution", self.pitch_m, 1e-4, 1.0, "[0.0001, 1] m")?;
        within("latency", self.latency_s, 1e-6, 10.0, "[1e-6, 10] s")?;
        within("iou", self.iou, 0.01, 0.99, "[0.01, 0.99]")?;
        // whole taxels in the area, to rounding
        let [cols, rows] = self.area_m.map(|side_m| (side_m / self.pitch_m + 1e-6).floor());
        if ![rows, cols].iter().all(|side| (2.0..=MOST_SIDE).contains(side)) {
            return Err(Refusal::new(format!(
                "`area` / `resolution`: {rows:.0} × {cols:.0} taxels are outside [2, 256] a side"
            )));
        }
        #[expect(clippy::cast_possible_truncation, reason = "at most 256")]
        let (rows, cols) = (rows as usize, cols as usize);
        let (WireChoice::Exactly(wires) | WireChoice::UpTo(wires)) = self.wires;
        if wires == 0 || (wires > rows && matches!(self.wires, WireChoice::Exactly(_))) {
            return Err(Refusal::new(format!(
                "`wires` = {wires} is outside [1, {rows}]: every wire reads whole rows of the skin"
            )));
        }
        let electrode_m = SkinLayout::usual_electrode_m(self.pitch_m);
        SkinLayout::new(rows, cols, self.pitch_m, electrode_m)
    }

    /// Learns what images are like.
    pub(super) fn ground(&self, layout: SkinLayout) -> Result<Ground, Refusal> {
        let drawn = draw(&self.objects, &layout, "design/learned", self.seed, LEARNED)?;
        let learned: Vec<Touch> = drawn.into_iter().flat_map(|(touches, _)| touches).collect();
        let images = learned.iter().map(|t| t.conductance_s.values());
        Ok(Ground {
            layout,
            electronics: ElectronicsStudy::as_designed()?,
            prior: SheetPrior::like(images, [layout.rows(), layout.cols()])?,
            learned,
            contacts: self.objects.contacts,
        })
    }
}

/// The decoder of a skin with so many taxels under so many contacts at once.
fn decoder_name(taxels: usize, contacts: usize) -> &'static str {
    if by_patches(taxels, contacts) { "patches" } else { "SheetDecoder" }
}

/// Whether the decoder is `patches` of sessions, [`spts_recon::matrix_free::OnSheet`], and not
/// [`spts_recon::matrix_free::SheetDecoder`]: of several contacts on a large skin the latter has too few taxels to
/// solve for, and of a single one it needs far fewer measurements.
fn by_patches(taxels: usize, contacts: usize) -> bool {
    contacts > 1 && taxels > TrainingData::MOST_TAXELS
}

/// A designed skin: everything needed to simulate it again, and its expected performance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Design {
    /// Rows of taxels.
    pub rows: usize,
    /// Columns of taxels.
    pub cols: usize,
    /// Number of taxels N.
    pub taxels: usize,
    /// Distance between neighbouring taxels, m.
    pub pitch_m: f64,
    /// Side of an electrode, m.
    pub electrode_m: f64,
    /// The objects for which it is designed.
    pub objects: DesignObjects,
    /// Wires, each with a sub-array, an amplifier and a converter, read at the same time.
    pub wires: usize,
    /// Taxels of every wire's sub-array, a band of whole rows of the skin.
    pub sub_arrays: Vec<usize>,
    /// Electronics of a wire.
    pub wire: WireDesign,
    /// Source of the rows of the sensing matrix.
    pub row_source: RowSource,
    /// Number of measurements of every wire.
    pub m_per_wire: usize,
    /// Number of measurements of all wires, M.
    pub m: usize,
    /// Decoder.
    pub decoder: DecoderDesign,
    /// Expected performance.
    pub expected: Expectation,
    /// Seed of all random numbers of the design.
    pub seed: u64,
}

/// The decoder that belongs to a designed skin, and what it takes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DecoderDesign {
    /// Name: `spts_recon::matrix_free::SheetDecoder`.
    pub name: String,
    /// Largest number of taxels with non-zero values.
    pub places: usize,
    /// Covariance of two taxels of a row at a distance of 0, 1, 2, … taxels in the expected images, relative to that at
    /// 0.
    pub covariance_along_rows: Vec<f64>,
    /// The same covariance for two taxels of a column.
    pub covariance_along_cols: Vec<f64>,
    /// Memory of the prepared decoder, bytes.
    pub bytes: usize,
    /// Approximate number of multiplications for an image.
    pub products: usize,
}

/// What a design promises: values with the bands in which a check has to find them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expectation {
    /// Intersection over union of image and touch.
    pub iou: Band,
    /// Median distance between image and touch, taxels.
    pub place_px: Band,
    /// Median distance between image and touch, mm.
    pub place_mm: Band,
    /// Share of the seventeen objects that are recognised; `None` if it cannot be determined.
    pub class: Option<Band>,
    /// Why it cannot be determined.
    pub no_class: Option<String>,
    /// Number of repetitions, each with its own specimen, parts, touches and noise.
    pub repetitions: usize,
    /// Number of touches in a repetition.
    pub touches: usize,
    /// Probability that the check of a correct design finds a quantity outside its band.
    pub outside: f64,
}

/// The time from touch to image of a designed skin, part by part.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LatencyParts {
    /// Requested latency, s.
    pub limit_s: f64,
    /// Time of all measurements of a wire, s, which must not exceed the limit.
    pub acquisition_s: f64,
    /// Part of every measurement in which the output settles, s.
    pub settle_s: f64,
    /// Time of the decoder for the largest image at 10⁹ multiplications a second, s: an estimate that is not part of
    /// the limit.
    pub decode_estimate_s: f64,
}

/// Numbers of parts of a designed skin, and the time to load its cells: what its price depends on.
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
    /// Buses of up to 112 cells, which are loaded in parallel.
    pub buses: usize,
    /// Number of bits of every cell's pattern; `None` for generators.
    pub pattern_bits: Option<usize>,
    /// Bytes written to each cell before the start.
    pub bytes_a_cell: usize,
    /// Time to write them to all cells at 400 kHz, s.
    pub load_s: f64,
}

/// Which requirement keeps a designed skin from being better.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Binding {
    /// The image quality determines the number of measurements, and there is time for more.
    Iou,
    /// There is no time for more measurements on a wire.
    Latency,
    /// No more wires are allowed or possible.
    Wires,
    /// The amplifier needs longer to settle than the published clock leaves.
    AmplifierSettling,
    /// More measurements would be needed than there are taxels, or than a decoder can hold.
    Measurements,
}

impl Binding {
    /// The constraint in words.
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

/// A skin that differs from the design in one respect, with what it would reach.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alternative {
    /// Difference from the design, in words.
    pub what: String,
    /// Taxels.
    pub taxels: usize,
    /// Distance between neighbouring taxels, m.
    pub pitch_m: f64,
    /// Wires.
    pub wires: usize,
    /// Source of the rows.
    pub rows: String,
    /// Number of measurements of every wire.
    pub m_per_wire: usize,
    /// Time of all measurements, s.
    pub acquisition_s: f64,
    /// Mean IoU, simulated with fewer touches than the design itself; `None` if nothing was simulated.
    pub iou: Option<f64>,
    /// Median place error, mm.
    pub place_mm: Option<f64>,
}

/// IoU over the number of measurements, for one number of wires and one kind of rows that the search tried.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DesignCurve {
    /// Wires.
    pub wires: usize,
    /// Source of the rows.
    pub rows: RowSource,
    /// Points in increasing order of M on a wire.
    pub points: Vec<DesignPoint>,
}

/// A number of measurements that the search tried, and the scores with it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DesignPoint {
    /// Measurements of every wire.
    pub m_per_wire: usize,
    /// Mean IoU and its band over the repetitions of the search.
    pub iou: Band,
    /// Median place error, taxels.
    pub place_px: f64,
}

/// Results of `spts design`: the skin that meets the requirements, its electronics, its promise, and what else was
/// tried.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DesignReport {
    /// Whether the design is expected to reach the requested IoU within the latency.
    pub reached: bool,
    /// Requested IoU.
    pub iou_wanted: f64,
    /// The design with the fewest wires and then the fewest measurements that meets the requirements; otherwise the
    /// best one.
    #[serde(flatten)]
    pub design: Design,
    /// Parts of the time from touch to image.
    pub latency: LatencyParts,
    /// Quantities that determine the cost.
    pub cost: CostDrivers,
    /// The limiting constraint.
    pub binding: Binding,
    /// Explanation of the constraint, in a sentence.
    pub binding_reason: String,
    /// Largest number of taxels on one wire with the electronics of `as_designed` and the pressed skin of `spts
    /// circuit`, as that command shows it.
    pub one_wire_taxels: Option<u32>,
    /// Alternative designs.
    pub alternatives: Vec<Alternative>,
    /// IoU as a function of M for every combination that was tried.
    pub curves: Vec<DesignCurve>,
    /// Readout profile with its rows, TOML.
    #[serde(skip)]
    pub profile: String,
    /// Pattern of a sub-array, one row a line; `None` for generators.
    #[serde(skip)]
    pub pattern: Option<String>,
    /// Scene for `spts simulate`.
    #[serde(skip)]
    pub scene: String,
}
