//! The mesh: its size limits, its sides, its measures, and how it is moved, refined and welded.

use std::collections::HashMap;

/// Smallest plausible extent of an object that presses on a skin, m.
pub const MIN_EXTENT_M: f64 = 1e-3;
/// Largest plausible extent, m.
pub const MAX_EXTENT_M: f64 = 2.0;
/// Largest credible coordinate, m: 500,000 times [`MAX_EXTENT_M`] from the origin. Maps have coordinates below 10⁷ m,
/// of which f64 keeps nanometres.
pub(super) const MAX_COORDINATE_M: f64 = 1e7;
/// Size of the largest mesh file that is read, bytes. A text STL has about 250 bytes a triangle.
pub const MAX_FILE_BYTES: u64 = 1 << 28;
/// Most triangles of a mesh before repair, which takes about 0.5 kB a triangle; scanners export fewer.
pub(super) const MAX_TRIANGLES: usize = 1_000_000;
/// Most vertices of a mesh: a format without shared corners has three a triangle.
pub(super) const MAX_VERTICES: usize = 3 * MAX_TRIANGLES;
/// Number of triangles above which a mesh is decimated: further triangles cost time but do not improve the contact.
pub const SOFT_MAX_TRIANGLES: usize = 5000;

/// Triangle mesh in metres, body axes; triangles are counter-clockwise seen from outside.
///
/// ```
/// use spts_contact::mesh::cuboid;
///
/// let block = cuboid([40e-3, 20e-3, 10e-3]);
/// let tilted = block.clone().rotated_x(0.1).grounded();
/// assert!((tilted.volume_m3() - block.volume_m3()).abs() < 1e-15);
/// assert!(tilted.bounds().unwrap().0[2].abs() < 1e-15, "its lowest point is at z = 0");
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriMesh {
    /// Vertex positions, m.
    pub vertices: Vec<[f64; 3]>,
    /// Indices into `vertices`.
    pub triangles: Vec<[u32; 3]>,
}

/// A position in a list as a 32-bit index. Saturates beyond 2³² entries, far beyond the budget of
/// [`checked`](super::checked).
pub(super) fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}

// The sides of the triangles, sorted by edge.

/// A side of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Side {
    /// Ends of the edge, the smaller index first.
    pub(super) edge: [u32; 2],
    /// The triangle.
    pub(super) triangle: u32,
    /// Whether the triangle runs along the edge from the smaller index to the larger.
    pub(super) rising: bool,
}

impl Side {
    /// Start and end, as the triangle runs.
    pub(super) fn directed(self) -> [u32; 2] {
        let [low, high] = self.edge;
        if self.rising { [low, high] } else { [high, low] }
    }
}

/// An edge at which a surface turns or ends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rim {
    pub(crate) ends_m: [[f64; 3]; 2],
    /// Radius of the turn, m; 0 where the surface ends or turns by more than [`Rim::SHARP_RAD`].
    pub(crate) radius_m: f64,
}

impl Rim {
    const SHARP_RAD: f64 = 0.25 * std::f64::consts::PI;
}

/// All sides, those on one edge next to each other, in the order of their triangles.
pub(super) struct Sides(Vec<Side>);

impl Sides {
    pub(super) fn of(mesh: &TriMesh) -> Self {
        let mut sides = Vec::with_capacity(3 * mesh.triangles.len());
        for (t, &[a, b, c]) in mesh.triangles.iter().enumerate() {
            sides.extend([[a, b], [b, c], [c, a]].map(|[p, q]| Side {
                edge: [p.min(q), p.max(q)],
                triangle: index(t),
                rising: p < q,
            }));
        }
        sides.sort_unstable();
        Self(sides)
    }

    /// Edge by edge, its sides.
    pub(super) fn edges(&self) -> impl Iterator<Item = &[Side]> {
        self.0.chunk_by(|a, b| a.edge == b.edge)
    }
}

