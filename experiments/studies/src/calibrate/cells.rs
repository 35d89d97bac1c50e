//! Cells that do not run their own sequence, because of another seed or missed edges.

use super::statistics::{mean, robust_sd, sd};
use super::windows::{OUTLIER_SD, Reseeded, TAPS, WINDOW_FRAMES, fit_windows};
use nalgebra::{SMatrix, SVector};
use serde::Serialize;
use spts_circuit::{Jump, Recording, WeightMode};
use spts_models::SkinLayout;
use spts_recon::{MatrixView, SignTables};
use std::ops::Range;

/// Correlation of the residual with a foreign sequence, in standard errors, that is believed. The memory of the taxels'
/// own sequences reaches 30 but is small in volts.
const BELIEVED_SE: f64 = 20.0;
/// Share of ‖x‖₂ that a foreign sequence must have.
const BELIEVED_SHARE: f64 = 0.05;
/// Largest seed: the master sends one byte.
const SEEDS: u32 = 256;
/// Largest lag that is looked for, measurements.
const LAGS: usize = 100;

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
            Self::MisSeeded { taxel, seed, amplitude_v } => {
                let (cell, hint) = match taxel {
                    Some(taxel) => (format!("taxel {taxel}"), ""),
                    None => ("some taxel".to_owned(), "; a raster session would say which"),
                };
                write!(f, "{cell} runs on seed {seed}, amplitude {amplitude_v:.3} V{hint}")
            }
            Self::Lagging { taxel, lag, amplitude_v } => {
                write!(f, "taxel {taxel} is {lag} measurements behind its sequence, amplitude {amplitude_v:.3} V")
            }
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
    let frames = hold.len().max(WINDOW_FRAMES);
    let Some(window) = fit_windows(recording, block, &[], true, hold.clone(), frames).pop() else {
        return Vec::new();
    };
    let first_row = recording.first_row(block, hold.start);
    let limit = OUTLIER_SD * robust_sd(&window.residual_v).unwrap_or(0.0);
    // NaN is not within the limit
    let core: Vec<f64> = window.residual_v.iter().map(|r| if r.abs() <= limit { *r } else { 0.0 }).collect();
    let power: f64 = core.iter().map(|r| r * r).sum();
    let norm_v = window.image.iter().map(|x| x * x).sum::<f64>().sqrt();
    let weights = recording.weights();
    let n = core.len() as f64;
    let believed = |sum: f64| sum.abs() > BELIEVED_SE * power.sqrt() && sum.abs() / n > BELIEVED_SHARE * norm_v;
    // sums of ± the residuals, by look-up
    let Ok(column) = MatrixView::new(core.len(), 1, &core) else {
        return Vec::new();
    };
    let sums = SignTables::<f64>::new(column);
    let correlate = |signs: &[u64]| -> f64 {
        let mut sum = [0.0];
        sums.fill_rows(signs, &mut sum);
        sum[0]
    };
    let taxels = u32::try_from(recording.taxels()).unwrap_or(u32::MAX);
    let own: Vec<u32> = (0..recording.taxels()).filter_map(|taxel| weights.seed(taxel)).collect();
    let (mut faults, mut taken) = (Vec::new(), Vec::new());
    for seed in (0..SEEDS).filter(|seed| !own.contains(seed)) {
        let sum = correlate(&signs(seed, first_row, core.len()));
        if believed(sum) {
            let taxel = raster.and_then(|r| missing(&window.image, r, &taken));
            taken.extend(taxel);
            faults.push(CellFault::MisSeeded { taxel, seed, amplitude_v: sum / n });
        }
    }
    for taxel in 0..taxels {
        let Some(seed) = weights.seed(taxel as usize) else {
            continue;
        };
        let most = usize::try_from(first_row).map_or(LAGS, |row| row.min(LAGS));
        let all = signs(seed, first_row - most as u64, core.len() + most);
        // lags of 1, 2 and 3 are the memory's
        for lag in TAPS + 1..=most {
            let sum = correlate(&later(&all, most - lag, core.len()));
            if believed(sum) {
                faults.push(CellFault::Lagging { taxel, lag: lag as u64, amplitude_v: sum / n });
            }
        }
    }
    faults
}

