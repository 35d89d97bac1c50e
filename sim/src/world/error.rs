//! Errors of a simulation.

use super::ik::Unreachable;
use crate::mechanics::MechanicsError;
use spts_contact::EquilibriumError;

/// Largest width or height of a picture, pixels.
pub const MAX_PIXELS: usize = 8192;

/// A simulation that failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// The scene is not valid.
    #[error(transparent)]
    Mechanics(#[from] MechanicsError),
    /// The linked MuJoCo has another version.
    #[error("MuJoCo {found} is linked, {wanted} is needed")]
    Version {
        /// Version found.
        found: String,
        /// Version for which this crate is made.
        wanted: &'static str,
    },
    /// MuJoCo rejects the model.
    #[error("MuJoCo rejects the model: {0}")]
    Model(String),
    /// There is no such press or drop.
    #[error("press {index} is outside [0, {repeats})")]
    NoSuchPress {
        /// Requested index.
        index: usize,
        /// Number of presses in the scene.
        repeats: usize,
    },
    /// The arm cannot reach the pose.
    #[error(transparent)]
    Unreachable(#[from] Unreachable),
    /// The arm or the ball touched nothing.
    #[error("nothing has touched the skin by {time_s:.3} s")]
    NoTouch {
        /// Time, s.
        time_s: f64,
    },
    /// MuJoCo reports a warning.
    #[error("MuJoCo warning {warning} at {time_s:.4} s: the dynamics are not stable")]
    Unstable {
        /// Index of the warning in MuJoCo's `mjtWarning`.
        warning: usize,
        /// Time, s.
        time_s: f64,
    },
    /// There is no equilibrium under the force of a press.
    #[error("`press.force_n` = {force_n} at {time_s:.4} s: {source}")]
    Balance {
        /// Force at that time, N.
        force_n: f64,
        /// Time, s.
        time_s: f64,
        /// Cause.
        source: EquilibriumError,
    },
    /// A contact wrench that is not finite, because the contact field has no answer.
    #[error("contact force {force_n:?} N at {time_s:.4} s is not finite: {reason}")]
    NotFinite {
        /// Force, N.
        force_n: [f64; 3],
        /// Time, s.
        time_s: f64,
        /// Reason given by the contact field.
        reason: String,
    },
    /// The contact field cannot compute the pressure of a frame.
    #[error("no pressure under {force_n:e} N at {time_s:.4} s: {reason}")]
    NoPressure {
        /// Normal force, N.
        force_n: f64,
        /// Time, s.
        time_s: f64,
        /// Reason given by the contact field.
        reason: String,
    },
    /// A picture without pixels, or with too many.
    #[error("picture of {width} × {height} is outside [1, {MAX_PIXELS}] pixels a side")]
    PictureSize {
        /// Requested width, pixels.
        width: usize,
        /// Requested height, pixels.
        height: usize,
    },
    /// The picture could not be drawn.
    #[error("off-screen rendering failed: {0} (is EGL installed? Debian: libegl1 libegl-mesa0 libgl1-mesa-dri)")]
    Render(String),
}