/// Sides along an edge minus sides against it: 0 where a surface is closed and agrees about its outside.
pub(super) fn balance(edge: &[Side]) -> i64 {
    edge.iter().map(|side| if side.rising { 1 } else { -1 }).sum()
}

/// Sets that are joined pair by pair, each member knowing whether it is turned against its set's first.
pub(super) struct Unions {
    parent: Vec<u32>,
    /// Whether the triangle is turned against its parent.
    turned: Vec<bool>,
}

impl Unions {
    pub(super) fn new(n: usize) -> Self {
        Self { parent: (0..n).map(index).collect(), turned: vec![false; n] }
    }

    /// First member of the set of `i`, and whether `i` is turned against it.
    pub(super) fn find(&mut self, i: u32) -> (u32, bool) {
        let (mut root, mut turned) = (i, false);
        while self.parent[root as usize] != root {
            turned ^= self.turned[root as usize];
            root = self.parent[root as usize];
        }
        let (mut at, mut rest) = (i, turned);
        while self.parent[at as usize] != root && at != root {
            let (next, step) = (self.parent[at as usize], self.turned[at as usize]);
            self.parent[at as usize] = root;
            self.turned[at as usize] = rest;
            rest ^= step;
            at = next;
        }
        (root, turned)
    }

    /// Joins the sets of `a` and `b`, which are `turned` against each other. `false` if they are known to be otherwise.
    pub(super) fn join(&mut self, a: u32, b: u32, turned: bool) -> bool {
        let ((ra, ta), (rb, tb)) = (self.find(a), self.find(b));
        if ra == rb {
            return ta ^ tb == turned;
        }
        // the smaller index leads, so that the numbering follows the file
        let (lead, follow) = (ra.min(rb), ra.max(rb));
        self.parent[follow as usize] = lead;
        self.turned[follow as usize] = ta ^ tb ^ turned;
        true
    }
}

// Bounds, area, volume and closedness of a mesh.

/// The least and the largest coordinates of `points`; ∞ and −∞ of none.
pub(crate) fn span<const N: usize>(points: impl IntoIterator<Item = [f64; N]>) -> [[f64; N]; 2] {
    let mut ends = [[f64::INFINITY; N], [f64::NEG_INFINITY; N]];
    for p in points {
        for k in 0..N {
            ends[0][k] = ends[0][k].min(p[k]);
            ends[1][k] = ends[1][k].max(p[k]);
        }
    }
    ends
}

