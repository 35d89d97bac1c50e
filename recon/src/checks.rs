//! Checks of parameters and measurements that several modules share.

/// A parameter outside its range.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("`{field}` = {value:e} is outside [{min:e}, {max:e}]")]
pub struct RangeError {
    /// Name of the parameter.
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// Smallest valid value.
    pub min: f64,
    /// Largest valid value.
    pub max: f64,
}

/// `value` when it lies in [`min`, `max`]; a NaN lies nowhere.
pub(crate) fn within(field: &'static str, value: f64, min: f64, max: f64) -> Result<f64, RangeError> {
    if value >= min && value <= max {
        Ok(value)
    } else {
        Err(RangeError { field, value, min, max })
    }
}

/// Largest measurement that evidence is computed from: its square still has room for sums and for small noise.
const LARGEST: f64 = 1e80;

/// Smallest one that is told from zero: the square of a smaller one would be rounded.
const SMALLEST: f64 = 1e-80;

/// The measurement `y` as evidence uses it: values below 1e-80 count as zero.
///
/// # Errors
/// [`RangeError`] for a NaN, an infinity, or more than 1e80.
pub(crate) fn measurement(y: f64) -> Result<f64, RangeError> {
    within("y", y, -LARGEST, LARGEST).map(|y| if y.abs() < SMALLEST { 0.0 } else { y })
}
