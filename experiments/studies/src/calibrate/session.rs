//! Combines the presses of one session.

use super::SessionPair;
use super::beat::{Beat, beat};
use super::faults::{self, CellFault};
use super::gains::{SessionGains, gains};
use super::late::{Counts, LateCell};
use super::missed::{MissedPress, missed};
use super::overdriven::{self, Overdriven};
use super::press::{PressAnalysis, PressNumbers, analyse};
use super::statistics::{Estimated, mean, middle, quantiles};
use super::steps::{ConverterSteps, steps};
use rayon::prelude::*;
use serde::Serialize;
use spts_circuit::{Recording, Weights};
use std::collections::BTreeMap;
use std::ops::Range;

/// A number of [`PressNumbers`]: name, unit, value.
type Number = (&'static str, &'static str, fn(&PressNumbers) -> f64);

/// Every number of a press.
pub(super) const NUMBERS: [Number; 22] = [
    ("idle_mean", "V", |p| p.idle_mean_v),
    ("idle_sd", "V", |p| p.idle_sd_v),
    ("idle_noise", "V", |p| p.idle_noise_v),
    ("idle_parity", "V", |p| p.idle_parity_v),
    ("idle_sum", "V", |p| p.idle_sum_v),
    ("residual", "V", |p| p.residual_v),
    ("clean_residual", "V", |p| p.clean_v),
    ("core_residual", "V", |p| p.core_v),
    ("h1", "", |p| p.h1),
    ("h2", "", |p| p.h2),
    ("h3", "", |p| p.h3),
    ("offset", "V", |p| p.offset_v),
    ("parity", "V", |p| p.parity_v),
    ("sum", "V", |p| p.sum_v),
    ("norm", "V", |p| p.norm_v),
    ("constant", "V", |p| p.constant_v),
    ("asymmetry", "", |p| p.asymmetry),
    ("outliers_5sd", "", |p| p.outliers),
    ("kurtosis", "", |p| p.kurtosis),
    ("late_per_flip", "", |p| p.late_per_flip),
    ("unexplained_outliers", "", |p| p.unexplained),
    ("contact_fraction", "", |p| p.contact_fraction),
];

/// Number of quantiles of the output that are compared.
pub const QUANTILES: usize = 100;

/// What the calibration finds in one session: parameters of the readout with their standard errors, faulty cells and
/// gains.
#[derive(Debug, Clone, Serialize)]
pub struct SessionEstimates {
    /// Name of the session.
    pub session: String,
    /// Presses that were used, from 1.
    pub presses: Vec<usize>,
    /// Presses that missed and were left out.
    pub missed: Vec<MissedPress>,
    /// Median over the presses and standard error, by name.
    pub numbers: BTreeMap<&'static str, Estimated>,
    /// Grid of the converter; `None` if the values are not on a grid.
    pub steps: Option<ConverterSteps>,
    /// Rate of late flips of the taxels with enough load to be distinguished.
    pub late_cells: Vec<LateCell>,
    /// Beats of the cells whose late updates can be distinguished.
    pub beats: Vec<Beat>,
    /// Cells that do not run their own sequence.
    pub faults: Vec<CellFault>,
    /// Mis-seeded cells whose output is not ±1.
    pub overdriven: Vec<Overdriven>,
    /// Image of the plateau, median over the presses, V.
    pub image_v: Vec<f64>,
    /// Taxels compared with the raster session; `None` without one, or if too few taxels are loaded.
    pub gains: Option<SessionGains>,
    /// Quantiles of the output on the plateau, V.
    #[serde(skip)]
    pub output_quantiles_v: Vec<f64>,
    /// Clean residuals of all presses, V.
    #[serde(skip)]
    pub clean_v: Vec<f64>,
    /// Weights of the recording.
    #[serde(skip)]
    pub weights: Weights,
    /// Measurements a second of the recording, Hz.
    #[serde(skip)]
    pub sample_rate_hz: f64,
}

impl SessionEstimates {
    /// Median over the presses of the value `name`; NaN if there is none.
    #[must_use]
    pub fn value(&self, name: &str) -> f64 {
        self.numbers.get(name).map_or(f64::NAN, |e| e.value)
    }

