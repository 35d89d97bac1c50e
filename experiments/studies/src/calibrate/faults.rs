//! Cells that do not run their own sequence, because of another seed or missed edges.

use super::design::Reseeded;
use super::fit::{FitRequest, WINDOW_FRAMES, fit_windows};
use super::statistics::{OUTLIER_SD, robust_sd};
use serde::Serialize;
use spts_circuit::Recording;
use std::ops::Range;

/// Correlation of the residual with a foreign sequence, in standard errors, that is believed. The memory of the taxels'
/// own sequences reaches 30 but is small in volts.
const BELIEVED_SE: f64 = 20.0;
/// Share of ‖x‖₂ that a foreign sequence must have.
const BELIEVED_SHARE: f64 = 0.05;
/// Largest seed: the master sends one byte.
const SEEDS: u32 = 256;
/// Largest lag that is looked for, measurements.
const LAGS: u64 = 100;

/// A sequence in the output that no cell should produce.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum CellFault {
    /// A cell runs with another seed.
    MisSeeded {
        /// The taxel without a contact of its own where the raster session has one; no taxel is used twice. `None`
        /// without a raster session, or if no touched taxel is left.
        taxel: Option<u32>,
        /// Seed of the cell.
        seed: u32,
        /// Amplitude of its ±1 output, V.
        amplitude_v: f64,
    },
    /// A cell lags behind its own sequence.
    Lagging {
        /// Taxel.
        taxel: u32,
        /// Number of missed edges, measurements.
        lag: u64,
        /// Amplitude of its output, V.
        amplitude_v: f64,
    },
}

/// In words, for the profile and the terminal.
impl std::fmt::Display for CellFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {
            Self::MisSeeded {
                taxel: Some(taxel),
                seed,
                amplitude_v,
            } => write!(f, "taxel {taxel} runs on seed {seed}, amplitude {amplitude_v:.3} V"),
            Self::MisSeeded {
                taxel: None,
                seed,
                amplitude_v,
            } => write!(
                f,
                "some taxel runs on seed {seed}, amplitude {amplitude_v:.3} V; a raster session would say which"
            ),
            Self::Lagging {
                taxel,
                lag,
                amplitude_v,
            } => write!(
                f,
                "taxel {taxel} is {lag} measurements behind its sequence, amplitude {amplitude_v:.3} V"
            ),
        }
    }
}

/// Faults of the presses `blocks` of a session, from the frames `hold` of the last of them (lags only grow). `raster`
/// is the mean contact of the raster session, which says which cell is missing.
pub(super) fn find(
    recording: &Recording,
    hold: &Range<usize>,
    raster: Option<&[f64]>,
    blocks: &[usize],
) -> Vec<CellFault> {
    let Some(&block) = blocks.last() else {
        return Vec::new();
    };
    let ask = FitRequest {
        block,
        reseeded: &[],
        parity: true,
    };
    let Some(window) = fit_windows(recording, ask, hold.clone(), hold.len().max(WINDOW_FRAMES)).pop() else {
        return Vec::new();
    };
    let first_row = recording.first_row(ask.block, hold.start);
    let limit = OUTLIER_SD * robust_sd(&window.residual_v).unwrap_or(0.0);
    // NaN is not within the limit
    let core: Vec<f64> = window
        .residual_v
        .iter()
        .map(|r| if r.abs() <= limit { *r } else { 0.0 })
        .collect();
    let power: f64 = core.iter().map(|r| r * r).sum();
    let norm_v = window.image.iter().map(|x| x * x).sum::<f64>().sqrt();
    let weights = recording.weights();
    let n = core.len() as f64;
    let believed = |sum: f64| sum.abs() > BELIEVED_SE * power.sqrt() && sum.abs() / n > BELIEVED_SHARE * norm_v;
    let correlate = |seed: u32, row: u64| -> f64 {
        let mut state = spts_circuit::Jump::new(row + 1).apply(seed);
        let mut sum = 0.0;
        for r in &core {
            sum += if state >> 31 == 1 { *r } else { -r };
            state = spts_circuit::Jump::ONE.apply(state);
        }
        sum
    };
    let taxels = u32::try_from(recording.taxels()).unwrap_or(u32::MAX);
    let own: Vec<u32> = (0..recording.taxels())
        .filter_map(|taxel| weights.seed(taxel))
        .collect();
    let (mut faults, mut taken) = (Vec::new(), Vec::new());
    for seed in (0..SEEDS).filter(|seed| !own.contains(seed)) {
        let sum = correlate(seed, first_row);
        if believed(sum) {
            let taxel = raster.and_then(|r| missing(&window.image, r, &taken));
            taken.extend(taxel);
            faults.push(CellFault::MisSeeded {
                taxel,
                seed,
                amplitude_v: sum / n,
            });
        }
    }
    for taxel in 0..taxels {
        let Some(seed) = weights.seed(taxel as usize) else {
            continue;
        };
        // lags of 1, 2 and 3 are the memory's
        for lag in (TAPS..=LAGS).filter(|lag| *lag <= first_row) {
            let sum = correlate(seed, first_row - lag);
            if believed(sum) {
                faults.push(CellFault::Lagging {
                    taxel,
                    lag,
                    amplitude_v: sum / n,
                });
            }
        }
    }
    faults
}

/// A taxel is touched when it has this share of the raster session's largest: ten times the noise of a mean over its
/// frames.
const TOUCHED: f64 = 0.1;
/// First lag that is not the memory's.
const TAPS: u64 = super::memory::TAPS as u64 + 1;

/// The taxel of the contact that shows least of what the raster session has there, none of `taken`.
fn missing(image: &[f64], raster: &[f64], taken: &[u32]) -> Option<u32> {
    let peak = raster.iter().copied().fold(0.0, f64::max);
    let touched = raster.iter().enumerate().filter(|(_, r)| **r > TOUCHED * peak);
    let shown = touched.filter_map(|(k, r)| Some((u32::try_from(k).ok()?, image[k].abs() / r)));
    let free = shown.filter(|(k, _)| !taken.contains(k));
    free.min_by(|p, q| p.1.total_cmp(&q.1)).map(|(k, _)| k)
}

/// The cells with another seed among `faults` whose taxel is known.
#[must_use]
pub fn reseeded(faults: &[CellFault]) -> Vec<Reseeded> {
    let cell = |fault: &CellFault| match *fault {
        CellFault::MisSeeded {
            taxel: Some(taxel),
            seed,
            ..
        } => Some(Reseeded { taxel, seed }),
        _ => None,
    };
    faults.iter().filter_map(cell).collect()
}
