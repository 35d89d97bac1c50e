//! Why a body cannot be pressed as asked, and how deep a balance is looked for.

use crate::body::PosedMesh;

/// The body cannot be pressed as asked.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EquilibriumError {
    /// No force at any depth.
    #[error("the body meets nothing down to {depth_m:.4} m depth: it lies beside the skin")]
    Beside {
        /// Depth at which the search ended, m.
        depth_m: f64,
    },
    /// Contact, but not with the force.
    #[error("the contact carries at most {reached_n:.4e} N, at {depth_m:.4} m depth, and {wanted_n:.4e} N are needed")]
    Force {
        /// Largest force found, N.
        reached_n: f64,
        /// Force asked for, N.
        wanted_n: f64,
        /// Depth at which the search ended, m.
        depth_m: f64,
    },
    /// A balance beyond small tilts.
    #[error("{force_n:.4e} N tilt the body by {tilt_rad:.3} rad, outside [0, {limit_rad}]: it tips over")]
    Tilt {
        /// Force, N.
        force_n: f64,
        /// Tilt found, rad.
        tilt_rad: f64,
        /// Largest tilt for which the balance is meant, rad.
        limit_rad: f64,
    },
    /// No balance found.
    #[error("no balance at {force_n:.4e} N after {iterations} iterations: {residual_n:.3e} N are left")]
    NotConverged {
        /// Force, N.
        force_n: f64,
        /// Iterations made.
        iterations: usize,
        /// Force left, N.
        residual_n: f64,
    },
    /// The contact field gave a wrench that is not a number.
    #[error("the contact field has no answer at {depth_m:.4e} m depth")]
    NoAnswer {
        /// Depth, m.
        depth_m: f64,
    },
    /// A load that cannot be carried.
    #[error("`force_n` = {force_n} is outside (0, ∞) N")]
    Load {
        /// Force asked for, N.
        force_n: f64,
    },
    /// Contact, but it does not absorb the energy.
    #[error(
        "the contact absorbs at most {reached_j:.4e} J, down to {depth_m:.4} m depth, and {wanted_j:.4e} J are needed"
    )]
    Energy {
        /// Largest energy found, J.
        reached_j: f64,
        /// Energy asked for, J.
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
