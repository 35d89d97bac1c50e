//! Closes holes where this does not change the surface that touches the skin.

use super::measure::{cross, dot, sub};
use super::polygon::{Point, signed_area_m2};
use super::sides::Sides;
use super::tri_mesh::{TriMesh, index};
use super::triangulate::triangulate;

/// Holes of at most this part of the mesh's extent are filled flat: 3 mm on an object of 60 mm, a fifth of a taxel.
/// What was lost there can stand out from the filling by about half of it.
const SMALL_FRACTION: f64 = 0.05;
/// Most of the surface that such fillings may make up, so that a sieve is not taken for a solid.
const MOST_FILLED_FRACTION: f64 = 0.02;
/// Holes narrower than this part of the extent, along a straight line, are slits beside a vertex that lies on a
/// neighbour's edge (T-junctions), and are filled whatever their length: 6 µm on 60 mm.
const SLIT_FRACTION: f64 = 1e-4;
/// Least cosine between up and the normal of the filling for a hole that counts as opening upward: 60°.
const UPWARD_COSINE: f64 = 0.5;
/// Height of the lid over a mesh that opens upward, above its highest point, as part of its extent: out of reach of a
/// press.
const LID_FRACTION: f64 = 0.25;
/// Longest hole that is triangulated, in edges. The time grows with the cube; several holes may take as long as one of
/// this length.
const MAX_EDGES: usize = 2000;

/// What was closed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Closed {
    /// Small holes and slits, filled flat.
    pub(super) filled: usize,
    /// Holes that open upwards, closed by walls and a lid above everything.
    pub(super) lids: usize,
}

/// A hole that is not closed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hole {
    /// Open edges in all.
    pub(super) open_edges: usize,
    /// Middle of one edge of the hole, m.
    pub(super) at_m: [f64; 3],
    /// Why the hole stays open.
    pub(super) why: &'static str,
}

/// Closes the holes of a mesh whose triangles agree: small ones are filled flat; around one that opens upward, walls go
/// straight up to a lid above everything.
///
/// Walls and lid do not change the lower envelope of a mesh that stands upright: the walls are vertical, and below each
/// point of the lid lies some triangle of the mesh, because a closed surface crosses each vertical line an even number
/// of times. When the mesh leans by θ, so do the walls: what sinks in by d then reaches d tan θ beyond the rim.
pub(super) fn close_holes(mesh: &mut TriMesh, sides: &Sides) -> Result<Closed, Hole> {
    let missing: Vec<[u32; 2]> = sides
        .edges()
        .filter_map(|edge| match edge {
            // the partner that is missing runs the other way
            [side] => Some(side.directed()).map(|[a, b]| [b, a]),
            _ => None,
        })
        .collect();
    let mut closed = Closed::default();
    let Some(&first) = missing.first() else {
        return Ok(closed);
    };
    let open = |edge: [u32; 2], why: &'static str, mesh: &TriMesh| Hole {
        open_edges: missing.len(),
        at_m: mesh.middle_m(edge),
        why,
    };
    let Some(loops) = loops(&missing, mesh.vertices.len()) else {
        return Err(open(first, "its border does not close", mesh));
    };
    let extent_m = mesh.extent_m();
    let lid_m = mesh.bounds().map_or(0.0, |(_, high)| high[2]) + LID_FRACTION * extent_m;
    let most_filled_m2 = MOST_FILLED_FRACTION * mesh.area_m2();
    let mut filled_m2 = 0.0;
    let mut cubes = 0.0;
    for ring in loops {
        let outline = Outline::of(mesh, &ring);
        let edge = [ring[0], ring[1]];
        cubes += cube(ring.len());
        if cubes > cube(MAX_EDGES) {
            return Err(open(
                edge,
                "its holes are as long to fill as one of more than 2000 edges; close them, or simplify their borders",
                mesh,
            ));
        }
        let slit = outline.width_m <= SLIT_FRACTION * extent_m;
        if slit || outline.extent_m <= SMALL_FRACTION * extent_m {
            filled_m2 += if slit { 0.0 } else { outline.area_m2() };
            if filled_m2 > most_filled_m2 {
                return Err(open(edge, "its small holes make up more than 2 % of the surface", mesh));
            }
            fill(mesh, &ring, &outline);
            closed.filled += 1;
        } else if outline.normal_m2[2] >= UPWARD_COSINE * outline.area_m2() {
            cover(mesh, &ring, lid_m);
            closed.lids += 1;
        } else {
            return Err(open(
                edge,
                "a hole wider than 5 % of the mesh opens sideways or downward, where it may touch (only one that opens \
                 upward can be closed without guessing)",
                mesh,
            ));
        }
    }
    Ok(closed)
}

/// n³, which is how the time to fill a hole of `edges` edges grows.
fn cube(edges: usize) -> f64 {
    (edges as f64).powi(3)
}

