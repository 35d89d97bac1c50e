//! Linear operators: dense matrices, ±1 matrices that are not stored, shifted atoms by Fourier transforms, and
//! combinations of them.
//!
//! ```
//! use spts_recon::operator::{LinearOperator as _, SignGenerator, SignOperator};
//!
//! // 20 measurements of 100 taxels with ±1 weights from a generator, of which no matrix is stored
//! let generator = SignGenerator::new(1_664_525, 1_013_904_223, 31)?;
//! let phi = SignOperator::new(generator, (8..108).collect(), 0, 20);
//! let (mut image, mut y) = ([0.0; 100], [0.0; 20]);
//! image[42] = 1.5;
//! phi.apply(&image, &mut y);
//! // one pressed taxel: every measurement is its pressure or the negative of it
//! assert!(y.iter().all(|v| (v.abs() - 1.5).abs() < 1e-15));
//! # Ok::<(), spts_recon::RangeError>(())
//! ```

mod centred;
mod composition;
mod conformance;
mod dense;
mod fft2;
mod shifted;
mod sign;
mod sign_kernels;
mod sub_arrays;

pub use centred::{Centred, centre};
pub(crate) use composition::Composition;
pub use conformance::check_operator;
pub use shifted::{Atom, ShiftedDictionary};
pub use sign::{SignGenerator, SignOperator};
pub use sub_arrays::SubArrays;

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
/// use spts_recon::operator::{LinearOperator as _, SelectColumns as _, SignGenerator, SignOperator};
///
/// let phi = SignOperator::new(SignGenerator::NUMERICAL_RECIPES, (8..108).collect(), 0, 20);
/// let few = phi.select_columns(&[3, 42]);
/// let (mut all, mut selected) = ([0.0; 20], [0.0; 20]);
/// let mut image = [0.0; 100];
/// (image[3], image[42]) = (1.0, 2.0);
/// phi.apply(&image, &mut all);
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
