//! Contact of a rigid shape with an elastic body, computed on a grid of squares.

use super::kernel::ElasticKernel;
use super::level::{Level, Window};
use super::memory::Memory;
use super::pcg::{Goal, Outcome, Stop};
use super::pyramid::{coarser, prolong, restrict};
use super::system::Planners;
use super::tables::{COARSEST, tables};
use crate::patch::Patch;
use std::sync::Arc;

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
    #[must_use]
    pub fn new(kernel: ElasticKernel, shape: [usize; 2], cell_m: f64) -> Self {
        let tables = tables(kernel, shape, cell_m);
        let levels = tables
            .iter()
            .map(|(influence, side_m)| Level::new(Arc::clone(influence), *side_m))
            .collect();
        Self {
            shape,
            planners: Planners::new(),
            levels,
            memory: Memory::default(),
        }
    }

    /// Rise of the surface beside a wide load relative to the depression under it; see [`Influence::bulge`].
    ///
    /// [`Influence::bulge`]: super::Influence::bulge
    #[must_use]
    pub fn bulge(&self) -> f64 {
        // the coarsest level spans the same distance with the fewest cells
        self.levels.last().map_or(0.0, Level::bulge)
    }

    /// Makes the pressing body compliant: adds `series_m_per_pa` (1/K of its surface) to the own compliance of each
    /// grid square.
    pub fn set_series(&mut self, series_m_per_pa: f64) {
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
        let shape = [patch.rows, patch.cols].map(|[first, end]| end.saturating_sub(first));
        assert_eq!(
            target_m.len(),
            shape[0] * shape[1],
            "one displacement a cell of the patch"
        );
        let fits = (0..2).all(|i| (1..=self.shape[i]).contains(&shape[i]));
        let any = target_m.iter().any(|t| t.is_finite());
        if !fits || !any {
            return self.free(target_m.len(), fits);
        }
        let top = &mut self.levels[0];
        top.target.clear();
        top.target.extend_from_slice(target_m);
        let warm = self.memory.start(patch, target_m, &mut top.pressure);
        let mut outcome = if warm {
            self.on_window(0, shape, Window::whole(shape), None, tolerance)
        } else {
            self.nested(0, shape, None, tolerance)
        };
        if warm && !outcome.converged {
            // a start that misleads
            let misled = outcome;
            outcome = self.nested(0, shape, None, tolerance);
            outcome.iterations += misled.iterations;
            outcome.convolutions += misled.convolutions;
        }
        if !outcome.converged {
            self.forget();
            return outcome;
        }
        // a combination of answers needs their displacement on all of the patch
        let top = &mut self.levels[0];
        outcome.convolutions += usize::from(top.complete(&mut self.planners, shape[1], Window::whole(shape)));
        self.memory.keep(&top.pressure, &top.displacement);
        outcome
    }

    /// Leaves `cells` cells without pressure, and nothing to remember.
    fn free(&mut self, cells: usize, converged: bool) -> Outcome {
        self.forget();
        let pressure = &mut self.levels[0].pressure;
        pressure.clear();
        pressure.resize(cells, 0.0);
        Outcome {
            approach_m: 0.0,
            iterations: 0,
            convolutions: 0,
            converged,
        }
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
        top.target.clear();
        top.target.extend(height_m.iter().map(|h| -h));
        self.nested(0, self.shape, Some(force_n), tolerance)
    }

    /// Pressure that the last call of [`Self::sink`] or [`Self::press`] has found, Pa: one value for each grid square,
    /// row by row. After `sink` the squares are those of its patch, after `press` those of the whole grid.
    #[must_use]
    pub fn pressure_pa(&self) -> &[f64] {
        &self.levels[0].pressure
    }

    /// Solves level `index` for the target that is in it, from the next coarser one's answer.
    fn nested(&mut self, index: usize, shape: [usize; 2], force_n: Option<f64>, tolerance: f64) -> Outcome {
        let mut convolutions = 0;
        let mut window = Window::whole(shape);
        if shape[0].min(shape[1]) > COARSEST && index + 1 < self.levels.len() {
            let (fine, coarse) = self.levels.split_at_mut(index + 1);
            restrict(&fine[index].target, shape, &mut coarse[0].target);
            convolutions += self
                .nested(index + 1, coarser(shape), force_n, COARSE_TOLERANCE.max(tolerance))
                .convolutions;
            let (fine, coarse) = self.levels.split_at_mut(index + 1);
            prolong(&coarse[0].pressure, &coarse[0].target, shape, &mut fine[index].pressure);
            let pressure = &fine[index].pressure;
            if let Some(contact) = Window::around(shape, |cell| pressure[cell] > 0.0) {
                window = contact.grown(MARGIN, shape).rounded(shape);
            }
        } else {
            let pressure = &mut self.levels[index].pressure;
            pressure.clear();
            pressure.resize(shape[0] * shape[1], 0.0);
        }
        let mut outcome = self.on_window(index, shape, window, force_n, tolerance);
        outcome.convolutions += convolutions;
        outcome
    }

    /// Solves on `window`, and on the whole patch when that proves too small.
    fn on_window(
        &mut self,
        index: usize,
        shape: [usize; 2],
        mut window: Window,
        force_n: Option<f64>,
        tolerance: f64,
    ) -> Outcome {
        let level = &mut self.levels[index];
        let goal = force_n.map_or(Goal::Displacement, |f| {
            Goal::PressureSum(f / (level.cell_m * level.cell_m))
        });
        // an iteration goes a little further than asked, so that the combination of answers is good enough next time
        let reserve = if force_n.is_none() && index == 0 { RESERVE } else { 1.0 };
        let stop = Stop {
            tolerance: reserve * tolerance,
            start_tolerance: tolerance,
            iterations: MAX_ITERATIONS,
        };
        let mut sum: Option<Outcome> = None;
        loop {
            let mut outcome = level.solve(&mut self.planners, shape[1], window, goal, stop);
            if let Some(before) = sum {
                outcome.iterations += before.iterations;
                outcome.convolutions += before.convolutions;
            }
            let whole = window == Window::whole(shape);
            if whole || index > 0 {
                return outcome;
            }
            outcome.convolutions += 1;
            if !level.add_outside(&mut self.planners, shape[1], window, outcome.approach_m, tolerance) {
                return outcome;
            }
            window = Window::whole(shape);
            sum = Some(outcome);
        }
    }
}
