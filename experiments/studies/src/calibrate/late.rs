//! Weight flips that come too late.

use super::windows::{FitWindow, OUTLIER_SD, TAPS};
use serde::Serialize;

/// Late update's error over the full 2x: 0.87 in the published recordings, 1 in a cell that holds its level for the
/// whole measurement. Middle of the two.
const FULL_SHARE: f64 = 0.93;
/// Distance from that, over 2x, that leaves room for both.
const SHARE_ROOM: f64 = 0.12;
/// Distance that leaves room for the noise, standard deviations: with the 5 % of 2x ≥ 5 sd that [`SHARE_ROOM`] has to
/// spare, 99.7 % of the late updates are within.
const NOISE_ROOM_SD: f64 = 2.5;
/// Error of a late update over the full 2x that makes an event of a beat.
const EVENT: std::ops::Range<f64> = 0.75..1.1;
/// Measurements by which the flips are shifted to find how many outliers match one by chance: beyond the memory's taps.
const SHIFTS: [usize; 8] = [5, 7, 9, 11, 13, 15, 17, 19];
/// Probability to be seen below which a taxel does not matter.
const UNSEEN: f64 = 0.005;
/// Chance matches beyond this share of the outliers say nothing: the error of L/O is √(c/(1 − c)/O), and 1 % of the
/// late updates that do not match costs 1 %/(1 − c). A contact of many taxels of one load is such; every outlier is
/// then taken for late.
const MOST_BY_CHANCE: f64 = 0.5;
/// Fewest flips that would be seen if late, for a taxel to have a share of its own: 20 late ones at a share of 0.002.
const FEWEST_FLIPS: f64 = 1e4;

/// Flips of one taxel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Counts {
    /// Number of flips that would be outliers if they were late.
    flips: f64,
    /// Number of outliers that match a flip of this taxel better than any other taxel's.
    matched: f64,
    /// Number of these matches expected by chance.
    chance: f64,
}

/// How often one cell sets a new weight too late for the sample.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LateCell {
    /// Taxel, from 0.
    pub taxel: usize,
    /// Late updates divided by flips.
    pub per_flip: f64,
    /// Standard error from the number of events (Poisson).
    pub standard_error: f64,
}

impl Counts {
    /// Both together.
    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            flips: self.flips + other.flips,
            matched: self.matched + other.matched,
            chance: self.chance + other.chance,
        }
    }

    /// The share of taxel `taxel`, if enough of its flips would be seen.
    pub(super) fn cell(self, taxel: usize) -> Option<LateCell> {
        (self.flips >= FEWEST_FLIPS).then(|| LateCell {
            taxel,
            per_flip: (self.matched - self.chance) / self.flips,
            standard_error: self.matched.max(1.0).sqrt() / self.flips,
        })
    }
}

/// Late flips of one press, from the outliers. An outlier matches a flip when it has the sign and the size of the error
/// of a late update, (previous − new level)·x. Of O outliers, M match: the L late ones, and of the others the share c
/// that matches flips at other rows too, M = L + c·(O − L). Least squares on the late errors would not do: it cannot
/// tell them from the first tap of the memory, Σ (wₙ₋₁ − wₙ)·x = (Φx)ₙ₋₁ − (Φx)ₙ.
#[derive(Debug, Clone)]
pub(super) struct Late {
    core_v: f64,
    /// Number of residuals beyond the outlier limit, with enough data before and after for the shifts.
    outliers: f64,
    /// Number of outliers that match a flip.
    matched: f64,
    /// Number of outliers that match a shifted flip, mean over the shifts.
    by_chance: f64,
    /// Flips of every taxel; `chance` is filled in by [`Late::cells`].
    counts: Vec<Counts>,
    /// Taxel and row of every outlier that may be a late update of the taxel.
    pub(super) events: Vec<(usize, u64)>,
}