/// Signs of the sequence of `seed` at `len` rows from `row` on, one bit each, set for +1.
fn signs(seed: u32, row: u64, len: usize) -> Vec<u64> {
    let mut state = Jump::new(row + 1).apply(seed);
    let mut signs = vec![0; len.div_ceil(64)];
    for i in 0..len {
        signs[i / 64] |= u64::from(state >> 31) << (i % 64);
        state = Jump::ONE.apply(state);
    }
    signs
}

/// `len` bits of `signs` from bit `start` on.
fn later(signs: &[u64], start: usize, len: usize) -> Vec<u64> {
    let word = |i: usize| signs.get(i).copied().unwrap_or(0);
    let shift = start % 64;
    // a shift by 64 would be one by 0
    let joined = |i: usize| word(i) >> shift | (word(i + 1) << 1) << (63 - shift);
    (start / 64..).map(joined).take(len.div_ceil(64)).collect()
}

/// A taxel is touched when it has this share of the raster session's largest: ten times the noise of a mean over its
/// frames.
const TOUCHED: f64 = 0.1;

/// The taxel of the contact that shows least of what the raster session has there, none of `taken`.
fn missing(image: &[f64], raster: &[f64], taken: &[u32]) -> Option<u32> {
    let peak = raster.iter().copied().fold(0.0, f64::max);
    let touched = raster.iter().enumerate().filter(|(_, r)| **r > TOUCHED * peak);
    let shown = touched.filter_map(|(k, r)| Some((u32::try_from(k).ok()?, image[k].abs() / r)));
    let free = shown.filter(|(k, _)| !taken.contains(k));
    free.min_by(|p, q| p.1.total_cmp(&q.1)).map(|(k, _)| k)
}

impl CellFault {
    /// The cell, if it runs with another seed and its taxel is known.
    pub(super) fn reseeded(&self) -> Option<Reseeded> {
        match *self {
            Self::MisSeeded { taxel: Some(taxel), seed, .. } => Some(Reseeded { taxel, seed }),
            _ => None,
        }
    }
}

/// The cells with another seed among `faults` whose taxel is known.
pub fn reseeded(faults: &[CellFault]) -> Vec<Reseeded> {
    faults.iter().filter_map(CellFault::reseeded).collect()
}

/// Output of the cell: clamp(gain·aₙ + carry·aₙ₋₁ + bias, −1, 1), where a is the analog level of its generator.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Overdriven {
    /// Taxel, from 0, row-major.
    pub taxel: u32,
    /// Seed of the cell.
    pub seed: u32,
    /// Gain on the present level.
    pub gain: f64,
    /// Gain on the previous level.
    pub carry: f64,
    /// Output at level 0.
    pub bias: f64,
    /// Contribution of its taxel at full output, divided by the value from a fit with ±1 weights.
    pub over_binary: f64,
}

/// In words, for the terminal.
impl std::fmt::Display for Overdriven {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "taxel {} is not ±1 but clamp({:.3}·a + {:.3}·a before + {:.3}, −1, 1), a the analog level of seed {}",
            self.taxel, self.gain, self.carry, self.bias, self.seed
        )
    }
}

impl Overdriven {
    /// Output of the cell at `row`, between −1 and 1.
    fn output(&self, row: u64) -> f64 {
        let analog = WeightMode::Analog;
        let before = analog.level_from_seed(self.seed, row.saturating_sub(1));
        (self.gain * analog.level_from_seed(self.seed, row) + self.carry * before + self.bias).clamp(-1.0, 1.0)
    }

