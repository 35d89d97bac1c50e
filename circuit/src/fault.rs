//! A cell or taxel that does something else than it should.

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

/// One cell over consecutive measurements, as its faults leave it.
#[derive(Debug)]
pub struct CellRun<'a> {
    /// Row of the weight matrix at the first entry; the others follow.
    pub first_row: u64,
    /// Time from one measurement to the next, s.
    pub period_s: f64,
    /// Drive level, −1 to 1.
    pub levels: &'a mut [f64],
    /// What the taxel's contribution is multiplied by, 1 for a sound one.
    pub gains: &'a mut [f64],
}

impl CellRun<'_> {
    /// Rows with level and gain of each.
    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = (u64, &mut f64, &mut f64)> {
        let rows = self.first_row..;
        let values = self.levels.iter_mut().zip(&mut *self.gains);
        rows.zip(values).map(|(row, (level, gain))| (row, level, gain))
    }
}

/// A fault of one cell. What it makes of a row is a function of the session, the taxel and the row.
pub trait Fault: Send {
    /// Whether it decides the level of the cell; a cell has at most one such fault.
    fn drives(&self) -> bool {
        true
    }

    /// Changes level and gain. A run may begin anywhere.
    fn apply(&mut self, run: &mut CellRun<'_>);
}

/// Builds a fault of a taxel from its parameters.
pub type BuildFault = fn(toml::Table, u32, &Session) -> Result<Box<dyn Fault>, ProfileError>;
