//! Triangles on the grid of fine cells.

use spts_models::SkinLayout;

/// Half-open rectangle of cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Patch {
    /// First and one-past-last row.
    pub rows: [usize; 2],
    /// First and one-past-last column.
    pub cols: [usize; 2],
}

impl Patch {
    /// Whether there is no cell in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows[0] >= self.rows[1] || self.cols[0] >= self.cols[1]
    }

    /// Number of columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.cols[1].saturating_sub(self.cols[0])
    }

    /// Number of rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.rows[1].saturating_sub(self.rows[0])
    }

    /// The cells of every row of the patch in a row-major grid `grid_cols` wide.
    pub fn lines(&self, grid_cols: usize) -> impl Iterator<Item = std::ops::Range<usize>> + use<> {
        let Self { rows, cols } = *self;
        (rows[0]..rows[1]).map(move |row| row * grid_cols + cols[0]..row * grid_cols + cols[1])
    }

    /// Grows to the smallest rectangle that has `other` too.
    pub(super) fn include(&mut self, other: Self) {
        if self.is_empty() {
            *self = other;
        } else if !other.is_empty() {
            self.rows = [self.rows[0].min(other.rows[0]), self.rows[1].max(other.rows[1])];
            self.cols = [self.cols[0].min(other.cols[0]), self.cols[1].max(other.cols[1])];
        }
    }
}

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
    /// A centre counts as inside down to this distance × length outside an edge (twice an area, cells²), so that none
    /// falls between two triangles through round-off.
    slack: f64,
}

/// Values on a rectangle of cells; each keeps the largest it gets.
pub(super) struct Cells<'a> {
    pub(super) values: &'a mut [f64],
    /// Row and column of the first value.
    pub(super) origin: [usize; 2],
    /// Values in a row.
    pub(super) stride: usize,
    /// Level above which heights count, m: the value of a cell is this less the height.
    pub(super) level_m: f64,
}

/// The ends of a run of cells are widened by this, in cells: above the round-off of a division; the slack is far below.
const COLUMN_SLACK: f64 = 1e-9;

/// Largest edge of a mesh that reaches the skin, m.
const LONGEST_M: f64 = 2.0;

/// Up to so many centres in a triangle's box are tested one by one.
const FEW: usize = 6;

impl Raster {
    #[expect(clippy::cast_precision_loss, reason = "cell counts stay far below 2^52")]
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
    #[expect(clippy::cast_precision_loss, reason = "cell counts stay far below 2^52")]
    pub(super) fn centre_m(&self, row: usize, col: usize) -> [f64; 2] {
        [
            self.first_m[0] + col as f64 * self.cell_m,
            self.first_m[1] - row as f64 * self.cell_m,
        ]
    }

