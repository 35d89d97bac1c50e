//! The elastic half-space and the bonded elastic layer as contact fields: their parameters, the problem that a body
//! poses to the solver, and what its solution means.

use super::forces::{Forces, Stand, step_n};
use super::influence::{ElasticKernel, modulus_of_confined_pa};
use super::solver::ElasticSolver;
use crate::columns::WinklerLayer;
use crate::envelope::{Envelope, Part, split_cell};
use crate::field::{ContactField, Patch, PosedMesh, Response, Wrench};
use crate::foam::{Foam, Most, check_cells, parameter};
use crate::prepared::PreparedMesh;
use crate::traction::{velocity_at, wrench};
use serde::{Deserialize, Serialize};
use spts_input::Refusal;
use spts_models::SkinLayout;

/// Parameters of [`ElasticField`]: those of [`Foam`], so that a scene can change only the model's name, and
/// some more. A missing one takes its value in [`ElasticConfig::default`].
///
/// [`ElasticField`]: super::ElasticField
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ElasticConfig {
    /// K, stiffness of the skin under uniform pressure, Pa/m; [1e4, 1e9]. It determines Young's modulus: E = K h (1 +
    /// ν)(1 − 2ν)/(1 − ν), also for the half-space.
    pub stiffness_pa_per_m: f64,
    /// τ, damping time of the Kelvin–Voigt material, s; [0, 0.02].
    pub damping_s: f64,
    /// h, thickness of the foam, m; [1e-4, 10].
    pub thickness_m: f64,
    /// ε_max, strain at which no pores are left (1 − relative density); [0.3, 1]. Not used if `densification` is off.
    pub max_strain: f64,
    /// Squares of the grid on which contact is computed, along one side of a taxel; [1, 64].
    pub cells_per_taxel: usize,
    /// μ, friction coefficient; [0, 5].
    pub friction: f64,
    /// v_reg, sliding speed below which friction is regularised, m/s; [1e-6, 1].
    pub friction_speed_m_per_s: f64,
    /// ν, Poisson's ratio; [0, 0.49].
    pub poisson: f64,
    /// Whether every time step solves the elastic problem. If not, the dynamics use a Winkler layer, and only frames
    /// have the elastic pressure, under the same force.
    pub coupled: bool,
    /// Bound on the estimated error of every pressure, relative to the largest pressure; [1e-12, 1e-2].
    pub tolerance: f64,
    /// Whether the foam densifies. Default: in a layer yes. A half-space never densifies.
    pub densification: Option<bool>,
}

impl Default for ElasticConfig {
    /// The skin of [`Foam::default`]; ν = 0.2, a foam in small compression (L. J. Gibson and M. F. Ashby,
    /// *Cellular Solids*, 2nd ed. (1997): 0.1–0.3).
    fn default() -> Self {
        let skin = Foam::default();
        Self {
            stiffness_pa_per_m: skin.stiffness_pa_per_m,
            damping_s: skin.damping_s,
            thickness_m: skin.thickness_m,
            max_strain: skin.max_strain,
            cells_per_taxel: skin.cells_per_taxel,
            friction: skin.friction,
            friction_speed_m_per_s: skin.friction_speed_m_per_s,
            poisson: 0.2,
            coupled: true,
            tolerance: 1e-6,
            densification: None,
        }
    }
}

/// Most fine cells of an elastic field: the transforms take about 100 bytes a cell.
const MAX_CELLS: Most = (1_048_576.0, "[1, 2^20] for an elastic field");

impl ElasticConfig {
    /// Checks every range.
    pub(crate) fn check(&self, bonded: bool, skin: &SkinLayout) -> Result<(), Refusal> {
        parameter("poisson", self.poisson, "[0, 0.49]")?;
        parameter("tolerance", self.tolerance, "[1e-12, 1e-2]")?;
        if self.densification == Some(true) && !bonded {
            let range = "false: a half-space has no thickness to be used up";
            return Err(Refusal::range("contact.densification", 1, range));
        }
        check_cells(skin, self.cells_per_taxel, MAX_CELLS)?;
        self.foam().check()
    }

