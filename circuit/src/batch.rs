//! Consecutive measurements on their way through the circuit.

use crate::weights::{Lines, Rows, Sums, WeightMode};

/// One cell over consecutive measurements, as modified by its faults.
#[derive(Debug)]
pub struct CellRun<'a> {
    /// Row of the weight matrix at the first entry; the other entries use the following rows.
    pub first_row: u64,
    /// Time from one measurement to the next, s.
    pub period_s: f64,
    /// Drive level, −1 to 1.
    pub levels: &'a mut [f64],
    /// Factor on the taxel's contribution; 1 for a fault-free cell.
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

/// A run of consecutive measurements. The readout decides how to divide a block into runs, and the result must not
/// depend on it.
///
/// All slices have one entry a measurement.
#[derive(Debug)]
pub struct Batch<'a> {
    /// Time from one measurement to the next, s.
    pub period_s: f64,
    /// Rf·Vd, V/S: conductance times this is a taxel's contribution to the output at drive level 1, the weight +1.
    pub volts_per_siemens: f64,
    /// Σx, sum of the taxels' contributions at drive level 1, V.
    pub sum_v: &'a mut [f64],
    /// √Σ(wᵢ·xᵢ)², V, with the weight wᵢ of taxel i and its contribution xᵢ at drive level 1. With weights ±1 this is
    /// ‖x‖₂; in raster mode it is the scanned taxel's own contribution.
    pub norm_v: &'a mut [f64],
    /// Output so far, V. It starts as Σ wᵢ·xᵢ, and every effect modifies it in turn.
    pub output_v: &'a mut [f64],
    pub(crate) rows: &'a Rows,
    /// Conductance of the taxels, S.
    pub(crate) skin: Lines<'a>,
    /// Faulty cells.
    pub(crate) cells: &'a mut Cells,
}

/// A cell that does something else than its weights say, over the measurements of a batch.
#[derive(Debug, Default)]
pub(crate) struct Cell {
    pub(crate) taxel: usize,
    /// Whether a fault determines the cell's level.
    decided: bool,
    /// Level at the measurement before the batch, then at each measurement of the batch.
    levels: Vec<f64>,
    /// Factor on the taxel's contribution, in the same order.
    gains: Vec<f64>,
}

impl Cell {
    /// Drive level at measurement `i`.
    #[inline]
    pub(crate) fn level(&self, i: usize) -> f64 {
        self.levels[i + 1]
    }

    /// Whether level or gain at measurement `i` are others than `level` and 1.
    #[inline]
    pub(crate) fn differs(&self, i: usize, level: f64) -> bool {
        (self.level(i) - level).abs() + (self.gain(i) - 1.0).abs() > 0.0
    }

    /// Factor of the contribution at measurement `i`.
    #[inline]
    pub(crate) fn gain(&self, i: usize) -> f64 {
        self.gains[i + 1]
    }
}

/// The cells of a batch that are not as they should be. The buffers of the batch before are used again.
#[derive(Debug, Default)]
pub(crate) struct Cells {
    /// In order of taxel.
    used: Vec<Cell>,
    free: Vec<Cell>,
}

impl Cells {
    /// All cells are as they should be.
    pub(crate) fn clear(&mut self) {
        self.free.append(&mut self.used);
    }

    /// Cell of `taxel`, unless it is as it should be.
    #[inline]
    pub(crate) fn get(&self, taxel: usize) -> Option<&Cell> {
        let place = self.used.binary_search_by_key(&taxel, |cell| cell.taxel).ok()?;
        self.used.get(place)
    }

