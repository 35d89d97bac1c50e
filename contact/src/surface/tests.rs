//! The curved field against the flat one, a closed form, and boxes cut by hand.

use super::{Part, Primitive, Solid, SurfaceField, SurfacePoints, Winding};
use crate::columns::WinklerLayer;
use crate::field::{ContactField as _, PosedMesh};
use crate::foam::Foam;
use crate::mesh::{TriMesh, cuboid, cylinder, revolve, sphere};
use crate::objects::OBJECTS;
use crate::prepared::PreparedMesh;
use crate::touch::{TouchBody, TouchSkin};
use approx::assert_relative_eq;
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use spts_models::SkinLayout;
use std::f64::consts::{PI, TAU};

/// On a flat skin it is `winkler`: same points, same law, so the same pressures but for round-off, for all objects,
/// turned, tilted and moving, on cells without a rim; and the same wrench for a ball, which has none. Depths are good
/// to 1e-15 m of some mm; a cell on a silhouette, within 1e-9 m of it, may fall on either side: none does at these
/// poses.
#[test]
fn a_flat_skin_is_winkler() {
    let skin = SkinLayout::default();
    let points = SurfacePoints::flat(&skin, 6).unwrap();
    let mut curved = SurfaceField::new(Foam::default(), points).unwrap();
    let mut flat = WinklerLayer::new(Foam::default(), &skin).unwrap();
    let objects = OBJECTS.iter().map(|object| (object.name, (object.build)()));
    for ((name, mesh), k) in objects.chain([("ball", sphere(0.03, 24, 48))]).zip(1_u8..) {
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
        assert!(most_pa > 1e3, "{name}");
        let (size_n, wanted_pa) = (wanted.wrench.force_n[2], wanted.pressure_pa.to_vec());
        let wanted = wanted.wrench;
        let mut alike = 0;
        for (cell, (found, wanted)) in curved.pressure_pa().iter().zip(wanted_pa).enumerate() {
            if flat.has_parts(cell) {
                continue;
            }
            assert!((found - wanted).abs() < 1e-9 * most_pa, "{name}: {found} {wanted}");
            alike += usize::from(wanted > 0.0);
        }
        // the rest is rims
        assert!((wrench.force_n[2] - size_n).abs() < 0.1 * size_n, "{name}");
        if name != "ball" {
            continue;
        }
        assert!(alike > 30);
        for i in 0..3 {
            assert!((wrench.force_n[i] - wanted.force_n[i]).abs() < 1e-10 * size_n);
            assert!((wrench.torque_nm[i] - wanted.torque_nm[i]).abs() < 1e-10 * size_n);
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
    let carried: f64 =
        (0..points.len()).map(|i| field.pressure_pa()[i] * points.areas_m2[i] * points.normals[i][2]).sum();
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
    /// The depth of a box in columns that look in all directions is that of its slabs, to 1e-12 m; rays that pass an
    /// edge within 1e-7 m may see it or not. A box with the base of the column inside has come through it if more of it
    /// lies outward; then its depth grows on behind the base.
    #[test]
    fn depths_of_boxes(
        half in prop::array::uniform3(0.001..0.02_f64),
        angles in prop::array::uniform3(-3.1..3.1_f64),
        place in prop::array::uniform3(-0.015..0.015_f64),
        seed in 0..1000_u32,
    ) {
        let mesh = centred(half);
        let solid = Solid::new(&mesh);
        let standing = solid.standing(&PosedMesh::at_rest(&mesh, [0.0; 3]));
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
                standing.depth_m(array(from), array(along), reach_m)
            };
            let wanted = |half| match inside(half, from, along * reach_m) {
                None => 0.0,
                Some([enter, leave]) if enter < 0.0 && -enter >= leave => 0.0,
                Some([enter, _]) => reach_m * (1.0 - enter.max(-1.0)),
            };
            // half of it on either side
            prop_assume!(inside(half, from, along * reach_m).is_none_or(|[a, b]| (a + b).abs() > 1e-6));
            let found = depth(from, along);
            let near = |grow: f64| (found - wanted(half.map(|h| h + grow))).abs() < 1e-6;
            prop_assert!((found - wanted(half)).abs() < 1e-12 || near(1e-7) || near(-1e-7), "{found} {}", wanted(half));
        }
    }
}