    /// World (x, y), m, in cells.
    #[inline]
    pub(super) fn cells(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            (x - self.first_m[0]) * self.cells_per_m,
            (self.first_m[1] - y) * self.cells_per_m,
        ]
    }

    /// Cells whose centres lie in the box around the corners (u, v, z).
    #[inline]
    pub(super) fn span(&self, [a, b, c]: [[f64; 3]; 3]) -> Option<Patch> {
        let cols = whole(least([a[0], b[0], c[0]]), most([a[0], b[0], c[0]]), self.cols)?;
        let rows = whole(least([a[1], b[1], c[1]]), most([a[1], b[1], c[1]]), self.rows)?;
        Some(Patch { rows, cols })
    }

    /// Gives the heights of a triangle to the cells whose centres lie in it or on its border, and returns the part of
    /// the grid it may have reached. Corners are (u, v, height in m).
    ///
    /// A triangle whose projection is no larger than the slack is a vertical wall: any centre in it lies in the slack of
    /// the neighbours across its edges.
    #[inline]
    pub(super) fn add(&self, cells: &mut Cells<'_>, corners: [[f64; 3]; 3]) -> Option<Patch> {
        let patch = self.span(corners)?;
        let area = cross(corners[0], corners[1], [corners[2][0], corners[2][1]]);
        if area.abs() <= self.slack {
            return None;
        }
        let [a, b, c] = if area > 0.0 {
            corners
        } else {
            [corners[0], corners[2], corners[1]]
        };
        let plane = Plane {
            scale: 1.0 / area.abs(),
            rise: [b[2] - a[2], c[2] - a[2]],
            base: -a[2],
            low: -most([a[2], b[2], c[2]]),
            high: -least([a[2], b[2], c[2]]),
            level: cells.level_m,
        };
        let hit = if patch.height() * patch.width() <= FEW {
            self.one_by_one(cells, patch, [a, b, c], &plane)
        } else {
            self.row_by_row(cells, patch, [a, b, c], &plane)
        };
        hit.then_some(patch)
    }

    #[inline]
    #[expect(clippy::cast_precision_loss, reason = "cell counts stay far below 2^52")]
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

    #[expect(clippy::cast_precision_loss, reason = "cell counts stay far below 2^52")]
    fn row_by_row(&self, cells: &mut Cells<'_>, patch: Patch, [a, b, c]: [[f64; 3]; 3], plane: &Plane) -> bool {
        // twice the areas opposite a, b, c are linear along a row: w + col · dw
        let dw = [b[1] - c[1], c[1] - a[1], a[1] - b[1]];
        let inverse = dw.map(f64::recip);
        let step = dw[1] * plane.rise[0] + dw[2] * plane.rise[1];
        let mut hit = false;
        for row in patch.rows[0]..patch.rows[1] {
            let p = [patch.cols[0] as f64, row as f64];
            let w = [cross(b, c, p), cross(c, a, p), cross(a, b, p)];
            let Some([first, end]) = self.inside(w, dw, inverse, patch.width()) else {
                continue;
            };
            hit = true;
            let start = w[1] * plane.rise[0] + w[2] * plane.rise[1];
            let line = (row - cells.origin[0]) * cells.stride + patch.cols[0] - cells.origin[1];
            for (i, cell) in (first..end).zip(&mut cells.values[line + first..line + end]) {
                let value = plane.value(start + i as f64 * step);
                *cell = if value > *cell { value } else { *cell };
            }
        }
        hit
    }

    /// Columns `[first, end)` of `0..cells` in which all three of w + col · dw are at least −slack; `inverse` is 1/dw.
    #[inline]
    fn inside(&self, w: [f64; 3], dw: [f64; 3], inverse: [f64; 3], cells: usize) -> Option<[usize; 2]> {
        let (mut low, mut high) = (0.0_f64, f64::INFINITY);
        for i in 0..3 {
            let limit = -(w[i] + self.slack) * inverse[i];
            if dw[i] > 0.0 {
                low = if limit > low { limit } else { low };
            } else if dw[i] < 0.0 {
                high = if limit < high { limit } else { high };
            } else if w[i] < -self.slack {
                return None;
            }
        }
        whole(low, high, cells)
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

/// Whole numbers of `0..cells` in `[low, high]`, widened by [`COLUMN_SLACK`], as a half-open range.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "both ends are inside the grid where they are cast"
)]
#[inline]
fn whole(low: f64, high: f64, cells: usize) -> Option<[usize; 2]> {
    let (low, high) = (low - COLUMN_SLACK, high + COLUMN_SLACK);
    let last = cells as f64 - 1.0;
    if high < 0.0 || low > last {
        return None;
    }
    // rounding by hand: the library's ceil and floor are calls on the baseline instruction set
    let low = if low > 0.0 { low } else { 0.0 };
    let cut = low as u32;
    let first = cut as usize + usize::from(f64::from(cut) < low);
    let end = if high < last { high as u32 as usize + 1 } else { cells };
    (first < end).then_some([first, end])
}

/// Smallest of three numbers that are not NaN; unlike `f64::min` this is two instructions.
#[inline]
fn least([a, b, c]: [f64; 3]) -> f64 {
    let ab = if a < b { a } else { b };
    if ab < c { ab } else { c }
}

#[inline]
fn most([a, b, c]: [f64; 3]) -> f64 {
    let ab = if a > b { a } else { b };
    if ab > c { ab } else { c }
}

/// Twice the signed area of the triangle (a, b, p), cells².
#[inline]
fn cross(a: [f64; 3], b: [f64; 3], p: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
}
