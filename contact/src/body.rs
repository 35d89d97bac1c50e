//! A body on the skin: a mesh with its pose and motion.

use crate::mesh::TriMesh;

/// A mesh with its pose and velocity in world axes.
///
/// ```
/// use spts_contact::{PosedMesh, mesh::sphere};
///
/// let ball = sphere(33.4e-3, 24, 48); // stands on its origin
/// let mut falling = PosedMesh::at_rest(&ball, [0.0, 0.0, 0.1]);
/// falling.velocity_m_per_s = [0.0, 0.0, -2.0];
/// assert!((falling.heights_m()[1] - 66.8e-3).abs() < 1e-9);
/// assert!(falling.is_finite());
/// ```
#[derive(Debug, Clone, Copy)]
pub struct PosedMesh<'a> {
    /// The mesh, body axes.
    pub mesh: &'a TriMesh,
    /// Rotation matrix, row-major: world = R · body + position.
    pub rotation: [[f64; 3]; 3],
    /// Position of the body origin, m.
    pub position_m: [f64; 3],
    /// Centre of mass in world axes, m. Torques are about this point.
    pub centre_of_mass_m: [f64; 3],
    /// Velocity of the centre of mass, m/s.
    pub velocity_m_per_s: [f64; 3],
    /// Angular velocity, world axes, rad/s.
    pub angular_velocity_rad_per_s: [f64; 3],
    /// Stiffness of the body's own surface in series with the skin, Pa/m; `f64::INFINITY` for a rigid body.
    pub stiffness_pa_per_m: f64,
}

impl<'a> PosedMesh<'a> {
    /// A rigid body at rest without rotation. Its origin and its centre of mass are at `position_m`.
    #[must_use]
    pub fn at_rest(mesh: &'a TriMesh, position_m: [f64; 3]) -> Self {
        Self {
            mesh,
            rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            position_m,
            centre_of_mass_m: position_m,
            velocity_m_per_s: [0.0; 3],
            angular_velocity_rad_per_s: [0.0; 3],
            stiffness_pa_per_m: f64::INFINITY,
        }
    }

    /// Heights of the lowest and the highest vertex above the body's origin in world axes, m. Without a vertex, the
    /// lowest is above the highest.
    #[must_use]
    pub fn heights_m(&self) -> [f64; 2] {
        let [_, _, up] = self.rotation;
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
        for v in &self.mesh.vertices {
            let z = up[0] * v[0] + up[1] * v[1] + up[2] * v[2];
            ends = [ends[0].min(z), ends[1].max(z)];
        }
        ends
    }

    /// Whether pose and velocity are finite, and the stiffness is not NaN.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let vectors = [
            self.position_m,
            self.centre_of_mass_m,
            self.velocity_m_per_s,
            self.angular_velocity_rad_per_s,
        ];
        let mut parts = self.rotation.iter().chain(&vectors).flatten();
        parts.all(|v| v.is_finite()) && !self.stiffness_pa_per_m.is_nan()
    }
}