    /// What the cell adds beyond the ±`binary_v` that a fit finds for it, about its mean, V, at `len` rows from
    /// `first_row` on.
    pub(super) fn beyond_binary(&self, binary_v: f64, first_row: u64, len: usize) -> Vec<f64> {
        let binary = WeightMode::Binary;
        let beyond = (first_row..)
            .take(len)
            .map(|row| binary_v * (self.over_binary * self.output(row) - binary.level_from_seed(self.seed, row)));
        let beyond: Vec<f64> = beyond.collect();
        let centre = mean(&beyond);
        beyond.into_iter().map(|v| v - centre).collect()
    }
}

/// Steps of the Gauss–Newton iteration; the published session needs six.
const STEPS: usize = 30;
/// Share of a step that is taken: the clamp makes full steps overshoot.
const DAMPING: f64 = 0.7;
/// An overdriven cell is believed when it leaves less than this share of the variance that ±1 leaves.
const BELIEVED: f64 = 0.9;

/// Fits `cell` in the frames `hold` of the given presses; `None` when ±1 describes it as well.
pub(super) fn fit(recording: &Recording, hold: &Range<usize>, blocks: &[usize], cell: Reseeded) -> Option<Overdriven> {
    let samples = samples(recording, hold, blocks, cell);
    let limit = OUTLIER_SD * robust_sd(&samples.iter().map(|s| s.residual_v).collect::<Vec<_>>())?;
    let samples: Vec<Sample> = samples.into_iter().filter(|s| s.residual_v.abs() <= limit).collect();
    let binary: f64 = samples.iter().map(|s| s.residual_v.powi(2)).sum();
    // constant, amplitude, gain, carry, bias; a full-swing analog output to begin with
    let mut p = SVector::<f64, 5>::from([0.0, samples.first()?.binary_v.abs() * 1.5, 1.5, 0.0, 0.0]);
    for _ in 0..STEPS {
        p += DAMPING * step(&samples, &p)?;
    }
    let left: f64 = samples.iter().map(|s| s.error(&p).powi(2)).sum();
    let binary_v = samples.iter().map(|s| s.binary_v.abs()).sum::<f64>();
    let binary_v = binary_v / samples.len() as f64;
    (left < BELIEVED * binary).then_some(Overdriven {
        taxel: cell.taxel,
        seed: cell.seed,
        gain: p[2],
        carry: p[3],
        bias: p[4],
        over_binary: p[1] / binary_v,
    })
}

/// One measurement with the cell's levels.
struct Sample {
    /// Residual of the fit with ±1 weights, V.
    residual_v: f64,
    /// Contribution of the cell in that fit, V.
    binary_v: f64,
    level: f64,
    before: f64,
}

impl Sample {
    fn drive(&self, p: &SVector<f64, 5>) -> f64 {
        p[2] * self.level + p[3] * self.before + p[4]
    }

    fn error(&self, p: &SVector<f64, 5>) -> f64 {
        self.residual_v + self.binary_v - p[0] - p[1] * self.drive(p).clamp(-1.0, 1.0)
    }
}

fn samples(recording: &Recording, hold: &Range<usize>, blocks: &[usize], cell: Reseeded) -> Vec<Sample> {
    let analog = WeightMode::Analog;
    let mut out = Vec::new();
    for &block in blocks {
        let first_row = recording.first_row(block, hold.start);
        for window in fit_windows(recording, block, &[cell], false, hold.clone(), hold.len()) {
            let x = window.image[cell.taxel as usize];
            let mut before = analog.level_from_seed(cell.seed, first_row.saturating_sub(1));
            for (i, &residual_v) in window.residual_v.iter().enumerate() {
                let level = analog.level_from_seed(cell.seed, first_row + i as u64);
                let binary_v = if level > 0.0 { x } else { -x };
                out.push(Sample { residual_v, binary_v, level, before });
                before = level;
            }
        }
    }
    out
}

