//! The recovery problem, its scaling, the trait of its solvers, and the memory that they share.

use crate::checks::{empty, not_finite, overflow, shape_mismatch};
use crate::kernels;
use crate::matrix::MatrixView;
use spts_input::Refusal;
use std::any::{Any, TypeId};
use std::fmt;

/// The problem: find a sparse `α` with `A α ≈ y`.
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    matrix: MatrixView<'a>,
    y: &'a [f64],
}

impl<'a> Problem<'a> {
    /// A problem with the operator `matrix` (M × K) and the measurements `y` (length M).
    ///
    /// # Errors
    /// [`Refusal`] if the lengths differ, [`Refusal`] if there is no measurement or no
    /// atom, [`Refusal`] if `y` holds a NaN or an infinity.
    pub fn new(matrix: MatrixView<'a>, y: &'a [f64]) -> Result<Self, Refusal> {
        if matrix.nrows() != y.len() {
            return Err(shape_mismatch(matrix.nrows(), y.len()));
        }
        if y.is_empty() || matrix.ncols() == 0 {
            return Err(empty(matrix.nrows(), matrix.ncols()));
        }
        if let Some((index, &value)) = y.iter().enumerate().find(|(_, v)| !v.is_finite()) {
            return Err(not_finite(index, value));
        }
        Ok(Self { matrix, y })
    }

    /// Operator A, M × K.
    pub fn matrix(&self) -> MatrixView<'a> {
        self.matrix
    }

    /// Measurements, length M.
    pub fn y(&self) -> &'a [f64] {
        self.y
    }
}

/// A sparse solution.
///
/// ```
/// use spts_recon::{Matrix, Solution};
///
/// let solution = Solution { support: vec![2, 0], coefficients: vec![3.0, -1.0], residual_norm: 0.0 };
/// let mut x = [0.0; 4];
/// solution.scatter(&mut x);
/// assert_eq!(x, [-1.0, 0.0, 3.0, 0.0]);
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Solution {
    /// Indices of the selected atoms, in order of selection.
    pub support: Vec<usize>,
    /// Coefficient of each atom of `support`.
    pub coefficients: Vec<f64>,
    /// ‖y − A α‖₂.
    pub residual_norm: f64,
}

impl Solution {
    /// Makes this the entries of `x` that are not zero, in the order of their indices, times `scale`.
    ///
    /// # Errors
    /// [`Refusal`] when an entry is beyond the range of numbers.
    pub(crate) fn set_dense(&mut self, x: &[f64], scale: f64, residual_norm: f64) -> Result<(), Refusal> {
        self.support.clear();
        self.coefficients.clear();
        self.residual_norm = residual_norm.min(f64::MAX);
        for (atom, &value) in x.iter().enumerate().filter(|(_, v)| **v != 0.0) {
            let coefficient = value * scale;
            if !coefficient.is_finite() {
                return Err(overflow(atom));
            }
            self.support.push(atom);
            self.coefficients.push(coefficient);
        }
        Ok(())
    }

    /// Makes this the solution without atoms, which leaves all of `y`.
    pub(crate) fn set_zero(&mut self, residual_norm: f64) {
        self.support.clear();
        self.coefficients.clear();
        self.residual_norm = residual_norm;
    }

    /// Writes the coefficients to their positions in `x` (length K), and zeros everywhere else.
    pub fn scatter(&self, x: &mut [f64]) {
        x.fill(0.0);
        for (&k, &c) in self.support.iter().zip(&self.coefficients) {
            x[k] = c;
        }
    }

    /// Computes the image `D α` for a dictionary `D` (N × K, row-major) into `image` (length N).
    pub fn synthesise(&self, dictionary: MatrixView<'_>, image: &mut [f64]) {
        for (out, row) in image.iter_mut().zip(dictionary.values().chunks_exact(dictionary.ncols().max(1))) {
            *out = self.support.iter().zip(&self.coefficients).map(|(&k, &c)| c * row[k]).sum();
        }
    }
}

