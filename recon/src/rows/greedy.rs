//! Rows designed one after the other, each for the largest reduction of the posterior variance.

use super::ascent::{Worth, climb};
use super::covariance::Posterior;
use super::error::RowError;
use super::headroom::Headroom;
use super::random::random_signs;
use super::task::{DesignRows, RowTask};
use crate::checks::within;
use crate::kernels::{adjoint, axpy, dot};
use crate::matrix::Matrix;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Rows that reduce the trace of the posterior covariance P of the expected images most, one after the other. The
/// reduction by a row a is |P a|² / (aᵀP a + σ²). The search for a row starts from the signs of P's leading
/// eigenvectors, of pairs of them, and of random vectors; single levels then change as long as the reduction grows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Greedy {
    /// Number of initial rows that are tried.
    pub starts: usize,
    /// Largest number of sweeps over all taxels for each of them.
    pub sweeps: usize,
}

/// Most taxels whose covariance is kept whole: 128 MiB twice.
const MOST_TAXELS: usize = 4096;
/// Leading eigenvectors that rows start from.
const LEADING: usize = 8;
/// Power iterations before the first row, and before every other one, which begins with the vectors of the last.
const ITERATIONS: [usize; 2] = [30, 3];

impl Default for Greedy {
    fn default() -> Self {
        Self { starts: 24, sweeps: 4 }
    }
}

impl DesignRows for Greedy {
    fn design(&self, task: &RowTask<'_>) -> Result<Matrix, RowError> {
        task.check(1 << 20, "so many rows are of no use")?;
        let n = task.expected.taxels();
        within("taxels", n as f64, 1.0, MOST_TAXELS as f64)?;
        let mut posterior = Posterior::new(task.expected.covariance(), task.variance());
        let headroom = Headroom::of(task);
        let mut rng = ChaCha8Rng::seed_from_u64(task.seed);
        let mut leading = Leading::new(n, &mut rng);
        let mut rows = Matrix::zeros(task.rows, n);
        for r in 0..task.rows {
            leading.iterate(&posterior.p, ITERATIONS[usize::from(r > 0)]);
            let starts = self.starts_of(&leading, n, &mut rng);
            let climbed = starts.into_par_iter().map(|mut row| {
                let mut headroom = headroom.clone();
                let mut worth = Fall::new(&posterior);
                let found = climb(&mut worth, headroom.as_mut(), self.sweeps, &mut row);
                found.map(|worth| (worth, row))
            });
            let climbed: Vec<Option<(f64, Vec<f64>)>> = climbed.collect();
            // the first of equals, whatever thread it came from
            let best = climbed
                .into_iter()
                .flatten()
                .reduce(|a, b| if b.0 > a.0 { b } else { a });
            let Some((_, row)) = best else {
                return Err(unreachable_limit(task, headroom));
            };
            posterior.observe(&row);
            rows.row_mut(r).copy_from_slice(&row);
        }
        Ok(rows)
    }
}

impl Greedy {
    fn starts_of(&self, leading: &Leading, n: usize, rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
        let signs = |v: &[f64]| v.iter().map(|x| if *x < 0.0 { -1.0 } else { 1.0 }).collect();
        let vectors: Vec<&[f64]> = leading.vectors.chunks_exact(n).collect();
        let mut starts: Vec<Vec<f64>> = vectors.iter().map(|v| signs(v)).collect();
        for pair in vectors.windows(2) {
            let sum: Vec<f64> = pair[0].iter().zip(pair[1]).map(|(a, b)| a + b).collect();
            starts.push(signs(&sum));
        }
        while starts.len() < self.starts {
            starts.push(random_signs(n, rng));
        }
        starts.truncate(self.starts.max(1));
        starts
    }
}