pub(super) fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl TriMesh {
    /// Corners of triangle `t`, m.
    ///
    /// # Panics
    /// If `t` or one of its indices is out of range, which cannot happen for a mesh that passed [`super::checked`].
    pub fn corners(&self, t: usize) -> [[f64; 3]; 3] {
        self.triangles[t].map(|i| self.vertices[i as usize])
    }

    /// Smallest box around the vertices, m: `(low, high)`. `None` for a mesh without vertices.
    pub fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        let [low, high] = span(self.vertices.iter().copied());
        (!self.vertices.is_empty()).then_some((low, high))
    }

    /// Longest side of the box around the vertices, m; 0 for a mesh without vertices.
    pub fn extent_m(&self) -> f64 {
        self.bounds().map_or(0.0, |(low, high)| (0..3).fold(0.0, |most: f64, k| most.max(high[k] - low[k])))
    }

    /// Normal of triangle `t` times twice its area, m².
    ///
    /// # Panics
    /// As [`TriMesh::corners`].
    pub fn area_vector_m2(&self, t: usize) -> [f64; 3] {
        let [a, b, c] = self.corners(t);
        cross(sub(b, a), sub(c, a))
    }

    /// Surface area, m².
    pub fn area_m2(&self) -> f64 {
        (0..self.triangles.len())
            .map(|t| {
                let n = self.area_vector_m2(t);
                0.5 * dot(n, n).sqrt()
            })
            .sum()
    }

    /// Enclosed volume, m³: positive when the triangles face outwards, negative when the mesh is inside out.
    ///
    /// The divergence theorem on tetrahedra from the first vertex; exact for a closed mesh.
    pub fn volume_m3(&self) -> f64 {
        let Some(&o) = self.vertices.first() else { return 0.0 };
        (0..self.triangles.len())
            .map(|t| {
                let [a, b, c] = self.corners(t).map(|v| sub(v, o));
                dot(a, cross(b, c)) / 6.0
            })
            .sum()
    }

    /// Whether the surface is closed and every connected part of it faces outward: whatever is seen of it from below
    /// faces down. A part that is the wall of a cavity faces inward.
    pub(crate) fn is_solid(&self) -> bool {
        let sides = Sides::of(self);
        let mut parts = Unions::new(self.triangles.len());
        for edge in sides.edges() {
            if balance(edge) != 0 {
                return false;
            }
            for pair in edge.windows(2) {
                // which way a triangle runs does not matter here
                parts.join(pair[0].triangle, pair[1].triangle, false);
            }
        }
        let mut volumes_m3 = vec![0.0; self.triangles.len()];
        let near = self.vertices.first().copied().unwrap_or_default();
        for (t, corners) in (0..).zip(&self.triangles) {
            let [a, b, c] = corners.map(|i| sub(self.vertices[i as usize], near));
            let (first, _) = parts.find(t);
            volumes_m3[first as usize] += dot(a, cross(b, c)) / 6.0;
        }
        let mut firsts = (0..).zip(&volumes_m3).filter(|(t, _)| parts.find(*t).0 == *t);
        firsts.all(|(_, volume_m3)| *volume_m3 > 0.0)
    }

    /// The edges at which the surface turns or ends, the sharpest first.
    pub(crate) fn rims(&self) -> Vec<Rim> {
        let sides = Sides::of(self);
        let point = |i: u32| self.vertices[i as usize];
        // vector along the normal, of twice the triangle's area
        let normal = |t: u32| {
            let [a, b, c] = self.triangles[t as usize].map(point);
            cross(sub(b, a), sub(c, a))
        };
        let mut rims: Vec<_> = sides
            .edges()
            .filter_map(|edge| {
                let ends_m = edge[0].edge.map(point);
                let radius_m = match edge {
                    [one, other] => {
                        let (n, m) = (normal(one.triangle), normal(other.triangle));
                        let (across, along) = (dot(cross(n, m), cross(n, m)).sqrt(), dot(n, m));
                        let turn = across.atan2(if one.rising == other.rising { -along } else { along });
                        let length_m = dot(sub(ends_m[0], ends_m[1]), sub(ends_m[0], ends_m[1])).sqrt();
                        // heights of both triangles over the edge: the way on which the surface turns
                        let way_m = 0.5 * (dot(n, n).sqrt() + dot(m, m).sqrt()) / length_m;
                        let folded = turn >= Rim::SHARP_RAD || dot(n, n) <= 0.0 || dot(m, m) <= 0.0;
                        if folded { 0.0 } else { way_m / turn }
                    }
                    _ => 0.0,
                };
                // a flat edge has no radius; one without a length is no edge
                (radius_m < f64::INFINITY).then_some(Rim { ends_m, radius_m })
            })
            .collect();
        rims.sort_by(|a, b| a.radius_m.total_cmp(&b.radius_m));
        rims
    }

    /// Number of edges without a partner in the opposite direction: 0 for a closed, consistently oriented surface.
    /// Bodies that touch along an edge count as closed.
    pub fn open_edges(&self) -> usize {
        Sides::of(self).edges().filter(|edge| balance(edge) != 0).count()
    }
}

// Moves, rotates, scales, warps and joins meshes.

impl TriMesh {
    /// Applies `f` to every vertex. `f` must keep handedness (see [`TriMesh::flipped`]).
    pub fn mapped(mut self, f: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        for v in &mut self.vertices {
            *v = f(*v);
        }
        self
    }

