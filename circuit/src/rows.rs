//! Consecutive rows of the weight matrix, without the matrix.

use crate::code_rows::CodeRows;
use crate::codes::{CellCodes, CodesError};
use crate::kernels::{Jumps, LANES, Lines, analog_sums, signed_sums, signed_sums_2};
use crate::lcg::Jump;
use crate::mode::{ANALOG_SCALE, WeightMode};
use crate::weights::Weights;

/// A run of rows: one jump from the seeds a row, so that any level of it is two operations away; or codes that are given.
#[derive(Debug, Clone)]
pub(crate) struct Rows {
    weights: Weights,
    first_row: u64,
    /// What the cells put out, where that comes from outside.
    given: Option<Box<CodeRows>>,
    /// Whether raster mode, too, has sums: with given codes any number of taxels may be scanned.
    summed: bool,
    /// Jump to the row before the first; none before the first edge of all.
    before: Option<Jump>,
    jumps: Jumps,
}

/// Sums over the taxels, one a measurement.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sums {
    /// Σ wₖ·fromₖ for binary weights; 127.5 Σ wₖ·xₖ for analog ones.
    pub(crate) from: Vec<f64>,
    /// Σ wₖ·toₖ for binary weights.
    pub(crate) to: Vec<f64>,
    /// 127.5² Σ (wₖ·xₖ)² for analog weights.
    pub(crate) squares: Vec<f64>,
}

impl Rows {
    /// No rows yet.
    pub(crate) fn new(weights: Weights) -> Self {
        Self {
            weights,
            first_row: 0,
            given: None,
            summed: false,
            before: None,
            jumps: Jumps::default(),
        }
    }

    /// Goes to the rows `first_row..first_row + len` of `source`, in place of the generator's.
    ///
    /// # Errors
    /// Those of the source.
    pub(crate) fn go_to_codes(
        &mut self,
        source: &mut dyn CellCodes,
        first_row: u64,
        len: usize,
    ) -> Result<(), CodesError> {
        let (mode, taxels) = (self.weights.mode(), self.weights.taxels());
        let given = self.given.get_or_insert_with(|| Box::new(CodeRows::new(mode, taxels)));
        (self.first_row, self.summed) = (first_row, true);
        given.go_to(source, first_row, len)
    }

    /// Goes to the rows `first_row..first_row + len`.
    pub(crate) fn go_to(&mut self, first_row: u64, len: usize) {
        self.first_row = first_row;
        if self.weights.mode() == WeightMode::Raster {
            return;
        }
        let before = Jump::new(first_row);
        self.before = (first_row > 0).then_some(before);
        self.jumps.go_to(before.then(Jump::ONE), len.next_multiple_of(LANES));
    }

    /// Weights that these are rows of.
    pub(crate) fn weights(&self) -> &Weights {
        &self.weights
    }

    /// Row of the first measurement.
    pub(crate) fn first_row(&self) -> u64 {
        self.first_row
    }

    /// Measurements with levels that sound cells in this mode do not have together, as only cells from outside may.
    pub(crate) fn odd(&self) -> impl Iterator<Item = usize> {
        self.given.iter().flat_map(|given| given.odd())
    }

    /// Taxel that measurement `i` of a raster scans.
    fn scanned(&self, i: usize) -> usize {
        let taxel = (self.first_row + i as u64) % self.weights.taxels().max(1) as u64;
        usize::try_from(taxel).unwrap_or(usize::MAX)
    }

    /// Level of `taxel` at measurement `i`.
    #[inline]
    pub(crate) fn level(&self, taxel: usize, i: usize) -> f64 {
        if let Some(given) = &self.given {
            return given.level(taxel, i);
        }
        if self.weights.mode() == WeightMode::Raster {
            return f64::from(self.scanned(i) == taxel);
        }
        let state = self.jumps.state(self.weights.seed(taxel), i);
        self.weights.mode().level(state)
    }

    /// Level of `taxel` at the measurement before measurement `i`; 0 before the first edge of all.
    #[inline]
    pub(crate) fn previous_level(&self, taxel: usize, i: usize) -> f64 {
        if let Some(given) = &self.given {
            return given.previous_level(taxel, i);
        }
        if i > 0 {
            return self.level(taxel, i - 1);
        }
        if self.weights.mode() == WeightMode::Raster {
            let before = self.first_row.checked_sub(1);
            let scanned = before.and_then(|row| row.checked_rem(self.weights.taxels() as u64));
            return f64::from(scanned == Some(taxel as u64));
        }
        self.before.map_or(0.0, |jump| {
            self.weights.mode().level(jump.apply(self.weights.seed(taxel)))
        })
    }

    /// Sums over the taxels with values on `lines`, into `sums`, whose old content is dropped. In raster mode the
    /// generator's rows have no sums.
    pub(crate) fn sum(&self, lines: Lines<'_>, sums: &mut Sums) {
        let len = self.given.as_ref().map_or(self.jumps.len(), |given| given.padded_len());
        let clear = |sum: &mut Vec<f64>| {
            sum.clear();
            sum.resize(len, 0.0);
        };
        clear(&mut sums.from);
        if let Some(given) = &self.given {
            clear(&mut sums.to);
            clear(&mut sums.squares);
            return given.sum(lines, sums);
        }
        let seeding = self.weights.seeding();
        match (self.weights.mode(), lines.to) {
            (WeightMode::Raster, _) => {}
            (WeightMode::Binary, Some(to)) => {
                clear(&mut sums.to);
                signed_sums_2(&self.jumps, seeding, [lines.from, to], [&mut sums.from, &mut sums.to]);
            }
            (WeightMode::Binary, None) => signed_sums(&self.jumps, seeding, lines.from, &mut sums.from),
            (WeightMode::Analog, _) => {
                clear(&mut sums.squares);
                analog_sums(&self.jumps, seeding, lines, &mut sums.from, &mut sums.squares);
            }
        }
    }

    /// Σ wₖ·xₖ at measurement `i`, from the `sums` of the same `lines`.
    #[inline(always)]
    pub(crate) fn weighted(&self, lines: &Lines<'_>, sums: &Sums, i: usize) -> f64 {
        match self.weights.mode() {
            WeightMode::Raster if self.summed => sums.from[i],
            WeightMode::Raster => lines.at(self.scanned(i), i),
            WeightMode::Binary => lines.between(i, sums.from[i], || lines.to.map(|_| sums.to[i])),
            WeightMode::Analog => sums.from[i] / ANALOG_SCALE,
        }
    }

    /// √Σ(wₖ·xₖ)² of the [`odd`](Self::odd) measurements.
    pub(crate) fn odd_norms(&self, lines: &Lines<'_>) -> impl Iterator<Item = (usize, f64)> {
        let given = self.given.iter();
        given.flat_map(move |given| given.odd().map(move |i| (i, given.norm(lines, i))))
    }
}
