//! Quasi-static contact: the pose in which the columns carry a load, without time steps.

use super::winkler::{MAX_CELLS, Shares, WinklerLayer};
use crate::field::{
    Balance, ContactField, EquilibriumError, Holder, Load, Patch, PosedMesh, QuasiStatic, Response, Seat, Wrench,
    depth_limit_m,
};
use crate::foam::{Foam, FoamLaw};
use crate::prepared::PreparedMesh;
use crate::traction::{dot, sum};
use nalgebra::{Matrix3, Rotation3, Vector3};
use spts_input::Refusal;
use spts_models::SkinLayout;

/// Pressure and its slope on the cells of one row.
#[derive(Debug, Clone, Default)]
pub(super) struct Row {
    pub(super) arm_m: Vec<f64>,
    pub(super) pressure_pa: Vec<f64>,
    pub(super) slope_pa_per_m: Vec<f64>,
}

/// One balance to be found: the columns' law, the load, and the height from which heights are counted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Task<'a> {
    pub(super) law: FoamLaw,
    pub(super) load: &'a Load,
    /// Height of the origin at which the untilted body touches, m. Where the origin is far from the face, the state's z
    /// is small compared with this height, and small numbers resolve small forces: rounding z changes the force by at
    /// most K A ulp(z).
    pub(super) base_m: f64,
    /// Stiffness of the body's surface, Pa/m; ∞ for a rigid one.
    pub(super) body_pa_per_m: f64,
}

/// Gradient and Hessian of the potential over (z, θx, θy): N and N m.
#[derive(Debug, Clone, Copy)]
pub(super) struct Potential {
    pub(super) gradient: Vector3<f64>,
    pub(super) hessian: Matrix3<f64>,
}

/// What may be left besides, in round-offs of the state: half an ulp each of the state, of z + θ y and of the depth,
/// and as much again.
const ROUND_OFFS: f64 = 4.0;

impl Row {
    pub(super) fn resize(&mut self, width: usize) {
        self.pressure_pa.resize(width, 0.0);
        self.slope_pa_per_m.resize(width, 0.0);
    }

    /// Pressures of the `law` of every cell at the depths drop − base − height + turn · arm.
    #[inline]
    pub(super) fn press(
        &mut self,
        base_m: f64,
        [height_m, turn_rad]: [f64; 2],
        drop_m: &[f64],
        shares: Shares<'_>,
        law: impl Fn(usize, f64) -> (f64, f64),
    ) {
        let cells = self.pressure_pa.iter_mut().zip(&mut self.slope_pa_per_m);
        for (k, (((p, s), drop_m), arm_m)) in cells.zip(drop_m).zip(&self.arm_m).enumerate() {
            let depth_m = (drop_m - base_m) - height_m + turn_rad * arm_m;
            (*p, *s) = law(k, depth_m);
        }
        shares.fill([&mut self.pressure_pa, &mut self.slope_pa_per_m], |k, drop_m| {
            let (p, s) = law(k, (drop_m - base_m) - height_m + turn_rad * self.arm_m[k]);
            [p, s]
        });
    }
}

impl Potential {
    /// Force that is not balanced, N: moments count by the lever `reach_m`.
    pub(super) fn left_n(&self, reach_m: f64) -> f64 {
        self.gradient.component_div(&Vector3::new(1.0, reach_m, reach_m)).amax()
    }

    /// What rounding `state` does to [`Potential::left_n`], N.
    pub(super) fn round_off_n(&self, state: &Vector3<f64>, reach_m: f64) -> f64 {
        let h = |i: usize| self.hessian[(i, i)];
        let tilts_rad = state[1].abs() + state[2].abs();
        let by_tilt = h(0) * reach_m + h(1).max(h(2)) / reach_m;
        ROUND_OFFS * 0.5 * f64::EPSILON * (h(0) * state[0].abs() + by_tilt * tilts_rad)
    }

