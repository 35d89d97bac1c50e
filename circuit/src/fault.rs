//! Faults of single cells or taxels.

use crate::cell_run::CellRun;
use crate::effect::{ProfileError, Session};
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
pub trait Fault: Send {
    /// Whether the fault determines the level of the cell. A cell has at most one such fault.
    fn drives(&self) -> bool {
        true
    }

    /// Modifies levels and gains. A run may begin at any row.
    fn apply(&mut self, run: &mut CellRun<'_>);
}

/// Builds a fault of a taxel from its parameters.
pub type BuildFault = fn(toml::Table, u32, &Session) -> Result<Box<dyn Fault>, ProfileError>;
