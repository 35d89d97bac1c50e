//! Contact without dynamics: the force is prescribed, the pose is found.

use crate::body::PosedMesh;
use crate::equilibrium::EquilibriumError;
use crate::response::Response;

/// How a body may tilt about the skin's axes while it is pressed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Holder {
    /// Not at all.
    Rigid,
    /// Against the moment k (θ₀ − θ) of an elastic holder, about the point where the load's axis meets z = 0.
    Elastic {
        /// k, symmetric and positive definite, N m/rad, about world x and y.
        stiffness_nm_per_rad: [[f64; 2]; 2],
        /// θ₀, tilts without a moment, rad: what the force itself does to the holder.
        rest_rad: [f64; 2],
    },
}

/// What presses a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Normal force, N; positive.
    pub force_n: f64,
    /// Place (x, y) of the vertical axis of the load, m.
    pub axis_m: [f64; 2],
    /// What holds the body.
    pub holder: Holder,
    /// Where to start from; a neighbour's seat saves time and changes the result by round-off only.
    pub from: Option<Seat>,
}

/// How a body sits in the skin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seat {
    /// Height of the body's origin, m, before it is tilted.
    pub height_m: f64,
    /// Small tilts about world x and y through the load's axis at z = 0, rad.
    pub tilt_rad: [f64; 2],
}

/// A body in balance.
#[derive(Debug, Clone, Copy)]
pub struct Balance<'a> {
    /// How it sits.
    pub seat: Seat,
    /// Rotation matrix, tilts included, row-major.
    pub rotation: [[f64; 3]; 3],
    /// Position of the body's origin, m.
    pub position_m: [f64; 3],
    /// Wrench about the centre of mass and pressure. The normal force is the load's.
    pub response: Response<'a>,
}

/// A contact field that balances a load by itself.
pub trait QuasiStatic {
    /// Finds the height and the small tilts at which the pressure under `body` (its height and velocities are ignored)
    /// carries `load`: Σ p A = F, and Σ (r × p) A about the load's axis is the holder's moment, up to its sign.
    ///
    /// # Errors
    /// [`EquilibriumError`] when nothing of the body lies over the skin, the force is not reached 5 cm beyond the
    /// body's height, or the body tips over.
    fn carry(&mut self, body: &PosedMesh<'_>, load: &Load) -> Result<Balance<'_>, EquilibriumError>;
}
