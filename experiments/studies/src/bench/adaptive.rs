//! Entrants that choose the next measurement by those before: taxels around a contact, and halves of a part that is
//! touched.

use super::rows::OneByOne;
use super::wire::{NEUTRAL, WireFrame, WireSession};
use super::{Entrant, Reader, Reading};
use spts_circuit::CellCodes;
use spts_input::Refusal;
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;

/// Adaptive sub-sampling: single taxels on ever finer grids until one is touched; then its neighbours, and theirs,
/// before the grids go on. Taxels that were not read are filled in from those that were.
///
/// After A. Slepyan et al., arXiv 2410.13847 (ACTS): their binary sampling. Their reconstruction takes a learned
/// dictionary; here a taxel that was not read has the value of the nearest one that was.
pub(super) struct Adaptive {
    rows: usize,
    cols: usize,
    /// Taxels in order of scanning, coarse grids first.
    order: Vec<usize>,
}

/// All taxels of a sheet: those of the coarsest grid first, then those that halve its pitch along both axes, and so on;
/// within a grid in an order that jumps about, so that the first part of it is spread evenly, too.
fn coarse_to_fine(rows: usize, cols: usize) -> Vec<usize> {
    let mut stride = rows.max(cols).next_power_of_two();
    let (mut order, mut taken) = (Vec::with_capacity(rows * cols), vec![false; rows * cols]);
    loop {
        let start = stride / 2;
        let along = |n: usize| (start.min(n - 1)..n).step_by(stride);
        let grid: Vec<usize> = along(rows).flat_map(|r| along(cols).map(move |c| r * cols + c)).collect();
        let mut fresh: Vec<usize> = grid.into_iter().filter(|k| !taken[*k]).collect();
        // multiples of the golden ratio, modulo 1, are spread evenly: Weyl
        fresh.sort_by_key(|k| (*k as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        fresh.iter().for_each(|k| taken[*k] = true);
        order.extend(fresh);
        if stride == 1 {
            break;
        }
        stride /= 2;
    }
    // odd sizes leave some to no grid
    order.extend((0..rows * cols).filter(|k| !taken[*k]));
    order
}

impl Adaptive {
    pub(super) fn new(rows: usize, cols: usize) -> Self {
        Self { rows, cols, order: coarse_to_fine(rows, cols) }
    }

    /// The taxels within one row and column of `taxel`, itself among them.
    fn around(&self, taxel: usize, reach: usize) -> impl Iterator<Item = usize> + '_ {
        let (r, c) = (taxel / self.cols, taxel % self.cols);
        let rows = r.saturating_sub(reach)..(r + reach + 1).min(self.rows);
        rows.flat_map(move |r| {
            let cols = c.saturating_sub(reach)..(c + reach + 1).min(self.cols);
            cols.map(move |c| r * self.cols + c)
        })
    }

    /// Reads `count` taxels at most: which, and their samples. `sample` reads one: its volts, and the alarm.
    fn read_taxels(
        &self,
        count: usize,
        mut sample: impl FnMut(usize) -> Result<(f64, f64), Refusal>,
    ) -> Result<(Vec<bool>, WireFrame), Refusal> {
        let taxels = self.order.len();
        let (mut read, mut frame) = (vec![false; taxels], WireFrame { volts: vec![0.0; taxels], alarm_v: 0.0 });
        let (mut near, mut grids) = (VecDeque::new(), self.order.iter().copied());
        for _ in 0..count {
            let next = std::iter::from_fn(|| near.pop_front()).chain(grids.by_ref()).find(|k: &usize| !read[*k]);
            let Some(taxel) = next else { break };
            read[taxel] = true;
            (frame.volts[taxel], frame.alarm_v) = sample(taxel)?;
            if frame.volts[taxel] > frame.alarm_v {
                near.extend(self.around(taxel, 1).filter(|k| !read[*k]));
            }
        }
        Ok((read, frame))
    }

    /// Samples of the contacts where they were taken; elsewhere that of the nearest taxel that was read, or the mean of
    /// several that are as near, up to one and a half pitches of a grid of `count` taxels. So a contact that was read
    /// to its rim, where nothing is touched, ends there.
    fn fill(&self, frame: &WireFrame, read: &[bool], count: usize) -> Vec<f64> {
        let pitch = (self.order.len() as f64 / count.max(1) as f64).sqrt();
        #[expect(clippy::cast_possible_truncation, reason = "at most the side of the skin")]
        let reach = (1.5 * pitch).ceil() as usize;
        let samples = frame.contacts(self.cols);
        // square of the distance to the nearest, the sum of those as near, and their number
        let mut nearest = vec![(usize::MAX, 0.0, 0_u32); read.len()];
        for taxel in (0..read.len()).filter(|k| read[*k]) {
            for k in self.around(taxel, reach).filter(|k| !read[*k]) {
                let rows = (k / self.cols).abs_diff(taxel / self.cols);
                let cols = (k % self.cols).abs_diff(taxel % self.cols);
                let square = rows * rows + cols * cols;
                let (least, sum, number) = &mut nearest[k];
                if square < *least {
                    (*least, *sum, *number) = (square, 0.0, 0);
                }
                if square == *least {
                    *sum += samples[taxel];
                    *number += 1;
                }
            }
        }
        let filled = |k: usize| {
            if read[k] { samples[k] } else { nearest[k].1 / f64::from(nearest[k].2.max(1)) }
        };
        (0..read.len()).map(filled).collect()
    }
}

impl Entrant for Adaptive {
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        conductance_s.iter().copied().fold(0.0, f64::max)
    }

    fn start(&self) -> Box<dyn Reader + '_> {
        Box::new(self)
    }
}

