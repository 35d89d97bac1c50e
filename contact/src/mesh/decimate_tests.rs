//! Decimation against closed forms and against the original.

use super::repair_tests::{lowest_m, pass};
use super::*;

/// Deepest point below a sphere of `radius_m` of the triangles inscribed in it: the centre of the smallest circle
/// around a triangle, which is its circumcentre or, if it is obtuse, the middle of its longest side.
fn deepest_m(mesh: &TriMesh, radius_m: f64) -> f64 {
    let depth = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        let square = |p: [f64; 3], q: [f64; 3]| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>();
        let mut sides = [square(a, b), square(b, c), square(c, a)];
        sides.sort_by(f64::total_cmp);
        let [s, m, l] = sides;
        let n = mesh.area_vector_m2(t);
        let double = n.iter().map(|x| x * x).sum::<f64>();
        let circle = if l >= s + m {
            0.25 * l
        } else {
            s * m * l / (4.0 * double)
        };
        radius_m - (radius_m * radius_m - circle).sqrt()
    };
    (0..mesh.triangles.len()).map(depth).fold(0.0, f64::max)
}

/// New vertices are old ones and lie on the sphere, so that the depth of the new facets is known in closed form.
#[test]
fn a_fine_sphere_is_decimated_within_its_bound() {
    let radius_m = 0.03;
    let ball = sphere(radius_m, 160, 320);
    assert!(ball.triangles.len() > 100_000);
    let (mesh, report) = pass(&ball);
    assert_eq!(report.decimated_from, Some(ball.triangles.len()));
    assert_eq!(
        (mesh.triangles.len() <= SOFT_MAX_TRIANGLES, report.heavy),
        (true, false)
    );
    let said_m = report.decimation_error_m.unwrap();
    assert!(said_m > 0.0 && said_m <= MAX_DECIMATION_ERROR_M, "{said_m}");
    // the original lies below the sphere itself, by at most its own deepest facet; and the deepest point is missed by
    // at most half the original's spacing s, over which a depth changes by s²/8R
    let spacing_m = std::f64::consts::TAU * radius_m / 320.0;
    let slack_m = deepest_m(&ball, radius_m) + spacing_m * spacing_m / (8.0 * radius_m);
    let depth_m = deepest_m(&mesh, radius_m);
    assert!((said_m - depth_m).abs() <= slack_m, "{said_m} {depth_m} {slack_m}");
    // the volume lost is at most the area times the error
    assert!(mesh.volume_m3() > ball.volume_m3() - ball.area_m2() * said_m);
    let again = pass(&ball).0;
    assert!(again == mesh, "not deterministic");
}

/// A rough surface cannot be brought down to the target within the bound: it keeps more triangles rather than its
/// error.
#[test]
fn what_cannot_be_decimated_within_the_bound_stays_heavy() {
    let mut rough = sphere(0.03, 60, 120);
    for (k, v) in rough.vertices.iter_mut().enumerate() {
        let factor = if k % 2 == 0 { 1.02 } else { 0.98 };
        *v = [v[0] * factor, v[1] * factor, 0.03 + (v[2] - 0.03) * factor];
    }
    let (mesh, report) = pass(&rough);
    assert!(report.heavy && mesh.triangles.len() > SOFT_MAX_TRIANGLES);
    assert!(report.decimation_error_m.unwrap_or(0.0) <= MAX_DECIMATION_ERROR_M);
    assert!(report.notes().iter().any(|n| n.contains("slow contact")));
}

/// A million triangles, bumpy so that the decimation has something to keep, as a file has them. Oracle: the underside
/// of the original, found by trying every triangle.
#[test]
fn a_million_triangles_from_a_file() {
    let ball = sphere(0.03, 500, 1000).mapped(|v| {
        let bump = 1.0 + 0.01 * (200.0 * v[0]).sin() * (200.0 * v[1]).cos();
        [v[0] * bump, v[1] * bump, v[2]]
    });
    let (mesh, report) = read_stl(&super::stl_tests::binary(&ball), 1.0, "ball.stl").unwrap();
    assert_eq!(report.decimated_from, Some(ball.triangles.len()));
    assert_eq!(mesh.open_edges(), 0);
    // smooth on the scale of a millimetre: a few thousand facets follow it to 0.1 mm
    assert!(
        mesh.triangles.len() < 2 * SOFT_MAX_TRIANGLES,
        "{}",
        mesh.triangles.len()
    );
    let error_m = report.decimation_error_m.unwrap();
    assert!(error_m <= MAX_DECIMATION_ERROR_M, "{error_m}");
    // up to 10 mm from the lowest point the surface rises by at most tan(asin(1/3)) + 0.06 = 0.41, so that a distance e
    // between the surfaces is at most 1.1 e upright; the rest is for where the error was not sampled
    for [x, y] in [
        [0.0, 0.0],
        [0.004, 0.001],
        [-0.003, 0.005],
        [0.006, -0.007],
        [-0.0091, -0.002],
    ] {
        let (before, after) = (lowest_m(&ball, x, y), lowest_m(&mesh, x, y));
        assert!((before - after).abs() <= 1.2 * error_m, "({x}, {y}): {before} {after}");
    }
}
