//! Properties that every contact field must have.

use crate::body::PosedMesh;
use crate::field::ContactField;
use crate::frame::Wrench;
use crate::mesh::TriMesh;
use crate::table::ContactBuild;
use spts_models::SkinLayout;

/// A property that [`ContactField`] demands and an implementation lacks.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{check}: got {actual:e}, expected {expected}")]
pub struct Nonconformity {
    /// Name of the property.
    pub check: &'static str,
    /// Value found.
    pub actual: f64,
    /// Expected value.
    pub expected: String,
}

/// Checks the contact field that `build` makes with default parameters for the properties of [`ContactField`]: the
/// force balances the pressure, there is no tension, there is no force without touch, the force is finite and grows
/// with depth, earlier calls change no answer, friction opposes sliding, there is no pressure beside the skin, a pose
/// or velocity that is not finite gives NaN, and `parameters` rebuild the same contact field.
///
/// ```
/// use spts_contact::{WinklerConfig, WinklerLayer, conformance};
///
/// // a contact field of your own passes the same checks
/// conformance(|parameters, skin| {
///     let config: WinklerConfig = parameters.try_into()?;
///     Ok(Box::new(WinklerLayer::new(config, skin)?))
/// })?;
/// # Ok::<(), spts_contact::Nonconformity>(())
/// ```
///
/// # Errors
/// The first [`Nonconformity`] found.
pub fn conformance(build: ContactBuild) -> Result<(), Nonconformity> {
    let skin = SkinLayout::default();
    let make = |table| {
        build(table, &skin).map_err(|error| Nonconformity {
            check: "builds",
            actual: f64::NAN,
            expected: error.to_string(),
        })
    };
    let mut field = make(toml::Table::new())?;
    let cells = field.cells_per_taxel();
    let area_m2 = (skin.pitch_m() / f64::from(u32::try_from(cells).unwrap_or(u32::MAX))).powi(2);
    let mesh = wedge();
    let poses = poses(&mesh);
    let mut last_n = 0.0;
    for body in &poses {
        let response = field.respond(body);
        let sum: f64 = response.pressure_pa.iter().sum::<f64>() * area_m2;
        let normal = response.wrench.force_n[2];
        check(
            "one value a grid square",
            response.pressure_pa.len() == skin.taxels() * cells * cells,
            response.pressure_pa.len(),
            "taxels × cells²",
        )?;
        let lowest = response.pressure_pa.iter().copied().fold(f64::INFINITY, f64::min);
        check("no tension", lowest >= 0.0, lowest, "≥ 0 Pa")?;
        let parts = response.wrench.force_n.iter().chain(&response.wrench.torque_nm);
        let finite = response.pressure_pa.iter().chain(parts).all(|v| v.is_finite());
        check("finite", finite, normal, "finite pressure and wrench")?;
        // sums of the same numbers in another order
        check("normal force = Σ p A", (normal - sum).abs() <= 1e-9 * sum, normal, sum)?;
        if body.velocity_m_per_s.map(f64::abs).iter().sum::<f64>() <= 0.0 {
            check("grows with depth", normal >= last_n, normal, format!("≥ {last_n:e} N"))?;
            last_n = normal;
        }
    }
    // partly in contact, wholly, sliding
    for pose in [1, 2, 8] {
        no_memory(field.as_mut(), &poses[pose], make(toml::Table::new())?.as_mut())?;
    }
    friction(field.as_mut(), &mesh)?;
    not_finite(field.as_mut(), &mesh)?;
    for position_m in [[0.0, 0.0, 1e-6], [1.0, 0.0, -1e-3], [0.0, -0.4, -1e-3]] {
        let force_n = field.respond(&PosedMesh::at_rest(&mesh, position_m)).wrench.force_n;
        check(
            "nothing without touch",
            force_n.iter().all(|f| f.abs() <= 0.0),
            force_n[2],
            "0 N",
        )?;
    }
    let mut again = make(field.parameters())?;
    let (a, b) = (force_n(field.as_mut(), &poses[2]), force_n(again.as_mut(), &poses[2]));
    check(
        "parameters rebuild the field",
        a.map(f64::to_bits) == b.map(f64::to_bits),
        b[2],
        a[2],
    )
}

fn check(check: &'static str, ok: bool, actual: impl Number, expected: impl ToString) -> Result<(), Nonconformity> {
    if ok {
        return Ok(());
    }
    Err(Nonconformity {
        check,
        actual: actual.number(),
        expected: expected.to_string(),
    })
}

trait Number {
    fn number(self) -> f64;
}

