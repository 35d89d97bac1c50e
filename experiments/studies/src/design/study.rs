//! What is asked of a skin, and the way to its design: learn, search, promise, compare.

use super::bench::draw;
use super::objects::DesignObjects;
use super::report::DesignReport;
use super::search::best;
use crate::electronics::ElectronicsStudy;
use crate::touches::Touch;
use spts::progress::Progress;
use spts_input::Refusal;
use spts_models::SkinLayout;
use spts_recon::matrix_free::SheetPrior;

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
        let within = |field, value: f64, least: f64, most: f64, range| {
            if (least..=most).contains(&value) {
                Ok(())
            } else {
                Err(Refusal::range(field, value, range))
            }
        };
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
        Ok(SkinLayout::new(rows, cols, self.pitch_m, electrode_m)?)
    }

    /// Learns what images are like.
    pub(super) fn ground(&self, layout: SkinLayout) -> Result<Ground, Refusal> {
        let drawn = draw(&self.objects, &layout, "design/learned", self.seed, LEARNED)?;
        let learned: Vec<Touch> = drawn.into_iter().flat_map(|(touches, _)| touches).collect();
        let images = learned.iter().map(|t| t.conductance_s.values());
        Ok(Ground {
            layout,
            electronics: ElectronicsStudy::as_designed()?,
            prior: SheetPrior::like(images, [layout.rows(), layout.cols()]).map_err(Refusal::from_error)?,
            learned,
        })
    }
}
