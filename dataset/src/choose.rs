//! Selects rows when not all are needed.

use crate::folder::Dataset;
use crate::shard::shard_rows;
use crate::spec::Spec;
use rand::RngExt as _;
use std::collections::BTreeSet;
use std::ops::Range;

/// `rows` rows spread evenly over the ranges `held`, including the first; all rows if there are fewer.
///
/// ```
/// use spts_dataset::spread_rows;
///
/// // the files of two workers of three are there
/// let rows = spread_rows(&[0..100, 200..300], 4);
/// assert_eq!(rows.into_iter().collect::<Vec<_>>(), [0, 50, 200, 250]);
/// ```
#[must_use]
pub fn spread_rows(held: &[Range<u64>], rows: u64) -> BTreeSet<u64> {
    let all = count(held);
    let rows = rows.min(all);
    // both are below 2^40 where a spec has them; wider numbers let any ranges be given
    let place = |k: u64| u64::try_from(u128::from(k) * u128::from(all) / u128::from(rows)).unwrap_or(u64::MAX);
    (0..rows).filter_map(|k| row_at(held, place(k))).collect()
}

impl Spec {
    /// `rows` different rows of the ranges `held`, drawn with `seed`; all rows if there are fewer. Draws with different
    /// `label`s are independent.
    #[must_use]
    pub fn drawn_rows(&self, label: &str, held: &[Range<u64>], rows: u64, seed: u64) -> BTreeSet<u64> {
        let all = count(held);
        if rows >= all {
            return held.iter().cloned().flatten().collect();
        }
        let mut rng = self.streams().rng(label, seed);
        let mut drawn = BTreeSet::new();
        while (drawn.len() as u64) < rows {
            drawn.extend(row_at(held, rng.random_range(0..all)));
        }
        drawn
    }
}

impl Dataset {
    /// The rows of all existing files, one range a file. The files' contents are not checked.
    #[must_use]
    pub fn made_rows(&self) -> Vec<Range<u64>> {
        let made = (0..self.spec().shards()).filter(|shard| self.shard_file(*shard).symlink_metadata().is_ok());
        made.map(|shard| shard_rows(self.spec(), shard)).collect()
    }
}

fn count(held: &[Range<u64>]) -> u64 {
    held.iter().map(|range| range.end.saturating_sub(range.start)).sum()
}

/// Row number `place` of the rows of `held`, one range after the other.
fn row_at(held: &[Range<u64>], mut place: u64) -> Option<u64> {
    for range in held {
        let length = range.end.saturating_sub(range.start);
        if place < length {
            return Some(range.start + place);
        }
        place -= length;
    }
    None
}
