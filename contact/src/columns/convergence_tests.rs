//! The fields of columns against closed forms on four grids: error, and the order at which it falls.

use super::{WinklerConfig, WinklerLayer};
use crate::mesh::{TriMesh, cuboid, cylinder, revolve, sphere};
use crate::{ContactField as _, PosedMesh};
use approx::assert_relative_eq;
use spts_models::SkinLayout;
use std::f64::consts::{FRAC_PI_2, PI};

const K: f64 = 1e7;
const THICKNESS_M: f64 = 10.0;
const GRIDS: [usize; 4] = [4, 8, 16, 32];
const OFFSETS: u32 = 32;

fn layer(cells: usize) -> WinklerLayer {
    let config = WinklerConfig {
        stiffness_pa_per_m: K,
        thickness_m: THICKNESS_M,
        cells_per_taxel: cells,
        ..WinklerConfig::default()
    };
    WinklerLayer::new(config, &SkinLayout::default()).unwrap()
}

/// ∫ d dA and ∫ d² dA over the part of the faces that look down and lie below `depth_m` above the lowest point, by
/// clipping every triangle: exact for the mesh, whose facets thus leave the order alone.
fn moments(mesh: &TriMesh, depth_m: f64) -> [f64; 2] {
    let (mut first, mut second) = (0.0, 0.0);
    for t in &mesh.triangles {
        let corners = t.map(|i| {
            let [x, y, z] = mesh.vertices[i as usize];
            [x, y, depth_m - z]
        });
        let mut below = Vec::new();
        for (i, &p) in corners.iter().enumerate() {
            let q = corners[(i + 1) % 3];
            if p[2] >= 0.0 {
                below.push(p);
            }
            if p[2] * q[2] < 0.0 {
                let s = p[2] / (p[2] - q[2]);
                below.push([p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1]), 0.0]);
            }
        }
        for i in 2..below.len() {
            let [a, b, c] = [below[0], below[i - 1], below[i]];
            // down-looking faces run clockwise seen from above
            let area = -0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
            let area = area.max(0.0);
            let d = [a[2], b[2], c[2]];
            first += area * (d[0] + d[1] + d[2]) / 3.0;
            let sum = d[0] + d[1] + d[2];
            second += area * (sum * sum + d.iter().map(|d| d * d).sum::<f64>()) / 12.0;
        }
    }
    [first, second]
}

/// Force on a grid for every offset, relative to the exact one, root mean square; and the order fitted over the grids.
/// The law is K d + 0.98² K d²/δ_m (the next term is 1e-7 of it).
fn order(mesh: &TriMesh, depth_m: f64, drop_m: impl Fn(f64) -> f64) -> (f64, f64) {
    let [first, second] = moments(mesh, depth_m);
    let max_depth_m = 0.85 * THICKNESS_M;
    let exact_n = K * (first + 0.98 * 0.98 / max_depth_m * second);
    let mut points = Vec::new();
    let mut last = 0.0;
    for cells in GRIDS {
        let mut field = layer(cells);
        let cell_m = 0.015 / f64::from(u32::try_from(cells).unwrap());
        let mut square = 0.0;
        for i in 0..OFFSETS {
            // evenly spread over a taxel (R2 sequence)
            let at = |step: f64| 0.015 * ((f64::from(i) * step).fract() - 0.5);
            let position = [at(0.754_877_666), at(0.569_840_296), -depth_m];
            let response = field.respond(&PosedMesh::at_rest(mesh, position));
            square += (response.wrench.force_n[2] / exact_n - 1.0).powi(2);
            // the deepest centre is at most half a cell's diagonal from the deepest point
            let peak_pa = response.pressure_pa.iter().copied().fold(0.0, f64::max);
            let off_m = cell_m * 0.5_f64.sqrt();
            assert!(peak_pa <= K * depth_m * (1.0 + depth_m / max_depth_m));
            assert!(peak_pa >= K * (depth_m - drop_m(off_m)), "{peak_pa}");
        }
        last = (square / f64::from(OFFSETS)).sqrt();
        points.push([cell_m.ln(), last.ln()]);
    }
    let mean = |k: usize| points.iter().map(|p| p[k]).sum::<f64>() / 4.0;
    let (x, y) = (mean(0), mean(1));
    let slope = points.iter().map(|p| (p[0] - x) * (p[1] - y)).sum::<f64>()
        / points.iter().map(|p| (p[0] - x).powi(2)).sum::<f64>();
    (slope, last)
}

/// A root mean square over 32 offsets scatters by 1/√64 = 12 %, so a slope over three octaves by about
/// 0.12 · √2 / (3 ln 2) = 0.08; three of these.
const SCATTER: f64 = 0.25;

