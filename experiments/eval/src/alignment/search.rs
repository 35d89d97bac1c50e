//! Finds the rows of a chunk when they are not the expected ones.

use crate::chunk::{Chunk, Fit};
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
    let (taxels, phi) = (rows.taxels(), rows.to_vec());
    let mut scores: Vec<(f64, i64)> = Vec::with_capacity(more + 1);
    let mut sums = vec![0.0; taxels];
    for (first, lag) in (least..=most).rev().enumerate() {
        sums.fill(0.0);
        let rows = phi[first * taxels..].chunks_exact(taxels);
        for (row, &y) in rows.zip(&chunk.y) {
            sums.iter_mut().zip(row).for_each(|(sum, w)| *sum += w * y);
        }
        scores.push((sums.iter().map(|sum| sum * sum).sum(), lag));
    }
    let far = |lag: i64| (lag - expected).abs();
    scores.sort_by(|a, b| b.0.total_cmp(&a.0).then(far(a.1).cmp(&far(b.1))));
    let fits = scores.iter().take(FITTED).filter_map(|&(_, lag)| chunk.fit(lag));
    fits.min_by(|a, b| a.residual.total_cmp(&b.residual).then(far(a.rows).cmp(&far(b.rows))))
}