    pub(super) fn hold(&mut self, holder: Holder, state: Vector3<f64>) {
        match holder {
            Holder::Rigid => {
                self.gradient = Vector3::new(self.gradient[0], 0.0, 0.0);
                self.hessian = Matrix3::from_diagonal(&Vector3::new(self.hessian[(0, 0)], 1.0, 1.0));
            }
            Holder::Elastic { stiffness_nm_per_rad: k, rest_rad } => {
                let off = [state[1] - rest_rad[0], state[2] - rest_rad[1]];
                for (i, k) in (1..).zip(k) {
                    self.gradient[i] += k[0] * off[0] + k[1] * off[1];
                    self.hessian[(i, 1)] += k[0];
                    self.hessian[(i, 2)] += k[1];
                }
            }
        }
    }
}

/// Elastic columns under the mesh's lower envelope, as [`WinklerLayer`] without its rates, that also find the pose in
/// which they carry a load ([`QuasiStatic`]).
///
/// With z the height of the body above the touch and θ its small tilts, the depth of a column at r from the load's axis
/// is linear, d = −h(r) − z − (θ × r)_z, and the pressure p(d) increases with it. So height and tilts minimise the
/// convex potential Σ A ∫p dd + F z + ½ (θ − θ₀)ᵀ k (θ − θ₀), which a damped Newton iteration finds on one height map.
/// Neglected: the shift θ d of the outline and friction.
///
/// Takes the parameters of [`Foam`], so that only the model's name changes in a scene; `damping_s`, `friction`
/// and `friction_speed_m_per_s` are checked and kept, and do nothing.
#[derive(Debug, Clone)]
pub(crate) struct Footprint {
    config: Foam,
    layer: WinklerLayer,
    row: Row,
}

/// Largest tilt for which sin θ = θ to 0.2 %, rad.
const MAX_TILT_RAD: f64 = 0.1;
/// What may be left of the force, relative to it: a hundred times the round-off of a sum of 1e4 cells.
const TOLERANCE: f64 = 1e-12;
const MAX_ITERATIONS: usize = 80;
/// First trial depth, m: a few newtons on foam.
const FIRST_DEPTH_M: f64 = 5e-4;
/// Exponent p of F ∝ d^p between which that of a body lies: a flat one has 1, a ball 2. The next trial depth follows
/// from it, within these factors of the last.
const EXPONENT: f64 = 1.5;
const GROWTH: [f64; 2] = [1.2, 8.0];
/// What may be left of the force, relative to it, before the tilts are looked for: from there on Newton's iteration
/// finds height and tilts together.
const ROUGH: f64 = 0.1;

impl Footprint {
    /// Layer under `skin`.
    ///
    /// # Errors
    /// [`Refusal`] when a parameter is outside its range.
    pub(crate) fn new(config: Foam, skin: &SkinLayout) -> Result<Self, Refusal> {
        // checked as they are, used without rates
        config.check_on(skin, MAX_CELLS)?;
        let elastic = Foam { damping_s: 0.0, friction: 0.0, ..config };
        Ok(Self { config, layer: WinklerLayer::new(elastic, skin)?, row: Row::default() })
    }

