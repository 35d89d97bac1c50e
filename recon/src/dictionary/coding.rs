//! Sparse codes of all training images.

use super::learner::DictionaryError;
use super::training::{Training, subtract_code, transposed};
use crate::kernels::dot;
use crate::matrix::Matrix;
use crate::problem::{Solution, Workspace};
use crate::recover::{BatchOmp, Choice};
use rayon::prelude::*;

/// Codes `codes` of the images with the indices `chosen` by a pursuit of `n_nonzero_coefs` atoms, on all threads.
///
/// # Errors
/// [`DictionaryError::Coding`].
pub(super) fn code(
    training: &Training,
    chosen: &[usize],
    atoms: &Matrix,
    n_nonzero_coefs: usize,
    choice: Choice,
    codes: &mut Vec<Solution>,
) -> Result<(), DictionaryError> {
    let pursuit = BatchOmp::new(transposed(atoms).view(), n_nonzero_coefs)?.with_choice(choice);
    codes.resize_with(chosen.len(), Solution::default);
    codes
        .par_iter_mut()
        .zip(chosen)
        .try_for_each_init(Workspace::default, |workspace, (code, &image)| {
            pursuit.recover_into(training.rows.row(image), workspace, code)
        })?;
    Ok(())
}

/// What the codes leave of every image, X − A D as rows.
pub(super) fn errors(training: &Training, atoms: &Matrix, codes: &[Solution]) -> Matrix {
    let mut errors = training.rows.clone();
    for (image, code) in codes.iter().enumerate() {
        subtract_code(errors.row_mut(image), atoms, &code.support, &code.coefficients);
    }
    errors
}

/// Relative error ‖X − A D‖_F / ‖X‖_F of coding `images` with `n_nonzero_coefs` atoms of `dictionary` (N × number of atoms) by
/// orthogonal matching pursuit. In [0, 1].
///
/// # Errors
/// [`DictionaryError`] as learning from the same images would give.
pub fn representation_error(
    images: &[Vec<f64>],
    dictionary: &Matrix,
    n_nonzero_coefs: usize,
) -> Result<f64, DictionaryError> {
    let training = Training::new(images)?;
    let pursuit = BatchOmp::new(dictionary.view(), n_nonzero_coefs)?;
    let squares: Vec<(f64, f64)> = (0..training.len())
        .into_par_iter()
        .map_init(
            || (Workspace::default(), Solution::default()),
            |(workspace, solution), image| {
                let row = training.rows.row(image);
                pursuit.recover_into(row, workspace, solution)?;
                Ok((solution.residual_norm.powi(2), dot(row, row)))
            },
        )
        .collect::<Result<_, DictionaryError>>()?;
    let (left, whole) = squares.iter().fold((0.0, 0.0), |(l, w), (a, b)| (l + a, w + b));
    Ok((left / whole).sqrt())
}
