//! Quality of a set's sensing matrix, independent of the decoder.

use super::error::SeedError;
use super::set::{PERIOD_ROWS, SeedSet};
use rand::RngExt as _;
use rayon::prelude::*;
use serde::Serialize;
use spts_circuit::WeightMode;
use spts_models::Streams;
use spts_recon::Matrix;
use spts_recon::coherence::{self, CoherenceError, IsometrySearch};

/// Rows in which windows start at random: about two and a half minutes of the published device, the length of its
/// sessions.
pub(super) const SPAN_ROWS: u64 = 10_000_000;
/// First rows that are looked through for constant ones.
const FIRST_ROWS: usize = 1000;
/// Rows that are looked through for nearly constant ones.
const MANY_ROWS: usize = 100_000;
/// A row is nearly constant when its sum is beyond this share of its magnitudes' sum.
const NEARLY: f64 = 0.9;
/// Windows whose isometry is looked at.
const ISOMETRY_WINDOWS: usize = 16;
/// Supports that the isometry constant is bounded by.
const ISOMETRY: IsometrySearch = IsometrySearch { random: 100, greedy: 2 };

/// What can be said of a set of seeds without choosing a window: period, constant rows, rank.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SeedFacts {
    /// Name of the set.
    pub seeds: String,
    /// Number of taxels N.
    pub taxels: usize,
    /// Number of rows after which all levels repeat.
    pub period_rows: u64,
    /// Smallest number of rows after which one taxel starts to repeat another one's levels.
    pub least_phase_rows: u64,
    /// Rows among the first 1000 (counted from 1) on which all taxels have the same level.
    pub constant_rows: Vec<usize>,
    /// Share of the first 100,000 rows whose sum exceeds 90 % of the sum of their magnitudes. Such rows measure little
    /// more than the total.
    pub nearly_constant_share: f64,
    /// Rank of the first N rows.
    pub first_rank: usize,
}

/// Windows of M consecutive rows. The first starts where the seeds are loaded, the others at random in the first ten
/// million rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WindowRow {
    /// Name of the set.
    pub seeds: String,
    /// Rows M of a window.
    pub m: usize,
    /// Mean rank.
    pub rank_mean: f64,
    /// Least rank.
    pub rank_least: usize,
    /// Share of the windows with full rank.
    pub full_rank_share: f64,
    /// Median condition number σ₁/σ_min; ∞ (null in JSON) if half of the windows lack full rank.
    pub condition_median: f64,
    /// Mutual coherence of the columns, mean over the windows.
    pub column_coherence: f64,
    /// Root mean square coherence of two columns.
    pub column_rms: f64,
    /// Welch's lower bound on the mutual coherence of the columns.
    pub welch_bound: f64,
    /// Largest coherence of two rows, mean over the windows.
    pub row_coherence: f64,
    /// Largest coherence of two rows in the worst window.
    pub row_coherence_worst: f64,
    /// Root mean square coherence of two rows; 1/√N for independent ones.
    pub row_rms: f64,
    /// Sparsity S of the isometry constant: M/4, in [2, 8].
    pub isometry_s: usize,
    /// Lower bound of the restricted isometry constant δ_S, mean over 16 windows. At 1 or more, some S columns are
    /// dependent.
    pub isometry_delta: f64,
}

/// Facts of a set.
pub(super) fn facts(set: &SeedSet, mode: WeightMode) -> Result<SeedFacts, SeedError> {
    let taxels = set.seeds.len();
    let first = set.rows(mode, 0, FIRST_ROWS);
    let constant = |row: &[f64]| row.iter().all(|w| w.to_bits() == row[0].to_bits());
    let nearly: usize = (0..MANY_ROWS.div_ceil(FIRST_ROWS))
        .into_par_iter()
        .map(|block| {
            let rows = set.rows(mode, (block * FIRST_ROWS) as u64, FIRST_ROWS);
            (0..FIRST_ROWS).filter(|&r| nearly_constant(rows.row(r))).count()
        })
        .sum();
    Ok(SeedFacts {
        seeds: set.name.clone(),
        taxels,
        period_rows: PERIOD_ROWS,
        least_phase_rows: set.least_phase(),
        constant_rows: (0..FIRST_ROWS)
            .filter(|&r| constant(first.row(r)))
            .map(|r| r + 1)
            .collect(),
        nearly_constant_share: nearly as f64 / MANY_ROWS as f64,
        first_rank: coherence::spectrum(set.rows(mode, 0, taxels).view())?.rank,
    })
}

fn nearly_constant(row: &[f64]) -> bool {
    let (sum, magnitudes) = row.iter().fold((0.0, 0.0), |(s, m), w| (s + w, m + w.abs()));
    sum.abs() > NEARLY * magnitudes
}

