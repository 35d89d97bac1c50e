//! States of emulated cells, kept so that earlier rows can be reached again.

use spts_firmware::Array;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Most states that are kept. One of 100 cells takes some 100 kB.
const MOST: usize = 32;

/// States of the cells by the row that comes next, the first one always among them. Their distance doubles whenever there are
/// too many: memory stays bounded, and a row is never further from a state than about 1/16 of the rows seen.
#[derive(Debug, Clone)]
pub(super) struct Snapshots {
    /// Least distance of two states, rows.
    distance: u64,
    kept: BTreeMap<u64, Arc<Vec<Array>>>,
}

impl Snapshots {
    /// Only the state before row 0, others to be `distance` rows apart; at least 1.
    pub(super) fn new(buses: &[Array], distance: u64) -> Self {
        Self {
            distance,
            kept: BTreeMap::from([(0, Arc::new(buses.to_vec()))]),
        }
    }

    /// Row at which the next new state is due.
    pub(super) fn due(&self) -> u64 {
        self.kept.keys().next_back().map_or(0, |last| last + self.distance)
    }

    /// Keeps the state before `row`, where it is due.
    pub(super) fn keep(&mut self, row: u64, buses: &[Array]) {
        if row < self.due() {
            return;
        }
        self.kept.insert(row, Arc::new(buses.to_vec()));
        while self.kept.len() > MOST {
            self.distance *= 2;
            let mut due = 0;
            self.kept.retain(|row, _| {
                let keeps = *row >= due;
                if keeps {
                    due = row + self.distance;
                }
                keeps
            });
        }
    }

    /// The last state that comes before `row` or at it, and its row.
    pub(super) fn before(&self, row: u64) -> Option<(u64, &Arc<Vec<Array>>)> {
        let (at, buses) = self.kept.range(..=row).next_back()?;
        Some((*at, buses))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_firmware::Image;

    #[test]
    fn few_are_kept_and_none_is_far() {
        let buses = [Array::new(1, &Image::shipped()).unwrap()];
        let mut snapshots = Snapshots::new(&buses, 10);
        for row in 0..20_000 {
            snapshots.keep(row, &buses);
            assert!(snapshots.kept.len() <= MOST);
            let (before, _) = snapshots.before(row).unwrap();
            // a doubling leaves at least half of the states, and so at least 16 distances
            let far = (row / 16).max(10);
            assert!(row - before <= far, "row {row} is {} rows from a state", row - before);
        }
        assert_eq!(snapshots.before(0).unwrap().0, 0);
    }
}
