//! Powers of two that scale a problem of any magnitude so that squares neither overflow nor vanish. Dividing by a power
//! of two loses no digits.

use crate::kernels;
use crate::matrix::MatrixView;
use crate::problem::{Problem, RecoverError, Solution};

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
    /// [`RecoverError::OperatorNotFinite`].
    pub(crate) fn apply<'a>(&'a mut self, problem: &Problem<'a>) -> Result<Scaled<'a>, RecoverError> {
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

    /// Measurements alone, divided by the power of two that is returned if they have to be.
    ///
    /// # Errors
    /// [`RecoverError::NotFinite`].
    pub(crate) fn measurements<'a>(&'a mut self, y: &'a [f64]) -> Result<(&'a [f64], f64), RecoverError> {
        scale_measurements(y, &mut self.y)
    }
}

fn scale_measurements<'a>(y: &'a [f64], copy: &'a mut Vec<f64>) -> Result<(&'a [f64], f64), RecoverError> {
    if ORDINARY.contains(&kernels::dot(y, y)) {
        return Ok((y, 1.0));
    }
    let scale = power_of_two(y);
    if !scale.is_finite() {
        let index = first_not_finite(y);
        return Err(RecoverError::NotFinite { index, value: y[index] });
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

    /// Power of two that the operator was divided by.
    pub(crate) fn matrix_scale(&self) -> f64 {
        self.matrix_scale
    }

    /// Takes the scaling back out of a solution.
    ///
    /// # Errors
    /// [`RecoverError::Overflow`] when a coefficient is beyond the range of numbers.
    pub(crate) fn unscale(&self, solution: &mut Solution) -> Result<(), RecoverError> {
        unscale(solution, self.y_scale, self.matrix_scale)
    }
}

/// Takes powers of two back out of a solution.
///
/// # Errors
/// [`RecoverError::Overflow`] when a coefficient is beyond the range of numbers.
#[expect(clippy::float_cmp, reason = "1 is what an unscaled problem has, to the bit")]
pub(crate) fn unscale(solution: &mut Solution, y_scale: f64, matrix_scale: f64) -> Result<(), RecoverError> {
    if y_scale == 1.0 && matrix_scale == 1.0 {
        return Ok(());
    }
    solution.residual_norm = (solution.residual_norm * y_scale).min(f64::MAX);
    let ratio = y_scale / matrix_scale;
    for (coefficient, &atom) in solution.coefficients.iter_mut().zip(&solution.support) {
        // one product that is exact, or two where 2^±1074 lies between the scales
        *coefficient = if ratio.is_normal() {
            *coefficient * ratio
        } else {
            *coefficient * y_scale / matrix_scale
        };
        if !coefficient.is_finite() {
            return Err(RecoverError::Overflow { atom });
        }
    }
    Ok(())
}

/// Largest power of two that is at most the largest magnitude of `values`, or 1 when all of them are zero. Dividing by
/// it is exact. Infinite or NaN when a value is.
pub(crate) fn power_of_two(values: &[f64]) -> f64 {
    let max = values
        .iter()
        .fold(0.0_f64, |m, v| if m.is_nan() || v.abs() <= m { m } else { v.abs() });
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
/// [`RecoverError::OperatorNotFinite`] for a NaN or an infinity.
pub(super) fn operator_scale(a: MatrixView<'_>) -> Result<f64, RecoverError> {
    let scale = power_of_two(a.values());
    if scale.is_finite() {
        return Ok(scale);
    }
    let index = first_not_finite(a.values());
    Err(RecoverError::OperatorNotFinite {
        row: index / a.ncols(),
        col: index % a.ncols(),
        value: a.values()[index],
    })
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
        assert!(
            matches!(error, RecoverError::OperatorNotFinite { row: 1, col: 0, .. }),
            "{error}"
        );
    }
}