/// The smallest sum that can be had, for an error.
pub(super) fn unreachable_limit(task: &RowTask<'_>, headroom: Option<Headroom>) -> RowError {
    let mut row: Vec<f64> = (0..task.expected.taxels())
        .map(|i| if i % 2 == 0 { 1.0 } else { -1.0 })
        .collect();
    let square = headroom.map_or(0.0, |mut headroom| {
        headroom.start(&row);
        loop {
            let next = (0..row.len())
                .map(|i| (headroom.after(i, -2.0 * row[i]), i))
                .fold((f64::INFINITY, 0), |a, b| if b.0 < a.0 { b } else { a });
            if next.0 >= headroom.square() * (1.0 - 1e-9) {
                break headroom.square();
            }
            headroom.change(next.1, -2.0 * row[next.1]);
            row[next.1] *= -1.0;
        }
    });
    RowError::Headroom {
        limit: task.largest_sum.unwrap_or_default(),
        least: (square.max(0.0) / task.expected.random_square()).sqrt(),
    }
}

/// |P a|² / (aᵀP a + σ²).
struct Fall<'a> {
    posterior: &'a Posterior,
    /// P a
    u: Vec<f64>,
    /// P² a
    w: Vec<f64>,
    uu: f64,
    apa: f64,
}

impl<'a> Fall<'a> {
    fn new(posterior: &'a Posterior) -> Self {
        let n = posterior.n;
        Self {
            posterior,
            u: vec![0.0; n],
            w: vec![0.0; n],
            uu: 0.0,
            apa: 0.0,
        }
    }

    fn parts(&self, i: usize, delta: f64) -> (f64, f64) {
        let diagonal = i * (self.posterior.n + 1);
        (
            self.uu + delta * (2.0 * self.w[i] + delta * self.posterior.square[diagonal]),
            self.apa + delta * (2.0 * self.u[i] + delta * self.posterior.p[diagonal]),
        )
    }

    fn of(&self, (uu, apa): (f64, f64)) -> f64 {
        uu / (apa.max(0.0) + self.posterior.variance)
    }
}

impl Worth for Fall<'_> {
    fn start(&mut self, row: &[f64]) {
        adjoint(&self.posterior.p, row, &mut self.u);
        adjoint(&self.posterior.square, row, &mut self.w);
        (self.uu, self.apa) = (dot(&self.u, &self.u), dot(row, &self.u));
    }

    fn worth(&self) -> f64 {
        self.of((self.uu, self.apa))
    }

    fn after(&mut self, i: usize, delta: f64) -> f64 {
        self.of(self.parts(i, delta))
    }

    fn change(&mut self, i: usize, delta: f64) {
        let n = self.posterior.n;
        (self.uu, self.apa) = self.parts(i, delta);
        axpy(delta, &self.posterior.p[i * n..(i + 1) * n], &mut self.u);
        axpy(delta, &self.posterior.square[i * n..(i + 1) * n], &mut self.w);
    }
}

/// Leading eigenvectors, by orthogonal iteration.
struct Leading {
    n: usize,
    /// One after the other, each of length N.
    vectors: Vec<f64>,
    products: Vec<f64>,
}

impl Leading {
    fn new(n: usize, rng: &mut ChaCha8Rng) -> Self {
        let count = LEADING.min(n);
        Self {
            n,
            vectors: (0..count * n).map(|_| rng.random::<f64>() - 0.5).collect(),
            products: vec![0.0; count * n],
        }
    }