impl Reader for &Adaptive {
    fn read(&mut self, wire: &mut WireSession<'_>) -> Result<Reading, Refusal> {
        let (count, taxels) = (wire.left().min(self.order.len()), self.order.len());
        let (read, frame) = self.read_taxels(count, |k| wire.single(0, || OneByOne { taxels }, taxels, k))?;
        Ok(Reading::of(self.fill(&frame, &read, count)))
    }
}

/// A binary search: the sum of a part of the sheet, and where it is beyond the alarm, of its halves, the largest part
/// first. A part that was not divided has its sum spread over its taxels, if it or the part that it is half of is
/// touched.
pub(super) struct BinarySearch {
    /// Each before its halves. The first is all of the sheet.
    parts: Vec<Part>,
    /// Those of the same depth: so many halvings.
    depths: Vec<Range<usize>>,
    cols: usize,
}

/// Part of a sheet: rows and columns, and the number of the first of its halves.
#[derive(Debug, Clone)]
struct Part {
    rows: Range<usize>,
    cols: Range<usize>,
    halves: Option<usize>,
}

/// The largest parts have a sixteenth of the taxels: sums of more would leave no volts to a taxel.
const LARGEST_PART: usize = 16;

impl Part {
    fn size(&self) -> usize {
        self.rows.len() * self.cols.len()
    }

    /// Both halves along the longer side; `None` of a taxel.
    fn halved(&self) -> Option<[Self; 2]> {
        let middle = |range: &Range<usize>| range.start + range.len().div_ceil(2);
        let of = |rows: Range<usize>, cols: Range<usize>| Self { rows, cols, halves: None };
        let Self { rows, cols, .. } = self.clone();
        if self.size() < 2 {
            return None;
        }
        Some(if rows.len() >= cols.len() {
            let at = middle(&rows);
            [of(rows.start..at, cols.clone()), of(at..rows.end, cols)]
        } else {
            let at = middle(&cols);
            [of(rows.clone(), cols.start..at), of(rows, at..cols.end)]
        })
    }

    /// Its taxels, of a sheet with `all` columns.
    fn taxels(&self, all: usize) -> impl Iterator<Item = usize> + '_ {
        self.rows.clone().flat_map(move |r| self.cols.clone().map(move |c| r * all + c))
    }
}

/// Row k is part k at level 1.
#[derive(Clone)]
struct PartRows {
    parts: Arc<[Part]>,
    cols: usize,
    taxels: usize,
}

impl CellCodes for PartRows {
    fn taxels(&self) -> usize {
        self.taxels
    }

    fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), Refusal> {
        out.fill(NEUTRAL);
        for (row, codes) in (first_row..).zip(out.chunks_exact_mut(self.taxels)) {
            #[expect(clippy::cast_possible_truncation, reason = "less than the number of parts")]
            let part = (row % self.parts.len() as u64) as usize;
            self.parts[part].taxels(self.cols).for_each(|taxel| codes[taxel] = u8::MAX);
        }
        Ok(())
    }
}

impl BinarySearch {
    pub(super) fn new(rows: usize, cols: usize) -> Self {
        let mut parts = vec![Part { rows: 0..rows, cols: 0..cols, halves: None }];
        let (mut depths, mut depth) = (Vec::new(), 0..1);
        while !depth.is_empty() {
            for part in depth.clone() {
                if let Some(halves) = parts[part].halved() {
                    parts[part].halves = Some(parts.len());
                    parts.extend(halves);
                }
            }
            let next = depth.end..parts.len();
            depths.push(std::mem::replace(&mut depth, next));
        }
        Self { parts, depths, cols }
    }

