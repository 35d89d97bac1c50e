//! Rows designed one after the other, each for the largest reduction of the posterior variance.

use crate::checks::within;
use crate::kernels::{adjoint, axpy, dot};
use crate::matrix::Matrix;
use crate::posterior::GaussianPosterior;
use crate::rows::expected::{Expected, Headroom};
use crate::rows::headroom_unreachable;
use crate::rows::kinds::{Trace, worth};
use crate::rows::other_grid;
use crate::rows::{DesignRows, RowTask};
use nalgebra::DMatrix;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use spts_input::Refusal;

/// Rows that reduce the trace of the posterior covariance P of the expected images most, one after the other. The
/// reduction by a row a is |P a|² / (aᵀP a + σ²). The search for a row starts from the signs of P's leading
/// eigenvectors, of pairs of them, and of random vectors; single levels then change as long as the reduction grows.
///
/// With [`RowTask::kinds`], each row is the one that leaves least of Σₖ ρₖᵖ, with p = 4 and the shares ρₖ = tr Pₖ /
/// tr Cₖ of all K kinds: a smooth form of the largest share, which it exceeds by a factor of at most K in the power p.
/// The largest share itself would stall where two kinds tie, since no row that helps one of them lowers it (A. Krause
/// et al., J. Mach. Learn. Res. 9 (2008) 2761, §3). The eigenvectors are those of Σₖ ρₖᵖ⁻¹ Pₖ / tr Cₖ, the slope of
/// that sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Greedy;

/// Rows that the search for one starts from, and most sweeps over all taxels for each of them.
const SEARCH: (usize, usize) = (24, 4);
/// Most taxels whose covariance is kept whole: 128 MiB twice.
const MOST_TAXELS: usize = 4096;
/// Most taxels with kinds: 32 MiB twice for each.
const MOST_WITH_KINDS: usize = 2048;
/// Leading eigenvectors that rows start from.
const LEADING: usize = 8;
/// Power iterations before the first row, and before every other one, which begins with the vectors of the last.
const ITERATIONS: [usize; 2] = [30, 3];

impl DesignRows for Greedy {
    fn design(&self, task: &RowTask<'_>) -> Result<Matrix, Refusal> {
        task.check(1 << 20, "so many rows are of no use")?;
        let n = task.expected.taxels();
        within("taxels", n as f64, 1.0, if task.kinds.is_empty() { MOST_TAXELS } else { MOST_WITH_KINDS } as f64)?;
        let mut kinds: Vec<Covariances> = task.gaussians().iter().map(|of| Covariances::new(task, of)).collect();
        let mut weighed = vec![0.0; if kinds.len() > 1 { n * n } else { 0 }];
        let headroom = Headroom::of(task);
        let mut rng = ChaCha8Rng::seed_from_u64(task.seed);
        let mut leading = Leading::new(n, &mut rng);
        let mut rows = Matrix::zeros(task.rows, n);
        for r in 0..task.rows {
            leading.iterate(weigh(&kinds, &mut weighed), ITERATIONS[usize::from(r > 0)]);
            let starts = starts(&leading, n, &mut rng);
            let row = best_row(task, &headroom, starts, SEARCH.1, || Falls::new(&kinds))?;
            kinds.iter_mut().for_each(|kind| kind.observe(&row));
            rows.row_mut(r).copy_from_slice(&row);
            (task.row_found)();
        }
        Ok(rows)
    }
}

/// `n` independent random signs.
pub(super) fn random_signs(n: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    (0..n).map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 }).collect()
}

fn starts(leading: &Leading, n: usize, rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    let signs = |v: &[f64]| v.iter().map(|x| if *x < 0.0 { -1.0 } else { 1.0 }).collect();
    let vectors: Vec<&[f64]> = leading.vectors.chunks_exact(n).collect();
    let mut starts: Vec<Vec<f64>> = vectors.iter().map(|v| signs(v)).collect();
    for pair in vectors.windows(2) {
        let sum: Vec<f64> = pair[0].iter().zip(pair[1]).map(|(a, b)| a + b).collect();
        starts.push(signs(&sum));
    }
    while starts.len() < SEARCH.0 {
        starts.push(random_signs(n, rng));
    }
    starts.truncate(SEARCH.0);
    starts
}

