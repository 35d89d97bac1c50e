//! Solids: prisms with holes, blocks, cylinders, trays, and solids of revolution.

use super::polygon::{self, Point, triangulate};
use super::tri_mesh::{TriMesh, index};
use std::f64::consts::{PI, TAU};

/// Block with the given sides along x, y, z, m. It is centred on the origin in x and y and stands on z = 0.
pub fn cuboid(sides_m: [f64; 3]) -> TriMesh {
    extrude(&polygon::rectangle(sides_m[0], sides_m[1]), &[], sides_m[2])
}

/// Upright cylinder that stands on z = 0, as a prism with `sides` sides.
pub fn cylinder(radius_m: f64, height_m: f64, sides: usize) -> TriMesh {
    extrude(&polygon::circle(radius_m, sides), &[], height_m)
}

/// Prism over `outer` minus `holes`, from z = 0 to `height_m`. The holes go all the way through.
pub fn extrude(outer: &[Point], holes: &[Vec<Point>], height_m: f64) -> TriMesh {
    let mut mesh = TriMesh::default();
    cap(&mut mesh, outer, holes, 0.0, false);
    cap(&mut mesh, outer, holes, height_m, true);
    wall(&mut mesh, outer, 0.0, height_m, true);
    for hole in holes {
        wall(&mut mesh, hole, 0.0, height_m, false);
    }
    joined(&mesh)
}

/// Prism over `outer` from z = 0 to `height_m`, with a blind recess over `inner`, `recess_m` deep from below: a tray
/// upside down.
///
/// ```
/// use spts_contact::mesh::{extrude_recessed, polygon::rectangle};
///
/// // a tray of 2 mm walls, 8 mm deep
/// let tray = extrude_recessed(&rectangle(40e-3, 40e-3), &rectangle(36e-3, 36e-3), 10e-3, 8e-3);
/// let exact_m3 = 0.04 * 0.04 * 0.010 - 0.036 * 0.036 * 0.008;
/// assert!((tray.volume_m3() - exact_m3).abs() < 1e-15);
/// ```
pub fn extrude_recessed(outer: &[Point], inner: &[Point], height_m: f64, recess_m: f64) -> TriMesh {
    let mut mesh = TriMesh::default();
    cap(&mut mesh, outer, &[inner.to_vec()], 0.0, false);
    cap(&mut mesh, inner, &[], recess_m, false);
    cap(&mut mesh, outer, &[], height_m, true);
    wall(&mut mesh, outer, 0.0, height_m, true);
    wall(&mut mesh, inner, 0.0, recess_m, false);
    joined(&mesh)
}

/// Corners of caps and walls joined; exact copies, so any tolerance far below a feature will do.
fn joined(mesh: &TriMesh) -> TriMesh {
    mesh.welded(1e-9).0
}

fn cap(mesh: &mut TriMesh, outer: &[Point], holes: &[Vec<Point>], z_m: f64, up: bool) {
    let base = mesh.vertices.len();
    let points = outer.iter().chain(holes.iter().flatten());
    mesh.vertices.extend(points.map(|p| [p[0], p[1], z_m]));
    for [a, b, c] in triangulate(outer, holes) {
        let [a, b, c] = [base + a, base + b, base + c].map(index);
        mesh.triangles.push(if up { [a, b, c] } else { [a, c, b] });
    }
}

