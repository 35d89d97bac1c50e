//! Powers of two that bring a problem near 1, so that neither 1e-300 nor 1e300 is lost in a square.

use crate::matrix::MatrixView;
use crate::problem::RecoverError;

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
    let index = a.values().iter().position(|v| !v.is_finite()).unwrap_or_default();
    Err(RecoverError::OperatorNotFinite {
        row: index / a.ncols(),
        col: index % a.ncols(),
        value: a.values()[index],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