    /// Moves the mesh by `offset_m`.
    pub fn translated(self, offset_m: [f64; 3]) -> Self {
        self.mapped(|v| [v[0] + offset_m[0], v[1] + offset_m[1], v[2] + offset_m[2]])
    }

    /// Scales along each axis about the origin. An odd number of negative factors mirrors the mesh; its triangles are
    /// then turned to face outwards again.
    pub fn scaled(self, factor: [f64; 3]) -> Self {
        let scaled = self.mapped(|v| [v[0] * factor[0], v[1] * factor[1], v[2] * factor[2]]);
        if factor.iter().product::<f64>() < 0.0 { scaled.flipped() } else { scaled }
    }

    /// Multiplies every vertex by a row-major rotation matrix.
    pub fn rotated(self, matrix: [[f64; 3]; 3]) -> Self {
        self.mapped(|v| matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2]))
    }

    /// Rotates by `angle_rad` about the body axis x.
    pub fn rotated_x(self, angle_rad: f64) -> Self {
        let (s, c) = angle_rad.sin_cos();
        self.rotated([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    }

    /// Moves the mesh along z so that its lowest vertex is at z = 0.
    pub fn grounded(self) -> Self {
        let low = self.bounds().map_or(0.0, |(low, _)| low[2]);
        self.translated([0.0, 0.0, -low])
    }

    /// Turns every triangle over: inside becomes outside.
    pub fn flipped(mut self) -> Self {
        for t in &mut self.triangles {
            t.swap(1, 2);
        }
        self
    }

    /// Joins both meshes into one. They share no vertices (see `TriMesh::welded`).
    pub fn merged(mut self, other: &TriMesh) -> Self {
        let base = index(self.vertices.len());
        self.vertices.extend_from_slice(&other.vertices);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i.saturating_add(base))));
        self
    }
}

// Splits long edges, so that a flat face can be bent.

impl TriMesh {
    /// Halves every edge that is longer than `longest_m` and for which `bends` (called with both ends, m) returns
    /// `true`, until none is left. Neighbours share the new vertices, so a closed mesh stays closed. There are at most
    /// 12 rounds: an edge ends at 1/4096 of its length or at `longest_m`, whichever is longer.
    ///
    /// # Panics
    /// If an index is out of range, which cannot happen for a mesh that passed [`super::checked`].
    pub fn refined(mut self, longest_m: f64, bends: impl Fn([f64; 3], [f64; 3]) -> bool) -> Self {
        for _ in 0..12 {
            let mut middle: HashMap<[u32; 2], u32> = HashMap::new();
            let mut triangles = Vec::with_capacity(self.triangles.len());
            for t in std::mem::take(&mut self.triangles) {
                let mids = [0, 1, 2].map(|k| self.middle_of(t[k], t[(k + 1) % 3], longest_m, &bends, &mut middle));
                self.split(t, mids, &mut triangles);
            }
            self.triangles = triangles;
            if middle.is_empty() {
                break;
            }
        }
        self
    }

    fn middle_of(
        &mut self,
        a: u32,
        b: u32,
        longest_m: f64,
        bends: &impl Fn([f64; 3], [f64; 3]) -> bool,
        middle: &mut HashMap<[u32; 2], u32>,
    ) -> Option<u32> {
        let key = [a.min(b), a.max(b)];
        if let Some(&m) = middle.get(&key) {
            return Some(m);
        }
        let (p, q) = (self.vertices[key[0] as usize], self.vertices[key[1] as usize]);
        if !bends(p, q) || square_distance(p, q) <= longest_m * longest_m {
            return None;
        }
        let m = index(self.vertices.len());
        self.vertices.push([0, 1, 2].map(|k| 0.5 * (p[k] + q[k])));
        middle.insert(key, m);
        Some(m)
    }

