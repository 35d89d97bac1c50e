//! Contact fields: how the foam answers a posed mesh.
//!
//! The skin's free surface is the plane z = 0; the foam lies below it. A contact field looks at the underside of a
//! body, gives the pressure on a fine grid over the whole skin and the wrench on the body, and nothing else: inertia,
//! arms and gravity belong to the world.

pub mod checks;
mod conformance;
#[cfg(test)]
mod convergence_tests;
mod elastic;
mod envelope;
mod envelope_blocks;
mod envelope_map;
#[cfg(test)]
mod envelope_oracle_tests;
mod envelope_raster;
#[cfg(test)]
mod envelope_tests;
mod equilibrium;
#[cfg(test)]
mod extremes_tests;
mod foam;
mod footprint;
mod footprint_potential;
#[cfg(test)]
mod footprint_tests;
mod limits;
mod quasi_static;
mod table;
mod taxels;
#[cfg(test)]
mod tests;
mod traction;
mod winkler;

pub use conformance::{Nonconformity, conformance};
pub use elastic::{
    ElasticConfig, ElasticField, ElasticKernel, ElasticSolver, Influence, Outcome, confined_stiffness_pa_per_m,
    modulus_of_confined_pa,
};
pub(crate) use envelope::Envelope;
pub use envelope_raster::Patch;
pub use equilibrium::{DepthCurve, EquilibriumError};
pub(crate) use foam::FoamLaw;
pub(crate) use footprint::Footprint;
pub use quasi_static::{Balance, Holder, Load, QuasiStatic, Seat};
#[cfg(test)]
pub(crate) use table::CONTACT_CHECKS;
pub use table::{CONTACT_FIELDS, ContactBuild, ContactError, build_contact};
pub use taxels::TaxelBins;
pub use winkler::{WinklerConfig, WinklerLayer};

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
    /// Stiffness of the body's own surface in series with the skin, Pa/m; `f64::INFINITY` for a rigid body.
    pub stiffness_pa_per_m: f64,
}

impl<'a> PosedMesh<'a> {
    /// Rigid body at rest, not rotated, its origin and centre of mass at `position_m`.
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

    /// Heights of the lowest and the highest vertex above the body's origin, world axes, m; not in order without a vertex.
    pub(crate) fn heights_m(&self) -> [f64; 2] {
        let [_, _, up] = self.rotation;
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
        for v in &self.mesh.vertices {
            let z = up[0] * v[0] + up[1] * v[1] + up[2] * v[2];
            ends = [ends[0].min(z), ends[1].max(z)];
        }
        ends
    }

    /// Whether pose and velocity are finite and the stiffness is a number.
    pub(crate) fn is_finite(&self) -> bool {
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

/// Answer of a contact field.
#[derive(Debug, Clone, Copy)]
pub struct Response<'a> {
    /// Wrench on the body; NaN when the field has no answer ([`ContactField::respond`]).
    pub wrench: Wrench,
    /// Fine pressure field, Pa, shape `(rows · cells, cols · cells)`, row-major in the skin's row and column order.
    pub pressure_pa: &'a [f64],
    /// Cells outside which the pressure is 0, also after [`ContactField::refine`]: no one needs to look further. `None` when
    /// it can be anywhere.
    pub patch: Option<Patch>,
}

/// Elastic layer of the skin, seen by a body.
pub trait ContactField: Send {
    /// Pressure on the skin and wrench on the body for the given pose and velocity.
    ///
    /// The normal force of the wrench equals the sum of pressure × cell area; pressure is finite and never negative,
    /// at any depth and for any mesh whose vertices are finite and whose triangles name vertices that exist.
    ///
    /// A wrench of NaN means that there is no answer, and the pressure then means nothing: pose or velocity are not finite, or the
    /// field's own solver gave up. A world stops with an error.
    fn respond(&mut self, body: &PosedMesh<'_>) -> Response<'_>;

    /// Why the last answer was none, when the field can say.
    fn failure(&self) -> Option<String> {
        None
    }

    /// Pressure that a frame shows, Pa, shaped as in [`Response`], when the field sees more than it answered to the dynamics;
    /// `None` when the answer is all there is, or when there is none: then [`ContactField::failure`] says why, and a world stops
    /// with an error. It carries the same normal force `force_n`.
    ///
    /// Called after [`ContactField::respond`] with the same body, for frames only.
    fn refine(&mut self, _body: &PosedMesh<'_>, _force_n: f64) -> Option<&[f64]> {
        None
    }

    /// The field as one that finds the pose under a prescribed force itself, when it is one: its presses need no dynamics.
    fn quasi_static(&mut self) -> Option<&mut dyn QuasiStatic> {
        None
    }

    /// Relative accuracy of an answer, of which earlier poses may take a part (an iteration that starts from the last
    /// pressure); 0 when the answer is a function of the body alone, bit for bit.
    fn tolerance(&self) -> f64 {
        0.0
    }

    /// Fine cells along one side of a taxel.
    fn cells_per_taxel(&self) -> usize;

    /// Every parameter, defaults included, as it would be written in a scene: enough to build the same field again.
    fn parameters(&self) -> toml::Table;

    /// Damping time of the layer, s: the viscous part of the pressure is this time × the rate of the elastic part.
    /// Bounds the time step together with the stiffness.
    fn damping_s(&self) -> f64;

    /// Thickness of the layer, m.
    fn thickness_m(&self) -> f64;
}
