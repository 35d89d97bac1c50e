//! DAC codes from outside that replace those of the generator's formula.

use crate::mode::{ANALOG_SCALE, WeightMode};

/// Code of level 1.
pub(crate) const FULL_SCALE: u8 = 255;
/// Code of level 0.
pub(crate) const NEUTRAL: u8 = 126;

impl WeightMode {
    /// Drive level of DAC code k in this mode: (k − 127.5)/127.5, and 0 for the neutral code 126, to which the
    /// amplifier's bias is trimmed. In analog mode 126 is an ordinary level, because the generator's top byte can be
    /// 126.
    #[must_use]
    pub fn code_level(self, code: u8) -> f64 {
        if code == NEUTRAL && self != Self::Analog {
            return 0.0;
        }
        (f64::from(code) - ANALOG_SCALE) / ANALOG_SCALE
    }
}

/// Nearest code of a level, the neutral one of level 0.
#[expect(clippy::cast_possible_truncation, reason = "float to integer casts saturate")]
pub(crate) fn code_of(level: f64) -> u8 {
    if level == 0.0 {
        NEUTRAL
    } else {
        (ANALOG_SCALE * (1.0 + level)).round() as u8
    }
}

/// Codes that the cells of a skin put out, row by row. A readout drives its taxels with them
/// ([`Readout::with_codes`](crate::Readout::with_codes)).
///
/// The content of a row depends only on its number, not on the rows requested before; [`check_codes`] checks this.
///
/// ```
/// use spts_circuit::{CellCodes, CodesError, check_codes};
///
/// /// Cells that all switch between the lowest and the highest code.
/// struct Blinking;
///
/// impl CellCodes for Blinking {
///     fn taxels(&self) -> usize {
///         4
///     }
///     fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), CodesError> {
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
    /// [`CodesError`] if the cells cannot reach these rows.
    fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), CodesError>;
}

/// Why codes are not available.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CodesError {
    /// The cells belong to another skin.
    #[error("the codes are those of {cells} cells; the readout has {taxels} taxels")]
    Taxels {
        /// Number of cells that put out codes.
        cells: usize,
        /// Number of taxels of the readout.
        taxels: usize,
    },
    /// The cells cannot put out a row.
    #[error("no codes from row {row} on: {reason}")]
    Row {
        /// First requested row.
        row: u64,
        /// Cause.
        reason: String,
    },
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seeding::Seeding;
    use crate::weights::Weights;

    /// Every level that a sound cell has is the level of the code that it stands for, bit for bit.
    #[test]
    fn codes_and_levels_are_inverse() {
        for mode in [WeightMode::Raster, WeightMode::Analog, WeightMode::Binary] {
            let weights = Weights::new(mode, Seeding::Address, 100);
            for row in 0..100 {
                let level = weights.level(31, row);
                assert_eq!(mode.code_level(code_of(level)).to_bits(), level.to_bits(), "{mode:?}");
            }
            for code in 0..=u8::MAX {
                assert_eq!(code_of(mode.code_level(code)), code, "{mode:?}");
            }
        }
    }
}
