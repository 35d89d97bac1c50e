//! The fields of columns against closed forms: forces, orders of convergence, balances, preloads, and extremes.

use super::{Footprint, WinklerLayer};
use crate::foam::{Foam, FoamLaw};
use crate::mesh::polygon::circle;
use crate::mesh::{TriMesh, cuboid, cylinder, extrude, revolve, sphere};
use crate::objects::by_name;
use crate::{ContactField, EquilibriumError, Holder, Load, PosedMesh, QuasiStatic as _};
use approx::assert_relative_eq;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use spts_models::SkinLayout;
use std::f64::consts::{FRAC_PI_2, PI};

const K: f64 = 1e7;

/// So thick that densification vanishes (δ/δ_m < 1e-3).
fn thick() -> Foam {
    Foam { stiffness_pa_per_m: K, thickness_m: 10.0, ..Foam::default() }
}

fn winkler(config: Foam) -> WinklerLayer {
    WinklerLayer::new(config, &SkinLayout::default()).unwrap()
}

/// A thick layer with `cells` fine cells a taxel side.
fn layer(cells: usize) -> WinklerLayer {
    winkler(Foam { cells_per_taxel: cells, ..thick() })
}

/// Block over [x0, x1] × [y0, y1] that stands on z = 0.
fn plate(x: [f64; 2], y: [f64; 2]) -> TriMesh {
    let middle = [0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]), 0.0];
    cuboid([x[1] - x[0], y[1] - y[0], 10e-3]).translated(middle)
}

fn pressed(layer: &mut WinklerLayer, mesh: &TriMesh, position_m: [f64; 3]) -> (f64, f64) {
    let response = layer.respond(&PosedMesh::at_rest(mesh, position_m));
    let peak_pa = response.pressure_pa.iter().copied().fold(0.0, f64::max);
    (response.wrench.force_n[2], peak_pa)
}

/// Off-grid position: no symmetry helps the midpoint sum.
const X: f64 = 0.00313;
const Y: f64 = -0.00171;

/// A plate that covers whole cells is exact up to the vanishing curvature of the law, δ/δ_m = 1.2e-4.
#[test]
fn flat_punch_and_tilt() {
    let mesh = plate([-0.03, 0.03], [-0.015, 0.015]);
    let depth_m = 1e-3;
    let (force_n, peak_pa) = pressed(&mut layer(6), &mesh, [0.0, 0.0, -depth_m]);
    assert_relative_eq!(force_n, K * 0.06 * 0.03 * depth_m, max_relative = 2.5e-4);
    assert_relative_eq!(peak_pa, K * depth_m, max_relative = 2.5e-4);
    // tilted about y by θ, still wholly in contact: the mean depth stays, torque = −K θ ∫ x² dA
    let angle = 0.01_f64;
    let (s, c) = angle.sin_cos();
    let mut skin = layer(12);
    let body = PosedMesh {
        rotation: [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]],
        ..PosedMesh::at_rest(&mesh, [0.0, 0.0, -depth_m])
    };
    let wrench = skin.respond(&body).wrench;
    assert_relative_eq!(wrench.force_n[2], K * 0.06 * 0.03 * depth_m, max_relative = 1e-3);
    // torque about y is −∫ x p dA; midpoint sum of x² over n cells is low by 1/n² = 4e-4 (n = 48)
    let torque_nm = -K * angle.tan() * 0.03 * 0.06_f64.powi(3) / 12.0;
    assert_relative_eq!(wrench.torque_nm[1], torque_nm, max_relative = 2e-3);
}

/// Flat ring: nothing in the hole. Rim cells make the area good to about cell / width.
#[test]
fn ring_with_hole() {
    let mesh = extrude(&circle(0.031, 256), &[circle(0.0125, 256)], 10e-3);
    let mut skin = layer(24);
    let response = skin.respond(&PosedMesh::at_rest(&mesh, [X, Y, -1e-3]));
    let area_m2 = PI * (0.031_f64.powi(2) - 0.0125_f64.powi(2));
    assert_relative_eq!(response.wrench.force_n[2], K * area_m2 * 1e-3, max_relative = 5e-3);
    let [col, row] = [(0.075 + X) / 0.015 * 24.0, (0.075 - Y) / 0.015 * 24.0];
    #[expect(clippy::cast_possible_truncation, reason = "positive and small")]
    let centre = row as usize * 240 + col as usize;
    assert!(response.pressure_pa[centre] < f64::MIN_POSITIVE);
}

