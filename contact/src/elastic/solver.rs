//! Contact of a rigid shape with an elastic body, computed on a grid of squares: from a coarse grid to the fine one, or
//! from earlier solutions.

use super::convolution::{EXTRA_OFFSETS, Planners, System};
use super::influence::{ElasticKernel, Influence, deficit};
use super::pcg::{self, Fields, Goal, Outcome, Stop, dot};
use crate::field::Patch;
use std::cell::RefCell;
use std::sync::Arc;

// Influence coefficients of all levels of a solver, shared between solvers. They are most of the set-up cost, and the
// next solver often has the same parameters: every press of a data set makes its own solver.

/// A level is the coarsest when its shorter side has at most this many cells.
pub(crate) const COARSEST: usize = 20;

/// Coefficients of a level and the side of its cells, m; the finest first.
pub(crate) type Tables = Arc<[(Arc<Influence>, f64)]>;

/// Most cells of tables that are kept: a few megabytes.
const MOST_KEPT: usize = 1 << 18;

/// Kernel, rows and columns, side of a cell in m.
type Kind = (ElasticKernel, [usize; 2], f64);

thread_local! {
    static LAST: RefCell<Option<(Kind, Tables)>> = const { RefCell::new(None) };
}

/// Coefficients for up to `shape` cells of side `cell_m`: a function of the arguments alone. Those of a thread's last
/// solver are kept.
pub(crate) fn tables(kernel: ElasticKernel, shape: [usize; 2], cell_m: f64) -> Tables {
    let kind = (kernel, shape, cell_m);
    LAST.with_borrow_mut(|last| match last {
        Some((known, tables)) if *known == kind => Arc::clone(tables),
        _ => {
            let tables = computed(kernel, shape, cell_m);
            let small = shape[0].saturating_mul(shape[1]) <= MOST_KEPT;
            *last = small.then(|| (kind, Arc::clone(&tables)));
            tables
        }
    })
}

fn computed(kernel: ElasticKernel, shape: [usize; 2], cell_m: f64) -> Tables {
    let (mut sizes, mut size, mut side_m) = (vec![(shape, cell_m)], shape, cell_m);
    while size[0].min(size[1]) > COARSEST {
        (size, side_m) = (coarser(size), 2.0 * side_m);
        sizes.push((size, side_m));
    }
    let sizes = sizes.into_iter().map(|(size, side_m)| (size.map(|n| n + EXTRA_OFFSETS), side_m));
    // the coarsest offsets reach furthest
    let table = sizes.clone().next_back().and_then(|(offsets, side_m)| deficit(&kernel, offsets, side_m));
    let level = |(offsets, side_m)| {
        let influence = Influence::with_deficit(&kernel, table.as_ref(), offsets, side_m);
        (Arc::new(influence), side_m)
    };
    sizes.map(level).collect()
}

// One resolution of the solver: coefficients, operators by size, and fields.

/// Patches that are solved on: windows of the cells of another patch.
impl Patch {
    /// Window whose sides are multiples of [`ROUND`] cells, as far as the patch of `shape` goes: contacts that grow
    /// need few operators.
    pub(crate) fn rounded(&self, [rows, cols]: [usize; 2]) -> Self {
        let rounded = |[first, end]: [usize; 2], most: usize| {
            let side = (end - first).next_multiple_of(ROUND);
            let end = (first + side).min(most);
            // what does not fit at the end goes before the beginning
            [end.saturating_sub(side).min(first), end]
        };
        Self { rows: rounded(self.rows, rows), cols: rounded(self.cols, cols) }
    }

    /// Window with `margin` more cells on every side, as far as the patch of `shape` goes.
    fn grown(&self, margin: usize, [rows, cols]: [usize; 2]) -> Self {
        let grown = |[first, end]: [usize; 2], most: usize| [first.saturating_sub(margin), (end + margin).min(most)];
        Self { rows: grown(self.rows, rows), cols: grown(self.cols, cols) }
    }

    /// Copies the window out of a patch `cols` wide.
    fn cut(self, patch: &[f64], cols: usize, out: &mut [f64]) {
        for (line, out) in self.lines(cols).zip(out.chunks_exact_mut(self.width())) {
            out.copy_from_slice(&patch[line]);
        }
    }

