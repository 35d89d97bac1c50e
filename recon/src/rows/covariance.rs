//! Covariance of the images after measurements.

use super::error::RowError;
use super::task::RowTask;
use crate::kernels::{adjoint, axpy, dot};
use crate::matrix::Matrix;
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Posterior covariance P of Gaussian images, row by row: P ← P − P a aᵀP / (aᵀP a + σ²), and its square.
#[derive(Debug, Clone)]
pub(super) struct Posterior {
    pub(super) n: usize,
    /// P, N × N.
    pub(super) p: Vec<f64>,
    /// P², N × N.
    pub(super) square: Vec<f64>,
    /// σ².
    pub(super) variance: f64,
    u: Vec<f64>,
    w: Vec<f64>,
}

impl Posterior {
    /// Before any measurement: P = `covariance`.
    pub(super) fn new(covariance: Matrix, variance: f64) -> Self {
        let n = covariance.nrows();
        let p = covariance.view().values().to_vec();
        let mut square = vec![0.0; n * n];
        // P is symmetric: (P²)ᵢⱼ is the product of two rows
        square.par_chunks_exact_mut(n).enumerate().for_each(|(i, out)| {
            let row = &p[i * n..(i + 1) * n];
            out.iter_mut()
                .zip(p.chunks_exact(n))
                .for_each(|(out, other)| *out = dot(row, other));
        });
        Self {
            n,
            p,
            square,
            variance,
            u: vec![0.0; n],
            w: vec![0.0; n],
        }
    }

    /// Measures the row `a`.
    pub(super) fn observe(&mut self, a: &[f64]) {
        let n = self.n;
        adjoint(&self.p, a, &mut self.u);
        adjoint(&self.p, &self.u, &mut self.w);
        let (u, w) = (&self.u, &self.w);
        let d = dot(a, u) + self.variance;
        let uu = dot(u, u) / (d * d);
        let rows = self.p.par_chunks_exact_mut(n).zip(self.square.par_chunks_exact_mut(n));
        rows.enumerate().with_min_len(64).for_each(|(i, (p, square))| {
            axpy(-u[i] / d, u, p);
            axpy(uu * u[i] - w[i] / d, u, square);
            axpy(-u[i] / d, w, square);
        });
    }

    pub(super) fn trace(&self) -> f64 {
        (0..self.n).map(|i| self.p[i * (self.n + 1)]).sum()
    }
}

/// Share of the expected images' variance that remains after the measurements `rows` (M × N): the trace of the
/// posterior covariance divided by that of the prior.
///
/// tr P = tr C − ‖L⁻¹ A C‖², L Lᵀ = A C Aᵀ + σ² I. The cost is O(M²N) plus M products with C; for separable images such
/// a product costs O(N) times the sides of the grid.
///
/// # Errors
/// [`RowError`] if the task is out of range, or the rows have another number of taxels.
pub fn posterior_trace(task: &RowTask<'_>, rows: &Matrix) -> Result<f64, RowError> {
    task.check(usize::MAX, "")?;
    let expected = task.expected;
    let (m, n) = (rows.nrows(), rows.ncols());
    if n != expected.taxels() {
        let [rows, cols] = expected.shape();
        return Err(RowError::Shape { pixels: n, rows, cols });
    }
    let mut cross = vec![0.0; m * n];
    cross
        .par_chunks_exact_mut(n)
        .enumerate()
        .for_each(|(r, out)| expected.times_covariance(rows.row(r), out));
    let row = |r: usize| &cross[r * n..(r + 1) * n];
    let mut system = DMatrix::from_fn(m, m, |i, j| if i < j { 0.0 } else { dot(row(i), rows.row(j)) });
    // rounding of the sums is what a noise of this size is lost in
    let floor = f64::EPSILON * m as f64 * (0..m).map(|i| system[(i, i)]).fold(0.0, f64::max);
    (0..m).for_each(|i| system[(i, i)] += task.variance().max(floor));
    let before = expected.variance();
    // only the lower triangle is read
    let Some(factor) = system.cholesky() else {
        let mut posterior = Posterior::new(expected.covariance(), task.variance());
        (0..m).for_each(|r| posterior.observe(rows.row(r)));
        return Ok(posterior.trace() / before);
    };
    // row by row
    let factor = factor.l().transpose();
    let factor = factor.as_slice();
    let gone: f64 = (0..n)
        .into_par_iter()
        .with_min_len(64)
        .map_init(
            || vec![0.0; m],
            |column, taxel| {
                for i in 0..m {
                    let lower = &factor[i * m..=i * m + i];
                    column[i] = (cross[i * n + taxel] - dot(&lower[..i], &column[..i])) / lower[i];
                }
                column.iter().map(|v| v * v).sum::<f64>()
            },
        )
        .collect::<Vec<f64>>()
        .iter()
        .sum();
    Ok((1.0 - gone / before).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::super::expected::Expected;
    use super::*;

    /// Against the batch form of the posterior: P = C − C Aᵀ (A C Aᵀ + σ² I)⁻¹ A C.
    #[test]
    fn row_by_row_is_all_at_once() {
        let expected = Expected::smooth([4, 5], 1.3).unwrap();
        let task = RowTask::new(6, &expected);
        let a = DMatrix::from_fn(6, 20, |i, j| if (i * 7 + j * j + i * j) % 3 == 0 { -1.0 } else { 1.0 });
        let c = DMatrix::from_row_slice(20, 20, expected.covariance().view().values());
        let system = &a * &c * a.transpose() + DMatrix::identity(6, 6) * task.variance();
        let left = &c - &c * a.transpose() * system.try_inverse().unwrap() * &a * &c;
        let mut posterior = Posterior::new(expected.covariance(), task.variance());
        let rows = Matrix::from_rows(6, 20, a.transpose().as_slice().to_vec()).unwrap();
        (0..6).for_each(|r| posterior.observe(rows.row(r)));
        let squared = &left * &left;
        for i in 0..20 {
            for j in 0..20 {
                // a few hundred products of numbers up to 1, and up to 10 in the square
                assert!((posterior.p[i * 20 + j] - left[(i, j)]).abs() < 1e-12);
                assert!((posterior.square[i * 20 + j] - squared[(i, j)]).abs() < 1e-11);
            }
        }
        let share = posterior_trace(&task, &rows).unwrap();
        assert!((share - left.trace() / c.trace()).abs() < 1e-13);
        // the same moments as one matrix
        let prior = crate::recover::Gaussian::new(vec![0.0; 20], expected.covariance()).unwrap();
        let dense = Expected::like(&prior, [4, 5], Default::default()).unwrap();
        let again = posterior_trace(&RowTask::new(6, &dense), &rows).unwrap();
        // its diagonal is raised by 1e-9 of itself
        assert!((share - again).abs() < 1e-8, "{share} {again}");
    }
}
