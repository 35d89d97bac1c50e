//! Rows of Φ times the bank of a classifier.

use crate::windows::Window;
use spts_recon::{Matrix, SignTables};

/// Up to this many columns rows are looked up; the tables of more no longer fit a cache.
const FEW_COLUMNS: usize = 1200;

/// Forms rows of Φ times the bank.
pub(super) struct Bank {
    tables: Option<SignTables<f64>>,
}

impl Bank {
    pub(super) fn new(bank: &Matrix) -> Self {
        let few = bank.ncols() <= FEW_COLUMNS;
        Self {
            tables: few.then(|| SignTables::new(bank.view())),
        }
    }

    /// Overwrites `rows` with one row of Φ times `bank` (taxels × columns) for every measurement of `window`.
    pub(super) fn project(&self, bank: &Matrix, window: &Window<'_>, rows: &mut Vec<f64>) {
        let columns = bank.ncols().max(1);
        rows.resize(window.y.len() * columns, 0.0);
        if let (Some(tables), Some(signs)) = (&self.tables, window.signs) {
            return tables.fill_rows(signs, rows);
        }
        let phi = window.phi.values().chunks_exact(window.phi.ncols().max(1));
        for (row, out) in phi.zip(rows.chunks_exact_mut(columns)) {
            out.fill(0.0);
            bank.accumulate_row(row, out);
        }
    }
}
