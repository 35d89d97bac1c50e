//! The rasterised envelope against every triangle of arbitrary meshes, and against itself when a pose comes again.

use super::{Envelope, Part};
use crate::field::PosedMesh;
use crate::mesh::polygon::{Point, circle, rectangle};
use crate::mesh::{TriMesh, cuboid, cylinder, extrude, extrude_recessed, revolve_ring, sphere};
use crate::objects::OBJECTS;
use approx::assert_relative_eq;
use nalgebra::{Rotation3, Unit, Vector3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use spts_models::SkinLayout;
use std::f64::consts::TAU;

/// A solid is seen by its lower side alone, a surface that is open or inside out by all of it: the same depths, since
/// the sides that are left out are never the lowest.
#[test]
fn solids_are_seen_from_below() {
    let skin = SkinLayout::default();
    let ball = sphere(20e-3, 12, 16);
    let inside_out = ball.clone().flipped();
    // without a triangle of the upper half, beside what is below the skin
    let least = |t: &usize| ball.corners(*t).map(|p| p[2]).into_iter().fold(f64::INFINITY, f64::min);
    let beside = (0..ball.triangles.len()).find(|t| (0.019..0.025).contains(&least(t)));
    let mut open = ball.clone();
    open.triangles.remove(beside.unwrap());
    let pair = ball.clone().merged(&inside_out.clone().translated([50e-3, 0.0, 0.0]));
    assert!(ball.is_solid() && !inside_out.is_solid() && !open.is_solid() && !pair.is_solid());
    let depths = |mesh: &TriMesh| {
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
        object in 0..OBJECTS.len(),
        start in prop::array::uniform3(-1.0..1.0_f64),
        moves in prop::collection::vec((prop::array::uniform3(-1.0..1.0_f64), -8.0..-3.0_f64), 1..60),
        cells in 1..12_usize,
    ) {
        let mesh = (OBJECTS[object].build)();
        let lowest_m = mesh.vertices.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
        let mut envelope = Envelope::new(&SkinLayout::default(), cells);
        let mut position = Vector3::new(0.04 * start[0], 0.04 * start[1], -lowest_m - 1e-3);
        let mut rotation = Rotation3::from_euler_angles(0.02 * start[2], 0.01 * start[0], 3.0 * start[1]);
        for (direction, exponent) in moves {
            let step = Vector3::from(direction) * 10_f64.powf(exponent);
            position += step;
            rotation = Rotation3::new(0.5 * step) * rotation;
            let body = PosedMesh {
                rotation: rotation.matrix().transpose().into(),
                ..PosedMesh::at_rest(&mesh, position.into())
            };
            let mut fresh = Envelope::new(&SkinLayout::default(), cells);
            prop_assert_eq!(envelope.rasterise(&body), fresh.rasterise(&body));
            let bits = |envelope: &Envelope| envelope.depth_m().iter().map(|d| d.to_bits()).collect::<Vec<_>>();
            prop_assert!(bits(&envelope) == bits(&fresh));
        }
    }
}

/// The mesh of a body in world axes.
fn posed(body: &PosedMesh<'_>) -> TriMesh {
    body.mesh.clone().rotated(body.rotation).translated(body.position_m)
}

/// Least height of the surface over the square of `slack_m` around (x, y), by brute force over the triangles: clips
/// every triangle to the square. Shares nothing with the rasteriser.
fn lowest_near_m(world: &TriMesh, [x, y]: Point, slack_m: f64) -> Option<f64> {
    let mut lowest: Option<f64> = None;
    for t in 0..world.triangles.len() {
        let mut polygon = world.corners(t).to_vec();
        for (axis, sign, bound) in
            [(0, 1.0, x + slack_m), (0, -1.0, slack_m - x), (1, 1.0, y + slack_m), (1, -1.0, slack_m - y)]
        {
            polygon = clipped(&polygon, axis, sign, bound);
        }
        for p in polygon {
            lowest = Some(lowest.map_or(p[2], |z| z.min(p[2])));
        }
    }
    lowest
}

/// The part of a polygon with sign · coordinate ≤ bound (Sutherland–Hodgman).
fn clipped(polygon: &[[f64; 3]], axis: usize, sign: f64, bound: f64) -> Vec<[f64; 3]> {
    let mut out = Vec::new();
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (dp, dq) = (sign * p[axis] - bound, sign * q[axis] - bound);
        if dp <= 0.0 {
            out.push(p);
        }
        if (dp < 0.0 && dq > 0.0) || (dp > 0.0 && dq < 0.0) {
            let s = dp / (dp - dq);
            out.push([0, 1, 2].map(|k| p[k] + s * (q[k] - p[k])));
        }
    }
    out
}

