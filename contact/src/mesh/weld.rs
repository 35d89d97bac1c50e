//! Joins coinciding vertices and drops triangles that collapse.

use super::tri_mesh::{TriMesh, index};

/// No vertex.
const NONE: u32 = u32::MAX;
/// Side of a cell of the search grid in tolerances: large enough that a search seldom needs a neighbour cell, small
/// enough that a cell holds few vertices.
const CELL_TOLERANCES: f64 = 8.0;

/// Hash table of the kept vertices by their cell in space; vertices of one slot are chained.
struct Grid {
    side_m: f64,
    heads: Vec<u32>,
    next: Vec<u32>,
}

impl Grid {
    fn new(side_m: f64, vertices: usize) -> Self {
        Self {
            side_m,
            heads: vec![NONE; vertices.next_power_of_two().max(16)],
            next: Vec::new(),
        }
    }

    /// Cell along one axis. Saturation far outside the grid only makes the search slower.
    #[expect(clippy::cast_possible_truncation, reason = "float-to-int casts saturate")]
    fn cell(&self, x: f64) -> i64 {
        (x / self.side_m).floor() as i64
    }

    /// Slot of a cell. Cells that share a slot only make the search slower: the distance decides.
    fn slot(&self, [x, y, z]: [i64; 3]) -> usize {
        const ODD: [u64; 4] = [
            0x9e37_79b9_7f4a_7c15,
            0xc2b2_ae3d_27d4_eb4f,
            0x1656_67b1_9e37_79f9,
            0xd6e8_feb8_6659_fd93,
        ];
        let mixed = (x as u64).wrapping_mul(ODD[0]) ^ (y as u64).wrapping_mul(ODD[1]) ^ (z as u64).wrapping_mul(ODD[2]);
        let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(ODD[3]);
        (mixed >> 24) as usize & (self.heads.len() - 1)
    }

    /// The first of `kept` within `tolerance_m` of `v`.
    fn find(&self, v: [f64; 3], tolerance_m: f64, kept: &[[f64; 3]]) -> Option<u32> {
        let mut found = NONE;
        let [xs, ys, zs] = v.map(|x| self.cell(x - tolerance_m)..=self.cell(x + tolerance_m));
        for x in xs {
            for y in ys.clone() {
                for z in zs.clone() {
                    let mut k = self.heads[self.slot([x, y, z])];
                    while k != NONE {
                        let p = kept[k as usize];
                        let square = (0..3).map(|a| (p[a] - v[a]).powi(2)).sum::<f64>();
                        if square <= tolerance_m.powi(2) {
                            found = found.min(k);
                        }
                        k = self.next[k as usize];
                    }
                }
            }
        }
        (found != NONE).then_some(found)
    }

    /// Adds the next vertex, in the order of their indices.
    fn push(&mut self, v: [f64; 3]) {
        let slot = self.slot(v.map(|x| self.cell(x)));
        self.next.push(self.heads[slot]);
        self.heads[slot] = index(self.next.len() - 1);
    }
}

impl TriMesh {
    /// Joins vertices closer than `tolerance_m` to the first of them, drops triangles that lose a corner, and removes
    /// unused vertices. Also returns `(vertices joined, triangles dropped)`.
    ///
    /// A thin triangle with three distinct corners stays, even if its area is zero, because removing it would open the
    /// surface.
    ///
    /// # Panics
    /// If an index is out of range; [`super::checked`] tests the indices first.
    #[must_use]
    pub fn welded(&self, tolerance_m: f64) -> (Self, usize, usize) {
        let side_m = (CELL_TOLERANCES * tolerance_m).max(f64::MIN_POSITIVE.sqrt());
        let mut grid = Grid::new(side_m, self.vertices.len());
        let mut kept: Vec<[f64; 3]> = Vec::new();
        let mut target: Vec<u32> = Vec::with_capacity(self.vertices.len());
        for &v in &self.vertices {
            target.push(grid.find(v, tolerance_m, &kept).unwrap_or_else(|| {
                grid.push(v);
                kept.push(v);
                index(kept.len() - 1)
            }));
        }
        let joined = self.vertices.len() - kept.len();
        let corners = self.triangles.iter().map(|t| t.map(|i| target[i as usize]));
        let triangles: Vec<[u32; 3]> = corners.filter(|&[a, b, c]| a != b && b != c && c != a).collect();
        let dropped = self.triangles.len() - triangles.len();
        let whole = Self {
            vertices: kept,
            triangles: Vec::new(),
        };
        (whole.with_triangles(&triangles), joined, dropped)
    }
}
