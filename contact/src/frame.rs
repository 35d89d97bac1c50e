//! State of the contact at every sampled instant.

use spts_models::PressureMap;

/// Position and orientation of the pressing body in world axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Position of the body origin, m.
    pub position_m: [f64; 3],
    /// Orientation, unit quaternion (w, x, y, z).
    pub quaternion: [f64; 4],
}

/// Force and torque on the pressing body about its centre of mass, world axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrench {
    /// Force, N.
    pub force_n: [f64; 3],
    /// Torque, N m.
    pub torque_nm: [f64; 3],
}

impl Wrench {
    /// The answer of a contact field that has none: NaN everywhere.
    pub const UNKNOWN: Self = Self {
        force_n: [f64::NAN; 3],
        torque_nm: [f64::NAN; 3],
    };
}

/// State of the contact at one instant.
///
/// ```
/// use spts_contact::{Frame, Pose, Wrench};
/// use spts_models::PressureMap;
///
/// let pressure = PressureMap::from_values(1, 2, vec![8e3, 2e3]);
/// let frame = Frame {
///     time_s: 0.1,
///     electrode_pressure: pressure.clone(),
///     pressure,
///     wrench: Wrench { force_n: [0.0, 0.0, 2.25], torque_nm: [0.0; 3] },
///     pose: Pose { position_m: [0.0; 3], quaternion: [1.0, 0.0, 0.0, 0.0] },
/// };
/// assert!(frame.imbalance(15e-3 * 15e-3) < 1e-12);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Time since the start of the scene, s.
    pub time_s: f64,
    /// Mean pressure over each taxel's whole area (pitch × pitch), Pa. Its sum × pitch² is the normal contact force.
    pub pressure: PressureMap,
    /// Mean pressure over each taxel's electrode (centred in that area), Pa, as the transducer sees it. It includes a
    /// preload of the skin, which `pressure` does not.
    pub electrode_pressure: PressureMap,
    /// Contact wrench on the body.
    pub wrench: Wrench,
    /// Pose of the body.
    pub pose: Pose,
}

impl Frame {
    /// Relative difference between force and pressure: |F_z − Σ p A| / F_z, where A is the area of a taxel's whole
    /// cell; 0 without a force.
    #[must_use]
    pub fn imbalance(&self, cell_area_m2: f64) -> f64 {
        let force_n = self.wrench.force_n[2];
        if force_n <= 0.0 {
            return 0.0;
        }
        (force_n - self.pressure.sum() * cell_area_m2).abs() / force_n
    }
}
