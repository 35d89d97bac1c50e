//! Levels that repeat after a number of rows.

use crate::mode::WeightMode;
use crate::weights_error::WeightsError;
use serde::{Deserialize, Serialize};

/// Most codes in a pattern.
const MAX_CODES: usize = 1 << 30;

/// Levels that the cells repeat: row r of the weights is row r mod `period` of the pattern.
///
/// As text: `{"period": 2, "codes": [0, 255, 255, 0]}`, with the codes in row-major order.
///
/// ```
/// use spts_circuit::{Patterns, WeightMode, Weights};
///
/// let patterns = Patterns::new(2, vec![0, 255, 255, 0])?;
/// let weights = Weights::with_patterns(WeightMode::Binary, patterns)?;
/// assert_eq!([weights.level(0, 6), weights.level(1, 6), weights.level(0, 7)], [-1.0, 1.0, 1.0]);
/// # Ok::<(), spts_circuit::WeightsError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "PatternsConfig", into = "PatternsConfig")]
pub struct Patterns {
    taxels: usize,
    codes: Vec<u8>,
}

/// Text of [`Patterns`].
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PatternsConfig {
    period: usize,
    codes: Vec<u8>,
}

impl TryFrom<PatternsConfig> for Patterns {
    type Error = WeightsError;
    fn try_from(config: PatternsConfig) -> Result<Self, WeightsError> {
        Self::new(config.period, config.codes)
    }
}

impl From<Patterns> for PatternsConfig {
    fn from(patterns: Patterns) -> Self {
        Self {
            period: patterns.period(),
            codes: patterns.codes,
        }
    }
}

impl Patterns {
    /// A pattern of `period` rows of DAC codes in row-major order. Code k is level (k − 127.5)/127.5. The number of
    /// taxels is the number of codes divided by `period`.
    ///
    /// # Errors
    /// [`WeightsError`] for no code, more than 2³⁰ codes, or a number of codes that is not a multiple of `period`.
    pub fn new(period: usize, codes: Vec<u8>) -> Result<Self, WeightsError> {
        let len = codes.len();
        if !(1..=MAX_CODES).contains(&len) {
            return Err(WeightsError::Length {
                field: "patterns.codes",
                len,
                most: MAX_CODES,
            });
        }
        match len.checked_div(period) {
            Some(taxels) if taxels > 0 && taxels * period == len => Ok(Self { taxels, codes }),
            _ => Err(WeightsError::Rows { len, period }),
        }
    }

    /// A pattern of `period` rows, from `levels` in [−1, 1], row-major. Every cell puts out the code nearest to its
    /// level.
    ///
    /// ```
    /// use spts_circuit::Patterns;
    ///
    /// assert_eq!(Patterns::of_levels(1, &[-1.0, 1.0])?.row(0), [0, 255]);
    /// # Ok::<(), spts_circuit::WeightsError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Patterns::new`].
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "float to integer casts saturate"
    )]
    pub fn of_levels(period: usize, levels: &[f64]) -> Result<Self, WeightsError> {
        let code = |level: &f64| (127.5 * (1.0 + level)).round() as u8;
        Self::new(period, levels.iter().map(code).collect())
    }

    /// Number of rows after which the pattern repeats.
    #[must_use]
    pub fn period(&self) -> usize {
        self.codes.len() / self.taxels
    }

    /// Number of taxels: the length of a row.
    #[must_use]
    pub fn taxels(&self) -> usize {
        self.taxels
    }

    /// Codes of row `row`, one a taxel. Rows beyond the period repeat.
    #[must_use]
    pub fn row(&self, row: u64) -> &[u8] {
        let first = usize::try_from(row % self.period() as u64).unwrap_or(0) * self.taxels;
        &self.codes[first..first + self.taxels]
    }

    /// Writes the codes of as many consecutive rows as `out` holds, starting with `first_row`.
    pub(crate) fn fill(&self, first_row: u64, out: &mut [u8]) {
        for (row, out) in (first_row..).zip(out.chunks_exact_mut(self.taxels)) {
            out.copy_from_slice(self.row(row));
        }
    }

    /// Checks that cells in `mode` can put out every code.
    pub(crate) fn check(&self, mode: WeightMode) -> Result<(), WeightsError> {
        match mode {
            WeightMode::Raster => Err(WeightsError::Mode {
                field: "patterns",
                mode,
            }),
            WeightMode::Analog => Ok(()),
            WeightMode::Binary => match self.codes.iter().position(|code| !matches!(code, 0 | 255)) {
                None => Ok(()),
                Some(index) => Err(WeightsError::Code {
                    index,
                    code: self.codes[index],
                }),
            },
        }
    }
}
