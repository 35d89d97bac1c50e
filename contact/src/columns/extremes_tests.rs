//! Skins and poses at their extremes: finite, balanced, and no dearer than the patch they touch.

use crate::mesh::{TriMesh, cuboid, sphere};
use crate::{CONTACT_FIELDS, ContactField, PosedMesh, build_contact};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use spts_models::SkinLayout;

const FIELDS: [&str; 2] = ["winkler", "footprint"];

fn build(name: &str, skin: &SkinLayout, cells: i64) -> Box<dyn ContactField> {
    let mut table = toml::Table::new();
    table.insert("cells_per_taxel".to_owned(), cells.into());
    build_contact(name, table, skin).unwrap()
}

/// Answers with finite numbers, no tension, Σ p A = `F_z` (up to the round-off of two sums), nothing outside the patch.
fn sound(field: &mut dyn ContactField, body: &PosedMesh<'_>, skin: &SkinLayout) -> f64 {
    let cell_m = skin.pitch_m() / f64::from(u32::try_from(field.cells_per_taxel()).unwrap());
    let width = skin.cols() * field.cells_per_taxel();
    let response = field.respond(body);
    let wrench = response.wrench;
    assert!(
        wrench.force_n.iter().chain(&wrench.torque_nm).all(|v| v.is_finite()),
        "{wrench:?}"
    );
    assert!(response.pressure_pa.iter().all(|p| p.is_finite() && *p >= 0.0));
    let force_n = response.pressure_pa.iter().sum::<f64>() * cell_m * cell_m;
    assert!(
        (force_n - wrench.force_n[2]).abs() <= 1e-9 * force_n,
        "{force_n} {wrench:?}"
    );
    if let Some(patch) = response.patch {
        let inside: f64 = patch.lines(width).flat_map(|line| &response.pressure_pa[line]).sum();
        assert!((inside * cell_m * cell_m - force_n).abs() <= 1e-9 * force_n);
    }
    wrench.force_n[2]
}

/// One taxel, a strip, a square; pitches of 0.1 mm, 15 mm and 0.1 m; a ball as large as the skin's smaller side, or as
/// large as a finger, that touches one cell, presses, floods the skin, lies beside it.
#[test]
fn any_skin() {
    for (rows, cols, cells) in [(1, 1, 1), (1, 1, 6), (1, 1000, 2), (500, 500, 1)] {
        for pitch_m in [1e-4, 15e-3, 0.1] {
            let skin = SkinLayout::new(rows, cols, pitch_m, 0.5 * pitch_m).unwrap();
            let side_m = rows.min(cols) as f64 * pitch_m;
            for name in FIELDS {
                let mut field = build(name, &skin, cells);
                let ball = sphere((0.5 * side_m).min(0.05), 12, 16);
                let cell_m = pitch_m / f64::from(i32::try_from(cells).unwrap());
                // the lowest vertex on the centre of a cell next to the middle
                let half = |n: usize| {
                    if (n * usize::try_from(cells).unwrap()).is_multiple_of(2) {
                        0.5 * cell_m
                    } else {
                        0.0
                    }
                };
                let middle = [half(cols), half(rows)];
                let at = |z: f64| PosedMesh::at_rest(&ball, [middle[0], middle[1], z]);
                assert!(sound(field.as_mut(), &at(1e-9), &skin) <= 0.0);
                assert!(
                    sound(field.as_mut(), &at(-1e-9), &skin) > 0.0,
                    "{name} {rows} × {cols} of {pitch_m}"
                );
                let mut last_n = 0.0;
                for depth_m in [1e-4, 1e-3, 6e-3, 0.05, 10.0] {
                    let force_n = sound(field.as_mut(), &at(-depth_m), &skin);
                    assert!(force_n >= last_n);
                    last_n = force_n;
                }
                let beside = PosedMesh::at_rest(&ball, [cols as f64 * pitch_m + 1.0, 0.0, -1e-3]);
                assert!(sound(field.as_mut(), &beside, &skin) <= 0.0);
            }
        }
    }
}

/// A plate over everything: every cell carries p(δ), so F = p A of the skin.
#[test]
fn flooded_skin() {
    let skin = SkinLayout::default();
    let plate = cuboid([0.4, 0.4, 0.02]);
    for name in FIELDS {
        let mut field = build(name, &skin, 3);
        let force_n = sound(field.as_mut(), &PosedMesh::at_rest(&plate, [0.01, -0.02, -3e-3]), &skin);
        let p = field
            .respond(&PosedMesh::at_rest(&plate, [0.0, 0.0, -3e-3]))
            .pressure_pa
            .to_vec();
        assert!(p.iter().all(|q| (q - p[0]).abs() <= 1e-12 * p[0]));
        assert!((force_n - p[0] * 0.15 * 0.15).abs() <= 1e-9 * force_n);
    }
}

/// On 500 × 500 taxels (9e6 cells) an answer to a finger says that nothing further than the finger has to be looked at.
#[test]
fn large_skin_answers_with_the_patch() {
    let skin = SkinLayout::new(500, 500, 15e-3, 10e-3).unwrap();
    let ball = sphere(0.01, 12, 16);
    let mut field = build("winkler", &skin, 6);
    for i in 0..100_u32 {
        let x = 1e-3 * f64::from(i % 7);
        let response = field.respond(&PosedMesh::at_rest(&ball, [x, 0.0, -2e-3]));
        let patch = response.patch.unwrap();
        // the ball is 9 cells across
        assert!(patch.height() <= 10 && patch.width() <= 10, "{patch:?}");
    }
}

#[test]
fn table_has_the_fields_tested_here() {
    for name in FIELDS {
        assert!(CONTACT_FIELDS.iter().any(|(known, _)| *known == name));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(7), ..ProptestConfig::with_cases(64) })]
    /// Soups of triangles, many of them without area, in any pose and motion.
    #[test]
    fn any_soup(
        points in prop::collection::vec(prop::array::uniform3(-0.05..0.05_f64), 3..12),
        picks in prop::collection::vec(prop::array::uniform3(0..12_usize), 1..20),
        q in prop::array::uniform4(-1.0..1.0_f64),
        position in prop::array::uniform3(-0.1..0.1_f64),
        velocity in prop::array::uniform3(-5.0..5.0_f64),
        spin in prop::array::uniform3(-50.0..50.0_f64),
        flat in prop::bool::ANY,
    ) {
        let n = points.len();
        let mesh = TriMesh {
            vertices: points.iter().map(|p| if flat { [p[0], p[1], 0.0] } else { *p }).collect(),
            triangles: picks.iter().map(|t| t.map(|i| u32::try_from(i % n).unwrap())).collect(),
        };
        let skin = SkinLayout::default();
        let turn = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[0] + 1.1, q[1], q[2], q[3]));
        let turn = turn.to_rotation_matrix();
        let body = PosedMesh {
            rotation: std::array::from_fn(|i| std::array::from_fn(|j| turn[(i, j)])),
            velocity_m_per_s: velocity,
            angular_velocity_rad_per_s: spin,
            ..PosedMesh::at_rest(&mesh, position)
        };
        for name in FIELDS {
            let mut field = build(name, &skin, 3);
            sound(field.as_mut(), &body, &skin);
            sound(field.as_mut(), &body, &skin);
        }
    }
}
