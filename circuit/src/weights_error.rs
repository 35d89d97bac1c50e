//! What makes weights unusable.

use crate::mode::WeightMode;

/// Weights that contradict themselves.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum WeightsError {
    /// A list of nothing, or of too much.
    #[error("`{field}` has {len} entries; valid: [1, {most}]")]
    Length {
        /// Name of the list.
        field: &'static str,
        /// Its entries.
        len: usize,
        /// Most entries.
        most: usize,
    },
    /// A list for another skin.
    #[error("`{field}` is for {found} taxels; expected {taxels}")]
    Taxels {
        /// Name of the list.
        field: &'static str,
        /// Taxels that the list is for.
        found: usize,
        /// Taxels of the skin.
        taxels: usize,
    },
    /// Codes that do not fill their rows.
    #[error(
        "`patterns.codes` has {len} entries; expected one or more for each of the `patterns.period` = {period} rows"
    )]
    Rows {
        /// Number of codes.
        len: usize,
        /// Rows of the pattern.
        period: usize,
    },
    /// A code that a binary cell does not have.
    #[error("`patterns.codes`[{index}] = {code} is no binary level; valid: 0 (level −1) and 255 (level +1)")]
    Code {
        /// 0-based place in the list.
        index: usize,
        /// Offending code.
        code: u8,
    },
    /// A key that the mode has no use for.
    #[error("`{field}` does not go with `mode` = {:?}; valid modes: \"analog\" and \"binary\"", .mode.name())]
    Mode {
        /// Name of the key.
        field: &'static str,
        /// Mode that has no use for it.
        mode: WeightMode,
    },
    /// No source of the levels, or several.
    #[error("weights need exactly one of `seeding`, `seeds` and `patterns`; found: {found}")]
    Source {
        /// The keys that were given.
        found: String,
    },
    /// The number of taxels is not given and does not follow from a list.
    #[error("`taxels` is missing; valid: [1, 2^32 − 1]")]
    NoTaxels,
}
