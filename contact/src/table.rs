//! The table of contact fields.

use crate::columns::{Footprint, WinklerLayer};
use crate::elastic::ElasticField;
use crate::field::ContactField;
use serde::de::DeserializeOwned;
use spts_input::Refusal;
use spts_models::{SkinLayout, in_section, parsed};

/// Builds a contact field from the parameters of a scene's `[contact]` section (without `model`).
pub type ContactBuild = fn(toml::Table, &SkinLayout) -> Result<Box<dyn ContactField>, Refusal>;

/// Contact fields with the names that scenes use.
pub type ContactTable = &'static [(&'static str, ContactBuild)];

/// Every contact field of this crate.
pub const CONTACT_FIELDS: ContactTable = &[
    ("winkler", |table, skin| Ok(Box::new(WinklerLayer::new(parameters(table)?, skin)?))),
    ("footprint", |table, skin| Ok(Box::new(Footprint::new(parameters(table)?, skin)?))),
    ("layer", |table, skin| Ok(Box::new(ElasticField::new(parameters(table)?, true, skin)?))),
    ("half_space", |table, skin| Ok(Box::new(ElasticField::new(parameters(table)?, false, skin)?))),
];

/// The parameters of a contact field in the section `[contact]` of a scene.
///
/// # Errors
/// [`Refusal`] for an unknown key or a value of the wrong type.
fn parameters<T: DeserializeOwned>(table: toml::Table) -> Result<T, Refusal> {
    parsed(table).map_err(|error| Refusal::new(in_section("contact", &error.to_string())))
}

/// Builds the contact field that scenes call `name`, for the layout `skin`. `parameters` are its section `[contact]`
/// without `model`; missing ones take their defaults.
///
/// ```
/// use spts_contact::build_contact;
/// use spts_models::SkinLayout;
///
/// let parameters = toml::toml! { stiffness_pa_per_m = 1.0 };
/// let error = build_contact("winkler", parameters, &SkinLayout::default()).err().expect("too soft");
/// assert!(error.to_string().contains("`contact.stiffness_pa_per_m` = 1"));
/// ```
///
/// # Errors
/// [`Refusal`] if the name is unknown or a parameter is not valid.
pub fn build_contact(name: &str, parameters: toml::Table, skin: &SkinLayout) -> Result<Box<dyn ContactField>, Refusal> {
    build_contact_from(&[CONTACT_FIELDS], name, parameters, skin)
}

/// Builds the contact field called `name` from the first of `tables` that has it. It is for programs with contact
/// fields of their own: `tables` are then [`CONTACT_FIELDS`] and theirs.
///
/// # Errors
/// [`Refusal`] if no table has the name, or a parameter is not valid.
pub fn build_contact_from(
    tables: &[ContactTable],
    name: &str,
    parameters: toml::Table,
    skin: &SkinLayout,
) -> Result<Box<dyn ContactField>, Refusal> {
    let all = || tables.iter().copied().flatten();
    let Some((_, build)) = all().find(|(known, _)| *known == name) else {
        let known: Vec<_> = all().map(|(known, _)| format!("\"{known}\"")).collect();
        let known = known.join(", ");
        return Err(Refusal::new(format!("`contact.model` = \"{name}\" is not one of {known}")));
    };
    build(parameters, skin)
}

