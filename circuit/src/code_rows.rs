//! Consecutive rows of codes that are given rather than computed.

use crate::code_kernels::{given_sums, given_sums_and_squares};
use crate::codes::{FULL_SCALE, NEUTRAL};
use crate::kernels::{LANES, Lines, Sums};
use crate::mode::{ANALOG_SCALE, WeightMode};

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
        Self {
            mode,
            taxels,
            first_row: 0,
            len: 0,
            levels,
            codes: Vec::new(),
            kinds: Vec::new(),
            drives: Vec::new(),
        }
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

    /// Adds to the cleared `sums` those over the taxels with values on `lines`, as
    /// [`Rows::sum`](crate::rows::Rows::sum) says.
    pub(crate) fn sum(&self, lines: Lines<'_>, sums: &mut Sums) {
        match self.mode {
            WeightMode::Raster => {
                for (i, sum) in sums.from.iter_mut().take(self.len).enumerate() {
                    *sum = self.raster(&lines, i);
                }
            }
            WeightMode::Binary => {
                given_sums(&self.drives, lines.from, &mut sums.from);
                if let Some(to) = lines.to {
                    given_sums(&self.drives, to, &mut sums.to);
                }
            }
            WeightMode::Analog => given_sums_and_squares(&self.drives, lines, &mut sums.from, &mut sums.squares),
        }
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