/// Chords of convex parts against rays on fine meshes of the same shapes, one by one and as a union of two, in columns
/// that look in all directions from all places: the same depth and gap within the mesh's error.
#[test]
fn chords_are_those_of_meshes() {
    let upright = |mesh: TriMesh, down_m: f64| mesh.translated([0.0, 0.0, -down_m]);
    let ball = upright(sphere(0.01, 256, 512), 0.01);
    let can = upright(cylinder(0.008, 0.03, 1024), 0.015);
    let pill = {
        let cap = |k: u32| {
            let (sin, cos) = (f64::from(k) / 128.0 * 0.25 * TAU).sin_cos();
            [0.007 * cos, 0.011 + 0.007 * sin]
        };
        let lower = (0..128).rev().map(cap).map(|[r, z]| [r, -z]);
        let profile = [[0.0, -0.018]].into_iter().chain(lower).chain((0..128).map(cap)).chain([[0.0, 0.018]]);
        revolve(&profile.collect::<Vec<_>>(), 512)
    };
    let floor = upright(cuboid([200.0, 200.0, 100.0]), 100.0);
    let egg = ball.clone().scaled([1.0, 0.5, 2.0]);
    let part =
        |shape, position_m| Part { shape, rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], position_m };
    let cases = [
        (ball.clone(), vec![part(Primitive::Ellipsoid([0.01; 3]), [0.0; 3])]),
        (egg, vec![part(Primitive::Ellipsoid([0.01, 0.005, 0.02]), [0.0; 3])]),
        (centred([0.01, 0.02, 0.03]), vec![part(Primitive::Cuboid([0.01, 0.02, 0.03]), [0.0; 3])]),
        (can, vec![part(Primitive::Cylinder(0.008, 0.015), [0.0; 3])]),
        (pill, vec![part(Primitive::Capsule(0.007, 0.011), [0.0; 3])]),
        (floor, vec![part(Primitive::HalfSpace, [0.0; 3])]),
        (
            ball.clone().translated([-0.02, 0.0, 0.0]).merged(&ball.clone().translated([0.02, 0.0, 0.0])),
            vec![
                part(Primitive::Ellipsoid([0.01; 3]), [-0.02, 0.0, 0.0]),
                part(Primitive::Ellipsoid([0.01; 3]), [0.02, 0.0, 0.0]),
            ],
        ),
    ];
    for (number, (mesh, parts)) in cases.into_iter().enumerate() {
        let (fine, exact) = (Solid::new(&mesh), Solid::of_parts(parts));
        let turn = Rotation3::from_euler_angles(0.3, -0.7, 1.1);
        let rotation = std::array::from_fn(|i| std::array::from_fn(|j| turn[(i, j)]));
        let body = PosedMesh { rotation, ..PosedMesh::at_rest(&mesh, [0.001, -0.002, 0.003]) };
        let (fine, exact) = (fine.standing(&body), exact.standing(&body));
        let (mut met, mut odd) = (0, 0);
        for k in 0..20_000 {
            let [a, b, c, d, e] =
                [0.618_034, 0.754_878, 0.569_840, 0.819_173, 0.671_044].map(|s| (f64::from(k) * s).fract());
            let z = 2.0 * d - 1.0;
            let flat = (1.0 - z * z).sqrt();
            let outward = parry3d_f64::math::Vector::new(flat * (TAU * e).cos(), flat * (TAU * e).sin(), z);
            let base = parry3d_f64::math::Vector::new(a - 0.5, b - 0.5, c - 0.5) * 0.06;
            let [one, other] = [&fine, &exact].map(|s| s.front_m(base, outward, 0.006, 0.004));
            met += usize::from(one.is_some());
            // beside an edge, and where as much of a body lies on either side of the base, one may see what the other
            // does not
            odd += usize::from(match (one, other) {
                (Some(one), Some(other)) => (one - other).abs() > 2e-5,
                (one, other) => one.is_some() != other.is_some(),
            });
        }
        assert!(met > 200 && odd <= met / 100, "{number}: {odd} of {met}");
    }
}

