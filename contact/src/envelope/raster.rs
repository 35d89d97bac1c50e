//! Triangles on the grid of fine cells.

use crate::field::Patch;
use spts_models::SkinLayout;

/// Grid of cells in its own coordinates: u counts columns and v rows, from the centre of the first cell, so that every
/// centre has whole coordinates.
#[derive(Debug, Clone)]
pub(super) struct Raster {
    pub(super) rows: usize,
    pub(super) cols: usize,
    pub(super) cell_m: f64,
    cells_per_m: f64,
    /// x of the centre of column 0 and y of the centre of row 0; y falls with the row.
    first_m: [f64; 2],
    /// Tolerance outside an edge up to which a centre counts as inside, as distance × length (twice an area, cells²),
    /// so that no centre falls between two triangles through round-off.
    pub(super) slack: f64,
}

/// Values on a rectangle of cells; each keeps the largest it gets.
pub(super) struct Cells<'a> {
    pub(super) values: &'a mut [f64],
    /// Row and column of the first value.
    pub(super) origin: [usize; 2],
    /// Number of values in a row.
    pub(super) stride: usize,
    /// Level above which heights count, m. The value of a cell is this level minus the height.
    pub(super) level_m: f64,
}

/// The ends of a run of cells are widened by this, in cells: above the round-off of a division; the slack is far below.
const COLUMN_SLACK: f64 = 1e-9;

/// Largest edge of a mesh that reaches the skin, m.
const LONGEST_M: f64 = 2.0;

/// Up to so many centres in a triangle's box are tested one by one.
const FEW: usize = 6;

impl Raster {
    pub(super) fn new(skin: &SkinLayout, cells_per_taxel: usize) -> Self {
        let (rows, cols) = (skin.rows() * cells_per_taxel, skin.cols() * cells_per_taxel);
        let cell_m = skin.pitch_m() / cells_per_taxel as f64;
        let [width_m, height_m] = skin.extent_m();
        // a product of an edge and a coordinate, each good to a few ulp of the largest coordinate
        let slack_m2 = 4.0 * f64::EPSILON * (0.5 * width_m.max(height_m) + LONGEST_M) * LONGEST_M;
        Self {
            rows,
            cols,
            cell_m,
            cells_per_m: 1.0 / cell_m,
            first_m: [0.5 * (cell_m - width_m), 0.5 * (height_m - cell_m)],
            slack: slack_m2 / (cell_m * cell_m),
        }
    }

    /// Centre (x, y) of a cell, m.
    pub(super) fn centre_m(&self, row: usize, col: usize) -> [f64; 2] {
        [self.first_m[0] + col as f64 * self.cell_m, self.first_m[1] - row as f64 * self.cell_m]
    }

    /// World (x, y) of a place in cells, m.
    pub(super) fn place_m(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        [self.first_m[0] + u * self.cell_m, self.first_m[1] - v * self.cell_m]
    }

    /// World (x, y), m, in cells.
    pub(super) fn cells(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [(x - self.first_m[0]) * self.cells_per_m, (self.first_m[1] - y) * self.cells_per_m]
    }

    /// Cells whose centres lie in the box around the corners (u, v, z); often none, with small triangles.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "corners stay in registers: most triangles end here")]
    pub(super) fn span(&self, [a, b, c]: [[f64; 3]; 3]) -> Option<Patch> {
        let cols = whole(least([a[0], b[0], c[0]]), most([a[0], b[0], c[0]]), self.cols);
        let rows = whole(least([a[1], b[1], c[1]]), most([a[1], b[1], c[1]]), self.rows);
        // one jump for both
        ((cols[0] < cols[1]) & (rows[0] < rows[1])).then_some(Patch { rows, cols })
    }

    /// Gives the heights of a triangle to the cells whose centres lie in it or on its border, and returns the part of
    /// the grid it may have reached. Corners are (u, v, height in m).
    ///
    /// A triangle whose projection is no larger than the slack is a vertical wall: any centre in it lies in the slack
    /// of the neighbours across its edges.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "as for `span`")]
    pub(super) fn add(&self, cells: &mut Cells<'_>, corners: [[f64; 3]; 3]) -> Option<Patch> {
        let patch = self.span(corners)?;
        self.fill(cells, patch, corners).then_some(patch)
    }

    /// Heights of a triangle at the centres of `patch`, the cells of its box.
    pub(super) fn fill(&self, cells: &mut Cells<'_>, patch: Patch, corners: [[f64; 3]; 3]) -> bool {
        let area = cross(corners[0], corners[1], [corners[2][0], corners[2][1]]);
        if area.abs() <= self.slack {
            return false;
        }
        let [a, b, c] = if area > 0.0 { corners } else { [corners[0], corners[2], corners[1]] };
        let plane = Plane {
            scale: 1.0 / area.abs(),
            rise: [b[2] - a[2], c[2] - a[2]],
            base: -a[2],
            low: -most([a[2], b[2], c[2]]),
            high: -least([a[2], b[2], c[2]]),
            level: cells.level_m,
        };
        if patch.height() * patch.width() <= FEW {
            self.one_by_one(cells, patch, [a, b, c], &plane)
        } else {
            self.row_by_row(cells, patch, [a, b, c], &plane)
        }
    }

