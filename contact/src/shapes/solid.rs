//! The closed solid over an underside.

use super::relief::Relief;
use super::triangulate::Plane;
use super::underside::Underside;
use crate::mesh::TriMesh;
use crate::mesh::polygon::Point;

/// Height of the flat top over the highest point of the underside, m. Not visible to the skin.
const THICKNESS_M: f64 = 10e-3;
/// Least area of a triangle of a wall's fan, as a share of that of a level one.
const LEAST_FAN: f64 = 0.1;

/// Prism over `loops` with a flat top and the underside `below`, which `relief` of the height `relief_m` is added to.
/// The underside's loops are the same ones, some sides divided; `places` has the places of their common points. Its
/// lowest point is at z = 0. `None` when loops touch or cross.
pub(super) fn solid(
    loops: &[Vec<Point>],
    below: &Underside,
    places: &[usize],
    relief: Option<(&Relief, f64)>,
) -> Option<TriMesh> {
    let points = &below.plane.points;
    let mut heights_m = below.heights_m.clone();
    if let Some((relief, relief_m)) = relief {
        for (z, bump_m) in heights_m.iter_mut().zip(relief.heights_m(points, relief_m)) {
            *z += bump_m;
        }
    }
    let low = heights_m.iter().copied().fold(f64::INFINITY, f64::min);
    let high = heights_m.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let top_m = high - low + THICKNESS_M;
    let mut lid = Plane::of(loops);
    let mut places = places.to_vec();
    if !fans_are_sound(&lid, &places, below, &heights_m, top_m + low) {
        let sides = below.plane.next.len();
        (lid.points, lid.next) = (points[..sides].to_vec(), below.plane.next.clone());
        places = (0..sides).collect();
    }
    let (under, over) = (below.plane.triangles()?, lid.triangles()?);
    let base = points.len();
    let index = |i: usize| u32::try_from(i).ok();
    let mut mesh = TriMesh::default();
    mesh.vertices.reserve(base + lid.points.len());
    mesh.vertices
        .extend(points.iter().zip(&heights_m).map(|(p, z)| [p[0], p[1], z - low]));
    mesh.vertices.extend(lid.points.iter().map(|p| [p[0], p[1], top_m]));
    mesh.triangles.reserve(under.len() + over.len() + 2 * lid.points.len());
    for [a, b, c] in under {
        mesh.triangles.push([index(a)?, index(c)?, index(b)?]);
    }
    for t in over {
        let [a, b, c] = t.map(|i| index(base + i));
        mesh.triangles.push([a?, b?, c?]);
    }
    for (i, (&j, &place)) in lid.next.iter().zip(&places).enumerate() {
        // a fan from the upper corner over the pieces of the side, and the rest of the wall
        let (mut low, end) = (place, places[j]);
        while low != end {
            let next = below.plane.next[low];
            mesh.triangles.push([index(low)?, index(next)?, index(base + i)?]);
            low = next;
        }
        mesh.triangles.push([index(end)?, index(base + j)?, index(base + i)?]);
    }
    Some(mesh)
}

/// Whether every side's wall can be a fan about the upper corner at its beginning: seen from there, its lower points
/// come one after the other. Those of a steep relief may not.
fn fans_are_sound(lid: &Plane, places: &[usize], below: &Underside, heights_m: &[f64], top_m: f64) -> bool {
    lid.next.iter().zip(places).enumerate().all(|(i, (&j, &place))| {
        let corner = lid.points[i];
        // distance from the corner along the side, and drop below it
        let seen = |k: usize| {
            let p = below.plane.points[k];
            let along_m = ((p[0] - corner[0]).powi(2) + (p[1] - corner[1]).powi(2)).sqrt();
            (along_m, top_m - heights_m[k])
        };
        let (mut low, end) = (place, places[j]);
        while low != end {
            let next = below.plane.next[low];
            let ((near, near_drop), (far, far_drop)) = (seen(low), seen(next));
            if far * near_drop - near * far_drop < LEAST_FAN * (far - near) * THICKNESS_M {
                return false;
            }
            low = next;
        }
        true
    })
}
