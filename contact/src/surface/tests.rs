//! The curved field against the flat one, a closed form, and boxes cut by hand.

use super::{Solid, SurfaceField, SurfacePoints};
use crate::columns::WinklerLayer;
use crate::field::{ContactField as _, PosedMesh};
use crate::foam::Foam;
use crate::mesh::{TriMesh, cuboid, sphere};
use crate::objects::OBJECTS;
use approx::assert_relative_eq;
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use spts_models::SkinLayout;
use std::f64::consts::{PI, TAU};

/// On a flat skin it is `winkler`: same points, same law, so the same pressures and wrench but for round-off, for all
/// objects, turned, tilted and moving. Depths are good to 1e-15 m of some mm; a cell on a silhouette, within 1e-9 m of
/// it, may fall on either side: none does at these poses.
#[test]
fn a_flat_skin_is_winkler() {
    let skin = SkinLayout::default();
    let points = SurfacePoints::flat(&skin, 6).unwrap();
    let mut curved = SurfaceField::new(Foam::default(), points).unwrap();
    let mut flat = WinklerLayer::new(Foam::default(), &skin).unwrap();
    for (object, k) in OBJECTS.iter().zip(1_u8..) {
        let mesh = (object.build)();
        let turn = f64::from(k);
        let rotation = Rotation3::from_euler_angles(0.01, -0.015, turn);
        let body = PosedMesh {
            rotation: rotation.matrix().transpose().into(),
            ..PosedMesh::at_rest(&mesh, [3.1e-3, -2.3e-3, 0.0])
        };
        let [lowest_m, _] = body.heights_m();
        let position_m = [3.1e-3, -2.3e-3, -lowest_m - 1.3e-3];
        let body = PosedMesh {
            position_m,
            centre_of_mass_m: position_m.map(|v| v + 0.01),
            velocity_m_per_s: [0.02, -0.01, -0.05],
            angular_velocity_rad_per_s: [0.3, -0.2, 0.5],
            stiffness_pa_per_m: 1e8,
            ..body
        };
        curved.clear();
        let wrench = curved.press(&Solid::new(&mesh), &body);
        let wanted = flat.respond(&body);
        let most_pa = wanted.pressure_pa.iter().copied().fold(0.0, f64::max);
        assert!(most_pa > 1e3, "{}", object.name);
        for (found, wanted) in curved.pressure_pa().iter().zip(wanted.pressure_pa) {
            assert!((found - wanted).abs() < 1e-9 * most_pa, "{}: {found} {wanted}", object.name);
        }
        let size_n = wanted.wrench.force_n[2];
        for i in 0..3 {
            assert!((wrench.force_n[i] - wanted.wrench.force_n[i]).abs() < 1e-10 * size_n);
            assert!((wrench.torque_nm[i] - wanted.wrench.torque_nm[i]).abs() < 1e-10 * size_n);
        }
    }
}

/// A rigid sphere of radius R on a bed of springs over a cylinder of radius S: the gap is x²/2A + y²/2B with A = R
/// along the axis and 1/B = 1/R + 1/S around it, so that F = K π d² √(A B) at the depth d (K. L. Johnson, *Contact
/// Mechanics* (1985), §4.3, with the volume of an elliptic paraboloid). Left out are terms of d/R = 1 % (gap and
/// normals to second order), the foam's densification (d/h ε_max = 2 %, less than half of it in the mean), facets
/// (0.1 %) and quadrature.
#[test]
fn a_sphere_on_a_cylinder() {
    let (ball_m, skin_m, depth_m) = (0.03, 0.02, 0.3e-3);
    let side_m = 0.2e-3;
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    for i in -40..=40 {
        for j in -40..=40 {
            let (along, around) = (f64::from(i) * side_m, f64::from(j) * side_m / skin_m);
            let normal = [0.0, around.sin(), around.cos()];
            positions.push([along, skin_m * normal[1], skin_m * (normal[2] - 1.0)]);
            normals.push(normal);
        }
    }
    let count = positions.len();
    let points = SurfacePoints::new(positions, normals, vec![side_m * side_m; count], vec![0; count]).unwrap();
    let config = Foam { thickness_m: 18e-3 / 2.0, max_strain: 1.0, ..Foam::default() };
    let mut field = SurfaceField::new(config, points).unwrap();
    let mesh = sphere(ball_m, 300, 600);
    // the lowest point of the mesh is its origin
    let wrench = field.press(&Solid::new(&mesh), &PosedMesh::at_rest(&mesh, [0.0, 0.0, -depth_m]));
    let b_m = 1.0 / (1.0 / ball_m + 1.0 / skin_m);
    let wanted_n = config.stiffness_pa_per_m * PI * depth_m * depth_m * (ball_m * b_m).sqrt();
    assert_relative_eq!(wrench.force_n[2], wanted_n, max_relative = 0.03);
    // what the points carry is what the body feels
    let points = field.points();
    let carried: f64 = (0..points.len())
        .map(|i| field.pressure_pa()[i] * points.areas_m2[i] * points.normals[i][2])
        .sum();
    assert_relative_eq!(wrench.force_n[2], carried, max_relative = 1e-12);
}

/// Box about the origin.
fn centred(half: [f64; 3]) -> TriMesh {
    cuboid(half.map(|h| 2.0 * h)).translated([0.0, 0.0, -half[2]])
}

