//! Training images, checked and contiguous in memory.

use super::error::DictionaryError;
use crate::checks::{RangeError, within};
use crate::kernels::dot;
use crate::matrix::Matrix;
use crate::recover::power_of_two;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;

/// Images as rows, all multiplied by the power of two that brings the largest value into [1, 2): their squares neither
/// overflow nor vanish, and no digit is lost.
#[derive(Debug)]
pub(super) struct Training {
    pub(super) rows: Matrix,
}

/// Least square of an image that can be learned from; that of the strongest one is at least 1.
const SMALLEST_SQUARE: f64 = 1e-300;

impl Training {
    /// # Errors
    /// [`DictionaryError::NoImages`], [`DictionaryError::Shape`], [`DictionaryError::Degenerate`].
    pub(super) fn new(images: &[Vec<f64>]) -> Result<Self, DictionaryError> {
        let expected = images.first().ok_or(DictionaryError::NoImages)?.len();
        let mut values = Vec::with_capacity(images.len() * expected);
        for (index, image) in images.iter().enumerate() {
            let len = image.len();
            if len != expected {
                return Err(DictionaryError::Shape { index, len, expected });
            }
            values.extend_from_slice(image);
        }
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            return Err(DictionaryError::Degenerate { index: at / expected });
        }
        let scale = power_of_two(&values);
        let mut rows = Matrix::zeros(images.len(), expected);
        for (index, image) in images.iter().enumerate() {
            let row = rows.row_mut(index);
            for (scaled, &value) in row.iter_mut().zip(image) {
                *scaled = value / scale;
            }
            if dot(row, row) < SMALLEST_SQUARE {
                return Err(DictionaryError::Degenerate { index });
            }
        }
        Ok(Self { rows })
    }

    /// Number of images.
    pub(super) fn len(&self) -> usize {
        self.rows.nrows()
    }

    /// `count` of the images in random order, or all of them when there are fewer, as rows of length 1.
    pub(super) fn draw(&self, count: usize, rng: &mut ChaCha8Rng) -> Matrix {
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.shuffle(rng);
        order.truncate(count);
        let mut atoms = Matrix::zeros(order.len(), self.rows.ncols());
        for (k, &image) in order.iter().enumerate() {
            set_unit(atoms.row_mut(k), self.rows.row(image));
        }
        atoms
    }
}

/// Scales `direction` to length 1 and writes it to `out`; false, and `out` stays, when it has no direction.
pub(super) fn set_unit(out: &mut [f64], direction: &[f64]) -> bool {
    let square = dot(direction, direction);
    if !square.is_normal() {
        return false;
    }
    let inverse = 1.0 / square.sqrt();
    for (o, v) in out.iter_mut().zip(direction) {
        *o = v * inverse;
    }
    true
}

/// A count of settings, at least `least`.
///
/// # Errors
/// [`RangeError`].
pub(super) fn at_least(field: &'static str, value: usize, least: usize) -> Result<(), RangeError> {
    within(field, value as f64, least as f64, f64::MAX).map(|_| ())
}

/// Columns of `rows`: the dictionary whose atoms are the rows.
pub(super) fn transposed(rows: &Matrix) -> Matrix {
    let atoms: Vec<&[f64]> = (0..rows.nrows()).map(|k| rows.row(k)).collect();
    Matrix::from_column_slices(rows.ncols(), &atoms)
}