/// Gauss–Newton step of the least squares of [`Sample::error`].
fn step(samples: &[Sample], p: &SVector<f64, 5>) -> Option<SVector<f64, 5>> {
    let (mut normal, mut moments) = (SMatrix::<f64, 5, 5>::zeros(), SVector::<f64, 5>::zeros());
    for s in samples {
        let drive = s.drive(p);
        let slope = if drive.abs() < 1.0 { p[1] } else { 0.0 };
        let row = SVector::from([1.0, drive.clamp(-1.0, 1.0), slope * s.level, slope * s.before, slope]);
        normal += row * row.transpose();
        moments += row * s.error(p);
    }
    Some(normal.cholesky()?.solve(&moments))
}

/// Taxels below this share of either image's maximum are not loaded enough to have a gain.
const LOADED: f64 = 0.1;
/// Fewest loaded taxels that have a spread.
const FEWEST: usize = 3;

/// Gain of one taxel in a compressive session, relative to the raster session of the same object.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TaxelGain {
    /// Taxel, from 0, row-major.
    pub taxel: usize,
    /// Ratio of compressive to raster image, divided by the geometric mean of the ratios.
    pub gain: f64,
}

/// Gains of the loaded taxels in the compressive session, relative to the raster session of the same object. The
/// contact's pressure and the taxel's fixed gain are common to both and cancel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SessionGains {
    /// Loaded taxels.
    pub taxels: Vec<TaxelGain>,
    /// Standard deviation of ln gain. It contains the changes of two sessions; that of one is smaller by √2.
    pub log_sd: f64,
    /// Standard error of `log_sd`: log_sd/√(2(n − 1)) for n Gaussian values.
    pub standard_error: f64,
    /// The plane in ln gain; `None` with too few loaded taxels, or all of them in one row or column.
    pub plane: Option<GainPlane>,
}

/// Plane through the logarithms of gains, by least squares.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GainPlane {
    /// Slopes along the rows and along the columns, from the middle of the sheet to its edge.
    pub slopes: [f64; 2],
    /// Their standard errors.
    pub standard_errors: [f64; 2],
    /// Standard deviation of ln gain about the plane, with n − 3 degrees of freedom.
    pub log_sd: f64,
}

/// Fewest loaded taxels that a plane is fitted to: twice its parameters.
const FEWEST_IN_PLANE: usize = 6;

impl GainPlane {
    /// The plane through `logs`, (taxel, ln gain), of `skin`.
    fn through(logs: &[(usize, f64)], skin: &SkinLayout) -> Option<Self> {
        if logs.len() < FEWEST_IN_PLANE {
            return None;
        }
        let row = |taxel: usize| {
            let [u, v] = skin.share_of_half(taxel);
            SVector::from([1.0, u, v])
        };
        let (mut normal, mut moments) = (SMatrix::<f64, 3, 3>::zeros(), SVector::<f64, 3>::zeros());
        for &(taxel, log) in logs {
            normal += row(taxel) * row(taxel).transpose();
            moments += row(taxel) * log;
        }
        let inverse = normal.cholesky()?.inverse();
        let plane = inverse * moments;
        let squares: f64 = logs.iter().map(|&(taxel, log)| (log - row(taxel).dot(&plane)).powi(2)).sum();
        let log_sd = (squares / (logs.len() as f64 - 3.0)).sqrt();
        let error = |k: usize| log_sd * inverse[(k, k)].sqrt();
        Some(Self { slopes: [plane[1], plane[2]], standard_errors: [error(1), error(2)], log_sd })
    }
}