    /// Potential at `state` = (z, θx, θy); also leaves the pressure in the layer when `keep`.
    fn potential(&mut self, task: &Task<'_>, state: Vector3<f64>, keep: bool) -> Potential {
        let load = task.load;
        let (map, width) = (self.layer.envelope.map(), self.layer.envelope.shape()[1]);
        let patch = map.patch();
        let [px, py] = load.axis_m;
        let row = &mut self.row;
        row.resize(patch.width());
        row.arm_m.clear();
        row.arm_m.extend(self.layer.x_m[patch.cols[0]..patch.cols[1]].iter().map(|x| x - px));
        let (mut g, mut h) = ([0.0; 3], [0.0; 6]);
        for (i, drops) in (patch.rows[0]..).zip(map.drop_m().chunks_exact(patch.width().max(1))) {
            let ry = self.layer.envelope.centre_m(i, 0)[1] - py;
            let height_m = state[0] + state[1] * ry;
            let start = i * width + patch.cols[0];
            let seat = [height_m, state[2]];
            let line = start..start + drops.len();
            let shares = Shares { parts: self.layer.envelope.map_parts(&line), first: start };
            match &self.layer.preload {
                None => row.press(task.base_m, seat, drops, shares, |_, depth_m| task.law.pressure_and_slope(depth_m)),
                Some(preload) => {
                    let preload = preload.row(line, task.body_pa_per_m);
                    let law = |k, depth_m| preload.pressure_and_slope(k, &task.law, depth_m);
                    row.press(task.base_m, seat, drops, shares, law);
                }
            }
            let (p, s) = (&row.pressure_pa, &row.slope_pa_per_m);
            if keep {
                self.layer.pressure_pa[start..start + p.len()].copy_from_slice(p);
            }
            let (p0, p1, s0, s1) = (sum(p), dot(p, &row.arm_m), sum(s), dot(s, &row.arm_m));
            // ∂d/∂(z, θx, θy) = (−1, −ry, rx)
            g[0] -= p0;
            g[1] -= ry * p0;
            g[2] += p1;
            let s2: f64 = row.arm_m.iter().zip(s).map(|(x, s)| x * x * s).sum();
            for (total, part) in h.iter_mut().zip([s0, ry * s0, -s1, ry * ry * s0, -ry * s1, s2]) {
                *total += part;
            }
        }
        let cell_m = self.layer.envelope.cell_m();
        let (g, h) = (g.map(|g| g * cell_m * cell_m), h.map(|h| h * cell_m * cell_m));
        let mut potential = Potential {
            gradient: Vector3::new(g[0] + load.force_n, g[1], g[2]),
            hessian: Matrix3::new(h[0], h[1], h[2], h[1], h[3], h[4], h[2], h[4], h[5]),
        };
        potential.hold(load.holder, state);
        potential
    }

    /// Height at which the body touches with these tilts, m; `None` when no cell is under it.
    fn touch_m(&self, task: &Task<'_>, tilt_rad: [f64; 2]) -> Option<f64> {
        let map = self.layer.envelope.map();
        let mut touch_m = f64::NEG_INFINITY;
        for (row, drops) in (map.patch().rows[0]..).zip(map.drop_m().chunks_exact(map.patch().width().max(1))) {
            for (col, drop_m) in (map.patch().cols[0]..).zip(drops) {
                let [x, y] = self.layer.envelope.centre_m(row, col);
                let [rx, ry] = [x - task.load.axis_m[0], y - task.load.axis_m[1]];
                touch_m = touch_m.max((drop_m - task.base_m) - tilt_rad[0] * ry + tilt_rad[1] * rx);
            }
        }
        touch_m.is_finite().then_some(touch_m)
    }

    /// Height at which the body roughly carries the force with its tilts fixed, by Newton's steps inside a shrinking
    /// bracket; the lowest one, `limit_m` below the touch, when it carries less there.
    fn height(&mut self, task: &Task<'_>, tilt_rad: [f64; 2], limit_m: f64) -> Result<f64, EquilibriumError> {
        let Some(touch_m) = self.touch_m(task, tilt_rad) else {
            return Err(EquilibriumError::Beside { depth_m: limit_m });
        };
        let state = |z: f64| Vector3::new(z, tilt_rad[0], tilt_rad[1]);
        let (mut high_m, mut depth_m) = (touch_m, FIRST_DEPTH_M);
        let mut here = loop {
            let here = self.potential(task, state(touch_m - depth_m), false);
            if here.gradient[0] <= 0.0 {
                break here;
            }
            if depth_m >= limit_m {
                return Ok(touch_m - depth_m);
            }
            high_m = touch_m - depth_m;
            let carried = 1.0 - here.gradient[0] / task.load.force_n;
            let growth = carried.powf(-1.0 / EXPONENT).clamp(GROWTH[0], GROWTH[1]);
            depth_m = (growth * depth_m).min(limit_m);
        };
        let mut low_m = touch_m - depth_m;
        let mut z = low_m;
        for _ in 0..MAX_ITERATIONS {
            if here.gradient[0].abs() <= ROUGH * task.load.force_n {
                break;
            }
            let step = z - here.gradient[0] / here.hessian[(0, 0)];
            z = if step > low_m && step < high_m { step } else { 0.5 * (low_m + high_m) };
            here = self.potential(task, state(z), false);
            if here.gradient[0] > 0.0 {
                high_m = z;
            } else {
                low_m = z;
            }
        }
        Ok(z)
    }

