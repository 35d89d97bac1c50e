//! Linear operators.

use crate::kernels;
use crate::matrix::MatrixView;

/// Linear map from `ncols` to `nrows` numbers. Every implementation satisfies ⟨A x, y⟩ = ⟨x, Aᵀ y⟩ to rounding.
pub trait LinearOperator {
    /// Number of rows.
    fn nrows(&self) -> usize;
    /// Number of columns.
    fn ncols(&self) -> usize;
    /// `y = A x`; overwrites `y` (length [`Self::nrows`]).
    fn apply(&self, x: &[f64], y: &mut [f64]);
    /// `x = Aᵀ y`; overwrites `x` (length [`Self::ncols`]).
    fn apply_adjoint(&self, y: &[f64], x: &mut [f64]);
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn adjoint(a in prop::collection::vec(-1.0..1.0, 12 * 7), x in prop::collection::vec(-1.0..1.0, 7),
                   y in prop::collection::vec(-1.0..1.0, 12)) {
            let a = MatrixView::new(12, 7, &a).unwrap();
            let (mut ax, mut aty) = ([0.0; 12], [0.0; 7]);
            a.apply(&x, &mut ax);
            a.apply_adjoint(&y, &mut aty);
            let lhs: f64 = ax.iter().zip(&y).map(|(p, q)| p * q).sum();
            let rhs: f64 = aty.iter().zip(&x).map(|(p, q)| p * q).sum();
            // 84 products of numbers below 1, each rounded a handful of times
            prop_assert!((lhs - rhs).abs() <= 84.0 * 4.0 * f64::EPSILON);
        }
    }
}
