//! Lower envelope of a posed triangle mesh on the skin's fine grid.

use super::PosedMesh;
use spts_models::SkinLayout;

/// Depth below the skin's free surface, sampled at the centres of fine cells: the deepest point of the mesh above each
/// centre, exact for the triangle mesh. Holes and concave undersides need no special care.
#[derive(Debug, Clone)]
pub struct Envelope {
    rows: usize,
    cols: usize,
    cell_m: f64,
    cells_per_m: f64,
    /// x of the centre of column 0 and y of the centre of row 0; y falls with the row.
    first_m: [f64; 2],
    depth_m: Vec<f64>,
    /// World z of every vertex of the last mesh.
    vertex_z_m: Vec<f64>,
    touched: Patch,
}

/// Half-open rectangle of cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Patch {
    /// First and one-past-last row.
    pub rows: [usize; 2],
    /// First and one-past-last column.
    pub cols: [usize; 2],
}

impl Patch {
    fn include(&mut self, rows: [usize; 2], cols: [usize; 2]) {
        if self.rows[0] >= self.rows[1] {
            *self = Self { rows, cols };
        } else {
            self.rows = [self.rows[0].min(rows[0]), self.rows[1].max(rows[1])];
            self.cols = [self.cols[0].min(cols[0]), self.cols[1].max(cols[1])];
        }
    }
}

/// A cell centre this far (twice an area, m²) outside an edge still counts as inside, so that no centre falls between
/// two triangles through round-off: 1e-15 m² / 1 mm = 1e-12 m.
const EDGE_SLACK_M2: f64 = 1e-15;

/// The same for the ends of a row of cells inside a triangle, in cells: above the round-off of a division.
const COLUMN_SLACK: f64 = 1e-9;

/// Triangles with a smaller projection (twice the area, m²) are vertical walls: their edges belong to neighbours too.
const WALL_M2: f64 = 1e-15;

impl Envelope {
    /// Empty envelope over `skin`, `cells_per_taxel` cells along each side of a taxel.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "cell counts stay far below 2^52")]
    pub fn new(skin: &SkinLayout, cells_per_taxel: usize) -> Self {
        let (rows, cols) = (skin.rows() * cells_per_taxel, skin.cols() * cells_per_taxel);
        let cell_m = skin.pitch_m() / cells_per_taxel as f64;
        let [width_m, height_m] = skin.extent_m();
        Self {
            rows,
            cols,
            cell_m,
            cells_per_m: 1.0 / cell_m,
            first_m: [0.5 * (cell_m - width_m), 0.5 * (height_m - cell_m)],
            depth_m: vec![0.0; rows * cols],
            vertex_z_m: Vec::new(),
            touched: Patch::default(),
        }
    }

    /// Number of fine rows and columns.
    #[must_use]
    pub fn shape(&self) -> [usize; 2] {
        [self.rows, self.cols]
    }

    /// Side of a fine cell, m.
    #[must_use]
    pub fn cell_m(&self) -> f64 {
        self.cell_m
    }

    /// Centre (x, y) of a fine cell, m.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "cell counts stay far below 2^52")]
    pub fn centre_m(&self, row: usize, col: usize) -> [f64; 2] {
        [
            self.first_m[0] + col as f64 * self.cell_m,
            self.first_m[1] - row as f64 * self.cell_m,
        ]
    }

    /// Depth below the free surface, m, row-major; 0 where nothing dips below it.
    #[must_use]
    pub fn depth_m(&self) -> &[f64] {
        &self.depth_m
    }

    /// Rasterises the parts of `body` below z = 0 and returns the cells that may have a depth. Only the cells of the
    /// previous call are cleared. Allocates only when a mesh has more vertices than any before it.
    pub fn rasterise(&mut self, body: &PosedMesh<'_>) -> Patch {
        for row in self.touched.rows[0]..self.touched.rows[1] {
            let start = row * self.cols;
            self.depth_m[start + self.touched.cols[0]..start + self.touched.cols[1]].fill(0.0);
        }
        self.touched = Patch::default();
        let [_, _, up] = body.rotation;
        let lift_m = body.position_m[2];
        self.vertex_z_m.clear();
        let height_m = |v: &[f64; 3]| up[0] * v[0] + up[1] * v[1] + up[2] * v[2] + lift_m;
        self.vertex_z_m.extend(body.mesh.vertices.iter().map(height_m));
        if !self.vertex_z_m.iter().fold(false, |dips, z| dips | (*z < 0.0)) {
            return self.touched;
        }
        for triangle in &body.mesh.triangles {
            let index = triangle.map(|i| i as usize);
            let z = index.map(|i| self.vertex_z_m[i]);
            if z[0] < 0.0 || z[1] < 0.0 || z[2] < 0.0 {
                let xy = index.map(|i| world_xy(body, body.mesh.vertices[i]));
                self.add_triangle(xy, z);
            }
        }
        self.touched
    }

