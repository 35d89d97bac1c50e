//! Linear operators: dense matrices, rows of ±1 that are stored as bits, and combinations of them.

mod bits;

pub use bits::SignRows;

use crate::kernels::{self, dot, norm};
use crate::matrix::{Matrix, MatrixView};

/// A linear map from `ncols` to `nrows` numbers. Every implementation satisfies ⟨A x, y⟩ = ⟨x, Aᵀ y⟩ up to rounding.
///
/// ```
/// use spts_recon::operator::{LinearOperator, check_operator};
///
/// /// Differences of neighbouring numbers.
/// struct Differences(usize);
///
/// impl LinearOperator for Differences {
///     fn nrows(&self) -> usize {
///         self.0 - 1
///     }
///     fn ncols(&self) -> usize {
///         self.0
///     }
///     fn apply(&self, x: &[f64], y: &mut [f64]) {
///         y.iter_mut().zip(x.windows(2)).for_each(|(y, x)| *y = x[1] - x[0]);
///     }
///     fn apply_adjoint(&self, y: &[f64], x: &mut [f64]) {
///         x.fill(0.0);
///         for (k, y) in y.iter().enumerate() {
///             x[k] -= y;
///             x[k + 1] += y;
///         }
///     }
/// }
/// check_operator(&Differences(10));
/// ```
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

/// An operator from which columns can be selected.
///
/// ```
/// use spts_recon::operator::{LinearOperator as _, SelectColumns as _, SignRows};
///
/// // the rows (+, −, +) and (−, −, +)
/// let phi = SignRows::new(&[0b101, 0b100], 3);
/// let few = phi.select_columns(&[0, 2]);
/// let (mut all, mut selected) = ([0.0; 2], [0.0; 2]);
/// phi.apply(&[1.0, 0.0, 2.0], &mut all);
/// few.apply(&[1.0, 2.0], &mut selected);
/// assert_eq!(all, selected);
/// ```
pub trait SelectColumns: LinearOperator {
    /// Operator of the selected columns.
    type Selected: LinearOperator;

    /// The columns with these numbers, in this order.
    ///
    /// # Panics
    /// If a column does not exist.
    fn select_columns(&self, columns: &[usize]) -> Self::Selected;

    /// Variance of every entry of Aᵀ r if the signs of the operator's entries were random: Σᵢ aᵢₖ² rᵢ². This is the
    /// correlation expected by chance from a residual r unrelated to the operator.
    ///
    /// # Panics
    /// If `r` does not have one entry a row, or `variance` not one a column.
    fn chance_variance(&self, r: &[f64], variance: &mut [f64]);
}

impl<A: LinearOperator + ?Sized> LinearOperator for &A {
    fn nrows(&self) -> usize {
        (**self).nrows()
    }

    fn ncols(&self) -> usize {
        (**self).ncols()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        (**self).apply(x, y);
    }

    fn apply_adjoint(&self, y: &[f64], x: &mut [f64]) {
        (**self).apply_adjoint(y, x);
    }
}

/// Panics with the numbers when `x` and `y` are not as long as the operator's columns and rows.
fn check_shape(a: &impl LinearOperator, x: &[f64], y: &[f64]) {
    let (nrows, ncols) = (a.nrows(), a.ncols());
    assert!(
        x.len() == ncols && y.len() == nrows,
        "a {nrows} × {ncols} operator between {} and {} numbers",
        x.len(),
        y.len()
    );
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
            *out = dot(row, x);
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

impl SelectColumns for MatrixView<'_> {
    type Selected = Matrix;

    fn select_columns(&self, columns: &[usize]) -> Matrix {
        let mut selected = Matrix::zeros((*self).nrows(), columns.len());
        for (r, row) in self.values().chunks_exact((*self).ncols().max(1)).enumerate() {
            let out = selected.row_mut(r).iter_mut();
            out.zip(columns).for_each(|(out, k)| *out = row[*k]);
        }
        selected
    }

    fn chance_variance(&self, r: &[f64], variance: &mut [f64]) {
        check_shape(self, variance, r);
        variance.fill(0.0);
        for (row, r) in self.values().chunks_exact(variance.len().max(1)).zip(r) {
            variance.iter_mut().zip(row).for_each(|(v, a)| *v += (a * r).powi(2));
        }
    }
}