/// A sparse-recovery algorithm.
///
/// ```
/// use spts_input::Refusal;
/// use spts_recon::{Matrix, Problem, Recover, Solution, Workspace};
///
/// /// The atom (of length 1) that correlates most with the measurements.
/// struct Single;
///
/// impl Recover for Single {
///     fn recover_into(&self, p: &Problem<'_>, _: &mut Workspace, best: &mut Solution) -> Result<(), Refusal> {
///         *best = Solution::default();
///         let mut atom = vec![0.0; p.y().len()];
///         for k in 0..p.matrix().ncols() {
///             p.matrix().copy_column(k, &mut atom);
///             let c: f64 = atom.iter().zip(p.y()).map(|(a, y)| a * y).sum();
///             if best.coefficients.first().is_none_or(|b| c.abs() > b.abs()) {
///                 (best.support, best.coefficients) = (vec![k], vec![c]);
///             }
///         }
///         Ok(())
///     }
/// }
/// let a = Matrix::from_rows(2, 2, vec![1.0, 0.0, 0.0, 1.0]).unwrap();
/// let solution = Single.recover(&Problem::new(a.view(), &[0.2, 3.0])?, &mut Workspace::default())?;
/// assert_eq!(solution.support, [1]);
/// # Ok::<(), Refusal>(())
/// ```
pub trait Recover: Send + Sync {
    /// Solves `problem` into `solution`, whose memory is reused. After an error the content of `solution` has no
    /// meaning.
    ///
    /// # Errors
    /// [`Refusal`] if the problem cannot be solved. A valid [`Problem`] never causes a panic.
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), Refusal>;

    /// Solves `problem`.
    ///
    /// # Errors
    /// As [`Self::recover_into`].
    fn recover(&self, problem: &Problem<'_>, workspace: &mut Workspace) -> Result<Solution, Refusal> {
        let mut solution = Solution::default();
        self.recover_into(problem, workspace, &mut solution)?;
        Ok(solution)
    }
}

/// Squared lengths between which nothing is scaled: the fourth power of a length still is an ordinary number.
pub(super) const ORDINARY: std::ops::RangeInclusive<f64> = 1e-50..=1e50;

/// A column counts as zero when its square is below this share of the longest one's.
const ZERO: f64 = 1e-100;

/// Copies of what had to be scaled, and the columns' lengths.
#[derive(Debug, Default)]
pub(crate) struct Scaling {
    matrix: Vec<f64>,
    y: Vec<f64>,
    ones: Vec<f64>,
    squares: Vec<f64>,
}

/// A problem A α = y with A and y multiplied by powers of two, which loses no digit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scaled<'a> {
    /// Operator, M × K.
    pub(crate) a: MatrixView<'a>,
    /// Measurements, length M.
    pub(crate) y: &'a [f64],
    /// ‖y‖₂.
    pub(crate) y_norm: f64,
    /// ‖aₖ‖₂² of every column; 0 for those that count as zero.
    pub(crate) squares: &'a [f64],
    matrix_scale: f64,
    y_scale: f64,
}

impl Scaling {
    /// Scales `problem` if it has to be.
    ///
    /// # Errors
    /// [`Refusal`].
    pub(crate) fn apply<'a>(&'a mut self, problem: &Problem<'a>) -> Result<Scaled<'a>, Refusal> {
        let (a, y) = (problem.matrix(), problem.y());
        self.ones.resize(a.nrows(), 1.0);
        self.squares.resize(a.ncols(), 0.0);
        kernels::column_squares(a.values(), &self.ones, &mut self.squares);
        // a NaN stays in the sum, unlike in a maximum
        let (mut matrix_scale, mut values) = (1.0, a.values());
        if !ORDINARY.contains(&self.squares.iter().sum::<f64>()) {
            matrix_scale = operator_scale(a)?;
            divide_into(values, matrix_scale, &mut self.matrix);
            kernels::column_squares(&self.matrix, &self.ones, &mut self.squares);
            values = &self.matrix;
        }
        let longest = self.squares.iter().fold(0.0_f64, |m, &s| m.max(s));
        for square in &mut self.squares {
            if *square <= ZERO * longest {
                *square = 0.0;
            }
        }
        let (scaled_y, y_scale) = scale_measurements(y, &mut self.y)?;
        Ok(Scaled {
            // the shape is the one of `a`
            a: MatrixView::new(a.nrows(), a.ncols(), values).unwrap_or(a),
            y: scaled_y,
            y_norm: kernels::dot(scaled_y, scaled_y).sqrt(),
            squares: &self.squares,
            matrix_scale,
            y_scale,
        })
    }
}

