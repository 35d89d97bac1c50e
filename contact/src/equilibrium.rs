//! Errors of equilibria, and the depth to which an equilibrium is searched.

use crate::body::PosedMesh;

/// Why a body has no equilibrium under the given load.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EquilibriumError {
    /// There is no force at any depth.
    #[error("the body meets nothing down to {depth_m:.4} m depth: it lies beside the skin")]
    Beside {
        /// Depth at which the search ended, m.
        depth_m: f64,
    },
    /// There is contact, but not enough force.
    #[error("the contact carries at most {reached_n:.4e} N, at {depth_m:.4} m depth, and {wanted_n:.4e} N are needed")]
    Force {
        /// Largest force found, N.
        reached_n: f64,
        /// Required force, N.
        wanted_n: f64,
        /// Depth at which the search ended, m.
        depth_m: f64,
    },
    /// The equilibrium has a tilt too large for the small-tilt approximation.
    #[error("{force_n:.4e} N tilt the body by {tilt_rad:.3} rad, outside [0, {limit_rad}]: it tips over")]
    Tilt {
        /// Force, N.
        force_n: f64,
        /// Tilt found, rad.
        tilt_rad: f64,
        /// Largest tilt for which the approximation holds, rad.
        limit_rad: f64,
    },
    /// The iteration did not converge.
    #[error("no equilibrium at {force_n:.4e} N after {iterations} iterations: residual force {residual_n:.3e} N")]
    NotConverged {
        /// Force, N.
        force_n: f64,
        /// Number of iterations.
        iterations: usize,
        /// Residual force, N.
        residual_n: f64,
    },
    /// The contact field returned a wrench that is NaN.
    #[error("the contact field has no answer at {depth_m:.4e} m depth")]
    NoAnswer {
        /// Depth, m.
        depth_m: f64,
    },
    /// The load is not a positive force.
    #[error("`force_n` = {force_n} is outside (0, ∞) N")]
    Load {
        /// The force, N.
        force_n: f64,
    },
    /// There is contact, but it does not absorb the energy.
    #[error(
        "the contact absorbs at most {reached_j:.4e} J, down to {depth_m:.4} m depth, and {wanted_j:.4e} J are needed"
    )]
    Energy {
        /// Largest energy found, J.
        reached_j: f64,
        /// Required energy, J.
        wanted_j: f64,
        /// Depth at which the search ended, m.
        depth_m: f64,
    },
}

/// How much deeper than the body is high a force is looked for, m.
const EXTRA_DEPTH_M: f64 = 0.05;

/// Depth below the touch down to which a force is looked for: the body's height and 5 cm, m.
pub(crate) fn depth_limit_m(body: &PosedMesh<'_>) -> f64 {
    let [low_m, high_m] = body.heights_m();
    high_m - low_m + EXTRA_DEPTH_M
}
