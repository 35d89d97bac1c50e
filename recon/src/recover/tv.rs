//! Total variation with non-negativity.

use crate::checks::{not_converged, other_columns};
use crate::kernels::{axpy, dot, norm};
use crate::matrix::MatrixView;
use crate::operator::LinearOperator as _;
use crate::problem::{Problem, Recover, Solution, Workspace, divide_into, operator_scale, power_of_two};
use crate::recover::prior::{Penalty, Stopping};
use spts_input::Refusal;

/// Non-negative image with small total variation:
///
/// min ‖y − A x‖² / (2M) + α Σ |xᵢ − xⱼ| subject to x ≥ 0. The sum is over horizontal and vertical neighbours of a
/// grid.
///
/// Primal–dual hybrid gradient on min_{x ≥ 0} max_{q, |p| ≤ λ} ⟨A x − y, q⟩ − ½ ‖q‖² + ⟨∇x, p⟩ with λ = M α. It
/// restarts from its running mean whenever that has reduced the gap enough, and rebalances primal and dual steps at
/// restarts. It stops when the duality gap is at most `stopping.tol` · ‖y‖² / (2M). The dual objective is evaluated on
/// 0 ≤ x ≤ R, where R is twice the largest x plus ‖y‖/‖A‖. The solution stays well inside this bound, so by convexity
/// it is also optimal without the bound.
/// Source: A. Chambolle, T. Pock, J. Math. Imaging Vis. 40 (2011) 120; restarts: D. Applegate et al., "Practical
/// large-scale linear programming using primal-dual hybrid gradient", NeurIPS 2021.
///
/// ```
/// use spts_recon::recover::{Penalty, Tv};
/// use spts_recon::{Matrix, Problem, Recover as _, Workspace};
///
/// // the first and the last of four pixels in a row are measured
/// let a = Matrix::from_rows(2, 4, vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])?;
/// let tv = Tv::new(1, 4, Penalty::Relative(1e-3))?;
/// let solution = tv.recover(&Problem::new(a.view(), &[2.0, 2.0])?, &mut Workspace::default())?;
/// let mut image = [0.0; 4];
/// solution.scatter(&mut image);
/// assert!(image.iter().all(|x| (x - 2.0).abs() < 0.05), "the smoothest image is constant");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tv {
    grid: Grid,
    alpha: Penalty,
    /// Largest duality gap relative to ‖y‖² / (2M), and largest number of iterations; default `STOPPING`.
    pub stopping: Stopping,
}

/// Iterations between two looks at the gap.
const CHECK: usize = 16;
/// A restart pays when the gap has fallen to this share.
const ENOUGH: f64 = 0.2;
/// A run longer than this share of all iterations is restarted anyway.
const LONG: f64 = 0.3;
/// Rounds of the power iteration for ‖A‖.
const POWER_ROUNDS: usize = 20;
/// What the power iteration may have missed of ‖A‖.
const POWER_MARGIN: f64 = 1.05;
/// ‖∇‖² of a grid is below 8: every pixel has at most four neighbours.
const GRADIENT_SQUARE: f64 = 8.0;

impl Tv {
    /// Default of `stopping`.
    pub(crate) const STOPPING: Stopping = Stopping { tol: 1e-6, max_iter: 200_000 };

    /// Images of `rows` × `cols` pixels (row-major) with the penalty `alpha`.
    ///
    /// # Errors
    /// [`Refusal`] if `alpha` is outside its range.
    pub fn new(rows: usize, cols: usize, alpha: Penalty) -> Result<Self, Refusal> {
        Ok(Self { grid: Grid { rows, cols }, alpha: alpha.checked()?, stopping: Self::STOPPING })
    }
}

