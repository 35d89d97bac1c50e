//! Consecutive rows of the weight matrix, without the matrix.

use crate::kernels::{Jumps, LANES, Lanes, Lines, analog_sums, signed_sums, signed_sums_2};
use crate::lcg::Jump;
use crate::weights::{ANALOG_SCALE, WeightMode, Weights};

/// A run of rows: one jump from the seeds a row, so that any level of it is two operations away.
#[derive(Debug, Clone)]
pub(crate) struct Rows {
    weights: Weights,
    first_row: u64,
    /// Jump to the row before the first; none before the first edge of all.
    before: Option<Jump>,
    jumps: Vec<Jumps>,
}

/// Sums over the taxels, one a measurement.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sums {
    /// Σ wₖ·fromₖ for binary weights; Σ wₖ·xₖ for others.
    pub(crate) from: Vec<Lanes<f64>>,
    /// Σ wₖ·toₖ for binary weights.
    pub(crate) to: Vec<Lanes<f64>>,
    /// Σ (wₖ·xₖ)² for analog weights.
    pub(crate) squares: Vec<Lanes<f64>>,
}

impl Rows {
    /// No rows yet.
    pub(crate) fn new(weights: Weights) -> Self {
        Self {
            weights,
            first_row: 0,
            before: None,
            jumps: Vec::new(),
        }
    }

    /// Goes to the rows `first_row..first_row + len`.
    pub(crate) fn go_to(&mut self, first_row: u64, len: usize) {
        self.first_row = first_row;
        self.jumps.clear();
        if self.weights.mode() == WeightMode::Raster {
            return;
        }
        let before = Jump::new(first_row);
        self.before = (first_row > 0).then_some(before);
        let mut next = before.then(Jump::ONE);
        for _ in 0..len.div_ceil(LANES) {
            let (jumps, after) = Jumps::from(next);
            self.jumps.push(jumps);
            next = after;
        }
    }

    /// Weights that these are rows of.
    pub(crate) fn weights(&self) -> &Weights {
        &self.weights
    }

    /// Row of the first measurement.
    pub(crate) fn first_row(&self) -> u64 {
        self.first_row
    }

    /// Taxel that measurement `i` of a raster scans.
    pub(crate) fn scanned(&self, i: usize) -> usize {
        let taxel = (self.first_row + i as u64) % self.weights.taxels() as u64;
        usize::try_from(taxel).unwrap_or(usize::MAX)
    }

    /// Level of `taxel` at measurement `i`.
    #[inline]
    pub(crate) fn level(&self, taxel: usize, i: usize) -> f64 {
        if self.weights.mode() == WeightMode::Raster {
            return f64::from(self.scanned(i) == taxel);
        }
        let seed = self.weights.seed(taxel);
        #[expect(clippy::cast_possible_truncation, reason = "the state is the low half")]
        let state = self.jumps[i / LANES].state(u64::from(seed), i % LANES) as u32;
        self.weights.mode().level(state)
    }

    /// Level of `taxel` at the measurement before measurement `i`; 0 before the first edge of all.
    #[inline]
    pub(crate) fn previous_level(&self, taxel: usize, i: usize) -> f64 {
        if i > 0 {
            return self.level(taxel, i - 1);
        }
        if self.weights.mode() == WeightMode::Raster {
            let before = self.first_row.checked_sub(1);
            return f64::from(before.is_some_and(|row| row % self.weights.taxels() as u64 == taxel as u64));
        }
        self.before.map_or(0.0, |jump| {
            self.weights.mode().level(jump.apply(self.weights.seed(taxel)))
        })
    }

    /// Sums over the taxels with values on `lines`, into `sums`, whose old content is dropped. In raster mode nothing is summed.
    pub(crate) fn sum(&self, lines: Lines<'_>, moving: bool, sums: &mut Sums) {
        let clear = |sum: &mut Vec<Lanes<f64>>| {
            sum.clear();
            sum.resize(self.jumps.len(), [0.0; LANES]);
        };
        clear(&mut sums.from);
        let seeding = self.weights.seeding();
        match self.weights.mode() {
            WeightMode::Raster => {}
            WeightMode::Binary if moving => {
                clear(&mut sums.to);
                signed_sums_2(
                    &self.jumps,
                    seeding,
                    [lines.from, lines.to],
                    [&mut sums.from, &mut sums.to],
                );
            }
            WeightMode::Binary => signed_sums(&self.jumps, seeding, lines.from, &mut sums.from),
            WeightMode::Analog => {
                clear(&mut sums.squares);
                analog_sums(&self.jumps, seeding, lines, &mut sums.from, &mut sums.squares);
            }
        }
    }

    /// Σ wₖ·`values`ₖ at every row.
    pub(crate) fn weighted_sums(&self, values: &[f64], sums: &mut Sums, out: &mut [f64]) {
        let share = vec![[0.0; LANES]; self.jumps.len()];
        let lines = Lines {
            from: values,
            to: values,
            share: &share,
        };
        self.sum(lines, false, sums);
        for (i, out) in out.iter_mut().enumerate() {
            *out = match self.weights.mode() {
                WeightMode::Raster => values[self.scanned(i)],
                WeightMode::Binary => sums.from[i / LANES][i % LANES],
                WeightMode::Analog => sums.from[i / LANES][i % LANES] / ANALOG_SCALE,
            };
        }
    }
}
