//! Weight flips that come too late, and the beat at which they do.

use super::fit::Window;
use super::memory::TAPS;
use super::statistics::OUTLIER_SD;

/// Error of a late update over the full 2x that makes an event: about 0.87 in the published recordings.
const EVENT: std::ops::Range<f64> = 0.75..1.1;

/// Late flips of one press. Every outlier is taken for a late update: least squares on the late errors cannot tell them from
/// the first tap of the memory, Σ (wₙ₋₁ − wₙ)·x = (Φx)ₙ₋₁ − (Φx)ₙ, and neighbouring seeds flip together, so that one taxel's are not
/// told from another's. Analyses of the published outliers find 73 to 98 % of them to be late updates.
#[derive(Debug, Clone)]
pub(super) struct Late {
    core_v: f64,
    /// Residuals beyond the outlier limit.
    outliers: f64,
    /// Outliers that there would be if every flip were late.
    possible: f64,
    /// Taxel and row of every outlier that a late update of the taxel explains.
    pub(super) events: Vec<(usize, u64)>,
}

impl Late {
    /// No flips yet, of a press whose clean residual has the core `core_v`.
    pub(super) fn new(core_v: f64) -> Self {
        Self {
            core_v,
            outliers: 0.0,
            possible: 0.0,
            events: Vec::new(),
        }
    }

    /// Share of flips that are late. NaN when no taxel's late update would be an outlier.
    pub(super) fn per_flip(&self) -> f64 {
        self.outliers / self.possible
    }

    /// Adds a window; `residual_v` lacks the first [`TAPS`] measurements.
    pub(super) fn add(&mut self, window: &Window, residual_v: &[f64]) {
        let limit = OUTLIER_SD * self.core_v;
        let is_outlier = |r: f64| r.abs() > limit;
        self.outliers += residual_v.iter().map(|r| f64::from(is_outlier(*r))).sum::<f64>();
        for (k, &x) in window.image.iter().enumerate() {
            let seen = seen(2.0 * x / self.core_v);
            if seen <= 0.0 {
                continue;
            }
            for (i, &r) in residual_v.iter().enumerate() {
                let (before, now) = (
                    window.design.is_plus(k, TAPS + i - 1),
                    window.design.is_plus(k, TAPS + i),
                );
                if before == now {
                    continue;
                }
                self.possible += seen;
                let full = if before { 2.0 * x } else { -2.0 * x };
                if is_outlier(r) && EVENT.contains(&(r / full)) {
                    self.events.push((k, window.first_row + (TAPS + i) as u64));
                }
            }
        }
    }
}

/// Probability that an error of `error_sd` standard deviations, the noise on it, is an outlier: the Gaussian distribution
/// function as a ramp with its slope in the middle, within 0.07 of it.
fn seen(error_sd: f64) -> f64 {
    ((error_sd - OUTLIER_SD) / std::f64::consts::TAU.sqrt() + 0.5).clamp(0.0, 1.0)
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
        // collisions at uneven numbers of periods of 52.47 (even ones would fit other periods too), and half as many stray events
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small rows")]
        let press = |phase: f64| -> Vec<u64> {
            let mut rows: Vec<u64> = (0..20)
                .map(|k| (phase + 52.47 * f64::from((7 * k * k + 3 * k) % 100)).ceil() as u64)
                .collect();
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