    /// Copies the window's cells into a patch `cols` wide.
    fn paste(self, cells: &[f64], patch: &mut [f64], cols: usize) {
        for (line, cells) in self.lines(cols).zip(cells.chunks_exact(self.width())) {
            patch[line].copy_from_slice(cells);
        }
    }
}

/// Windows' sides are multiples of this many cells.
const ROUND: usize = 4;

/// Operators kept; a growing contact passes through about ten sizes.
const KEPT: usize = 24;

/// Cells of one size.
#[derive(Clone)]
pub(crate) struct Level {
    pub(crate) cell_m: f64,
    influence: Arc<Influence>,
    series_m_per_pa: f64,
    /// See [`Level::set_shares`]: one number a cell of the patch, or none.
    own_m_per_pa: Vec<f64>,
    /// Ordered by use; the most recent one is last.
    systems: Vec<System>,
    fields: Fields,
    /// Fields on the patch.
    pub(crate) target: Vec<f64>,
    pub(crate) pressure: Vec<f64>,
    /// C · pressure where it was solved for, 0 elsewhere.
    pub(crate) displacement: Vec<f64>,
    /// Where the displacement is known.
    known: Patch,
}

impl Level {
    pub(crate) fn new(influence: Arc<Influence>, cell_m: f64) -> Self {
        Self {
            cell_m,
            influence,
            series_m_per_pa: 0.0,
            own_m_per_pa: Vec::new(),
            systems: Vec::new(),
            fields: Fields::default(),
            target: Vec::new(),
            pressure: Vec::new(),
            displacement: Vec::new(),
            known: Patch::default(),
        }
    }

    /// Compliance of every cell by itself, added to the elastic one; true when it has changed.
    pub(crate) fn set_series(&mut self, series_m_per_pa: f64) -> bool {
        let changed = self.series_m_per_pa.to_bits() != series_m_per_pa.to_bits();
        if changed {
            self.series_m_per_pa = series_m_per_pa;
            self.systems.clear();
        }
        changed
    }

    pub(crate) fn bulge(&self) -> f64 {
        self.influence.bulge()
    }

    /// Makes the system of a window of a patch `cols` wide the last one.
    fn system(&mut self, planners: &mut Planners, cols: usize, window: Patch) {
        let shape = window.shape();
        if let Some(index) = self.systems.iter().position(|s| s.shape == shape) {
            self.systems[index..].rotate_left(1);
        } else {
            if self.systems.len() >= KEPT {
                self.systems.remove(0);
            }
            self.systems.push(System::new(planners, &self.influence, shape, self.series_m_per_pa));
        }
        let own = &self.own_m_per_pa;
        if let Some(system) = self.systems.last_mut() {
            system.set_own(window.lines(cols).flat_map(|line| own.get(line).unwrap_or_default()).copied());
        }
    }

    /// Gives the cells of a patch the share of them that is under the body, those that are not whole.
    ///
    /// On a share c the mean pressure p stands for p/c. As if under that pressure on all of it, the cell sinks by p/c
    /// times its own coefficient: it is softer by (1/c − 1) of that. So the cells that an edge cuts carry what is
    /// theirs of the pressure along the edge, and force and centre hardly feel where the edge is within a cell.
    pub(crate) fn set_shares(&mut self, cells: usize, shares: &[(usize, f64)]) {
        self.own_m_per_pa.clear();
        if shares.is_empty() {
            return;
        }
        self.own_m_per_pa.resize(cells, 0.0);
        let unit_m_per_pa = self.influence.at(0, 0) + self.series_m_per_pa;
        for &(cell, share) in shares {
            self.own_m_per_pa[cell] = unit_m_per_pa * (1.0 / share - 1.0);
        }
    }

