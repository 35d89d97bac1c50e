//! Remainder of earlier measurements in a residual: rₙ = Σ hₖ·(Φx)ₙ₋ₖ.

use super::fit::FitWindow;
use super::statistics::{OUTLIER_SD, robust_sd};
use nalgebra::{Matrix3, Vector3};

/// Number of taps that are fitted; the third says whether two are enough.
pub(super) const TAPS: usize = 3;

/// Taps h₁, h₂, h₃ of the windows together, without outliers. The image's own fit takes the share p/n of any
/// disturbance; that share is put back.
pub(super) fn taps(windows: &[FitWindow]) -> [f64; TAPS] {
    let (mut normal, mut moments) = (Matrix3::zeros(), Vector3::zeros());
    let mut left_over = 0.0;
    for window in windows {
        let limit = OUTLIER_SD * robust_sd(&window.residual_v).unwrap_or(0.0);
        for i in TAPS..window.residual_v.len() {
            let r = window.residual_v[i];
            // NaN, a lost sample, is not within the limit
            if r.abs() <= limit {
                let past = Vector3::new(window.model_v[i - 1], window.model_v[i - 2], window.model_v[i - 3]);
                normal += past * past.transpose();
                moments += past * r;
            }
        }
        left_over += window.left_over.powi(2);
    }
    let Some(factor) = normal.cholesky() else {
        return [0.0; TAPS];
    };
    let share = left_over / windows.len() as f64;
    (factor.solve(&moments) / share).into()
}

/// Residual of a window less what `taps` explain, V; the first [`TAPS`] measurements, whose past is outside, are left
/// out.
pub(super) fn without_memory(window: &FitWindow, taps: [f64; TAPS]) -> Vec<f64> {
    (TAPS..window.residual_v.len())
        .map(|i| {
            let past: f64 = (0..TAPS).map(|k| taps[k] * window.model_v[i - 1 - k]).sum();
            window.residual_v[i] - past
        })
        .collect()
}
