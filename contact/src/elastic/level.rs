//! One resolution of the solver: coefficients, operators by size, and fields.

use super::coefficients::Influence;
use super::pcg::{self, Fields, Goal, Outcome, Stop};
use super::system::{Planners, System};
use std::sync::Arc;

/// Half-open rectangle of cells inside a patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Window {
    pub(crate) first: [usize; 2],
    pub(crate) end: [usize; 2],
}

impl Window {
    pub(crate) fn whole(shape: [usize; 2]) -> Self {
        Self {
            first: [0, 0],
            end: shape,
        }
    }

    pub(crate) fn shape(&self) -> [usize; 2] {
        [self.end[0] - self.first[0], self.end[1] - self.first[1]]
    }

    pub(crate) fn cells(&self) -> usize {
        let [rows, cols] = self.shape();
        rows * cols
    }

    /// Window whose sides are multiples of [`ROUND`] cells, as far as the patch goes: contacts that grow need few
    /// operators.
    pub(crate) fn rounded(&self, shape: [usize; 2]) -> Self {
        let sides = self.shape();
        let end = [0, 1].map(|i| (self.first[i] + sides[i].next_multiple_of(ROUND)).min(shape[i]));
        // what does not fit at the end goes before the beginning
        let first = [0, 1].map(|i| {
            end[i]
                .saturating_sub(sides[i].next_multiple_of(ROUND))
                .min(self.first[i])
        });
        Self { first, end }
    }

    /// Smallest window with every cell for which `inside(cell)`; `None` when there is none.
    pub(crate) fn around([rows, cols]: [usize; 2], inside: impl Fn(usize) -> bool) -> Option<Self> {
        let (mut first, mut end) = ([rows, cols], [0, 0]);
        for r in 0..rows {
            for c in 0..cols {
                if inside(r * cols + c) {
                    first = [first[0].min(r), first[1].min(c)];
                    end = [end[0].max(r + 1), end[1].max(c + 1)];
                }
            }
        }
        (end[0] > 0).then_some(Self { first, end })
    }

    /// Window with `margin` more cells on every side, as far as the patch goes.
    pub(crate) fn grown(&self, margin: usize, shape: [usize; 2]) -> Self {
        let first = self.first.map(|i| i.saturating_sub(margin));
        let end = [0, 1].map(|i| (self.end[i] + margin).min(shape[i]));
        Self { first, end }
    }

    /// Ranges of the window's rows in a patch `cols` wide.
    pub(crate) fn lines(self, cols: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
        (self.first[0]..self.end[0]).map(move |r| r * cols + self.first[1]..r * cols + self.end[1])
    }

    /// Copies the window out of a patch `cols` wide.
    pub(crate) fn cut(self, patch: &[f64], cols: usize, out: &mut [f64]) {
        let width = self.shape()[1];
        for (line, out) in self.lines(cols).zip(out.chunks_exact_mut(width)) {
            out.copy_from_slice(&patch[line]);
        }
    }

