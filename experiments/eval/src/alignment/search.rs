//! Finds the rows of a chunk when they are not the expected ones.

use crate::chunk::{Chunk, Fit};
use realfft::RealFftPlanner;
use realfft::num_complex::Complex;
use std::ops::RangeInclusive;

/// Candidates that are fitted.
const FITTED: usize = 4;

/// The best fit of `chunk` for any lag of `lags`; `None` when there is no such row.
///
/// The candidates are the lags with the largest ‖Φᵀy‖². With wrong rows it is ‖y‖² times N on average, with a standard
/// deviation of √(2N), and with the right ones ‖y‖² times N + L for what an image explains: at N = 100 and L = 400
/// more than twenty standard deviations apart. A fit decides between the best of them; of equal ones, that nearest
/// to `expected`.
pub(super) fn search(chunk: &Chunk<'_>, lags: RangeInclusive<i64>, expected: i64) -> Option<Fit> {
    let (least, most) = (*lags.start(), *lags.end());
    // rows from that of the largest lag on; before the first row of all there are none
    let most = (least..=most).rev().find(|lag| chunk.rows(*lag, 0).is_some())?;
    let more = usize::try_from(most - least).ok()?;
    let rows = chunk.rows(most, more)?;
    let energies = correlation_energies(&rows.to_vec(), rows.taxels(), &chunk.y);
    let mut scores: Vec<(f64, i64)> = energies.into_iter().zip((least..=most).rev()).collect();
    let far = |lag: i64| (lag - expected).abs();
    scores.sort_by(|a, b| b.0.total_cmp(&a.0).then(far(a.1).cmp(&far(b.1))));
    let fits = scores.iter().take(FITTED).filter_map(|&(_, lag)| chunk.fit(lag));
    fits.min_by(|a, b| a.residual.total_cmp(&b.residual).then(far(a.rows).cmp(&far(b.rows))))
}

/// ‖Φᵀy‖² for every row of `phi` at which Φ can begin, times a constant; `phi` has `taxels` weights a row.
///
/// What one taxel adds is the square of the cross-correlation of its weights with y. By FFT that is the inverse
/// transform of W · conj(Y), W and Y being the transforms of weights and samples. They are as long as `phi` or longer,
/// so that no row wraps around.
fn correlation_energies(phi: &[f64], taxels: usize, y: &[f64]) -> Vec<f64> {
    /// Lengths that are multiples of it are quick.
    const MULTIPLE: usize = 1024;
    let rows = phi.len() / taxels;
    let len = rows.next_multiple_of(MULTIPLE);
    let mut planner = RealFftPlanner::<f64>::new();
    let (forward, inverse) = (planner.plan_fft_forward(len), planner.plan_fft_inverse(len));
    let (mut values, mut spectrum) = (forward.make_input_vec(), forward.make_output_vec());
    let mut scratch = forward.make_scratch_vec();
    scratch.resize(scratch.len().max(inverse.get_scratch_len()), Complex::default());
    let lengths = "buffers of the plan's own lengths";
    let mut output = forward.make_output_vec();
    values[..y.len()].copy_from_slice(y);
    forward
        .process_with_scratch(&mut values, &mut output, &mut scratch)
        .expect(lengths);
    let mut energies = vec![0.0; rows + 1 - y.len()];
    for taxel in 0..taxels {
        let weights = phi.iter().skip(taxel).step_by(taxels);
        values
            .iter_mut()
            .zip(weights)
            .for_each(|(value, weight)| *value = *weight);
        values[rows..].fill(0.0);
        forward
            .process_with_scratch(&mut values, &mut spectrum, &mut scratch)
            .expect(lengths);
        spectrum.iter_mut().zip(&output).for_each(|(w, y)| *w *= y.conj());
        inverse
            .process_with_scratch(&mut spectrum, &mut values, &mut scratch)
            .expect(lengths);
        energies
            .iter_mut()
            .zip(&values)
            .for_each(|(energy, part)| *energy += part * part);
    }
    energies
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The sums that define them; a transform of 2048 values errs by some 1e-15 of the largest.
    #[test]
    fn energies_are_those_of_the_sums() {
        let (taxels, rows, samples) = (7, 1100, 300);
        let phi: Vec<f64> = (0..taxels * rows).map(|k| ((k * k * 31) % 17) as f64 - 8.0).collect();
        let y: Vec<f64> = (0..samples).map(|k| ((k * 7) % 23) as f64 - 11.0).collect();
        let found = correlation_energies(&phi, taxels, &y);
        assert_eq!(found.len(), rows + 1 - samples);
        let direct = |first: usize| -> f64 {
            let sum = |taxel: usize| -> f64 {
                let at = |k: usize| phi[(first + k) * taxels + taxel] * y[k];
                (0..samples).map(at).sum()
            };
            (0..taxels).map(|taxel| sum(taxel).powi(2)).sum()
        };
        let scale = found[0] / direct(0);
        let most = (0..found.len()).map(direct).fold(0.0, f64::max);
        for (first, energy) in found.iter().enumerate() {
            let error = (energy / scale - direct(first)).abs() / most;
            assert!(error < 1e-12, "{first}: {error}");
        }
    }
}