    /// Solves on `window` of the patch, starting from `pressure` (and a contact set of its positive cells, or, where it
    /// is all zero, of every cell that can touch). Outside the window the pressure becomes zero.
    pub(crate) fn solve(
        &mut self,
        planners: &mut Planners,
        cols: usize,
        window: Patch,
        goal: Goal,
        stop: Stop,
    ) -> Outcome {
        self.system(planners, cols, window);
        let (Some(system), f) = (self.systems.last_mut(), &mut self.fields) else { return Outcome::default() };
        f.resize(window.height() * window.width());
        window.cut(&self.target, cols, &mut f.target);
        window.cut(&self.pressure, cols, &mut f.pressure);
        let started = f.pressure.iter().any(|p| *p > 0.0);
        for ((inside, p), target) in f.contact.iter_mut().zip(&mut f.pressure).zip(&f.target) {
            *inside = if target.is_finite() && (!started || *p > 0.0) { 1.0 } else { 0.0 };
            *p *= *inside;
        }
        let outcome = pcg::solve(system, f, goal, stop);
        self.pressure.fill(0.0);
        window.paste(&f.pressure, &mut self.pressure, cols);
        self.displacement.clear();
        self.displacement.resize(self.pressure.len(), 0.0);
        window.paste(&f.displacement, &mut self.displacement, cols);
        self.known = window;
        outcome
    }

    /// Completes the displacement on `window`, at the price of a convolution.
    pub(crate) fn complete(&mut self, planners: &mut Planners, cols: usize, window: Patch) {
        if self.known != window {
            self.system(planners, cols, window);
            let (Some(system), f) = (self.systems.last_mut(), &mut self.fields) else { return };
            f.resize(window.height() * window.width());
            window.cut(&self.pressure, cols, &mut f.pressure);
            system.displace(&f.pressure, &mut f.displacement);
            window.paste(&f.displacement, &mut self.displacement, cols);
            self.known = window;
        }
    }

    /// Adds a small pressure to the cells outside `window` that the surface penetrates by more than the tolerance;
    /// false when there are none.
    pub(crate) fn add_outside(
        &mut self,
        planners: &mut Planners,
        cols: usize,
        window: Patch,
        approach_m: f64,
        tolerance: f64,
    ) -> bool {
        let shape = [self.target.len() / cols, cols];
        let sum: f64 = self.pressure.iter().sum();
        let highest = self.pressure.iter().copied().fold(0.0, f64::max);
        // nowhere does the surface rise by more than this
        let bulge_m = self.influence.bulge_below_m(highest, sum);
        let reach = |cell: usize| self.target[cell] + approach_m > -bulge_m || self.pressure[cell] > 0.0;
        let wide = Patch::whole(shape).shrunk(cols, reach);
        if wide.is_empty() || window.holds(wide) {
            return false;
        }
        let wide = wide.rounded(shape);
        self.complete(planners, cols, wide);
        let Some(system) = self.systems.last() else {
            return false;
        };
        let limit_m = tolerance * highest / system.stiffness_pa_per_m;
        let mut found = false;
        for (row, line) in (wide.rows[0]..).zip(wide.lines(cols)) {
            let known = if (window.rows[0]..window.rows[1]).contains(&row) {
                row * cols + window.cols[0]..row * cols + window.cols[1]
            } else {
                0..0
            };
            for cell in line.filter(|cell| !known.contains(cell)) {
                if self.target[cell] + approach_m - self.displacement[cell] > limit_m {
                    self.pressure[cell] = SEED * highest;
                    found = true;
                }
            }
        }
        found
    }
}

/// Pressure, in units of the largest, that marks a cell as a member of the first contact set.
const SEED: f64 = 1e-9;

// Halving and doubling the resolution of a patch of cells.

/// Rows and columns of the next coarser patch.
pub(crate) fn coarser([rows, cols]: [usize; 2]) -> [usize; 2] {
    [rows.div_ceil(2), cols.div_ceil(2)]
}

/// Mean of the finite values of each 2 × 2 block; negative infinity where there are none.
pub(crate) fn restrict(fine: &[f64], [rows, cols]: [usize; 2], coarse: &mut Vec<f64>) {
    let [coarse_rows, coarse_cols] = coarser([rows, cols]);
    coarse.clear();
    for i in 0..coarse_rows {
        for j in 0..coarse_cols {
            let (mut sum, mut count) = (0.0, 0.0);
            for r in 2 * i..(2 * i + 2).min(rows) {
                for value in &fine[r * cols + 2 * j..r * cols + (2 * j + 2).min(cols)] {
                    if value.is_finite() {
                        sum += value;
                        count += 1.0;
                    }
                }
            }
            coarse.push(if count > 0.0 { sum / count } else { f64::NEG_INFINITY });
        }
    }
}