fn scale_measurements<'a>(y: &'a [f64], copy: &'a mut Vec<f64>) -> Result<(&'a [f64], f64), Refusal> {
    if ORDINARY.contains(&kernels::dot(y, y)) {
        return Ok((y, 1.0));
    }
    let scale = power_of_two(y);
    if !scale.is_finite() {
        let index = first_not_finite(y);
        return Err(not_finite(index, y[index]));
    }
    divide_into(y, scale, copy);
    Ok((copy, scale))
}

impl Scaled<'_> {
    /// Writes the weights of the columns in a choice: 1/‖aₖ‖, 0 for columns that count as zero.
    pub(crate) fn weights_into(&self, out: &mut Vec<f64>) {
        out.resize(self.squares.len(), 0.0);
        kernels::inverse_roots(self.squares, out);
    }

    /// Takes the scaling back out of a solution.
    ///
    /// # Errors
    /// [`Refusal`] when a coefficient is beyond the range of numbers.
    #[expect(clippy::float_cmp, reason = "1 is what an unscaled problem has, to the bit")]
    pub(crate) fn unscale(&self, solution: &mut Solution) -> Result<(), Refusal> {
        let (y_scale, matrix_scale) = (self.y_scale, self.matrix_scale);
        if y_scale == 1.0 && matrix_scale == 1.0 {
            return Ok(());
        }
        solution.residual_norm = (solution.residual_norm * y_scale).min(f64::MAX);
        let ratio = y_scale / matrix_scale;
        for (coefficient, &atom) in solution.coefficients.iter_mut().zip(&solution.support) {
            // one product that is exact, or two where 2^±1074 lies between the scales
            *coefficient = if ratio.is_normal() { *coefficient * ratio } else { *coefficient * y_scale / matrix_scale };
            if !coefficient.is_finite() {
                return Err(overflow(atom));
            }
        }
        Ok(())
    }
}

/// Largest power of two that is at most the largest magnitude of `values`, or 1 when all of them are zero. Dividing by
/// it is exact. Infinite or NaN when a value is.
pub(crate) fn power_of_two(values: &[f64]) -> f64 {
    let max = values.iter().fold(0.0_f64, |m, v| if m.is_nan() || v.abs() <= m { m } else { v.abs() });
    if max == 0.0 {
        return 1.0;
    }
    if max.is_normal() {
        const EXPONENT: u64 = 0x7ff0_0000_0000_0000;
        f64::from_bits(max.to_bits() & EXPONENT)
    } else if max.is_finite() {
        f64::MIN_POSITIVE
    } else {
        max
    }
}

/// [`power_of_two`] of the operator's entries.
///
/// # Errors
/// [`Refusal`] for a NaN or an infinity.
pub(super) fn operator_scale(a: MatrixView<'_>) -> Result<f64, Refusal> {
    let scale = power_of_two(a.values());
    if scale.is_finite() {
        return Ok(scale);
    }
    let index = first_not_finite(a.values());
    Err(Refusal::new(format!(
        "operator[{row}, {col}] = {value} is not finite",
        row = index / a.ncols(),
        col = index % a.ncols(),
        value = a.values()[index]
    )))
}

