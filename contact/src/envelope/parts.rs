//! Cells that a body covers in part, or whose surface turns within the cell.

use super::raster::{Raster, cross, least, most};

/// Part of a cell under a body.
///
/// Where the surface is smooth, its height at a cell's centre stands for the cell. At the rims of a body it does not:
/// there a cell has parts, each with its share of the cell's area and its mean height. The sum of share × pressure over
/// the parts is the cell's mean pressure, so the pressure map moves smoothly with the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Part {
    /// Row × columns + column.
    pub(crate) cell: usize,
    /// Share of the cell's area; those of a cell sum to at most 1.
    pub(crate) share: f64,
    /// How far the part lies below the level from which depths count, m.
    pub(crate) depth_m: f64,
    /// Its centroid, (column, row) in cells.
    pub(super) place: [f64; 2],
}

/// Takes the parts of a cell off the front of those of a line.
pub(crate) fn split_cell<'a>(parts: &mut &'a [Part], cell: usize) -> &'a [Part] {
    let count = parts.iter().take_while(|part| part.cell == cell).count();
    let (own, rest) = parts.split_at(count);
    *parts = rest;
    own
}

/// The parts of a body at a stand.
#[derive(Debug, Clone, Default)]
pub(super) struct Parts {
    /// Rows and columns of the cells that have parts, in order.
    marked: Vec<[usize; 2]>,
    /// The lowest height, m, that each has of what is no wall; infinite without.
    floor_m: Vec<f64>,
    /// Where each row of them begins, from the first on, and the end of the last.
    lines: Vec<usize>,
    first_row: usize,
    /// Height of the lowest point, m, from which bins of heights count, and the height of an even bin.
    lowest_m: f64,
    bin_m: f64,
    pieces: Vec<Piece>,
    /// Scratch: where the pieces of each marked cell begin, and once they are in order where they end; and the pieces
    /// as they came.
    ends: Vec<usize>,
    unsorted: Vec<Piece>,
    walls: Vec<[[f64; 3]; 3]>,
    /// In the order of cells, the lowest of each first; depths are below the body's origin.
    pub(super) list: Vec<Part>,
}

/// What a triangle has of a cell in one bin of heights: area, and integrals of height, column and row over it.
#[derive(Debug, Clone, Copy)]
struct Piece {
    /// Number of the marked cell, and the bin.
    key: u64,
    order: u32,
    sums: [f64; 4],
}

impl Piece {
    fn marked(&self) -> usize {
        usize::try_from(self.key >> 32).unwrap_or(0)
    }
}

/// Heights are told apart by bins. The lowest is 2⁻¹² of a cell high; from there on each is as high as all before it,
/// up to a quarter of a cell; then they are even; and from 16 cells on, where no foam reaches, as high as all before.
const EVEN_BIN: f64 = 0.25;
const LOWER_BINS: u32 = 10;
const EVEN_BINS: u32 = 64;
/// A surface that rises by more than this is a wall. Where one stands on the rim of a floor it is left out: a strip of
/// at most 1/20 of the depth.
const STEEP: f64 = 20.0;
/// Parts smaller than this share of a cell are round-off.
const LEAST_SHARE: f64 = 1e-7;
/// Corners of a triangle that is cut by the four sides of a cell and by a height.
const MOST_CORNERS: usize = 8;

impl Parts {
    /// Begins with the marked cells, for a body whose lowest point is at `lowest_m`. Returns the height below which a
    /// triangle may belong to a part below `level_m`.
    pub(super) fn begin(&mut self, raster: &Raster, lowest_m: f64, level_m: f64) -> f64 {
        // one number is compared faster than two
        self.marked.sort_unstable_by_key(|[row, col]| (*row as u64) << 32 | *col as u64);
        self.marked.dedup();
        self.pieces.clear();
        self.walls.clear();
        self.list.clear();
        self.floor_m.clear();
        self.floor_m.resize(self.marked.len(), f64::INFINITY);
        self.lines.clear();
        self.lines.push(0);
        self.first_row = self.marked.first().map_or(0, |[row, _]| *row);
        for (k, [row, _]) in self.marked.iter().enumerate() {
            while self.lines.len() <= row - self.first_row {
                self.lines.push(k);
            }
        }
        self.lines.push(self.marked.len());
        (self.lowest_m, self.bin_m) = (lowest_m, EVEN_BIN * raster.cell_m);
        if self.marked.is_empty() || !level_m.is_finite() {
            return level_m;
        }
        // and the floors that walls of these parts are told apart by
        lowest_m + self.top_m(self.bin(level_m - lowest_m)) + self.bin_m
    }

    pub(super) fn forget(&mut self) {
        self.marked.clear();
        self.list.clear();
    }