    /// Pieces of triangle `t` whose edges `k → k+1` have the middles `mids[k]`, where split.
    fn split(&self, t: [u32; 3], mids: [Option<u32>; 3], out: &mut Vec<[u32; 3]>) {
        // turned so that the split edges come first
        let first = (0..3).find(|&k| mids[k].is_some() && mids[(k + 2) % 3].is_none()).unwrap_or(0);
        let [a, b, c] = [0, 1, 2].map(|k| t[(first + k) % 3]);
        match [0, 1, 2].map(|k| mids[(first + k) % 3]) {
            [Some(ab), Some(bc), Some(ca)] => out.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]),
            [Some(ab), Some(bc), None] => {
                out.push([ab, b, bc]);
                let at = |i: u32| self.vertices[i as usize];
                // the quadrangle a, ab, bc, c is cut along its shorter diagonal
                if square_distance(at(a), at(bc)) < square_distance(at(ab), at(c)) {
                    out.extend([[a, ab, bc], [a, bc, c]]);
                } else {
                    out.extend([[a, ab, c], [ab, bc, c]]);
                }
            }
            [Some(ab), ..] => out.extend([[a, ab, c], [ab, b, c]]),
            _ => out.push(t),
        }
    }
}

fn square_distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    (0..3).map(|k| (p[k] - q[k]).powi(2)).sum()
}

// Joins coinciding vertices and drops triangles that collapse.

/// Side of a cell of the search grid in tolerances: large enough that a search seldom needs a neighbour cell, small
/// enough that a cell holds few vertices.
const CELL_TOLERANCES: f64 = 8.0;

/// The kept vertices by their cell in space.
struct Grid {
    side_m: f64,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl Grid {
    /// Cell along one axis. Saturation far outside the grid only makes the search slower.
    #[expect(clippy::cast_possible_truncation, reason = "float-to-int casts saturate")]
    fn cell(&self, x: f64) -> i64 {
        (x / self.side_m).floor() as i64
    }

    /// The first of `kept` within `tolerance_m` of `v`.
    fn find(&self, v: [f64; 3], tolerance_m: f64, kept: &[[f64; 3]]) -> Option<u32> {
        let [xs, ys, zs] = v.map(|x| self.cell(x - tolerance_m)..=self.cell(x + tolerance_m));
        let columns = xs.flat_map(|x| ys.clone().map(move |y| [x, y]));
        let cells = columns.flat_map(|[x, y]| zs.clone().map(move |z| [x, y, z]));
        let known = cells.filter_map(|cell| self.cells.get(&cell)).flatten();
        let near = |k: &&u32| square_distance(kept[**k as usize], v) <= tolerance_m.powi(2);
        known.filter(near).min().copied()
    }

    fn push(&mut self, v: [f64; 3], vertex: u32) {
        let cell = v.map(|x| self.cell(x));
        self.cells.entry(cell).or_default().push(vertex);
    }
}

impl TriMesh {
    /// Only the triangles that `keep` marks, and the vertices they use.
    pub(super) fn only(&self, keep: &[bool]) -> Self {
        let marked = self.triangles.iter().zip(keep).filter(|(_, k)| **k);
        let triangles: Vec<[u32; 3]> = marked.map(|(&t, _)| t).collect();
        self.with_triangles(&triangles)
    }

    /// `triangles` on the vertices of this mesh, without those that nothing uses.
    pub(super) fn with_triangles(&self, triangles: &[[u32; 3]]) -> Self {
        let mut out = Self { vertices: Vec::new(), triangles: Vec::with_capacity(triangles.len()) };
        let mut renumbered: Vec<Option<u32>> = vec![None; self.vertices.len()];
        for t in triangles {
            out.triangles.push(t.map(|i| {
                *renumbered[i as usize].get_or_insert_with(|| {
                    out.vertices.push(self.vertices[i as usize]);
                    index(out.vertices.len() - 1)
                })
            }));
        }
        out
    }