    /// The foam alone.
    pub(crate) fn foam(&self) -> Foam {
        Foam {
            stiffness_pa_per_m: self.stiffness_pa_per_m,
            damping_s: self.damping_s,
            thickness_m: self.thickness_m,
            max_strain: self.max_strain,
            cells_per_taxel: self.cells_per_taxel,
            friction: self.friction,
            friction_speed_m_per_s: self.friction_speed_m_per_s,
        }
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

/// An overlap of this or less is no contact, m: of a pose 0.1 m from its origin, the last bits are a thousandth of it.
const GRAZE_M: f64 = 1e-14;

/// First step of the search for a depth, in thicknesses, and most solutions it may take.
const FIRST_STRIDE: f64 = 0.02;
const MOST_TRIALS: usize = 60;
/// From this trial on the bracket is halved, to less than 1e-9 of itself.
const TRIALS_BEFORE_BISECTION: usize = 30;

/// Error of an answer in units of the tolerance: the estimate of the error may be low by 2–3 near sharp edges, and
/// densification raises relative errors by up to 4 (slope × depth / pressure of the foam's law at its knee).
const ERROR_PER_TOLERANCE: f64 = 10.0;

/// Linear elastic skin (bonded layer or half-space) under the mesh's lower envelope, with damping, densification and
/// friction.
///
/// Contact without adhesion: p ≥ 0, and where p > 0 the surface follows the body, C p = δ + τ δ′. Damping of the
/// Kelvin–Voigt material is proportional to its elasticity, so the same kernel C describes both terms. This is exact
/// while the contact set does not change; the retarded motion of the free surface is neglected. A body with the surface
/// stiffness K_b yields by a further p/K_b at each cell.
///
/// Densification: the linear problem gives q; the pressure is p = f(q (1/K + 1/K_b)) with the foam law f of `winkler`.
/// This is exact for uniform pressure and for small strain. In between, the contact area is that of the linear problem,
/// and each cell stiffens by its own load. The approximation is good if lateral coupling is weak (ν ≤ 0.3, patches
/// wider than h).
///
/// The surface beside a load rises if ν exceeds about 0.2. Contact outside the geometric overlap is then searched down
/// to `Influence::bulge` × the depth, the rise beside a half-plane under uniform pressure.
///
/// If a pose or velocity is not finite, or the iteration does not converge, there is no answer: the pressure is 0 and
/// the wrench NaN, which stops the simulation. Without `coupled`, the same holds for a frame whose iteration fails. At
/// first touch, where the force of a moving body jumps from cell to cell, such a frame may instead have the pressure of
/// the dynamics.
///
/// Validity: small slopes; for the half-space, contact that is narrow compared with the thickness; the normal problem
/// neglects friction.
///
/// ```
/// use spts_contact::{PosedMesh, build_contact, mesh::cuboid};
/// use spts_models::SkinLayout;
///
/// let mut layer = build_contact("layer", toml::Table::new(), &SkinLayout::default())?;
/// let block = cuboid([30e-3, 30e-3, 10e-3]);
/// let answer = layer.respond(&PosedMesh::at_rest(&block, [0.0, 0.0, -0.5e-3]));
/// let cells = answer.pressure_pa.len().isqrt();
/// let row = &answer.pressure_pa[cells * cells / 2..][..cells];
/// let highest_pa = row.iter().copied().fold(0.0, f64::max);
/// assert!(highest_pa > 1.05 * row[cells / 2], "an elastic layer is pressed most at the edges of a flat punch");
/// # Ok::<(), spts_input::Refusal>(())
/// ```
pub struct ElasticField {
    config: ElasticConfig,
    /// The layer used by the dynamics without `coupled`.
    columns: Option<Columns>,
    solver: ElasticSolver,
    envelope: Envelope,
    /// Rise of the surface beside a load in units of the depth.
    bulge: f64,
    patch: Patch,
    target_m: Vec<f64>,
    /// Cells of the patch that are under the body in part, and their share.
    shares: Vec<(usize, f64)>,
    /// On the patch, then on the whole skin.
    patch_pa: Vec<f64>,
    pressure_pa: Vec<f64>,
    /// Depth to be added to the dynamics' pose at the last frame, m.
    shift_m: f64,
    /// Slope of the force there, N/m, once known.
    slope_n_per_m: Option<f64>,
    /// Pressures under some forces, and a frame between two of them: the pressure, and where there is any.
    forces: Forces,
    frame_pa: Vec<f64>,
    frame_patch: Patch,
    /// Why the last call had no answer.
    failure: Option<String>,
}

impl ElasticField {
    /// A bonded layer (if `bonded`) or a half-space under `skin`.
    ///
    /// # Errors
    /// [`Refusal`] if a parameter is outside its range, or the skin has more than 2²⁰ grid squares.
    pub fn new(config: ElasticConfig, bonded: bool, skin: &SkinLayout) -> Result<Self, Refusal> {
        config.check(bonded, skin)?;
        Self::unchecked(config, bonded, skin)
    }

    pub(super) fn unchecked(mut config: ElasticConfig, bonded: bool, skin: &SkinLayout) -> Result<Self, Refusal> {
        config.densification.get_or_insert(bonded);
        let (poisson, thickness_m) = (config.poisson, config.thickness_m);
        let modulus_pa = modulus_of_confined_pa(config.stiffness_pa_per_m, poisson, thickness_m);
        let kernel = if bonded {
            ElasticKernel::Layer { modulus_pa, poisson, thickness_m }
        } else {
            ElasticKernel::HalfSpace { modulus_pa, poisson }
        };
        let envelope = Envelope::new(skin, config.cells_per_taxel);
        let [rows, cols] = envelope.shape();
        let solver = ElasticSolver::new(kernel, [rows, cols], envelope.cell_m());
        let columns = (!config.coupled).then(|| Columns::new(config.foam(), skin, 1));
        Ok(Self {
            config,
            columns: columns.transpose()?,
            bulge: solver.bulge(),
            solver,
            patch: Patch::default(),
            target_m: Vec::new(),
            shares: Vec::new(),
            patch_pa: Vec::new(),
            pressure_pa: vec![0.0; rows * cols],
            envelope,
            shift_m: 0.0,
            slope_n_per_m: None,
            forces: Forces::default(),
            frame_pa: Vec::new(),
            frame_patch: Patch::default(),
            failure: None,
        })
    }

    /// Leaves the elastic pressure under the body as it is on the skin; the wrench, NaN without an answer (a body that
    /// is nowhere, an iteration that fails).
    fn elastic(&mut self, body: &PosedMesh<'_>) -> Wrench {
        self.failure = None;
        if self.solve(body, 0.0).is_none() {
            return Wrench::UNKNOWN;
        }
        self.spread(1.0);
        self.wrench(body)
    }

    /// Pressure on the skin when the body is moved along the normal until it carries `force_n`; `None` when it never
    /// does or no such pose is found.
    pub(super) fn carry(&mut self, body: &PosedMesh<'_>, force_n: f64) -> Option<&[f64]> {
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

    /// Leaves the pressure of a frame of a slow press in `frame_pa`: between those under a smaller and a larger force.
    /// `None` for a frame that stands for itself.
    fn interpolate(&mut self, body: &PosedMesh<'_>, carried_n: f64) -> Option<()> {
        if !self.envelope.knows(body.mesh) {
            self.forces.forget();
        }
        let stand = Stand::new(body, self.envelope.cell_m(), self.config.damping_s);
        let (steps, share) = self.forces.around(carried_n, stand)?;
        let stand = stand?;
        for step in steps {
            if self.forces.get(step, &stand).is_none() {
                let Some(reached_n) = self.balance(body, step_n(step)) else {
                    (self.shift_m, self.slope_n_per_m) = (0.0, None);
                    return None;
                };
                let scale = step_n(step) / reached_n;
                let pressure_pa = self.patch_pa.iter().map(|p| scale * p).collect();
                self.forces.insert(step, stand, self.patch, pressure_pa);
            }
        }
        let width = self.envelope.shape()[1];
        self.frame_pa.resize(self.pressure_pa.len(), 0.0);
        self.frame_patch.lines(width).for_each(|line| self.frame_pa[line].fill(0.0));
        self.frame_patch = Patch::default();
        for (step, share) in steps.into_iter().zip([1.0 - share, share]) {
            let known = self.forces.get(step, &stand)?;
            self.frame_patch.include(known.patch);
            let own = known.pressure_pa.chunks_exact(known.patch.width().max(1));
            for (line, own) in known.patch.lines(width).zip(own) {
                self.frame_pa[line].iter_mut().zip(own).for_each(|(p, own)| *p += share * own);
            }
        }
        Some(())
    }

    /// No answer, and why.
    fn fail<T>(&mut self, failure: String) -> Option<T> {
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
            return self.fail("pose or velocity of the body are not finite".to_owned());
        }
        let c = self.config;
        let margin_m = self.margin_m(body, shift_m);
        let [x, y, z] = body.position_m;
        let [lowest_m, _] = body.heights_m();
        let lowered = PosedMesh { position_m: [x, y, z - shift_m - margin_m], ..*body };
        self.clear();
        let seen = self.envelope.rasterise(&lowered);
        self.patch = self.contact_patch(seen);
        if self.patch == Patch::default() || shift_m - lowest_m - z <= GRAZE_M {
            self.patch = Patch::default();
            self.patch_pa.clear();
            self.solver.forget();
            return Some(0.0);
        }
        self.aim(body, margin_m, shift_m);
        let body_m_per_pa = 1.0 / body.stiffness_pa_per_m;
        self.solver.set_series(body_m_per_pa);
        if !self.solver.sink_shares(self.patch, &self.target_m, &self.shares, c.tolerance).converged {
            let bound = c.tolerance;
            return self
                .fail(format!("the elastic contact problem does not converge to `contact.tolerance` = {bound:e}"));
        }
        self.patch_pa.clear();
        self.patch_pa.extend_from_slice(self.solver.pressure_pa());
        if c.densification == Some(true) {
            let law = c.foam().law(body.stiffness_pa_per_m);
            let m_per_pa = 1.0 / c.stiffness_pa_per_m + body_m_per_pa;
            let mut shares = self.shares.iter().peekable();
            for (cell, p) in self.patch_pa.iter_mut().enumerate() {
                let share = shares.next_if(|(at, _)| *at == cell).map_or(1.0, |(_, share)| *share);
                *p = share * law.pressure_pa(*p / share * m_per_pa);
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
        let (last, depth_m) = (self.patch, self.envelope.depth_m());
        let found = seen.shrunk(self.envelope.shape()[1], |cell| depth_m[cell] > 0.0);
        let area = |p: Patch| p.height() * p.width();
        let patch = if found.is_empty() { found } else { found.rounded(self.envelope.shape()) };
        if last.holds(found) && 4 * area(last) <= 5 * area(patch) { last } else { patch }
    }

    /// Displacement wanted at each cell of the patch.
    fn aim(&mut self, body: &PosedMesh<'_>, margin_m: f64, shift_m: f64) {
        let width = self.envelope.shape()[1];
        let (com, tau_s) = (body.centre_of_mass_m, self.config.damping_s);
        self.target_m.clear();
        self.shares.clear();
        for (row, line) in (self.patch.rows[0]..).zip(self.patch.lines(width)) {
            let mut parts = self.envelope.parts(&line);
            for (col, cell) in (self.patch.cols[0]..).zip(line) {
                let mut lowered_m = self.envelope.depth_m()[cell];
                let own = split_cell(&mut parts, cell);
                if !own.is_empty() {
                    let (share, depth_m) = deepest(own, self.envelope.cell_m());
                    self.shares.push((self.target_m.len(), share));
                    lowered_m = depth_m;
                }
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
        for line in self.patch.lines(self.envelope.shape()[1]) {
            self.pressure_pa[line].fill(0.0);
        }
    }

    /// Spreads the patch's pressure, times `scale`, on the skin.
    fn spread(&mut self, scale: f64) {
        let lines = self.patch.lines(self.envelope.shape()[1]);
        for (to, from) in lines.zip(self.patch_pa.chunks_exact(self.patch.width().max(1))) {
            for (to, from) in self.pressure_pa[to].iter_mut().zip(from) {
                *to = scale * from;
            }
        }
    }

    fn wrench(&self, body: &PosedMesh<'_>) -> Wrench {
        let width = self.envelope.shape()[1];
        let margin_m = self.margin_m(body, 0.0);
        wrench(&self.envelope, self.patch, &self.patch_pa, body, &self.config.foam(), |row, col| {
            self.envelope.depth_m()[row * width + col] - margin_m
        })
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
            let (moved, other) = if over_n > 0.0 { (&mut high, &mut low) } else { (&mut low, &mut high) };
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
        self.fail(format!(
            "no depth found at which the elastic skin carries {force_n:e} N; the last one carries {reached_n:e} N"
        ))
    }
}

/// Share and mean depth, m, of the parts of a cell that are less than a cell above the deepest: what is higher does not
/// touch a surface that follows the deepest.
fn deepest(parts: &[Part], cell_m: f64) -> (f64, f64) {
    let deepest_m = parts.iter().map(|part| part.depth_m).fold(f64::NEG_INFINITY, f64::max);
    let near = parts.iter().filter(|part| part.depth_m > deepest_m - cell_m);
    let [share, moment] = near.fold([0.0; 2], |sum, p| [sum[0] + p.share, sum[1] + p.share * p.depth_m]);
    (share.min(1.0), moment / share)
}

/// Columns for the dynamics. Under a body that is announced and wide their cells may be larger than those of the
/// frames: a rim counts by what it covers of them.
struct Columns {
    skin: SkinLayout,
    layer: WinklerLayer,
    /// Cells of the elastic field along a cell of the columns; above 1, the pressure on those.
    finer: usize,
    spread_pa: Vec<f64>,
    patch: Patch,
}

/// Least cells of the columns along one side of a taxel, and along the second of the three sides of a body.
const COLUMN_CELLS: usize = 6;
const BODY_CELLS: f64 = 10.0;

impl Columns {
    fn new(foam: Foam, skin: &SkinLayout, finer: usize) -> Result<Self, Refusal> {
        let layer = WinklerLayer::new(Foam { cells_per_taxel: foam.cells_per_taxel / finer, ..foam }, skin)?;
        let count = if finer > 1 { layer.pressure_pa.len() * finer * finer } else { 0 };
        Ok(Self { skin: *skin, layer, finer, spread_pa: vec![0.0; count], patch: Patch::default() })
    }

    /// The columns for bodies of a mesh: on the largest cells that divide into those of the frames.
    fn expect(&mut self, foam: Foam, mesh: &PreparedMesh) {
        let (cells, pitch_m) = (foam.cells_per_taxel, self.skin.pitch_m());
        let (low, high) = mesh.bounds().unwrap_or_default();
        let mut sides = [0, 1, 2].map(|k| high[k] - low[k]);
        sides.sort_by(f64::total_cmp);
        // of a plate or a blade the smallest is its thickness
        let wide = |own: &usize| *own as f64 * sides[1] >= BODY_CELLS * pitch_m;
        let own = (COLUMN_CELLS..=cells).find(|own| cells % own == 0 && wide(own)).unwrap_or(cells);
        if cells / own != self.finer
            && let Ok(columns) = Self::new(foam, &self.skin, cells / own)
        {
            *self = columns;
        }
        self.layer.expect(mesh);
    }

    fn respond(&mut self, body: &PosedMesh<'_>) -> Wrench {
        let wrench = self.layer.respond(body).wrench;
        if self.finer > 1 {
            let (finer, width) = (self.finer, self.layer.x_m.len());
            self.patch.lines(finer * width).for_each(|line| self.spread_pa[line].fill(0.0));
            let own = self.layer.patch;
            self.patch = Patch { rows: own.rows.map(|i| i * finer), cols: own.cols.map(|i| i * finer) };
            for (row, line) in (self.patch.rows[0]..).zip(self.patch.lines(finer * width)) {
                let from = &self.layer.pressure_pa[row / finer * width..][own.cols[0]..own.cols[1]];
                let cells = self.spread_pa[line].chunks_exact_mut(finer);
                cells.zip(from).for_each(|(cells, p)| cells.fill(*p));
            }
        }
        wrench
    }

    fn pressure_pa(&self) -> &[f64] {
        if self.finer > 1 { &self.spread_pa } else { &self.layer.pressure_pa }
    }
}

impl ContactField for ElasticField {
    fn expect(&mut self, mesh: &PreparedMesh) {
        if !self.envelope.knows(mesh) {
            self.forces.forget();
        }
        self.envelope.expect(mesh);
        if let Some(columns) = &mut self.columns {
            columns.expect(self.config.foam(), mesh);
        }
    }

    fn respond(&mut self, body: &PosedMesh<'_>) -> Response<'_> {
        let wrench = match &mut self.columns {
            Some(columns) => columns.respond(body),
            None => self.elastic(body),
        };
        let (pressure_pa, patch) = match &self.columns {
            // a frame's pressure may reach further than the dynamics' own
            Some(columns) => (columns.pressure_pa(), None),
            None => (&self.pressure_pa[..], Some(self.patch)),
        };
        Response { wrench, pressure_pa, patch }
    }

    fn failure(&self) -> Option<String> {
        self.failure.clone()
    }

    fn refine(&mut self, body: &PosedMesh<'_>, force_n: f64) -> Option<&[f64]> {
        self.columns.as_ref()?;
        self.failure = None;
        match self.interpolate(body, force_n) {
            Some(()) => Some(&self.frame_pa),
            None => self.carry(body, force_n),
        }
    }

    fn tolerance(&self) -> f64 {
        if self.config.coupled { ERROR_PER_TOLERANCE * self.config.tolerance } else { 0.0 }
    }

    fn cells_per_taxel(&self) -> usize {
        self.config.cells_per_taxel
    }

    fn parameters(&self) -> toml::Table {
        // a struct of plain numbers always serialises to a table
        toml::Table::try_from(self.config).unwrap_or_default()
    }

    fn damping_s(&self) -> f64 {
        self.config.damping_s
    }

    fn thickness_m(&self) -> f64 {
        self.config.thickness_m
    }
}
