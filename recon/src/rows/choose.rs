//! Selects rows among given candidates.

use super::classes::Apart;
use super::error::RowError;
use super::task::RowTask;
use crate::kernels::{axpy, dot};
use crate::matrix::MatrixView;

/// Selects `task.rows` rows of `candidates` (C × N), and returns their numbers in order of selection. Each is the row
/// that reduces the trace of the posterior covariance most; see `greedy` in [`super::DESIGNERS`]. No row is selected
/// twice.
///
/// Costs O(C N) for each row, because P a is kept for every candidate.
///
/// ```
/// use spts_recon::Matrix;
/// use spts_recon::rows::{Expected, RowTask, choose_for_images};
///
/// let smooth = Expected::smooth([2, 2], 2.0)?;
/// let candidates = Matrix::from_rows(3, 4, vec![
///     1.0, -1.0, -1.0, 1.0, //
///     1.0, 1.0, 1.0, 1.0, //
///     1.0, 1.0, -1.0, -1.0,
/// ])?;
/// let chosen = choose_for_images(&RowTask::new(2, &smooth), candidates.view())?;
/// assert_eq!(chosen[0], 1, "the sum says most about a smooth image");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`RowError`] if the task is out of range, the candidates have another number of taxels, or there are too few.
pub fn choose_for_images(task: &RowTask<'_>, candidates: MatrixView<'_>) -> Result<Vec<usize>, RowError> {
    let n = check(task, candidates)?;
    let covariance = task.expected.covariance();
    let variance = task.variance();
    let rows: Vec<&[f64]> = candidates.values().chunks_exact(n).collect();
    // P a of every candidate, |P a|² and aᵀP a
    let mut products = vec![0.0; rows.len() * n];
    for (product, row) in products.chunks_exact_mut(n).zip(&rows) {
        crate::kernels::adjoint(covariance.view().values(), row, product);
    }
    let mut falls: Vec<(f64, f64)> = products
        .chunks_exact(n)
        .zip(&rows)
        .map(|(u, a)| (dot(u, u), dot(u, a)))
        .collect();
    let mut chosen = Vec::with_capacity(task.rows);
    let mut left = vec![true; rows.len()];
    let mut u = vec![0.0; n];
    while chosen.len() < task.rows {
        let fall = |k: usize| falls[k].0 / (falls[k].1.max(0.0) + variance);
        let each = (0..rows.len()).filter(|k| left[*k]).map(|k| (fall(k), k));
        let Some((_, best)) = each.reduce(|a, b| if b.0 > a.0 { b } else { a }) else {
            break;
        };
        chosen.push(best);
        left[best] = false;
        u.copy_from_slice(&products[best * n..(best + 1) * n]);
        let d = falls[best].1.max(0.0) + variance;
        for ((product, row), fall) in products.chunks_exact_mut(n).zip(&rows).zip(&mut falls) {
            axpy(-dot(row, &u) / d, &u, product);
            *fall = (dot(product, product), dot(product, row));
        }
    }
    Ok(chosen)
}

/// As [`choose_for_images`], but each row is the one that reduces the bound of the errors between `task.classes` most;
/// see `classes` in [`super::DESIGNERS`].
///
/// # Errors
/// As [`choose_for_images`], and [`RowError::Classes`] for fewer than two classes.
pub fn choose_for_classes(task: &RowTask<'_>, candidates: MatrixView<'_>) -> Result<Vec<usize>, RowError> {
    let n = check(task, candidates)?;
    let mut apart = Apart::new(task.classes, task.expected.shape())?;
    let rows: Vec<&[f64]> = candidates.values().chunks_exact(n).collect();
    // of every candidate, its sums over what is not explained of the templates, and aᵀP a
    let mut seen: Vec<(Vec<f64>, f64)> = rows.iter().map(|row| apart.seen(row)).collect();
    let mut left = vec![true; rows.len()];
    let mut chosen = Vec::with_capacity(task.rows);
    while chosen.len() < task.rows {
        let mut least: Option<(f64, usize)> = None;
        for k in (0..rows.len()).filter(|k| left[*k]) {
            let enough = least.map_or(f64::INFINITY, |(bound, _)| bound);
            let bound = apart.bound_with(&seen[k], enough);
            if least.is_none() || bound < enough {
                least = Some((bound, k));
            }
        }
        let Some((_, best)) = least else { break };
        chosen.push(best);
        left[best] = false;
        let step = apart.observe(rows[best]);
        for ((sums, apa), row) in seen.iter_mut().zip(&rows) {
            let share = dot(row, &step.u) / step.s;
            *apa -= share * share * step.s;
            axpy(-share, &step.sums, sums);
        }
    }
    Ok(chosen)
}