    /// Rows and columns of the cells that have parts.
    pub(super) fn marked(&self) -> &[[usize; 2]] {
        &self.marked
    }

    /// Marks the cells through which an edge goes. Ends are (u, v, height).
    pub(super) fn mark(&mut self, raster: &Raster, [a, b]: [[f64; 3]; 2]) {
        let (a, b) = if a[1] <= b[1] { (a, b) } else { (b, a) };
        let rows = cells_between(a[1], b[1], raster.rows);
        let slope = (b[0] - a[0]) / (b[1] - a[1]);
        for row in rows {
            let at = |v: f64| {
                let u = a[0] + (v - a[1]) * slope;
                // a level edge has no slope
                if u.is_finite() { u.clamp(a[0].min(b[0]), a[0].max(b[0])) } else { f64::NAN }
            };
            let (first, last) = (at((row as f64 - 0.5).max(a[1])), at((row as f64 + 0.5).min(b[1])));
            let [first, last] = if first.is_nan() || last.is_nan() { [a[0], b[0]] } else { [first, last] };
            let cols = cells_between(first.min(last), first.max(last), raster.cols);
            self.marked.extend(cols.map(|col| [row, col]));
        }
    }

    /// Adds what a triangle has of the marked cells. Corners are (u, v, height). Walls wait: they count only where
    /// they hang far below the rest.
    #[inline]
    pub(super) fn add(&mut self, raster: &Raster, corners: [[f64; 3]; 3]) {
        if self.marked.is_empty() {
            return;
        }
        let [a, b, c] = corners;
        let area = cross(a, b, [c[0], c[1]]);
        let rise = [b[2] - a[2], c[2] - a[2]];
        let across = [0, 1].map(|k| rise[0] * (c[k] - a[k]) - rise[1] * (b[k] - a[k]));
        let per_cell = raster.cell_m * STEEP;
        if across[0] * across[0] + across[1] * across[1] > (area * area) * (per_cell * per_cell) {
            self.walls.push(corners);
        } else {
            self.add_to(raster, corners, false);
        }
    }

    /// Adds what a triangle has of the marked cells; of a wall what is below the cell's floor, if it begins more than
    /// an even bin below it. Other walls stand on the rim of the floor, as those of a block do.
    fn add_to(&mut self, raster: &Raster, corners: [[f64; 3]; 3], is_wall: bool) {
        let area = cross(corners[0], corners[1], [corners[2][0], corners[2][1]]);
        if area.abs() <= raster.slack.max(LEAST_SHARE) {
            return;
        }
        let [a, b, c] = if area > 0.0 { corners } else { [corners[0], corners[2], corners[1]] };
        let edges = [(b, c), (c, a), (a, b)];
        let by_col = edges.map(|(from, to)| from[1] - to[1]);
        let by_row = edges.map(|(from, to)| to[0] - from[0]);
        let reach = [0, 1, 2].map(|k| 0.5 * (by_col[k].abs() + by_row[k].abs()));
        let scale = 1.0 / area.abs();
        let rise = [b[2] - a[2], c[2] - a[2]];
        let slope = [by_col, by_row].map(|by| (by[1] * rise[0] + by[2] * rise[1]) * scale);
        let half_m = 0.5 * (slope[0].abs() + slope[1].abs());
        let low_m = least([a[2], b[2], c[2]]);
        let spans = [0, 1].map(|k| [least([a[k], b[k], c[k]]), most([a[k], b[k], c[k]])]);
        let rows = cells_between(spans[1][0], spans[1][1], raster.rows);
        let cols = cells_between(spans[0][0], spans[0][1], raster.cols);
        let last_row = self.first_row + self.lines.len() - 1;
        for row in rows.start.max(self.first_row)..rows.end.min(last_row) {
            let line = self.lines[row - self.first_row]..self.lines[row - self.first_row + 1];
            let from = line.start + self.marked[line.clone()].partition_point(|[_, col]| *col < cols.start);
            for k in from..line.end {
                let [_, col] = self.marked[k];
                if col >= cols.end {
                    break;
                }
                let p = [col as f64, row as f64];
                let w = edges.map(|(from, to)| cross(from, to, p));
                let hangs = low_m + self.bin_m < self.floor_m[k];
                if (0..3).any(|k| w[k] <= -reach[k]) || (is_wall && !hangs) {
                    continue;
                }
                if !is_wall && (0..3).all(|k| w[k] >= reach[k]) {
                    let height_m = a[2] + (w[1] * rise[0] + w[2] * rise[1]) * scale;
                    let bins = [-half_m, half_m].map(|off| self.bin(height_m + off - self.lowest_m));
                    if bins[0] == bins[1] {
                        self.floor_m[k] = self.floor_m[k].min(height_m - half_m);
                        self.push(k, bins[0], [1.0, height_m, p[0], p[1]]);
                        continue;
                    }
                }
                let mut polygon = Polygon::from([a, b, c]);
                for (axis, at, [low, high]) in [(1, p[1], spans[1]), (0, p[0], spans[0])] {
                    if high > at + 0.5 {
                        polygon.cut(axis, 1.0, at + 0.5);
                    }
                    if low < at - 0.5 {
                        polygon.cut(axis, -1.0, 0.5 - at);
                    }
                }
                self.cut(k, &polygon, is_wall);
            }
        }
    }