impl Recover for Tv {
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), Refusal> {
        let (a, y) = (problem.matrix(), problem.y());
        if a.ncols() != self.grid.pixels() {
            return Err(other_columns(a.ncols(), self.grid.pixels()));
        }
        let (a_power, y_power) = (operator_scale(a)?, power_of_two(y));
        let work = workspace.scratch::<TvScratch>();
        divide_into(a.values(), a_power, &mut work.operator);
        divide_into(y, y_power, &mut work.y);
        let y_norm = norm(&work.y);
        if y_norm == 0.0 {
            solution.set_zero(0.0);
            return Ok(());
        }
        let mut hybrid = Hybrid::new(a.nrows(), self.grid, y_norm, work);
        let a_norm = hybrid.normalise();
        let measurements = a.nrows() as f64;
        // λ in units of the normalised problem: divided by ‖A‖ ‖y‖
        let penalty = match self.alpha {
            Penalty::Absolute(alpha) => measurements * alpha / (a_power * a_norm) / (y_power * y_norm),
            Penalty::Relative(share) => share * hybrid.largest_correlation(),
        };
        hybrid.penalty = penalty.min(f64::MAX);
        hybrid.run(self.stopping)?;
        let residual_norm = hybrid.residual_norm() * y_norm * y_power;
        let x_scale = (y_norm * y_power) / (a_norm * a_power);
        solution.set_dense(&hybrid.work.mean.x, x_scale, residual_norm)
    }
}

/// A primal point with its duals.
#[derive(Debug, Default, Clone)]
struct Point {
    x: Vec<f64>,
    q: Vec<f64>,
    p: Vec<f64>,
}

impl Point {
    fn zero(&mut self, pixels: usize, measurements: usize, edges: usize) {
        for (v, len) in [(&mut self.x, pixels), (&mut self.q, measurements), (&mut self.p, edges)] {
            v.clear();
            v.resize(len, 0.0);
        }
    }

    fn copy_from(&mut self, other: &Self) {
        self.x.copy_from_slice(&other.x);
        self.q.copy_from_slice(&other.q);
        self.p.copy_from_slice(&other.p);
    }

    /// Running mean: self + (other − self)·weight.
    fn approach(&mut self, other: &Self, weight: f64) {
        for (mine, theirs) in [(&mut self.x, &other.x), (&mut self.q, &other.q), (&mut self.p, &other.p)] {
            for (m, t) in mine.iter_mut().zip(theirs) {
                *m += weight * (t - *m);
            }
        }
    }
}

/// Memory of the iteration.
#[derive(Debug, Default)]
struct TvScratch {
    /// The operator divided by its norm, M × N.
    operator: Vec<f64>,
    /// The measurements divided by their norm.
    y: Vec<f64>,
    now: Point,
    mean: Point,
    start: Point,
    /// 2x⁺ − x
    ahead: Vec<f64>,
    slope: Vec<f64>,
    image: Vec<f64>,
    differences: Vec<f64>,
}

struct Hybrid<'w> {
    m: usize,
    grid: Grid,
    /// λ
    penalty: f64,
    /// Ratio of dual to primal step.
    balance: f64,
    work: &'w mut TvScratch,
}

impl<'w> Hybrid<'w> {
    fn new(m: usize, grid: Grid, y_norm: f64, work: &'w mut TvScratch) -> Self {
        work.y.iter_mut().for_each(|v| *v /= y_norm);
        for point in [&mut work.now, &mut work.mean, &mut work.start] {
            point.zero(grid.pixels(), m, grid.edges());
        }
        work.slope.resize(grid.pixels(), 0.0);
        work.image.resize(m, 0.0);
        work.differences.resize(grid.edges(), 0.0);
        Self { m, grid, penalty: 0.0, balance: 1.0, work }
    }

    /// Divides the operator by its largest singular value, which is returned (1 for a zero operator).
    fn normalise(&mut self) -> f64 {
        let (m, n) = (self.m, self.grid.pixels());
        let work = &mut *self.work;
        // a direction that no symmetry of the operator is likely to be orthogonal to
        work.slope.iter_mut().zip(1_u32..).for_each(|(v, i)| *v = 1.0 + f64::from(i).sin());
        let mut largest = 0.0;
        for _ in 0..POWER_ROUNDS {
            let length = norm(&work.slope);
            if length == 0.0 {
                break;
            }
            work.slope.iter_mut().for_each(|v| *v /= length);
            apply(&work.operator, n, &work.slope, &mut work.image);
            largest = norm(&work.image);
            adjoint(&work.operator, m, n, &work.image, &mut work.slope);
        }
        let largest = if largest > 0.0 { largest * POWER_MARGIN } else { 1.0 };
        work.operator.iter_mut().for_each(|v| *v /= largest);
        largest
    }

