//! Composition of two operators.

use super::{LinearOperator, check_shape};

/// Φ∘D: first `inner`, then `outer`; the product of the two is not formed. Every call takes memory for what lies
/// between them.
#[derive(Debug, Clone)]
pub(crate) struct Composition<A, B> {
    outer: A,
    inner: B,
}

impl<A: LinearOperator, B: LinearOperator> Composition<A, B> {
    /// `outer` after `inner`.
    ///
    /// # Panics
    /// When `outer` has not as many columns as `inner` has rows.
    pub(crate) fn new(outer: A, inner: B) -> Self {
        assert_eq!(
            outer.ncols(),
            inner.nrows(),
            "columns of the outer operator against rows of the inner one"
        );
        Self { outer, inner }
    }
}

impl<A: LinearOperator, B: LinearOperator> LinearOperator for Composition<A, B> {
    fn nrows(&self) -> usize {
        self.outer.nrows()
    }

    fn ncols(&self) -> usize {
        self.inner.ncols()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        check_shape(self, x, y);
        let mut between = vec![0.0; self.inner.nrows()];
        self.inner.apply(x, &mut between);
        self.outer.apply(&between, y);
    }

    fn apply_adjoint(&self, y: &[f64], x: &mut [f64]) {
        check_shape(self, x, y);
        let mut between = vec![0.0; self.inner.nrows()];
        self.outer.apply_adjoint(y, &mut between);
        self.inner.apply_adjoint(&between, x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix::Matrix;
    use crate::operator::check_operator;

    #[test]
    fn it_is_the_product_of_the_matrices() {
        let a = Matrix::from_rows(2, 3, vec![1.0, 2.0, -1.0, 0.5, 0.0, 3.0]).unwrap();
        let b = Matrix::from_rows(3, 2, vec![1.0, -2.0, 0.0, 4.0, 2.0, 1.0]).unwrap();
        let both = Composition::new(&a, &b);
        check_operator(&both);
        let mut y = [0.0; 2];
        both.apply(&[1.0, 1.0], &mut y);
        // b·(1, 1) = (−1, 4, 3): exact in binary
        assert_eq!(y.map(f64::to_bits), [4.0_f64, 8.5].map(f64::to_bits));
    }

    #[test]
    #[should_panic(expected = "columns of the outer operator")]
    fn shapes_that_do_not_fit_are_refused() {
        let _ = Composition::new(Matrix::zeros(2, 3), Matrix::zeros(2, 3));
    }
}