impl Late {
    /// No flips yet, of a press of `taxels` taxels whose clean residual has the core `core_v`.
    pub(super) fn new(core_v: f64, taxels: usize) -> Self {
        Self {
            core_v,
            outliers: 0.0,
            matched: 0.0,
            by_chance: 0.0,
            counts: vec![Counts::default(); taxels],
            events: Vec::new(),
        }
    }

    /// Outliers that are late updates, L = (M − c·O)/(1 − c); all of them where c says nothing.
    fn late(&self) -> f64 {
        if self.outliers <= 0.0 {
            return 0.0;
        }
        let c = self.by_chance / self.outliers;
        if c > MOST_BY_CHANCE {
            return self.outliers;
        }
        (self.matched - self.by_chance) / (1.0 - c)
    }

    /// Share of flips that are late. NaN when no taxel's late update would be an outlier.
    pub(super) fn per_flip(&self) -> f64 {
        self.late() / self.counts.iter().map(|c| c.flips).sum::<f64>()
    }

    /// Share of the outliers that are no late updates. NaN without outliers, or where nearly all match by chance. Below
    /// 0 when chance has it so.
    pub(super) fn unexplained(&self) -> f64 {
        if self.by_chance > MOST_BY_CHANCE * self.outliers {
            return f64::NAN;
        }
        1.0 - self.late() / self.outliers
    }

    /// Flips of every taxel. Only outliers that are no late updates match by chance.
    pub(super) fn cells(&self) -> Vec<Counts> {
        let other = self.unexplained().clamp(0.0, 1.0);
        let other = if other.is_nan() { 0.0 } else { other };
        let cell = |c: &Counts| Counts { chance: other * c.chance, ..*c };
        self.counts.iter().map(cell).collect()
    }

    /// Adds a window; `residual_v` lacks the first [`TAPS`] measurements.
    pub(super) fn add(&mut self, window: &FitWindow, residual_v: &[f64]) {
        let limit = OUTLIER_SD * self.core_v;
        let reach = SHIFTS[SHIFTS.len() - 1];
        // both ends are left out, so that every outlier has all its shifts
        let inside = reach..residual_v.len().saturating_sub(reach);
        let outliers: Vec<usize> = inside.clone().filter(|i| residual_v[*i].abs() > limit).collect();
        let seen: Vec<f64> = window.image.iter().map(|x| seen(2.0 * x / self.core_v)).collect();
        for (k, seen) in seen.iter().enumerate().filter(|(_, seen)| **seen > UNSEEN) {
            let flips = window.design.flips(k, TAPS + inside.start..TAPS + inside.end);
            self.counts[k].flips += seen * flips as f64;
        }
        let cells: Vec<usize> = (0..seen.len()).filter(|k| seen[*k] > UNSEEN).collect();
        for &i in &outliers {
            let r = residual_v[i];
            self.outliers += 1.0;
            if let Some(k) = self.best(window, &cells, r, i) {
                self.matched += 1.0;
                self.counts[k].matched += 1.0;
            }
            for shift in SHIFTS {
                for at in [i - shift, i + shift] {
                    if let Some(k) = self.best(window, &cells, r, at) {
                        let one = 0.5 / SHIFTS.len() as f64;
                        self.by_chance += one;
                        self.counts[k].chance += one;
                    }
                }
            }
            let row = window.first_row + (TAPS + i) as u64;
            let of = |k: &usize| full(window, *k, i).is_some_and(|full| EVENT.contains(&(r / full)));
            self.events.extend(cells.iter().filter(|k| of(k)).map(|k| (*k, row)));
        }
    }

    /// The taxel among `cells` whose flip at `i` is nearest to the error `r`, if any matches it.
    fn best(&self, window: &FitWindow, cells: &[usize], r: f64, i: usize) -> Option<usize> {
        let distance = |k: usize| {
            let full = full(window, k, i)?;
            let off = (r - FULL_SHARE * full).abs();
            (off <= SHARE_ROOM * full.abs() + NOISE_ROOM_SD * self.core_v).then_some((k, off))
        };
        let near = cells.iter().filter_map(|k| distance(*k));
        near.min_by(|p, q| p.1.total_cmp(&q.1)).map(|(k, _)| k)
    }
}