/// Round-off of positions below 1 m, m: a few ulp, times the steepest gradient that matters.
const ROUND_OFF_M: f64 = 1e-12;
/// The envelope may take any point this far from a centre, m: the slack over the shortest edges met here (10 µm).
const NEAR_M: f64 = 1e-9;

/// At every centre the depth is that of the surface: where the brute force is the same all around the centre, to
/// round-off; on edges and walls between the deepest point of the neighbourhood and the point itself. Over a cell with
/// parts, ∫ depth dA is that of the surface.
fn check(mesh: &TriMesh, rotation: [[f64; 3]; 3], position_m: [f64; 3], cells: usize) -> Result<(), TestCaseError> {
    let body = PosedMesh { rotation, ..PosedMesh::at_rest(mesh, position_m) };
    let mut envelope = Envelope::new(&SkinLayout::default(), cells);
    let patch = envelope.rasterise(&body);
    let moving = envelope.depth_m().to_vec();
    let world = posed(&body);
    let [rows, cols] = envelope.shape();
    for row in 0..rows {
        for col in 0..cols {
            let centre = envelope.centre_m(row, col);
            let cell = row * cols + col;
            let found = moving[cell];
            let inside = (patch.rows[0]..patch.rows[1]).contains(&row) && (patch.cols[0]..patch.cols[1]).contains(&col);
            prop_assert!(found <= 0.0 || inside);
            let depth = |z: Option<f64>| z.map_or(0.0, |z| (-z).max(0.0));
            let parts = envelope.parts(&(cell..cell + 1));
            if !parts.is_empty() {
                parts_check(&world, envelope.cell_m(), centre, parts)?;
                continue;
            }
            if envelope.has_parts(cell) {
                continue;
            }
            let exact = depth(world.underside_m(centre));
            let most = depth(lowest_near_m(&world, centre, NEAR_M));
            prop_assert!(
                found >= exact - ROUND_OFF_M - 1e-6 * (most - exact) && found <= most + ROUND_OFF_M,
                "({row}, {col}): {found:e}, brute force {exact:e} to {most:e}"
            );
        }
    }
    // the same pose again comes out of the height map, at the same height and at others
    for lower_m in [0.0, 0.0, 3e-4, -2e-4, 0.02, -0.5] {
        let again = PosedMesh { position_m: [position_m[0], position_m[1], position_m[2] - lower_m], ..body };
        let patch = envelope.rasterise(&again);
        let mut fresh = Envelope::new(&SkinLayout::default(), cells);
        fresh.rasterise(&again);
        for (i, (a, b)) in envelope.depth_m().iter().zip(fresh.depth_m()).enumerate() {
            prop_assert!(a.to_bits() == b.to_bits(), "cell {i}: {a:e} from the map, {b:e} anew");
            let (row, col) = (i / cols, i % cols);
            let inside = (patch.rows[0]..patch.rows[1]).contains(&row) && (patch.cols[0]..patch.cols[1]).contains(&col);
            prop_assert!(*a <= 0.0 || inside);
        }
        let all = 0..rows * cols;
        prop_assert!(envelope.parts(&all) == fresh.parts(&all));
    }
    Ok(())
}

