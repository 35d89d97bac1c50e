//! Force as a function of depth for a body at rest. Simulations need it before they move the body.

use crate::field::{ContactField, EquilibriumError, PosedMesh, depth_limit_m};
use spts_input::Refusal;

/// Static force–depth curve of one body in one orientation.
///
/// Depth is measured from the height at which the body's lowest vertex touches the free surface. The curve starts at a
/// depth above zero if that vertex lies beside the skin.
///
/// ```
/// use spts_contact::{DepthCurve, PosedMesh, build_contact, mesh::sphere};
/// use spts_models::SkinLayout;
///
/// let mut field = build_contact("winkler", toml::Table::new(), &SkinLayout::default())?;
/// let ball = sphere(33.4e-3, 24, 48);
/// let curve = DepthCurve::up_to_force(&mut *field, &PosedMesh::at_rest(&ball, [0.0; 3]), 20.0)?;
/// assert!(curve.depth_m(5.0) < curve.depth_m(20.0));
/// assert!(curve.energy_j() < 20.0 * curve.depth_m(20.0), "the force rises to 20 N on the way");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct DepthCurve {
    depth_m: Vec<f64>,
    force_n: Vec<f64>,
}

const SAMPLES: u32 = 64;
/// Halvings of the largest depth after which a touch is known, and what is then left of it: 2⁻⁴⁸.
const BISECTIONS: u32 = 48;
const FINEST: f64 = 1.0 / (1_u64 << BISECTIONS) as f64;
/// Error of the force at the curve's end, relative: far below what a sample of 64 resolves.
const FORCE_TOLERANCE: f64 = 1e-10;
/// Secant steps, after which a bracket is halved: the force may jump from cell to cell.
const SECANT_STEPS: u32 = 20;

/// Depth above which the body touches, m, in (0, `deep_m`], where it does.
fn touch(force_at: &mut impl FnMut(f64) -> f64, deep_m: f64) -> f64 {
    let finest_m = deep_m * FINEST;
    if force_at(finest_m) > 0.0 {
        return finest_m;
    }
    let (mut low_m, mut high_m) = (finest_m, deep_m);
    for _ in 0..BISECTIONS {
        let middle_m = 0.5 * (low_m + high_m);
        if force_at(middle_m) > 0.0 {
            high_m = middle_m;
        } else {
            low_m = middle_m;
        }
    }
    high_m
}

/// Depth in (0, `deep_m`] at which the body carries `wanted_n`, m: secant steps inside a bracket (the Illinois rule),
/// then halvings; where the force jumps over it, the depth behind the jump.
fn depth_of(force_at: &mut impl FnMut(f64) -> f64, wanted_n: f64, deep_m: f64) -> f64 {
    let (mut low_m, mut high_m) = (0.0, deep_m);
    let (mut less_n, mut more_n) = (-wanted_n, force_at(deep_m) - wanted_n);
    let mut rose = None;
    for step in 0..SECANT_STEPS + BISECTIONS {
        let secant_m = low_m - less_n * (high_m - low_m) / (more_n - less_n);
        let inside = step < SECANT_STEPS && secant_m > low_m && secant_m < high_m;
        let middle_m = if inside { secant_m } else { 0.5 * (low_m + high_m) };
        let over_n = force_at(middle_m) - wanted_n;
        if over_n.abs() <= FORCE_TOLERANCE * wanted_n {
            return middle_m;
        }
        let over = over_n > 0.0;
        // the end that stays put twice in a row counts half
        let share = if rose == Some(over) { 0.5 } else { 1.0 };
        if over {
            (high_m, more_n, less_n) = (middle_m, over_n, share * less_n);
        } else {
            (low_m, less_n, more_n) = (middle_m, over_n, share * more_n);
        }
        rose = Some(over);
    }
    high_m
}

impl DepthCurve {
    /// The curve of a body that has not been pressed yet: no depth and no force, whatever is asked of it.
    pub fn empty() -> Self {
        let nothing = vec![0.0; 2];
        Self { depth_m: nothing.clone(), force_n: nothing }
    }

