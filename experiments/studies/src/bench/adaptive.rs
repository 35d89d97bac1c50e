//! Entrants that choose the next measurement by those before: taxels around a contact, and halves of a part that is
//! touched.

use super::wire::{NEUTRAL, WireFrame, WireSession};
use super::{Entrant, Reader, Reading};
use spts_circuit::CellCodes;
use spts_input::Refusal;
use std::collections::VecDeque;
use std::ops::Range;

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

    /// The taxels that are read, `count` at most, from the samples of all.
    fn read_taxels(&self, frame: &WireFrame, count: usize) -> Vec<bool> {
        let mut read = vec![false; self.order.len()];
        let (mut near, mut grids) = (VecDeque::new(), self.order.iter().copied());
        for _ in 0..count {
            let next = std::iter::from_fn(|| near.pop_front()).chain(grids.by_ref()).find(|k: &usize| !read[*k]);
            let Some(taxel) = next else { break };
            read[taxel] = true;
            if frame.volts[taxel] > frame.alarm_v {
                near.extend(self.around(taxel, 1).filter(|k| !read[*k]));
            }
        }
        read
    }

    /// Samples of the contacts where they were taken; elsewhere that of the nearest taxel that was read, or the mean of
    /// several that are as near, up to one and a half pitches of a grid of `count` taxels. So a contact that was read
    /// to its rim, where nothing is touched, ends there.
    fn fill(&self, frame: &WireFrame, read: &[bool], count: usize) -> Vec<f64> {
        let pitch = (self.order.len() as f64 / count.max(1) as f64).sqrt();
        #[expect(clippy::cast_possible_truncation, reason = "at most the side of the skin")]
        let reach = (1.5 * pitch).ceil() as usize;
        // of the taxels that were read alone: the alarm of another one is not known
        let known = WireFrame {
            volts: (0..read.len()).map(|k| if read[k] { frame.volts[k] } else { 0.0 }).collect(),
            alarm_v: frame.alarm_v,
        };
        let samples = known.contacts(self.cols);
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
        // all taxels are measured once, and the samples are those at the taxels that are asked for
        let count = wire.left().min(self.order.len());
        let frame = wire.whole_scan(self.order.len())?;
        wire.spend(count)?;
        let read = self.read_taxels(&frame, count);
        Ok(Reading::of(self.fill(&frame, &read, count)))
    }
}

/// A binary search: the sum of a part of the sheet, and where it is beyond the alarm, of its halves, the largest part
/// first. A part that was not divided has its sum spread over its taxels.
pub(super) struct BinarySearch {
    parts: Parts,
}

/// Parts of a sheet, each before its halves: rows and columns. The first is all of it.
#[derive(Clone)]
struct Parts(Vec<(Range<usize>, Range<usize>)>, usize);

/// The largest parts have a sixteenth of the taxels: sums of more would leave no volts to a taxel.
const LARGEST_PART: usize = 16;

impl Parts {
    fn new(rows: usize, cols: usize) -> Self {
        let mut parts = vec![(0..rows, 0..cols)];
        let mut at = 0;
        while let Some(part) = parts.get(at).cloned() {
            parts.extend(halves(&part).into_iter().flatten());
            at += 1;
        }
        Self(parts, cols)
    }

    /// The numbers of the parts from which the search begins.
    fn first(&self) -> Vec<usize> {
        let taxels = self.size(0);
        let small = |k: &usize| self.size(*k) * LARGEST_PART <= taxels;
        // parts of which no larger one is small
        let mut first: Vec<usize> = Vec::new();
        for k in (0..self.0.len()).filter(small) {
            let within = |k: usize, of: usize| {
                let ((r, c), (rows, cols)) = (&self.0[k], &self.0[of]);
                rows.start <= r.start && r.end <= rows.end && cols.start <= c.start && c.end <= cols.end
            };
            if !first.iter().any(|&of| within(k, of)) {
                first.push(k);
            }
        }
        first
    }

    fn size(&self, part: usize) -> usize {
        self.0[part].0.len() * self.0[part].1.len()
    }

    fn number(&self, part: &(Range<usize>, Range<usize>)) -> Option<usize> {
        self.0.iter().position(|other| other == part)
    }

    fn taxels(&self, part: usize) -> impl Iterator<Item = usize> + '_ {
        let (rows, cols) = &self.0[part];
        rows.clone().flat_map(move |r| cols.clone().map(move |c| r * self.1 + c))
    }
}

/// Both halves along the longer side; `None` of a taxel.
fn halves((rows, cols): &(Range<usize>, Range<usize>)) -> Option<[(Range<usize>, Range<usize>); 2]> {
    let middle = |range: &Range<usize>| range.start + range.len().div_ceil(2);
    if rows.len() * cols.len() < 2 {
        return None;
    }
    Some(if rows.len() >= cols.len() {
        let at = middle(rows);
        [(rows.start..at, cols.clone()), (at..rows.end, cols.clone())]
    } else {
        let at = middle(cols);
        [(rows.clone(), cols.start..at), (rows.clone(), at..cols.end)]
    })
}

/// Row k is part k at level 1.
impl CellCodes for Parts {
    fn taxels(&self) -> usize {
        self.size(0)
    }

    fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), Refusal> {
        out.fill(NEUTRAL);
        for (row, codes) in (first_row..).zip(out.chunks_exact_mut(self.size(0))) {
            #[expect(clippy::cast_possible_truncation, reason = "less than the number of parts")]
            let part = (row % self.0.len() as u64) as usize;
            self.taxels(part).for_each(|taxel| codes[taxel] = u8::MAX);
        }
        Ok(())
    }
}

impl BinarySearch {
    pub(super) fn new(rows: usize, cols: usize) -> Self {
        Self { parts: Parts::new(rows, cols) }
    }
}

impl Entrant for BinarySearch {
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        let sum = |part: &usize| self.parts.taxels(*part).map(|k| conductance_s[k]).sum::<f64>();
        self.parts.first().iter().map(sum).fold(0.0, f64::max)
    }

    fn start(&self) -> Box<dyn Reader + '_> {
        Box::new(self)
    }
}

impl Reader for &BinarySearch {
    fn read(&mut self, wire: &mut WireSession<'_>) -> Result<Reading, Refusal> {
        let all = self.parts.0.len();
        let mut image = vec![0.0; self.parts.size(0)];
        let mut next: VecDeque<usize> = self.parts.first().into();
        while let Some(part) = next.pop_front().filter(|_| wire.left() > 0) {
            let (volts, alarm_v) = wire.single(&self.parts, all, part)?;
            let touched = volts > alarm_v;
            let each = if touched { volts / self.parts.size(part) as f64 } else { 0.0 };
            self.parts.taxels(part).for_each(|taxel| image[taxel] = each);
            if let Some(halves) = halves(&self.parts.0[part]).filter(|_| touched) {
                next.extend(halves.iter().filter_map(|half| self.parts.number(half)));
            }
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
        let read = grids.read_taxels(&frame, 40);
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
        for (rows, cols) in [(10, 10), (7, 3)] {
            let parts = Parts::new(rows, cols);
            assert_eq!(parts.0.len(), 2 * rows * cols - 1);
            let mut first: Vec<usize> = parts.first().into_iter().flat_map(|k| parts.taxels(k)).collect();
            first.sort_unstable();
            assert!(first.into_iter().eq(0..rows * cols), "{rows} × {cols}");
        }
    }
}