    fn largest_correlation(&mut self) -> f64 {
        let work = &mut *self.work;
        adjoint(&work.operator, self.m, self.grid.pixels(), &work.y, &mut work.slope);
        work.slope.iter().fold(0.0, |m: f64, v| m.max(v.abs()))
    }

    /// Leaves the answer in `mean`.
    fn run(&mut self, Stopping { tol, max_iter }: Stopping) -> Result<(), Refusal> {
        let (mut run, mut at_restart) = (0_usize, f64::INFINITY);
        let mut iteration = 0;
        loop {
            let (of_now, of_mean) = (self.gap(false), self.gap(true));
            let best = of_now.min(of_mean);
            let long = run > CHECK && number(run) > LONG * number(iteration);
            if run == 0 || best <= tol || best <= ENOUGH * at_restart || long || iteration >= max_iter {
                if of_now <= of_mean {
                    self.work.mean.copy_from(&self.work.now);
                } else {
                    self.work.now.copy_from(&self.work.mean);
                }
                if best <= tol {
                    return Ok(());
                }
                if iteration >= max_iter {
                    return Err(not_converged(iteration, best, tol));
                }
                self.rebalance();
                self.work.start.copy_from(&self.work.now);
                (run, at_restart) = (0, best);
            }
            for _ in 0..CHECK {
                run += 1;
                iteration += 1;
                self.step();
                self.work.mean.approach(&self.work.now, 1.0 / number(run));
            }
        }
    }

    /// The steps follow the ways that dual and primal have gone since the last restart.
    fn rebalance(&mut self) {
        let way = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        let work = &*self.work;
        let primal = way(&work.now.x, &work.start.x).sqrt();
        let dual = (way(&work.now.q, &work.start.q) + way(&work.now.p, &work.start.p)).sqrt();
        if primal > 0.0 && dual > 0.0 {
            // half way in the logarithm, so that one odd run does not upset the balance
            self.balance = (self.balance * dual / primal).sqrt().clamp(1e-4, 1e4);
        }
    }

    fn step(&mut self) {
        let (m, n, work) = (self.m, self.grid.pixels(), &mut *self.work);
        // ‖A‖ = 1: each block of the dual takes half of what τ σ ‖K‖² ≤ 1 leaves
        let primal_step = 1.0 / self.balance;
        let (q_step, p_step) = (0.5 * self.balance, 0.5 * self.balance / GRADIENT_SQUARE);
        adjoint(&work.operator, m, n, &work.now.q, &mut work.slope);
        self.grid.add_adjoint(&work.now.p, &mut work.slope);
        work.ahead.clear();
        for (x, &slope) in work.now.x.iter_mut().zip(&work.slope) {
            let new = (*x - primal_step * slope).max(0.0);
            work.ahead.push(2.0 * new - *x);
            *x = new;
        }
        apply(&work.operator, n, &work.ahead, &mut work.image);
        for ((q, &image), &y) in work.now.q.iter_mut().zip(&work.image).zip(&work.y) {
            *q = (*q + q_step * (image - y)) / (1.0 + q_step);
        }
        self.grid.differences(&work.ahead, &mut work.differences);
        for (p, &d) in work.now.p.iter_mut().zip(&work.differences) {
            *p = (*p + p_step * d).clamp(-self.penalty, self.penalty);
        }
    }

    /// Primal minus dual objective over ½ ‖y‖² = ½.
    fn gap(&mut self, of_mean: bool) -> f64 {
        let (m, n, work) = (self.m, self.grid.pixels(), &mut *self.work);
        let point = if of_mean { &work.mean } else { &work.now };
        apply(&work.operator, n, &point.x, &mut work.image);
        axpy(-1.0, &work.y, &mut work.image);
        self.grid.differences(&point.x, &mut work.differences);
        let variation: f64 = work.differences.iter().map(|d| d.abs()).sum();
        let primal = 0.5 * dot(&work.image, &work.image) + self.penalty * variation;
        adjoint(&work.operator, m, n, &point.q, &mut work.slope);
        self.grid.add_adjoint(&point.p, &mut work.slope);
        let bound = 2.0 * point.x.iter().fold(0.0_f64, |m, v| m.max(*v)) + 1.0;
        let below: f64 = work.slope.iter().map(|v| v.min(0.0)).sum();
        let dual = bound * below - 0.5 * dot(&point.q, &point.q) - dot(&point.q, &work.y);
        2.0 * (primal - dual)
    }

