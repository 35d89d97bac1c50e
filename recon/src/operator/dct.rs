//! Discrete cosine basis of images.

use super::{LinearOperator, check_shape};
use rustdct::{DctPlanner, TransformType2And3};
use std::sync::Arc;

/// Orthonormal two-dimensional cosine basis of `rows` × `cols` images: `apply` makes an image of its coefficients (DCT-III),
/// `apply_adjoint` the coefficients of an image (DCT-II). Both are row-major; coefficient (0, 0) belongs to the mean.
///
/// Along a line of n: x(i) = Σₖ sₖ cₖ cos(π k (i + ½)/n), s₀ = √(1/n), sₖ = √(2/n).
/// Source: N. Ahmed, T. Natarajan, K. R. Rao, IEEE Trans. Computers C-23 (1974) 90.
pub struct Dct2 {
    rows: usize,
    cols: usize,
    along_rows: Arc<dyn TransformType2And3<f64>>,
    along_cols: Arc<dyn TransformType2And3<f64>>,
}

impl Dct2 {
    /// Basis of `rows` × `cols` images.
    #[must_use]
    pub fn new(rows: usize, cols: usize) -> Self {
        let mut planner = DctPlanner::new();
        Self {
            rows,
            cols,
            along_rows: planner.plan_dct2(cols.max(1)),
            along_cols: planner.plan_dct2(rows.max(1)),
        }
    }

    /// A transform of every row, then of every column.
    fn separable(&self, from: &[f64], to: &mut [f64], line: fn(&dyn TransformType2And3<f64>, &mut [f64])) {
        to.copy_from_slice(from);
        for row in to.chunks_exact_mut(self.cols.max(1)) {
            line(&*self.along_rows, row);
        }
        let mut column = vec![0.0; self.rows];
        for c in 0..self.cols {
            for (r, v) in column.iter_mut().enumerate() {
                *v = to[r * self.cols + c];
            }
            line(&*self.along_cols, &mut column);
            for (r, v) in column.iter().enumerate() {
                to[r * self.cols + c] = *v;
            }
        }
    }
}

/// √(2/n), and what the coefficient of the mean has besides: √½.
fn scales(n: usize) -> (f64, f64) {
    ((2.0 / n as f64).sqrt(), std::f64::consts::FRAC_1_SQRT_2)
}

fn analyse(plan: &dyn TransformType2And3<f64>, line: &mut [f64]) {
    let (all, first) = scales(line.len());
    plan.process_dct2(line);
    line.iter_mut().for_each(|v| *v *= all);
    line[0] *= first;
}

fn synthesise(plan: &dyn TransformType2And3<f64>, line: &mut [f64]) {
    let (all, first) = scales(line.len());
    // the library's DCT-III halves the first coefficient
    line[0] *= 2.0 * first;
    line.iter_mut().for_each(|v| *v *= all);
    plan.process_dct3(line);
}

impl LinearOperator for Dct2 {
    fn nrows(&self) -> usize {
        self.rows * self.cols
    }

    fn ncols(&self) -> usize {
        self.rows * self.cols
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        check_shape(self, x, y);
        self.separable(x, y, synthesise);
    }

    fn apply_adjoint(&self, y: &[f64], x: &mut [f64]) {
        check_shape(self, x, y);
        self.separable(y, x, analyse);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator::{check_operator, check_orthonormal};
    use approx::assert_relative_eq;

    #[test]
    fn it_is_orthonormal() {
        for (rows, cols) in [(1, 1), (1, 7), (10, 10), (8, 5), (48, 30)] {
            let basis = Dct2::new(rows, cols);
            check_operator(&basis);
            check_orthonormal(&basis);
        }
    }

    /// Against the cosines themselves.
    #[test]
    fn its_images_are_cosines() {
        let (rows, cols, (u, v)) = (6, 9, (2, 5));
        let mut coefficients = vec![0.0; rows * cols];
        coefficients[u * cols + v] = 1.0;
        let mut image = vec![0.0; rows * cols];
        Dct2::new(rows, cols).apply(&coefficients, &mut image);
        let line = |k: usize, i: usize, n: usize| {
            (2.0 / n as f64).sqrt() * (std::f64::consts::PI * k as f64 * (i as f64 + 0.5) / n as f64).cos()
        };
        for r in 0..rows {
            for c in 0..cols {
                // a few roundings of numbers below 1
                assert_relative_eq!(
                    image[r * cols + c],
                    line(u, r, rows) * line(v, c, cols),
                    epsilon = 1e-14
                );
            }
        }
    }
}
