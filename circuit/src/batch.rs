//! Consecutive measurements on their way through the circuit.

use crate::kernels::Lines;
use crate::rows::{Rows, Sums};
use crate::weights::WeightMode;

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
    /// Cells that are not as they should be.
    pub(crate) cells: Vec<Cell>,
}

/// A cell that does something else than its weights say, over the measurements of a batch.
#[derive(Debug)]
pub(crate) struct Cell {
    pub(crate) taxel: usize,
    /// Level at the measurement before the batch, then at each of its own.
    pub(crate) levels: Vec<f64>,
    /// Factor of the taxel's contribution, one a measurement.
    pub(crate) gains: Vec<f64>,
}

/// Buffers of [`Batch::add_errors`].
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    from: Vec<f64>,
    to: Vec<f64>,
    sums: Sums,
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
        match self.cell(taxel) {
            Some(cell) => cell.levels[i + 1],
            None => self.rows.level(taxel, i),
        }
    }

    /// Drive level of `taxel` at the measurement before measurement `i`, in O(1); 0 before the first of all.
    #[must_use]
    #[inline]
    pub fn previous_level(&self, taxel: usize, i: usize) -> f64 {
        match self.cell(taxel) {
            Some(cell) => cell.levels[i],
            None => self.rows.previous_level(taxel, i),
        }
    }

    /// Contribution of `taxel` at level 1 at measurement `i`, V.
    #[must_use]
    #[inline]
    pub fn taxel_v(&self, taxel: usize, i: usize) -> f64 {
        let gain = self.cell(taxel).map_or(1.0, |cell| cell.gains[i]);
        gain * self.sound_v(taxel, i)
    }

    /// What the cells put out.
    #[must_use]
    pub fn mode(&self) -> WeightMode {
        self.rows.weights().mode()
    }

    /// Number of taxels.
    #[must_use]
    pub fn taxels(&self) -> usize {
        self.rows.weights().taxels()
    }

    /// Adds Σₖ (`means`ₖ + `halves`ₖ·wₖ)·xₖ, of sound cells, to the output. Not for analog weights.
    pub(crate) fn add_errors(&mut self, means: &[f64], halves: &[f64], scratch: &mut Scratch) {
        let times = |values: &[f64], out: &mut Vec<f64>| {
            out.clear();
            out.extend(values.iter().zip(halves).map(|(x, half)| x * half));
        };
        times(self.skin.from, &mut scratch.from);
        let to = self.skin.to.map(|to| {
            times(to, &mut scratch.to);
            &scratch.to[..]
        });
        let lines = Lines {
            from: &scratch.from,
            to,
            share: self.skin.share,
        };
        self.rows.sum(lines, &mut scratch.sums);
        let total = |values: &[f64]| values.iter().zip(means).map(|(x, mean)| x * mean).sum();
        let (from, to) = (total(self.skin.from), self.skin.to.map(total));
        for (i, output_v) in self.output_v.iter_mut().enumerate() {
            let error = lines.between(i, from, || to) + self.rows.weighted(&lines, &scratch.sums, i);
            *output_v += error * self.volts_per_siemens;
        }
    }

    /// Contribution of `taxel` at level 1 without its faults, V.
    #[inline]
    pub(crate) fn sound_v(&self, taxel: usize, i: usize) -> f64 {
        self.skin.at(taxel, i) * self.volts_per_siemens
    }

    #[inline]
    fn cell(&self, taxel: usize) -> Option<&Cell> {
        self.cells.iter().find(|cell| cell.taxel == taxel)
    }

    /// Puts `cell` in the place of the sound one, into output, sum and norm.
    pub(crate) fn replace(&mut self, cell: Cell) {
        for i in 0..self.len() {
            let x = self.sound_v(cell.taxel, i);
            let sound = self.rows.level(cell.taxel, i) * x;
            let faulty = cell.levels[i + 1] * cell.gains[i] * x;
            self.output_v[i] += faulty - sound;
            self.sum_v[i] += (cell.gains[i] - 1.0) * x;
            let change = faulty * faulty - sound * sound;
            if change != 0.0 {
                self.norm_v[i] = (self.norm_v[i] * self.norm_v[i] + change).max(0.0).sqrt();
            }
        }
        self.cells.push(cell);
    }
}
