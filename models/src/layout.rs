//! Geometry of the skin.

use crate::check::{in_interval, in_range};
use serde::{Deserialize, Serialize};
use spts_input::Refusal;
use std::marker::PhantomData;

/// A rectangular array of square taxels. The sheet lies in the plane z = 0 and is centred on the origin. Columns run
/// along +x and rows along −y (row 0 is the far edge), so that a printed map looks like the skin seen from above.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, try_from = "SkinLayoutConfig")]
pub struct SkinLayout {
    rows: usize,
    cols: usize,
    pitch_m: f64,
    electrode_m: f64,
}

/// Most taxels a skin may have.
const MAX_TAXELS: usize = 1 << 24;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct SkinLayoutConfig {
    rows: usize,
    cols: usize,
    pitch_m: f64,
    electrode_m: Option<f64>,
}

impl Default for SkinLayoutConfig {
    fn default() -> Self {
        let skin = SkinLayout::default();
        Self { rows: skin.rows, cols: skin.cols, pitch_m: skin.pitch_m, electrode_m: None }
    }
}

impl TryFrom<SkinLayoutConfig> for SkinLayout {
    type Error = Refusal;
    fn try_from(c: SkinLayoutConfig) -> Result<Self, Refusal> {
        let electrode_m = c.electrode_m.unwrap_or(Self::usual_electrode_m(c.pitch_m));
        // a pitch that is not valid has no electrode: the pitch is what is refused
        Self::new(c.rows, c.cols, c.pitch_m, electrode_m)
    }
}

/// Side of the electrode that the transducers' and the readouts' defaults are calibrated for, m: that of the published
/// skin.
const CALIBRATED_ELECTRODE_M: f64 = 10e-3;

impl Default for SkinLayout {
    /// The published skin: 10 × 10 taxels at 15 mm pitch. The side of the electrode is not published; 10 mm is an
    /// estimate from how little a neighbour of an edge responds.
    fn default() -> Self {
        Self { rows: 10, cols: 10, pitch_m: 15e-3, electrode_m: 10e-3 }
    }
}

impl SkinLayout {
    /// A skin of `rows × cols` taxels at the pitch `pitch_m`, each with a square electrode of side `electrode_m`.
    ///
    /// # Errors
    /// [`Refusal`] for an empty or oversized array, a pitch outside [1e-6, 1] m, or an electrode outside
    /// `(0, pitch_m]`.
    pub fn new(rows: usize, cols: usize, pitch_m: f64, electrode_m: f64) -> Result<Self, Refusal> {
        in_range("rows", rows as f64, rows > 0, "[1, ∞)")?;
        in_range("cols", cols as f64, cols > 0, "[1, ∞)")?;
        let taxels = rows.saturating_mul(cols);
        in_range("rows × cols", taxels as f64, taxels <= MAX_TAXELS, "[1, 2^24]")?;
        // below a micrometre a sheet of carbon-filled film is no continuum; beyond a metre the arm's reach ends in a
        // taxel
        in_interval("pitch_m", pitch_m, "[1e-6, 1] m")?;
        in_range("electrode_m", electrode_m, electrode_m > 0.0 && electrode_m <= pitch_m, "(0, pitch_m]")?;
        Ok(Self { rows, cols, pitch_m, electrode_m })
    }

    /// A skin of `rows × cols` taxels at the pitch `pitch_m`. Electrodes fill the same share of a taxel as on the
    /// published skin.
    ///
    /// ```
    /// use spts_models::SkinLayout;
    ///
    /// let skin = SkinLayout::with_pitch(12, 20, 4.5e-3)?;
    /// assert!((skin.electrode_m() - 3e-3).abs() < 1e-15);
    /// assert_eq!(SkinLayout::with_pitch(10, 10, 15e-3)?, SkinLayout::default());
    /// # Ok::<(), spts_input::Refusal>(())
    /// ```
    ///
    /// # Errors
    /// As [`SkinLayout::new`].
    pub fn with_pitch(rows: usize, cols: usize, pitch_m: f64) -> Result<Self, Refusal> {
        Self::new(rows, cols, pitch_m, Self::usual_electrode_m(pitch_m))
    }

