//! Dense matrices as operators.

use super::{LinearOperator, SelectColumns};
use crate::kernels;
use crate::matrix::{Matrix, MatrixView};

impl LinearOperator for MatrixView<'_> {
    fn nrows(&self) -> usize {
        (*self).nrows()
    }

    fn ncols(&self) -> usize {
        (*self).ncols()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        for (out, row) in y.iter_mut().zip(self.values().chunks_exact(x.len().max(1))) {
            *out = row.iter().zip(x).map(|(a, b)| a * b).sum();
        }
    }

    fn apply_adjoint(&self, y: &[f64], x: &mut [f64]) {
        kernels::adjoint(self.values(), y, x);
    }
}

impl LinearOperator for Matrix {
    fn nrows(&self) -> usize {
        self.nrows()
    }

    fn ncols(&self) -> usize {
        self.ncols()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        self.view().apply(x, y);
    }

    fn apply_adjoint(&self, y: &[f64], x: &mut [f64]) {
        self.view().apply_adjoint(y, x);
    }
}

impl SelectColumns for Matrix {
    type Selected = Self;

    fn select_columns(&self, columns: &[usize]) -> Self {
        let columns: Vec<Vec<f64>> = columns.iter().map(|&k| self.column(k)).collect();
        let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        Self::from_column_slices(self.nrows(), &slices)
    }

    fn chance_variance(&self, r: &[f64], variance: &mut [f64]) {
        super::check_shape(self, variance, r);
        for (k, variance) in variance.iter_mut().enumerate() {
            *variance = self.column(k).iter().zip(r).map(|(a, r)| (a * r).powi(2)).sum();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator::check_operator;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn adjoint(a in prop::collection::vec(-1.0..1.0, 12 * 7)) {
            check_operator(&MatrixView::new(12, 7, &a).unwrap());
            let a = Matrix::from_rows(12, 7, a).unwrap();
            check_operator(&a);
            let some = a.select_columns(&[6, 0]);
            let (r, mut variance): (Vec<f64>, _) = ((0..12).map(f64::from).collect(), [f64::NAN; 7]);
            a.chance_variance(&r, &mut variance);
            let squares: f64 = a.column(3).iter().zip(&r).map(|(a, r)| a * a * r * r).sum();
            // a dozen roundings of numbers below 121
            prop_assert!((variance[3] - squares).abs() < 1e-11);
            prop_assert_eq!((some.nrows(), some.column(0), some.column(1)), (12, a.column(6), a.column(0)));
        }
    }
}
