//! Contact without dynamics: the force is prescribed, and the pose is computed.

use crate::body::PosedMesh;
use crate::equilibrium::EquilibriumError;
use crate::response::Response;

/// How the holder lets a body tilt about the skin's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Holder {
    /// The body cannot tilt.
    Rigid,
    /// An elastic holder exerts the moment k (θ₀ − θ) about the point where the load's axis meets z = 0.
    Elastic {
        /// k, symmetric and positive definite, N m/rad, about world x and y.
        stiffness_nm_per_rad: [[f64; 2]; 2],
        /// θ₀, tilts without a moment, rad, caused by the force on the holder.
        rest_rad: [f64; 2],
    },
}

/// What presses a body onto the skin: a force along a vertical axis, through a holder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Normal force, N; positive.
    pub force_n: f64,
    /// Position (x, y) of the vertical axis of the load, m.
    pub axis_m: [f64; 2],
    /// The holder of the body.
    pub holder: Holder,
    /// Pose from which the iteration starts. The pose of a similar load saves time, and changes the result by round-off
    /// only.
    pub from: Option<Seat>,
}

/// How a pressed body lies in the skin: its height and its small tilts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seat {
    /// Height of the body's origin before tilting, m.
    pub height_m: f64,
    /// Small tilts about world x and y through the load's axis at z = 0, rad.
    pub tilt_rad: [f64; 2],
}

/// A body that lies in equilibrium under a load: its pose, and the pressure under it.
#[derive(Debug, Clone, Copy)]
pub struct Balance<'a> {
    /// Height and tilts.
    pub seat: Seat,
    /// Rotation matrix including the tilts, row-major.
    pub rotation: [[f64; 3]; 3],
    /// Position of the body's origin, m.
    pub position_m: [f64; 3],
    /// Pressure, and wrench about the centre of mass. The normal force is that of the load.
    pub response: Response<'a>,
}

/// A contact field that computes the equilibrium under a load.
///
/// ```
/// use spts_contact::{Holder, Load, PosedMesh, build_contact, mesh::cuboid};
/// use spts_models::SkinLayout;
///
/// let mut field = build_contact("footprint", toml::Table::new(), &SkinLayout::default())?;
/// let block = cuboid([30e-3, 30e-3, 10e-3]);
/// let load = Load { force_n: 20.0, axis_m: [0.0, 0.0], holder: Holder::Rigid, from: None };
/// let quasi_static = field.quasi_static().expect("`footprint` is quasi-static");
/// let balance = quasi_static.carry(&PosedMesh::at_rest(&block, [0.0; 3]), &load)?;
/// assert!((balance.response.wrench.force_n[2] - 20.0).abs() < 1e-6);
/// assert!(balance.seat.height_m < 0.0, "the block sinks into the skin");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait QuasiStatic {
    /// Finds the height and the small tilts at which the pressure under `body` carries `load`: Σ p A = F, and Σ (r × p)
    /// A about the load's axis equals the holder's moment up to its sign. The body's height and velocities are ignored.
    ///
    /// # Errors
    /// [`EquilibriumError`] if no part of the body lies over the skin, the force is not reached within 5 cm beyond the
    /// body's height, or the body tips over.
    fn carry(&mut self, body: &PosedMesh<'_>, load: &Load) -> Result<Balance<'_>, EquilibriumError>;
}
