//! Consecutive rows of the weight matrix, computed without storing the matrix, and rows of codes that come from
//! outside.

use super::kernels::{Drives, Jumps, LANES, Lines, Sums, analog_sums, signed_sums, signed_sums_2};
use super::lcg::{ANALOG_SCALE, Jump, Seeds};
use super::sequence::{FULL_SCALE, NEUTRAL, Patterns, WeightMode, Weights};
use spts_input::Refusal;
use std::convert::Infallible;

/// Codes that the cells of a skin put out, row by row. A readout drives its taxels with them
/// ([`Readout::with_codes`](crate::Readout::with_codes)).
///
/// The content of a row depends only on its number, not on the rows requested before; [`check_codes`] checks this.
///
/// ```
/// use spts_circuit::{CellCodes, check_codes};
/// use spts_input::Refusal;
///
/// /// Cells that all switch between the lowest and the highest code.
/// struct Blinking;
///
/// impl CellCodes for Blinking {
///     fn taxels(&self) -> usize {
///         4
///     }
///     fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), Refusal> {
///         for (row, codes) in (first_row..).zip(out.chunks_exact_mut(4)) {
///             codes.fill(if row % 2 == 0 { 0 } else { 255 });
///         }
///         Ok(())
///     }
/// }
/// check_codes(&|| Box::new(Blinking));
/// ```
pub trait CellCodes: Send {
    /// Number of cells: the length of a row.
    fn taxels(&self) -> usize;

    /// Writes the DAC code of every cell, as it is when the output is sampled, into `out`: consecutive rows from
    /// `first_row` on, row-major. Rows count clock edges from 0, since loading the seeds. The length of `out` is a
    /// whole number of rows. Without a seek, the readout requests rows in increasing order.
    ///
    /// # Errors
    /// [`Refusal`] if the cells cannot reach these rows.
    fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), Refusal>;
}

/// The cells repeat the pattern.
impl CellCodes for Patterns {
    fn taxels(&self) -> usize {
        Patterns::taxels(self)
    }

    fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), Refusal> {
        self.fill(first_row, out);
        Ok(())
    }
}

/// Checks the property that every source of codes must have: rows are the same when requested at once, in pieces of
/// other lengths, backwards, or from the middle on. `build` makes a fresh source.
///
/// # Panics
/// If the source lacks the property or returns an error.
pub fn check_codes(build: &dyn Fn() -> Box<dyn CellCodes>) {
    const ROWS: usize = 700;
    let mut source = build();
    let taxels = source.taxels();
    assert!(taxels > 0, "a skin has taxels");
    let mut whole = vec![0; ROWS * taxels];
    source.codes(0, &mut whole).expect("the first rows");
    let check = |source: &mut dyn CellCodes, first_row: usize, rows: usize| {
        let mut piece = vec![0; rows * taxels];
        source.codes(first_row as u64, &mut piece).expect("rows once more");
        let expected = &whole[first_row * taxels..(first_row + rows) * taxels];
        assert!(piece == expected, "{rows} rows from {first_row} on differ");
    };
    for length in [1, 7, 128] {
        let mut pieces = build();
        for first_row in (0..=ROWS - length).step_by(length) {
            check(&mut *pieces, first_row, length);
        }
        for first_row in (0..=ROWS - length).rev().step_by(97) {
            check(&mut *pieces, first_row, length);
        }
    }
    check(&mut *build(), 513, ROWS - 513);
}

/// What a row is beside those that sound cells put out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Every level is valid in the mode.
    Sound,
    /// In raster mode: level 1 of this taxel and 0 of all others.
    Scan(usize),
    /// Any other levels.
    Odd,
}

impl Kind {
    /// Kind of a row of `codes`.
    fn of(mode: WeightMode, codes: &[u8]) -> Self {
        match mode {
            WeightMode::Analog => Self::Sound,
            WeightMode::Binary if codes.iter().all(|code| matches!(*code, 0 | FULL_SCALE)) => Self::Sound,
            WeightMode::Binary => Self::Odd,
            WeightMode::Raster => {
                let mut driven = codes.iter().enumerate().filter(|(_, code)| **code != NEUTRAL);
                match (driven.next(), driven.next()) {
                    (Some((taxel, &FULL_SCALE)), None) => Self::Scan(taxel),
                    _ => Self::Odd,
                }
            }
        }
    }
}

