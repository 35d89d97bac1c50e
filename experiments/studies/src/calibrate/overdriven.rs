//! A mis-seeded cell with an analog output that exceeds its swing.

use super::design::Reseeded;
use super::fit::{FitRequest, fit_windows};
use super::statistics::{OUTLIER_SD, mean, robust_sd};
use nalgebra::{SMatrix, SVector};
use serde::Serialize;
use spts_circuit::{Recording, WeightMode};
use std::ops::Range;

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
        let ask = FitRequest {
            block,
            reseeded: &[cell],
            parity: false,
        };
        let first_row = recording.first_row(block, hold.start);
        for window in fit_windows(recording, ask, hold.clone(), hold.len()) {
            let x = window.image[cell.taxel as usize];
            let mut before = analog.level_from_seed(cell.seed, first_row.saturating_sub(1));
            for (i, &residual_v) in window.residual_v.iter().enumerate() {
                let level = analog.level_from_seed(cell.seed, first_row + i as u64);
                let binary_v = if level > 0.0 { x } else { -x };
                out.push(Sample {
                    residual_v,
                    binary_v,
                    level,
                    before,
                });
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