    /// Joins vertices closer than `tolerance_m` to the first of them, drops triangles that lose a corner, and removes
    /// unused vertices. Also returns `(vertices joined, triangles dropped)`.
    ///
    /// A thin triangle with three distinct corners stays, even if its area is zero, because removing it would open the
    /// surface.
    ///
    /// # Panics
    /// If an index is out of range; [`super::checked`] tests the indices first.
    pub(crate) fn welded(&self, tolerance_m: f64) -> (Self, usize, usize) {
        let side_m = (CELL_TOLERANCES * tolerance_m).max(f64::MIN_POSITIVE.sqrt());
        let mut grid = Grid { side_m, cells: HashMap::new() };
        let mut kept: Vec<[f64; 3]> = Vec::new();
        let mut target: Vec<u32> = Vec::with_capacity(self.vertices.len());
        for &v in &self.vertices {
            target.push(grid.find(v, tolerance_m, &kept).unwrap_or_else(|| {
                let vertex = index(kept.len());
                grid.push(v, vertex);
                kept.push(v);
                vertex
            }));
        }
        let joined = self.vertices.len() - kept.len();
        let corners = self.triangles.iter().map(|t| t.map(|i| target[i as usize]));
        let triangles: Vec<[u32; 3]> = corners.filter(|&[a, b, c]| a != b && b != c && c != a).collect();
        let dropped = self.triangles.len() - triangles.len();
        let whole = Self { vertices: kept, triangles: Vec::new() };
        (whole.with_triangles(&triangles), joined, dropped)
    }
}

impl TriMesh {
    /// Lowest z of the surface above (x, y), m, by trying every triangle: an oracle for tests. `None` beside it.
    #[cfg(test)]
    pub(crate) fn underside_m(&self, [x, y]: [f64; 2]) -> Option<f64> {
        let mut lowest: Option<f64> = None;
        for t in 0..self.triangles.len() {
            let [a, b, c] = self.corners(t);
            let side = |p: [f64; 3], q: [f64; 3]| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
            let parts = [side(b, c), side(c, a), side(a, b)];
            let whole = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            let [u, v, w] = parts.map(|part| part / whole);
            if u >= 0.0 && v >= 0.0 && w >= 0.0 {
                let z = u * a[2] + v * b[2] + w * c[2];
                lowest = Some(lowest.map_or(z, |low| low.min(z)));
            }
        }
        lowest
    }

    /// Middle of an edge, m.
    pub(super) fn middle_m(&self, edge: [u32; 2]) -> [f64; 3] {
        let [p, q] = edge.map(|i| self.vertices[i as usize]);
        [0, 1, 2].map(|k| 0.5 * (p[k] + q[k]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cuboid;
    use approx::assert_relative_eq;

    /// A chain of turned pairs: member k is turned against member 0 if k is odd; a pair that says otherwise is found.
    #[test]
    fn unions_know_who_is_turned() {
        let mut unions = Unions::new(100);
        for k in (1..100).rev() {
            assert!(unions.join(k - 1, k, true));
        }
        for k in 0..100 {
            assert_eq!(unions.find(k), (0, k % 2 == 1));
        }
        assert!(unions.join(3, 10, true) && !unions.join(3, 10, false));
    }

    #[test]
    fn refining_keeps_the_solid() {
        let block = cuboid([0.1, 0.05, 0.02]);
        let fine = block.clone().refined(4e-3, |p, q| p[2].max(q[2]) <= 0.0);
        assert_eq!(fine.open_edges(), 0);
        assert!(fine.triangles.len() > 300, "{}", fine.triangles.len());
        assert_relative_eq!(fine.volume_m3(), block.volume_m3(), max_relative = 1e-12);
        assert_relative_eq!(fine.area_m2(), block.area_m2(), max_relative = 1e-12);
    }
}