    #[inline]
    fn one_by_one(&self, cells: &mut Cells<'_>, patch: Patch, [a, b, c]: [[f64; 3]; 3], plane: &Plane) -> bool {
        let mut hit = false;
        for row in patch.rows[0]..patch.rows[1] {
            let line = (row - cells.origin[0]) * cells.stride;
            for col in patch.cols[0]..patch.cols[1] {
                let p = [col as f64, row as f64];
                let (wa, wb, wc) = (cross(b, c, p), cross(c, a, p), cross(a, b, p));
                if wa < -self.slack || wb < -self.slack || wc < -self.slack {
                    continue;
                }
                let value = plane.value(wb * plane.rise[0] + wc * plane.rise[1]);
                let cell = &mut cells.values[line + col - cells.origin[1]];
                *cell = if value > *cell { value } else { *cell };
                hit = true;
            }
        }
        hit
    }

    /// Every edge bounds the columns of a row by a number that is linear in the row; so is the height.
    fn row_by_row(&self, cells: &mut Cells<'_>, patch: Patch, [a, b, c]: [[f64; 3]; 3], plane: &Plane) -> bool {
        let p = [patch.cols[0] as f64, patch.rows[0] as f64];
        let edges = [(b, c), (c, a), (a, b)];
        // twice the areas opposite a, b, c at the first centre, and their growth with column and row
        let w = edges.map(|(from, to)| cross(from, to, p));
        let by_col = edges.map(|(from, to)| from[1] - to[1]);
        let by_row = edges.map(|(from, to)| to[0] - from[0]);
        // a triangle has at most two edges on either side; a level one is an end of the rows
        let mut low = [[0.0; 2]; 2];
        let mut high = [[f64::INFINITY, 0.0]; 2];
        for i in 0..3 {
            let inverse = by_col[i].recip();
            let limit = [-(w[i] + self.slack) * inverse, -by_row[i] * inverse];
            if by_col[i] > 0.0 {
                low = [limit, low[0]];
            } else if by_col[i] < 0.0 {
                high = [limit, high[0]];
            }
        }
        let weighted = |w: [f64; 3]| w[1] * plane.rise[0] + w[2] * plane.rise[1];
        let (start, step, lift) = (weighted(w), weighted(by_col), weighted(by_row));
        let mut hit = false;
        let mut line = (patch.rows[0] - cells.origin[0]) * cells.stride + patch.cols[0] - cells.origin[1];
        for row in 0..patch.height() {
            let row = row as f64;
            let [l, h] = [low, high].map(|side| side.map(|[at, slope]| at + row * slope));
            let from = if l[0] > l[1] { l[0] } else { l[1] };
            let to = if h[0] < h[1] { h[0] } else { h[1] };
            let [first, end] = whole(from, to, patch.width());
            if first < end {
                hit = true;
                let start = start + row * lift;
                for (i, cell) in (first..end).zip(&mut cells.values[line + first..line + end]) {
                    let value = plane.value(start + i as f64 * step);
                    *cell = if value > *cell { value } else { *cell };
                }
            }
            line += cells.stride;
        }
        hit
    }
}

/// Height over a triangle as level − height.
struct Plane {
    /// 1 / twice the area.
    scale: f64,
    /// Heights of the second and third corner above the first, m.
    rise: [f64; 2],
    base: f64,
    low: f64,
    high: f64,
    level: f64,
}

impl Plane {
    /// Value where the areas opposite the second and third corner, times their rises, sum to `weighted`; never beyond
    /// the corners', which bounds what round-off does to a needle.
    #[inline]
    fn value(&self, weighted: f64) -> f64 {
        let value = self.base - weighted * self.scale;
        let value = if value < self.low { self.low } else { value };
        let value = if value > self.high { self.high } else { value };
        // last, so that a map made at another level gives the same bits
        self.level + value
    }
}

/// Whole numbers of `0..cells` in `[low, high]`, widened by [`COLUMN_SLACK`], as a half-open range; none when its ends
/// are not in order.
#[expect(clippy::cast_possible_truncation, reason = "both ends are inside the grid where they are cast")]
#[inline(always)]
#[expect(clippy::inline_always, reason = "as for `span`")]
fn whole(low: f64, high: f64, cells: usize) -> [usize; 2] {
    let count = cells as f64;
    // first = ⌈low⌉ and end = ⌊high⌋ + 1, cut to the grid; by hand, since the library's ceil and floor are calls on the
    // baseline instruction set
    let low = low - COLUMN_SLACK;
    let low = if low > 0.0 { low } else { 0.0 };
    let low = if low < count { low } else { count };
    let high = high + (1.0 + COLUMN_SLACK);
    let high = if high > 0.0 { high } else { 0.0 };
    let high = if high < count { high } else { count };
    let cut = low as u32;
    let first = cut + u32::from(f64::from(cut) < low);
    [first as usize, high as u32 as usize]
}

/// Smallest of three numbers that are not NaN; unlike `f64::min` this is two instructions.
#[inline]
pub(super) fn least([a, b, c]: [f64; 3]) -> f64 {
    let ab = if a < b { a } else { b };
    if ab < c { ab } else { c }
}

#[inline]
pub(super) fn most([a, b, c]: [f64; 3]) -> f64 {
    let ab = if a > b { a } else { b };
    if ab > c { ab } else { c }
}

/// Twice the signed area of the triangle (a, b, p), cells².
#[inline]
pub(super) fn cross(a: [f64; 3], b: [f64; 3], p: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
}
