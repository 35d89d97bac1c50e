//! Non-negative lasso.

use crate::checks::not_converged;
use crate::cholesky::{self, NotPositiveDefinite};
use crate::kernels::{axpy, dot, norm};
use crate::problem::{Problem, Recover, Solution, Workspace, divide_into, operator_scale, power_of_two};
use crate::recover::prior::{Penalty, Stopping};
use spts_input::Refusal;

/// Non-negative lasso:
///
/// min ‖y − A w‖² / (2M) + α Σ wₖ subject to w ≥ 0, where α = `alpha` is the parameter of scikit-learn's
/// `Lasso(positive=True)`.
///
/// Coordinate descent on a working set, which the worst violators of the optimality conditions join. Between sweeps,
/// Newton steps on the non-zero entries, cut where one of them reaches zero, make the result exact. It stops when the
/// duality gap is at most `stopping.tol` · ‖y‖² / (2M). The feasible dual point is the residual, scaled down until no
/// column correlates with it by more than the penalty. Penalties below 1e-12 of the one that makes the solution zero
/// are raised to that value.
/// Source: J. Friedman, T. Hastie, R. Tibshirani, J. Stat. Softw. 33 (2010) 1, §2; gap and working set: M. Massias,
/// A. Gramfort, J. Salmon, "Celer", ICML 2018.
///
/// ```
/// use spts_recon::recover::{NnLasso, Penalty};
/// use spts_recon::{Matrix, Problem, Recover as _, Workspace};
///
/// let a = Matrix::from_rows(2, 3, vec![1.0, 0.0, 0.6, 0.0, 1.0, 0.8])?;
/// let lasso = NnLasso::new(Penalty::Relative(0.01))?;
/// let solution = lasso.recover(&Problem::new(a.view(), &[0.6, 0.8])?, &mut Workspace::default())?;
/// assert_eq!(solution.support, [2], "one atom explains both measurements");
/// assert!((solution.coefficients[0] - 0.99).abs() < 1e-6, "shrunk by the penalty");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NnLasso {
    alpha: Penalty,
    normalise: bool,
    /// Largest duality gap relative to ‖y‖² / (2M), and largest number of sweeps; default `STOPPING`.
    pub stopping: Stopping,
}

impl NnLasso {
    /// Default of `stopping`.
    pub(crate) const STOPPING: Stopping = Stopping { tol: 1e-8, max_iter: 10_000 };

    /// A lasso with the penalty `alpha`.
    ///
    /// # Errors
    /// [`Refusal`] if `alpha` is outside its range.
    pub fn new(alpha: Penalty) -> Result<Self, Refusal> {
        Ok(Self { alpha: alpha.checked()?, normalise: false, stopping: Self::STOPPING })
    }

    /// The same with columns scaled to unit length first. Coefficients belong to the columns as given.
    pub fn with_normalised_columns(self) -> Self {
        Self { normalise: true, ..self }
    }

    /// The problem near 1, and what its coefficients must be multiplied by.
    fn set_up<'w>(&self, problem: &Problem<'_>, workspace: &'w mut Workspace) -> Result<(Descent<'w>, f64), Refusal> {
        let (a, y) = (problem.matrix(), problem.y());
        let (a_scale, y_scale) = (operator_scale(a)?, power_of_two(y));
        let m = a.nrows();
        let work = workspace.scratch::<NnLassoScratch>();
        a.copy_columns(&mut work.columns);
        work.columns.iter_mut().for_each(|v| *v /= a_scale);
        work.lengths.clear();
        work.lengths.extend(work.columns.chunks_exact(m).map(norm));
        if self.normalise {
            for (column, &length) in work.columns.chunks_exact_mut(m).zip(&work.lengths) {
                if length > 0.0 {
                    column.iter_mut().for_each(|v| *v /= length);
                }
            }
        } else {
            work.lengths.fill(1.0);
        }
        divide_into(y, y_scale, &mut work.y);
        let x_scale = y_scale / a_scale;
        let mut descent = Descent::new(m, work);
        descent.set_penalty(self.penalty(m, a_scale, x_scale, descent.largest()));
        Ok((descent, x_scale))
    }

    /// λ = M α in the units of the scaled problem.
    fn penalty(&self, m: usize, a_scale: f64, x_scale: f64, largest: f64) -> f64 {
        match self.alpha {
            Penalty::Absolute(alpha) => {
                // the objective was divided by a_scale² x_scale²; unit columns leave the scale of A to their
                // coefficients
                let (of_a, of_x) = if self.normalise { (1.0, x_scale * a_scale) } else { (a_scale, x_scale) };
                alpha * m as f64 / of_x / of_a / of_a
            }
            Penalty::Relative(share) => share * largest,
        }
    }
}

