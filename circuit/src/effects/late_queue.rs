//! Queue of the next late cells: one row for each cell, retrieved in order of row.

/// Rows that have a list of their own; a power of two.
const SPAN: usize = 1024;
const NONE: u32 = u32::MAX;

/// The next row of every cell. Cells come out by row, and by number within a row, as from a heap, but at a cost that
/// does not grow with their number: the rows ahead have a list each, and what lies beyond is looked at once in
/// [`SPAN`] rows.
#[derive(Debug, Default)]
pub(super) struct LateQueue {
    /// First cell of the list of row `r` at `r % SPAN`, for rows before `end`.
    heads: Vec<u32>,
    /// Next cell in the list of each cell.
    next: Vec<u32>,
    /// Row of each cell.
    rows: Vec<u64>,
    /// First row without a list.
    end: u64,
    /// Cells whose rows have no list yet.
    beyond: Vec<u32>,
    /// Scratch: cells of one row.
    due: Vec<u32>,
}

impl LateQueue {
    /// Begins anew at `first_row` with `cells` cells, which have no row yet.
    pub(super) fn begin(&mut self, first_row: u64, cells: usize) {
        self.heads.clear();
        self.heads.resize(SPAN, NONE);
        self.next.clear();
        self.next.resize(cells, NONE);
        self.rows.clear();
        self.rows.resize(cells, u64::MAX);
        self.beyond.clear();
        self.end = first_row.saturating_add(SPAN as u64);
    }

    /// Says that `cell` is late at `row`, which is not before the row that was taken last.
    pub(super) fn put(&mut self, cell: usize, row: u64) {
        let number = u32::try_from(cell).unwrap_or(NONE);
        self.rows[cell] = row;
        if row < self.end {
            let head = &mut self.heads[place(row)];
            self.next[cell] = std::mem::replace(head, number);
        } else {
            self.beyond.push(number);
        }
    }

    /// Calls `each` with the cells that are late at `row` in the order of their numbers, and puts them back at the rows
    /// that it returns, which are later. Rows are taken one after the other.
    pub(super) fn take(&mut self, row: u64, mut each: impl FnMut(usize) -> u64) {
        if row >= self.end {
            self.end = row.saturating_add(SPAN as u64);
            for number in std::mem::take(&mut self.beyond) {
                self.put(number as usize, self.rows[number as usize]);
            }
        }
        let mut cell = std::mem::replace(&mut self.heads[place(row)], NONE);
        if cell == NONE {
            return;
        }
        let mut due = std::mem::take(&mut self.due);
        while cell != NONE {
            due.push(cell);
            cell = self.next[cell as usize];
        }
        due.sort_unstable();
        for cell in due.drain(..) {
            let cell = cell as usize;
            let next = each(cell);
            self.put(cell, next);
        }
        self.due = due;
    }
}

#[expect(clippy::cast_possible_truncation, reason = "less than SPAN")]
fn place(row: u64) -> usize {
    (row % SPAN as u64) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::cmp::Reverse;
    use std::collections::BinaryHeap;

    proptest! {
        /// Cells come out as from a heap of the standard library, whatever their rows.
        #[test]
        fn as_a_heap(first in 0..5000_u64, gaps in prop::collection::vec(prop::collection::vec(1..3000_u64, 1..8), 1..20)) {
            let mut queue = LateQueue::default();
            queue.begin(first, gaps.len());
            let mut heap = BinaryHeap::new();
            for (cell, gaps) in gaps.iter().enumerate() {
                queue.put(cell, first + gaps[0] - 1);
                heap.push(Reverse((first + gaps[0] - 1, cell)));
            }
            let mut turns = vec![0; gaps.len()];
            let after = |row: u64, cell: usize, turns: &mut Vec<usize>| {
                turns[cell] += 1;
                gaps[cell].get(turns[cell]).map_or(u64::MAX, |gap| row + gap)
            };
            let mut found = Vec::new();
            for row in first..first + 30_000 {
                queue.take(row, |cell| {
                    found.push((row, cell));
                    after(row, cell, &mut turns)
                });
            }
            let mut turns = vec![0; gaps.len()];
            let mut expected = Vec::new();
            while let Some(Reverse((row, cell))) = heap.pop().filter(|Reverse((row, _))| *row < first + 30_000) {
                expected.push((row, cell));
                heap.push(Reverse((after(row, cell, &mut turns), cell)));
            }
            prop_assert_eq!(found, expected);
        }
    }
}
