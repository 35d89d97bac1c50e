//! The triangles that can cover a cell's centre while the body hardly moves to the side or turns.

use super::blocks::Blocks;
use super::height_map::Stand;
use super::raster::{Raster, cross, least, most, whole};
use crate::body::PosedMesh;

/// How far a corner may move to the side, in cells.
const MARGIN: f64 = 0.03;

/// Share of the margin that is used. The rest covers what a triangle reaches beyond its edges by the raster's slack:
/// at a corner less than √(2 slack), 1e-4 cells.
const USED: f64 = 0.9;

/// A body that moves faster than this share of the margin from one call to the next is gone before a choice of its
/// triangles pays.
const SLOW: f64 = 1.0 / 16.0;

/// Few triangles of a fine mesh lie over a centre: slivers and small ones lie between. Those that may, out of the whole
/// mesh, for every stand near one. A centre that a moved triangle covers lies within the motion of its corners from
/// where the triangle was, so that what is left out covers none: the envelope is the same, bit for bit.
#[derive(Debug, Clone)]
pub(super) struct Near {
    stand: Stand,
    pub(super) blocks: Blocks,
}

impl Near {
    /// Triangles of `blocks` for stands near that of `body`.
    fn new(raster: &Raster, blocks: &Blocks, body: &PosedMesh<'_>, stand: Stand) -> Self {
        Self {
            stand,
            blocks: blocks.kept(raster, body, |corners, solid| may_cover(raster, corners, solid)),
        }
    }

    /// Whether it serves a body at `stand`.
    fn serves(&self, raster: &Raster, stand: &Stand) -> bool {
        moved_m(&self.stand, stand, self.blocks.radius_m()) <= USED * MARGIN * raster.cell_m
    }

    /// The choice of triangles for `body` at `stand`, which was at `last` before: `near`, or a new one if it moves so
    /// slowly that this pays.
    pub(super) fn follow(
        near: Option<Self>,
        raster: &Raster,
        blocks: &Blocks,
        body: &PosedMesh<'_>,
        [last, stand]: [&Stand; 2],
    ) -> Option<Self> {
        if near.as_ref().is_some_and(|near| near.serves(raster, stand)) {
            return near;
        }
        let slow = moved_m(last, stand, blocks.radius_m()) <= SLOW * MARGIN * raster.cell_m;
        slow.then(|| Self::new(raster, blocks, body, *stand))
    }
}

/// Farthest that a point within `radius_m` of the origin moves to the side from stand `a` to stand `b`, m.
fn moved_m(a: &Stand, b: &Stand, radius_m: f64) -> f64 {
    let squared = |range: std::ops::Range<usize>| -> f64 {
        let apart = a[range.clone()].iter().zip(&b[range]);
        apart
            .map(|(a, b)| (f64::from_bits(*a) - f64::from_bits(*b)).powi(2))
            .sum()
    };
    // the first two rows of the rotation, then x and y
    radius_m * squared(0..6).sqrt() + squared(9..11).sqrt()
}

/// Whether a triangle covers a centre when its corners, (column, row, height), move by up to the margin.
fn may_cover(raster: &Raster, [a, b, c]: [[f64; 3]; 3], solid: bool) -> bool {
    let area = cross(a, b, [c[0], c[1]]);
    let length = |p: [f64; 3], q: [f64; 3]| (p[0] - q[0]).hypot(p[1] - q[1]);
    let lengths = [length(b, c), length(c, a), length(a, b)];
    // twice the area changes by less than this
    let change = 2.0 * MARGIN * (lengths[1] + lengths[2] + 2.0 * MARGIN);
    if solid && area < -change {
        return false;
    }
    let side = if area < 0.0 { -1.0 } else { 1.0 };
    let ends = |k: usize, cells| {
        let ends = [a[k], b[k], c[k]];
        whole(least(ends) - MARGIN, most(ends) + MARGIN, cells)
    };
    let (cols, rows) = (ends(0, raster.cols), ends(1, raster.rows));
    let within = |p: [f64; 2]| {
        let edges = [(b, c), (c, a), (a, b)];
        let mut each = edges.iter().zip(lengths);
        each.all(|((from, to), length)| side * cross(*from, *to, p) >= -(MARGIN * length + raster.slack))
    };
    (rows[0]..rows[1]).any(|row| (cols[0]..cols[1]).any(|col| within([col as f64, row as f64])))
}
