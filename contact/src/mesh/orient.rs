//! Orients the triangles of each part consistently, and outwards.

use super::measure::{cross, dot, sub};
use super::sides::{Sides, Unions};
use super::tri_mesh::{TriMesh, index};

/// Evaluations of a triangle spent on asking what lies inside what; beyond them boxes decide, which can only mistake a
/// part beside a bent one for a cavity.
const MAX_EVALUATIONS: usize = 30_000_000;
/// Only so many of the largest bodies are asked what they contain.
const MAX_CONTAINERS: usize = 256;

/// Why triangles cannot be made to agree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Disagreement {
    /// An edge with an odd number of triangles above one.
    Branching {
        /// Middle of the edge, m.
        at_m: [f64; 3],
        /// Triangles on it.
        triangles: usize,
    },
    /// On a closed path over the surface, a triangle meets itself turned over.
    OneSided {
        /// Middle of the edge at which it was noticed, m.
        at_m: [f64; 3],
    },
}

/// Turns triangles so that neighbours agree; in each connected part those in the minority. Returns the part of each
/// triangle, numbered from 0, and the number turned. Edges of more than two triangles do not connect.
pub(super) fn agree(mesh: &mut TriMesh, sides: &Sides) -> Result<(Vec<u32>, usize), Disagreement> {
    let mut unions = Unions::new(mesh.triangles.len());
    for edge in sides.edges() {
        if let [a, b] = edge {
            if !unions.join(a.triangle, b.triangle, a.rising == b.rising) {
                let at_m = mesh.middle_m(a.edge);
                return Err(Disagreement::OneSided { at_m });
            }
        } else if edge.len() > 1 && edge.len() % 2 == 1 {
            let at_m = mesh.middle_m(edge[0].edge);
            let triangles = edge.len();
            return Err(Disagreement::Branching { at_m, triangles });
        }
    }
    let n = mesh.triangles.len();
    let found: Vec<(u32, bool)> = (0..n).map(|t| unions.find(index(t))).collect();
    // members and turned members of the part that each triangle leads
    let mut counts = vec![[0_usize; 2]; n];
    for &(lead, turned) in &found {
        counts[lead as usize][0] += 1;
        counts[lead as usize][1] += usize::from(turned);
    }
    let mut number = vec![u32::MAX; n];
    let mut parts = Vec::with_capacity(n);
    let (mut next, mut changed) = (0, 0);
    for (t, &(lead, turned)) in found.iter().enumerate() {
        let lead = lead as usize;
        if number[lead] == u32::MAX {
            number[lead] = next;
            next += 1;
        }
        parts.push(number[lead]);
        let [all, against] = counts[lead];
        if turned == (2 * against <= all) {
            mesh.triangles[t].swap(1, 2);
            changed += 1;
        }
    }
    Ok((parts, changed))
}

/// Turns every closed part that is inside out, together with what it contains. A part that is inside out within another
/// is a cavity and stays. Returns the number of parts turned.
pub(super) fn turn_outward(mesh: &mut TriMesh, parts: &[u32]) -> usize {
    let bodies = bodies(mesh, parts);
    if bodies.iter().all(|b| b.volume_m3 >= 0.0) {
        return 0;
    }
    let turned: Vec<bool> = outermost(mesh, &bodies)
        .into_iter()
        .map(|outer| bodies[outer].volume_m3 < 0.0)
        .collect();
    for (t, &part) in mesh.triangles.iter_mut().zip(parts) {
        if turned[part as usize] {
            t.swap(1, 2);
        }
    }
    turned.into_iter().filter(|&t| t).count()
}

struct Body {
    triangles: Vec<u32>,
    volume_m3: f64,
    low: [f64; 3],
    high: [f64; 3],
}

fn bodies(mesh: &TriMesh, parts: &[u32]) -> Vec<Body> {
    let mut bodies: Vec<Body> = Vec::new();
    for (t, &part) in parts.iter().enumerate() {
        let corners = mesh.corners(t);
        if part as usize == bodies.len() {
            bodies.push(Body {
                triangles: Vec::new(),
                volume_m3: 0.0,
                low: corners[0],
                high: corners[0],
            });
        }
        let body = &mut bodies[part as usize];
        let first = body
            .triangles
            .first()
            .map_or(corners[0], |&f| mesh.corners(f as usize)[0]);
        let [a, b, c] = corners.map(|v| sub(v, first));
        body.volume_m3 += dot(a, cross(b, c)) / 6.0;
        body.triangles.push(index(t));
        for v in corners {
            body.low = [0, 1, 2].map(|k| body.low[k].min(v[k]));
            body.high = [0, 1, 2].map(|k| body.high[k].max(v[k]));
        }
    }
    bodies
}

/// For each body the largest that contains it, or itself.
fn outermost(mesh: &TriMesh, bodies: &[Body]) -> Vec<usize> {
    let mut by_size: Vec<usize> = (0..bodies.len()).collect();
    by_size.sort_by(|&a, &b| bodies[b].volume_m3.abs().total_cmp(&bodies[a].volume_m3.abs()));
    let mut left = MAX_EVALUATIONS;
    let mut out: Vec<usize> = (0..bodies.len()).collect();
    // bodies that no other contains, largest first
    let mut roots: Vec<usize> = Vec::new();
    for &i in &by_size {
        let inner = &bodies[i];
        let [a, b, c] = mesh.corners(inner.triangles[0] as usize);
        let point = [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0);
        let container = roots.iter().copied().take(MAX_CONTAINERS).find(|&j| {
            let outer = &bodies[j];
            let boxed = (0..3).all(|k| outer.low[k] <= inner.low[k] && inner.high[k] <= outer.high[k]);
            if !boxed || left < outer.triangles.len() {
                return boxed;
            }
            left -= outer.triangles.len();
            winding(mesh, &outer.triangles, point).abs() > 0.5
        });
        match container {
            Some(j) => out[i] = j,
            None => roots.push(i),
        }
    }
    out
}

/// How often the closed surface of `triangles` goes around `point`: ±1 inside, 0 outside.
///
/// Source: van Oosterom and Strackee, *The solid angle of a plane triangle*, IEEE Trans. Biomed. Eng. 30 (1983).
fn winding(mesh: &TriMesh, triangles: &[u32], point: [f64; 3]) -> f64 {
    let solid: f64 = triangles
        .iter()
        .map(|&t| {
            let [a, b, c] = mesh.corners(t as usize).map(|v| sub(v, point));
            let [la, lb, lc] = [a, b, c].map(|v| dot(v, v).sqrt());
            let below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
            2.0 * dot(a, cross(b, c)).atan2(below)
        })
        .sum();
    solid / (4.0 * std::f64::consts::PI)
}

impl TriMesh {
    /// Middle of an edge, m.
    pub(super) fn middle_m(&self, edge: [u32; 2]) -> [f64; 3] {
        let [p, q] = edge.map(|i| self.vertices[i as usize]);
        [0, 1, 2].map(|k| 0.5 * (p[k] + q[k]))
    }
}