/// Bilinear interpolation of `coarse` at the fine cells' centres; coarse cells without a `target` (no body there) are
/// left out and the others weigh more. Cells of a coarse one without pressure have none.
pub(crate) fn prolong(coarse: &[f64], target: &[f64], [rows, cols]: [usize; 2], fine: &mut Vec<f64>) {
    let [coarse_rows, coarse_cols] = coarser([rows, cols]);
    let near = |i: usize, n: usize| {
        let own = i / 2;
        let other = if i % 2 == 1 { (own + 1).min(n - 1) } else { own.saturating_sub(1) };
        [(own, 0.75), (other, 0.25)]
    };
    fine.clear();
    for r in 0..rows {
        let across = near(r, coarse_rows);
        for c in 0..cols {
            // the coarse contact set is right on average, and a cell too few costs less than one too many
            if coarse[r / 2 * coarse_cols + c / 2] <= 0.0 {
                fine.push(0.0);
                continue;
            }
            let along = near(c, coarse_cols);
            let (mut sum, mut weight) = (0.0, 0.0);
            for (i, wi) in across {
                for (j, wj) in along {
                    let cell = i * coarse_cols + j;
                    if target[cell].is_finite() {
                        sum += wi * wj * coarse[cell];
                        weight += wi * wj;
                    }
                }
            }
            fine.push(if weight > 0.0 { sum / weight } else { 0.0 });
        }
    }
}

// Recent solutions, used to start the next one.

/// Answers kept: a flat shape that sinks and tilts about two axes has three degrees of freedom; one more for friction's
/// sake of round-off.
const KEPT_ANSWERS: usize = 4;

/// A direction that adds less than this share of its own energy to the ones before is left out.
const INDEPENDENT: f64 = 1e-12;

/// Pressure and displacement of earlier answers, all on the same patch.
#[derive(Debug, Clone, Default)]
pub(crate) struct Memory {
    patch: Patch,
    /// Newest first.
    answers: Vec<Answer>,
    spare: Vec<f64>,
}

#[derive(Debug, Clone, Default)]
struct Answer {
    pressure: Vec<f64>,
    displacement: Vec<f64>,
}

impl Memory {
    pub(crate) fn clear(&mut self) {
        self.answers.clear();
    }

    /// Moves to `patch` and puts the combination Σ cᵢ pᵢ of least energy ½ p·Cp − p·target into `start`; false when
    /// nothing is known.
    pub(crate) fn start(&mut self, patch: Patch, target: &[f64], start: &mut Vec<f64>) -> bool {
        self.shift(patch);
        start.clear();
        start.resize(target.len(), 0.0);
        let (mut factor, mut scaled) = ([[0.0; KEPT_ANSWERS]; KEPT_ANSWERS], [0.0; KEPT_ANSWERS]);
        let mut used = [false; KEPT_ANSWERS];
        // Cholesky of A_ij = p_i·u_j, skipping what depends on the newer ones
        for i in 0..self.answers.len() {
            let mut row = [0.0; KEPT_ANSWERS];
            for j in 0..i {
                if used[j] {
                    let before: f64 = (0..j).map(|k| row[k] * factor[j][k]).sum();
                    row[j] = (dot(&self.answers[i].pressure, &self.answers[j].displacement) - before) / factor[j][j];
                }
            }
            let own = dot(&self.answers[i].pressure, &self.answers[i].displacement);
            let left = own - row.iter().map(|v| v * v).sum::<f64>();
            used[i] = left > INDEPENDENT * own;
            if used[i] {
                row[i] = left.sqrt();
                let load = finite_dot(&self.answers[i].pressure, target);
                let before: f64 = (0..i).map(|k| row[k] * scaled[k]).sum();
                scaled[i] = (load - before) / row[i];
                factor[i] = row;
            }
        }
        let mut share = [0.0; KEPT_ANSWERS];
        for i in (0..self.answers.len()).rev().filter(|i| used[*i]) {
            let after: f64 = (i + 1..KEPT_ANSWERS).map(|k| factor[k][i] * share[k]).sum();
            share[i] = (scaled[i] - after) / factor[i][i];
        }
        for (answer, share) in self.answers.iter().zip(share) {
            for (to, from) in start.iter_mut().zip(&answer.pressure) {
                *to += share * from;
            }
        }
        start.iter().any(|p| *p > 0.0)
    }