    /// Newton's iteration over height and tilts, steps halved until they do not overshoot by much.
    fn settle(&mut self, task: &Task<'_>, mut state: Vector3<f64>) -> Result<Vector3<f64>, EquilibriumError> {
        let (force_n, reach_m) = (task.load.force_n, self.reach_m(task.load));
        let mut here = self.potential(task, state, false);
        for _ in 0..MAX_ITERATIONS {
            if here.left_n(reach_m) <= TOLERANCE * force_n + here.round_off_n(&state, reach_m) {
                return Ok(state);
            }
            let Some(factor) = here.hessian.cholesky() else {
                break;
            };
            let step = -factor.solve(&here.gradient);
            let slope = here.gradient.dot(&step).abs();
            let mut share = 1.0;
            let next = loop {
                let next = self.potential(task, state + share * step, false);
                if next.gradient.dot(&step) <= 0.9 * slope || share < 1e-9 {
                    break next;
                }
                share *= 0.5;
            };
            state += share * step;
            here = next;
        }
        let residual_n = here.left_n(reach_m);
        Err(Refusal::new(format!(
            "no equilibrium at {force_n:.4e} N after {MAX_ITERATIONS} iterations: residual force {residual_n:.3e} N"
        ))
        .into())
    }

    /// Whether the balance is one for which this is meant: small tilts, and no deeper than `limit_m`.
    fn admit(&mut self, task: &Task<'_>, state: Vector3<f64>, limit_m: f64) -> Result<(), EquilibriumError> {
        let (force_n, tilt_rad) = (task.load.force_n, [state[1], state[2]]);
        let size_rad = tilt_rad[0].hypot(tilt_rad[1]);
        if size_rad > MAX_TILT_RAD {
            return Err(Refusal::new(format!(
                "{force_n:.4e} N tilt the body by {size_rad:.3} rad, outside [0, {MAX_TILT_RAD}]: it tips over"
            ))
            .into());
        }
        let touch_m = self.touch_m(task, tilt_rad).unwrap_or(f64::NEG_INFINITY);
        // round-off of the height at which the search for one ends
        if touch_m - state[0] <= limit_m * (1.0 + TOLERANCE) {
            return Ok(());
        }
        let deepest = Vector3::new(touch_m - limit_m, state[1], state[2]);
        let reached_n = force_n - self.potential(task, deepest, false).gradient[0];
        Err(EquilibriumError::Force { reached_n, wanted_n: force_n, depth_m: limit_m })
    }

    /// Farthest cell of the map from the load's axis, m: the lever that makes moments forces.
    fn reach_m(&self, load: &Load) -> f64 {
        let Patch { rows, cols } = self.layer.envelope.map().patch();
        let corners = [(rows[0], cols[0]), (rows[1], cols[1]), (rows[0], cols[1]), (rows[1], cols[0])];
        let far = corners.map(|(row, col)| {
            let [x, y] = self.layer.envelope.centre_m(row, col);
            (x - load.axis_m[0]).hypot(y - load.axis_m[1])
        });
        far.into_iter().fold(self.layer.envelope.cell_m(), f64::max)
    }
}

