//! Consecutive measurements on their way through the circuit.

use crate::kernels::{LANES, Lines};
use crate::rows::Rows;

/// A run of consecutive measurements. How a block is cut into runs is up to the readout and must not show in the result.
///
/// All slices have one entry a measurement.
#[derive(Debug)]
pub struct Batch<'a> {
    /// Time from one measurement to the next, s.
    pub period_s: f64,
    /// Rf·Vd, V/S: conductance times this is what a taxel adds to the output at level 1.
    pub volts_per_siemens: f64,
    /// Σx, sum of the taxels' contributions at level 1, V.
    pub sum_v: &'a mut [f64],
    /// √Σ(wᵢ·xᵢ)², V: with weights ±1 this is ‖x‖₂, in raster mode the scanned taxel's own contribution.
    pub norm_v: &'a mut [f64],
    /// Output so far, V. It starts as Σ wᵢ·xᵢ, and every effect changes it in turn.
    pub output_v: &'a mut [f64],
    pub(crate) rows: &'a Rows,
    /// Conductance of the taxels, S.
    pub(crate) skin: Lines<'a>,
}

impl Batch<'_> {
    /// Number of measurements.
    #[must_use]
    pub fn len(&self) -> usize {
        self.output_v.len()
    }

    /// Whether there is no measurement; the readout makes no such batch.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.output_v.is_empty()
    }

    /// Row of the weight matrix at measurement `i`: clock edges since the seeds were loaded.
    #[must_use]
    #[inline]
    pub fn row(&self, i: usize) -> u64 {
        self.rows.first_row() + i as u64
    }

    /// Drive level of `taxel` at measurement `i`, in O(1).
    #[must_use]
    #[inline]
    pub fn level(&self, taxel: usize, i: usize) -> f64 {
        self.rows.level(taxel, i)
    }

    /// Drive level of `taxel` at the measurement before measurement `i`, in O(1); 0 before the first of all.
    #[must_use]
    #[inline]
    pub fn previous_level(&self, taxel: usize, i: usize) -> f64 {
        self.rows.previous_level(taxel, i)
    }

    /// Contribution of `taxel` at level 1 at measurement `i`, V.
    #[must_use]
    #[inline]
    pub fn taxel_v(&self, taxel: usize, i: usize) -> f64 {
        let share = self.skin.share[i / LANES][i % LANES];
        self.skin.at(taxel, share) * self.volts_per_siemens
    }
}