    /// Copies the window's cells into a patch `cols` wide.
    pub(crate) fn paste(self, cells: &[f64], patch: &mut [f64], cols: usize) {
        let width = self.shape()[1];
        for (line, cells) in self.lines(cols).zip(cells.chunks_exact(width)) {
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
    /// Ordered by use; the most recent one is last.
    systems: Vec<System>,
    fields: Fields,
    /// Fields on the patch.
    pub(crate) target: Vec<f64>,
    pub(crate) pressure: Vec<f64>,
    /// C · pressure where it was solved for, 0 elsewhere.
    pub(crate) displacement: Vec<f64>,
    /// Where the displacement is known.
    known: Window,
}

impl Level {
    pub(crate) fn new(influence: Arc<Influence>, cell_m: f64) -> Self {
        Self {
            cell_m,
            influence,
            series_m_per_pa: 0.0,
            systems: Vec::new(),
            fields: Fields::default(),
            target: Vec::new(),
            pressure: Vec::new(),
            displacement: Vec::new(),
            known: Window::whole([0, 0]),
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

    fn system(&mut self, planners: &mut Planners, shape: [usize; 2]) -> usize {
        if let Some(index) = self.systems.iter().position(|s| s.shape == shape) {
            self.systems[index..].rotate_left(1);
            return self.systems.len() - 1;
        }
        if self.systems.len() >= KEPT {
            self.systems.remove(0);
        }
        let system = System::new(planners, &self.influence, shape, self.series_m_per_pa);
        self.systems.push(system);
        self.systems.len() - 1
    }

    /// Solves on `window` of the patch, starting from `pressure` (and a contact set of its positive cells, or, where it
    /// is all zero, of every cell that can touch). Outside the window the pressure becomes zero.
    pub(crate) fn solve(
        &mut self,
        planners: &mut Planners,
        cols: usize,
        window: Window,
        goal: Goal,
        stop: Stop,
    ) -> Outcome {
        let index = self.system(planners, window.shape());
        let f = &mut self.fields;
        f.resize(window.cells());
        window.cut(&self.target, cols, &mut f.target);
        window.cut(&self.pressure, cols, &mut f.pressure);
        let started = f.pressure.iter().any(|p| *p > 0.0);
        for ((inside, p), target) in f.contact.iter_mut().zip(&mut f.pressure).zip(&f.target) {
            *inside = if target.is_finite() && (!started || *p > 0.0) {
                1.0
            } else {
                0.0
            };
            *p *= *inside;
        }
        let outcome = pcg::solve(&mut self.systems[index], f, goal, stop);
        self.pressure.fill(0.0);
        window.paste(&f.pressure, &mut self.pressure, cols);
        self.displacement.clear();
        self.displacement.resize(self.pressure.len(), 0.0);
        window.paste(&f.displacement, &mut self.displacement, cols);
        self.known = window;
        outcome
    }

    /// Completes the displacement on `window`, at the price of a convolution; true when there was something to do.
    pub(crate) fn complete(&mut self, planners: &mut Planners, cols: usize, window: Window) -> bool {
        let missing = self.known != window;
        if missing {
            let index = self.system(planners, window.shape());
            let f = &mut self.fields;
            f.resize(window.cells());
            window.cut(&self.pressure, cols, &mut f.pressure);
            self.systems[index].displace(&f.pressure, &mut f.displacement);
            window.paste(&f.displacement, &mut self.displacement, cols);
            self.known = window;
        }
        missing
    }

    /// Adds a small pressure to the cells outside `window` that the surface penetrates by more than the tolerance;
    /// false when there are none.
    pub(crate) fn add_outside(
        &mut self,
        planners: &mut Planners,
        cols: usize,
        window: Window,
        approach_m: f64,
        tolerance: f64,
    ) -> bool {
        let shape = [self.target.len() / cols, cols];
        let sum: f64 = self.pressure.iter().sum();
        let highest = self.pressure.iter().copied().fold(0.0, f64::max);
        // nowhere does the surface rise by more than this
        let bulge_m = self.influence.bulge_below_m(highest, sum);
        let reach = |cell: usize| self.target[cell] + approach_m > -bulge_m || self.pressure[cell] > 0.0;
        let Some(wide) = Window::around(shape, reach) else {
            return false;
        };
        let inside = |i: usize| window.first[i] <= wide.first[i] && window.end[i] >= wide.end[i];
        if inside(0) && inside(1) {
            return false;
        }
        let wide = wide.rounded(shape);
        self.complete(planners, cols, wide);
        let Some(system) = self.systems.last() else {
            return false;
        };
        let limit_m = tolerance * highest / system.stiffness_pa_per_m;
        let mut found = false;
        for r in wide.first[0]..wide.end[0] {
            for c in wide.first[1]..wide.end[1] {
                let within =
                    (window.first[0]..window.end[0]).contains(&r) && (window.first[1]..window.end[1]).contains(&c);
                let cell = r * cols + c;
                if !within && self.target[cell] + approach_m - self.displacement[cell] > limit_m {
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
