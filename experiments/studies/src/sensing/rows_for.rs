//! Turns a design into weights that cells put out.

use super::error::SensingError;
use spts_circuit::{Patterns, WeightMode, Weights};
use spts_recon::Matrix;
use spts_recon::rows::{Designer, Levels, RowTask};

/// Rows of a designer.
#[derive(Debug, Clone)]
pub(super) struct RowsFor {
    pub(super) designer: &'static str,
    pub(super) mode: WeightMode,
    rows: Matrix,
}

/// What `designer` answers to `task`.
pub(super) fn rows_for(designer: &'static Designer, task: &RowTask<'_>) -> Result<RowsFor, SensingError> {
    Ok(RowsFor {
        designer: designer.name,
        mode: mode_of(designer),
        rows: (designer.build)().design(task)?,
    })
}

/// Levels of a designer's rows, as cells have them.
pub(super) fn mode_of(designer: &Designer) -> WeightMode {
    match designer.levels {
        Levels::Signs => WeightMode::Binary,
        Levels::Analog => WeightMode::Analog,
    }
}

impl RowsFor {
    /// Number of rows.
    pub(super) fn len(&self) -> usize {
        self.rows.nrows()
    }

    /// The first `m` rows as a pattern that repeats.
    pub(super) fn first(&self, m: usize) -> Result<Weights, SensingError> {
        self.ordered(&(0..m).collect::<Vec<usize>>())
    }

    /// The rows with these numbers as a pattern that repeats.
    pub(super) fn ordered(&self, rows: &[usize]) -> Result<Weights, SensingError> {
        let patterns = patterns(&self.rows, rows)?;
        Ok(Weights::with_patterns(self.mode, patterns)?)
    }

    /// The first `m` rows as a matrix.
    pub(super) fn matrix(&self, m: usize) -> Matrix {
        let mut first = Matrix::zeros(m, self.rows.ncols());
        (0..m).for_each(|r| first.row_mut(r).copy_from_slice(self.rows.row(r)));
        first
    }
}

/// The rows with the numbers `order`, as codes of the cells' converters.
pub(super) fn patterns(rows: &Matrix, order: &[usize]) -> Result<Patterns, SensingError> {
    let levels: Vec<f64> = order.iter().flat_map(|&r| rows.row(r)).copied().collect();
    Ok(Patterns::of_levels(order.len(), &levels)?)
}