/// P∘A, where P subtracts the mean: P y = y − Σy/M. For measurements y = A x + c with an unknown constant c, such as
/// the offset of asymmetric drives, P y = P A x holds exactly. This costs one measurement.
///
/// ```
/// use spts_recon::Matrix;
/// use spts_recon::operator::{Centred, LinearOperator as _, centre_by_wire};
///
/// let a = Matrix::from_rows(3, 2, vec![1.0, 1.0, 1.0, -1.0, -1.0, 1.0])?;
/// let (x, mut y, mut expected) = ([2.0, 1.0], [0.0; 3], [0.0; 3]);
/// a.apply(&x, &mut y);
/// y.iter_mut().for_each(|y| *y += 0.7); // an unknown offset
/// centre_by_wire(&mut y, &[]);
/// Centred::by_wire(a, &[]).apply(&x, &mut expected);
/// assert!(y.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-12));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Measurements of several wires are centred wire by wire ([`Centred::by_wire`]): each has an offset of its own.
#[derive(Debug, Clone)]
pub struct Centred<A> {
    inner: A,
    /// Wire of every measurement; empty for one wire.
    wires: Vec<u16>,
}

impl<A> Centred<A> {
    /// The operator that applies `inner`, and subtracts from every measurement the mean of its wire; `wires` has the
    /// wire of every measurement, or nothing for one wire.
    pub fn by_wire(inner: A, wires: &[u16]) -> Self {
        Self { inner, wires: wires.to_vec() }
    }
}

/// Subtracts the mean of `y`.
fn centre(y: &mut [f64]) {
    let mean = y.iter().sum::<f64>() / y.len().max(1) as f64;
    y.iter_mut().for_each(|v| *v -= mean);
}

/// Fewest measurements of a wire whose mean is taken off: of fewer too little would be left.
const FEWEST_OF_A_WIRE: f64 = 4.0;

/// Share of a wire's sum that is taken off each of its `number` measurements.
pub(crate) fn mean_share(number: f64) -> f64 {
    if number < FEWEST_OF_A_WIRE { 0.0 } else { 1.0 / number }
}

/// Subtracts from `y` the mean of every wire that has four measurements at least; `wires` has the wire of every
/// measurement, or nothing for one wire.
pub fn centre_by_wire(y: &mut [f64], wires: &[u16]) {
    if wires.is_empty() {
        return centre(y);
    }
    let count = wires.iter().max().map_or(0, |wire| usize::from(*wire) + 1);
    let mut sums = vec![(0.0, 0.0); count];
    for (v, wire) in y.iter().zip(wires) {
        let (sum, number) = &mut sums[usize::from(*wire)];
        *sum += v;
        *number += 1.0;
    }
    y.iter_mut().zip(wires).for_each(|(v, wire)| {
        let (sum, number) = sums[usize::from(*wire)];
        *v -= sum * mean_share(number);
    });
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
        centre_by_wire(y, &self.wires);
    }

    fn apply_adjoint(&self, y: &[f64], x: &mut [f64]) {
        check_shape(self, x, y);
        let mut y = y.to_vec();
        centre_by_wire(&mut y, &self.wires);
        self.inner.apply_adjoint(&y, x);
    }
}

impl<A: SelectColumns> SelectColumns for Centred<A> {
    type Selected = Centred<A::Selected>;

    fn select_columns(&self, columns: &[usize]) -> Self::Selected {
        Centred::by_wire(self.inner.select_columns(columns), &self.wires)
    }

    /// That of the centred `r`.
    fn chance_variance(&self, r: &[f64], variance: &mut [f64]) {
        let mut r = r.to_vec();
        centre_by_wire(&mut r, &self.wires);
        self.inner.chance_variance(&r, variance);
    }
}

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
        assert_eq!(outer.ncols(), inner.nrows(), "columns of the outer operator against rows of the inner one");
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