    /// The curve of `body` up to the force `force_n`. The body's velocity and height are ignored.
    ///
    /// # Errors
    /// [`EquilibriumError`] if no depth up to the body's height plus 5 cm gives that force, or the field has no answer.
    pub fn up_to_force(
        field: &mut dyn ContactField,
        body: &PosedMesh<'_>,
        force_n: f64,
    ) -> Result<Self, EquilibriumError> {
        let [low_m, _] = body.heights_m();
        let touch_m = -low_m;
        let [x, y, _] = body.position_m;
        let mut force_at = |depth_m: f64| {
            let posed = PosedMesh {
                position_m: [x, y, touch_m - depth_m],
                velocity_m_per_s: [0.0; 3],
                angular_velocity_rad_per_s: [0.0; 3],
                ..*body
            };
            field.respond(&posed).wrench.force_n[2]
        };
        let limit_m = depth_limit_m(body);
        let mut deep_m = 1e-4;
        loop {
            let reached_n = force_at(deep_m);
            if reached_n >= force_n {
                break;
            }
            if reached_n.is_nan() {
                return Err(EquilibriumError::no_answer(deep_m));
            }
            if deep_m >= limit_m {
                let (wanted_n, depth_m) = (force_n, deep_m);
                return Err(if reached_n > 0.0 {
                    EquilibriumError::Force { reached_n, wanted_n, depth_m }
                } else {
                    EquilibriumError::Beside { depth_m }
                });
            }
            deep_m = (2.0 * deep_m).min(limit_m);
        }
        let (first_m, last_m) = (touch(&mut force_at, deep_m), depth_of(&mut force_at, force_n, deep_m));
        let depths = (0..=SAMPLES).map(|i| {
            let s = f64::from(i) / f64::from(SAMPLES);
            first_m + (last_m - first_m) * s * s
        });
        let depth_m: Vec<f64> = depths.collect();
        let mut force: Vec<f64> = depth_m.iter().map(|&d| force_at(d)).collect();
        if let Some(i) = force.iter().position(|f| f.is_nan()) {
            return Err(EquilibriumError::no_answer(depth_m[i]));
        }
        force[0] = 0.0;
        Ok(Self { depth_m, force_n: force })
    }

    /// The curve up to the depth at which the contact has absorbed `energy_j`.
    ///
    /// # Errors
    /// [`EquilibriumError`] if no depth in the range of [`DepthCurve::up_to_force`] absorbs that energy.
    pub fn up_to_energy(
        field: &mut dyn ContactField,
        body: &PosedMesh<'_>,
        energy_j: f64,
    ) -> Result<Self, EquilibriumError> {
        // by the exponent of 1.5 in the last force: the curve, its energy, and the depth below which there is no more
        let mut curve_of = |exponent: i32| -> Result<(Self, f64, Option<f64>), EquilibriumError> {
            let (curve, deepest_m) = match Self::up_to_force(field, body, 1.5_f64.powi(exponent)) {
                Err(EquilibriumError::Force { reached_n, depth_m, .. }) => {
                    (Self::up_to_force(field, body, reached_n)?, Some(depth_m))
                }
                curve => (curve?, None),
            };
            let reached_j = curve.energy_j();
            Ok((curve, reached_j, deepest_m))
        };
        // the first exponent that is enough, or that is beyond what the body can be pressed with
        let mut below = -1;
        let mut stride = 4;
        let mut found = loop {
            let tried = curve_of(below + stride)?;
            if tried.1 >= energy_j || tried.2.is_some() {
                break (below + stride, tried);
            }
            below += stride;
        };
        while found.0 - below > 1 {
            stride = (found.0 - below) / 2;
            let tried = curve_of(below + stride)?;
            if tried.1 >= energy_j || tried.2.is_some() {
                found = (below + stride, tried);
            } else {
                below += stride;
            }
        }
        match found.1 {
            (_, reached_j, Some(depth_m)) if reached_j < energy_j => Err(Refusal::new(format!(
                "the contact absorbs at most {reached_j:.4e} J, down to {depth_m:.4} m depth, and {energy_j:.4e} J are \
                 needed"
            ))
            .into()),
            (curve, ..) => Ok(curve),
        }
    }

    /// Work to the end of the curve, J.
    pub fn energy_j(&self) -> f64 {
        let pairs = self.depth_m.windows(2).zip(self.force_n.windows(2));
        pairs.map(|(d, f)| 0.5 * (d[1] - d[0]) * (f[0] + f[1])).sum()
    }

