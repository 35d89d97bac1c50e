//! Contact fields: how the foam answers a posed mesh.

use crate::frame::Wrench;
use crate::mesh::TriMesh;

/// A mesh with its pose and velocity in world axes.
#[derive(Debug, Clone, Copy)]
pub struct PosedMesh<'a> {
    /// The mesh, body axes.
    pub mesh: &'a TriMesh,
    /// Rotation matrix, row-major: world = R · body + position.
    pub rotation: [[f64; 3]; 3],
    /// Position of the body origin, m.
    pub position_m: [f64; 3],
    /// Centre of mass, world axes, m: torques are taken about it.
    pub centre_of_mass_m: [f64; 3],
    /// Velocity of the centre of mass, m/s.
    pub velocity_m_per_s: [f64; 3],
    /// Angular velocity, world axes, rad/s.
    pub angular_velocity_rad_per_s: [f64; 3],
}

/// Answer of a contact field.
#[derive(Debug, Clone, Copy)]
pub struct Response<'a> {
    /// Wrench on the body.
    pub wrench: Wrench,
    /// Fine pressure field, Pa, shape `(rows · cells, cols · cells)`, row-major in the skin's row and column order.
    pub pressure_pa: &'a [f64],
}

/// Elastic layer of the skin, seen by a body.
pub trait ContactField: Send {
    /// Pressure on the skin and wrench on the body for the given pose and velocity.
    fn respond(&mut self, body: &PosedMesh<'_>) -> Response<'_>;
}
