//! Why a simulation could not start or go on.

use super::ik::Unreachable;
use crate::mechanics::MechanicsError;
use spts_contact::EquilibriumError;

/// Largest side of a picture, pixels.
pub const MAX_PIXELS: usize = 8192;

/// A simulation that failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// The scene is not valid.
    #[error(transparent)]
    Mechanics(#[from] MechanicsError),
    /// The linked MuJoCo is another version.
    #[error("MuJoCo {found} is linked, {wanted} is needed")]
    Version {
        /// Version found.
        found: String,
        /// Version this crate is made for.
        wanted: &'static str,
    },
    /// MuJoCo rejects the model.
    #[error("MuJoCo rejects the model: {0}")]
    Model(String),
    /// There is no such press or drop.
    #[error("press {index} is outside [0, {repeats})")]
    NoSuchPress {
        /// Index asked for.
        index: usize,
        /// Number of presses in the scene.
        repeats: usize,
    },
    /// The arm cannot get there.
    #[error(transparent)]
    Unreachable(#[from] Unreachable),
    /// The arm came down, or the ball fell, and met nothing.
    #[error("nothing has touched the skin by {time_s:.3} s")]
    NoTouch {
        /// Time, s.
        time_s: f64,
    },
    /// MuJoCo counted a warning.
    #[error("MuJoCo warning {warning} at {time_s:.4} s: the dynamics are not stable")]
    Unstable {
        /// Index of the warning in MuJoCo's `mjtWarning`.
        warning: usize,
        /// Time, s.
        time_s: f64,
    },
    /// No balance under the force of a press.
    #[error("`press.force_n` = {force_n} at {time_s:.4} s: {source}")]
    Balance {
        /// Force at that time, N.
        force_n: f64,
        /// Time, s.
        time_s: f64,
        /// What is wrong.
        source: EquilibriumError,
    },
    /// A contact wrench that is not finite: the contact field has no answer.
    #[error("contact force {force_n:?} N at {time_s:.4} s is not finite: {reason}")]
    NotFinite {
        /// Force, N.
        force_n: [f64; 3],
        /// Time, s.
        time_s: f64,
        /// What the contact field says.
        reason: String,
    },
    /// A frame's pressure that the contact field cannot find.
    #[error("no pressure under {force_n:e} N at {time_s:.4} s: {reason}")]
    NoPressure {
        /// Normal force, N.
        force_n: f64,
        /// Time, s.
        time_s: f64,
        /// What the contact field says.
        reason: String,
    },
    /// A picture without pixels, or with too many.
    #[error("picture of {width} × {height} is outside [1, {MAX_PIXELS}] pixels a side")]
    PictureSize {
        /// Width asked for, pixels.
        width: usize,
        /// Height asked for, pixels.
        height: usize,
    },
    /// The picture could not be drawn.
    #[error("off-screen rendering failed: {0} (is EGL installed? Debian: libegl1 libegl-mesa0 libgl1-mesa-dri)")]
    Render(String),
}
