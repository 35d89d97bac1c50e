//! Checks of parameters and measurements, and sentences for what several modules refuse.

use spts_input::Refusal;

/// `value` when it lies in [`min`, `max`]; a NaN lies nowhere.
pub(crate) fn within(field: &str, value: f64, min: f64, max: f64) -> Result<f64, Refusal> {
    if value >= min && value <= max { Ok(value) } else { Err(out_of_range(field, value, min, max)) }
}

/// A parameter outside its range.
pub(crate) fn out_of_range(field: &str, value: f64, min: f64, max: f64) -> Refusal {
    Refusal::range(field, format_args!("{value:e}"), format_args!("[{min:e}, {max:e}]"))
}

/// Largest measurement that evidence is computed from: its square still has room for sums and for small noise.
const LARGEST: f64 = 1e80;

/// Smallest one that is told from zero: the square of a smaller one would be rounded.
const SMALLEST: f64 = 1e-80;

/// The measurement `y` as evidence uses it: values below 1e-80 count as zero.
///
/// # Errors
/// A NaN, an infinity, or more than 1e80.
pub(crate) fn measurement(y: f64) -> Result<f64, Refusal> {
    within("y", y, -LARGEST, LARGEST).map(|y| if y.abs() < SMALLEST { 0.0 } else { y })
}

/// Another number of measurements than of rows.
pub(crate) fn shape_mismatch(rows: usize, len: usize) -> Refusal {
    Refusal::new(format!("operator has {rows} rows but `y` has {len} entries"))
}

/// No measurement, or no unknown.
pub(crate) fn empty(rows: usize, cols: usize) -> Refusal {
    Refusal::new(format!("operator has shape {rows} × {cols}; both must be at least 1"))
}

/// An operator for another number of unknowns.
pub(crate) fn other_columns(cols: usize, expected: usize) -> Refusal {
    Refusal::new(format!("operator has {cols} columns; the method was built for {expected}"))
}

/// A measurement that is a NaN or an infinity.
pub(crate) fn not_finite(index: usize, value: f64) -> Refusal {
    Refusal::new(format!("`y[{index}]` = {value} is not finite"))
}

/// A coefficient beyond the range of numbers, as with measurements of 1e300 and an operator of 1e-300.
pub(crate) fn overflow(atom: usize) -> Refusal {
    Refusal::new(format!("the coefficient of atom {atom} exceeds the range of 64-bit numbers"))
}

/// Normal equations that cannot be solved.
pub(crate) fn not_positive_definite(pivot: usize) -> Refusal {
    Refusal::new(format!("the matrix of the normal equations is not positive definite at pivot {pivot}"))
}

/// An iteration that ended before its tolerance, with the relative error that it reached.
pub(crate) fn not_converged(iterations: usize, error: f64, tol: f64) -> Refusal {
    Refusal::new(format!("no convergence in {iterations} iterations (relative error {error:.3e}, tolerance {tol:.3e})"))
}

/// An argument of the wrong length.
pub(crate) fn other_length(what: &str, len: usize, expected: usize) -> Refusal {
    Refusal::new(format!("{what} has {len} values, expected {expected}"))
}

/// An image without a value above zero.
pub(crate) fn no_contact(index: usize) -> Refusal {
    Refusal::new(format!("image {index} has no value above zero"))
}

/// Whether `result` is refused, with a sentence that has this part.
#[cfg(test)]
pub(crate) fn says<T>(result: &Result<T, Refusal>, part: &str) -> bool {
    result.as_ref().is_err_and(|error| error.to_string().contains(part))
}