/// Where the segment from `start` along `direction` lies in the box, as shares of its length 1; by its slabs.
fn inside(half: [f64; 3], start: Vector3<f64>, direction: Vector3<f64>) -> Option<[f64; 2]> {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        if direction[axis].abs() < 1e-14 {
            if start[axis].abs() > half[axis] {
                return None;
            }
            continue;
        }
        let a = (-half[axis] - start[axis]) / direction[axis];
        let b = (half[axis] - start[axis]) / direction[axis];
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter <= leave && leave >= 0.0 && enter <= 1.0).then_some([enter, leave])
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(11), ..ProptestConfig::with_cases(400) })]
    /// The depth of a box under points that look in all directions is that of its slabs, to 1e-12 m; rays that pass an
    /// edge within 1e-7 m may see it or not. A box that goes deeper than the reach counts as that deep.
    #[test]
    fn depths_of_boxes(
        half in prop::array::uniform3(0.001..0.02_f64),
        angles in prop::array::uniform3(-3.1..3.1_f64),
        place in prop::array::uniform3(-0.015..0.015_f64),
        seed in 0..1000_u32,
    ) {
        let solid = Solid::new(&centred(half));
        let rotation = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
        let (place, reach_m) = (Vector3::from(place), 0.012);
        for k in 0..50 {
            let turn = f64::from(seed * 50 + k) * 0.618_034 * TAU;
            let up = f64::from(k).mul_add(2.0 / 50.0, -0.98);
            let flat = (1.0 - up * up).sqrt();
            let direction = Vector3::new(flat * turn.cos(), flat * turn.sin(), up);
            let start = -direction * reach_m;
            let (from, along) = (rotation.inverse() * (start - place), rotation.inverse() * direction);
            let depth = |from: Vector3<f64>, along: Vector3<f64>| {
                let array = |v: Vector3<f64>| parry3d_f64::math::Vector::new(v.x, v.y, v.z);
                solid.depth_m(array(from), array(along), reach_m)
            };
            let wanted = |half| inside(half, from, along * reach_m).map_or(0.0, |[enter, _]| reach_m * (1.0 - enter.max(0.0)));
            let found = depth(from, along);
            let near = |grow: f64| (found - wanted(half.map(|h| h + grow))).abs() < 1e-6;
            prop_assert!((found - wanted(half)).abs() < 1e-12 || near(1e-7) || near(-1e-7), "{found} {}", wanted(half));
        }
    }
}

/// Deeper is never softer, through the whole foam and out of its reach; a body that is nowhere presses nothing.
#[test]
fn extremes() {
    let points = SurfacePoints::flat(&SkinLayout::default(), 4).unwrap();
    let mut field = SurfaceField::new(Foam::default(), points).unwrap();
    let mesh = centred([0.02, 0.02, 0.05]);
    let solid = Solid::new(&mesh);
    let mut last_n = 0.0;
    for k in 0..60 {
        field.clear();
        let height_m = 0.05 - 1e-3 * f64::from(k);
        let wrench = field.press(&solid, &PosedMesh::at_rest(&mesh, [0.001, 0.002, height_m]));
        assert!(wrench.force_n[2] >= last_n * (1.0 - 1e-12), "{k}: {} {last_n}", wrench.force_n[2]);
        last_n = wrench.force_n[2];
    }
    assert!(last_n > 1e3);
    field.clear();
    for position in [[f64::NAN; 3], [0.0, 0.0, f64::INFINITY]] {
        let wrench = field.press(&solid, &PosedMesh::at_rest(&mesh, position));
        assert!(wrench.force_n.iter().all(|f| f.is_nan()));
        assert!(field.pressure_pa().iter().all(|p| *p == 0.0));
    }
    let empty = TriMesh::default();
    let wrench = field.press(&Solid::new(&empty), &PosedMesh::at_rest(&empty, [0.0; 3]));
    assert!(wrench.force_n.iter().all(|f| *f == 0.0));
}

#[test]
fn points_that_cannot_be_are_refused() {
    let p = vec![[0.0; 3]; 2];
    let n = vec![[0.0, 0.0, 2.0]; 2];
    let refused = |p: &Vec<[f64; 3]>, n: &Vec<[f64; 3]>, a: Vec<f64>, t: Vec<u32>| {
        SurfacePoints::new(p.clone(), n.clone(), a, t).unwrap_err().to_string()
    };
    assert!(SurfacePoints::new(p.clone(), n.clone(), vec![1e-6; 2], vec![1, 0]).is_ok());
    for (error, field) in [
        (refused(&vec![], &vec![], vec![], vec![]), "points"),
        (refused(&vec![[f64::NAN; 3]; 2], &n, vec![1e-6; 2], vec![0; 2]), "positions_m[0]"),
        (refused(&p, &vec![[0.0; 3]; 2], vec![1e-6; 2], vec![0; 2]), "normals[0]"),
        (refused(&p, &n, vec![1e-6, 0.0], vec![0; 2]), "areas_m2[1]"),
        (refused(&p, &n, vec![1e-6], vec![0; 2]), "areas_m2"),
        (refused(&p, &n, vec![1e-6; 2], vec![0, 2]), "taxels"),
        (refused(&p, &n, vec![1e-6; 2], vec![1, 1]), "taxels"),
    ] {
        assert!(error.contains(field), "{error}");
    }
}
