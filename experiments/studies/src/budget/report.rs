//! What a budget found.

use super::table::{BudgetRow, EndPoint};
use super::variants::Direction;
use serde::Serialize;
use spts::provenance::Provenance;
use spts_eval::unique;

/// What every effect costs.
#[derive(Debug, Clone, Serialize)]
pub struct BudgetReport {
    /// One line an effect, direction, decode and M.
    pub rows: Vec<BudgetRow>,
    /// The whole chain, the ideal one and the scan that is the truth.
    pub end_points: Vec<EndPoint>,
    /// What they depend on.
    pub provenance: Provenance,
}

impl BudgetReport {
    /// The row of an effect, if it was measured.
    #[must_use]
    pub fn find(
        &self,
        (stage, effect): (&str, &str),
        direction: Direction,
        (decode, m): (&str, usize),
    ) -> Option<&BudgetRow> {
        let found =
            |r: &&BudgetRow| (r.stage, r.effect, r.mode, r.decode, r.m) == (stage, effect, direction.name(), decode, m);
        self.rows.iter().find(found)
    }

    /// Stage and effect of every row, each once.
    #[must_use]
    pub fn effects(&self) -> Vec<(&'static str, &'static str)> {
        unique(self.rows.iter().map(|r| (r.stage, r.effect)))
    }

    /// Decodes, each once.
    #[must_use]
    pub fn decodes(&self) -> Vec<&'static str> {
        unique(self.rows.iter().map(|r| r.decode))
    }

    /// Numbers of measurements, each once.
    #[must_use]
    pub fn measurements(&self) -> Vec<usize> {
        unique(self.rows.iter().map(|r| r.m))
    }
}
