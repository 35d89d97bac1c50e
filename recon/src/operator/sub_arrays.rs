//! A skin divided into parts, each on its own wire.

use super::{LinearOperator, SelectColumns, check_shape};
use rayon::prelude::*;

/// Block-diagonal operator. Each sub-array has its own rows (a wire) and the next range of columns.
///
/// ```
/// use spts_recon::operator::{LinearOperator as _, SignGenerator, SignOperator, SubArrays};
///
/// // 200 taxels on two wires, 20 measurements of each
/// let wire = |seeds| SignOperator::new(SignGenerator::NUMERICAL_RECIPES, seeds, 0, 20);
/// let skin = SubArrays::new(vec![wire((8..108).collect()), wire((108..208).collect())]);
/// assert_eq!((skin.nrows(), skin.ncols()), (40, 200));
/// let (mut image, mut y) = ([0.0; 200], [0.0; 40]);
/// image[150] = 1.0; // on the second wire
/// skin.apply(&image, &mut y);
/// assert!(y[..20].iter().all(|v| *v == 0.0) && y[20..].iter().all(|v| v.abs() == 1.0));
/// ```
#[derive(Debug, Clone)]
pub struct SubArrays<A> {
    parts: Vec<A>,
}

impl<A: LinearOperator + Sync> SubArrays<A> {
    /// The given sub-arrays, in order of their columns.
    #[must_use]
    pub fn new(parts: Vec<A>) -> Self {
        Self { parts }
    }

    /// The sub-arrays.
    #[must_use]
    pub fn parts(&self) -> &[A] {
        &self.parts
    }

    /// Every part with its own pieces of `input` and `output`.
    fn each(&self, input: &[f64], output: &mut [f64], of: fn(&A) -> (usize, usize), run: fn(&A, &[f64], &mut [f64])) {
        let mut pieces = Vec::with_capacity(self.parts.len());
        let (mut input, mut output) = (input, output);
        for part in &self.parts {
            let (from, to) = of(part);
            let (piece_in, rest_in) = input.split_at(from);
            let (piece_out, rest_out) = output.split_at_mut(to);
            pieces.push((part, piece_in, piece_out));
            (input, output) = (rest_in, rest_out);
        }
        pieces.into_par_iter().for_each(|(part, from, to)| run(part, from, to));
    }
}

impl<A: LinearOperator + Sync> LinearOperator for SubArrays<A> {
    fn nrows(&self) -> usize {
        self.parts.iter().map(LinearOperator::nrows).sum()
    }

    fn ncols(&self) -> usize {
        self.parts.iter().map(LinearOperator::ncols).sum()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        check_shape(self, x, y);
        self.each(x, y, |part| (part.ncols(), part.nrows()), A::apply);
    }

    fn apply_adjoint(&self, y: &[f64], x: &mut [f64]) {
        check_shape(self, x, y);
        self.each(y, x, |part| (part.nrows(), part.ncols()), A::apply_adjoint);
    }
}

/// The columns have to be in increasing order, so that those of a part stay together.
impl<A: SelectColumns + Sync> SelectColumns for SubArrays<A>
where
    A::Selected: Sync,
{
    type Selected = SubArrays<A::Selected>;

    fn select_columns(&self, columns: &[usize]) -> Self::Selected {
        assert!(
            columns.is_sorted(),
            "columns of sub-arrays are taken in increasing order"
        );
        let (mut first, mut parts) = (0, Vec::with_capacity(self.parts.len()));
        let mut left = columns;
        for part in &self.parts {
            let end = first + part.ncols();
            let (own, rest) = left.split_at(left.partition_point(|&k| k < end));
            let own: Vec<usize> = own.iter().map(|k| k - first).collect();
            parts.push(part.select_columns(&own));
            (first, left) = (end, rest);
        }
        assert!(left.is_empty(), "column {} of {first}", left[0]);
        SubArrays { parts }
    }

    fn chance_variance(&self, r: &[f64], variance: &mut [f64]) {
        check_shape(self, variance, r);
        self.each(r, variance, |part| (part.nrows(), part.ncols()), A::chance_variance);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix::Matrix;
    use crate::operator::check_operator;

    fn parts() -> SubArrays<Matrix> {
        let first = Matrix::from_rows(1, 2, vec![1.0, 2.0]).unwrap();
        let second = Matrix::from_rows(2, 1, vec![3.0, -1.0]).unwrap();
        SubArrays::new(vec![first, second])
    }

    #[test]
    fn it_is_block_diagonal() {
        let a = parts();
        check_operator(&a);
        assert_eq!((a.nrows(), a.ncols()), (3, 3));
        let mut y = [0.0; 3];
        a.apply(&[1.0, 1.0, 2.0], &mut y);
        assert_eq!(y.map(f64::to_bits), [3.0_f64, 6.0, -2.0].map(f64::to_bits));
    }

    #[test]
    fn columns_keep_their_wires() {
        let some = parts().select_columns(&[1, 2]);
        let mut y = [0.0; 3];
        some.apply(&[1.0, 1.0], &mut y);
        assert_eq!(y.map(f64::to_bits), [2.0_f64, 3.0, -1.0].map(f64::to_bits));
        assert_eq!(parts().select_columns(&[]).nrows(), 3);
    }
}
