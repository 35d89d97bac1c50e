//! Faults of single cells or taxels.

use crate::cell_run::CellRun;
use crate::effect::{EffectSession, ProfileError};
use serde::Deserialize;

/// One fault of a profile's `[[faults]]` list.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct FaultConfig {
    /// Name in [`FAULTS`](crate::FAULTS).
    pub name: String,
    /// Taxel, 0-based and row-major. Range [0, taxels − 1].
    pub taxel: u32,
    /// Parameters of this fault; each has a default.
    #[serde(flatten)]
    pub parameters: toml::Table,
}

/// A fault of one cell. Its effect on a row is a function of the session, the taxel and the row.
///
/// ```
/// use spts_circuit::{CellRun, Fault};
///
/// /// A taxel that conducts half as well as it should.
/// struct Worn;
///
/// impl Fault for Worn {
///     fn drives(&self) -> bool {
///         false // the level is still the generator's
///     }
///     fn apply(&mut self, run: &mut CellRun<'_>) {
///         run.gains.iter_mut().for_each(|gain| *gain *= 0.5);
///     }
/// }
/// let (mut levels, mut gains) = ([1.0, -1.0], [1.0, 1.0]);
/// Worn.apply(&mut CellRun { first_row: 0, period_s: 1.55e-5, levels: &mut levels, gains: &mut gains });
/// assert_eq!(gains, [0.5, 0.5]);
/// ```
pub trait Fault: Send {
    /// Whether the fault determines the level of the cell. A cell has at most one such fault.
    fn drives(&self) -> bool {
        true
    }

    /// Modifies levels and gains. A run may begin at any row.
    fn apply(&mut self, run: &mut CellRun<'_>);
}

/// Builds a fault of a taxel from its parameters.
pub type BuildFault = fn(toml::Table, u32, &EffectSession) -> Result<Box<dyn Fault>, ProfileError>;
