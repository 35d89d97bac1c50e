//! The rasterised envelope against rays through every cell's centre.

use super::Envelope;
use crate::body::PosedMesh;
use crate::mesh::TriMesh;
use nalgebra::{Rotation3, Unit, Vector3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use spts_models::SkinLayout;

fn cuboid(half: [f64; 3]) -> TriMesh {
    let corner = |i: u32| {
        let sign = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        [sign(0) * half[0], sign(1) * half[1], sign(2) * half[2]]
    };
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
    TriMesh {
        vertices: (0..8).map(corner).collect(),
        triangles: triangles.collect(),
    }
}

/// Lowest z at which the vertical line through (x, y) meets the solid box, by clipping the line against the box's
/// slabs in its own axes: shares nothing with the rasteriser.
fn ray(half: [f64; 3], rotation: &Rotation3<f64>, position: Vector3<f64>, x: f64, y: f64) -> Option<f64> {
    let origin = rotation.inverse() * (Vector3::new(x, y, 0.0) - position);
    let direction = rotation.inverse() * Vector3::z();
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        if direction[axis].abs() < 1e-12 {
            if origin[axis].abs() > half[axis] {
                return None;
            }
            continue;
        }
        let a = (-half[axis] - origin[axis]) / direction[axis];
        let b = (half[axis] - origin[axis]) / direction[axis];
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter <= leave).then_some(enter)
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(7), ..ProptestConfig::with_cases(200) })]
    /// Exact at every centre, up to round-off; centres within 1e-9 m of the silhouette may fall on either side.
    #[test]
    fn equals_ray_casting(
        half in prop::array::uniform3(0.002..0.05_f64),
        axis in prop::array::uniform3(-1.0..1.0_f64),
        angle in -3.1..3.1_f64,
        place in prop::array::uniform2(-0.09..0.09_f64),
        height in -0.03..0.05_f64,
        cells in 1..8_usize,
    ) {
        let mesh = cuboid(half);
        let axis = Unit::new_normalize(Vector3::from(axis) + Vector3::new(0.0, 0.0, 1e-6));
        let rotation = Rotation3::from_axis_angle(&axis, angle);
        let position = Vector3::new(place[0], place[1], height);
        let matrix = rotation.matrix();
        let body = PosedMesh {
            rotation: std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)])),
            ..PosedMesh::at_rest(&mesh, position.into())
        };
        let mut envelope = Envelope::new(&SkinLayout::default(), cells);
        // something else first: its cells have to be cleared
        envelope.rasterise(&PosedMesh::at_rest(&mesh, [-0.03, 0.02, half[2] - 0.005]));
        let patch = envelope.rasterise(&body);
        let [rows, cols] = envelope.shape();
        for row in 0..rows {
            for col in 0..cols {
                let [x, y] = envelope.centre_m(row, col);
                let found = envelope.depth_m()[row * cols + col];
                let expected = ray(half, &rotation, position, x, y).map_or(0.0, |z| (-z).max(0.0));
                if (found - expected).abs() > 1e-9 {
                    let near = [(1e-9, 0.0), (-1e-9, 0.0), (0.0, 1e-9), (0.0, -1e-9)];
                    let edge = near.iter().any(|(dx, dy)| {
                        let z = ray(half, &rotation, position, x + dx, y + dy).map_or(0.0, |z| (-z).max(0.0));
                        (z - found).abs() < 1e-6
                    });
                    prop_assert!(edge, "({row}, {col}): {found} against {expected}");
                }
                let inside = (patch.rows[0]..patch.rows[1]).contains(&row) && (patch.cols[0]..patch.cols[1]).contains(&col);
                prop_assert!(found <= 0.0 || inside);
            }
        }
    }
}

/// A solid is seen by its lower side alone, a surface that is open or inside out by all of it: the same depths, since
/// the sides that are left out are never the lowest.
#[test]
fn solids_are_seen_from_below() {
    let skin = SkinLayout::default();
    let ball = crate::mesh::sphere(20e-3, 12, 16);
    let mut inside_out = ball.clone();
    for triangle in &mut inside_out.triangles {
        triangle.swap(1, 2);
    }
    let mut open = ball.clone();
    // the top of the ball, far above the skin
    let highest = |t: &[u32; 3]| {
        t.iter()
            .map(|i| ball.vertices[*i as usize][2])
            .fold(f64::INFINITY, f64::min)
    };
    let top =
        (0..open.triangles.len()).max_by(|a, b| highest(&ball.triangles[*a]).total_cmp(&highest(&ball.triangles[*b])));
    open.triangles.remove(top.unwrap());
    let mut pair = ball.clone();
    let base = u32::try_from(ball.vertices.len()).unwrap();
    pair.vertices
        .extend(ball.vertices.iter().map(|v| [v[0] + 50e-3, v[1], v[2]]));
    pair.triangles
        .extend(inside_out.triangles.iter().map(|t| t.map(|i| i + base)));
    assert!(ball.is_solid() && !inside_out.is_solid() && !open.is_solid() && !pair.is_solid());
    let depths = |mesh: &crate::mesh::TriMesh| {
        let mut envelope = Envelope::new(&skin, 5);
        envelope.rasterise(&PosedMesh::at_rest(mesh, [3e-3, -2e-3, -1.5e-3]));
        envelope.depth_m().to_vec()
    };
    let expected = depths(&ball);
    assert!(expected.iter().any(|d| *d > 1e-3));
    for other in [&inside_out, &open] {
        for (a, b) in depths(other).iter().zip(&expected) {
            // a cell on an edge takes the height of either triangle: the same but for round-off of 1e-16 of 20 mm
            assert!((a - b).abs() < 1e-16, "{a} and {b}");
        }
    }
    assert!(depths(&pair).iter().zip(&expected).all(|(a, b)| a >= b));
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(8), ..ProptestConfig::with_cases(60) })]
    /// A body that moves slowly is answered from the triangles near its stand, and that shows nowhere: every answer is
    /// that of an envelope which has seen nothing before, bit for bit. Steps from 0.01 to 1000 µm and half as many
    /// µrad, so that choices are kept, left and not made.
    #[test]
    fn what_came_before_does_not_show(
        object in 0..crate::objects::OBJECTS.len(),
        start in prop::array::uniform3(-1.0..1.0_f64),
        moves in prop::collection::vec((prop::array::uniform3(-1.0..1.0_f64), -8.0..-3.0_f64), 1..60),
        cells in 1..12_usize,
    ) {
        let mesh = (crate::objects::OBJECTS[object].build)();
        let lowest_m = mesh.vertices.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
        let mut envelope = Envelope::new(&SkinLayout::default(), cells);
        let mut position = Vector3::new(0.04 * start[0], 0.04 * start[1], -lowest_m - 1e-3);
        let mut rotation = Rotation3::from_euler_angles(0.02 * start[2], 0.01 * start[0], 3.0 * start[1]);
        for (direction, exponent) in moves {
            let step = Vector3::from(direction) * 10_f64.powf(exponent);
            position += step;
            rotation = Rotation3::new(0.5 * step) * rotation;
            let matrix = rotation.matrix();
            let body = PosedMesh {
                rotation: std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)])),
                ..PosedMesh::at_rest(&mesh, position.into())
            };
            let mut fresh = Envelope::new(&SkinLayout::default(), cells);
            prop_assert_eq!(envelope.rasterise(&body), fresh.rasterise(&body));
            let bits = |envelope: &Envelope| envelope.depth_m().iter().map(|d| d.to_bits()).collect::<Vec<_>>();
            prop_assert!(bits(&envelope) == bits(&fresh));
        }
    }
}