    fn iterate(&mut self, p: &[f64], iterations: usize) {
        let n = self.n;
        for _ in 0..iterations {
            let pairs = self
                .vectors
                .par_chunks_exact(n)
                .zip(self.products.par_chunks_exact_mut(n));
            pairs.for_each(|(v, out)| adjoint(p, v, out));
            std::mem::swap(&mut self.vectors, &mut self.products);
            for k in 0..self.vectors.len() / n {
                let (done, rest) = self.vectors.split_at_mut(k * n);
                let v = &mut rest[..n];
                let before = dot(v, v).sqrt();
                for other in done.chunks_exact(n) {
                    axpy(-dot(other, v), other, v);
                }
                let length = dot(v, v).sqrt();
                // what the others explain but for rounding starts from a taxel of its own
                if length <= 1e-12 * before || !length.is_normal() {
                    v.fill(0.0);
                    v[k % n] = 1.0;
                } else {
                    v.iter_mut().for_each(|x| *x /= length);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::covariance::posterior_trace;
    use super::super::expected::{Expected, Tolerances};
    use super::*;
    use crate::recover::Gaussian;

    fn hadamard(n: usize, r: usize, c: usize) -> f64 {
        debug_assert!(n.is_power_of_two());
        if (r & c).count_ones().is_multiple_of(2) {
            1.0
        } else {
            -1.0
        }
    }

    /// Where the eigenvectors are rows of a Hadamard matrix, they are the best rows of all, strongest first.
    #[test]
    fn eigenvectors_of_signs_are_found_in_their_order() {
        let n = 16;
        let variances: Vec<f64> = (0..n).map(|k| 0.7_f64.powf(((k * 7 + 3) % n) as f64)).collect();
        let mut c = Matrix::zeros(n, n);
        for i in 0..n {
            for j in 0..n {
                c.row_mut(i)[j] = (0..n)
                    .map(|k| variances[k] * hadamard(n, k, i) * hadamard(n, k, j) / n as f64)
                    .sum();
            }
        }
        let prior = Gaussian::new(vec![0.0; n], c).unwrap();
        let expected = Expected::like(&prior, [4, 4], Tolerances::default()).unwrap();
        let task = RowTask {
            noise: 0.01,
            ..RowTask::new(8, &expected)
        };
        let rows = Greedy::default().design(&task).unwrap();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| variances[*b].total_cmp(&variances[*a]));
        for (r, &k) in order[..8].iter().enumerate() {
            let overlap: f64 = (0..n).map(|i| rows.row(r)[i] * hadamard(n, k, i)).sum();
            assert!(
                (overlap.abs() - n as f64).abs() < 1e-9,
                "row {r} is not eigenvector {k}: {overlap}"
            );
        }
        // every row then removes its own variance but for the noise: λ → λ σ²/(N λ + σ²)
        let (variance, all) = (task.variance(), variances.iter().sum::<f64>());
        let left: f64 = order
            .iter()
            .enumerate()
            .map(|(r, &k)| {
                let v = variances[k];
                if r < 8 {
                    v * variance / (n as f64 * v + variance)
                } else {
                    v
                }
            })
            .sum();
        // `like` raises the diagonal by 1e-9 of its mean
        assert!((posterior_trace(&task, &rows).unwrap() - left / all).abs() < 1e-7);
    }

    /// No rows of energy N each leave less than water-filling over the eigenvectors does, and greedy signs come within
    /// a fifth of what it explains.
    #[test]
    fn signs_come_near_the_bound() {
        let expected = Expected::smooth([8, 8], 1.5).unwrap();
        let task = RowTask::new(12, &expected);
        let rows = Greedy::default().design(&task).unwrap();
        let c = expected.covariance();
        let dense = nalgebra::DMatrix::from_row_slice(64, 64, c.view().values());
        let eigen: Vec<f64> = dense.symmetric_eigenvalues().iter().map(|v| v.max(0.0)).collect();
        let bound = water_filling(&eigen, 12.0 * 64.0 / task.variance()) / 64.0;
        let left = posterior_trace(&task, &rows).unwrap();
        assert!(left >= bound, "{left} below the bound {bound}");
        assert!(1.0 - left > 0.8 * (1.0 - bound), "{left}, bound {bound}");
    }

    /// Least Σ λ/(1 + λ e) over energies e ≥ 0 of sum `energy`: e = (μ − 1/λ)₊, by bisection of μ.
    fn water_filling(eigen: &[f64], energy: f64) -> f64 {
        let spent = |mu: f64| eigen.iter().map(|l| (mu - 1.0 / l.max(1e-300)).max(0.0)).sum::<f64>();
        let (mut low, mut high) = (0.0, 1e9);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if spent(middle) < energy {
                low = middle
            } else {
                high = middle
            }
        }
        eigen
            .iter()
            .map(|l| l / (1.0 + l * (low - 1.0 / l.max(1e-300)).max(0.0)))
            .sum()
    }
}