/// Half of the plate hangs over the border at x = 75 mm: half of the force.
#[test]
fn partly_beside_the_skin() {
    let mesh = plate([-0.03, 0.03], [-0.015, 0.015]);
    let (force_n, _) = pressed(&mut layer(6), &mesh, [0.075, 0.0, -1e-3]);
    assert_relative_eq!(force_n, 0.5 * K * 0.06 * 0.03 * 1e-3, max_relative = 2.5e-4);
}

/// A concave underside (two feet, arch between) presses only with the feet, and the deeper of two layers counts.
#[test]
fn concave_and_stacked() {
    let foot = plate([-0.03, -0.015], [-0.015, 0.015]);
    let other = plate([0.015, 0.03], [-0.015, 0.015]);
    let roof = plate([-0.03, 0.03], [-0.015, 0.015]).translated([0.0, 0.0, 2e-4]);
    let mesh = foot.merged(&other).merged(&roof);
    let (force_n, _) = pressed(&mut layer(6), &mesh, [0.0, 0.0, -1e-3]);
    let expected_n = K * (2.0 * 0.015 * 0.03 * 1e-3 + 0.03 * 0.03 * 8e-4);
    assert_relative_eq!(force_n, expected_n, max_relative = 2.5e-4);
}

/// Kelvin–Voigt: p = K (δ + τ v) for a plate that sinks at v; the default foam stays finite far beyond its thickness.
#[test]
fn damping_and_depth_beyond_the_foam() {
    let mesh = plate([-0.015, 0.015], [-0.015, 0.015]);
    let mut skin = layer(6);
    let body = PosedMesh { velocity_m_per_s: [0.0, 0.0, -1.0], ..PosedMesh::at_rest(&mesh, [0.0, 0.0, -1e-3]) };
    let force_n = skin.respond(&body).wrench.force_n[2];
    let tau_s = Foam::default().damping_s;
    assert_relative_eq!(force_n, K * 9e-4 * (1e-3 + tau_s), max_relative = 1e-3);
    let mut foam = winkler(Foam::default());
    let (shallow_n, _) = pressed(&mut foam, &mesh, [0.0, 0.0, -3e-3]);
    let (deep_n, _) = pressed(&mut foam, &mesh, [0.0, 0.0, -12e-3]);
    assert!(deep_n > 4.0 * shallow_n && deep_n.is_finite());
}

// The fields of columns against closed forms on four grids: error, and the order at which it falls.

const THICKNESS_M: f64 = 10.0;
const GRIDS: [usize; 4] = [4, 8, 16, 32];
const OFFSETS: u32 = 32;

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

/// Place (x, y) of a body and its depth, m.
type Case = [f64; 3];

/// Places spread evenly over a taxel (R2 sequence), all at one depth.
fn places(depth_m: f64) -> Vec<Case> {
    let at = |i: u32, step: f64| 0.015 * ((f64::from(i) * step).fract() - 0.5);
    let place = |i| [at(i, 0.754_877_666), at(i, 0.569_840_296), depth_m];
    (0..OFFSETS).map(place).collect()
}