/// Gains of the taxels of `compressive_v` on `skin`, leaving out those in `faulty`. `None` with fewer than three loaded
/// taxels.
pub(super) fn gains(
    compressive_v: &[f64],
    raster_v: &[f64],
    faulty: &[usize],
    skin: &SkinLayout,
) -> Option<SessionGains> {
    let limit = |image: &[f64]| LOADED * image.iter().copied().fold(0.0, f64::max);
    let (least_c, least_r) = (limit(compressive_v), limit(raster_v));
    let loaded: Vec<(usize, f64)> = compressive_v
        .iter()
        .zip(raster_v)
        .enumerate()
        .filter(|(k, (c, r))| **c > least_c && **r > least_r && !faulty.contains(k))
        .map(|(k, (c, r))| (k, (c / r).ln()))
        .collect();
    if loaded.len() < FEWEST {
        return None;
    }
    let logs: Vec<f64> = loaded.iter().map(|(_, log)| *log).collect();
    let (centre, freedom) = (mean(&logs), logs.len() as f64 - 1.0);
    let log_sd = sd(&logs) * (logs.len() as f64 / freedom).sqrt();
    let relative = |(taxel, log): (usize, f64)| TaxelGain { taxel, gain: (log - centre).exp() };
    Some(SessionGains {
        plane: GainPlane::through(&loaded, skin),
        taxels: loaded.into_iter().map(relative).collect(),
        log_sd,
        standard_error: log_sd / (2.0 * freedom).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_ratio_of_two_images_is_found_where_both_are_loaded() {
        let raster = [1.0, 2.0, 0.05, 1.5, 0.0, 1.0];
        // twice the raster image, times e^±0.1 on two taxels; one is faulty, one idle
        let compressive = [2.0 * 0.1_f64.exp(), 4.0, 3.0, 3.0 * (-0.1_f64).exp(), 0.0, 9.0];
        let skin = SkinLayout::with_pitch(1, 6, 15e-3).unwrap();
        let found = gains(&compressive, &raster, &[5], &skin).unwrap();
        let gain: Vec<f64> = found.taxels.iter().map(|t| t.gain.ln()).collect();
        for (found, expected) in gain.iter().zip([0.1, 0.0, -0.1]) {
            assert_relative_eq!(*found, expected, epsilon = 1e-12);
        }
        assert_eq!(found.taxels.iter().map(|t| t.taxel).collect::<Vec<_>>(), [0, 1, 3]);
        // (0.01 + 0 + 0.01)/2
        assert_relative_eq!(found.log_sd, 0.1, max_relative = 1e-12);
        assert_relative_eq!(found.standard_error, 0.05, max_relative = 1e-12);
        assert_eq!(found.plane, None, "three taxels have none");
        assert_eq!(gains(&compressive, &raster, &[0, 5], &skin), None);
    }

    /// Nine taxels at u, v = -2/3, 0, 2/3 with a plane and a deviation that is orthogonal to it: slopes are exact, the
    /// deviation's squares 4·0.1² have six degrees of freedom, and the error of a slope is sd/√(6·(2/3)²).
    #[test]
    fn a_plane_is_found_with_its_errors() {
        let skin = SkinLayout::with_pitch(3, 3, 15e-3).unwrap();
        let corners = [1.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0];
        let log = |k: usize| {
            let [u, v] = skin.share_of_half(k);
            0.7 + 0.5 * u - 0.2 * v + 0.1 * corners[k]
        };
        let found = GainPlane::through(&(0..9).map(|k| (k, log(k))).collect::<Vec<_>>(), &skin).unwrap();
        let sd = (0.04_f64 / 6.0).sqrt();
        let error = sd / (6.0_f64 * 4.0 / 9.0).sqrt();
        for (found, expected) in [
            (found.slopes[0], 0.5),
            (found.slopes[1], -0.2),
            (found.log_sd, sd),
            (found.standard_errors[0], error),
            (found.standard_errors[1], error),
        ] {
            assert_relative_eq!(found, expected, max_relative = 1e-12);
        }
        let row: Vec<(usize, f64)> = (0..8).map(|k| (k, 0.1)).collect();
        assert_eq!(GainPlane::through(&row, &SkinLayout::with_pitch(1, 8, 15e-3).unwrap()), None);
    }
}