/// ∫ depth dA over a cell by its parts against samples of the surface, as a mean over the cell: samples miss the border
/// of what is under the body by half their distance, at two borders; a part, a quarter of a cell high, that reaches
/// above the skin counts with its mean; layers that lie above each other in part count as if they
/// did not; and of walls a strip is left out, of a twentieth of the depth, half as deep, on two sides.
fn parts_check(world: &TriMesh, cell_m: f64, [x, y]: Point, parts: &[Part]) -> Result<(), TestCaseError> {
    const SIDE: u32 = 12;
    let at = |i: u32| cell_m * ((f64::from(i) + 0.5) / f64::from(SIDE) - 0.5);
    let (mut sum_m, mut deepest_m) = (0.0, 0.0_f64);
    for (i, j) in (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| (i, j))) {
        let depth_m = world.underside_m([x + at(i), y + at(j)]).map_or(0.0, |z| (-z).max(0.0));
        sum_m += depth_m / f64::from(SIDE * SIDE);
        deepest_m = deepest_m.max(depth_m);
    }
    let found_m: f64 = parts.iter().map(|part| part.share * part.depth_m).sum();
    deepest_m = parts.iter().map(|part| part.depth_m).fold(deepest_m, f64::max);
    let most_m = 0.15 * deepest_m + cell_m / 32.0 + deepest_m * deepest_m / (20.0 * cell_m);
    prop_assert!((found_m - sum_m).abs() < most_m, "{found_m:e} by parts, {sum_m:e} by samples: {parts:?}");
    Ok(())
}

/// A pin smaller than a cell, a blade thinner than one and a block, flat and upright, have their own area under them
/// wherever they are: the parts sum to it, to round-off.
#[test]
fn shares_sum_to_the_area() {
    let skin = SkinLayout::default();
    let bodies = [
        (cylinder(0.5e-3, 0.02, 48), 24.0 * (TAU / 48.0).sin() * 0.25e-6),
        (cuboid([1e-3, 60e-3, 10e-3]), 60e-6),
        (cuboid([40e-3, 40e-3, 10e-3]), 1.6e-3),
    ];
    for (mesh, area_m2) in bodies {
        let low_m = mesh.bounds().unwrap().0[2];
        for k in 0..40_u8 {
            let mut envelope = Envelope::new(&skin, 4);
            let (x, y) = (1e-4 * f64::from(k), 0.37e-4 * f64::from(k));
            envelope.rasterise(&PosedMesh::at_rest(&mesh, [x, y, -low_m - 1e-3]));
            let [rows, cols] = envelope.shape();
            let mut cells = 0.0;
            for cell in 0..rows * cols {
                let parts = envelope.parts(&(cell..cell + 1));
                let whole = if envelope.depth_m()[cell] > 0.0 { 1.0 } else { 0.0 };
                cells += if parts.is_empty() { whole } else { parts.iter().map(|part| part.share).sum() };
                assert!(parts.iter().all(|part| (part.depth_m - 1e-3).abs() < ROUND_OFF_M), "{area_m2} {parts:?}");
            }
            assert_relative_eq!(cells * envelope.cell_m().powi(2), area_m2, max_relative = 1e-9);
        }
    }
}

fn any_mesh(kind: usize, a: f64, b: f64) -> TriMesh {
    let low = |mesh: TriMesh| mesh.translated([0.0, 0.0, -0.01]);
    match kind {
        0 => cuboid([a, b, 0.02]),
        1 => sphere(0.5 * a, 7, 9),
        2 => low(cylinder(0.5 * b, 0.02, 17)),
        // a hole right through, and a recess from below
        3 => low(extrude(&rectangle(a, a), &[circle(0.3 * a, 11)], 0.02)),
        4 => low(extrude_recessed(&rectangle(a, b), &rectangle(0.5 * a, 0.5 * b), 0.02, 0.004)),
        5 => revolve_ring(&[[0.3 * a, 0.0], [0.5 * a, -0.01], [0.5 * a, 0.01], [0.4 * a, 0.002]], 12),
        // a needle, and two bodies one above the other
        6 => cuboid([a, 1e-5, 0.02]),
        _ => cuboid([a, b, 0.004]).merged(&sphere(0.4 * b, 6, 8).translated([0.2 * a, 0.0, 0.003])),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(7), ..ProptestConfig::with_cases(96) })]
    #[test]
    fn equals_brute_force(
        kind in 0..8_usize,
        size in prop::array::uniform2(0.01..0.06_f64),
        axis in prop::array::uniform3(-1.0..1.0_f64),
        // upright and upside down, with vertical walls, as often as anything between
        angle in prop_oneof![Just(0.0), Just(std::f64::consts::PI), Just(std::f64::consts::FRAC_PI_2), -3.1..3.1_f64],
        place in prop::array::uniform2(-0.08..0.08_f64),
        // walls and corners on centres (odd multiples of half a cell) and on borders of cells as often as anywhere
        snap in prop::bool::ANY,
        height in -0.02..0.02_f64,
        cells in 1..4_usize,
    ) {
        let mesh = any_mesh(kind, size[0], size[1]);
        let axis = Unit::new_normalize(Vector3::from(axis) + Vector3::new(0.0, 0.0, 1e-6));
        let half_cell_m = 0.5 * 0.015 / f64::from(u32::try_from(cells).unwrap());
        let on = |x: f64| if snap { (x / half_cell_m).round() * half_cell_m } else { x };
        let mesh = if snap && kind == 0 { cuboid([on(size[0]).max(half_cell_m), on(size[1]).max(half_cell_m), 0.02]) } else { mesh };
        let rotation = Rotation3::from_axis_angle(&axis, angle);
        check(&mesh, rotation.matrix().transpose().into(), [on(place[0]), on(place[1]), height], cells)?;
    }
}