impl Recover for NnLasso {
    fn recover_into(
        &self,
        problem: &Problem<'_>,
        workspace: &mut Workspace,
        solution: &mut Solution,
    ) -> Result<(), Refusal> {
        let (mut descent, x_scale) = self.set_up(problem, workspace)?;
        descent.run(self.stopping)?;
        descent.write(x_scale, power_of_two(problem.y()), solution)
    }
}

/// Smallest penalty, as a share of the one that makes the answer zero: rounding hides what is below.
const SMALLEST_PENALTY: f64 = 1e-12;
/// Sweeps between two minimisations on a face.
const SWEEPS: usize = 2;
/// Minimisations on a face for one working set at most.
const FACES: usize = 20;
/// A working set is solved when its conditions hold to this share of the largest correlation with `y`.
const SOLVED: f64 = 1e-13;

/// Memory of the descent.
#[derive(Debug, Default)]
pub(super) struct NnLassoScratch {
    /// Columns of the scaled operator, one after the other, K × M.
    pub(super) columns: Vec<f64>,
    /// Divisor that scales every column to unit length, or 1.
    pub(super) lengths: Vec<f64>,
    /// Squared length of every column.
    curvature: Vec<f64>,
    pub(super) y: Vec<f64>,
    x: Vec<f64>,
    residual: Vec<f64>,
    /// Minus the slope of the smooth part: aₖᵀ r.
    correlation: Vec<f64>,
    working: Vec<usize>,
    free: Vec<usize>,
    gram: Vec<f64>,
    point: Vec<f64>,
}

/// Minimises ½ ‖y − A x‖² + λ Σ x over x ≥ 0.
pub(super) struct Descent<'w> {
    m: usize,
    /// λ
    penalty: f64,
    /// Largest correlation of a column with y. The solution is zero if λ is at least this.
    largest: f64,
    work: &'w mut NnLassoScratch,
}

impl<'w> Descent<'w> {
    /// Descent from zero on the problem that the buffers hold, M measurements, without a penalty yet.
    pub(super) fn new(m: usize, work: &'w mut NnLassoScratch) -> Self {
        work.x.clear();
        work.x.resize(work.lengths.len(), 0.0);
        work.correlation.resize(work.lengths.len(), 0.0);
        let columns = work.columns.chunks_exact(m);
        let largest = columns.map(|c| dot(c, &work.y)).fold(0.0, f64::max);
        Self { m, penalty: 0.0, largest, work }
    }

    /// Largest correlation of a column with y, at least 0.
    pub(super) fn largest(&self) -> f64 {
        self.largest
    }

    fn column(&self, k: usize) -> &[f64] {
        &self.work.columns[k * self.m..(k + 1) * self.m]
    }

    /// Takes up the penalty λ.
    pub(super) fn set_penalty(&mut self, penalty: f64) {
        self.penalty = penalty.clamp(SMALLEST_PENALTY * self.largest, f64::MAX);
        let columns = self.work.columns.chunks_exact(self.m);
        self.work.curvature.clear();
        self.work.curvature.extend(columns.map(|c| dot(c, c)));
        self.refresh();
    }