    /// Keeps the answer on the patch of the last [`Memory::start`] and lets the oldest go.
    pub(crate) fn keep(&mut self, pressure: &[f64], displacement: &[f64]) {
        let mut answer =
            if self.answers.len() < KEPT_ANSWERS { Answer::default() } else { self.answers.pop().unwrap_or_default() };
        answer.pressure.clear();
        answer.pressure.extend_from_slice(pressure);
        answer.displacement.clear();
        answer.displacement.extend_from_slice(displacement);
        self.answers.insert(0, answer);
    }

    /// Moves the answers onto another patch; what lies beside it is lost, what is new is zero.
    fn shift(&mut self, patch: Patch) {
        if self.patch == patch {
            return;
        }
        let old = self.patch;
        for answer in &mut self.answers {
            for field in [&mut answer.pressure, &mut answer.displacement] {
                shifted(field, old, patch, &mut self.spare);
                std::mem::swap(field, &mut self.spare);
            }
        }
        self.patch = patch;
    }
}

fn shifted(field: &[f64], old: Patch, new: Patch, out: &mut Vec<f64>) {
    let (old_width, width) = (old.width(), new.width());
    out.clear();
    out.resize(new.height() * width, 0.0);
    let [first, end] = [old.cols[0].max(new.cols[0]), old.cols[1].min(new.cols[1])];
    if first >= end {
        return;
    }
    for row in old.rows[0].max(new.rows[0])..old.rows[1].min(new.rows[1]) {
        let from = (row - old.rows[0]) * old_width;
        let to = (row - new.rows[0]) * width;
        out[to + first - new.cols[0]..to + end - new.cols[0]]
            .copy_from_slice(&field[from + first - old.cols[0]..from + end - old.cols[0]]);
    }
}

/// Σ p d over the cells in contact; the others may have an infinite target.
fn finite_dot(pressure: &[f64], target: &[f64]) -> f64 {
    let cells = pressure.iter().zip(target);
    cells.map(|(p, d)| if *p > 0.0 && d.is_finite() { p * d } else { 0.0 }).sum()
}

/// Solver for the contact of height maps with a half-space or a bonded layer.
///
/// The surface is divided into a grid of squares (in names: `cell`). It is not periodic: pressure acts on the grid, and
/// the body extends to infinity. Pressure is uniform on each square; displacement is evaluated at its centre. Operators
/// of the sizes used most recently (about two dozen) and all buffers are kept between calls, so only a new size
/// allocates.
///
/// ```
/// use spts_contact::{ElasticKernel, ElasticSolver};
/// // 20 N press a ball of radius 33.4 mm on a soft half-space, 32 × 32 squares on 45 mm
/// let kernel = ElasticKernel::HalfSpace { modulus_pa: 150e3, poisson: 0.2 };
/// let cell_m = 0.045 / 32.0;
/// let mut solver = ElasticSolver::new(kernel, [32, 32], cell_m);
/// let at = |i: usize| (i as f64 + 0.5) * cell_m - 0.0225;
/// let height = |i: usize| (at(i / 32).powi(2) + at(i % 32).powi(2)) / (2.0 * 0.0334);
/// let height_m: Vec<f64> = (0..32 * 32).map(height).collect();
/// let outcome = solver.press(&height_m, 20.0, 1e-6);
/// let hertz_m = (9.0_f64 * 20.0 * 20.0 / (16.0 * 0.0334 * (150e3_f64 / 0.96).powi(2))).cbrt();
/// assert!(outcome.converged && (outcome.approach_m / hertz_m - 1.0).abs() < 5e-3);
/// ```
pub struct ElasticSolver {
    shape: [usize; 2],
    planners: Planners,
    levels: Vec<Level>,
    memory: Memory,
}

/// Tolerance of the coarser patches: their discretisation errs by about that.
const COARSE_TOLERANCE: f64 = 1e-2;
/// Share of the tolerance to which an answer that will be remembered is solved.
const RESERVE: f64 = 0.2;
/// Cells around the contact of the coarser start that are solved for too.
const MARGIN: usize = 2;
/// Most iterations on one patch: about ten times what rough shapes need.
const MAX_ITERATIONS: usize = 400;

