//! The Winkler layer against closed forms; sphere, cone and cylinder are in `convergence_tests`.

use super::{WinklerConfig, WinklerLayer};
use crate::mesh::TriMesh;
use crate::{CONTACT_FIELDS, ContactField as _, PosedMesh, conformance};
use approx::assert_relative_eq;
use spts_models::SkinLayout;
use std::f64::consts::{PI, TAU};

const K: f64 = 1e7;

/// A layer so thick that densification vanishes (δ/δ_m < 1e-3), with `cells` fine cells a taxel side.
fn layer(cells: usize) -> WinklerLayer {
    let config = WinklerConfig {
        stiffness_pa_per_m: K,
        thickness_m: 10.0,
        cells_per_taxel: cells,
        ..WinklerConfig::default()
    };
    WinklerLayer::new(config, &SkinLayout::default()).unwrap()
}

/// Surface of revolution of z = `profile(r)` about the z axis, out to `radius_m`.
fn revolved(radius_m: f64, rings: u32, sectors: u32, inner_m: f64, profile: impl Fn(f64) -> f64) -> TriMesh {
    let mut mesh = TriMesh {
        vertices: Vec::new(),
        triangles: Vec::new(),
    };
    for i in 0..=rings {
        let r = inner_m + (radius_m - inner_m) * f64::from(i) / f64::from(rings);
        for j in 0..sectors {
            let (s, c) = (TAU * f64::from(j) / f64::from(sectors)).sin_cos();
            mesh.vertices.push([r * c, r * s, profile(r)]);
        }
    }
    for i in 0..rings {
        for j in 0..sectors {
            let (a, b) = (i * sectors + j, i * sectors + (j + 1) % sectors);
            mesh.triangles.push([a, b, a + sectors]);
            mesh.triangles.push([b, b + sectors, a + sectors]);
        }
    }
    mesh
}

/// Flat rectangle [x0, x1] × [y0, y1] at z = 0.
fn plate(x: [f64; 2], y: [f64; 2]) -> TriMesh {
    TriMesh {
        vertices: vec![
            [x[0], y[0], 0.0],
            [x[1], y[0], 0.0],
            [x[1], y[1], 0.0],
            [x[0], y[1], 0.0],
        ],
        triangles: vec![[0, 2, 1], [0, 3, 2]],
    }
}

fn pressed(layer: &mut WinklerLayer, mesh: &TriMesh, position_m: [f64; 3]) -> (f64, f64) {
    let response = layer.respond(&PosedMesh::at_rest(mesh, position_m));
    let peak_pa = response.pressure_pa.iter().copied().fold(0.0, f64::max);
    (response.wrench.force_n[2], peak_pa)
}

/// Off-grid position: no symmetry helps the midpoint sum.
const X: f64 = 0.00313;
const Y: f64 = -0.00171;

/// The textbook parabola F = π K R δ² (K. L. Johnson, *Contact Mechanics* (1985), §4.3). The midpoint sum of a function
/// that vanishes linearly at the rim misses O(h²) of the load, h = cell / contact radius; the facets R (1 − cos(π/n)) ≈
/// 1e-6 m of 2 mm.
#[test]
fn paraboloid() {
    let (radius_m, depth_m) = (0.03, 2e-3);
    let mesh = revolved(0.014, 60, 256, 1e-6, |r| r * r / (2.0 * radius_m));
    let (force_n, _) = pressed(&mut layer(12), &mesh, [X, Y, -depth_m]);
    let h = 0.015 / 12.0 / (2.0 * radius_m * depth_m).sqrt();
    assert_relative_eq!(
        force_n,
        PI * K * radius_m * depth_m.powi(2),
        max_relative = h * h + 1e-3
    );
}

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
    let mesh = revolved(0.031, 8, 256, 0.0125, |_| 0.0);
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
    let mut mesh = plate([-0.03, -0.015], [-0.015, 0.015]);
    let other = plate([0.015, 0.03], [-0.015, 0.015]);
    let roof = plate([-0.03, 0.03], [-0.015, 0.015]);
    for (part, lift_m) in [(other, 0.0), (roof, 2e-4)] {
        let base = u32::try_from(mesh.vertices.len()).unwrap();
        mesh.vertices.extend(part.vertices.iter().map(|v| [v[0], v[1], lift_m]));
        mesh.triangles
            .extend(part.triangles.iter().map(|t| t.map(|i| i + base)));
    }
    let (force_n, _) = pressed(&mut layer(6), &mesh, [0.0, 0.0, -1e-3]);
    let expected_n = K * (2.0 * 0.015 * 0.03 * 1e-3 + 0.03 * 0.03 * 8e-4);
    assert_relative_eq!(force_n, expected_n, max_relative = 2.5e-4);
}

/// Kelvin–Voigt: p = K (δ + τ v) for a plate that sinks at v; the default foam stays finite far beyond its thickness.
#[test]
fn damping_and_depth_beyond_the_foam() {
    let mesh = plate([-0.015, 0.015], [-0.015, 0.015]);
    let mut skin = layer(6);
    let body = PosedMesh {
        velocity_m_per_s: [0.0, 0.0, -1.0],
        ..PosedMesh::at_rest(&mesh, [0.0, 0.0, -1e-3])
    };
    let force_n = skin.respond(&body).wrench.force_n[2];
    let tau_s = WinklerConfig::default().damping_s;
    assert_relative_eq!(force_n, K * 9e-4 * (1e-3 + tau_s), max_relative = 1e-3);
    let mut foam = WinklerLayer::new(WinklerConfig::default(), &SkinLayout::default()).unwrap();
    let (shallow_n, _) = pressed(&mut foam, &mesh, [0.0, 0.0, -3e-3]);
    let (deep_n, _) = pressed(&mut foam, &mesh, [0.0, 0.0, -12e-3]);
    assert!(deep_n > 4.0 * shallow_n && deep_n.is_finite());
}

#[test]
fn every_field_conforms() {
    for (name, build) in CONTACT_FIELDS {
        if let Err(error) = conformance(*build) {
            panic!("{name}: {error}");
        }
    }
}