    #[inline]
    fn add_triangle(&mut self, xy: [[f64; 2]; 3], z: [f64; 3]) {
        let [a, b, c] = xy;
        let x = [a[0], b[0], c[0]].map(|x| x - self.first_m[0]);
        let Some(cols) = self.span(least(x), -least(x.map(|x| -x)), self.cols) else {
            return;
        };
        let y = [a[1], b[1], c[1]].map(|y| self.first_m[1] - y);
        let Some(rows) = self.span(least(y), -least(y.map(|y| -y)), self.rows) else {
            return;
        };
        let double_area = cross(a, b, c);
        if double_area.abs() < WALL_M2 {
            return;
        }
        let sign = double_area.signum();
        let scale = sign / double_area;
        let (floor, ceiling) = (least(z), -least(z.map(|z| -z)));
        // twice the areas opposite a, b, c are linear along a row: w + col · dw
        let dw = [b[1] - c[1], c[1] - a[1], a[1] - b[1]].map(|dy| sign * dy * self.cell_m);
        let inverse = dw.map(f64::recip);
        let dz = (dw[0] * z[0] + dw[1] * z[1] + dw[2] * z[2]) * scale;
        let mut hit = false;
        for row in rows[0]..rows[1] {
            let p = self.centre_m(row, cols[0]);
            let w = [cross(b, c, p), cross(c, a, p), cross(a, b, p)].map(|area| sign * area);
            let Some([first, end]) = inside(w, dw, inverse, cols[1] - cols[0]) else {
                continue;
            };
            let start = (w[0] * z[0] + w[1] * z[1] + w[2] * z[2]) * scale;
            let line = row * self.cols + cols[0];
            for (i, cell) in self.depth_m[line + first..line + end].iter_mut().enumerate() {
                #[expect(clippy::cast_precision_loss, reason = "cell counts stay far below 2^52")]
                let height = (start + (first + i) as f64 * dz).clamp(floor, ceiling);
                if -height > *cell {
                    *cell = -height;
                    hit = true;
                }
            }
        }
        if hit {
            self.touched.include(rows, cols);
        }
    }

    /// Cells whose centres lie in `[low, high]`, measured from the first centre; `None` when there are none. The
    /// interval is widened by 1e-9 of a cell: the edge test decides, this only selects.
    fn span(&self, low_m: f64, high_m: f64, cells: usize) -> Option<[usize; 2]> {
        whole(low_m * self.cells_per_m, high_m * self.cells_per_m, cells)
    }
}

/// Columns `[first, end)` of `0..cells` in which all three of w + col · dw are at least −[`EDGE_SLACK_M2`]; `inverse` is
/// 1/dw.
#[inline]
fn inside(w: [f64; 3], dw: [f64; 3], inverse: [f64; 3], cells: usize) -> Option<[usize; 2]> {
    let (mut low, mut high) = (0.0_f64, f64::INFINITY);
    for i in 0..3 {
        let limit = -(w[i] + EDGE_SLACK_M2) * inverse[i];
        if dw[i] > 0.0 {
            low = if limit > low { limit } else { low };
        } else if dw[i] < 0.0 {
            high = if limit < high { limit } else { high };
        } else if w[i] < -EDGE_SLACK_M2 {
            return None;
        }
    }
    whole(low, high, cells)
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

fn world_xy(body: &PosedMesh<'_>, v: [f64; 3]) -> [f64; 2] {
    let [rx, ry, _] = body.rotation;
    [
        rx[0] * v[0] + rx[1] * v[1] + rx[2] * v[2] + body.position_m[0],
        ry[0] * v[0] + ry[1] * v[1] + ry[2] * v[2] + body.position_m[1],
    ]
}

/// Smallest of three numbers that are not NaN; unlike `f64::min` this is two instructions.
#[inline]
fn least([a, b, c]: [f64; 3]) -> f64 {
    let ab = if a < b { a } else { b };
    if ab < c { ab } else { c }
}

/// Twice the signed area of the triangle (a, b, p), m².
#[inline]
fn cross(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
}