    /// The numbers of the parts from which the search begins: those of a sixteenth of the sheet at most, of which no
    /// larger one is.
    fn first(&self) -> Vec<usize> {
        let small = |part: &Part| part.size() * LARGEST_PART <= self.parts[0].size();
        let mut first = Vec::new();
        for part in self.parts.iter().filter(|part| !small(part)) {
            let halves = part.halves.into_iter().flat_map(|k| [k, k + 1]);
            first.extend(halves.filter(|k| small(&self.parts[*k])));
        }
        if self.parts.iter().all(|part| !small(part)) {
            // a sheet of less than sixteen taxels: the taxels
            first.extend((0..self.parts.len()).filter(|k| self.parts[*k].halves.is_none()));
        }
        first
    }
}

impl Entrant for BinarySearch {
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        let sum = |part: &usize| self.parts[*part].taxels(self.cols).map(|k| conductance_s[k]).sum::<f64>();
        self.first().iter().map(sum).fold(0.0, f64::max)
    }

    fn start(&self) -> Box<dyn Reader + '_> {
        Box::new(self)
    }
}

impl Reader for &BinarySearch {
    fn read(&mut self, wire: &mut WireSession<'_>) -> Result<Reading, Refusal> {
        let taxels = self.parts[0].size();
        let mut image = vec![0.0; taxels];
        // parts, and whether they are halves of a touched one
        let mut next: VecDeque<(usize, bool)> = self.first().into_iter().map(|part| (part, false)).collect();
        while let Some((number, half)) = next.pop_front().filter(|_| wire.left() > 0) {
            // parts of another depth have noise of their own, and another alarm
            let depth = self.depths.iter().position(|depth| depth.contains(&number)).unwrap_or(0);
            let first = self.depths[depth].start;
            let rows = || PartRows { parts: self.parts[self.depths[depth].clone()].into(), cols: self.cols, taxels };
            let (volts, alarm_v) = wire.single(depth, rows, self.depths[depth].len(), number - first)?;
            let (part, touched) = (&self.parts[number], volts > alarm_v);
            let each = if touched || half { volts.max(0.0) / part.size() as f64 } else { 0.0 };
            part.taxels(self.cols).for_each(|taxel| image[taxel] = each);
            next.extend(part.halves.filter(|_| touched).into_iter().flat_map(|k| [(k, true), (k + 1, true)]));
        }
        Ok(Reading::of(image))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_recon::metrics::SUPPORT_THRESHOLD;

    #[test]
    fn the_order_has_every_taxel_once_and_its_beginning_is_a_grid() {
        for (rows, cols) in [(10, 10), (32, 32), (1, 7), (5, 12)] {
            let order = coarse_to_fine(rows, cols);
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert!(sorted.into_iter().eq(0..rows * cols), "{rows} × {cols}");
        }
        // 1, 4 and 16 taxels of 32 × 32: the middles of its quarters of quarters
        let mut first: Vec<usize> = coarse_to_fine(32, 32)[1..5].to_vec();
        first.sort_unstable();
        assert_eq!(first, [8 * 32 + 8, 8 * 32 + 24, 24 * 32 + 8, 24 * 32 + 24]);
    }

    /// A patch of 3 × 3 whose middle is on a grid is read as a whole, with a rim, once the grid has found it.
    #[test]
    fn a_contact_is_read_densely() {
        let grids = Adaptive::new(32, 32);
        let mut frame = WireFrame { volts: vec![0.0; 1024], alarm_v: 0.5 };
        for taxel in grids.around(8 * 32 + 8, 1) {
            frame.volts[taxel] = 1.0;
        }
        let (read, frame) = grids.read_taxels(40, |k| Ok((frame.volts[k], frame.alarm_v))).unwrap();
        assert_eq!(read.iter().filter(|r| **r).count(), 40);
        assert!(grids.around(8 * 32 + 8, 2).all(|k| read[k]));
        let image = grids.fill(&frame, &read, 40);
        for (k, v) in image.iter().enumerate() {
            let touched = grids.around(8 * 32 + 8, 1).any(|t| t == k);
            // what is filled in beside it does not count as touched
            assert!(if touched { *v > 0.99 } else { *v < SUPPORT_THRESHOLD }, "taxel {k}: {v}");
        }
    }

    /// Every taxel is a part, every part is there once, and the first ones are the sheet.
    #[test]
    fn parts_divide_the_sheet() {
        for (rows, cols) in [(10, 10), (7, 3), (2, 2)] {
            let search = BinarySearch::new(rows, cols);
            assert_eq!(search.parts.len(), 2 * rows * cols - 1);
            let mut first: Vec<usize> = search.first().into_iter().flat_map(|k| search.parts[k].taxels(cols)).collect();
            first.sort_unstable();
            assert!(first.into_iter().eq(0..rows * cols), "{rows} × {cols}");
        }
    }
}
