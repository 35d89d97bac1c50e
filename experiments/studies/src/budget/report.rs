//! Results of the budget study.

use super::table::{BudgetRow, EndPoint};
use super::variants::Direction;
use serde::Serialize;
use spts::provenance::Provenance;
use spts_eval::unique;

/// Results of `spts budget`: what every effect costs, and the scores of the chains that are compared.
#[derive(Debug, Clone, Serialize)]
pub struct BudgetReport {
    /// One row for each effect, direction, decoding variant and M.
    pub rows: Vec<BudgetRow>,
    /// Scores of the whole chain, of the ideal chain, and of the scan that is the ground truth.
    pub end_points: Vec<EndPoint>,
    /// Provenance of the numbers.
    pub provenance: Provenance,
}

impl BudgetReport {
    /// The row of an effect; `None` if it was not measured.
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

    /// Stage and effect of every row, without duplicates.
    #[must_use]
    pub fn effects(&self) -> Vec<(&'static str, &'static str)> {
        unique(self.rows.iter().map(|r| (r.stage, r.effect)))
    }

    /// Decoding variants, without duplicates.
    #[must_use]
    pub fn decodes(&self) -> Vec<&'static str> {
        unique(self.rows.iter().map(|r| r.decode))
    }

    /// Numbers of measurements, without duplicates.
    #[must_use]
    pub fn measurements(&self) -> Vec<usize> {
        unique(self.rows.iter().map(|r| r.m))
    }
}