/// A run of rows of codes, and the row before it.
#[derive(Debug, Clone)]
pub(crate) struct CodeRows {
    mode: WeightMode,
    taxels: usize,
    first_row: u64,
    len: usize,
    /// Level of every code.
    levels: [f64; 256],
    /// Row-major: the row before the first (nothing before the first edge), then the rows.
    codes: Vec<u8>,
    kinds: Vec<Kind>,
    /// Levels, times 127.5 in analog mode. Taxel-major, padded with zeros to whole SIMD lanes of rows and to groups of
    /// four taxels. Empty in raster mode.
    drives: Vec<f64>,
}

impl CodeRows {
    /// No rows yet.
    pub(crate) fn new(mode: WeightMode, taxels: usize) -> Self {
        let mut levels = [0.0; 256];
        for (code, level) in (0..=u8::MAX).zip(&mut levels) {
            *level = mode.code_level(code);
        }
        Self { mode, taxels, first_row: 0, len: 0, levels, codes: Vec::new(), kinds: Vec::new(), drives: Vec::new() }
    }

    /// Goes to the rows `first_row..first_row + len` of a source, whose `codes` writes as many rows as the slice holds,
    /// from a given row on. A row that is still here is not asked for again.
    ///
    /// # Errors
    /// Those of the source.
    pub(crate) fn go_to<E>(
        &mut self,
        first_row: u64,
        len: usize,
        mut codes: impl FnMut(u64, &mut [u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let follows = self.len > 0 && first_row == self.first_row + self.len as u64;
        if follows {
            self.codes.copy_within(self.len * self.taxels.., 0);
        }
        self.codes.resize((len + 1) * self.taxels, 0);
        // should the source fail, nothing that is here counts
        self.len = 0;
        match first_row.checked_sub(1) {
            Some(before) if !follows => codes(before, &mut self.codes)?,
            _ => codes(first_row, &mut self.codes[self.taxels..])?,
        }
        (self.first_row, self.len) = (first_row, len);
        self.kinds.clear();
        for row in self.codes.chunks_exact(self.taxels.max(1)).skip(1) {
            self.kinds.push(Kind::of(self.mode, row));
        }
        self.set_drives();
        Ok(())
    }

    fn set_drives(&mut self) {
        if self.mode == WeightMode::Raster {
            return;
        }
        let stride = self.padded_len();
        self.drives.clear();
        self.drives.resize(self.taxels.next_multiple_of(4) * stride, 0.0);
        let columns = self.drives.chunks_exact_mut(stride.max(1)).take(self.taxels);
        for (k, drives) in columns.enumerate() {
            let codes = self.codes[self.taxels..].iter().skip(k).step_by(self.taxels);
            for (drive, code) in drives.iter_mut().zip(codes) {
                *drive = match self.mode {
                    // not the level times 127.5, which would be rounded twice
                    WeightMode::Analog => f64::from(*code) - ANALOG_SCALE,
                    _ => self.levels[usize::from(*code)],
                };
            }
        }
    }

    /// Number of measurements, padded to whole lanes.
    pub(crate) fn padded_len(&self) -> usize {
        self.len.next_multiple_of(LANES)
    }

    /// Level of `taxel` at measurement `i`. Out of line, so that the generator's path stays short.
    #[inline(never)]
    pub(crate) fn level(&self, taxel: usize, i: usize) -> f64 {
        self.levels[usize::from(self.codes[(i + 1) * self.taxels + taxel])]
    }

    /// Level of `taxel` at the measurement before measurement `i`; 0 before the first edge of all.
    #[inline(never)]
    pub(crate) fn previous_level(&self, taxel: usize, i: usize) -> f64 {
        if i == 0 && self.first_row == 0 {
            return 0.0;
        }
        self.levels[usize::from(self.codes[i * self.taxels + taxel])]
    }

    /// Measurements with levels that sound cells in this mode do not have together.
    pub(crate) fn odd(&self) -> impl Iterator<Item = usize> {
        (0..self.len).filter(|i| self.kinds[*i] == Kind::Odd)
    }

    /// The levels for the kernels; none in raster mode.
    fn drives(&self) -> Drives<'_> {
        Drives::Codes(&self.drives, self.padded_len())
    }

    /// Σ wₖ·xₖ at measurement `i` of a raster.
    fn raster(&self, lines: &Lines<'_>, i: usize) -> f64 {
        match self.kinds[i] {
            Kind::Scan(taxel) => lines.at(taxel, i),
            _ => self.contributions(lines, i).sum(),
        }
    }

    /// √Σ(wₖ·xₖ)² at measurement `i`.
    pub(crate) fn norm(&self, lines: &Lines<'_>, i: usize) -> f64 {
        self.contributions(lines, i).map(|x| x * x).sum::<f64>().sqrt()
    }

    fn contributions(&self, lines: &Lines<'_>, i: usize) -> impl Iterator<Item = f64> {
        (0..self.taxels).map(move |k| self.level(k, i) * lines.at(k, i))
    }
}

/// Rows that [`Weights::weighted_sums`] sums at a time.
const RUN: usize = 128;

/// A run of rows: one jump from the seeds a row, so that any level of it is two operations away; or codes that are
/// given.
#[derive(Debug, Clone)]
pub(crate) struct Rows {
    weights: Weights,
    first_row: u64,
    /// Codes of the cells, if they are given or form a pattern.
    given: Option<Box<CodeRows>>,
    /// Whether raster mode also computes sums: given codes may drive any number of taxels.
    summed: bool,
    /// Jump to the row before the first; `None` before the first edge.
    before: Option<Jump>,
    jumps: Jumps,
}

impl Rows {
    /// No rows yet.
    pub(crate) fn new(weights: Weights) -> Self {
        Self { weights, first_row: 0, given: None, summed: false, before: None, jumps: Jumps::default() }
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
    ) -> Result<(), Refusal> {
        let (mode, taxels) = (self.weights.mode(), self.weights.taxels());
        let given = self.given.get_or_insert_with(|| Box::new(CodeRows::new(mode, taxels)));
        (self.first_row, self.summed) = (first_row, true);
        given.go_to(first_row, len, |row, codes| source.codes(row, codes))
    }