/// A load that vanishes linearly at its rim: the midpoint sum misses O(h²) (Euler–Maclaurin), or less where the rim is
/// curved. The closed forms of the smooth bodies hold to the facets' sag over the depth.
#[test]
fn round_bodies_converge_with_order_two() {
    let (radius_m, depth_m) = (0.0334, 3e-3);
    let ball = sphere(radius_m, 120, 128);
    let (slope, finest) = order(&ball, depth_m, |r| {
        radius_m - (radius_m * radius_m - r * r).sqrt() + 1.2e-5
    });
    assert!(
        slope >= 2.0 - SCATTER && finest < 1e-3,
        "sphere: order {slope}, {finest:e}"
    );
    // sag of a facet R (π/120)²/8 = 3e-6 m and r (1 − cos(π/128)) of 14 mm: 0.1 % and 0.1 % of the force
    let expected = PI * (radius_m * depth_m.powi(2) - depth_m.powi(3) / 3.0);
    assert_relative_eq!(moments(&ball, depth_m)[0], expected, max_relative = 3e-3);

    let cone = revolve(&[[0.0, 0.0], [0.03, 0.006], [0.0, 0.006]], 256);
    let (slope, finest) = order(&cone, depth_m, |r| 0.2 * r);
    assert!(
        slope >= 2.0 - SCATTER && finest < 1e-3,
        "cone: order {slope}, {finest:e}"
    );
    // area of a 256-gon: (π/256)² · 2/3 = 1e-4 short
    let expected = PI * depth_m.powi(3) / (3.0 * 0.2 * 0.2);
    assert_relative_eq!(moments(&cone, depth_m)[0], expected, max_relative = 2e-4);

    // lying along y, longer than the skin is wide
    let (s, c) = FRAC_PI_2.sin_cos();
    let lying = cylinder(radius_m, 0.4, 360).rotated([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]);
    let lying = lying.translated([0.0, 0.2, 0.0]).grounded();
    let (slope, finest) = cut_to_skin(&lying, depth_m, radius_m);
    assert!(
        slope >= 2.0 - SCATTER && finest < 1e-3,
        "cylinder: order {slope}, {finest:e}"
    );
}

/// The same for a cylinder across the whole skin, of which 0.15 m carry; per length (4/3) √(2R) δ^1.5 to the parabola's
/// 3 δ/(20 R) = 1.3 %.
fn cut_to_skin(lying: &TriMesh, depth_m: f64, radius_m: f64) -> (f64, f64) {
    // the part over the skin is a prism: moments of 0.15 m of its 0.4 m
    let share = 0.15 / 0.4;
    let expected = 4.0 / 3.0 * (2.0 * radius_m).sqrt() * depth_m.powf(1.5) * 0.15;
    assert_relative_eq!(moments(lying, depth_m)[0] * share, expected, max_relative = 1.5e-2);
    // a body whose ends lie on cells' borders: 0.15 m long, on the middle of the skin
    let short = lying.clone().scaled([1.0, share, 1.0]);
    order_across(&short, depth_m)
}

/// [`order`] with offsets along x only. The errors of the two straight rims add or cancel with the width in cells, so
/// the depth varies too, by ± a quarter: the width by ± a cell of the coarsest grid.
fn order_across(mesh: &TriMesh, depth_m: f64) -> (f64, f64) {
    let cases: Vec<[f64; 3]> = (0..OFFSETS)
        .map(|i| {
            let spread = |step: f64| (f64::from(i) * step).fract() - 0.5;
            let depth_m = depth_m * (1.0 + 0.5 * spread(0.754_877_666));
            let [first, second] = moments(mesh, depth_m);
            let exact_n = K * (first + 0.98 * 0.98 / (0.85 * THICKNESS_M) * second);
            [0.015 * spread(0.569_840_296), depth_m, exact_n]
        })
        .collect();
    let mut points = Vec::new();
    let mut last = 0.0;
    for cells in GRIDS {
        let mut field = layer(cells);
        let mut square = 0.0;
        for &[x, depth_m, exact_n] in &cases {
            let body = PosedMesh::at_rest(mesh, [x, 0.0, -depth_m]);
            let force_n = field.respond(&body).wrench.force_n[2];
            square += (force_n / exact_n - 1.0).powi(2);
        }
        last = (square / f64::from(OFFSETS)).sqrt();
        points.push(last);
    }
    // three octaves
    ((points[0] / points[3]).log2() / 3.0, last)
}

/// A load that ends at full height misses O(h): the cells its edges cut count whole or not at all.
#[test]
fn punch_converges_with_order_one() {
    let block = cuboid([0.0437, 0.0291, 0.02]);
    let (slope, finest) = order(&block, 1e-3, |_| 0.0);
    assert!((1.0 - SCATTER..1.6).contains(&slope), "order {slope}");
    // half a cell at each of two edges is what a side can be wrong by, of 29 mm
    assert!(finest < 0.015 / 32.0 / 0.0291, "{finest:e}");
    assert_relative_eq!(moments(&block, 1e-3)[0], 0.0437 * 0.0291 * 1e-3, max_relative = 1e-12);
}

/// A compliant punch on whole cells: p = δ / (1/K + 1/K_b). The curvature is below δ/δ_m = 1.2e-4; twice that is
/// allowed.
#[test]
fn compliant_punch_is_two_springs_in_series() {
    let block = cuboid([0.06, 0.03, 0.02]);
    for body_pa_per_m in [1e6, 1e7, 2e8] {
        let body = PosedMesh {
            stiffness_pa_per_m: body_pa_per_m,
            ..PosedMesh::at_rest(&block, [0.0, 0.0, -1e-3])
        };
        let mut field = layer(4);
        let response = field.respond(&body);
        let expected_pa = 1e-3 / (1.0 / K + 1.0 / body_pa_per_m);
        let peak_pa = response.pressure_pa.iter().copied().fold(0.0, f64::max);
        assert_relative_eq!(peak_pa, expected_pa, max_relative = 2.4e-4);
        assert_relative_eq!(
            response.wrench.force_n[2],
            expected_pa * 0.06 * 0.03,
            max_relative = 2.4e-4
        );
    }
}