    /// Depth at `force_n`, limited to the curve, m.
    pub fn depth_m(&self, force_n: f64) -> f64 {
        let i = self.segment(force_n);
        let step_n = self.force_n[i + 1] - self.force_n[i];
        let s = ((force_n - self.force_n[i]) / step_n.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        self.depth_m[i] + s * (self.depth_m[i + 1] - self.depth_m[i])
    }

    /// Compliance dδ/dF at `force_n`, m/N.
    pub fn compliance_m_per_n(&self, force_n: f64) -> f64 {
        let i = self.segment(force_n);
        let step_n = (self.force_n[i + 1] - self.force_n[i]).max(1e-9);
        (self.depth_m[i + 1] - self.depth_m[i]) / step_n
    }

    /// Largest stiffness dF/dδ between an eighth of the last force and the end, N/m. The time step of a simulation must
    /// resolve it. (At smaller forces, single cells make jumps in the curve that no oscillation can follow.)
    pub fn stiffness_n_per_m(&self) -> f64 {
        let last = self.segments();
        let floor_n = self.force_n[last] / 8.0;
        (0..last)
            .filter(|&i| self.force_n[i + 1] >= floor_n)
            .map(|i| (self.force_n[i + 1] - self.force_n[i]) / (self.depth_m[i + 1] - self.depth_m[i]).max(1e-12))
            .fold(0.0, f64::max)
    }

    fn segments(&self) -> usize {
        self.depth_m.len() - 1
    }

    fn segment(&self, force_n: f64) -> usize {
        let after = self.force_n.partition_point(|&f| f <= force_n);
        after.clamp(1, self.segments()) - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::WinklerLayer;
    use crate::foam::Foam;
    use crate::mesh::TriMesh;
    use approx::assert_relative_eq;
    use spts_models::SkinLayout;

    #[test]
    fn an_empty_curve_answers() {
        let curve = DepthCurve::empty();
        let answers = [
            curve.depth_m(3.0),
            curve.depth_m(f64::INFINITY),
            curve.compliance_m_per_n(3.0),
            curve.stiffness_n_per_m(),
            curve.energy_j(),
        ];
        assert_eq!(answers.map(f64::to_bits), [0; 5]);
    }

    /// A 30 mm square plate on a thick layer of K = 1e7 Pa/m: 12 whole cells a side, k = K A = 9000 N/m.
    #[test]
    fn plate_is_a_linear_spring() {
        let config = Foam { stiffness_pa_per_m: 1e7, thickness_m: 10.0, ..Foam::default() };
        let mut layer = WinklerLayer::new(config, &SkinLayout::default()).unwrap();
        let vertices = vec![[-0.015, -0.015, 0.0], [0.015, -0.015, 0.0], [0.015, 0.015, 0.0], [-0.015, 0.015, 0.0]];
        let mesh = TriMesh { vertices, triangles: vec![[0, 2, 1], [0, 3, 2]] };
        let body = PosedMesh::at_rest(&mesh, [0.0; 3]);
        let curve = DepthCurve::up_to_force(&mut layer, &body, 20.0).unwrap();
        // stiffening of 20/9000/8.5 m = 2.6e-4 at the end of the curve
        assert_relative_eq!(curve.depth_m(9.0), 1e-3, max_relative = 1e-3);
        assert_relative_eq!(curve.compliance_m_per_n(10.0), 1.0 / 9000.0, max_relative = 1e-3);
        assert_relative_eq!(curve.stiffness_n_per_m(), 9000.0, max_relative = 1e-3);
        assert_relative_eq!(curve.energy_j(), 0.5 * 20.0 * 20.0 / 9000.0, max_relative = 1e-3);
        let away = PosedMesh::at_rest(&mesh, [0.5, 0.0, 0.0]);
        let error = DepthCurve::up_to_force(&mut layer, &away, 20.0).unwrap_err();
        assert!(error.to_string().contains("lies beside the skin"), "{error}");
        // the deepest point, 5 cm below a flat plate, carries less than 9000 N/m · 0.05 m / (1 − 0.05/8.5) = 452.7 N
        // and absorbs less than half of that times the depth
        let error = DepthCurve::up_to_force(&mut layer, &body, 1000.0).unwrap_err();
        let EquilibriumError::Force { reached_n, depth_m, .. } = error else { panic!("{error}") };
        assert_relative_eq!(depth_m, 0.05, max_relative = 1e-12);
        assert_relative_eq!(reached_n, 452.7, max_relative = 1e-3);
        let error = DepthCurve::up_to_energy(&mut layer, &body, 20.0).unwrap_err();
        let said = error.to_string();
        let rest = said.strip_prefix("the contact absorbs at most ").unwrap();
        let reached_j: f64 = rest.split_once(" J").unwrap().0.parse().unwrap();
        assert_relative_eq!(reached_j, 0.5 * 452.7 * 0.05, max_relative = 3e-3);
        // energy between the curve of the last power of 1.5 N, 438 N, and the deepest one
        assert!(DepthCurve::up_to_energy(&mut layer, &body, 0.999 * reached_j).is_ok());
    }
}