    /// ‖y − A x‖ of the answer.
    fn residual_norm(&mut self) -> f64 {
        let work = &mut *self.work;
        apply(&work.operator, self.grid.pixels(), &work.mean.x, &mut work.image);
        axpy(-1.0, &work.y, &mut work.image);
        norm(&work.image)
    }
}

fn apply(operator: &[f64], n: usize, x: &[f64], image: &mut [f64]) {
    for (out, row) in image.iter_mut().zip(operator.chunks_exact(n)) {
        *out = dot(row, x);
    }
}

fn adjoint(operator: &[f64], m: usize, n: usize, image: &[f64], x: &mut [f64]) {
    if let Ok(operator) = MatrixView::new(m, n, operator) {
        operator.apply_adjoint(image, x);
    }
}

/// A count of iterations as a number.
fn number(count: usize) -> f64 {
    count as f64
}

/// Grid of pixels, row-major.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Grid {
    pub(super) rows: usize,
    pub(super) cols: usize,
}

impl Grid {
    /// Number of pixels.
    pub(super) fn pixels(self) -> usize {
        self.rows * self.cols
    }

    /// Number of pairs of neighbours: first the horizontal ones, row by row, then the vertical ones.
    pub(super) fn edges(self) -> usize {
        self.rows * self.cols.saturating_sub(1) + self.rows.saturating_sub(1) * self.cols
    }

    /// d = ∇x: later minus earlier pixel of every pair.
    pub(super) fn differences(self, x: &[f64], d: &mut [f64]) {
        let (across, down) = d.split_at_mut(self.rows * self.cols.saturating_sub(1));
        if self.cols > 1 {
            for (row, d) in x.chunks_exact(self.cols).zip(across.chunks_exact_mut(self.cols - 1)) {
                for (d, pair) in d.iter_mut().zip(row.windows(2)) {
                    *d = pair[1] - pair[0];
                }
            }
        }
        for ((d, above), below) in down.iter_mut().zip(x).zip(&x[self.cols.min(x.len())..]) {
            *d = below - above;
        }
    }

    /// x += ∇ᵀ p.
    pub(super) fn add_adjoint(self, p: &[f64], x: &mut [f64]) {
        let (across, down) = p.split_at(self.rows * self.cols.saturating_sub(1));
        if self.cols > 1 {
            for (row, p) in x.chunks_exact_mut(self.cols).zip(across.chunks_exact(self.cols - 1)) {
                for (i, &p) in p.iter().enumerate() {
                    row[i] -= p;
                    row[i + 1] += p;
                }
            }
        }
        for (i, &p) in down.iter().enumerate() {
            x[i] -= p;
            x[i + self.cols] += p;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn differences_of_a_small_grid() {
        let grid = Grid { rows: 2, cols: 3 };
        let mut d = vec![0.0; grid.edges()];
        grid.differences(&[1.0, 2.0, 4.0, 8.0, 16.0, 32.0], &mut d);
        assert_eq!(d, [1.0, 2.0, 8.0, 16.0, 7.0, 14.0, 28.0]);
    }

    proptest! {
        #[test]
        fn adjoint(rows in 1_usize..5, cols in 1_usize..5, seed in prop::collection::vec(-1.0..1.0, 60)) {
            let grid = Grid { rows, cols };
            let (x, p) = (&seed[..grid.pixels()], &seed[20..20 + grid.edges()]);
            let (mut d, mut back) = (vec![0.0; grid.edges()], vec![0.0; grid.pixels()]);
            grid.differences(x, &mut d);
            grid.add_adjoint(p, &mut back);
            let lhs: f64 = d.iter().zip(p).map(|(a, b)| a * b).sum();
            let rhs: f64 = x.iter().zip(&back).map(|(a, b)| a * b).sum();
            // at most 24 differences of numbers below 1, each rounded a handful of times
            prop_assert!((lhs - rhs).abs() <= 24.0 * 8.0 * f64::EPSILON);
        }
    }
}
