//! The interface of dictionary learning.

use crate::checks::RangeError;
use crate::matrix::Matrix;
use crate::problem::RecoverError;
use rand_chacha::ChaCha8Rng;

/// Learns a dictionary from images.
pub trait Learner: Send + Sync {
    /// Dictionary with a column of length 1 for every atom (N × number of atoms), learned from `images` of N values each.
    ///
    /// With fewer images than atoms, every image starts an atom and the dictionary has as many columns as there are images.
    /// The result is a function of the settings, the images and `rng`, whatever the number of threads; multiplying all images by a
    /// power of two does not change it.
    ///
    /// # Errors
    /// [`DictionaryError`] when there is no image, images cannot be learned from, or a setting is out of range.
    fn learn(&self, images: &[Vec<f64>], rng: &mut ChaCha8Rng) -> Result<Matrix, DictionaryError>;
}

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