impl Number for f64 {
    fn number(self) -> f64 {
        self
    }
}

impl Number for usize {
    fn number(self) -> f64 {
        f64::from(u32::try_from(self).unwrap_or(u32::MAX))
    }
}

/// A 40 × 30 × 10 mm block whose underside rises by 1 mm along x: pressure, torque and a partial contact.
fn wedge() -> TriMesh {
    let mut vertices = Vec::new();
    for (x, bottom) in [(-0.02, 0.0), (0.02, 1e-3)] {
        for y in [-0.015, 0.015] {
            vertices.extend([[x, y, bottom], [x, y, 0.01]]);
        }
    }
    let quads = [
        [0, 2, 6, 4],
        [1, 5, 7, 3],
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
    ];
    let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
    TriMesh {
        vertices,
        triangles: triangles.collect(),
    }
}

fn poses(mesh: &TriMesh) -> Vec<PosedMesh<'_>> {
    let mut poses = Vec::new();
    for depth_m in [1e-6, 1e-4, 1e-3, 3e-3, 8e-3, 0.05, 1.0] {
        poses.push(PosedMesh::at_rest(mesh, [0.01, -0.02, -depth_m]));
    }
    for (depth_m, v) in [(1e-3, 3.0), (1e-3, -3.0), (0.01, 50.0), (0.01, -50.0)] {
        poses.push(PosedMesh {
            velocity_m_per_s: [0.1, 0.2, v],
            angular_velocity_rad_per_s: [5.0, -3.0, 8.0],
            ..PosedMesh::at_rest(mesh, [0.07, 0.06, -depth_m])
        });
    }
    poses
}

fn force_n(field: &mut dyn ContactField, body: &PosedMesh<'_>) -> [f64; 3] {
    field.respond(body).wrench.force_n
}

/// The first answer of a fresh field, its second and that of a used one.
fn no_memory(
    used: &mut dyn ContactField,
    body: &PosedMesh<'_>,
    fresh: &mut dyn ContactField,
) -> Result<(), Nonconformity> {
    let tolerance = used.tolerance().max(fresh.tolerance());
    let bits = |w: Wrench| [w.force_n, w.torque_nm].map(|v| v.map(f64::to_bits));
    let first = fresh.respond(body);
    let (wrench, pressure_pa) = (first.wrench, first.pressure_pa.to_vec());
    let highest = pressure_pa.iter().copied().fold(0.0, f64::max);
    for again in [fresh.respond(body), used.respond(body)] {
        let pairs = again.pressure_pa.iter().zip(&pressure_pa);
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        check(
            "no memory of earlier poses",
            worst <= tolerance * highest,
            worst,
            format!("≤ {:e} Pa", tolerance * highest),
        )?;
        check(
            "same wrench, bit for bit",
            tolerance > 0.0 || bits(again.wrench) == bits(wrench),
            again.wrench.torque_nm[1],
            wrench.torque_nm[1],
        )?;
    }
    Ok(())
}

/// A body that is not anywhere has no wrench: zero would let the world go on.
fn not_finite(field: &mut dyn ContactField, mesh: &TriMesh) -> Result<(), Nonconformity> {
    let sound = PosedMesh::at_rest(mesh, [0.0, 0.0, -1e-3]);
    let mut broken = [sound; 4];
    broken[0].position_m[2] = f64::NAN;
    broken[1].rotation[2][1] = f64::NAN;
    broken[2].velocity_m_per_s[0] = f64::INFINITY;
    broken[3].angular_velocity_rad_per_s[1] = f64::NAN;
    for body in &broken {
        let response = field.respond(body);
        let answer = response.wrench.force_n[2];
        check("NaN for NaN", answer.is_nan(), answer, f64::NAN)?;
        let finite = response.pressure_pa.iter().all(|p| p.is_finite() && *p >= 0.0);
        check("finite pressure for NaN", finite, answer, "finite, not negative")?;
    }
    let after = force_n(field, &sound)[2];
    check("goes on after NaN", after > 0.0, after, "> 0 N")
}

fn friction(field: &mut dyn ContactField, mesh: &TriMesh) -> Result<(), Nonconformity> {
    let slide = PosedMesh {
        velocity_m_per_s: [0.3, -0.1, 0.0],
        ..PosedMesh::at_rest(mesh, [0.0, 0.0, -1e-3])
    };
    let force = force_n(field, &slide);
    let power_w = force[0] * 0.3 - force[1] * 0.1;
    check("friction never drives", power_w <= 0.0, power_w, "≤ 0 W")
}