/// Number of taxels.
fn check(task: &RowTask<'_>, candidates: MatrixView<'_>) -> Result<usize, RowError> {
    let [rows, cols] = task.expected.shape();
    if candidates.ncols() != rows * cols {
        return Err(RowError::Shape {
            pixels: candidates.ncols(),
            rows,
            cols,
        });
    }
    task.check(candidates.nrows(), "there are no more candidates")?;
    Ok(rows * cols)
}

#[cfg(test)]
mod tests {
    use super::super::covariance::posterior_trace;
    use super::super::expected::Expected;
    use super::super::random::Random;
    use super::super::task::DesignRows as _;
    use super::*;
    use crate::classify::Component;
    use crate::matrix::Matrix;

    /// Against the rule as it is written: every candidate measured in turn on top of those chosen.
    #[test]
    fn the_choice_lowers_the_trace_most() {
        let expected = Expected::smooth([4, 4], 1.2).unwrap();
        let candidates = Random.design(&RowTask::new(60, &expected)).unwrap();
        let task = RowTask::new(5, &expected);
        let chosen = choose_for_images(&task, candidates.view()).unwrap();
        let trace = |rows: &[usize]| {
            let mut picked = Matrix::zeros(rows.len(), 16);
            rows.iter()
                .enumerate()
                .for_each(|(r, &k)| picked.row_mut(r).copy_from_slice(candidates.row(k)));
            posterior_trace(&task, &picked).unwrap()
        };
        for m in 1..=5 {
            let best = trace(&chosen[..m]);
            for k in (0..60).filter(|k| !chosen[..m - 1].contains(k)) {
                let mut other = chosen[..m - 1].to_vec();
                other.push(k);
                assert!(
                    trace(&other) >= best - 1e-12,
                    "row {m}: {k} is better than {}",
                    chosen[m - 1]
                );
            }
        }
        let refused = choose_for_images(&RowTask::new(61, &expected), candidates.view());
        assert!(matches!(refused, Err(RowError::Rows { most: 60, .. })), "{refused:?}");
    }
    /// The same for classes: what is kept for every candidate is what a look at it afresh says.
    #[test]
    fn the_choice_lowers_the_bound_most() {
        let expected = Expected::smooth([4, 4], 1.2).unwrap();
        let candidates = Random.design(&RowTask::new(60, &expected)).unwrap();
        let classes: Vec<Component> = (0..4)
            .map(|label| Component {
                label: Some(label),
                weight: 1.0,
                mean: candidates.row(label).iter().map(|v| 0.5 * v + 1.0).collect(),
                factors: vec![candidates.row(50 + label).iter().map(|v| 0.2 * v).collect()],
                noise_variance: 3.0,
            })
            .collect();
        let task = RowTask {
            classes: &classes,
            ..RowTask::new(5, &expected)
        };
        let chosen = choose_for_classes(&task, candidates.view()).unwrap();
        let mut apart = Apart::new(&classes, [4, 4]).unwrap();
        for (m, &best) in chosen.iter().enumerate() {
            let bound = |k: usize| apart.bound_with(&apart.seen(candidates.row(k)), f64::INFINITY);
            for k in (0..60).filter(|k| !chosen[..m].contains(k)) {
                assert!(
                    bound(k) >= bound(best) * (1.0 - 1e-9),
                    "row {m}: {k} is better than {best}"
                );
            }
            apart.observe(candidates.row(best));
        }
    }
}