/// Deeper is never softer, through the whole foam and behind it; a body that is nowhere presses nothing.
#[test]
fn extremes() {
    let points = SurfacePoints::flat(&SkinLayout::default(), 4).unwrap();
    let mut field = SurfaceField::new(Foam::default(), points).unwrap();
    let mesh = centred([0.02, 0.02, 0.05]);
    let solid = Solid::new(&mesh);
    let mut last_n = 0.0;
    for k in 0..50 {
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

/// Bodies that creep, jump, turn and come back feel on a skin that knows where they were what they feel on a fresh one,
/// bit for bit.
#[test]
fn what_was_near_before_does_not_show() {
    let winding = Winding {
        shape: [12, 24],
        points_per_side: 2,
        axis: 2,
        centre_m: [0.0; 3],
        arc_rad: [0.0, TAU],
        span_m: [-0.06, 0.06],
    };
    let points = SurfacePoints::on_cylinder(&winding, 0.04).unwrap();
    let fresh = || SurfaceField::new(Foam::default(), points.clone()).unwrap();
    let mesh = cuboid([0.03, 0.03, 0.03]);
    let part = |shape| {
        let rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        vec![Part { shape, rotation, position_m: [0.0, 0.0, 0.004] }]
    };
    let shapes =
        [Primitive::Capsule(0.012, 0.03), Primitive::Cuboid([0.02, 0.01, 0.03]), Primitive::Cylinder(0.02, 0.01)];
    let parts = shapes.into_iter().chain([Primitive::Ellipsoid([0.02, 0.015, 0.03]), Primitive::HalfSpace]);
    let mut solids: Vec<Solid> = parts.map(|shape| Solid::of_parts(part(shape))).collect();
    solids.push(Solid::new(&mesh));
    let (mut used, mut felt) = (fresh(), 0);
    for k in 0..120_u32 {
        let t = f64::from(k);
        // every tenth step goes far
        let radius_m = 0.045 + 2e-3 * (0.3 * t).sin() + if k % 10 == 9 { 0.05 } else { 0.0 };
        let angle = 0.004 * t + if k % 30 > 20 { 2.0 } else { 0.0 };
        let turn = Rotation3::from_euler_angles(0.01 * t, 0.3, -0.02 * t);
        for solid in &solids {
            let at = [radius_m * angle.cos(), radius_m * angle.sin(), 1e-3 * t - 0.06];
            let rotation = std::array::from_fn(|i| std::array::from_fn(|j| turn[(i, j)]));
            let pose = PosedMesh { rotation, ..PosedMesh::at_rest(&mesh, at) };
            let mut other = fresh();
            used.clear();
            assert_eq!(used.press(solid, &pose), other.press(solid, &pose), "step {k}");
            assert_eq!(used.pressure_pa(), other.pressure_pa(), "step {k}");
            felt += usize::from(used.touched_m2() > 0.0);
        }
    }
    assert!(felt > 300, "{felt}");
}

/// A floor under a thin finger, ever deeper: the force never turns and never falls, on skins thicker than the finger
/// too, and the columns that look away from the floor feel nothing.
#[test]
fn a_thin_finger_goes_through_the_floor() {
    let floor = cuboid([1.0, 1.0, 0.2]).translated([0.0, 0.0, -0.2]);
    let solid = Solid::new(&floor);
    for (radius_m, thickness_m) in [(8e-3, 6e-3), (8e-3, 3e-3), (5e-3, 6e-3), (20e-3, 6e-3)] {
        let whole = [0.0, TAU];
        let shape = [8, 16];
        let winding =
            Winding { shape, points_per_side: 2, axis: 0, centre_m: [0.0; 3], arc_rad: whole, span_m: [-0.04, 0.04] };
        let points = SurfacePoints::on_cylinder(&winding, radius_m).unwrap();
        let mut field = SurfaceField::new(Foam { thickness_m, ..Foam::default() }, points).unwrap();
        let mut last_n = 0.0;
        for k in -1..60 {
            field.clear();
            let depth_m = 0.2e-3 * f64::from(k);
            let wrench = field.press(&solid, &PosedMesh::at_rest(&floor, [0.0, 0.0, depth_m - radius_m]));
            let force_n = -wrench.force_n[2];
            assert!(force_n >= last_n * (1.0 - 1e-12), "{radius_m} {thickness_m} {depth_m}: {force_n} after {last_n}");
            assert!(if k < 0 { force_n <= 0.0 } else { force_n < 1e6 });
            let points = field.points();
            for (pressure, normal) in field.pressure_pa().iter().zip(&points.normals) {
                assert!(normal[2] < 0.0 || *pressure <= 0.0, "{radius_m} {depth_m}: felt from behind");
            }
            last_n = force_n;
        }
        assert!(last_n > 100.0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(35), ..ProptestConfig::with_cases(10_000) })]
    /// A body behind a link is never felt, bit for bit: behind a flat skin, and inside the link under a round one.
    #[test]
    fn what_is_behind_a_link_is_not_felt(
        half in prop::array::uniform3(1e-4..0.5_f64),
        angles in prop::array::uniform3(-3.1..3.1_f64),
        place in prop::array::uniform2(-0.1..0.1_f64),
        away in 1e-9..3.0_f64,
        velocity in prop::array::uniform3(-2.0..2.0_f64),
        round in any::<bool>(),
    ) {
        let foam = Foam::default();
        let layout = SkinLayout::with_pitch(6, 6, 15e-3).unwrap();
        let rotation = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
        fn at<'a>(turn: &Rotation3<f64>, velocity: [f64; 3], mesh: &'a TriMesh, position_m: [f64; 3]) -> PosedMesh<'a> {
            let posed = PosedMesh::at_rest(mesh, position_m);
            PosedMesh { rotation: turn.matrix().transpose().into(), velocity_m_per_s: velocity, ..posed }
        }
        let corner = Vector3::from(half).norm();
        let (mut skins, mesh, position_m) = if round {
            // a link of 80 mm radius; the body anywhere inside it
            let arc_rad = [0.0, TAU];
            let winding =
                Winding { shape: [6, 6], points_per_side: 2, axis: 2, centre_m: [0.0; 3], arc_rad, span_m: [-0.1, 0.1] };
            let points = SurfacePoints::on_cylinder(&winding, 0.08 + foam.thickness_m).unwrap();
            let small = 0.05 / corner;
            let mesh = centred(half.map(|h| h * small));
            (vec![TouchSkin::curved(layout, points, foam).unwrap()], mesh, [0.2 * place[0], 0.2 * place[1], 0.05])
        } else {
            let points = SurfacePoints::flat(&layout, 2).unwrap();
            let skins = vec![
                TouchSkin::flat(layout, Foam { cells_per_taxel: 2, ..foam }).unwrap(),
                TouchSkin::curved(layout, points, foam).unwrap(),
            ];
            let mesh = centred(half);
            let [_, high_m] = at(&rotation, velocity, &mesh, [0.0; 3]).heights_m();
            (skins, mesh, [place[0], place[1], -foam.thickness_m - high_m - away])
        };
        let body = TouchBody::from(PreparedMesh::from(mesh));
        for skin in &mut skins {
            let mut wrenches = Vec::new();
            skin.touch(&[(&body, at(&rotation, velocity, &body.mesh, position_m))], &mut wrenches);
            prop_assert!(wrenches[0].force_n.iter().chain(&wrenches[0].torque_nm).all(|v| v.abs().to_bits() == 0));
            prop_assert!(skin.pressure().values().iter().all(|p| p.to_bits() == 0) && !skin.bottomed());
        }
    }
}

