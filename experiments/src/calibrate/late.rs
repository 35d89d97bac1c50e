//! Weight flips that come too late, and the beat at which they do.

use super::fit::Window;
use super::memory::TAPS;
use super::statistics::mean;
use nalgebra::{DMatrix, DVector};

/// A taxel is loaded when it has this share of the largest.
const LOADED: f64 = 0.1;
/// Residuals beyond this many standard deviations may be late updates: smaller ones are the memory's and the noise's.
const IMPULSE_SD: f64 = 4.0;
/// Error of a late update over the full 2x, about 0.87 in the published recordings: the least of it, that must be an impulse for
/// a taxel's late updates to be counted, and where one is taken for an event.
const EVENT: std::ops::Range<f64> = 0.7..1.15;

/// Late flips of one press: the impulses by least squares on the late errors L = (previous − new weight)·x of all loaded taxels
/// together, because neighbouring seeds flip together. Without the impulses alone, late updates of all taxels at one rate could
/// not be told from the first tap of the memory: Σ L = (Φx)ₙ₋₁ − (Φx)ₙ.
#[derive(Debug, Clone)]
pub(super) struct Late {
    loaded: Vec<usize>,
    /// Whether an impulse of the taxel is seen, by place in `loaded`.
    seen: Vec<bool>,
    core_sd_v: f64,
    normal: DMatrix<f64>,
    moments: DVector<f64>,
    /// Taxel and row of every late flip.
    pub(super) events: Vec<(usize, u64)>,
}

impl Late {
    /// No flips yet, of a press with the mean image `image` and noise `core_sd_v`.
    pub(super) fn new(image: &[f64], core_sd_v: f64) -> Self {
        let peak = image.iter().copied().fold(0.0, f64::max);
        let loaded: Vec<usize> = (0..image.len()).filter(|k| image[*k] > LOADED * peak).collect();
        let seen = |k: &usize| 2.0 * EVENT.start * image[*k] > IMPULSE_SD * core_sd_v;
        Self {
            seen: loaded.iter().map(seen).collect(),
            normal: DMatrix::zeros(loaded.len(), loaded.len()),
            moments: DVector::zeros(loaded.len()),
            loaded,
            core_sd_v,
            events: Vec::new(),
        }
    }

    /// Mean share of flips that are late, over the taxels whose impulses are seen. NaN when there is none.
    pub(super) fn per_flip(&self) -> f64 {
        let Some(factor) = self.normal.clone().cholesky() else {
            return f64::NAN;
        };
        let rates = factor.solve(&self.moments);
        let seen: Vec<f64> = rates.iter().zip(&self.seen).filter(|(_, seen)| **seen).map(|(r, _)| *r).collect();
        if seen.is_empty() { f64::NAN } else { mean(&seen) }
    }

    /// Adds a window that starts at `first_row`; `residual_v` lacks the first [`TAPS`] measurements.
    pub(super) fn add(&mut self, window: &Window, residual_v: &[f64], first_row: u64) {
        let mut errors: Vec<(usize, f64)> = Vec::new();
        for (i, &r) in residual_v.iter().enumerate() {
            errors.clear();
            for (place, &k) in self.loaded.iter().enumerate() {
                let (before, now) = (window.design.is_plus(k, TAPS + i - 1), window.design.is_plus(k, TAPS + i));
                if before != now {
                    let x = window.image[k];
                    errors.push((place, if before { 2.0 * x } else { -2.0 * x }));
                }
            }
            for (n, (p, a)) in errors.iter().enumerate() {
                for (q, b) in &errors[..=n] {
                    // places ascend: this is the lower triangle
                    self.normal[(*p, *q)] += a * b;
                }
            }
            // NaN, a lost sample, is no impulse
            if r.abs() > IMPULSE_SD * self.core_sd_v {
                self.impulse(r, &errors, first_row + (TAPS + i) as u64);
            }
        }
    }

    /// An impulse of `r` V at `row`, where the taxels of `errors` flip.
    fn impulse(&mut self, r: f64, errors: &[(usize, f64)], row: u64) {
        for (place, full) in errors {
            self.moments[*place] += r * full;
        }
        let events = errors.iter().filter(|(_, full)| EVENT.contains(&(r / full)));
        self.events.extend(events.map(|(place, _)| (self.loaded[*place], row)));
    }
}

/// Beat of one cell's timer against the measurement clock.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Beat {
    /// Taxel, 0-based.
    pub taxel: usize,
    /// Late flips that it is from.
    pub events: usize,
    /// Period, measurements.
    pub period_measurements: f64,
    /// Power of the period's line over the mean of all periods tried.
    pub prominence: f64,
}

/// Periods that are tried, measurements: a cell's 20 MHz may be off by 10 %, the rate between 50 and 80 kHz.
const PERIODS: (f64, f64) = (36.0, 73.0);
/// Step of the period: a press is about 300 periods long, so its line is 0.17 wide.
const STEP: f64 = 0.01;
/// A beat is believed when its line is this many times the mean. The power of random rows is exponential: of 3700 periods the
/// largest is 8 times the mean in one press and 3 times in five presses together, so two presses or more are asked for.
const PROMINENCE: f64 = 6.0;
/// Fewest late flips a press that say anything about a period.
const FEWEST: usize = 4;

/// Beat of the cell of `taxel`, from its events of several presses; each press has a phase of its own.
pub(super) fn beat(taxel: usize, presses: &[Vec<u64>]) -> Option<Beat> {
    let presses: Vec<&Vec<u64>> = presses.iter().filter(|rows| rows.len() >= FEWEST).collect();
    if presses.len() < 2 {
        return None;
    }
    let events = presses.iter().map(|rows| rows.len()).sum();
    let (mut best, mut total, mut tried) = ((0.0, 0.0), 0.0, 0.0);
    let mut period = PERIODS.0;
    while period < PERIODS.1 {
        let power: f64 = presses.iter().map(|rows| line(rows, period)).sum();
        if power > best.1 {
            best = (period, power);
        }
        total += power;
        tried += 1.0;
        period += STEP;
    }
    let prominence = best.1 / (total / tried);
    (prominence > PROMINENCE).then_some(Beat {
        taxel,
        events,
        period_measurements: best.0,
        prominence,
    })
}

/// |Σ exp(2πi·row/period)|² / number of rows.
#[expect(clippy::cast_precision_loss, reason = "rows within a press stay far below 2^52")]
fn line(rows: &[u64], period: f64) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for row in rows {
        let angle = std::f64::consts::TAU * (row - rows[0]) as f64 / period;
        re += angle.cos();
        im += angle.sin();
    }
    (re * re + im * im) / rows.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_beat_is_found_among_stray_events() {
        // every fifth collision of a period of 52.47, and as many events at random places of a fixed progression
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small rows")]
        let press = |phase: f64| -> Vec<u64> {
            let mut rows: Vec<u64> = (0..20).map(|k| (phase + 52.47 * f64::from(5 * k)).ceil() as u64).collect();
            rows.extend((0..10).map(|k| 97 + 577 * k * k % 5200));
            rows.sort_unstable();
            rows
        };
        let presses: Vec<Vec<u64>> = (0..8).map(|p| press(10.0 + 37.0 * f64::from(p))).collect();
        let beat = beat(3, &presses).unwrap();
        // 5200 measurements long: the line is 52.47²/5200 = 0.5 wide, its centre known ten times better
        assert!((beat.period_measurements - 52.47).abs() < 0.05, "{beat:?}");
        assert!(super::beat(3, &[vec![1, 2], vec![]]).is_none());
    }
}