impl QuasiStatic for Footprint {
    fn carry(&mut self, body: &PosedMesh<'_>, load: &Load) -> Result<Balance<'_>, EquilibriumError> {
        let force_n = load.force_n;
        if !(force_n > 0.0 && force_n.is_finite()) {
            return Err(EquilibriumError::load(force_n));
        }
        let c = &self.config;
        let law = c.law(body.stiffness_pa_per_m);
        self.layer.clear();
        self.layer.envelope.make_map(body);
        let rest_rad = match load.holder {
            Holder::Rigid => [0.0; 2],
            Holder::Elastic { rest_rad, .. } => rest_rad,
        };
        let limit_m = depth_limit_m(body);
        let drops = self.layer.envelope.map().drop_m().iter();
        let base_m = drops.copied().fold(f64::NEG_INFINITY, f64::max);
        if !base_m.is_finite() {
            return Err(EquilibriumError::Beside { depth_m: limit_m });
        }
        let task = Task { law, load, base_m, body_pa_per_m: body.stiffness_pa_per_m };
        let started = load.from.map(|seat| {
            let tilt_rad = match load.holder {
                Holder::Rigid => rest_rad,
                Holder::Elastic { .. } => seat.tilt_rad,
            };
            let state = Vector3::new(seat.height_m - base_m, tilt_rad[0], tilt_rad[1]);
            self.settle(&task, state)
        });
        let state = if let Some(Ok(state)) = started {
            state
        } else {
            let z = self.height(&task, rest_rad, limit_m)?;
            self.settle(&task, Vector3::new(z, rest_rad[0], rest_rad[1]))?
        };
        self.admit(&task, state, limit_m)?;
        let seat = Seat { height_m: base_m + state[0], tilt_rad: [state[1], state[2]] };
        let free = Load { holder: Holder::Elastic { stiffness_nm_per_rad: [[0.0; 2]; 2], rest_rad }, ..*load };
        let rest = self.potential(&Task { load: &free, ..task }, state, true);
        self.layer.patch = self.layer.envelope.map().patch();
        let (rotation, position_m, centre_m) = seated(body, load, &seat);
        // moments about the load's axis at z = 0, then about the centre of mass
        let (up_n, mx, my) = (force_n - rest.gradient[0], -rest.gradient[1], -rest.gradient[2]);
        let arm = [load.axis_m[0] - centre_m[0], load.axis_m[1] - centre_m[1]];
        Ok(Balance {
            seat,
            rotation,
            position_m,
            response: Response {
                wrench: Wrench { force_n: [0.0, 0.0, up_n], torque_nm: [mx + arm[1] * up_n, my - arm[0] * up_n, 0.0] },
                pressure_pa: &self.layer.pressure_pa,
                patch: Some(self.layer.patch),
            },
        })
    }
}

/// Rotation, position and centre of mass of `body` in its seat.
fn seated(body: &PosedMesh<'_>, load: &Load, seat: &Seat) -> ([[f64; 3]; 3], [f64; 3], [f64; 3]) {
    let turn = Rotation3::from_scaled_axis(Vector3::new(seat.tilt_rad[0], seat.tilt_rad[1], 0.0));
    let rotation = turn.matrix() * Matrix3::from_fn(|i, j| body.rotation[i][j]);
    let pivot = Vector3::new(load.axis_m[0], load.axis_m[1], 0.0);
    let [x, y, z] = body.position_m;
    let centre = Vector3::from(body.centre_of_mass_m) - Vector3::new(x, y, z);
    let position = pivot + turn * (Vector3::new(x, y, seat.height_m) - pivot);
    let centre_m = position + turn * centre;
    (rotation.transpose().into(), position.into(), centre_m.into())
}

impl ContactField for Footprint {
    fn expect(&mut self, mesh: &PreparedMesh) {
        self.layer.envelope.expect(mesh);
    }

    fn respond(&mut self, body: &PosedMesh<'_>) -> Response<'_> {
        self.layer.respond(body)
    }

    fn preload(&mut self, strain: &[f64]) -> Option<Vec<f64>> {
        self.layer.preload(strain)
    }

    fn quasi_static(&mut self) -> Option<&mut dyn QuasiStatic> {
        Some(self)
    }

    fn cells_per_taxel(&self) -> usize {
        self.config.cells_per_taxel
    }

    fn parameters(&self) -> toml::Table {
        toml::Table::try_from(self.config).unwrap_or_default()
    }

    fn thickness_m(&self) -> f64 {
        self.config.thickness_m
    }
}
