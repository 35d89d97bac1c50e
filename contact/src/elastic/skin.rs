//! The elastic skin under a body: the problem for the solver, and what its solution means.

use super::config::ElasticConfig;
use super::kernel::{ElasticKernel, modulus_of_confined_pa};
use super::level::Window;
use super::solver::ElasticSolver;
use crate::body::PosedMesh;
use crate::columns::FoamLaw;
use crate::envelope::Envelope;
use crate::frame::Wrench;
use crate::patch::Patch;
use crate::prepared::PreparedMesh;
use crate::response::Response;
use crate::traction::{Friction, velocity_at, wrench};
use spts_models::SkinLayout;

/// Why there is no answer.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub(crate) enum Failure {
    #[error("pose or velocity of the body are not finite")]
    NotFinite,
    #[error("the elastic contact problem does not converge to `contact.tolerance` = {0:e}")]
    NotConverged(f64),
    #[error("no depth found at which the elastic skin carries {wanted_n:e} N; the last one carries {reached_n:e} N")]
    Unbalanced { wanted_n: f64, reached_n: f64 },
}

/// Elastic skin with the answer to the last body.
pub(crate) struct ElasticSkin {
    config: ElasticConfig,
    solver: ElasticSolver,
    envelope: Envelope,
    /// Rise of the surface beside a load in units of the depth.
    bulge: f64,
    patch: Patch,
    target_m: Vec<f64>,
    /// On the patch, then on the whole skin.
    patch_pa: Vec<f64>,
    pressure_pa: Vec<f64>,
    /// Depth to be added to the dynamics' pose at the last frame, m.
    shift_m: f64,
    /// Slope of the force there, N/m, once known.
    slope_n_per_m: Option<f64>,
    /// Why the last call had no answer.
    failure: Option<Failure>,
}

impl ElasticSkin {
    /// Bonded layer (`bonded`) or half-space under `skin`; the parameters are valid.
    pub(crate) fn new(config: ElasticConfig, bonded: bool, skin: &SkinLayout) -> Self {
        let c = &config;
        let (poisson, thickness_m) = (c.poisson, c.thickness_m);
        let modulus_pa = modulus_of_confined_pa(c.stiffness_pa_per_m, poisson, thickness_m);
        let kernel = if bonded {
            ElasticKernel::Layer {
                modulus_pa,
                poisson,
                thickness_m,
            }
        } else {
            ElasticKernel::HalfSpace { modulus_pa, poisson }
        };
        let envelope = Envelope::new(skin, c.cells_per_taxel);
        let shape = envelope.shape();
        let solver = ElasticSolver::new(kernel, shape, envelope.cell_m());
        Self {
            bulge: solver.bulge(),
            solver,
            config,
            patch: Patch::default(),
            target_m: Vec::new(),
            patch_pa: Vec::new(),
            pressure_pa: vec![0.0; shape[0] * shape[1]],
            envelope,
            shift_m: 0.0,
            slope_n_per_m: None,
            failure: None,
        }
    }

    /// Makes `mesh` the one that bodies are expected to have.
    pub(crate) fn expect(&mut self, mesh: &PreparedMesh) {
        self.envelope.expect(mesh);
    }

    /// Why the last answer was none; `None` when there was one.
    pub(crate) fn failure(&self) -> Option<Failure> {
        self.failure
    }

