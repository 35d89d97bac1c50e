//! Dense row-major matrices. A window of consecutive measurements is a slice of rows.

use nalgebra::DMatrix;
use spts_input::Refusal;

/// Dense matrix, row-major.
///
/// ```
/// use spts_recon::Matrix;
///
/// let a = Matrix::from_rows(2, 3, vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0])?;
/// assert_eq!((a.row(1), a.column(2)), (&[4.0, 5.0, 6.0][..], vec![3.0, 6.0]));
/// assert_eq!(Matrix::from_columns(2, 3, &[1.0, 4.0, 2.0, 5.0, 3.0, 6.0])?, a);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    nrows: usize,
    ncols: usize,
    values: Vec<f64>,
}

/// Borrowed rows of a dense row-major matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MatrixView<'a> {
    nrows: usize,
    ncols: usize,
    values: &'a [f64],
}

impl Matrix {
    /// Matrix of zeros.
    pub fn zeros(nrows: usize, ncols: usize) -> Self {
        Self { nrows, ncols, values: vec![0.0; nrows * ncols] }
    }

    /// A matrix with row-major `values`.
    ///
    /// # Errors
    /// [`Refusal`] if `values` does not hold `nrows · ncols` numbers.
    pub fn from_rows(nrows: usize, ncols: usize, values: Vec<f64>) -> Result<Self, Refusal> {
        let len = values.len();
        if nrows.checked_mul(ncols) == Some(len) {
            Ok(Self { nrows, ncols, values })
        } else {
            Err(matrix_shape(nrows, ncols, len))
        }
    }

    /// A matrix with column-major `values`, the layout of MATLAB files.
    ///
    /// # Errors
    /// [`Refusal`] if `values` does not hold `nrows · ncols` numbers.
    pub fn from_columns(nrows: usize, ncols: usize, values: &[f64]) -> Result<Self, Refusal> {
        if nrows.checked_mul(ncols) != Some(values.len()) {
            return Err(matrix_shape(nrows, ncols, values.len()));
        }
        let mut out = Self::zeros(nrows, ncols);
        for (c, column) in values.chunks_exact(nrows.max(1)).enumerate() {
            for (r, &v) in column.iter().enumerate() {
                out.values[r * ncols + c] = v;
            }
        }
        Ok(out)
    }

    /// A matrix with the given columns, all of length `nrows`.
    ///
    /// # Panics
    /// If a column has another length than `nrows`.
    pub fn from_column_slices(nrows: usize, columns: &[impl AsRef<[f64]>]) -> Self {
        let ncols = columns.len();
        let mut out = Self::zeros(nrows, ncols);
        for (c, column) in columns.iter().map(AsRef::as_ref).enumerate() {
            assert_eq!(column.len(), nrows, "column {c} must have one value for each of the {nrows} rows");
            out.set_column(c, column);
        }
        out
    }

    /// All rows.
    pub fn view(&self) -> MatrixView<'_> {
        MatrixView { nrows: self.nrows, ncols: self.ncols, values: &self.values }
    }

    /// Number of rows.
    pub fn nrows(&self) -> usize {
        self.nrows
    }

    /// Number of columns.
    pub fn ncols(&self) -> usize {
        self.ncols
    }

    /// Row `r`.
    pub fn row(&self, r: usize) -> &[f64] {
        &self.values[r * self.ncols..(r + 1) * self.ncols]
    }

    /// Row `r`, for writing.
    pub fn row_mut(&mut self, r: usize) -> &mut [f64] {
        &mut self.values[r * self.ncols..(r + 1) * self.ncols]
    }

    /// Copies column `c` into `out`.
    pub fn copy_column(&self, c: usize, out: &mut [f64]) {
        self.view().copy_column(c, out);
    }

    /// Column `c`.
    pub fn column(&self, c: usize) -> Vec<f64> {
        let mut out = vec![0.0; self.nrows];
        self.copy_column(c, &mut out);
        out
    }

    /// Overwrites column `c`.
    pub fn set_column(&mut self, c: usize, column: &[f64]) {
        for (r, &v) in column.iter().enumerate() {
            self.values[r * self.ncols + c] = v;
        }
    }

    /// Adds the product of the row vector `row` and this matrix to `out`.
    pub fn accumulate_row(&self, row: &[f64], out: &mut [f64]) {
        for (&w, values) in row.iter().zip(self.values.chunks_exact(self.ncols.max(1))) {
            if w != 0.0 {
                for (o, &v) in out.iter_mut().zip(values) {
                    *o += w * v;
                }
            }
        }
    }

    /// Sum over all rows: `1ᵀ · self`.
    pub fn column_sums(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.ncols];
        self.accumulate_row(&vec![1.0; self.nrows], &mut out);
        out
    }
}

impl From<&DMatrix<f64>> for Matrix {
    fn from(m: &DMatrix<f64>) -> Self {
        Self { nrows: m.nrows(), ncols: m.ncols(), values: m.transpose().as_slice().to_vec() }
    }
}

impl<'a> MatrixView<'a> {
    /// View of row-major `values`.
    ///
    /// # Errors
    /// [`Refusal`] if `values` does not hold `nrows · ncols` numbers.
    pub fn new(nrows: usize, ncols: usize, values: &'a [f64]) -> Result<Self, Refusal> {
        if nrows.checked_mul(ncols) == Some(values.len()) {
            Ok(Self { nrows, ncols, values })
        } else {
            Err(matrix_shape(nrows, ncols, values.len()))
        }
    }

    /// Number of rows.
    pub fn nrows(self) -> usize {
        self.nrows
    }

    /// Number of columns.
    pub fn ncols(self) -> usize {
        self.ncols
    }

    /// Values, row-major.
    pub fn values(self) -> &'a [f64] {
        self.values
    }

    /// `nrows` consecutive rows from `start`.
    ///
    /// # Panics
    /// If the rows do not exist.
    pub fn rows(self, start: usize, nrows: usize) -> Self {
        Self { nrows, ncols: self.ncols, values: &self.values[start * self.ncols..(start + nrows) * self.ncols] }
    }

    /// Copies column `c` into `out`.
    pub fn copy_column(self, c: usize, out: &mut [f64]) {
        for (o, row) in out.iter_mut().zip(self.values.chunks_exact(self.ncols.max(1))) {
            *o = row[c];
        }
    }

    /// Writes the columns one after the other: the transpose.
    pub(crate) fn copy_columns(self, out: &mut Vec<f64>) {
        out.resize(self.values.len(), 0.0);
        for (c, column) in out.chunks_exact_mut(self.nrows.max(1)).enumerate() {
            self.copy_column(c, column);
        }
    }
}

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
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
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
    Matrix::from_column_slices(dictionary.nrows(), &atoms)
}

/// Another number of values than the shape needs.
pub(crate) fn matrix_shape(nrows: usize, ncols: usize, len: usize) -> Refusal {
    Refusal::new(format!("a {nrows} × {ncols} matrix needs {} values, got {len}", nrows * ncols))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_pixel_moves_to_every_place_in_reach() {
        let corner = Matrix::from_rows(9, 1, vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
        let all = shifted(&corner, 3, 1);
        let mut places: Vec<usize> =
            (0..all.ncols()).map(|k| all.column(k).iter().position(|v| *v > 0.0).unwrap()).collect();
        places.sort_unstable();
        assert_eq!(places, [0, 1, 3, 4]);
    }
}