    /// Estimates from the given presses of `recording`, the compressive recording of `pair` or one like it. The raster
    /// recording of `pair` shows to which cell a foreign sequence belongs, and is the reference for the taxels. Presses
    /// that missed are left out. `None` if no press determines an image.
    #[must_use]
    pub fn of(pair: &SessionPair, recording: &Recording, blocks: &[usize]) -> Option<Self> {
        let hold = &pair.hold;
        let raster = pair.raster.as_ref();
        let contact = raster.and_then(|(raster, hold)| mean_contact(raster, hold));
        let faults = faults::find(recording, hold, contact.as_deref(), blocks);
        let cells = faults::reseeded(&faults);
        let overdriven: Vec<Overdriven> = cells
            .iter()
            .filter_map(|cell| overdriven::fit(recording, hold, blocks, *cell))
            .collect();
        let analysed: Vec<(usize, PressAnalysis)> = blocks
            .par_iter()
            .filter_map(|&block| Some((block, analyse(recording, hold, block, &cells, &overdriven)?)))
            .collect();
        if analysed.is_empty() {
            return None;
        }
        let numbers: Vec<(usize, PressNumbers)> =
            analysed.iter().map(|(block, press)| (*block, press.numbers)).collect();
        let missed = missed(&numbers);
        if !missed.is_empty() {
            // their outliers and residuals reach the faults, too: everything is found anew without them
            let hit = |block: &usize| missed.iter().all(|m| m.press != block + 1);
            let kept: Vec<usize> = blocks.iter().copied().filter(hit).collect();
            let mut found = Self::of(pair, recording, &kept)?;
            found.missed.extend(missed);
            found.missed.sort_by_key(|m| m.press);
            return Some(found);
        }
        let values = |get: fn(&PressNumbers) -> f64| -> Vec<f64> {
            analysed.iter().map(|(_, press)| get(&press.numbers)).collect()
        };
        let image_v = middle_image(&analysed);
        let faulty: Vec<usize> = cells.iter().map(|cell| cell.taxel as usize).collect();
        let used: Vec<usize> = analysed.iter().map(|(block, _)| *block).collect();
        Some(Self {
            session: pair.session.clone(),
            presses: used.iter().map(|block| block + 1).collect(),
            missed,
            numbers: NUMBERS
                .iter()
                .map(|(name, _, get)| (*name, Estimated::median_of(&values(*get))))
                .collect(),
            steps: steps(recording, &used),
            late_cells: late_cells(&analysed),
            beats: beats(&analysed),
            overdriven,
            faults,
            gains: contact.and_then(|raster_v| gains(&image_v, &raster_v, &faulty)),
            image_v,
            output_quantiles_v: quantiles(&plateau_volts(recording, hold, &used), QUANTILES),
            clean_v: analysed.into_iter().flat_map(|(_, press)| press.clean_v).collect(),
            weights: recording.weights().clone(),
            sample_rate_hz: recording.sample_rate_hz(),
        })
    }
}

/// Mean over the presses of the raster images in the frames `hold`, less their idle mean, V. Lost samples do not count.
/// `None` when it is not known which of the frames are idle.
fn mean_contact(raster: &Recording, hold: &Range<usize>) -> Option<Vec<f64>> {
    let idle = raster.blocks().iter().map(|block| Some(0..block.idle_frames?));
    let idle = idle.collect::<Option<Vec<Range<usize>>>>()?;
    let plateaus = vec![hold.clone(); raster.blocks().len()];
    let of = |taxel: usize, frames: &[Range<usize>]| -> f64 {
        let blocks = frames.iter().cloned().enumerate();
        let values = blocks.flat_map(|(block, frames)| frames.map(move |frame| raster.volts(block, frame)[taxel]));
        mean(&values.collect::<Vec<_>>())
    };
    Some((0..raster.taxels()).map(|k| of(k, &plateaus) - of(k, &idle)).collect())
}

/// Median over the presses of every taxel's image, V.
fn middle_image(analysed: &[(usize, PressAnalysis)]) -> Vec<f64> {
    let taxels = analysed.first().map_or(0, |(_, press)| press.image.len());
    (0..taxels)
        .map(|k| middle(&analysed.iter().map(|(_, press)| press.image[k]).collect::<Vec<_>>()))
        .collect()
}

/// Counts of all presses together, of the taxels that are loaded enough.
fn late_cells(analysed: &[(usize, PressAnalysis)]) -> Vec<LateCell> {
    let taxels = analysed.first().map_or(0, |(_, press)| press.late.len());
    (0..taxels)
        .filter_map(|k| {
            let sum = analysed
                .iter()
                .fold(Counts::default(), |sum, (_, press)| sum.plus(press.late[k]));
            sum.cell(k)
        })
        .collect()
}

/// Most cells that a beat is looked for in, the loaded ones first: others' late updates cannot be told apart.
const BEATING_CELLS: usize = 16;

fn beats(analysed: &[(usize, PressAnalysis)]) -> Vec<Beat> {
    let image = middle_image(analysed);
    let mut taxels: Vec<usize> = (0..image.len()).collect();
    taxels.sort_by(|a, b| image[*b].total_cmp(&image[*a]));
    let rows = |taxel: usize, press: &PressAnalysis| -> Vec<u64> {
        press
            .events
            .iter()
            .filter(|(k, _)| *k == taxel)
            .map(|(_, row)| *row)
            .collect()
    };
    taxels
        .into_par_iter()
        .take(BEATING_CELLS)
        .filter_map(|k| beat(k, &analysed.iter().map(|(_, press)| rows(k, press)).collect::<Vec<_>>()))
        .collect()
}

/// Output in the frames `hold` of the given presses, V.
fn plateau_volts(recording: &Recording, hold: &Range<usize>, blocks: &[usize]) -> Vec<f64> {
    let per_frame = recording.measurements_per_frame();
    let range = hold.start * per_frame..hold.end * per_frame;
    blocks
        .iter()
        .flat_map(|&block| recording.blocks()[block].volts[range.clone()].iter().copied())
        .collect()
}