    pub(super) fn run(&mut self, Stopping { tol, max_iter }: Stopping) -> Result<(), Refusal> {
        if self.largest == 0.0 {
            // no column points towards y
            return Ok(());
        }
        let mut iterations = 0;
        loop {
            let gap = self.gap();
            if gap <= tol {
                return Ok(());
            }
            if iterations >= max_iter {
                return Err(not_converged(iterations, gap, tol));
            }
            self.choose_working_set();
            iterations += self.solve_working_set();
            self.refresh();
        }
    }

    /// r = y − A x, computed afresh.
    fn refresh(&mut self) {
        let work = &mut *self.work;
        work.residual.clear();
        work.residual.extend_from_slice(&work.y);
        for (column, &x) in work.columns.chunks_exact(self.m).zip(&work.x) {
            if x != 0.0 {
                axpy(-x, column, &mut work.residual);
            }
        }
    }

    /// Primal minus dual objective over ½ ‖y‖², with s·r as the dual point.
    fn gap(&mut self) -> f64 {
        let work = &mut *self.work;
        let mut steepest = 0.0_f64;
        for (k, column) in work.columns.chunks_exact(self.m).enumerate() {
            work.correlation[k] = dot(column, &work.residual);
            steepest = steepest.max(work.correlation[k]);
        }
        let whole = 0.5 * dot(&work.y, &work.y);
        if whole == 0.0 {
            return if work.x.iter().all(|x| *x == 0.0) { 0.0 } else { f64::INFINITY };
        }
        let shrink = if steepest > self.penalty { self.penalty / steepest } else { 1.0 };
        let primal = 0.5 * dot(&work.residual, &work.residual) + self.penalty * work.x.iter().sum::<f64>();
        let rest: f64 = work.y.iter().zip(&work.residual).map(|(y, r)| (y - shrink * r).powi(2)).sum();
        let dual = whole - 0.5 * rest;
        ((primal - dual) / whole).max(0.0)
    }

    /// Entries above zero and the worst violators, few enough to keep the Newton steps well posed.
    fn choose_working_set(&mut self) {
        let work = &mut *self.work;
        work.working.clear();
        work.working.extend((0..work.x.len()).filter(|&k| work.x[k] > 0.0));
        let room = 1 + work.working.len() / 2;
        let mut violators = std::mem::take(&mut work.free);
        violators.clear();
        violators.extend(
            (0..work.x.len())
                .filter(|&k| work.x[k] == 0.0 && work.correlation[k] > self.penalty && work.curvature[k].is_normal()),
        );
        let order = |a: &usize, b: &usize| work.correlation[*b].total_cmp(&work.correlation[*a]).then(a.cmp(b));
        if violators.len() > room {
            violators.select_nth_unstable_by(room - 1, order);
            violators.truncate(room);
        }
        work.working.extend_from_slice(&violators);
        work.working.sort_unstable();
        work.free = violators;
    }

    /// Sweeps and Newton steps until the working set's conditions hold. Returns the number of sweeps.
    fn solve_working_set(&mut self) -> usize {
        for step in 1..=FACES {
            for _ in 0..SWEEPS {
                self.sweep();
            }
            self.newton_steps();
            if self.violation() <= SOLVED * self.largest {
                return step * SWEEPS;
            }
        }
        FACES * SWEEPS
    }

    /// One pass of exact minimisations along the coordinates of the working set.
    fn sweep(&mut self) {
        for i in 0..self.work.working.len() {
            let k = self.work.working[i];
            let old = self.work.x[k];
            let slope = dot(self.column(k), &self.work.residual) - self.penalty;
            let new = (old + slope / self.work.curvature[k]).max(0.0);
            if (new - old).abs() > 0.0 {
                self.work.x[k] = new;
                let column = &self.work.columns[k * self.m..(k + 1) * self.m];
                axpy(old - new, column, &mut self.work.residual);
            }
        }
    }

    /// To the minimiser on the face of the entries above zero. Entries that reach zero on the way leave the face.
    fn newton_steps(&mut self) {
        loop {
            let done = match self.factor_face() {
                Ok(()) => self.step_on_face(),
                Err(error) => {
                    self.drop_dependent(error.pivot);
                    false
                }
            };
            if done {
                break;
            }
        }
        self.refresh();
    }