    /// Cuts a polygon of a cell at the borders of the bins.
    fn cut(&mut self, marked: usize, polygon: &Polygon, is_wall: bool) {
        let [low_m, high_m] = polygon.span(2);
        if low_m > high_m {
            return;
        }
        let (mut bin, last) = (self.bin(low_m - self.lowest_m), self.bin(high_m - self.lowest_m));
        let floor = if is_wall { self.bin(self.floor_m[marked] - self.lowest_m) } else { u32::MAX };
        if !is_wall {
            self.floor_m[marked] = self.floor_m[marked].min(low_m);
        }
        let mut before = [0.0; 4];
        loop {
            let below = if bin >= last {
                polygon.sums()
            } else {
                let mut below = *polygon;
                below.cut(2, 1.0, self.lowest_m + self.top_m(bin));
                below.sums()
            };
            let sums = [0, 1, 2, 3].map(|k| below[k] - before[k]);
            if sums[0] > LEAST_SHARE * LEAST_SHARE && bin < floor {
                self.push(marked, bin, sums);
            }
            if bin >= last.min(floor) {
                return;
            }
            (before, bin) = (below, bin + 1);
        }
    }

    fn push(&mut self, marked: usize, bin: u32, sums: [f64; 4]) {
        let order = u32::try_from(self.pieces.len()).unwrap_or(u32::MAX);
        self.pieces.push(Piece { key: (marked as u64) << 32 | u64::from(bin), order, sums });
    }

    /// The bin of a height above the lowest point.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number from 1 to 64")]
    fn bin(&self, above_m: f64) -> u32 {
        // ⌊log₂⌋ of a number from 1 on
        let log = |x: f64| u32::try_from(x.to_bits() >> 52).unwrap_or(0).saturating_sub(1023);
        let at = above_m / self.bin_m;
        let lower = at * f64::from(LOWER_BINS).exp2();
        if lower < 1.0 {
            0
        } else if at < 1.0 {
            1 + log(lower)
        } else if at < f64::from(EVEN_BINS) {
            LOWER_BINS + at as u32
        } else {
            LOWER_BINS + EVEN_BINS + log(at / f64::from(EVEN_BINS))
        }
    }

    /// Upper border of a bin above the lowest point, m.
    fn top_m(&self, bin: u32) -> f64 {
        let even = bin.saturating_sub(LOWER_BINS);
        let lower = f64::from(bin.min(LOWER_BINS)) - f64::from(LOWER_BINS);
        let upper = f64::from(even.saturating_sub(EVEN_BINS - 1));
        let at = if even == 0 { lower.exp2() } else { f64::from((even + 1).min(EVEN_BINS)) * upper.exp2() };
        at * self.bin_m
    }

    /// Puts the pieces in the order of cells, bins and their own: first those of every cell together, by counting.
    fn sort(&mut self) {
        self.ends.clear();
        self.ends.resize(self.marked.len() + 1, 0);
        for piece in &self.pieces {
            self.ends[piece.marked() + 1] += 1;
        }
        let mut end = 0;
        for count in &mut self.ends {
            end += *count;
            *count = end;
        }
        self.unsorted.clone_from(&self.pieces);
        for piece in &self.unsorted {
            // where the cell's next goes, and after the last its end
            let at = &mut self.ends[piece.marked()];
            self.pieces[*at] = *piece;
            *at += 1;
        }
        let mut begin = 0;
        for end in &self.ends[..self.marked.len()] {
            self.pieces[begin..*end].sort_unstable_by_key(|p| (p.key, p.order));
            begin = *end;
        }
    }