/// Rows at which `count` windows start: 0, and random ones.
pub(super) fn starts(streams: Streams, label: &str, count: usize) -> Vec<u64> {
    let mut rng = streams.rng(label, 0);
    let random = std::iter::repeat_with(|| rng.random_range(0..SPAN_ROWS));
    std::iter::once(0).chain(random).take(count).collect()
}

/// One window.
struct JudgedWindow {
    spectrum: coherence::Spectrum,
    columns: coherence::Coherence,
    rows: coherence::Coherence,
    delta: Option<f64>,
}

/// Judges the windows of `m` rows that begin at `starts`.
pub(super) fn windows(
    set: &SeedSet,
    mode: WeightMode,
    m: usize,
    starts: &[u64],
    streams: Streams,
) -> Result<WindowRow, SeedError> {
    let isometry_s = (m / 4).clamp(2, 8);
    let judge = |(index, &start): (usize, &u64)| {
        let rows: Matrix = set.rows(mode, start, m);
        let delta = (index < ISOMETRY_WINDOWS).then(|| {
            let mut rng = streams.rng("isometry", index as u64);
            coherence::restricted_isometry(rows.view(), isometry_s, ISOMETRY, &mut rng).map(|found| found.delta)
        });
        Ok(JudgedWindow {
            spectrum: coherence::spectrum(rows.view())?,
            columns: coherence::columns(rows.view())?,
            rows: coherence::rows(rows.view())?,
            delta: delta.transpose()?,
        })
    };
    let found: Result<Vec<JudgedWindow>, CoherenceError> = starts.par_iter().enumerate().map(judge).collect();
    let found = found?;
    let mean = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
        sum / f64::max(count, 1.0)
    };
    let mut conditions: Vec<f64> = found.iter().map(|w| w.spectrum.condition).collect();
    conditions.sort_by(f64::total_cmp);
    Ok(WindowRow {
        seeds: set.name.clone(),
        m,
        rank_mean: mean(&mut found.iter().map(|w| w.spectrum.rank as f64)),
        rank_least: found.iter().map(|w| w.spectrum.rank).min().unwrap_or(0),
        full_rank_share: mean(&mut found.iter().map(|w| f64::from(w.spectrum.rank == w.spectrum.full))),
        condition_median: conditions.get(conditions.len() / 2).copied().unwrap_or(f64::NAN),
        column_coherence: mean(&mut found.iter().map(|w| w.columns.max)),
        column_rms: mean(&mut found.iter().map(|w| w.columns.rms)),
        welch_bound: coherence::welch_bound(m, set.seeds.len()),
        row_coherence: mean(&mut found.iter().map(|w| w.rows.max)),
        row_coherence_worst: found.iter().map(|w| w.rows.max).fold(0.0, f64::max),
        row_rms: mean(&mut found.iter().map(|w| w.rows.rms)),
        isometry_s,
        isometry_delta: mean(&mut found.iter().filter_map(|w| w.delta)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::Seeding;

    /// Rows of the published seeds that are known to be constant, counted from 1.
    #[test]
    fn the_published_seeds_have_their_known_constant_rows() {
        let address = facts(&SeedSet::of(Seeding::Address, 10), WeightMode::Binary).unwrap();
        assert_eq!(address.constant_rows, [1, 46, 63, 483, 528, 819, 928]);
        let mixed = facts(&SeedSet::of(Seeding::Mixed, 10), WeightMode::Binary).unwrap();
        assert!(mixed.constant_rows.is_empty() && mixed.first_rank == 100, "{mixed:?}");
        // 95 of 100 equal signs in a row of independent ones: 1e-22
        assert!(mixed.nearly_constant_share < 1e-9 && address.nearly_constant_share > 1e-3);
    }

    /// Independent ±1: squares of cosines are 1/N between rows and 1/M between columns on average.
    #[test]
    fn mixed_rows_look_independent() {
        let (set, streams) = (SeedSet::of(Seeding::Mixed, 10), Streams::new(1));
        let starts = starts(streams, "windows", 64);
        assert!(starts[0] == 0 && starts.iter().all(|&start| start < SPAN_ROWS));
        let found = windows(&set, WeightMode::Binary, 20, &starts, streams).unwrap();
        // 64 · 190 pairs of rows and 64 · 4950 of columns: 1 % of the mean
        assert!((found.row_rms / 0.1 - 1.0).abs() < 0.05, "{found:?}");
        assert!((found.column_rms * 20_f64.sqrt() - 1.0).abs() < 0.05, "{found:?}");
        assert!(found.column_coherence > found.welch_bound);
        assert_eq!((found.rank_least, found.isometry_s), (20, 5));
    }
}