/// Error of taxel `k` at measurement `TAPS + i` of the window if it does not flip in time, V; `None` when it does not
/// flip.
fn full(window: &FitWindow, k: usize, i: usize) -> Option<f64> {
    let (before, now) = (window.design.is_plus(k, TAPS + i - 1), window.design.is_plus(k, TAPS + i));
    let full_v = 2.0 * window.image[k];
    (before != now).then_some(if before { full_v } else { -full_v })
}

/// Probability that an error of `error_sd` standard deviations, the noise on it, is an outlier: the Gaussian
/// distribution function as a logistic one, within 0.0095 of it (Camilli 1994).
fn seen(error_sd: f64) -> f64 {
    1.0 / (1.0 + (-1.702 * (error_sd - OUTLIER_SD)).exp())
}

/// The late updates of one cell come periodically, because the cell's millisecond timer beats with the measurement
/// clock: this is the period that was found.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Beat {
    /// Taxel, from 0.
    pub taxel: usize,
    /// Number of late flips used.
    pub events: usize,
    /// Period, measurements.
    pub period_measurements: f64,
    /// Power of the line at this period divided by the mean over all periods tried.
    pub prominence: f64,
}

/// Periods that are tried, measurements: a cell's 20 MHz may be off by 10 %, the rate between 50 and 80 kHz.
const PERIODS: (f64, f64) = (36.0, 73.0);
/// Step of the period: a press is about 300 periods long, so its line is 0.17 wide.
const STEP: f64 = 0.01;
/// A beat is believed when its line is this many times the mean, or more: flips of a pseudorandom sequence are not
/// quite at random.
const PROMINENCE: f64 = 6.0;
/// Chance that a cell without a beat shows one.
const FALSE_ALARM: f64 = 1e-3;
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
    let least = chance_prominence(presses.len(), FALSE_ALARM / tried).max(PROMINENCE);
    (prominence > least).then_some(Beat { taxel, events, period_measurements: best.0, prominence })
}

/// Prominence that one period reaches with the given chance when the rows are random: the power of a press is then
/// exponential and the sum over `presses` of them, of mean `presses`, is beyond x with probability e⁻ˣ·Σ xᵏ/k!, k <
/// `presses` (Erlang).
fn chance_prominence(presses: usize, chance: f64) -> f64 {
    let n = presses as f64;
    let beyond = |x: f64| {
        let (mut term, mut sum, mut k) = (1.0, 0.0, 1.0);
        while k <= n {
            sum += term;
            term *= x / k;
            k += 1.0;
        }
        sum * (-x).exp()
    };
    // the power is beyond n + 60√n with a chance far below any that is asked for; 60 halvings leave no more than
    // rounding
    let (mut low, mut high) = (0.0, n + 60.0 * n.sqrt());
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if beyond(middle) > chance {
            low = middle;
        } else {
            high = middle;
        }
    }
    high / n
}

/// |Σ exp(2πi·row/period)|² / number of rows.
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
        // collisions at uneven numbers of periods of 52.47 (even ones would fit other periods too), and half as many
        // stray events
        #[expect(clippy::cast_possible_truncation, reason = "small rows")]
        let press = |phase: f64| -> Vec<u64> {
            let mut rows: Vec<u64> =
                (0..20).map(|k| (phase + 52.47 * f64::from((7 * k * k + 3 * k) % 100)).ceil() as u64).collect();
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

    #[test]
    fn few_presses_must_show_a_clearer_beat() {
        // one press: e⁻ˣ; two: e⁻ˣ(1 + x). 60 halvings of at most 90 leave 1e-14
        assert!((chance_prominence(1, 1e-6) - 1e6_f64.ln()).abs() < 1e-12);
        let x = 2.0 * chance_prominence(2, 1e-7);
        assert!(((1.0 + x) * (-x).exp() / 1e-7 - 1.0).abs() < 1e-10);
    }
}
