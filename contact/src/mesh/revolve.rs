//! Solids of revolution about the z axis.

use super::polygon::Point;
use super::tri_mesh::{TriMesh, index};
use std::f64::consts::{PI, TAU};

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
#[must_use]
pub fn revolve(profile: &[Point], segments: usize) -> TriMesh {
    sweep(profile, segments, false)
}

/// Ring of revolution of the closed loop `section`: points (r, z), m, with r > 0, counter-clockwise in the (r, z)
/// plane.
#[must_use]
pub fn revolve_ring(section: &[Point], segments: usize) -> TriMesh {
    sweep(section, segments, true)
}

/// Sphere of `radius_m` that stands on z = 0, with `rings` bands from pole to pole and `segments` around the axis.
#[must_use]
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
