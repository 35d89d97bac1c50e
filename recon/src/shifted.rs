//! Dictionaries with every image at all places.

use crate::matrix::Matrix;

/// Every atom of `dictionary` (images with `cols` columns, row-major) shifted by −`reach`…`reach` rows and columns,
/// with zeros moving in. Atoms that become empty are dropped. The others keep their values, so an atom cut by the edge
/// has a smaller length.
///
/// ```
/// use spts_recon::Matrix;
/// use spts_recon::dictionary::shifted;
///
/// let image = [0.0, 0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.0]; // 3 × 3 pixels
/// let everywhere = shifted(&Matrix::from_columns(9, 1, &image)?, 3, 1);
/// assert_eq!(everywhere.ncols(), 9);
/// assert!(everywhere.column_sums().iter().all(|sum| *sum == 5.0));
/// # Ok::<(), spts_recon::ShapeError>(())
/// ```
#[must_use]
pub fn shifted(dictionary: &Matrix, cols: usize, reach: usize) -> Matrix {
    let rows = dictionary.nrows() / cols.max(1);
    let mut atoms: Vec<Vec<f64>> = Vec::new();
    for k in 0..dictionary.ncols() {
        let atom = dictionary.column(k);
        for dr in 0..=2 * reach {
            for dc in 0..=2 * reach {
                let mut moved = vec![0.0; atom.len()];
                for (r, c) in (0..rows).flat_map(|r| (0..cols).map(move |c| (r, c))) {
                    // target = source + shift − reach, skipped when it leaves the image
                    let (tr, tc) = ((r + dr).wrapping_sub(reach), (c + dc).wrapping_sub(reach));
                    if tr < rows && tc < cols {
                        moved[tr * cols + tc] = atom[r * cols + c];
                    }
                }
                if moved.iter().any(|v| *v != 0.0) {
                    atoms.push(moved);
                }
            }
        }
    }
    let slices: Vec<&[f64]> = atoms.iter().map(Vec::as_slice).collect();
    Matrix::from_column_slices(dictionary.nrows(), &slices)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_pixel_moves_to_every_place_in_reach() {
        let corner = Matrix::from_rows(9, 1, vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
        let all = shifted(&corner, 3, 1);
        let mut places: Vec<usize> = (0..all.ncols())
            .map(|k| all.column(k).iter().position(|v| *v > 0.0).unwrap())
            .collect();
        places.sort_unstable();
        assert_eq!(places, [0, 1, 3, 4]);
    }
}