/// What every contact field of the table must have: force and torque balance the pressure, there is no tension, there
/// is no force without touch, the force is finite and grows with depth, earlier calls change no answer, friction
/// opposes sliding, there is no pressure beside the skin, a pose or velocity that is not finite gives NaN, and
/// `parameters` rebuild the same contact field.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::PosedMesh;
    use crate::mesh::{TriMesh, cuboid, cylinder, sphere};
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    /// A 40 × 30 × 10 mm block whose underside rises by 1 mm along x: pressure, torque and a partial contact.
    fn wedge() -> TriMesh {
        let block = cuboid([0.04, 0.03, 0.01]);
        block.mapped(|[x, y, z]| if z > 0.0 { [x, y, z] } else { [x, y, 0.025 * (x + 0.02)] })
    }

    fn poses(mesh: &TriMesh) -> Vec<PosedMesh<'_>> {
        let deep = [1e-6, 1e-4, 1e-3, 3e-3, 8e-3, 0.05, 1.0].map(|d| PosedMesh::at_rest(mesh, [0.01, -0.02, -d]));
        let fast = [(1e-3, 3.0), (1e-3, -3.0), (0.01, 50.0), (0.01, -50.0)].map(|(depth_m, v)| PosedMesh {
            velocity_m_per_s: [0.1, 0.2, v],
            angular_velocity_rad_per_s: [5.0, -3.0, 8.0],
            ..PosedMesh::at_rest(mesh, [0.07, 0.06, -depth_m])
        });
        deep.into_iter().chain(fast).collect()
    }

    fn force_n(field: &mut dyn ContactField, body: &PosedMesh<'_>) -> [f64; 3] {
        field.respond(body).wrench.force_n
    }

    #[test]
    fn every_field_conforms() {
        for (name, build) in CONTACT_FIELDS {
            conforms(name, *build);
        }
    }

    fn conforms(name: &str, build: ContactBuild) {
        let skin = SkinLayout::default();
        let make = |table| build(table, &skin).unwrap();
        let mut field = make(toml::Table::new());
        let mesh = wedge();
        let poses = poses(&mesh);
        let mut last_n = 0.0;
        for body in &poses {
            let (normal_n, _) = sound(name, field.as_mut(), body, &skin);
            if body.velocity_m_per_s.iter().all(|v| v.abs() <= 0.0) {
                assert!(normal_n >= last_n, "{name}: {normal_n} N after {last_n} N at less depth");
                last_n = normal_n;
            }
        }
        // partly in contact, wholly, sliding
        for pose in [1, 2, 8] {
            no_memory(name, field.as_mut(), &poses[pose], make(toml::Table::new()).as_mut());
        }
        let slide = PosedMesh { velocity_m_per_s: [0.3, -0.1, 0.0], ..PosedMesh::at_rest(&mesh, [0.0, 0.0, -1e-3]) };
        let drag_n = force_n(field.as_mut(), &slide);
        assert!(drag_n[0] * 0.3 - drag_n[1] * 0.1 <= 0.0, "{name}: friction drives");
        not_finite(name, field.as_mut(), &mesh);
        for position_m in [[0.0, 0.0, 1e-6], [1.0, 0.0, -1e-3], [0.0, -0.4, -1e-3]] {
            let away_n = force_n(field.as_mut(), &PosedMesh::at_rest(&mesh, position_m));
            assert!(away_n.iter().all(|f| f.abs() <= 0.0), "{name}: {away_n:?} N without touch");
        }
        let mut again = make(field.parameters());
        let (a, b) = (force_n(field.as_mut(), &poses[2]), force_n(again.as_mut(), &poses[2]));
        assert_eq!(a.map(f64::to_bits), b.map(f64::to_bits), "{name}: parameters build another field");
    }

    /// Answers with finite numbers, no tension and nothing outside the patch; force and torque are those of the
    /// pressure (sums of the same numbers in another order; friction has a torque of its own). The force, N, and the
    /// cells under pressure.
    fn sound(name: &str, field: &mut dyn ContactField, body: &PosedMesh<'_>, skin: &SkinLayout) -> (f64, usize) {
        let cells = field.cells_per_taxel();
        let (rows, cols) = (skin.rows() * cells, skin.cols() * cells);
        let cell_m = skin.pitch_m() / cells as f64;
        let response = field.respond(body);
        let (wrench, pressure_pa) = (response.wrench, response.pressure_pa);
        assert_eq!(pressure_pa.len(), rows * cols, "{name}");
        let parts = wrench.force_n.iter().chain(&wrench.torque_nm);
        assert!(pressure_pa.iter().all(|p| *p >= 0.0), "{name}: tension");
        assert!(pressure_pa.iter().chain(parts).all(|v| v.is_finite()), "{name}: {wrench:?}");
        let at = |i: usize, n: usize| (i as f64 + 0.5 - 0.5 * n as f64) * cell_m;
        let (mut force_n, mut torque_nm) = (0.0, [0.0; 2]);
        for (i, p) in pressure_pa.iter().enumerate() {
            let (x, y) = (at(i % cols, cols), -at(i / cols, rows));
            let arm = [y - body.centre_of_mass_m[1], body.centre_of_mass_m[0] - x];
            let part_n = p * cell_m * cell_m;
            force_n += part_n;
            torque_nm = [0, 1].map(|k| torque_nm[k] + arm[k] * part_n);
        }
        let size_nm = force_n * (rows + cols) as f64 * cell_m;
        let near = |a: f64, b: f64, size: f64| (a - b).abs() <= 1e-9 * size;
        assert!(near(wrench.force_n[2], force_n, force_n), "{name}: {wrench:?}, Σ p A = {force_n} N");
        let moves = body.velocity_m_per_s.iter().chain(&body.angular_velocity_rad_per_s);
        if moves.copied().all(|v| v == 0.0) {
            for (found_nm, sum_nm) in wrench.torque_nm.into_iter().zip(torque_nm) {
                assert!(near(found_nm, sum_nm, size_nm), "{name}: {wrench:?}, Σ p A r = {torque_nm:?} N m");
            }
        }
        if let Some(patch) = response.patch {
            let inside: f64 = patch.lines(cols).flat_map(|line| &pressure_pa[line]).sum();
            assert!(near(inside * cell_m * cell_m, force_n, force_n), "{name}: outside {patch:?}");
        }
        (wrench.force_n[2], pressure_pa.iter().filter(|p| **p > 0.0).count())
    }

    /// A block, and a pin narrower than a cell, moved in steps of 0.1 mm over two taxels. No place is missed, and the
    /// middle of the map stays within 0.1 mm of the body's: cells of 2.5 mm do for the block, but a map cannot tell
    /// where a pin is within a cell, so it needs cells of 0.6 mm. Columns carry the same force everywhere; an elastic
    /// surface is pressed hardest at an edge, and what the grid has of that depends on its place: 1 % under the block,
    /// 10 % under a pin on two cells, half of it under one on a part of a cell.
    #[test]
    fn the_map_follows_the_body() {
        let skin = SkinLayout::default();
        let (block, pin) = (cuboid([0.04, 0.04, 0.01]), cylinder(0.5e-3, 0.02, 24));
        let bodies = [(&block, 6, 1e-4, 0.01), (&pin, 24, 1e-4, 0.1), (&pin, 6, 1.25e-3, 0.5)];
        for &(name, build) in CONTACT_FIELDS {
            for (mesh, cells, most_m, spread) in bodies {
                let mut table = toml::Table::new();
                table.insert("cells_per_taxel".to_owned(), cells.into());
                let mut field = build(table, &skin).unwrap();
                let cols = skin.cols() * usize::try_from(cells).unwrap();
                let cell_m = skin.pitch_m() / f64::from(cells);
                let mut forces_n = [f64::INFINITY, 0.0_f64];
                for step in 0..300 {
                    let x_m = 1e-4 * f64::from(step) - 0.01;
                    let response = field.respond(&PosedMesh::at_rest(mesh, [x_m, 0.37e-3, -0.8e-3]));
                    let (mut sum, mut moment) = (0.0, 0.0);
                    for (i, p) in response.pressure_pa.iter().enumerate() {
                        sum += p;
                        moment += p * ((i % cols) as f64 + 0.5 - 0.5 * cols as f64) * cell_m;
                    }
                    let off_m = (moment / sum - x_m).abs();
                    assert!(off_m < most_m, "{name}: {off_m} m off at {x_m} m");
                    let force_n = response.wrench.force_n[2];
                    forces_n = [forces_n[0].min(force_n), forces_n[1].max(force_n)];
                }
                let spread = if ["winkler", "footprint"].contains(&name) { 1e-9 } else { spread };
                assert!(forces_n[1] < (1.0 + spread) * forces_n[0], "{name}: {forces_n:?} N");
            }
        }
    }

    /// One cell a taxel, and the parameters that a field of the table takes.
    fn coarse(name: &str, thickness_m: f64, poisson: f64) -> toml::Table {
        let mut table = toml::toml! { cells_per_taxel = 1 };
        table.insert("thickness_m".to_owned(), thickness_m.into());
        if ["layer", "half_space"].contains(&name) {
            table.insert("poisson".to_owned(), poisson.into());
        }
        table
    }

    /// One taxel, a small square and a strip, of 0.1 mm, 15 mm and 0.1 m, thicknesses from 0.1 mm to 10 m: a ball that
    /// touches one cell, presses, drowns and lies beside the skin, and a plate over everything. Up to 1000 cells of
    /// 1000 thicknesses.
    #[test]
    fn any_skin() {
        let squares = [(1, 1, 1e-4), (1, 1, 0.1), (5, 7, 1e-4), (5, 7, 0.1), (5, 7, 3e-3)];
        let strips = [(1, 1000, 15e-3), (1, 1000, 1e-4)];
        for (rows, cols, pitch_m) in squares.into_iter().chain(strips) {
            let skin = SkinLayout::new(rows, cols, pitch_m, 0.5 * pitch_m).unwrap();
            for (thickness_m, poisson) in [(1e-4, 0.49), (6e-3, 0.2), (10.0, 0.0)] {
                for (name, build) in CONTACT_FIELDS {
                    let mut field = build(coarse(name, thickness_m, poisson), &skin).unwrap();
                    any_body(name, field.as_mut(), &skin);
                }
            }
        }
    }

    fn any_body(name: &str, field: &mut dyn ContactField, skin: &SkinLayout) {
        let pitch_m = skin.pitch_m();
        let ball = sphere(pitch_m.min(0.05), 8, 12);
        // the lowest vertex on a cell's centre
        let even = skin.cols().is_multiple_of(2);
        let x_m = if even { 0.5 * pitch_m } else { 0.0 };
        let at = |z| PosedMesh::at_rest(&ball, [x_m, 0.0, z]);
        assert!(sound(name, field, &at(1e-9), skin).0 <= 0.0);
        let (force_n, loaded) = sound(name, field, &at(-1e-3 * pitch_m), skin);
        assert!(force_n > 0.0 && loaded == 1, "{name}: {force_n} N on {loaded} cells of {pitch_m} m");
        for depth_m in [0.5 * pitch_m, 10.0] {
            assert!(sound(name, field, &at(-depth_m), skin).0 > 0.0);
        }
        let beside = PosedMesh::at_rest(&ball, [1e3 * pitch_m, 0.0, -1e-3 * pitch_m]);
        assert!(sound(name, field, &beside, skin).0 <= 0.0);
        let plate = cuboid([2e3 * pitch_m, 20.0 * pitch_m, pitch_m]);
        let flooding = PosedMesh::at_rest(&plate, [0.0, 0.0, -1e-2 * pitch_m]);
        let (force_n, loaded) = sound(name, field, &flooding, skin);
        assert!(force_n > 0.0 && loaded == skin.taxels(), "{name}: {force_n} N on {loaded} cells");
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            rng_seed: RngSeed::Fixed(7),
            failure_persistence: None,
            ..ProptestConfig::with_cases(48)
        })]
        /// Soups of triangles, many of them without area, in any pose and motion; then again, from memory.
        #[test]
        fn any_soup(
            points in prop::collection::vec(prop::array::uniform3(-0.05..0.05_f64), 3..12),
            picks in prop::collection::vec(prop::array::uniform3(0..12_usize), 1..20),
            q in prop::array::uniform4(-1.0..1.0_f64),
            position in prop::array::uniform3(-0.08..0.08_f64),
            velocity in prop::array::uniform3(-5.0..5.0_f64),
            spin in prop::array::uniform3(-50.0..50.0_f64),
            poisson in 0.0..0.49_f64,
            flat in prop::bool::ANY,
        ) {
            let n = points.len();
            let mesh = TriMesh {
                vertices: points.iter().map(|p| if flat { [p[0], p[1], 0.0] } else { *p }).collect(),
                triangles: picks.iter().map(|t| t.map(|i| u32::try_from(i % n).unwrap())).collect(),
            };
            let skin = SkinLayout::new(8, 8, 15e-3, 7.5e-3).unwrap();
            let turn = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[0] + 1.1, q[1], q[2], q[3]));
            let body = PosedMesh {
                rotation: turn.to_rotation_matrix().matrix().transpose().into(),
                velocity_m_per_s: velocity,
                angular_velocity_rad_per_s: spin,
                ..PosedMesh::at_rest(&mesh, position)
            };
            for (name, build) in CONTACT_FIELDS {
                let mut table = coarse(name, 6e-3, poisson);
                table.insert("cells_per_taxel".to_owned(), 2.into());
                let mut field = build(table, &skin).unwrap();
                for _ in 0..2 {
                    sound(name, field.as_mut(), &body, &skin);
                }
            }
        }
    }

    /// The first answer of a fresh field, its second and that of a used one.
    fn no_memory(name: &str, used: &mut dyn ContactField, body: &PosedMesh<'_>, fresh: &mut dyn ContactField) {
        let tolerance = used.tolerance().max(fresh.tolerance());
        let first = fresh.respond(body);
        let (wrench, pressure_pa) = (first.wrench, first.pressure_pa.to_vec());
        let highest = pressure_pa.iter().copied().fold(0.0, f64::max);
        for again in [fresh.respond(body), used.respond(body)] {
            let pairs = again.pressure_pa.iter().zip(&pressure_pa);
            let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst <= tolerance * highest, "{name}: {worst} Pa by earlier poses, of {highest} Pa");
            if tolerance <= 0.0 {
                let bits = |v: [f64; 3]| v.map(f64::to_bits);
                assert_eq!(bits(again.wrench.force_n), bits(wrench.force_n), "{name}");
                assert_eq!(bits(again.wrench.torque_nm), bits(wrench.torque_nm), "{name}");
            }
        }
    }

    /// A body that is not anywhere has no wrench: zero would let the world go on.
    fn not_finite(name: &str, field: &mut dyn ContactField, mesh: &TriMesh) {
        let sound = PosedMesh::at_rest(mesh, [0.0, 0.0, -1e-3]);
        let mut broken = [sound; 4];
        broken[0].position_m[2] = f64::NAN;
        broken[1].rotation[2][1] = f64::NAN;
        broken[2].velocity_m_per_s[0] = f64::INFINITY;
        broken[3].angular_velocity_rad_per_s[1] = f64::NAN;
        for body in &broken {
            let response = field.respond(body);
            assert!(response.wrench.force_n[2].is_nan(), "{name}");
            assert!(response.pressure_pa.iter().all(|p| p.is_finite() && *p >= 0.0), "{name}");
        }
        assert!(force_n(field, &sound)[2] > 0.0, "{name} does not go on after NaN");
    }
}