/// The row of the greatest worth that is climbed to from one of `starts`; the first of equals, whatever thread it came
/// from.
///
/// # Errors
/// [`Refusal`] if none keeps to the headroom.
pub(super) fn best_row<W: Worth>(
    task: &RowTask<'_>,
    headroom: &Option<Headroom>,
    starts: Vec<Vec<f64>>,
    sweeps: usize,
    worth: impl Fn() -> W + Sync,
) -> Result<Vec<f64>, Refusal> {
    let climbed = starts.into_par_iter().map(|mut row| {
        let found = climb(&mut worth(), headroom.clone().as_mut(), sweeps, &mut row);
        found.map(|worth| (worth, row))
    });
    let climbed: Vec<Option<(f64, Vec<f64>)>> = climbed.collect();
    let climbed = climbed.into_iter().flatten();
    match climbed.reduce(|a, b| if b.0 > a.0 { b } else { a }) {
        Some((_, row)) => Ok(row),
        None => Err(unreachable_limit(task, headroom.clone())),
    }
}

/// The smallest sum that can be had, for an error.
fn unreachable_limit(task: &RowTask<'_>, headroom: Option<Headroom>) -> Refusal {
    let mut row: Vec<f64> = (0..task.expected.taxels()).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
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
    headroom_unreachable(task.largest_sum.unwrap_or_default(), (square.max(0.0) / task.expected.random_square()).sqrt())
}

/// Σₖ ρₖᵖ⁻¹ Pₖ / tr Cₖ over all `kinds`, in `sum`; P of a single one.
fn weigh<'a>(kinds: &'a [Covariances], sum: &'a mut [f64]) -> &'a [f64] {
    if let [one] = kinds {
        return &one.posterior.covariance;
    }
    let worst = kinds.iter().map(|kind| kind.trace.share(0.0)).fold(0.0, f64::max);
    sum.fill(0.0);
    for kind in kinds {
        axpy(kind.trace.weight(worst), &kind.posterior.covariance, sum);
    }
    sum
}

/// [`worth`] of a row for all kinds.
struct Falls<'a>(Vec<Fall<'a>>);

impl<'a> Falls<'a> {
    fn new(kinds: &'a [Covariances]) -> Self {
        Self(kinds.iter().map(Fall::new).collect())
    }
}

impl Worth for Falls<'_> {
    fn start(&mut self, row: &[f64]) {
        self.0.iter_mut().for_each(|fall| fall.start(row));
    }

    fn worth(&self) -> f64 {
        worth(self.0.iter().map(|fall| (fall.covariances.trace, fall.of((fall.uu, fall.apa)))))
    }

    fn after(&mut self, i: usize, delta: f64) -> f64 {
        worth(self.0.iter().map(|fall| (fall.covariances.trace, fall.of(fall.parts(i, delta)))))
    }

    fn change(&mut self, i: usize, delta: f64) {
        self.0.iter_mut().for_each(|fall| fall.change(i, delta));
    }
}

/// |P a|² / (aᵀP a + σ²) of one kind.
struct Fall<'a> {
    covariances: &'a Covariances,
    /// P a
    u: Vec<f64>,
    /// P² a
    w: Vec<f64>,
    uu: f64,
    apa: f64,
}

impl<'a> Fall<'a> {
    fn new(covariances: &'a Covariances) -> Self {
        let n = covariances.n;
        Self { covariances, u: vec![0.0; n], w: vec![0.0; n], uu: 0.0, apa: 0.0 }
    }

    fn parts(&self, i: usize, delta: f64) -> (f64, f64) {
        let diagonal = i * (self.covariances.n + 1);
        (
            self.uu + delta * (2.0 * self.w[i] + delta * self.covariances.square[diagonal]),
            self.apa + delta * (2.0 * self.u[i] + delta * self.covariances.posterior.covariance[diagonal]),
        )
    }

    fn of(&self, (uu, apa): (f64, f64)) -> f64 {
        uu / (apa.max(0.0) + self.covariances.variance)
    }