    /// Cells in the order of their taxels.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Cell> {
        self.used.iter()
    }

    fn put(&mut self, mut cell: Cell) {
        match self.used.binary_search_by_key(&cell.taxel, |other| other.taxel) {
            Ok(place) => {
                std::mem::swap(&mut self.used[place], &mut cell);
                self.free.push(cell);
            }
            Err(place) => self.used.insert(place, cell),
        }
    }
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
    pub fn len(&self) -> usize {
        self.output_v.len()
    }

    /// Whether the batch is empty. The readout makes no empty batch.
    pub fn is_empty(&self) -> bool {
        self.output_v.is_empty()
    }

    /// Row of the weight matrix at measurement `i`: clock edges since the seeds were loaded.
    #[inline]
    pub fn row(&self, i: usize) -> u64 {
        self.rows.first_row() + i as u64
    }

    /// Drive level of `taxel` at measurement `i`, in O(1).
    #[inline]
    pub fn level(&self, taxel: usize, i: usize) -> f64 {
        match self.cell(taxel) {
            Some(cell) => cell.level(i),
            None => self.rows.level(taxel, i),
        }
    }

    /// Drive level of `taxel` at the measurement before measurement `i`, in O(1); 0 before the first measurement.
    #[inline]
    pub(crate) fn previous_level(&self, taxel: usize, i: usize) -> f64 {
        match self.cell(taxel) {
            Some(cell) => cell.levels[i],
            None => self.rows.previous_level(taxel, i),
        }
    }

    /// Contribution of `taxel` to measurement `i` at drive level 1, V.
    #[inline]
    pub(crate) fn taxel_v(&self, taxel: usize, i: usize) -> f64 {
        let gain = self.cell(taxel).map_or(1.0, |cell| cell.gain(i));
        gain * self.sound_v(taxel, i)
    }

    /// Kind of the levels that the cells put out.
    pub fn mode(&self) -> WeightMode {
        self.rows.weights().mode()
    }

    /// Adds Σₖ (`means`ₖ + `halves`ₖ·wₖ)·xₖ, of sound cells, to the output. Not for analog weights.
    pub(crate) fn add_errors(&mut self, means: &[f64], halves: &[f64], scratch: &mut Scratch) {
        let skin = self.skin;
        let times = |values: &[f64], out: &mut Vec<f64>| {
            out.resize(values.len(), 0.0);
            skin.places().for_each(|k| out[k] = values[k] * halves[k]);
        };
        times(skin.from, &mut scratch.from);
        let to = skin.to.map(|to| {
            times(to, &mut scratch.to);
            &scratch.to[..]
        });
        let lines = Lines { from: &scratch.from, to, ..skin };
        self.rows.sum(lines, &mut scratch.sums);
        let total = |values: &[f64]| skin.places().map(|k| values[k] * means[k]).sum();
        let (from, to) = (total(self.skin.from), self.skin.to.map(total));
        for (i, output_v) in self.output_v.iter_mut().enumerate() {
            let error = lines.between(i, from, || to) + self.rows.weighted(&lines, &scratch.sums, i);
            *output_v += error * self.volts_per_siemens;
        }
        // other taxels may conduct in the next batch
        for values in [&mut scratch.from, &mut scratch.to] {
            skin.places().for_each(|k| values.get_mut(k).into_iter().for_each(|value| *value = 0.0));
        }
    }

    /// Contribution of `taxel` at level 1 without its faults, V.
    #[inline]
    pub(crate) fn sound_v(&self, taxel: usize, i: usize) -> f64 {
        self.skin.at(taxel, i) * self.volts_per_siemens
    }

    #[inline]
    fn cell(&self, taxel: usize) -> Option<&Cell> {
        self.cells.get(taxel)
    }

    /// Whether a fault decides the level of `taxel`.
    pub(crate) fn decided(&self, taxel: usize) -> bool {
        self.cell(taxel).is_some_and(|cell| cell.decided)
    }

    /// Changes a cell and, with it, output, sum and norm. `change` has the measurement before the batch, too, except
    /// before the first of all. `decides`: it leaves nothing of the level that it finds.
    pub(crate) fn change(&mut self, taxel: usize, decides: bool, change: impl FnOnce(&mut CellRun<'_>)) {
        let mut cell = self.cells.free.pop().unwrap_or_default();
        self.describe(taxel, &mut cell);
        cell.decided |= decides;
        let skipped = usize::from(self.row(0) == 0);
        change(&mut CellRun {
            first_row: self.row(0).saturating_sub(1),
            period_s: self.period_s,
            levels: &mut cell.levels[skipped..],
            gains: &mut cell.gains[skipped..],
        });
        let before = self.cells.get(taxel);
        for i in 0..self.output_v.len() {
            let x = self.skin.at(taxel, i) * self.volts_per_siemens;
            let (level, gain) = match before {
                Some(before) => (before.level(i), before.gain(i)),
                None => (self.rows.level(taxel, i), 1.0),
            };
            let (old, new) = (level * gain * x, cell.level(i) * cell.gain(i) * x);
            let difference = new - old;
            // not 0.0 either, which would make −0.0 of the output 0.0, but only in a batch that has the cell
            if difference != 0.0 {
                self.output_v[i] += difference;
            }
            self.sum_v[i] += (cell.gain(i) - gain) * x;
            let change = new * new - old * old;
            if change != 0.0 {
                self.norm_v[i] = (self.norm_v[i] * self.norm_v[i] + change).max(0.0).sqrt();
            }
        }
        self.cells.put(cell);
    }

    /// Writes what the cell of `taxel` does so far into `cell`.
    fn describe(&self, taxel: usize, cell: &mut Cell) {
        cell.taxel = taxel;
        cell.levels.clear();
        cell.gains.clear();
        if let Some(now) = self.cell(taxel) {
            cell.decided = now.decided;
            cell.levels.extend_from_slice(&now.levels);
            cell.gains.extend_from_slice(&now.gains);
        } else {
            cell.decided = false;
            cell.levels.push(self.rows.previous_level(taxel, 0));
            cell.levels.extend((0..self.len()).map(|i| self.rows.level(taxel, i)));
            cell.gains.resize(self.len() + 1, 1.0);
        }
    }
}