/// Numbers in (−1, 1) that are the same at every call.
fn values(n: usize, phase: f64) -> Vec<f64> {
    (0_u32..).map(|k| (1.7 * f64::from(k) + phase).sin()).take(n).collect()
}

/// Rounding that a product of `nrows` × `ncols` weights may leave of what it adds up, `whole`: one unit for every
/// addition on the longest way, which no order of summing exceeds, and a transform's constant.
fn rounding(nrows: usize, ncols: usize, whole: f64) -> f64 {
    16.0 * (nrows + ncols) as f64 * f64::EPSILON * whole.max(f64::MIN_POSITIVE)
}

/// Checks that `a` is linear, that ⟨A x, y⟩ = ⟨x, Aᵀ y⟩, and that results do not depend on the earlier content of
/// output slices.
///
/// # Panics
/// If a property fails; the message holds the numbers.
pub fn check_operator(a: &impl LinearOperator) {
    let (m, n) = (a.nrows(), a.ncols());
    let (x, z, y) = (values(n, 0.0), values(n, 1.0), values(m, 2.0));
    let apply = |x: &[f64]| {
        let mut out = vec![f64::NAN; m];
        a.apply(x, &mut out);
        out
    };
    let mut aty = vec![f64::NAN; n];
    a.apply_adjoint(&y, &mut aty);
    let (ax, az) = (apply(&x), apply(&z));
    let (lhs, rhs) = (dot(&ax, &y), dot(&aty, &x));
    let whole = norm(&ax) * norm(&y) + norm(&aty) * norm(&x);
    let allowed = rounding(m, n, whole);
    assert!((lhs - rhs).abs() <= allowed, "⟨Ax, y⟩ = {lhs}, ⟨x, Aᵀy⟩ = {rhs}, allowed {allowed:e}");

    let sum: Vec<f64> = x.iter().zip(&z).map(|(x, z)| 2.0 * x - z).collect();
    let off: Vec<f64> = apply(&sum).iter().zip(ax.iter().zip(&az)).map(|(s, (x, z))| s - (2.0 * x - z)).collect();
    let allowed = rounding(m, n, norm(&ax) + norm(&az) + norm(&x) * norm(&aty) / norm(&y).max(f64::MIN_POSITIVE));
    assert!(norm(&off) <= allowed, "not linear by {:e}, allowed {allowed:e}", norm(&off));
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn adjoint(a in prop::collection::vec(-1.0..1.0, 12 * 7)) {
            check_operator(&MatrixView::new(12, 7, &a).unwrap());
            let a = Matrix::from_rows(12, 7, a).unwrap();
            check_operator(&a);
        }
    }

    #[test]
    fn a_constant_makes_no_difference() {
        let a = Matrix::from_rows(3, 2, vec![1.0, 2.0, -1.0, 0.5, 0.0, 3.0]).unwrap();
        let centred = Centred::by_wire(&a, &[]);
        check_operator(&centred);
        let (mut y, mut with) = ([0.0; 3], [0.0; 3]);
        centred.apply(&[2.0, -1.0], &mut y);
        a.apply(&[2.0, -1.0], &mut with);
        with.iter_mut().for_each(|v| *v += 7.0);
        centre(&mut with);
        // sums of three numbers below 11
        assert!(y.iter().zip(&with).all(|(a, b)| (a - b).abs() < 1e-14));
    }

    /// By hand: wire 0 has the mean 4, wire 1 a single measurement, which is left.
    #[test]
    fn wires_are_centred_apart() {
        let mut y = [1.0, 3.0, 5.0, 7.0, 9.0];
        centre_by_wire(&mut y, &[0, 0, 0, 0, 1]);
        assert!(y.iter().zip([-3.0, -1.0, 1.0, 3.0, 9.0]).all(|(a, b)| (a - b).abs() < 1e-15));
    }
}