/// Force on a grid for every case, relative to the exact one, which is that of `share` of the mesh, root mean square;
/// and the order fitted over the grids. The law is K d + 0.98² K d²/δ_m (the next term is 1e-7 of it).
fn order(mesh: &TriMesh, share: f64, cases: &[Case], drop_m: impl Fn(f64) -> f64) -> (f64, f64) {
    let max_depth_m = 0.85 * THICKNESS_M;
    let exact_n = |depth_m: f64| {
        let [first, second] = moments(mesh, depth_m);
        share * K * (first + 0.98 * 0.98 / max_depth_m * second)
    };
    let exact_n: Vec<f64> = cases.iter().map(|case| exact_n(case[2])).collect();
    let mut points = Vec::new();
    let mut last = 0.0;
    for cells in GRIDS {
        let mut field = layer(cells);
        let cell_m = 0.015 / cells as f64;
        let mut square = 0.0;
        for (&[x, y, depth_m], exact_n) in cases.iter().zip(&exact_n) {
            let (force_n, peak_pa) = pressed(&mut field, mesh, [x, y, -depth_m]);
            square += (force_n / exact_n - 1.0).powi(2);
            // the deepest centre is at most half a cell's diagonal from the deepest point
            let off_m = cell_m * 0.5_f64.sqrt();
            assert!(peak_pa <= K * depth_m * (1.0 + depth_m / max_depth_m));
            assert!(peak_pa >= K * (depth_m - drop_m(off_m)), "{peak_pa}");
        }
        last = (square / cases.len() as f64).sqrt();
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
    let (radius_m, depth_m) = (0.0334_f64, 3e-3_f64);
    let round = |r: f64| radius_m - (radius_m * radius_m - r * r).sqrt() + 1.2e-5;
    let ball = sphere(radius_m, 120, 128);
    // sag of a facet R (π/120)²/8 = 3e-6 m and r (1 − cos(π/128)) of 14 mm: 0.1 % and 0.1 % of the force
    let expected = PI * (radius_m * depth_m.powi(2) - depth_m.powi(3) / 3.0);
    assert_relative_eq!(moments(&ball, depth_m)[0], expected, max_relative = 3e-3);
    // area of a 256-gon: (π/256)² · 2/3 = 1e-4 short
    let cone = revolve(&[[0.0, 0.0], [0.03, 0.006], [0.0, 0.006]], 256);
    let expected = PI * depth_m.powi(3) / (3.0 * 0.2 * 0.2);
    assert_relative_eq!(moments(&cone, depth_m)[0], expected, max_relative = 2e-4);
    // lying along y, longer than the skin is wide: 0.15 m of its 0.4 m carry, per length (4/3) √(2R) δ^1.5 to the
    // parabola's 3 δ/(20 R) = 1.3 %
    let (s, c) = FRAC_PI_2.sin_cos();
    let lying = cylinder(radius_m, 0.4, 360).rotated([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]);
    let lying = lying.translated([0.0, 0.2, 0.0]).grounded();
    let share = 0.15 / 0.4;
    let expected = 4.0 / 3.0 * (2.0 * radius_m).sqrt() * depth_m.powf(1.5) * 0.15;
    assert_relative_eq!(moments(&lying, depth_m)[0] * share, expected, max_relative = 1.5e-2);
    // the errors of its two straight rims add or cancel with the width in cells, so the depth varies too, by ± a
    // quarter: the width by ± a cell of the coarsest grid
    let spread = places(1.0).into_iter().map(|[x, y, _]| [y, 0.0, depth_m * (1.0 + 0.5 * x / 0.015)]);
    let across: Vec<Case> = spread.collect();
    let slope = |r: f64| 0.2 * r;
    type Drop<'a> = &'a dyn Fn(f64) -> f64;
    let all: [(&str, &TriMesh, f64, &[Case], Drop<'_>); 3] = [
        ("sphere", &ball, 1.0, &places(depth_m), &round),
        ("cone", &cone, 1.0, &places(depth_m), &slope),
        ("cylinder", &lying, share, &across, &round),
    ];
    for (name, mesh, share, cases, drop_m) in all {
        let (order, finest) = order(mesh, share, cases, drop_m);
        assert!(order >= 2.0 - SCATTER && finest < 1e-3, "{name}: order {order}, {finest:e}");
    }
}

/// The cells that a punch's edges cut count in part, so its force is exact on every grid, wherever it is: to the next
/// term of the law, 1e-7.
#[test]
fn a_punch_is_exact_on_every_grid() {
    let block = cuboid([0.0437, 0.0291, 0.02]);
    assert_relative_eq!(moments(&block, 1e-3)[0], 0.0437 * 0.0291 * 1e-3, max_relative = 1e-12);
    let [first, second] = moments(&block, 1e-3);
    let exact_n = K * (first + 0.98 * 0.98 / (0.85 * THICKNESS_M) * second);
    for cells in GRIDS {
        let mut field = layer(cells);
        for [x, y, depth_m] in places(1e-3) {
            let (force_n, _) = pressed(&mut field, &block, [x, y, -depth_m]);
            assert_relative_eq!(force_n, exact_n, max_relative = 1e-6);
        }
    }
}

/// A compliant punch on whole cells: p = δ / (1/K + 1/K_b). The curvature is below δ/δ_m = 1.2e-4; twice that is
/// allowed.
#[test]
fn compliant_punch_is_two_springs_in_series() {
    let block = cuboid([0.06, 0.03, 0.02]);
    for body_pa_per_m in [1e6, 1e7, 2e8] {
        let body = PosedMesh { stiffness_pa_per_m: body_pa_per_m, ..PosedMesh::at_rest(&block, [0.0, 0.0, -1e-3]) };
        let mut field = layer(4);
        let response = field.respond(&body);
        let expected_pa = 1e-3 / (1.0 / K + 1.0 / body_pa_per_m);
        let peak_pa = response.pressure_pa.iter().copied().fold(0.0, f64::max);
        assert_relative_eq!(peak_pa, expected_pa, max_relative = 2.4e-4);
        assert_relative_eq!(response.wrench.force_n[2], expected_pa * 0.06 * 0.03, max_relative = 2.4e-4);
    }
}

// A body on foam that is compressed already.

const FLAT_M: f64 = 40e-3;

fn strains(of: impl Fn(usize) -> f64) -> Vec<f64> {
    (0..100).map(of).collect()
}

/// The law of the foam under a rigid body.
fn law(c: &Foam) -> FoamLaw {
    FoamLaw::new(c.stiffness_pa_per_m, c.max_strain * c.thickness_m, f64::INFINITY)
}

/// The rest pressure is the foam's law at the strain, K h ε / (1 − ε/ε_max) as long as the solid in series gives way by
/// little: its share is p/(50 K) of ε h, 2.4 % at ε = 0.1 and less below.
#[test]
fn rest_pressure_is_the_foams_law_at_the_strain() {
    let config = Foam::default();
    let mut layer = winkler(config);
    let strain = strains(|k| 1e-3 * k as f64);
    let rest_pa = layer.preload(&strain).unwrap();
    for (strain, rest_pa) in strain.iter().zip(&rest_pa) {
        assert_relative_eq!(*rest_pa, law(&config).pressure_pa(strain * config.thickness_m));
        let modulus_pa = config.stiffness_pa_per_m * config.thickness_m;
        let closed_pa = modulus_pa * strain / (1.0 - strain / config.max_strain);
        assert_relative_eq!(*rest_pa, closed_pa, max_relative = 0.025);
    }
}

/// A rigid flat body that sinks in by d adds f(ε h + d) − f(ε h) on every cell: more than on fresh foam, since the law
/// stiffens. To the rounding of a difference of two numbers ten times as large.
#[test]
fn a_body_adds_what_the_stiffened_foam_gives() {
    let config = Foam::default();
    let mesh = cuboid([FLAT_M, FLAT_M, 5e-3]);
    let low_m = mesh.bounds().unwrap().0[2];
    let depth_m = 0.8e-3;
    let body = PosedMesh::at_rest(&mesh, [0.0, 0.0, -low_m - depth_m]);
    let force_n = |strain: f64| {
        let mut layer = winkler(config);
        layer.preload(&strains(|_| strain)).unwrap();
        layer.respond(&body).wrench.force_n[2]
    };
    let fresh_n = winkler(config).respond(&body).wrench.force_n[2];
    let area_m2 = fresh_n / law(&config).pressure_pa(depth_m);
    for strain in [0.02, 0.08, 0.3] {
        let start_m = strain * config.thickness_m;
        let added_pa = law(&config).pressure_pa(start_m + depth_m) - law(&config).pressure_pa(start_m);
        assert_relative_eq!(force_n(strain), added_pa * area_m2, max_relative = 1e-11);
        assert!(force_n(strain) > fresh_n);
    }
}

/// A soft surface in series gives way to what is added alone: δ = d_foam + (p − p₀)/K_b.
#[test]
fn a_soft_body_gives_way_to_what_is_added() {
    let config = Foam::default();
    let mesh = cuboid([FLAT_M, FLAT_M, 5e-3]);
    let low_m = mesh.bounds().unwrap().0[2];
    let (strain, depth_m, body_pa_per_m) = (0.1, 1e-3, 2e7);
    let mut layer = winkler(config);
    let rest_pa = layer.preload(&strains(|_| strain)).unwrap()[0];
    let body =
        PosedMesh { stiffness_pa_per_m: body_pa_per_m, ..PosedMesh::at_rest(&mesh, [0.0, 0.0, -low_m - depth_m]) };
    let answer = layer.respond(&body);
    let added_pa = answer.pressure_pa.iter().copied().fold(0.0, f64::max);
    let foam_m = depth_m - added_pa / body_pa_per_m;
    let expected_pa = law(&config).pressure_pa(strain * config.thickness_m + foam_m);
    assert_relative_eq!(rest_pa + added_pa, expected_pa, max_relative = 1e-11);
}

/// A preload of nothing changes no bit, of either field.
#[test]
fn no_preload_is_the_flat_skin() {
    let mesh = cuboid([FLAT_M, 25e-3, 5e-3]);
    let low_m = mesh.bounds().unwrap().0[2];
    let body = PosedMesh::at_rest(&mesh, [3e-3, -2e-3, -low_m - 1e-3]);
    let load = load(9.0, [3e-3, -2e-3], Holder::Rigid);
    let answers = |preloaded: bool| {
        let (mut layer, mut footprint) = (winkler(Foam::default()), footprint(Foam::default()));
        if preloaded {
            for field in [&mut layer as &mut dyn ContactField, &mut footprint] {
                assert_eq!(field.preload(&[0.0; 100]), Some(vec![0.0; 100]));
            }
        }
        let stepped = layer.respond(&body).pressure_pa.to_vec();
        let balanced = footprint.quasi_static().unwrap().carry(&body, &load).unwrap();
        (stepped, balanced.response.pressure_pa.to_vec())
    };
    assert_eq!(answers(true), answers(false));
}

/// A balanced body on uneven preload carries its force by what it adds.
#[test]
fn a_balance_on_uneven_preload_carries_the_force() {
    let skin = SkinLayout::default();
    let mesh = cuboid([FLAT_M, FLAT_M, 5e-3]);
    let mut field = footprint(Foam::default());
    field.preload(&strains(|k| if k % 3 == 0 { 0.08 } else { 0.0 })).unwrap();
    let load = load(12.0, [0.0, 0.0], Holder::Rigid);
    let body = PosedMesh::at_rest(&mesh, [0.0; 3]);
    let cell_m = skin.pitch_m() / field.cells_per_taxel() as f64;
    let balance = field.quasi_static().unwrap().carry(&body, &load).unwrap();
    let force_n = balance.response.pressure_pa.iter().sum::<f64>() * cell_m * cell_m;
    // the balance ends at 1e-12 of the force, and a sum of some thousand cells rounds by less
    assert_relative_eq!(force_n, load.force_n, max_relative = 1e-11);
}

// The quasi-static level against closed forms and against the sums it has to fulfil.

fn footprint(config: Foam) -> Footprint {
    Footprint::new(config, &SkinLayout::default()).unwrap()
}

fn load(force_n: f64, axis_m: [f64; 2], holder: Holder) -> Load {
    Load { force_n, axis_m, holder, from: None }
}

fn elastic(k: f64) -> Holder {
    Holder::Elastic { stiffness_nm_per_rad: [[k, 0.0], [0.0, k]], rest_rad: [0.0; 2] }
}

/// 60 × 30 mm block on whole cells (24 × 12), axis e beside its middle, wholly in contact: δ = F/(K A) and, the
/// pressure's moment about the axis being −F e − K I θ, θ = −F e/(k + K I) about y (and likewise about x). I is the sum
/// over the cells' centres. Stiffening is δ/δ_m = 1.3e-4 of the pressure; three times that is allowed.
#[test]
fn tilted_block_in_closed_form() {
    let mesh = cuboid([0.06, 0.03, 0.02]);
    let (force_n, off, k) = (20.0, [1.5e-3, -1e-3], 40.0);
    let body = PosedMesh::at_rest(&mesh, [0.0; 3]);
    let mut field = footprint(thick());
    let balance = field.carry(&body, &load(force_n, off, elastic(k))).unwrap();
    let inertia = |n: f64, long: f64, wide: f64| long.powi(3) * wide / 12.0 * (1.0 - 1.0 / (n * n));
    let (ix, iy) = (inertia(12.0, 0.03, 0.06), inertia(24.0, 0.06, 0.03));
    // about the axis: centre of the block at −e, with depth δ at the centre carrying F
    let (tx, ty) = (-off[1] * force_n / (k + K * ix), off[0] * force_n / (k + K * iy));
    assert_relative_eq!(balance.seat.tilt_rad[0], tx, max_relative = 4e-4);
    assert_relative_eq!(balance.seat.tilt_rad[1], ty, max_relative = 4e-4);
    // the block's own middle is lower than its origin's height by the tilts
    let middle_m = balance.seat.height_m - tx * off[1] + ty * off[0];
    assert_relative_eq!(-middle_m, force_n / (K * 0.06 * 0.03), max_relative = 4e-4);
    assert_relative_eq!(balance.response.wrench.force_n[2], force_n, max_relative = 1e-11);
    // a rigid holder lets it sink only
    let balance = field.carry(&body, &load(force_n, off, Holder::Rigid)).unwrap();
    assert!(balance.seat.tilt_rad.iter().all(|t| t.abs() <= 0.0));
    assert_relative_eq!(-balance.seat.height_m, force_n / (K * 0.06 * 0.03), max_relative = 4e-4);
}

/// In the pose found, without tilt, the Winkler layer at rest answers with the same pressure, bit for bit, and the same
/// wrench up to the round-off of its sums.
#[test]
fn same_pressure_as_winkler() {
    let mesh = sphere(0.0334, 24, 48);
    let body = PosedMesh { stiffness_pa_per_m: 2e7, ..PosedMesh::at_rest(&mesh, [0.0031, -0.0017, 0.0]) };
    let config = Foam::default();
    let mut field = footprint(config);
    let balance = field.carry(&body, &load(20.0, [0.0031, -0.0017], Holder::Rigid)).unwrap();
    let mut layer = winkler(config);
    let com_m = balance.position_m;
    let there = PosedMesh { position_m: balance.position_m, centre_of_mass_m: com_m, ..body };
    let expected = layer.respond(&there);
    for (a, b) in balance.response.pressure_pa.iter().zip(expected.pressure_pa) {
        assert_relative_eq!(*a, *b, max_relative = 1e-12);
    }
    assert_relative_eq!(expected.wrench.force_n[2], 20.0, max_relative = 1e-11);
}

/// A warm start ends where a cold one does: the potential has one minimum.
#[test]
fn start_does_not_matter() {
    let mesh = (by_name("T").unwrap().build)();
    let body = PosedMesh::at_rest(&mesh, [0.004, -0.003, 0.0]);
    let mut field = footprint(Foam::default());
    let mut cold = load(20.0, [0.004, -0.003], elastic(300.0));
    let far = field.carry(&body, &Load { force_n: 2.0, ..cold }).unwrap().seat;
    let expected = field.carry(&body, &cold).unwrap().seat;
    cold.from = Some(far);
    let found = field.carry(&body, &cold).unwrap().seat;
    // 1e-12 of 20 N left, on some 1e4 N/m
    assert!((found.height_m - expected.height_m).abs() < 1e-13);
    for i in 0..2 {
        assert!((found.tilt_rad[i] - expected.tilt_rad[i]).abs() < 1e-11);
    }
}

/// The origin's height does not matter: 0.1 m above the face, or on it, any force is balanced to 1e-12 of itself, on
/// the softest and the stiffest skin. K A = 1e9 Pa/m · 85 × 70 mm = 6e6 N/m makes 1e-10 N of one rounding of z = 0.1 m
/// (ulp 1.4e-17 m), and 1e-12 of 0.2 N is 2e-13 N. The pressure is the same to what rounding the vertices (half that
/// ulp) does to a depth F/(K A): 7e-18 m of 3e-8 m for K = 1.5e7 Pa/m, below 1e-9.
#[test]
fn origin_far_from_the_face() {
    let near = cuboid([0.085, 0.07, 0.01]);
    for k in [1e4, 1.5e7, 1e9] {
        let config = Foam { stiffness_pa_per_m: k, ..Foam::default() };
        for (force_n, holder) in
            [(0.2, Holder::Rigid), (0.2, elastic(300.0)), (2e-3, elastic(300.0)), (50.0, elastic(1e3))]
        {
            let mut pressures = Vec::new();
            for lift_m in [0.0, 0.1, -0.1] {
                let mesh = near.clone().translated([0.0, 0.0, lift_m]);
                let body = PosedMesh::at_rest(&mesh, [0.004, -0.003, 0.0]);
                let mut field = footprint(config);
                let cold = load(force_n, [0.004, -0.003], holder);
                let balance = field.carry(&body, &cold).unwrap();
                assert_relative_eq!(balance.response.wrench.force_n[2], force_n, max_relative = 2e-12);
                pressures.push(balance.response.pressure_pa.iter().copied().fold(0.0, f64::max));
                let from = Some(balance.seat);
                let warm = field.carry(&body, &Load { from, ..cold }).unwrap();
                assert_relative_eq!(warm.response.wrench.force_n[2], force_n, max_relative = 2e-12);
            }
            if k <= 1.5e7 && force_n >= 0.2 {
                assert_relative_eq!(pressures[0], pressures[1], max_relative = 1e-9);
                assert_relative_eq!(pressures[0], pressures[2], max_relative = 1e-9);
            }
        }
    }
}

/// The depth at which a force is given up does not depend on where the search starts. The deepest pose, 7 cm on
/// K = 1e7 Pa/m, carries K A δ/(1 − δ/8.5 m) = 635 N.
#[test]
fn depth_limit_holds_for_any_start() {
    let mesh = cuboid([0.03, 0.03, 0.02]);
    let body = PosedMesh::at_rest(&mesh, [0.0; 3]);
    let mut field = footprint(thick());
    for holder in [Holder::Rigid, elastic(300.0)] {
        let cold = load(650.0, [0.0; 2], holder);
        let near = field.carry(&body, &Load { force_n: 600.0, ..cold }).unwrap().seat;
        for from in [None, Some(near)] {
            let error = field.carry(&body, &Load { from, ..cold }).unwrap_err();
            let EquilibriumError::Force { reached_n, depth_m, .. } = error else { panic!("{error}") };
            assert_relative_eq!(depth_m, 0.07, max_relative = 1e-12);
            assert_relative_eq!(reached_n, 635.0, max_relative = 1e-3);
        }
    }
}

#[test]
fn what_cannot_be_carried() {
    let mesh = cuboid([0.03, 0.03, 0.02]);
    let mut field = footprint(thick());
    let body = |x| PosedMesh::at_rest(&mesh, [x, 0.0, 0.0]);
    let error = field.carry(&body(0.3), &load(5.0, [0.3, 0.0], Holder::Rigid)).unwrap_err();
    assert!(error.to_string().contains("lies beside the skin"), "{error}");
    // 9e-4 m² at 7 cm: less than 640 N
    let error = field.carry(&body(0.0), &load(1e3, [0.0; 2], Holder::Rigid)).unwrap_err();
    assert!(matches!(error, EquilibriumError::Force { .. }), "{error}");
    // 30 mm beside the middle of a block that ends at 15 mm, hardly held
    let error = field.carry(&body(0.0), &load(20.0, [0.03, 0.0], elastic(1e-3))).unwrap_err();
    assert!(error.to_string().contains("it tips over"), "{error}");
    for force_n in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = field.carry(&body(0.0), &load(force_n, [0.0; 2], Holder::Rigid)).unwrap_err();
        assert!(error.to_string().contains("is outside (0, ∞) N"), "{error}");
    }
}

fn any_mesh(kind: usize) -> TriMesh {
    match kind {
        0 => (by_name("T").unwrap().build)(),
        1 => sphere(0.03, 16, 24),
        2 => (by_name("tape").unwrap().build)(),
        _ => cuboid([0.04, 0.02, 0.01]),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(7), ..ProptestConfig::with_cases(48) })]
    /// Force and moments, summed anew from the pressure, balance load and holder.
    #[test]
    fn balances_any_body(
        kind in 0..4_usize,
        place in prop::array::uniform2(-0.07..0.07_f64),
        tilt in prop::array::uniform2(-0.05..0.05_f64),
        force_n in 0.5..60.0_f64,
        k in 100.0..3000.0_f64,
        cells in 1..7_usize,
    ) {
        let mesh = any_mesh(kind);
        let skin = SkinLayout::default();
        let mut field = Footprint::new(Foam { cells_per_taxel: cells, ..Foam::default() }, &skin).unwrap();
        let (s, c) = tilt[0].sin_cos();
        let body = PosedMesh {
            rotation: [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]],
            ..PosedMesh::at_rest(&mesh, [place[0], place[1], 0.0])
        };
        let holder = Holder::Elastic { stiffness_nm_per_rad: [[k, 0.1 * k], [0.1 * k, 0.7 * k]], rest_rad: [0.1 * tilt[0], 0.1 * tilt[1]] };
        let balance = match field.carry(&body, &load(force_n, place, holder)) {
            Ok(balance) => balance,
            Err(error) => {
                let said = error.to_string();
                let expected = ["beside the skin", "tips over", "N are needed"].iter().any(|part| said.contains(part));
                prop_assert!(expected, "{said}");
                return Ok(());
            }
        };
        let n = skin.cols() * cells;
        let cell_m = skin.pitch_m() / f64::from(u32::try_from(cells).unwrap());
        let (mut f, mut mx, mut my) = (0.0, 0.0, 0.0);
        for (i, p) in balance.response.pressure_pa.iter().enumerate() {
            prop_assert!(*p >= 0.0 && p.is_finite());
            let half = 0.5 * (f64::from(u32::try_from(n).unwrap()) - 1.0);
            let x = (f64::from(u32::try_from(i % n).unwrap()) - half) * cell_m - place[0];
            let y = (half - f64::from(u32::try_from(i / n).unwrap())) * cell_m - place[1];
            let part = p * cell_m * cell_m;
            f += part;
            mx += y * part;
            my -= x * part;
        }
        prop_assert!((f - force_n).abs() <= 1e-9 * force_n);
        let off = [balance.seat.tilt_rad[0] - 0.1 * tilt[0], balance.seat.tilt_rad[1] - 0.1 * tilt[1]];
        let held = [k * off[0] + 0.1 * k * off[1], 0.1 * k * off[0] + 0.7 * k * off[1]];
        // moments up to the force's tolerance times the size of the skin
        prop_assert!((mx - held[0]).abs() <= 1e-9 * force_n * 0.15, "{mx} {}", held[0]);
        prop_assert!((my - held[1]).abs() <= 1e-9 * force_n * 0.15, "{my} {}", held[1]);
    }
}

/// On 500 × 500 taxels (9e6 cells) an answer to a finger says that nothing further than the finger has to be looked at.
#[test]
fn large_skin_answers_with_the_patch() {
    let skin = SkinLayout::new(500, 500, 15e-3, 10e-3).unwrap();
    let ball = sphere(0.01, 12, 16);
    let mut field = WinklerLayer::new(Foam::default(), &skin).unwrap();
    for i in 0..100_u32 {
        let x = 1e-3 * f64::from(i % 7);
        let response = field.respond(&PosedMesh::at_rest(&ball, [x, 0.0, -2e-3]));
        let patch = response.patch.unwrap();
        // the ball is 9 cells across
        assert!(patch.height() <= 10 && patch.width() <= 10, "{patch:?}");
    }
}
