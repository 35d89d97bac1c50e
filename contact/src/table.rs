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
    ("winkler", |table, skin| {
        Ok(Box::new(WinklerLayer::new(parameters(table)?, skin)?))
    }),
    ("footprint", |table, skin| {
        Ok(Box::new(Footprint::new(parameters(table)?, skin)?))
    }),
    ("layer", |table, skin| {
        Ok(Box::new(ElasticField::new(parameters(table)?, true, skin)?))
    }),
    ("half_space", |table, skin| {
        Ok(Box::new(ElasticField::new(parameters(table)?, false, skin)?))
    }),
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
        return Err(Refusal::new(format!(
            "`contact.model` = \"{name}\" is not one of {known}"
        )));
    };
    build(parameters, skin)
}

/// What every contact field of the table must have: the force balances the pressure, there is no tension, there is no
/// force without touch, the force is finite and grows with depth, earlier calls change no answer, friction opposes
/// sliding, there is no pressure beside the skin, a pose or velocity that is not finite gives NaN, and `parameters`
/// rebuild the same contact field.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::PosedMesh;
    use crate::mesh::TriMesh;

    /// A 40 × 30 × 10 mm block whose underside rises by 1 mm along x: pressure, torque and a partial contact.
    fn wedge() -> TriMesh {
        let block = crate::mesh::cuboid([0.04, 0.03, 0.01]);
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
        let cells = field.cells_per_taxel();
        let area_m2 = (skin.pitch_m() / cells as f64).powi(2);
        let mesh = wedge();
        let poses = poses(&mesh);
        let mut last_n = 0.0;
        for body in &poses {
            let response = field.respond(body);
            let (wrench, pressure_pa) = (response.wrench, response.pressure_pa);
            assert_eq!(pressure_pa.len(), skin.taxels() * cells * cells, "{name}");
            let parts = wrench.force_n.iter().chain(&wrench.torque_nm);
            assert!(pressure_pa.iter().all(|p| *p >= 0.0), "{name}: tension");
            assert!(
                pressure_pa.iter().chain(parts).all(|v| v.is_finite()),
                "{name}: {wrench:?}"
            );
            // sums of the same numbers in another order
            let (normal_n, sum_n) = (wrench.force_n[2], pressure_pa.iter().sum::<f64>() * area_m2);
            assert!(
                (normal_n - sum_n).abs() <= 1e-9 * sum_n,
                "{name}: {normal_n} N, Σ p A = {sum_n} N"
            );
            if body.velocity_m_per_s.iter().all(|v| v.abs() <= 0.0) {
                assert!(
                    normal_n >= last_n,
                    "{name}: {normal_n} N after {last_n} N at less depth"
                );
                last_n = normal_n;
            }
        }
        // partly in contact, wholly, sliding
        for pose in [1, 2, 8] {
            no_memory(name, field.as_mut(), &poses[pose], make(toml::Table::new()).as_mut());
        }
        let slide = PosedMesh {
            velocity_m_per_s: [0.3, -0.1, 0.0],
            ..PosedMesh::at_rest(&mesh, [0.0, 0.0, -1e-3])
        };
        let drag_n = force_n(field.as_mut(), &slide);
        assert!(drag_n[0] * 0.3 - drag_n[1] * 0.1 <= 0.0, "{name}: friction drives");
        not_finite(name, field.as_mut(), &mesh);
        for position_m in [[0.0, 0.0, 1e-6], [1.0, 0.0, -1e-3], [0.0, -0.4, -1e-3]] {
            let away_n = force_n(field.as_mut(), &PosedMesh::at_rest(&mesh, position_m));
            assert!(
                away_n.iter().all(|f| f.abs() <= 0.0),
                "{name}: {away_n:?} N without touch"
            );
        }
        let mut again = make(field.parameters());
        let (a, b) = (force_n(field.as_mut(), &poses[2]), force_n(again.as_mut(), &poses[2]));
        assert_eq!(
            a.map(f64::to_bits),
            b.map(f64::to_bits),
            "{name}: parameters build another field"
        );
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
            assert!(
                worst <= tolerance * highest,
                "{name}: {worst} Pa by earlier poses, of {highest} Pa"
            );
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
            assert!(
                response.pressure_pa.iter().all(|p| p.is_finite() && *p >= 0.0),
                "{name}"
            );
        }
        assert!(force_n(field, &sound)[2] > 0.0, "{name} does not go on after NaN");
    }
}