impl ElasticSolver {
    /// A solver for up to `shape` (rows, columns) grid squares of side `cell_m`, m.
    pub fn new(kernel: ElasticKernel, shape: [usize; 2], cell_m: f64) -> Self {
        let tables = tables(kernel, shape, cell_m);
        let levels = tables.iter().map(|(influence, side_m)| Level::new(Arc::clone(influence), *side_m)).collect();
        Self { shape, planners: Planners::new(), levels, memory: Memory::default() }
    }

    /// Rise of the surface beside a wide load relative to the depression under it; see [`Influence::bulge`].
    ///
    /// [`Influence::bulge`]: super::Influence::bulge
    pub(crate) fn bulge(&self) -> f64 {
        // the coarsest level spans the same distance with the fewest cells
        self.levels.last().map_or(0.0, Level::bulge)
    }

    /// Makes the pressing body compliant: adds `series_m_per_pa` (1/K of its surface) to the own compliance of each
    /// grid square.
    pub(crate) fn set_series(&mut self, series_m_per_pa: f64) {
        let mut changed = false;
        for level in &mut self.levels {
            // a coarse cell's mean displacement is that of its fine cells: the same for a bed of springs
            changed |= level.set_series(series_m_per_pa);
        }
        if changed {
            self.memory.clear();
        }
    }

    /// Forgets earlier solutions: the next one depends only on its input.
    pub fn forget(&mut self) {
        self.memory.clear();
    }

    /// Presses the surface down by at least `target_m` (row-major on the squares of `patch`; negative infinity where
    /// there is no body): p ≥ 0, C p ≥ target, p (C p − target) = 0. [`ElasticSolver::pressure_pa`] returns the
    /// solution on the patch.
    ///
    /// The iteration starts from the best-fitting combination of the last solutions. This start is already the solution
    /// if the contact set has not changed and the target is a combination of the last ones, as for a flat shape that
    /// sinks and tilts.
    ///
    /// If no target value is finite, the surface is free: pressure 0, converged. If the patch is empty or larger than
    /// the solver's grid: pressure 0, not converged. A solution that has not converged is not kept for later starts.
    ///
    /// # Panics
    /// If `target_m` does not have one value for each square of the patch.
    pub fn sink(&mut self, patch: Patch, target_m: &[f64], tolerance: f64) -> Outcome {
        self.sink_shares(patch, target_m, &[], tolerance)
    }

    /// As [`ElasticSolver::sink`], with the share of some squares of the patch that is under the body; the pressure is
    /// the mean over the square.
    pub(crate) fn sink_shares(
        &mut self,
        patch: Patch,
        target_m: &[f64],
        shares: &[(usize, f64)],
        tolerance: f64,
    ) -> Outcome {
        let shape = patch.shape();
        assert_eq!(target_m.len(), shape[0] * shape[1], "one displacement a cell of the patch");
        let fits = (0..2).all(|i| (1..=self.shape[i]).contains(&shape[i]));
        let any = target_m.iter().any(|t| t.is_finite());
        if !fits || !any {
            return self.free(target_m.len(), fits);
        }
        let top = &mut self.levels[0];
        top.target.clear();
        top.target.extend_from_slice(target_m);
        top.set_shares(target_m.len(), shares);
        let warm = self.memory.start(patch, target_m, &mut top.pressure);
        let mut outcome = if warm {
            self.on_window(0, shape, Patch::whole(shape), None, tolerance)
        } else {
            self.nested(0, shape, None, tolerance)
        };
        if warm && !outcome.converged {
            // a start that misleads
            let misled = outcome;
            outcome = self.nested(0, shape, None, tolerance);
            outcome.iterations += misled.iterations;
        }
        if !outcome.converged {
            self.forget();
            return outcome;
        }
        // a combination of answers needs their displacement on all of the patch
        let top = &mut self.levels[0];
        top.complete(&mut self.planners, shape[1], Patch::whole(shape));
        self.memory.keep(&top.pressure, &top.displacement);
        outcome
    }

