//! Parameters of the algorithms, checked for their valid ranges.

use crate::kernels::norm;

/// A parameter outside its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("`{field}` = {value} is outside {range}")]
pub struct ParameterError {
    /// Name of the parameter.
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// Valid range.
    pub range: &'static str,
}

/// `value` when it is finite and above zero.
pub(super) fn positive(field: &'static str, value: f64) -> Result<f64, ParameterError> {
    within(field, value, value > 0.0 && value.is_finite(), "(0, ∞)")
}

/// `value` when it is in (0, 1].
pub(super) fn share(field: &'static str, value: f64) -> Result<f64, ParameterError> {
    within(field, value, value > 0.0 && value <= 1.0, "(0, 1]")
}

/// `value` when it is in [0, 1].
pub(super) fn non_negative_share(field: &'static str, value: f64) -> Result<f64, ParameterError> {
    within(field, value, (0.0..=1.0).contains(&value), "[0, 1]")
}

/// `value` when it is in [0, 1).
pub(super) fn below_one(field: &'static str, value: f64) -> Result<f64, ParameterError> {
    within(field, value, (0.0..1.0).contains(&value), "[0, 1)")
}

fn within(field: &'static str, value: f64, ok: bool, range: &'static str) -> Result<f64, ParameterError> {
    if ok {
        Ok(value)
    } else {
        Err(ParameterError { field, value, range })
    }
}

/// How strongly a recovery penalises its unknowns, in place of fitting the samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Penalty {
    /// As given, in (0, ∞).
    Absolute(f64),
    /// Relative to the largest correlation of a column with `y`, maxₖ aₖᵀ y / M; in (0, 1]. The solution then scales
    /// with `y`. At 1 the solution of the lasso is zero.
    Relative(f64),
}

impl Penalty {
    /// The penalty when it is in its range.
    ///
    /// # Errors
    /// [`ParameterError`] when it is not.
    pub(super) fn checked(self) -> Result<Self, ParameterError> {
        match self {
            Self::Absolute(value) => positive("alpha", value)?,
            Self::Relative(value) => share("alpha", value)?,
        };
        Ok(self)
    }
}

/// Standard deviation of the noise of a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Noise {
    /// In the unit of `y`, in (0, ∞).
    Absolute(f64),
    /// Relative to the root mean square of `y`, in (0, ∞). Contact noise grows with the contact.
    Relative(f64),
}

impl Noise {
    /// The noise when it is in its range.
    ///
    /// # Errors
    /// [`ParameterError`] when it is not.
    pub(super) fn checked(self) -> Result<Self, ParameterError> {
        match self {
            Self::Absolute(value) | Self::Relative(value) => positive("noise", value)?,
        };
        Ok(self)
    }

    /// Standard deviation for the measurements `y`.
    pub(super) fn deviation(self, y: &[f64]) -> f64 {
        match self {
            Self::Absolute(value) => value,
            Self::Relative(share) => share * norm(y) / (y.len().max(1) as f64).sqrt(),
        }
    }
}

/// Stopping criterion of an iteration: it ends when its error, as the method defines it, is at most `tol`, or fails
/// with [`RecoverError::NotConverged`](crate::RecoverError::NotConverged) after `max_iter` iterations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stopping {
    /// Largest error, in (0, ∞). If the method cannot reach it, as with 0 or NaN, it fails.
    pub tol: f64,
    /// Largest number of iterations.
    pub max_iter: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_refused_by_name() {
        for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = Noise::Absolute(value).checked().unwrap_err();
            assert_eq!((error.field, error.range), ("noise", "(0, ∞)"));
            assert!(Penalty::Relative(value).checked().is_err());
        }
        assert!(Penalty::Relative(1.5).checked().is_err());
        assert_eq!(Penalty::Relative(1.0).checked(), Ok(Penalty::Relative(1.0)));
    }
}
