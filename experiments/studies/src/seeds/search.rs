//! Searches better seeds: mixed addresses with another salt, then exchanges of single seeds.

use super::analysis::starts;
use super::error::SeedError;
use super::set::SeedSet;
use crate::budget::estimate::estimate;
use rayon::prelude::*;
use serde::Serialize;
use spts_circuit::{Seeding, WeightMode};
use spts_models::Streams;
use spts_recon::coherence::{self, CoherenceError};
use spts_recon::rows::{Exchange, exchange};

/// Windows that the search looks at.
const SEEN: usize = 24;
/// Windows of its own that its answer is judged on.
const UNSEEN: usize = 192;

/// Result of a search. The cost is the mean square coherence of two rows of a window, 1/N for independent rows. The sum
/// over pairs of rows equals the sum over pairs of columns (the frame potential) up to a constant, so a lower cost
/// improves both.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SeedSearch {
    /// Number of sets tried.
    pub tried: usize,
    /// Rows of a window.
    pub m: usize,
    /// Cost of the mixed addresses on the windows used in the search.
    pub mixed_cost: f64,
    /// Cost of the found set on the same windows.
    pub found_cost: f64,
    /// Cost of the mixed addresses on other windows.
    pub mixed_cost_unseen: f64,
    /// Cost of the found set on the other windows.
    pub found_cost_unseen: f64,
    /// Standard error of the difference of the two, over the windows.
    pub unseen_se: f64,
}

/// Standard errors that a gain on unseen windows has to be beyond: chance does it once in 40.
const BEYOND: f64 = 2.0;

impl SeedSearch {
    /// Whether the found set is better than the mixed addresses on the other windows, by more than chance.
    #[must_use]
    pub fn gained(&self) -> bool {
        self.mixed_cost_unseen - self.found_cost_unseen > BEYOND * self.unseen_se
    }
}

/// Looks at `budget` sets for a skin of `side` × `side` taxels: half of them mixed addresses with random salts, the
/// others what the best of these becomes by exchanging one seed at a time. The answer does not depend on the threads.
pub(super) fn search(
    side: usize,
    mode: WeightMode,
    m: usize,
    budget: usize,
    streams: Streams,
) -> Result<(SeedSet, SeedSearch), SeedError> {
    let seen = starts(streams, "seen", SEEN);
    // the start of the sequence was seen
    let unseen = starts(streams, "unseen", UNSEEN + 1).split_off(1);
    let costs = |set: &SeedSet, starts: &[u64]| costs(set, mode, m, starts);
    let cost = |set: &SeedSet, starts: &[u64]| costs(set, starts).map(|costs| estimate(&[costs]).mean);
    let mixed = SeedSet::of(Seeding::Mixed, side);
    let mixed_cost = cost(&mixed, &seen)?;
    let set = |seeds: &[u32]| SeedSet {
        name: "searched".to_owned(),
        seeds: seeds.to_vec(),
    };
    let (seeds, found_cost) = exchange(
        &Exchange {
            budget,
            salted: &|salt| salted(side, salt),
            cost: &|seeds| cost(&set(seeds), &seen),
        },
        mixed.seeds.clone(),
        [&mut streams.rng("salts", 0), &mut streams.rng("exchange", 0)],
    )?;
    let found = set(&seeds);
    let (with_mixed, with_found) = (costs(&mixed, &unseen)?, costs(&found, &unseen)?);
    let differences = with_mixed.iter().zip(&with_found).map(|(a, b)| a - b).collect();
    let report = SeedSearch {
        tried: budget,
        m,
        mixed_cost,
        found_cost,
        mixed_cost_unseen: estimate(&[with_mixed]).mean,
        found_cost_unseen: estimate(&[with_found]).mean,
        unseen_se: estimate(&[differences]).se,
    };
    Ok((found, report))
}

/// Mixed addresses that start at another one.
fn salted(side: usize, salt: u32) -> Vec<u32> {
    let seed = |taxel: u32| Seeding::Mixed.seed(salt.wrapping_add(taxel));
    (0..).map(seed).take(side * side).collect()
}

/// Mean square coherence of two rows in every window.
fn costs(set: &SeedSet, mode: WeightMode, m: usize, starts: &[u64]) -> Result<Vec<f64>, CoherenceError> {
    let of = |&start: &u64| coherence::rows(set.rows(mode, start, m).view()).map(|rows| rows.rms * rows.rms);
    starts.par_iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_search_lowers_its_cost_and_does_not_depend_on_the_threads() {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| search(5, WeightMode::Binary, 6, 60, Streams::new(3)).unwrap())
        };
        let (set, found) = run(1);
        assert_eq!((set.clone(), found.clone()), run(3));
        assert!(found.found_cost < found.mixed_cost, "{found:?}");
        // 1/N for independent rows of 25, and 192 · 15 pairs of rows; the others gain by chance at most, four standard
        // errors
        for cost in [found.mixed_cost_unseen, found.found_cost_unseen] {
            assert!((cost - 0.04).abs() < 0.01, "{found:?}");
        }
        assert!(
            (found.mixed_cost_unseen - found.found_cost_unseen).abs() < 4.0 * found.unseen_se,
            "{found:?}"
        );
        let seen = starts(Streams::new(3), "seen", SEEN);
        let again = costs(&set, WeightMode::Binary, 6, &seen).unwrap();
        assert!((again.iter().sum::<f64>() / SEEN as f64 - found.found_cost).abs() < 1e-15);
    }
}
