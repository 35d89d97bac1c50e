//! Probabilities that mean what they say.

use super::component::EvidenceError;
use crate::matrix::MatrixView;

/// Temperature T that makes softmax(log evidence / T) most likely for windows of known class: argmin over T of −Σ ln
/// p(truth). `log_evidence` holds one row a window and one column an outcome, `truth` the column of the true outcome.
///
/// The function is convex in 1/T, so its derivative is bisected, within [1e-3, 1e3]; evidence that is right every time
/// by a wide margin ends at the lower end.
/// Source: C. Guo, G. Pleiss, Y. Sun, K. Weinberger, "On calibration of modern neural networks", ICML 2017.
///
/// # Errors
/// [`EvidenceError`] when there is no window, the lengths differ, a true outcome does not exist, or a value is not
/// finite.
pub fn fit_temperature(log_evidence: MatrixView<'_>, truth: &[usize]) -> Result<f64, EvidenceError> {
    if truth.len() != log_evidence.nrows() {
        return Err(EvidenceError::Shape {
            what: "truth",
            len: truth.len(),
            expected: log_evidence.nrows(),
        });
    }
    if truth.is_empty() || log_evidence.ncols() == 0 {
        return Err(EvidenceError::Empty);
    }
    if let Some(&len) = truth.iter().find(|t| **t >= log_evidence.ncols()) {
        return Err(EvidenceError::Shape {
            what: "a row up to the true outcome",
            len,
            expected: log_evidence.ncols(),
        });
    }
    for &v in log_evidence.values() {
        crate::checks::within("log evidence", v, f64::MIN, f64::MAX)?;
    }
    // derivative with respect to β = 1/T: Σ (Σ_k p_k e_k − e_truth), rising in β
    let slope = |ln_beta: f64| -> f64 {
        let beta = ln_beta.exp();
        let rows = log_evidence.values().chunks_exact(log_evidence.ncols()).zip(truth);
        rows.map(|(row, &t)| expected(row, beta) - row[t]).sum()
    };
    let (mut low, mut high) = (1e-3_f64.ln(), 1e3_f64.ln());
    // 60 halvings of a width of 14 end below 1e-16
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if slope(middle) > 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok((-0.5 * (low + high)).exp())
}

/// Mean of `row` under the probabilities softmax(β·row).
fn expected(row: &[f64], beta: f64) -> f64 {
    let max = row.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let (mut sum, mut first) = (0.0, 0.0);
    for v in row {
        let w = (beta * (v - max)).exp();
        sum += w;
        if w > 0.0 {
            first += w * (v - max);
        }
    }
    max + first / sum
}

/// Expected calibration error: mean over all decisions of |share correct − mean probability| of the decision's bin, for
/// `bins` bins of equal width. `decisions` holds the probability given to each decision and whether it was right.
/// `None` without any.
/// Source: as [`fit_temperature`].
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "a bin's index from a probability")]
pub fn calibration_error(decisions: &[(f64, bool)], bins: usize) -> Option<f64> {
    let bins = bins.max(1);
    let mut surplus = vec![0.0; bins];
    for &(probability, right) in decisions {
        let bin = ((probability * bins as f64) as usize).min(bins - 1);
        surplus[bin] += probability - f64::from(u8::from(right));
    }
    let total: f64 = surplus.iter().map(|s: &f64| s.abs()).sum();
    (!decisions.is_empty()).then(|| total / decisions.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix::Matrix;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    /// Evidence made T times too strong is found to be so.
    #[test]
    fn finds_a_planted_temperature() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for planted in [0.3, 1.0, 4.0] {
            let (windows, outcomes) = (20_000, 5);
            let mut rows = Vec::new();
            let mut truth = Vec::new();
            for _ in 0..windows {
                let logits: Vec<f64> = (0..outcomes).map(|_| rng.random_range(-2.0..2.0)).collect();
                let sum: f64 = logits.iter().map(|v| v.exp()).sum();
                let mut left = rng.random_range(0.0..sum);
                let chosen = logits.iter().position(|v| {
                    left -= v.exp();
                    left < 0.0
                });
                truth.push(chosen.unwrap_or(outcomes - 1));
                rows.extend(logits.iter().map(|v| planted * v));
            }
            let rows = Matrix::from_rows(windows, outcomes, rows).unwrap();
            let found = fit_temperature(rows.view(), &truth).unwrap();
            // a logit's variance of 4/3 under the model leaves β known to about 1/√(0.8·20,000) = .8 %; four deviations
            assert!((found / planted - 1.0).abs() < 0.032, "{found} for {planted}");
        }
    }

    #[test]
    fn certain_and_hopeless_evidence_end_at_the_limits() {
        let rows = Matrix::from_rows(2, 2, vec![900.0, 0.0, 0.0, 900.0]).unwrap();
        assert!((fit_temperature(rows.view(), &[0, 1]).unwrap() - 1e-3).abs() < 1e-6);
        assert!((fit_temperature(rows.view(), &[1, 0]).unwrap() - 1e3).abs() < 1.0);
        assert!(fit_temperature(rows.view(), &[0]).is_err());
        assert!(fit_temperature(rows.view(), &[0, 2]).is_err());
        let nan = Matrix::from_rows(1, 2, vec![f64::NAN, 0.0]).unwrap();
        assert!(fit_temperature(nan.view(), &[0]).is_err());
    }

    #[test]
    fn calibration_error_of_a_hand_counted_case() {
        let decisions = [(0.9, true), (0.95, false), (0.3, false), (0.3, true)];
        // bins .9…1: |1.85 − 1|; .3….4: |.6 − 1|
        let error = calibration_error(&decisions, 10).unwrap();
        assert!((error - (0.85 + 0.4) / 4.0).abs() < 1e-15, "{error}");
        assert_eq!(calibration_error(&[], 10), None);
        assert_eq!(calibration_error(&[(1.0, true)], 10), Some(0.0));
    }
}