    /// Goes to the rows `first_row..first_row + len`.
    pub(crate) fn go_to(&mut self, first_row: u64, len: usize) {
        self.first_row = first_row;
        if let Some(patterns) = self.weights.patterns() {
            let (mode, taxels) = (self.weights.mode(), self.weights.taxels());
            let given = self.given.get_or_insert_with(|| Box::new(CodeRows::new(mode, taxels)));
            let Ok(()) = given.go_to(first_row, len, |row, codes| {
                patterns.fill(row, codes);
                Ok::<(), Infallible>(())
            });
            return;
        }
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

    /// Seed of `taxel`; only the generator's rows ask for it.
    #[inline]
    fn seed(&self, taxel: usize) -> u32 {
        self.weights.seeds().map_or(0, |seeds| seeds.seed(taxel))
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
        let state = self.jumps.state(self.seed(taxel), i);
        self.weights.mode().level(state)
    }

    /// Whether the levels are given by codes of the cells, and not by the weights.
    pub(crate) fn are_given(&self) -> bool {
        self.given.is_some()
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
        self.before.map_or(0.0, |jump| self.weights.mode().level(jump.apply(self.seed(taxel))))
    }

    /// Sums over the taxels with values on `lines`, into `sums`, whose old content is dropped. In raster mode the
    /// generator's rows have no sums.
    pub(crate) fn sum(&self, lines: Lines<'_>, sums: &mut Sums) {
        let given = self.given.as_deref();
        let len = given.map_or(self.jumps.len(), CodeRows::padded_len);
        let Sums { from, to, squares, gathered } = sums;
        for sum in [&mut *from, to, squares] {
            sum.clear();
            sum.resize(len, 0.0);
        }
        let (lines, drives) = match (given, self.weights.seeds()) {
            (Some(given), _) => (lines, given.drives()),
            (None, Some(seeds)) if lines.fours.is_some() => {
                let (lines, seeds) = lines.gathered(seeds, gathered);
                (lines, Drives::Generator(&self.jumps, Seeds::Given(seeds)))
            }
            (None, Some(seeds)) => (lines, Drives::Generator(&self.jumps, seeds)),
            (None, None) => return,
        };
        match (self.weights.mode(), lines.to) {
            (WeightMode::Binary, Some(values)) => {
                signed_sums_2(drives, [lines.from, values], [from, to]);
            }
            (WeightMode::Binary, None) => signed_sums(drives, lines.from, from),
            (WeightMode::Analog, _) => analog_sums(drives, lines, from, squares),
            (WeightMode::Raster, _) => {
                if let Some(given) = given {
                    for (i, sum) in from.iter_mut().take(given.len).enumerate() {
                        *sum = given.raster(&lines, i);
                    }
                }
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

impl Weights {
    /// Σₖ wₖ·valuesₖ at consecutive rows from `first_row` on, one for each entry of `out`; the matrix is never stored.
    /// The sums have the same bits on every machine, and for any division of the rows among calls.
    ///
    /// # Panics
    /// If `values` does not have one entry a taxel.
    pub fn weighted_sums(&self, first_row: u64, values: &[f64], out: &mut [f64]) {
        assert_eq!(values.len(), self.taxels(), "one value a taxel");
        if values.is_empty() {
            out.fill(0.0);
            return;
        }
        if let Some(wires) = self.wires().filter(|_| self.mode() != WeightMode::Raster) {
            // every wire has each of its samples `count` places after the last
            let count = wires.count();
            for wire in 0..count {
                let own: Vec<f64> = wires.taxels(wire).iter().map(|k| values[*k as usize]).collect();
                let first = self.before(wire, first_row);
                #[expect(clippy::cast_possible_truncation, reason = "less than the number of wires")]
                let start = (first * count as u64 + wire as u64 - first_row) as usize;
                let mut sums = vec![0.0; out.len().saturating_sub(start).div_ceil(count)];
                self.of_wire(wire).weighted_sums(first, &own, &mut sums);
                out.iter_mut().skip(start).step_by(count).zip(&sums).for_each(|(out, sum)| *out = *sum);
            }
            return;
        }
        let (mut rows, mut sums) = (Rows::new(self.clone()), Sums::default());
        for (out, first_row) in out.chunks_mut(RUN).zip((first_row..).step_by(RUN)) {
            rows.go_to(first_row, out.len());
            let lines = Lines { from: values, to: None, share: &[0.0; RUN], fours: None };
            rows.sum(lines, &mut sums);
            for (i, out) in out.iter_mut().enumerate() {
                *out = rows.weighted(&lines, &sums, i);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::weights::Seeding;

    /// The sums have the same bits however the rows are divided among calls.
    #[test]
    fn the_cut_into_runs_does_not_show() {
        for taxels in [1, 5, 64, 100, 131] {
            let values: Vec<f64> = (0..taxels).map(|k| (0.7 * f64::from(k)).sin() * 10.0).collect();
            for mode in [WeightMode::Raster, WeightMode::Analog, WeightMode::Binary] {
                for seeding in [Seeding::Address, Seeding::Mixed] {
                    let weights = Weights::new(mode, seeding, taxels);
                    let (mut sums, mut again) = ([0.0; 300], [0.0; 300]);
                    weights.weighted_sums(77, &values, &mut sums);
                    for (i, out) in again.chunks_mut(7).enumerate() {
                        weights.weighted_sums(77 + 7 * i as u64, &values, out);
                    }
                    let [sums, again] = [sums, again].map(|sums| sums.map(f64::to_bits));
                    assert!(sums == again, "{mode:?}, {seeding:?}, {taxels} taxels");
                }
            }
        }
    }
}
