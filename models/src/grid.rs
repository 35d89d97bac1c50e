//! Taxel maps with a unit tag.

use std::marker::PhantomData;

/// Unit tag: pascal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pascal {}

/// Unit tag: siemens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Siemens {}

/// A map with one value a taxel: shape `(rows, cols)`, row-major, all values in unit `U`.
///
/// ```
/// use spts_models::PressureMap;
///
/// let mut pressure = PressureMap::zeros(10, 10);
/// pressure.values_mut()[4 * 10 + 7] = 12e3; // row 4, column 7
/// let cell_area_m2 = 15e-3 * 15e-3;
/// assert!((pressure.sum() * cell_area_m2 - 2.7).abs() < 1e-12, "the force, N");
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Grid<U> {
    rows: usize,
    cols: usize,
    values: Vec<f64>,
    unit: PhantomData<U>,
}

/// Pressure on every taxel, Pa.
pub type PressureMap = Grid<Pascal>;
/// Conductance of every taxel, S.
pub type ConductanceMap = Grid<Siemens>;

impl<U> Grid<U> {
    /// A map of zeros.
    #[must_use]
    pub fn zeros(rows: usize, cols: usize) -> Self {
        Self::from_values(rows, cols, vec![0.0; rows * cols])
    }

    /// A map from row-major `values`.
    ///
    /// # Panics
    /// If `values.len() != rows * cols`.
    #[must_use]
    pub fn from_values(rows: usize, cols: usize, values: Vec<f64>) -> Self {
        assert_eq!(
            values.len(),
            rows * cols,
            "a {rows} × {cols} map needs {} values",
            rows * cols
        );
        Self {
            rows,
            cols,
            values,
            unit: PhantomData,
        }
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    #[must_use]
    pub fn cols(&self) -> usize {
        self.cols
    }

    /// Values, row-major.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Values, row-major, for writing.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// Sum of all values.
    #[must_use]
    pub fn sum(&self) -> f64 {
        self.values.iter().sum()
    }

    /// Largest value, or −∞ for an empty map.
    #[must_use]
    pub fn max(&self) -> f64 {
        self.values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }
}