/// A blade with a sharp edge and walls of 2° that hangs under a wide roof: it is not lost over the roof, and a map made
/// for all depths has what one made for the depth has.
#[test]
fn a_blade_under_a_roof_counts() {
    let blade = revolve_ring(&[[0.02, 0.0], [0.0203, 0.01], [0.0197, 0.01]], 24);
    let roof = cuboid([0.06, 0.06, 0.004]).translated([0.0, 0.0, 0.01]);
    let mesh = blade.merged(&roof);
    check(&mesh, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [1.1e-3, 0.3e-3, -4e-3], 3).unwrap();
    let mut envelope = Envelope::new(&SkinLayout::default(), 3);
    envelope.rasterise(&PosedMesh::at_rest(&mesh, [1.1e-3, 0.3e-3, -4e-3]));
    let [rows, cols] = envelope.shape();
    let volume_cells: f64 = envelope.parts(&(0..rows * cols)).iter().map(|part| part.share * part.depth_m).sum();
    // a ring of 2π · 20 mm and a triangle 4 mm high, 0.24 mm wide below the skin
    let expected_m3 = std::f64::consts::TAU * 0.02 * 0.5 * 4e-3 * 0.24e-3;
    assert_relative_eq!(volume_cells * envelope.cell_m().powi(2), expected_m3, max_relative = 0.15);
}

/// A rim that leans out of the skin: the cells in which it comes up have parts at every depth, out of a map and anew.
#[test]
fn a_leaning_rim_has_parts_at_every_depth() {
    let mesh = cylinder(0.02, 0.02, 2000);
    let rotation = Rotation3::from_axis_angle(&Vector3::y_axis(), 0.03);
    let low_m = -0.02 * 0.03_f64.sin();
    for k in (1..12).step_by(2) {
        let height_m = low_m + 1e-3 - 1e-4 * f64::from(k);
        check(&mesh, rotation.matrix().transpose().into(), [1.1e-3, 0.3e-3, height_m], 3).unwrap();
    }
}

/// The seventeen objects as they are pressed.
#[test]
fn objects_equal_brute_force() {
    for object in OBJECTS.iter().filter(|o| ["T", "comb", "tape", "center"].contains(&o.name)) {
        let mesh = (object.build)();
        check(&mesh, object.placement.matrix(), [0.001, 0.002, -1e-3], 2).unwrap();
    }
}

/// A mesh that changes in place, keeping its address and lengths, is another mesh.
#[test]
fn changed_mesh_is_noticed() {
    let mut mesh = cuboid([0.03, 0.03, 0.01]);
    let mut envelope = Envelope::new(&SkinLayout::default(), 2);
    let deepest = |envelope: &Envelope| envelope.depth_m().iter().copied().fold(0.0, f64::max);
    for _ in 0..3 {
        envelope.rasterise(&PosedMesh::at_rest(&mesh, [0.0, 0.0, -1e-3]));
        assert!((deepest(&envelope) - 1e-3).abs() < ROUND_OFF_M);
    }
    for v in &mut mesh.vertices {
        v[2] -= 1e-3;
    }
    envelope.rasterise(&PosedMesh::at_rest(&mesh, [0.0, 0.0, -1e-3]));
    assert!((deepest(&envelope) - 2e-3).abs() < ROUND_OFF_M);
}
