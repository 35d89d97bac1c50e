//! The quasi-static level against closed forms and against the sums it has to fulfil.

use super::{Footprint, WinklerConfig, WinklerLayer};
use crate::mesh::{TriMesh, cuboid, sphere};
use crate::objects::by_name;
use crate::{ContactField as _, EquilibriumError, Holder, Load, PosedMesh, QuasiStatic as _};
use approx::assert_relative_eq;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use spts_models::SkinLayout;

const K: f64 = 1e7;

/// So thick that densification vanishes (δ/δ_m ≈ 1e-4).
fn thick() -> WinklerConfig {
    WinklerConfig {
        stiffness_pa_per_m: K,
        thickness_m: 10.0,
        ..WinklerConfig::default()
    }
}

fn footprint(config: WinklerConfig) -> Footprint {
    Footprint::new(config, &SkinLayout::default()).unwrap()
}

fn load(force_n: f64, axis_m: [f64; 2], holder: Holder) -> Load {
    Load {
        force_n,
        axis_m,
        holder,
        from: None,
    }
}

fn elastic(k: f64) -> Holder {
    Holder::Elastic {
        stiffness_nm_per_rad: [[k, 0.0], [0.0, k]],
        rest_rad: [0.0; 2],
    }
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
    let body = PosedMesh {
        stiffness_pa_per_m: 2e7,
        ..PosedMesh::at_rest(&mesh, [0.0031, -0.0017, 0.0])
    };
    let config = WinklerConfig::default();
    let mut field = footprint(config);
    let balance = field
        .carry(&body, &load(20.0, [0.0031, -0.0017], Holder::Rigid))
        .unwrap();
    let mut layer = WinklerLayer::new(config, &SkinLayout::default()).unwrap();
    let com_m = balance.position_m;
    let there = PosedMesh {
        position_m: balance.position_m,
        centre_of_mass_m: com_m,
        ..body
    };
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
    let mut field = footprint(WinklerConfig::default());
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
        let config = WinklerConfig {
            stiffness_pa_per_m: k,
            ..WinklerConfig::default()
        };
        for (force_n, holder) in [
            (0.2, Holder::Rigid),
            (0.2, elastic(300.0)),
            (2e-3, elastic(300.0)),
            (50.0, elastic(1e3)),
        ] {
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
            let EquilibriumError::Force { reached_n, depth_m, .. } = error else {
                panic!("{error}")
            };
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
    let error = field
        .carry(&body(0.3), &load(5.0, [0.3, 0.0], Holder::Rigid))
        .unwrap_err();
    assert!(matches!(error, EquilibriumError::Beside { .. }), "{error}");
    // 9e-4 m² at 7 cm: less than 640 N
    let error = field
        .carry(&body(0.0), &load(1e3, [0.0; 2], Holder::Rigid))
        .unwrap_err();
    assert!(matches!(error, EquilibriumError::Force { .. }), "{error}");
    // 30 mm beside the middle of a block that ends at 15 mm, hardly held
    let error = field
        .carry(&body(0.0), &load(20.0, [0.03, 0.0], elastic(1e-3)))
        .unwrap_err();
    assert!(matches!(error, EquilibriumError::Tilt { .. }), "{error}");
    for force_n in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = field
            .carry(&body(0.0), &load(force_n, [0.0; 2], Holder::Rigid))
            .unwrap_err();
        assert!(matches!(error, EquilibriumError::Load { .. }), "{error}");
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
        let mut field = Footprint::new(WinklerConfig { cells_per_taxel: cells, ..WinklerConfig::default() }, &skin).unwrap();
        let (s, c) = tilt[0].sin_cos();
        let body = PosedMesh {
            rotation: [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]],
            ..PosedMesh::at_rest(&mesh, [place[0], place[1], 0.0])
        };
        let holder = Holder::Elastic { stiffness_nm_per_rad: [[k, 0.1 * k], [0.1 * k, 0.7 * k]], rest_rad: [0.1 * tilt[0], 0.1 * tilt[1]] };
        let balance = match field.carry(&body, &load(force_n, place, holder)) {
            Ok(balance) => balance,
            Err(EquilibriumError::Beside { .. } | EquilibriumError::Tilt { .. } | EquilibriumError::Force { .. }) => return Ok(()),
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
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
