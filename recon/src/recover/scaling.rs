//! Brings a problem of any magnitude into the range in which squares neither overflow nor vanish.

use crate::kernels;
use crate::matrix::MatrixView;
use crate::problem::{Problem, RecoverError, Solution};

/// Squared lengths between which nothing is scaled: the fourth power of a length still is an ordinary number.
const ORDINARY: std::ops::RangeInclusive<f64> = 1e-50..=1e50;

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
    matrix_exponent: i32,
    y_exponent: i32,
}

impl Scaling {
    /// Scales `problem` if it has to be.
    ///
    /// # Errors
    /// [`RecoverError::OperatorNotFinite`].
    pub(crate) fn apply<'a>(&'a mut self, problem: &Problem<'a>) -> Result<Scaled<'a>, RecoverError> {
        let (a, y) = (problem.matrix(), problem.y());
        self.ones.resize(a.nrows(), 1.0);
        self.squares.resize(a.ncols(), 0.0);
        kernels::column_squares(a.values(), &self.ones, &mut self.squares);
        // a NaN stays in the sum, unlike in a maximum
        let mut matrix_exponent = 0;
        let mut values = a.values();
        if !ORDINARY.contains(&self.squares.iter().sum::<f64>()) {
            matrix_exponent = exponent(values).map_err(|at| RecoverError::OperatorNotFinite {
                row: at / a.ncols(),
                col: at % a.ncols(),
                value: values[at],
            })?;
            scale_into(values, -matrix_exponent, &mut self.matrix);
            kernels::column_squares(&self.matrix, &self.ones, &mut self.squares);
            values = &self.matrix;
        }
        let longest = self.squares.iter().fold(0.0_f64, |m, &s| m.max(s));
        for square in &mut self.squares {
            if *square <= ZERO * longest {
                *square = 0.0;
            }
        }
        let (scaled_y, y_exponent) = scale_measurements(y, &mut self.y)?;
        Ok(Scaled {
            // the shape is the one of `a`
            a: MatrixView::new(a.nrows(), a.ncols(), values).unwrap_or(a),
            y: scaled_y,
            y_norm: kernels::dot(scaled_y, scaled_y).sqrt(),
            squares: &self.squares,
            matrix_exponent,
            y_exponent,
        })
    }

    /// Measurements alone, scaled if they have to be, and the exponent of two that was taken out.
    ///
    /// # Errors
    /// [`RecoverError::NotFinite`].
    pub(crate) fn measurements<'a>(&'a mut self, y: &'a [f64]) -> Result<(&'a [f64], i32), RecoverError> {
        scale_measurements(y, &mut self.y)
    }
}

fn scale_measurements<'a>(y: &'a [f64], copy: &'a mut Vec<f64>) -> Result<(&'a [f64], i32), RecoverError> {
    if ORDINARY.contains(&kernels::dot(y, y)) {
        return Ok((y, 0));
    }
    let exponent = exponent(y).map_err(|index| RecoverError::NotFinite { index, value: y[index] })?;
    scale_into(y, -exponent, copy);
    Ok((copy, exponent))
}

impl Scaled<'_> {
    /// Writes the weights of the columns in a choice: 1/‖aₖ‖ or, not `normalize`d, 1; 0 for columns that count as zero.
    pub(crate) fn weights_into(&self, normalize: bool, out: &mut Vec<f64>) {
        if normalize {
            out.resize(self.squares.len(), 0.0);
            kernels::inverse_roots(self.squares, out);
        } else {
            out.clear();
            out.extend(self.squares.iter().map(|&square| f64::from(square > 0.0)));
        }
    }

    /// Power of two that was taken out of the operator.
    pub(crate) fn matrix_exponent(&self) -> i32 {
        self.matrix_exponent
    }

    /// Takes the scaling back out of a solution.
    ///
    /// # Errors
    /// [`RecoverError::Overflow`] when a coefficient is beyond the range of numbers.
    pub(crate) fn unscale(&self, solution: &mut Solution) -> Result<(), RecoverError> {
        unscale(solution, self.y_exponent, self.matrix_exponent)
    }
}

/// Takes powers of two back out of a solution.
///
/// # Errors
/// [`RecoverError::Overflow`] when a coefficient is beyond the range of numbers.
pub(crate) fn unscale(solution: &mut Solution, y_exponent: i32, matrix_exponent: i32) -> Result<(), RecoverError> {
    if y_exponent == 0 && matrix_exponent == 0 {
        return Ok(());
    }
    solution.residual_norm = times_power_of_two(solution.residual_norm, y_exponent).min(f64::MAX);
    for (coefficient, &atom) in solution.coefficients.iter_mut().zip(&solution.support) {
        *coefficient = times_power_of_two(*coefficient, y_exponent - matrix_exponent);
        if !coefficient.is_finite() {
            return Err(RecoverError::Overflow { atom });
        }
    }
    Ok(())
}

/// Exponent e with max |v| in [2^e, 2^(e+1)), at least −1022; 0 when all are zero. The index of the first that is not finite otherwise.
pub(crate) fn exponent(values: &[f64]) -> Result<i32, usize> {
    let mut most = 0.0_f64;
    for (index, v) in values.iter().enumerate() {
        if !v.is_finite() {
            return Err(index);
        }
        most = most.max(v.abs());
    }
    #[expect(
        clippy::cast_possible_truncation,
        reason = "log2 of a finite number is between -1074 and 1024"
    )]
    Ok(if most > 0.0 { most.log2().floor() as i32 } else { 0 })
}

fn scale_into(values: &[f64], exponent: i32, out: &mut Vec<f64>) {
    out.clear();
    out.extend(values.iter().map(|&v| times_power_of_two(v, exponent)));
}

/// `v`·2^`exponent`, in steps: 2^`exponent` itself may be out of range where the product is not.
pub(crate) fn times_power_of_two(mut v: f64, mut exponent: i32) -> f64 {
    while exponent != 0 {
        let step = exponent.clamp(-1000, 1000);
        v *= 2.0_f64.powi(step);
        exponent -= step;
    }
    v
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
            assert!(
                ORDINARY.contains(&scaled.squares[1]) && ORDINARY.contains(&scaled.y_norm),
                "{scale:e}"
            );
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
    fn a_matrix_that_is_not_finite_is_named() {
        for bad in [f64::NAN, f64::INFINITY] {
            let a = [1.0, 0.0, 0.0, bad];
            let problem = Problem::new(MatrixView::new(2, 2, &a).unwrap(), &[1.0, 1.0]).unwrap();
            let error = Scaling::default().apply(&problem).map(|_| ());
            assert!(
                matches!(error, Err(RecoverError::OperatorNotFinite { row: 1, col: 1, .. })),
                "{error:?}"
            );
        }
    }
}
