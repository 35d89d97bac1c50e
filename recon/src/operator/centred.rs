//! Measurements with an unknown common offset.

use super::{LinearOperator, SelectColumns, check_shape};

/// P∘A, where P subtracts the mean: P y = y − Σy/M. For measurements y = A x + c with an unknown constant c, such as
/// the offset of asymmetric drives, P y = P A x holds exactly. This costs one measurement.
///
/// ```
/// use spts_recon::Matrix;
/// use spts_recon::operator::{Centred, LinearOperator as _, centre};
///
/// let a = Matrix::from_rows(3, 2, vec![1.0, 1.0, 1.0, -1.0, -1.0, 1.0])?;
/// let (x, mut y, mut expected) = ([2.0, 1.0], [0.0; 3], [0.0; 3]);
/// a.apply(&x, &mut y);
/// y.iter_mut().for_each(|y| *y += 0.7); // an unknown offset
/// centre(&mut y);
/// Centred::new(a).apply(&x, &mut expected);
/// assert!(y.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-12));
/// # Ok::<(), spts_recon::ShapeError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Centred<A> {
    inner: A,
}

impl<A> Centred<A> {
    /// The operator that applies `inner`, and subtracts from every measurement the mean of all measurements.
    #[must_use]
    pub fn new(inner: A) -> Self {
        Self { inner }
    }

    /// The operator without the subtraction.
    #[must_use]
    pub fn inner(&self) -> &A {
        &self.inner
    }
}

/// Subtracts the mean of `y`, to match a [`Centred`] operator.
pub fn centre(y: &mut [f64]) {
    let mean = y.iter().sum::<f64>() / y.len().max(1) as f64;
    y.iter_mut().for_each(|v| *v -= mean);
}

impl<A: LinearOperator> LinearOperator for Centred<A> {
    fn nrows(&self) -> usize {
        self.inner.nrows()
    }

    fn ncols(&self) -> usize {
        self.inner.ncols()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        self.inner.apply(x, y);
        centre(y);
    }

    fn apply_adjoint(&self, y: &[f64], x: &mut [f64]) {
        check_shape(self, x, y);
        let mut y = y.to_vec();
        centre(&mut y);
        self.inner.apply_adjoint(&y, x);
    }
}

impl<A: SelectColumns> SelectColumns for Centred<A> {
    type Selected = Centred<A::Selected>;

    fn select_columns(&self, columns: &[usize]) -> Self::Selected {
        Centred::new(self.inner.select_columns(columns))
    }

    /// That of the centred `r`.
    fn chance_variance(&self, r: &[f64], variance: &mut [f64]) {
        let mut r = r.to_vec();
        centre(&mut r);
        self.inner.chance_variance(&r, variance);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix::Matrix;
    use crate::operator::check_operator;

    #[test]
    fn a_constant_makes_no_difference() {
        let a = Matrix::from_rows(3, 2, vec![1.0, 2.0, -1.0, 0.5, 0.0, 3.0]).unwrap();
        let centred = Centred::new(&a);
        check_operator(&centred);
        let (mut y, mut with) = ([0.0; 3], [0.0; 3]);
        centred.apply(&[2.0, -1.0], &mut y);
        a.apply(&[2.0, -1.0], &mut with);
        with.iter_mut().for_each(|v| *v += 7.0);
        centre(&mut with);
        // sums of three numbers below 11
        assert!(y.iter().zip(&with).all(|(a, b)| (a - b).abs() < 1e-14));
    }
}
