//! Errors of weights.

use crate::mode::WeightMode;

/// Why weights are not valid.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum WeightsError {
    /// A list that is empty or too long.
    #[error("`{field}` has {len} entries; valid: [1, {most}]")]
    Length {
        /// Name of the list.
        field: &'static str,
        /// Number of its entries.
        len: usize,
        /// Largest number of entries.
        most: usize,
    },
    /// A list for another skin.
    #[error("`{field}` is for {found} taxels; expected {taxels}")]
    Taxels {
        /// Name of the list.
        field: &'static str,
        /// Number of taxels of the list.
        found: usize,
        /// Number of taxels of the skin.
        taxels: usize,
    },
    /// A number of codes that is not a multiple of the period.
    #[error("`patterns.codes` has {len} entries, not a positive multiple of `patterns.period` = {period}")]
    Rows {
        /// Number of codes.
        len: usize,
        /// Rows of the pattern.
        period: usize,
    },
    /// A code that a binary cell does not have.
    #[error("`patterns.codes`[{index}] = {code} is no binary level; valid: 0 (level −1) and 255 (level +1)")]
    Code {
        /// Position in the list, from 0.
        index: usize,
        /// The code.
        code: u8,
    },
    /// A key that the mode does not use.
    #[error("`{field}` does not go with `mode` = {:?}; valid modes: \"analog\" and \"binary\"", .mode.name())]
    Mode {
        /// Name of the key.
        field: &'static str,
        /// The mode.
        mode: WeightMode,
    },
    /// No source of the levels, or several.
    #[error("weights need exactly one of `seeding`, `seeds` and `patterns`; found: {found}")]
    Source {
        /// The keys that were given.
        found: String,
    },
    /// The number of taxels is not given, and there is no list from which it follows.
    #[error("`taxels` is missing; valid: [1, 2^32 − 1]")]
    NoTaxels,
}
