//! What keeps a dictionary from being learned.

use crate::checks::RangeError;
use crate::problem::RecoverError;

/// Why no dictionary was learned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DictionaryError {
    /// There is nothing to learn from.
    #[error("no training image is left after preprocessing")]
    NoImages,
    /// Images of different sizes.
    #[error("training image {index} has {len} values, the first has {expected}")]
    Shape {
        /// Which image.
        index: usize,
        /// Its length.
        len: usize,
        /// Length of the first image.
        expected: usize,
    },
    /// A training image has no direction.
    #[error("training image {index} is zero, not finite, or less than 1e-150 of the strongest one")]
    Degenerate {
        /// Which image.
        index: usize,
    },
    /// A setting out of range.
    #[error(transparent)]
    Setting(#[from] RangeError),
    /// The images could not be coded.
    #[error("coding the training images: {0}")]
    Coding(#[from] RecoverError),
}