    /// Leaves `cells` cells without pressure, and nothing to remember.
    fn free(&mut self, cells: usize, converged: bool) -> Outcome {
        self.forget();
        let pressure = &mut self.levels[0].pressure;
        pressure.clear();
        pressure.resize(cells, 0.0);
        Outcome { converged, ..Outcome::default() }
    }

    /// Presses a rigid shape of height `height_m` above its lowest point (row-major; infinite where there is nothing)
    /// with the force `force_n` > 0. [`ElasticSolver::pressure_pa`] returns the solution. The approach is that of
    /// height 0.
    ///
    /// `tolerance` bounds the estimated error of every pressure, relative to the largest. If no height is finite, or
    /// the force is not a positive number: pressure 0, not converged.
    ///
    /// # Panics
    /// If `height_m` does not have one value for each grid square.
    pub fn press(&mut self, height_m: &[f64], force_n: f64, tolerance: f64) -> Outcome {
        assert_eq!(height_m.len(), self.shape[0] * self.shape[1], "one height a cell");
        let any = height_m.iter().any(|h| h.is_finite());
        if !any || !force_n.is_finite() || force_n <= 0.0 {
            return self.free(height_m.len(), false);
        }
        let top = &mut self.levels[0];
        top.set_shares(height_m.len(), &[]);
        top.target.clear();
        top.target.extend(height_m.iter().map(|h| -h));
        self.nested(0, self.shape, Some(force_n), tolerance)
    }

    /// Pressure that the last call of [`Self::sink`] or [`Self::press`] has found, Pa: one value for each grid square,
    /// row by row. After `sink` the squares are those of its patch, after `press` those of the whole grid.
    pub fn pressure_pa(&self) -> &[f64] {
        &self.levels[0].pressure
    }

    /// Solves level `index` for the target that is in it, from the next coarser one's answer.
    fn nested(&mut self, index: usize, shape: [usize; 2], force_n: Option<f64>, tolerance: f64) -> Outcome {
        let mut window = Patch::whole(shape);
        if shape[0].min(shape[1]) > COARSEST && index + 1 < self.levels.len() {
            let (fine, coarse) = self.levels.split_at_mut(index + 1);
            restrict(&fine[index].target, shape, &mut coarse[0].target);
            self.nested(index + 1, coarser(shape), force_n, COARSE_TOLERANCE.max(tolerance));
            let (fine, coarse) = self.levels.split_at_mut(index + 1);
            prolong(&coarse[0].pressure, &coarse[0].target, shape, &mut fine[index].pressure);
            let pressure = &fine[index].pressure;
            let contact = window.shrunk(shape[1], |cell| pressure[cell] > 0.0);
            if !contact.is_empty() {
                window = contact.grown(MARGIN, shape).rounded(shape);
            }
        } else {
            let pressure = &mut self.levels[index].pressure;
            pressure.clear();
            pressure.resize(shape[0] * shape[1], 0.0);
        }
        self.on_window(index, shape, window, force_n, tolerance)
    }

    /// Solves on `window`, and on the whole patch when that proves too small.
    fn on_window(
        &mut self,
        index: usize,
        shape: [usize; 2],
        mut window: Patch,
        force_n: Option<f64>,
        tolerance: f64,
    ) -> Outcome {
        let level = &mut self.levels[index];
        let goal = force_n.map_or(Goal::Displacement, |f| Goal::PressureSum(f / (level.cell_m * level.cell_m)));
        // an iteration goes a little further than asked, so that the combination of answers is good enough next time
        let reserve = if force_n.is_none() && index == 0 { RESERVE } else { 1.0 };
        let stop = Stop { tolerance: reserve * tolerance, start_tolerance: tolerance, iterations: MAX_ITERATIONS };
        let mut iterations = 0;
        loop {
            let mut outcome = level.solve(&mut self.planners, shape[1], window, goal, stop);
            outcome.iterations += iterations;
            let whole = window == Patch::whole(shape);
            if whole || index > 0 {
                return outcome;
            }
            if !level.add_outside(&mut self.planners, shape[1], window, outcome.approach_m, tolerance) {
                return outcome;
            }
            window = Patch::whole(shape);
            iterations = outcome.iterations;
        }
    }
}