/// Simple closed loops of `edges`; `None` if some edge is in none. Where loops touch they are taken apart.
fn loops(edges: &[[u32; 2]], vertices: usize) -> Option<Vec<Vec<u32>>> {
    let mut sorted = edges.to_vec();
    sorted.sort_unstable();
    // the next unused edge of each vertex: they are used in their order
    let mut next = vec![usize::MAX; vertices];
    for (k, edge) in sorted.iter().enumerate().rev() {
        next[edge[0] as usize] = k;
    }
    let mut place: Vec<Option<usize>> = vec![None; vertices];
    let mut out = Vec::new();
    for start in 0..sorted.len() {
        let first = sorted[start][0] as usize;
        if next[first] > start {
            continue;
        }
        next[first] += 1;
        let mut path = vec![sorted[start][0]];
        place[path[0] as usize] = Some(0);
        let mut at = sorted[start][1];
        loop {
            if let Some(from) = place[at as usize] {
                let ring = path.split_off(from);
                ring.iter().for_each(|&v| place[v as usize] = None);
                if ring.len() < 3 {
                    return None;
                }
                out.push(ring);
                if path.is_empty() {
                    break;
                }
            }
            place[at as usize] = Some(path.len());
            path.push(at);
            let edge = sorted.get(next[at as usize]).filter(|edge| edge[0] == at)?;
            next[at as usize] += 1;
            at = edge[1];
        }
    }
    Some(out)
}

/// Size and direction of a loop.
struct Outline {
    /// Area times normal of the flat surface it spans, m² (Newell's formula).
    normal_m2: [f64; 3],
    /// Longest side of its box, m.
    extent_m: f64,
    /// Largest distance from the line between two points far apart, m.
    width_m: f64,
}

impl Outline {
    fn of(mesh: &TriMesh, ring: &[u32]) -> Self {
        let at = |i: usize| mesh.vertices[ring[i % ring.len()] as usize];
        let points = || (0..ring.len()).map(at);
        let mut normal_m2 = [0.0; 3];
        let (mut low, mut high) = (at(0), at(0));
        for i in 0..ring.len() {
            let n = cross(sub(at(i), at(0)), sub(at(i + 1), at(0)));
            for k in 0..3 {
                normal_m2[k] += 0.5 * n[k];
                low[k] = low[k].min(at(i)[k]);
                high[k] = high[k].max(at(i)[k]);
            }
        }
        let farthest = |from: [f64; 3]| {
            let square = |p: [f64; 3]| dot(sub(p, from), sub(p, from));
            points().fold(from, |best, p| if square(p) > square(best) { p } else { best })
        };
        let one = farthest(at(0));
        let other = farthest(one);
        let along = sub(other, one);
        let length_m = dot(along, along).sqrt().max(f64::MIN_POSITIVE);
        let aside = |p: [f64; 3]| {
            let n = cross(sub(p, one), along);
            dot(n, n).sqrt() / length_m
        };
        Self {
            normal_m2,
            extent_m: (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max),
            width_m: points().map(aside).fold(0.0, f64::max),
        }
    }

    fn area_m2(&self) -> f64 {
        dot(self.normal_m2, self.normal_m2).sqrt()
    }
}

/// Fills a loop with triangles between its own corners, seen along the normal of the surface it spans.
fn fill(mesh: &mut TriMesh, ring: &[u32], outline: &Outline) {
    if let [a, b, c] = *ring {
        mesh.triangles.push([a, b, c]);
        return;
    }
    // the two axes across the normal's largest component, in the order that keeps the direction
    let n = outline.normal_m2;
    let up = (0..3).fold(0, |best, k| if n[k].abs() > n[best].abs() { k } else { best });
    let (mut u, mut v) = ((up + 1) % 3, (up + 2) % 3);
    if n[up] < 0.0 {
        (u, v) = (v, u);
    }
    let points: Vec<Point> = ring
        .iter()
        .map(|&i| mesh.vertices[i as usize])
        .map(|p| [p[u], p[v]])
        .collect();
    append(mesh, ring, &points);
}

/// Triangles of the polygon `points`, whose corners are the vertices `ring`, in the direction of the loop.
fn append(mesh: &mut TriMesh, ring: &[u32], points: &[Point]) {
    let along = signed_area_m2(points) > 0.0;
    for corners in triangulate(points, &[]) {
        let [a, b, c] = corners.map(|i| ring[i]);
        mesh.triangles.push(if along { [a, b, c] } else { [a, c, b] });
    }
}

/// Walls from a loop straight up to `lid_m`, and a lid between them.
fn cover(mesh: &mut TriMesh, ring: &[u32], lid_m: f64) {
    let n = ring.len();
    let base = mesh.vertices.len();
    let points: Vec<[f64; 3]> = ring.iter().map(|&i| mesh.vertices[i as usize]).collect();
    mesh.vertices.extend(points.iter().map(|p| [p[0], p[1], lid_m]));
    let lid: Vec<u32> = (base..base + n).map(index).collect();
    for i in 0..n {
        let j = (i + 1) % n;
        let [p, q, above_p, above_q] = [ring[i], ring[j], lid[i], lid[j]];
        mesh.triangles.extend([[p, q, above_q], [p, above_q, above_p]]);
    }
    let flat: Vec<Point> = points.iter().map(|p| [p[0], p[1]]).collect();
    append(mesh, &lid, &flat);
}