    /// The entries above zero → `free`, the factor of their Gram matrix → `gram`.
    fn factor_face(&mut self) -> Result<(), NotPositiveDefinite> {
        let work = &mut *self.work;
        work.free.clear();
        work.free.extend(work.working.iter().filter(|&&k| work.x[k] > 0.0));
        let n = work.free.len();
        let column = |k: usize| &work.columns[k * self.m..(k + 1) * self.m];
        work.gram.resize(n * n, 0.0);
        for (i, &k) in work.free.iter().enumerate() {
            for (j, &l) in work.free[..i].iter().enumerate() {
                work.gram[j * n + i] = dot(column(k), column(l));
            }
            work.gram[i * n + i] = work.curvature[k];
        }
        cholesky::factor(&mut work.gram, n)
    }

    /// Towards the minimiser on the face, as far as all entries stay above zero. True when it was reached.
    fn step_on_face(&mut self) -> bool {
        let work = &mut *self.work;
        work.point.clear();
        for &k in &work.free {
            let column = &work.columns[k * self.m..(k + 1) * self.m];
            work.point.push(dot(column, &work.y) - self.penalty);
        }
        cholesky::solve(&work.gram, work.free.len(), &mut work.point);
        for (target, &k) in work.point.iter_mut().zip(&work.free) {
            *target -= work.x[k];
        }
        self.advance(1.0) >= 1.0
    }

    /// The column at `pivot` of the face depends on the ones before: exchanging it for them leaves A x as it is, so the
    /// penalty decides the way, which ends where an entry reaches zero.
    fn drop_dependent(&mut self, pivot: usize) {
        let (n, work) = (self.work.free.len(), &mut *self.work);
        work.point.clear();
        work.point.extend_from_slice(&work.gram[pivot * n..pivot * n + pivot]);
        // Lᵀ z = that row, in the rows before the pivot
        for i in (0..pivot).rev() {
            let row = &work.gram[i * n + i..i * n + pivot];
            work.point[i] = (work.point[i] - dot(&row[1..], &work.point[i + 1..])) / row[0];
        }
        work.point.iter_mut().for_each(|v| *v = -*v);
        work.point.push(1.0);
        work.point.resize(n, 0.0);
        if work.point.iter().sum::<f64>() > 0.0 {
            work.point.iter_mut().for_each(|v| *v = -*v);
        }
        self.advance(f64::INFINITY);
    }

    /// x += step · `point` on the face, with the largest step up to `limit` that keeps every entry at or above zero;
    /// the entries that stop it are set to zero. Returns the step.
    fn advance(&mut self, limit: f64) -> f64 {
        let work = &mut *self.work;
        let reach = |x: f64, way: f64| if way < 0.0 { -x / way } else { f64::INFINITY };
        let moves = || work.free.iter().zip(&work.point);
        let step = moves().fold(limit, |step, (&k, &way)| step.min(reach(work.x[k], way)));
        for (&k, &way) in work.free.iter().zip(&work.point) {
            let x = work.x[k];
            work.x[k] = if reach(x, way) <= step { 0.0 } else { (x + step * way).max(0.0) };
        }
        step
    }

    /// Largest violation of the optimality conditions on the working set.
    fn violation(&self) -> f64 {
        let mut worst = 0.0_f64;
        for &k in &self.work.working {
            let x = self.work.x[k];
            let slope = dot(self.column(k), &self.work.residual) - self.penalty;
            worst = worst.max(if x > 0.0 { slope.abs() } else { slope });
        }
        worst
    }

    pub(super) fn write(&mut self, x_scale: f64, y_scale: f64, solution: &mut Solution) -> Result<(), Refusal> {
        let residual_norm = norm(&self.work.residual) * y_scale;
        for (x, length) in self.work.x.iter_mut().zip(&self.work.lengths) {
            if *x > 0.0 {
                *x /= length;
            }
        }
        solution.set_dense(&self.work.x, x_scale, residual_norm)
    }
}