/// Vertical wall over `outline`, facing away from its inside (`outward`) or into it.
fn wall(mesh: &mut TriMesh, outline: &[Point], low_m: f64, high_m: f64, outward: bool) {
    let base = mesh.vertices.len();
    let n = outline.len();
    for p in outline {
        mesh.vertices.push([p[0], p[1], low_m]);
        mesh.vertices.push([p[0], p[1], high_m]);
    }
    let out = outward == (polygon::signed_area_m2(outline) > 0.0);
    for i in 0..n {
        let (here, next) = (base + 2 * i, base + 2 * ((i + 1) % n));
        let [a, b, c, d] = [here, next, next + 1, here + 1].map(index);
        if out {
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        } else {
            mesh.triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
}

// Solids of revolution about the z axis.

/// Solid of revolution of `profile`: points (r, z), m, from the lower to the upper point on the axis. The first and the
/// last must have r = 0. `segments` is the number of segments around the axis.
///
/// ```
/// use spts_contact::mesh::revolve;
///
/// // a cone of 10 mm radius and 30 mm height
/// let cone = revolve(&[[0.0, 0.0], [10e-3, 30e-3], [0.0, 30e-3]], 128);
/// let exact_m3 = std::f64::consts::PI * 10e-3_f64.powi(2) * 30e-3 / 3.0;
/// assert!((cone.volume_m3() / exact_m3 - 1.0).abs() < 1e-3);
/// ```
pub fn revolve(profile: &[Point], segments: usize) -> TriMesh {
    sweep(profile, segments, false)
}

/// Ring of revolution of the closed loop `section`: points (r, z), m, with r > 0, counter-clockwise in the (r, z)
/// plane.
pub fn revolve_ring(section: &[Point], segments: usize) -> TriMesh {
    sweep(section, segments, true)
}

/// Sphere of `radius_m` that stands on z = 0, with `rings` bands from pole to pole and `segments` around the axis.
pub fn sphere(radius_m: f64, rings: usize, segments: usize) -> TriMesh {
    let rings = rings.max(2);
    let mut profile: Vec<Point> = (0..=rings)
        .map(|i| {
            let (s, c) = (PI * i as f64 / rings as f64).sin_cos();
            [radius_m * s, radius_m * (1.0 - c)]
        })
        .collect();
    profile[0] = [0.0, 0.0];
    profile[rings] = [0.0, 2.0 * radius_m];
    revolve(&profile, segments)
}

fn sweep(profile: &[Point], segments: usize, closed: bool) -> TriMesh {
    let mut mesh = TriMesh::default();
    let n = profile.len();
    for k in 0..segments {
        let (s, c) = (TAU * k as f64 / segments as f64).sin_cos();
        mesh.vertices.extend(profile.iter().map(|p| [p[0] * c, p[0] * s, p[1]]));
    }
    let spans = if closed { n } else { n.saturating_sub(1) };
    for k in 0..segments {
        let (here, next) = (k * n, (k + 1) % segments * n);
        for i in 0..spans {
            let j = (i + 1) % n;
            let [a, b, c, d] = [here + i, next + i, next + j, here + j].map(index);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    // poles: all copies of a point on the axis coincide, and their triangles collapse
    mesh.welded(1e-9).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn block_has_its_volume_and_area() {
        let block = cuboid([2.0, 3.0, 4.0]);
        assert_relative_eq!(block.volume_m3(), 24.0, max_relative = 1e-12);
        assert_relative_eq!(block.area_m2(), 52.0, max_relative = 1e-12);
        assert_eq!((block.vertices.len(), block.triangles.len(), block.open_edges()), (8, 12, 0));
    }

    #[test]
    fn prism_with_hole_and_tray() {
        let (outer, inner) = (polygon::rectangle(4.0, 4.0), polygon::rectangle(2.0, 1.0));
        let pipe = extrude(&outer, std::slice::from_ref(&inner), 3.0);
        assert_relative_eq!(pipe.volume_m3(), 42.0, max_relative = 1e-12);
        assert_eq!(pipe.open_edges(), 0);
        let tray = extrude_recessed(&outer, &inner, 3.0, 0.5);
        assert_relative_eq!(tray.volume_m3(), 47.0, max_relative = 1e-12);
        assert_eq!(tray.open_edges(), 0);
    }

    #[test]
    fn clockwise_outlines_still_face_outward() {
        let mut outer = polygon::rectangle(1.0, 1.0);
        outer.reverse();
        assert_relative_eq!(extrude(&outer, &[], 1.0).volume_m3(), 1.0, max_relative = 1e-12);
        assert_eq!(extrude(&outer, &[], 1.0).open_edges(), 0);
    }

    /// Inscribed polyhedra converge with the square of the step: |error| ≤ (π/rings)²/… ; 1 % at 48 × 96 is 5× slack.
    #[test]
    fn sphere_volume_converges() {
        let exact = 4.0 / 3.0 * PI;
        let (coarse, fine) = (sphere(1.0, 12, 24), sphere(1.0, 48, 96));
        assert_relative_eq!(fine.volume_m3(), exact, max_relative = 1e-2);
        let order = ((exact - coarse.volume_m3()) / (exact - fine.volume_m3())).log(4.0);
        assert_relative_eq!(order, 2.0, epsilon = 0.1);
        assert_eq!(fine.open_edges(), 0);
        assert_relative_eq!(fine.bounds().unwrap().0[2], 0.0);
    }

    /// Pappus: volume = area × 2π × centroid radius; the polygon around loses sin(x)/x of it.
    #[test]
    fn ring_follows_pappus() {
        let ring = revolve_ring(&[[2.0, 0.0], [3.0, 0.0], [3.0, 1.0], [2.0, 1.0]], 256);
        let step = TAU / 256.0;
        assert_relative_eq!(ring.volume_m3(), TAU * 2.5 * step.sin() / step, max_relative = 1e-9);
        assert_eq!(ring.open_edges(), 0);
    }
}