    /// Default side of the electrode for this pitch, m: 10/15 of the pitch.
    pub fn usual_electrode_m(pitch_m: f64) -> f64 {
        pitch_m * 10.0 / 15.0
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn cols(&self) -> usize {
        self.cols
    }

    /// Number of taxels, N.
    pub fn taxels(&self) -> usize {
        self.rows * self.cols
    }

    /// Distance between the centres of neighbouring taxels, m.
    pub fn pitch_m(&self) -> f64 {
        self.pitch_m
    }

    /// Side of a taxel's square electrode, m.
    pub fn electrode_m(&self) -> f64 {
        self.electrode_m
    }

    /// Area of a taxel's electrode divided by that of the published skin (10 mm × 10 mm), for which transducers and
    /// readouts are calibrated. The conductance of a taxel is proportional to it. Exactly 1 for the published skin.
    pub fn relative_area(&self) -> f64 {
        (self.electrode_m / CALIBRATED_ELECTRODE_M).powi(2)
    }

    /// Area of the skin that belongs to one taxel, pitch × pitch, m².
    pub fn cell_area_m2(&self) -> f64 {
        self.pitch_m * self.pitch_m
    }

    /// Extent of the sheet along x (columns) and y (rows), m.
    pub fn extent_m(&self) -> [f64; 2] {
        [self.cols as f64 * self.pitch_m, self.rows as f64 * self.pitch_m]
    }

    /// Where the middle of the taxel number `taxel` (row-major) lies along the rows and along the columns of the sheet:
    /// -1 and 1 are its edges, 0 its middle.
    pub fn share_of_half(&self, taxel: usize) -> [f64; 2] {
        let along = |index: usize, count: usize| (2 * index + 1) as f64 / count as f64 - 1.0;
        [along(taxel / self.cols, self.rows), along(taxel % self.cols, self.cols)]
    }

    /// Position (x, y), m, of the taxel coordinate `(row, col)`, which may be fractional.
    pub fn position_m(&self, row: f64, col: f64) -> [f64; 2] {
        let [width, height] = self.extent_m();
        [(col + 0.5) * self.pitch_m - 0.5 * width, 0.5 * height - (row + 0.5) * self.pitch_m]
    }
}

// Taxel maps with a unit tag.

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
    pub fn zeros(rows: usize, cols: usize) -> Self {
        Self::from_values(rows, cols, vec![0.0; rows * cols])
    }

    /// A map from row-major `values`.
    ///
    /// # Panics
    /// If `values.len() != rows * cols`.
    pub fn from_values(rows: usize, cols: usize, values: Vec<f64>) -> Self {
        assert_eq!(values.len(), rows * cols, "a {rows} × {cols} map needs {} values", rows * cols);
        Self { rows, cols, values, unit: PhantomData }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn cols(&self) -> usize {
        self.cols
    }

    /// Values, row-major.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Values, row-major, for writing.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// Sum of all values.
    pub fn sum(&self) -> f64 {
        self.values.iter().sum()
    }

    /// Largest value, or −∞ for an empty map.
    pub fn max(&self) -> f64 {
        self.values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 10 mm at 15 mm to the bit, the same share of any other pitch, and absolute where it is given.
    #[test]
    fn the_electrode_follows_the_pitch_unless_it_is_given() {
        let electrode_m = |text: &str| toml::from_str::<SkinLayout>(text).unwrap().electrode_m();
        assert_eq!(electrode_m("").to_bits(), 10e-3_f64.to_bits());
        assert_eq!(electrode_m("pitch_m = 0.015\nrows = 3").to_bits(), 10e-3_f64.to_bits());
        // one rounding each of the product, the quotient and the number read
        let rounded = 3.0 * f64::EPSILON;
        assert!((electrode_m("pitch_m = 0.005") / (0.01 / 3.0) - 1.0).abs() < rounded);
        assert_eq!(electrode_m("pitch_m = 0.005\nelectrode_m = 0.004").to_bits(), 4e-3_f64.to_bits());
        assert_eq!(SkinLayout::default().relative_area().to_bits(), 1.0_f64.to_bits());
    }
}
