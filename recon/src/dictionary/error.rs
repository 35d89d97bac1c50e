//! Errors of dictionary learning.

use crate::checks::RangeError;
use crate::problem::RecoverError;

/// Why no dictionary was learned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DictionaryError {
    /// There is no training image.
    #[error("no training image is left after preprocessing")]
    NoImages,
    /// Training images of different sizes.
    #[error("training image {index} has {len} values, the first has {expected}")]
    Shape {
        /// Number of the image, from 0.
        index: usize,
        /// Its length.
        len: usize,
        /// Length of the first image.
        expected: usize,
    },
    /// A training image that is zero, not finite, or far too small.
    #[error("training image {index} is zero, not finite, or less than 1e-150 of the strongest one")]
    Degenerate {
        /// Number of the image, from 0.
        index: usize,
    },
    /// A setting out of range.
    #[error(transparent)]
    Setting(#[from] RangeError),
    /// The pursuit failed on the training images.
    #[error("coding the training images: {0}")]
    Coding(#[from] RecoverError),
}