/// Flat and curved skins are one rule at every depth: a ball that sinks in, bottoms out, goes through and comes out
/// behind; what bottoms out says so.
#[test]
fn flat_and_curved_are_one_rule() {
    let layout = SkinLayout::default();
    let foam = Foam::default();
    let ball = TouchBody::from(PreparedMesh::from(sphere(0.03, 48, 96).translated([0.0, 0.0, -0.03])));
    let mut flat = TouchSkin::flat(layout, foam).unwrap();
    let points = SurfacePoints::flat(&layout, foam.cells_per_taxel).unwrap();
    let mut curved = TouchSkin::curved(layout, points, foam).unwrap();
    let mut bottomed = Vec::new();
    for k in 0..75 {
        let height_m = 0.0313 - 1e-3 * f64::from(k);
        let (mut a, mut b) = (Vec::new(), Vec::new());
        let posed = |body| (body, PosedMesh::at_rest(&ball.mesh, [1.3e-3, 0.7e-3, height_m]));
        flat.touch(&[posed(&ball)], &mut a);
        curved.touch(&[posed(&ball)], &mut b);
        let (a, b) = (a[0].force_n[2], b[0].force_n[2]);
        assert!((a - b).abs() <= 1e-9 * b.max(1.0), "{height_m}: {a} {b}");
        assert_eq!(flat.bottomed(), curved.bottomed(), "{height_m}");
        assert_eq!(a > 0.0, (-0.006..0.03).contains(&height_m), "{height_m}: {a}");
        bottomed.push(flat.bottomed());
    }
    // touched at 30 mm, at the link at 24 mm, half of it behind the link at −6 mm
    assert_eq!(bottomed.iter().position(|b| *b), Some(8));
    assert_eq!(bottomed.iter().rposition(|b| *b), Some(37));
}
