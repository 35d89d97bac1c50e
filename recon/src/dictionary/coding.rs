//! Sparse codes of all training images.

use super::error::DictionaryError;
use super::training::{Training, transposed};
use crate::kernels::axpy;
use crate::matrix::Matrix;
use crate::problem::Solution;
use crate::recover::BatchOmp;
use crate::workspace::Workspace;
use rayon::prelude::*;

/// Codes `codes` of all images by a pursuit of `n_nonzero_coefs` atoms, on all threads.
///
/// # Errors
/// [`DictionaryError::Coding`].
pub(super) fn code(
    training: &Training,
    atoms: &Matrix,
    n_nonzero_coefs: usize,
    codes: &mut Vec<Solution>,
) -> Result<(), DictionaryError> {
    let pursuit = BatchOmp::new(transposed(atoms).view(), n_nonzero_coefs)?;
    codes.resize_with(training.len(), Solution::default);
    codes
        .par_iter_mut()
        .enumerate()
        .try_for_each_init(Workspace::default, |workspace, (image, code)| {
            pursuit.recover_into(training.rows.row(image), workspace, code)
        })?;
    Ok(())
}

/// What the codes leave of every image, X − A D as rows.
pub(super) fn errors(training: &Training, atoms: &Matrix, codes: &[Solution]) -> Matrix {
    let mut errors = training.rows.clone();
    for (image, code) in codes.iter().enumerate() {
        for (&k, &c) in code.support.iter().zip(&code.coefficients) {
            axpy(-c, atoms.row(k), errors.row_mut(image));
        }
    }
    errors
}
