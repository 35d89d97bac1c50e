//! Replaces useless atoms by poorly represented images.

use super::training::{Training, set_unit};
use crate::kernels::dot;
use crate::matrix::Matrix;

/// |cosine| from which two atoms count as one. Rubinstein's KSVD-Box has the same limit.
const TWIN: f64 = 0.99;

/// Share of an image's square below which its error is rounding, and the image no better than the atom it would
/// replace.
const REPRESENTED: f64 = 1e-20;

/// Replaces atoms (rows) without users and, of two that are equal up to sign, the one with fewer users, by the images
/// with the largest `errors`, each image once. Stops when all images that are left are represented.
pub(super) fn replace_useless(training: &Training, errors: &Matrix, used: &[usize], atoms: &mut Matrix) {
    let useless = useless(atoms, used);
    if useless.is_empty() {
        return;
    }
    let squares: Vec<f64> = (0..errors.nrows()).map(|i| dot(errors.row(i), errors.row(i))).collect();
    let mut order: Vec<usize> = (0..errors.nrows()).collect();
    order.sort_by(|&a, &b| squares[b].total_cmp(&squares[a]).then(a.cmp(&b)));
    for (k, &image) in useless.into_iter().zip(&order) {
        let row = training.rows.row(image);
        if squares[image] <= REPRESENTED * dot(row, row) {
            break;
        }
        set_unit(atoms.row_mut(k), row);
    }
}

/// Indices of the atoms without users, and of twins, in order.
fn useless(atoms: &Matrix, used: &[usize]) -> Vec<usize> {
    let mut of_use: Vec<bool> = used.iter().map(|&n| n > 0).collect();
    for a in 0..atoms.nrows() {
        for b in a + 1..atoms.nrows() {
            if of_use[a] && of_use[b] && dot(atoms.row(a), atoms.row(b)).abs() > TWIN {
                of_use[if used[b] > used[a] { a } else { b }] = false;
            }
        }
    }
    (0..used.len()).filter(|&k| !of_use[k]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twins_and_the_unused_give_way_to_the_worst_images() {
        let images = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 4.0], [1.0, 1.0, 1.0]].map(Vec::from);
        let training = Training::new(&images).unwrap();
        let mut atoms =
            Matrix::from_rows(4, 3, vec![1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.6, 0.8, 0.0]).unwrap();
        // the first of the twins has fewer users, the last atom has none; images 2 and 1 have the largest errors
        let errors = Matrix::from_rows(4, 3, vec![0.0, 0.0, 0.0, 0.3, 0.0, 0.0, 0.4, 0.0, 0.0, 0.1, 0.0, 0.0]).unwrap();
        replace_useless(&training, &errors, &[1, 2, 3, 0], &mut atoms);
        assert_eq!(atoms.row(0), [0.0, 0.0, 1.0]);
        assert_eq!(atoms.row(1), [-1.0, 0.0, 0.0]);
        assert_eq!(atoms.row(2), [0.0, 1.0, 0.0]);
        assert_eq!(atoms.row(3), [0.0, 1.0, 0.0]);
    }

    #[test]
    fn nothing_replaces_an_atom_when_everything_is_represented() {
        let training = Training::new(&[vec![1.0, 0.0], vec![2.0, 0.0]]).unwrap();
        let mut atoms = Matrix::from_rows(2, 2, vec![1.0, 0.0, 1.0, 0.0]).unwrap();
        replace_useless(&training, &Matrix::zeros(2, 2), &[2, 0], &mut atoms);
        assert_eq!(atoms.row(1), [1.0, 0.0]);
    }
}