    /// Pressure on the skin and wrench for the body as it is.
    /// Without an answer (a body that is nowhere, an iteration that fails) the wrench is NaN.
    pub(crate) fn respond(&mut self, body: &PosedMesh<'_>) -> Response<'_> {
        self.failure = None;
        let wrench = match self.solve(body, 0.0) {
            Some(_) => {
                self.spread(1.0);
                self.wrench(body)
            }
            None => Wrench::UNKNOWN,
        };
        Response {
            wrench,
            pressure_pa: &self.pressure_pa,
            patch: Some(self.patch),
        }
    }

    /// Pressure on the skin when the body is moved along the normal until it carries `force_n`; `None` when it never
    /// does or no such pose is found.
    pub(crate) fn carry(&mut self, body: &PosedMesh<'_>, force_n: f64) -> Option<&[f64]> {
        self.failure = None;
        if force_n <= 0.0 {
            self.lift();
            return Some(&self.pressure_pa);
        }
        let Some(reached_n) = self.balance(body, force_n) else {
            (self.shift_m, self.slope_n_per_m) = (0.0, None);
            return None;
        };
        self.spread(force_n / reached_n);
        Some(&self.pressure_pa)
    }

    /// No answer, and why.
    fn fail<T>(&mut self, failure: Failure) -> Option<T> {
        self.lift();
        self.failure = Some(failure);
        None
    }

    /// Nothing touches the skin, and nothing is remembered.
    fn lift(&mut self) {
        self.clear();
        self.patch = Patch::default();
        self.patch_pa.clear();
        self.solver.forget();
    }

    /// Solves for `body`, `shift_m` deeper than it is: pressure on the patch. The normal force, N; `None` when there is
    /// no answer.
    fn solve(&mut self, body: &PosedMesh<'_>, shift_m: f64) -> Option<f64> {
        if !body.is_finite() || !shift_m.is_finite() {
            return self.fail(Failure::NotFinite);
        }
        let c = self.config;
        let margin_m = self.margin_m(body, shift_m);
        let [x, y, z] = body.position_m;
        let lowered = PosedMesh {
            position_m: [x, y, z - shift_m - margin_m],
            ..*body
        };
        self.clear();
        let seen = self.envelope.rasterise(&lowered);
        self.patch = self.contact_patch(seen);
        if self.patch == Patch::default() {
            self.patch_pa.clear();
            self.solver.forget();
            return Some(0.0);
        }
        self.aim(body, margin_m, shift_m);
        let body_m_per_pa = 1.0 / body.stiffness_pa_per_m;
        self.solver.set_series(body_m_per_pa);
        if !self.solver.sink(self.patch, &self.target_m, c.tolerance).converged {
            return self.fail(Failure::NotConverged(c.tolerance));
        }
        self.patch_pa.clear();
        self.patch_pa.extend_from_slice(self.solver.pressure_pa());
        if c.densification == Some(true) {
            let law = FoamLaw::new(
                c.stiffness_pa_per_m,
                c.max_strain * c.thickness_m,
                body.stiffness_pa_per_m,
            );
            let m_per_pa = 1.0 / c.stiffness_pa_per_m + body_m_per_pa;
            for p in &mut self.patch_pa {
                *p = law.pressure_pa(*p * m_per_pa);
            }
        }
        Some(self.patch_pa.iter().sum::<f64>() * self.envelope.cell_m() * self.envelope.cell_m())
    }

    /// How far outside the overlap the bulging surface may meet the body, m.
    fn margin_m(&self, body: &PosedMesh<'_>, shift_m: f64) -> f64 {
        if self.bulge <= 0.0 {
            return 0.0;
        }
        let [lowest_m, _] = body.heights_m();
        self.bulge * (-(lowest_m + body.position_m[2] - shift_m)).max(0.0)
    }

    /// Bounding box of the cells with a depth, a little rounded. The last one is kept while it holds this one and is
    /// not much larger, since operators and memory belong to a patch.
    fn contact_patch(&self, seen: Patch) -> Patch {
        let width = self.envelope.shape()[1];
        let (mut rows, mut cols) = ([usize::MAX, 0], [usize::MAX, 0]);
        for row in seen.rows[0]..seen.rows[1] {
            let line = &self.envelope.depth_m()[row * width..(row + 1) * width];
            let mut inside = (seen.cols[0]..seen.cols[1]).filter(|col| line[*col] > 0.0);
            if let Some(first) = inside.next() {
                let last = inside.next_back().unwrap_or(first);
                rows = [rows[0].min(row), row + 1];
                cols = [cols[0].min(first), cols[1].max(last + 1)];
            }
        }
        if rows[1] == 0 {
            return Patch::default();
        }
        let last = self.patch;
        let area = |p: Patch| (p.rows[1] - p.rows[0]) * (p.cols[1] - p.cols[0]);
        let window = Window {
            first: [rows[0], cols[0]],
            end: [rows[1], cols[1]],
        };
        let Window { first, end } = window.rounded(self.envelope.shape());
        let patch = Patch {
            rows: [first[0], end[0]],
            cols: [first[1], end[1]],
        };
        let holds =
            last.rows[0] <= rows[0] && last.rows[1] >= rows[1] && last.cols[0] <= cols[0] && last.cols[1] >= cols[1];
        if holds && 4 * area(last) <= 5 * area(patch) {
            last
        } else {
            patch
        }
    }

    /// Displacement wanted at each cell of the patch.
    fn aim(&mut self, body: &PosedMesh<'_>, margin_m: f64, shift_m: f64) {
        let width = self.envelope.shape()[1];
        let (com, tau_s) = (body.centre_of_mass_m, self.config.damping_s);
        self.target_m.clear();
        for row in self.patch.rows[0]..self.patch.rows[1] {
            for col in self.patch.cols[0]..self.patch.cols[1] {
                let lowered_m = self.envelope.depth_m()[row * width + col];
                if lowered_m <= 0.0 {
                    self.target_m.push(f64::NEG_INFINITY);
                    continue;
                }
                let depth_m = lowered_m - margin_m;
                let [x, y] = self.envelope.centre_m(row, col);
                let r = [x - com[0], y - com[1], shift_m - depth_m - com[2]];
                self.target_m.push(depth_m - tau_s * velocity_at(body, r)[2]);
            }
        }
    }

    /// Removes the last answer from the skin.
    fn clear(&mut self) {
        let width = self.envelope.shape()[1];
        for row in self.patch.rows[0]..self.patch.rows[1] {
            self.pressure_pa[row * width + self.patch.cols[0]..row * width + self.patch.cols[1]].fill(0.0);
        }
    }

    /// Spreads the patch's pressure, times `scale`, on the skin.
    fn spread(&mut self, scale: f64) {
        let (width, patch) = (self.envelope.shape()[1], self.patch);
        let across = patch.cols[1] - patch.cols[0];
        for (row, line) in (patch.rows[0]..patch.rows[1]).zip(self.patch_pa.chunks_exact(across.max(1))) {
            let cells = &mut self.pressure_pa[row * width + patch.cols[0]..row * width + patch.cols[1]];
            for (to, from) in cells.iter_mut().zip(line) {
                *to = scale * from;
            }
        }
    }

    fn wrench(&self, body: &PosedMesh<'_>) -> Wrench {
        let friction = Friction {
            coefficient: self.config.friction,
            speed_m_per_s: self.config.friction_speed_m_per_s,
        };
        let width = self.envelope.shape()[1];
        let margin_m = self.margin_m(body, 0.0);
        wrench(
            &self.envelope,
            self.patch,
            &self.patch_pa,
            body,
            friction,
            |row, col| self.envelope.depth_m()[row * width + col] - margin_m,
        )
    }

    /// Force carried, N, after moving the body along the normal until it is `force_n`: secant steps from the last
    /// frame's slope on, and when they leave the bracket or there is no slope yet, the Illinois rule; bisection when
    /// that has taken too long, as it does at a jump. `None` when a pose has no answer or the last trial's force is
    /// still another one. That is no failure where the force jumps within [`JUMP`] thicknesses: under a moving body,
    /// whose damping acts on a cell as soon as it is touched, some small forces belong to no depth.
    fn balance(&mut self, body: &PosedMesh<'_>, force_n: f64) -> Option<f64> {
        // a pose that carries too little and one that carries too much
        let (mut low, mut high): (Option<Trial>, Option<Trial>) = (None, None);
        let mut last: Option<Trial> = None;
        let mut stride_m = FIRST_STRIDE * self.config.thickness_m;
        let mut rose = None;
        let mut reached_n = 0.0;
        for trial in 0..MOST_TRIALS {
            let secant_m = last
                .zip(self.slope_n_per_m)
                .map(|((shift_m, over_n), slope)| shift_m - over_n / slope)
                .filter(|m| low.is_none_or(|l| *m > l.0) && high.is_none_or(|h| *m < h.0))
                .filter(|m| last.is_none_or(|l| (m - l.0).abs() <= stride_m))
                .filter(|_| trial < TRIALS_BEFORE_BISECTION);
            let shift_m = secant_m.unwrap_or_else(|| match (low, high) {
                (Some((low_m, _)), Some((high_m, _))) if trial >= TRIALS_BEFORE_BISECTION => 0.5 * (low_m + high_m),
                (Some((low_m, less_n)), Some((high_m, more_n))) => {
                    low_m - less_n * (high_m - low_m) / (more_n - less_n)
                }
                (Some((low_m, _)), None) => low_m + stride_m,
                (None, Some((high_m, _))) => high_m - stride_m,
                (None, None) => self.shift_m,
            });
            stride_m *= if low.is_some() || high.is_some() { 2.0 } else { 1.0 };
            reached_n = self.solve(body, shift_m)?;
            self.shift_m = shift_m;
            let over_n = reached_n - force_n;
            if let Some((from_m, from_n)) = last {
                let slope = (over_n - from_n) / (shift_m - from_m);
                self.slope_n_per_m = (slope.is_finite() && slope > 0.0).then_some(slope);
            }
            last = Some((shift_m, over_n));
            if over_n.abs() <= BALANCE.max(self.config.tolerance) * force_n {
                break;
            }
            // the side that stays put twice in a row counts half
            let (moved, other) = if over_n > 0.0 {
                (&mut high, &mut low)
            } else {
                (&mut low, &mut high)
            };
            *moved = Some((shift_m, over_n));
            if rose == Some(over_n > 0.0)
                && let Some((_, value)) = other
            {
                *value *= 0.5;
            }
            rose = Some(over_n > 0.0);
        }
        if (reached_n - force_n).abs() <= UNBALANCED * force_n {
            return Some(reached_n);
        }
        let width_m = low.zip(high).map(|((low_m, _), (high_m, _))| high_m - low_m);
        if width_m.is_some_and(|m| m <= JUMP * self.config.thickness_m) {
            // the force jumps over the one wanted
            self.lift();
            return None;
        }
        self.fail(Failure::Unbalanced {
            wanted_n: force_n,
            reached_n,
        })
    }
}

/// How near the balance has to come, relative to the force: what is left is made up by scaling the pressure, whose
/// shape changes by less than that.
const BALANCE: f64 = 1e-4;
/// A force that is still further off than this share of the one wanted after the last trial cannot be made up by
/// scaling.
const UNBALANCED: f64 = 1e-2;
/// A force that misses the one wanted on both sides of a depth known to this many thicknesses jumps there; over a wider
/// bracket the search has failed.
const JUMP: f64 = 1e-6;
/// Shift of the body, m, and the force it carries there beyond the one wanted, N.
type Trial = (f64, f64);

/// First step of the search for a depth, in thicknesses, and most solutions it may take.
const FIRST_STRIDE: f64 = 0.02;
const MOST_TRIALS: usize = 60;
/// From this trial on the bracket is halved, to less than 1e-9 of itself.
const TRIALS_BEFORE_BISECTION: usize = 30;