    /// Joins the pieces to parts. Where layers of a body lie above each other, the lowest count first.
    pub(super) fn finish(&mut self, raster: &Raster) {
        let walls = std::mem::take(&mut self.walls);
        walls.iter().for_each(|corners| self.add_to(raster, *corners, true));
        self.walls = walls;
        self.sort();
        let mut left = 1.0;
        for pieces in self.pieces.chunk_by_mut(|p, q| p.key == q.key) {
            let [row, col] = self.marked[pieces[0].marked()];
            let cell = row * raster.cols + col;
            if pieces.iter().map(|p| p.sums[0]).sum::<f64>() > 1.0 + LEAST_SHARE {
                let mean_m = |p: &Piece| p.sums[1] / p.sums[0];
                pieces.sort_unstable_by(|p, q| mean_m(p).total_cmp(&mean_m(q)).then(p.order.cmp(&q.order)));
            }
            if self.list.last().is_none_or(|part| part.cell != cell) {
                left = 1.0;
            }
            let mut sums = [0.0; 4];
            for piece in pieces {
                let own = piece.sums[0].min(left);
                left -= own;
                let kept = own / piece.sums[0];
                sums = [0, 1, 2, 3].map(|k| sums[k] + kept * piece.sums[k]);
            }
            let [share, height, u, v] = sums;
            if share > LEAST_SHARE {
                self.list.push(Part { cell, share, depth_m: -height / share, place: [u / share, v / share] });
            }
        }
    }
}

/// Cells of `0..count` that the closed interval between two coordinates meets, of which centres are whole numbers.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "both ends are cut to the grid")]
fn cells_between(low: f64, high: f64, count: usize) -> std::ops::Range<usize> {
    // not finite: none
    if !(low <= high && low < count as f64 && high > -1.0) {
        return 0..0;
    }
    let first = (low + 0.5 - BORDER).max(0.0) as usize;
    let end = (high + 1.5 + BORDER).clamp(0.0, count as f64) as usize;
    first.min(count)..end
}

/// A point this near to the border of a cell, in cells, counts for both sides.
const BORDER: f64 = 1e-9;

/// A convex polygon with few corners.
#[derive(Clone, Copy)]
struct Polygon {
    /// The corners, and room for those of the next cut.
    corners: [[[f64; 3]; MOST_CORNERS]; 2],
    current: usize,
    count: usize,
}

impl From<[[f64; 3]; 3]> for Polygon {
    #[inline]
    fn from(triangle: [[f64; 3]; 3]) -> Self {
        let mut corners = [[[0.0; 3]; MOST_CORNERS]; 2];
        corners[0][..3].copy_from_slice(&triangle);
        Self { corners, current: 0, count: 3 }
    }
}

impl Polygon {
    #[inline]
    fn corners(&self) -> &[[f64; 3]] {
        &self.corners[self.current][..self.count]
    }

    /// Smallest and largest coordinate `axis`; out of order without corners.
    #[inline]
    fn span(&self, axis: usize) -> [f64; 2] {
        let mut span = [f64::INFINITY, f64::NEG_INFINITY];
        for p in self.corners() {
            span =
                [if p[axis] < span[0] { p[axis] } else { span[0] }, if p[axis] > span[1] { p[axis] } else { span[1] }];
        }
        span
    }

    /// Leaves the part where `sign` × the coordinate `axis` is at most `bound` (I. E. Sutherland and G. W. Hodgman,
    /// Communications of the ACM 17 (1974) 32).
    #[inline]
    fn cut(&mut self, axis: usize, sign: f64, bound: f64) {
        let over = |p: &[f64; 3]| sign * p[axis] - bound;
        let (low, high) = self.corners.split_at_mut(1);
        let (from, to) = if self.current == 0 { (&low[0], &mut high[0]) } else { (&high[0], &mut low[0]) };
        let mut count = 0;
        if let Some(last) = from[..self.count].last() {
            let (mut before, mut before_over) = (last, over(last));
            // cut by five lines, a triangle has no more corners than there is room for
            let mut keep = |p: [f64; 3]| {
                if count < MOST_CORNERS {
                    to[count] = p;
                    count += 1;
                }
            };
            for p in &from[..self.count] {
                let here = over(p);
                if (before_over < 0.0 && here > 0.0) || (before_over > 0.0 && here < 0.0) {
                    let share = before_over / (before_over - here);
                    keep([0, 1, 2].map(|k| before[k] + share * (p[k] - before[k])));
                }
                if here <= 0.0 {
                    keep(*p);
                }
                (before, before_over) = (p, here);
            }
        }
        (self.current, self.count) = (1 - self.current, count);
    }

    /// Area, and integrals of height, u and v over it.
    #[inline]
    fn sums(&self) -> [f64; 4] {
        let mut sums = [0.0; 4];
        let [a, rest @ ..] = self.corners() else { return sums };
        for pair in rest.windows(2) {
            let (b, c) = (pair[0], pair[1]);
            let area = 0.5 * cross(*a, b, [c[0], c[1]]);
            let third = area / 3.0;
            sums[0] += area;
            for (sum, k) in sums[1..].iter_mut().zip([2, 0, 1]) {
                *sum += third * (a[k] + b[k] + c[k]);
            }
        }
        sums
    }
}