    fn start(&mut self, row: &[f64]) {
        adjoint(&self.covariances.posterior.covariance, row, &mut self.u);
        adjoint(&self.covariances.square, row, &mut self.w);
        (self.uu, self.apa) = (dot(&self.u, &self.u), dot(row, &self.u));
    }

    fn change(&mut self, i: usize, delta: f64) {
        let n = self.covariances.n;
        (self.uu, self.apa) = self.parts(i, delta);
        axpy(delta, &self.covariances.posterior.covariance[i * n..(i + 1) * n], &mut self.u);
        axpy(delta, &self.covariances.square[i * n..(i + 1) * n], &mut self.w);
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
        Self { n, vectors: (0..count * n).map(|_| rng.random::<f64>() - 0.5).collect(), products: vec![0.0; count * n] }
    }

    fn iterate(&mut self, p: &[f64], iterations: usize) {
        let n = self.n;
        for _ in 0..iterations {
            let pairs = self.vectors.par_chunks_exact(n).zip(self.products.par_chunks_exact_mut(n));
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

/// Worth of a row, kept up to date while single levels change.
pub(super) trait Worth {
    /// Takes `row` as it is.
    fn start(&mut self, row: &[f64]);
    /// The worth of the row.
    fn worth(&self) -> f64;
    /// Its worth after level i has changed by `delta`.
    fn after(&mut self, i: usize, delta: f64) -> f64;
    /// Changes level i by `delta`.
    fn change(&mut self, i: usize, delta: f64);
}

/// Least gain of worth, as a share of it, for which a level is changed: rounding makes no progress.
const LEAST_GAIN: f64 = 1e-9;

/// Turns single signs of `row` while its worth grows, at most `sweeps` times through all of them. A row whose sum is
/// too large is brought within `headroom` first, by the turns that cost the least worth for what they take off the sum;
/// `None` when that cannot be done.
fn climb(worth: &mut impl Worth, mut headroom: Option<&mut Headroom>, sweeps: usize, row: &mut [f64]) -> Option<f64> {
    worth.start(row);
    if let Some(headroom) = headroom.as_deref_mut() {
        headroom.start(row);
        settle(worth, headroom, row)?;
    }
    for _ in 0..sweeps {
        let mut changed = false;
        for (i, value) in row.iter_mut().enumerate() {
            let (now, delta) = (worth.worth(), -2.0 * *value);
            if headroom.as_ref().is_some_and(|h| h.after(i, delta) > h.limit()) {
                continue;
            }
            if worth.after(i, delta) > now + LEAST_GAIN * now.abs() {
                worth.change(i, delta);
                if let Some(headroom) = headroom.as_deref_mut() {
                    headroom.change(i, delta);
                }
                *value = -*value;
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    Some(worth.worth())
}

/// Brings `row` within `headroom`.
fn settle(worth: &mut impl Worth, headroom: &mut Headroom, row: &mut [f64]) -> Option<()> {
    while !headroom.kept() {
        let now = worth.worth();
        let (mut least, mut best) = (f64::INFINITY, None);
        for (i, value) in row.iter().enumerate() {
            let delta = -2.0 * value;
            let taken = headroom.square() - headroom.after(i, delta);
            // less is rounding
            if taken <= LEAST_GAIN * headroom.square() {
                continue;
            }
            let cost = (now - worth.after(i, delta)) / taken;
            if cost < least {
                (least, best) = (cost, Some((i, delta)));
            }
        }
        let (i, delta) = best?;
        worth.change(i, delta);
        headroom.change(i, delta);
        row[i] += delta;
    }
    Some(())
}

/// Posterior covariance P of Gaussian images, and its square.
#[derive(Debug, Clone)]
struct Covariances {
    n: usize,
    posterior: GaussianPosterior,
    /// P², N × N.
    square: Vec<f64>,
    /// tr P.
    trace: Trace,
    /// σ².
    variance: f64,
    w: Vec<f64>,
}

impl Covariances {
    /// Before any measurement of the images `of`: P is their covariance.
    fn new(task: &RowTask<'_>, of: &Expected) -> Self {
        let (n, covariance) = (of.taxels(), of.covariance());
        let p = covariance.view().values().to_vec();
        let mut square = vec![0.0; n * n];
        // P is symmetric: (P²)ᵢⱼ is the product of two rows
        square.par_chunks_exact_mut(n).enumerate().for_each(|(i, out)| {
            let row = &p[i * n..(i + 1) * n];
            out.iter_mut().zip(p.chunks_exact(n)).for_each(|(out, other)| *out = dot(row, other));
        });
        let (trace, variance) = (Trace::new(of.variance()), task.variance(of));
        Self { n, posterior: GaussianPosterior::new(p, n), square, trace, variance, w: vec![0.0; n] }
    }

    /// Measures the row `a`.
    fn observe(&mut self, a: &[f64]) {
        let d = self.posterior.project(a) + self.variance;
        adjoint(&self.posterior.covariance, &self.posterior.product, &mut self.w);
        let (u, w) = (&self.posterior.product, &self.w);
        let uu = dot(u, u) / (d * d);
        let rows = self.square.par_chunks_exact_mut(self.n);
        rows.enumerate().with_min_len(64).for_each(|(i, square)| {
            axpy(uu * u[i] - w[i] / d, u, square);
            axpy(-u[i] / d, w, square);
        });
        self.posterior.lower(d);
        self.trace.lower(self.posterior.variances().sum());
    }
}

/// Share of the expected images' variance that remains after the measurements `rows` (M × N): the trace of the
/// posterior covariance divided by that of the prior.
///
/// tr P = tr C − ‖L⁻¹ A C‖², L Lᵀ = A C Aᵀ + σ² I. The cost is O(M²N) plus M products with C; for separable images such
/// a product costs O(N) times the sides of the grid.
///
/// # Errors
/// [`Refusal`] if the task is out of range, or the rows have another number of taxels.
pub fn posterior_trace(task: &RowTask<'_>, rows: &Matrix) -> Result<f64, Refusal> {
    task.check(usize::MAX, "")?;
    let expected = task.expected;
    let (m, n) = (rows.nrows(), rows.ncols());
    if n != expected.taxels() {
        let [rows, cols] = expected.shape();
        return Err(other_grid(n, rows, cols));
    }
    let mut cross = vec![0.0; m * n];
    cross.par_chunks_exact_mut(n).enumerate().for_each(|(r, out)| expected.times_covariance(rows.row(r), out));
    let row = |r: usize| &cross[r * n..(r + 1) * n];
    let mut system = DMatrix::from_fn(m, m, |i, j| if i < j { 0.0 } else { dot(row(i), rows.row(j)) });
    // rounding of the sums is what a noise of this size is lost in
    let floor = f64::EPSILON * m as f64 * (0..m).map(|i| system[(i, i)]).fold(0.0, f64::max);
    (0..m).for_each(|i| system[(i, i)] += task.variance(expected).max(floor));
    let before = expected.variance();
    // only the lower triangle is read
    let Some(factor) = system.cholesky() else {
        let mut covariances = Covariances::new(task, expected);
        (0..m).for_each(|r| covariances.observe(rows.row(r)));
        return Ok(covariances.trace.share(0.0));
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
    use super::*;
    use crate::recover::Gaussian;
    use crate::rows::expected::Tolerances;

    fn hadamard(n: usize, r: usize, c: usize) -> f64 {
        debug_assert!(n.is_power_of_two());
        if (r & c).count_ones().is_multiple_of(2) { 1.0 } else { -1.0 }
    }

    /// Where the eigenvectors are rows of a Hadamard matrix, they are the best rows of all, strongest first.
    #[test]
    fn eigenvectors_of_signs_are_found_in_their_order() {
        let n = 16;
        let variances: Vec<f64> = (0..n).map(|k| 0.7_f64.powf(((k * 7 + 3) % n) as f64)).collect();
        let mut c = Matrix::zeros(n, n);
        for i in 0..n {
            for j in 0..n {
                c.row_mut(i)[j] = (0..n).map(|k| variances[k] * hadamard(n, k, i) * hadamard(n, k, j) / n as f64).sum();
            }
        }
        let prior = Gaussian::new(vec![0.0; n], c).unwrap();
        let expected = Expected::like(&prior, [4, 4], Tolerances::default()).unwrap();
        let task = RowTask { noise: 0.01, ..RowTask::new(8, &expected) };
        let rows = Greedy.design(&task).unwrap();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| variances[*b].total_cmp(&variances[*a]));
        for (r, &k) in order[..8].iter().enumerate() {
            let overlap: f64 = (0..n).map(|i| rows.row(r)[i] * hadamard(n, k, i)).sum();
            assert!((overlap.abs() - n as f64).abs() < 1e-9, "row {r} is not eigenvector {k}: {overlap}");
        }
        // every row then removes its own variance but for the noise: λ → λ σ²/(N λ + σ²)
        let (variance, all) = (task.variance(&expected), variances.iter().sum::<f64>());
        let left: f64 = order
            .iter()
            .enumerate()
            .map(|(r, &k)| {
                let v = variances[k];
                if r < 8 { v * variance / (n as f64 * v + variance) } else { v }
            })
            .sum();
        // `like` raises the diagonal by 1e-9 of its mean
        assert!((posterior_trace(&task, &rows).unwrap() - left / all).abs() < 1e-7);
    }

    /// Least Σ λ/(1 + λ e) over energies e ≥ 0 of sum `energy`: e = (μ − 1/λ)₊, by bisection of μ.
    fn water_filling(eigen: &[f64], energy: f64) -> f64 {
        let spent = |mu: f64| eigen.iter().map(|l| (mu - 1.0 / l.max(1e-300)).max(0.0)).sum::<f64>();
        let (mut low, mut high) = (0.0, 1e9);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if spent(middle) < energy { low = middle } else { high = middle }
        }
        eigen.iter().map(|l| l / (1.0 + l * (low - 1.0 / l.max(1e-300)).max(0.0))).sum()
    }

    /// No rows of energy N each leave less than water-filling over the eigenvectors does, and greedy signs come within
    /// a fifth of what it explains.
    #[test]
    fn signs_come_near_the_bound() {
        let expected = Expected::smooth([8, 8], 1.5).unwrap();
        let task = RowTask::new(12, &expected);
        let rows = Greedy.design(&task).unwrap();
        let c = expected.covariance();
        let dense = nalgebra::DMatrix::from_row_slice(64, 64, c.view().values());
        let eigen: Vec<f64> = dense.symmetric_eigenvalues().iter().map(|v| v.max(0.0)).collect();
        let bound = water_filling(&eigen, 12.0 * 64.0 / task.variance(&expected)) / 64.0;
        let left = posterior_trace(&task, &rows).unwrap();
        assert!(left >= bound, "{left} below the bound {bound}");
        assert!(1.0 - left > 0.8 * (1.0 - bound), "{left}, bound {bound}");
    }

    /// Against the batch form of the posterior: P = C − C Aᵀ (A C Aᵀ + σ² I)⁻¹ A C.
    #[test]
    fn row_by_row_is_all_at_once() {
        let expected = Expected::smooth([4, 5], 1.3).unwrap();
        let task = RowTask::new(6, &expected);
        let a = DMatrix::from_fn(6, 20, |i, j| if (i * 7 + j * j + i * j) % 3 == 0 { -1.0 } else { 1.0 });
        let c = DMatrix::from_row_slice(20, 20, expected.covariance().view().values());
        let system = &a * &c * a.transpose() + DMatrix::identity(6, 6) * task.variance(&expected);
        let left = &c - &c * a.transpose() * system.try_inverse().unwrap() * &a * &c;
        let mut covariances = Covariances::new(&task, &expected);
        let rows = Matrix::from_rows(6, 20, a.transpose().as_slice().to_vec()).unwrap();
        (0..6).for_each(|r| covariances.observe(rows.row(r)));
        let squared = &left * &left;
        for i in 0..20 {
            for j in 0..20 {
                // a few hundred products of numbers up to 1, and up to 10 in the square
                assert!((covariances.posterior.covariance[i * 20 + j] - left[(i, j)]).abs() < 1e-12);
                assert!((covariances.square[i * 20 + j] - squared[(i, j)]).abs() < 1e-11);
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
