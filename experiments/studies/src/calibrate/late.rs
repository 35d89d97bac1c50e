//! Weight flips that come too late.

use super::fit::FitWindow;
use super::memory::TAPS;
use super::statistics::OUTLIER_SD;

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
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
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
        let cell = |c: &Counts| Counts {
            chance: other * c.chance,
            ..*c
        };
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
            let flips = inside.clone().filter(|i| full(window, k, *i).is_some()).count();
            let flips = flips as f64;
            self.counts[k].flips += seen * flips;
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
    let (before, now) = (
        window.design.is_plus(k, TAPS + i - 1),
        window.design.is_plus(k, TAPS + i),
    );
    let full_v = 2.0 * window.image[k];
    (before != now).then_some(if before { full_v } else { -full_v })
}

/// Probability that an error of `error_sd` standard deviations, the noise on it, is an outlier: the Gaussian
/// distribution function as a logistic one, within 0.0095 of it (Camilli 1994).
fn seen(error_sd: f64) -> f64 {
    1.0 / (1.0 + (-1.702 * (error_sd - OUTLIER_SD)).exp())
}