/// Writes `values` over `scale`, a power of two.
pub(super) fn divide_into(values: &[f64], scale: f64, out: &mut Vec<f64>) {
    // of the largest power of two the inverse is subnormal but still exact
    let inverse = 1.0 / scale;
    out.clear();
    out.extend(values.iter().map(|v| v * inverse));
}

fn first_not_finite(values: &[f64]) -> usize {
    values.iter().position(|v| !v.is_finite()).unwrap_or_default()
}

/// Scratch memory reused between calls, so that a decode allocates only its result.
///
/// Every method defines its memory as a type. The workspace holds one value of each requested type and returns the same
/// value next time. A method must not depend on the earlier content of its value.
///
/// ```
/// use spts_recon::Workspace;
///
/// #[derive(Debug, Default)]
/// struct Residual(Vec<f64>);
///
/// let mut work = Workspace::default();
/// work.scratch::<Residual>().0.resize(20, 0.0);
/// // the memory is still there
/// assert_eq!(work.scratch::<Residual>().0.len(), 20);
/// ```
#[derive(Default)]
pub struct Workspace {
    /// One value for each type. There are only a few, so they are searched linearly.
    values: Vec<(TypeId, Box<dyn Any + Send + Sync>)>,
}

impl Workspace {
    /// The workspace's value of type `T`. The first call creates it as `T::default()`.
    ///
    /// # Panics
    /// Never: a value is stored under its own type.
    pub fn scratch<T: Any + Default + Send + Sync>(&mut self) -> &mut T {
        let id = TypeId::of::<T>();
        let found = self.values.iter().position(|(other, _)| *other == id);
        let index = found.unwrap_or_else(|| {
            self.values.push((id, Box::<T>::default()));
            self.values.len() - 1
        });
        match self.values[index].1.downcast_mut() {
            Some(value) => value,
            None => unreachable!("a value is kept under its own type"),
        }
    }
}

impl fmt::Debug for Workspace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Workspace({} kinds of scratch memory)", self.values.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scaling_brings_squares_into_range_and_back() {
        for scale in [1e-320, 1e-300, 1e-30, 1.0, 1e30, 1e308] {
            let a = [scale, 0.0, 0.0, 0.5 * scale];
            let y = [0.0, scale];
            let mut scaling = Scaling::default();
            let problem = Problem::new(MatrixView::new(2, 2, &a).unwrap(), &y).unwrap();
            let scaled = scaling.apply(&problem).unwrap();
            assert!(ORDINARY.contains(&scaled.squares[1]) && ORDINARY.contains(&scaled.y_norm), "{scale:e}");
            let mut solution = Solution {
                support: vec![1],
                coefficients: vec![scaled.y[1] / scaled.a.values()[3]],
                residual_norm: scaled.y_norm,
            };
            scaled.unscale(&mut solution).unwrap();
            // 1e-320 has 11 bits; the quotient is within one of its last places
            assert!((solution.coefficients[0] - 2.0).abs() <= 2e-3, "{scale:e}");
            assert!((solution.residual_norm / scale - 1.0).abs() <= 1e-3, "{scale:e}");
        }
    }

    #[test]
    fn powers_of_two_at_the_edges_of_the_range() {
        for (values, expected) in [
            (vec![0.0, -0.0], 1.0),
            (vec![-3.0, 1.0], 2.0),
            (vec![1.0], 1.0),
            (vec![5e-324], f64::MIN_POSITIVE),
            (vec![f64::MAX], 2.0_f64.powi(1023)),
        ] {
            assert!((power_of_two(&values) - expected).abs() <= 0.0, "{values:?}");
        }
        let a = [1.0, 2.0, f64::NAN, 4.0, f64::INFINITY, 6.0];
        let error = operator_scale(MatrixView::new(3, 2, &a).unwrap()).unwrap_err();
        assert!(error.to_string().contains("operator[1, 0]"), "{error}");
    }
}
