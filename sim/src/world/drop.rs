//! The fall of the ball, and its bounces.

use crate::mechanics::{DropConfig, GRAVITY_M_PER_S2, Mechanics};
use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};
use spts_contact::Wrench;
use spts_models::{SkinLayout, Streams};

/// One contact of the ball with the skin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounce {
    /// First instant with a force, s.
    pub start_s: f64,
    /// Time with a force, s.
    pub contact_s: f64,
    /// Speed towards the skin before the contact, m/s.
    pub speed_in_m_per_s: f64,
    /// Speed away from the skin after the contact, m/s.
    pub speed_out_m_per_s: f64,
    /// Largest normal force, N.
    pub peak_force_n: f64,
    /// Energy the ball lost (kinetic and potential), J.
    pub lost_j: f64,
    /// Work of the ball against the contact force, J. It equals the loss up to the error of the integration.
    pub work_j: f64,
}

impl Bounce {
    /// Coefficient of restitution.
    pub fn restitution(&self) -> f64 {
        self.speed_out_m_per_s / self.speed_in_m_per_s
    }
}

/// Where a drop starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Start {
    /// Time of release, s.
    pub(crate) release_s: f64,
    /// Centre, m.
    pub(crate) centre_m: [f64; 3],
    /// Orientation (w, x, y, z).
    pub(crate) quaternion: [f64; 4],
}

impl Start {
    /// Start of drop `index`.
    pub(crate) fn new(scene: &Mechanics, config: &DropConfig, index: u64) -> Self {
        let mut rng = Streams::new(scene.seed()).rng("drop", index);
        let release_s = config.release_s + config.release_spread_s * (2.0 * rng.random::<f64>() - 1.0);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let [x, y] = scene.skin().position_m(config.row.unwrap_or_default(), config.col.unwrap_or_default());
        let centre_m = [
            x + config.position_sd_m * normal(),
            y + config.position_sd_m * normal(),
            config.height_m + config.radius_m,
        ];
        // four normal numbers, normalised, are a uniform orientation
        let q: [f64; 4] = std::array::from_fn(|_| normal());
        let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
        Self { release_s, centre_m, quaternion: q.map(|v| v / norm) }
    }
}

/// Follows the ball and notes its bounces.
#[derive(Debug, Clone)]
pub(crate) struct BounceLog {
    mass_kg: f64,
    last: Option<Sample>,
    open: Option<Bounce>,
    energy_in_j: f64,
    pub(crate) done: Vec<Bounce>,
}

/// State of the ball at one step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    pub(crate) time_s: f64,
    pub(crate) height_m: f64,
    pub(crate) velocity_m_per_s: [f64; 3],
    pub(crate) force_n: [f64; 3],
}

impl BounceLog {
    pub(crate) fn new(mass_kg: f64) -> Self {
        Self { mass_kg, last: None, open: None, energy_in_j: 0.0, done: Vec::with_capacity(64) }
    }

    /// The first bounce; while it lasts, as far as it is known.
    pub(crate) fn first(&self) -> Option<Bounce> {
        self.done.first().copied().or(self.open)
    }

    fn energy_j(&self, s: &Sample) -> f64 {
        let speed2: f64 = s.velocity_m_per_s.iter().map(|v| v * v).sum();
        self.mass_kg * (0.5 * speed2 + GRAVITY_M_PER_S2 * s.height_m)
    }

    pub(crate) fn push(&mut self, now: Sample) {
        if let (Some(bounce), Some(last)) = (&mut self.open, &self.last) {
            // the velocity is updated first, so F · (v + v′)/2 dt is exactly the change of kinetic energy
            let power: f64 =
                (0..3).map(|i| last.force_n[i] * 0.5 * (last.velocity_m_per_s[i] + now.velocity_m_per_s[i])).sum();
            bounce.work_j -= power * (now.time_s - last.time_s);
            bounce.peak_force_n = bounce.peak_force_n.max(now.force_n[2]);
        }
        match self.open {
            None if now.force_n[2] > 0.0 => {
                self.energy_in_j = self.energy_j(&now);
                self.open = Some(Bounce {
                    start_s: now.time_s,
                    contact_s: 0.0,
                    speed_in_m_per_s: -now.velocity_m_per_s[2],
                    speed_out_m_per_s: 0.0,
                    peak_force_n: now.force_n[2],
                    lost_j: 0.0,
                    work_j: 0.0,
                });
            }
            Some(mut bounce) if now.force_n[2] <= 0.0 => {
                bounce.contact_s = now.time_s - bounce.start_s;
                bounce.speed_out_m_per_s = now.velocity_m_per_s[2];
                bounce.lost_j = self.energy_in_j - self.energy_j(&now);
                self.done.push(bounce);
                self.open = None;
            }
            _ => {}
        }
        self.last = Some(now);
    }
}

// The wrench of the skin on a smooth, free ball.
//
// A contact field works for any mesh: its pressure acts along the skin's normal, and friction depends on the velocity
// at the start of a time step. A free ball needs more care. Vertical pressures off its centre would rotate the ball,
// which real pressures cannot do, and would give it energy at the skin's rim. Constant friction over a whole step
// would make the slip oscillate with growing amplitude.

/// Motion of the ball at the start of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct BallMotion {
    /// Centre, m.
    pub(super) centre_m: [f64; 3],
    /// Velocity of the centre, m/s.
    pub(super) velocity_m_per_s: [f64; 3],
    /// Angular velocity, world axes, rad/s.
    pub(super) angular_velocity_rad_per_s: [f64; 3],
}

/// A smooth ball over the fine cells of a skin.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ball {
    pub(super) mass_kg: f64,
    pub(super) radius_m: f64,
    cells: [usize; 2],
    cell_m: f64,
    /// x of the centre of column 0 and y of the centre of row 0; y falls with the row.
    first_m: [f64; 2],
}

/// What the pressure does to the ball, all forces over cells of one area.
#[derive(Debug, Clone, Copy, Default)]
struct PressureSums {
    /// Σ p A, N.
    force_n: f64,
    /// Σ p A x and Σ p A y about the centre, N m.
    moment_nm: [f64; 2],
    /// Σ p A x/h and Σ p A y/h, N, where h is the height of the centre above the surface at that point.
    side_n: [f64; 2],
    /// Σ p A h, N m.
    height_nm: f64,
}

/// Steepest part of the sphere that is told apart: h is at least this share of the radius (84° from the normal).
const STEEPEST: f64 = 0.1;

impl Ball {
    /// Ball of this mass and radius over `skin` in cells of a `cells_per_taxel`th of a taxel.
    pub(super) fn new(mass_kg: f64, radius_m: f64, skin: &SkinLayout, cells_per_taxel: usize) -> Self {
        let cell_m = skin.pitch_m() / cells_per_taxel as f64;
        let [width_m, height_m] = skin.extent_m();
        Self {
            mass_kg,
            radius_m,
            cells: [skin.rows() * cells_per_taxel, skin.cols() * cells_per_taxel],
            cell_m,
            first_m: [0.5 * (cell_m - width_m), 0.5 * (height_m - cell_m)],
        }
    }

    /// What a field's answer about the centre, `wrench` with its `pressure_pa`, does to the ball in a step of `dt_s`.
    ///
    /// Pressure: on a smooth sphere its traction is along the surface's normal, through the centre: p (−x/h, −y/h, 1)
    /// at (x, y, −h) from the centre, h = √(R² − x² − y²), and no torque. So it is the gradient of the energy in the
    /// foam, also over the skin's rim.
    ///
    /// Friction: with F = −c v the slip v of the contact changes by −dt b c v, b = 1/m + h²/I. Taken at the end of the
    /// step, v′ = v − dt b c v′, the force is F/(1 + dt b c): it never turns the slip round. Likewise for the spin
    /// about the normal. Both equal the field's own friction as dt → 0.
    pub(super) fn wrench(&self, wrench: &Wrench, pressure_pa: &[f64], motion: &BallMotion, dt_s: f64) -> Wrench {
        let ([fx, fy, fz], [tx, ty, tz]) = (wrench.force_n, wrench.torque_nm);
        if fz <= 0.0 {
            return *wrench;
        }
        let sums = self.sums(pressure_pa, motion.centre_m);
        if sums.force_n <= 0.0 {
            return *wrench;
        }
        // a thin shell
        let inertia = 2.0 / 3.0 * self.mass_kg * self.radius_m * self.radius_m;
        let arm_m = sums.height_nm / sums.force_n;
        let ([vx, vy, _], [wx, wy, wz]) = (motion.velocity_m_per_s, motion.angular_velocity_rad_per_s);
        // ω × r at r = (0, 0, −h)
        let slip = [vx - wy * arm_m, vy + wx * arm_m];
        let mobility = 1.0 / self.mass_kg + arm_m * arm_m / inertia;
        let share = implicit_share(dt_s * mobility, [fx, fy], slip);
        let spin_share = implicit_share(dt_s / inertia, [tz, 0.0], [wz, 0.0]);
        let [mx, my] = sums.moment_nm;
        Wrench {
            force_n: [share * fx - sums.side_n[0], share * fy - sums.side_n[1], fz],
            torque_nm: [share * (tx - my), share * (ty + mx), spin_share * tz],
        }
    }

    /// Sums over the cells under the ball.
    #[expect(clippy::cast_possible_truncation, reason = "indices are cut to the grid before they are cast")]
    fn sums(&self, pressure_pa: &[f64], centre_m: [f64; 3]) -> PressureSums {
        let span = |middle_m: f64, cells: usize| {
            let low = ((middle_m - self.radius_m) / self.cell_m).ceil().max(0.0);
            let end = ((middle_m + self.radius_m) / self.cell_m).floor() + 1.0;
            [low as usize, end.clamp(0.0, cells as f64) as usize]
        };
        let rows = span(self.first_m[1] - centre_m[1], self.cells[0]);
        let cols = span(centre_m[0] - self.first_m[0], self.cells[1]);
        let mut sums = PressureSums::default();
        let area_m2 = self.cell_m * self.cell_m;
        let least = STEEPEST * STEEPEST * self.radius_m * self.radius_m;
        for row in rows[0]..rows[1] {
            let y = self.first_m[1] - row as f64 * self.cell_m - centre_m[1];
            for col in cols[0]..cols[1] {
                let force_n = pressure_pa[row * self.cells[1] + col] * area_m2;
                if force_n > 0.0 {
                    let x = self.first_m[0] + col as f64 * self.cell_m - centre_m[0];
                    let height_m = (self.radius_m * self.radius_m - x * x - y * y).max(least).sqrt();
                    sums.force_n += force_n;
                    sums.moment_nm[0] += force_n * x;
                    sums.moment_nm[1] += force_n * y;
                    sums.side_n[0] += force_n * x / height_m;
                    sums.side_n[1] += force_n * y / height_m;
                    sums.height_nm += force_n * height_m;
                }
            }
        }
        sums
    }
}

/// 1/(1 + s c) for the drag c that takes the velocity `v` to the force `f` = −c v, s being time step × mobility.
fn implicit_share(step: f64, f: [f64; 2], v: [f64; 2]) -> f64 {
    let speed2 = v[0] * v[0] + v[1] * v[1];
    let power = -(f[0] * v[0] + f[1] * v[1]);
    if power > 0.0 && speed2 > 0.0 { 1.0 / (1.0 + step * power / speed2) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn ball() -> Ball {
        Ball::new(0.06, 0.03, &SkinLayout::default(), 6)
    }

    /// Centre 29 mm above the middle of a cell (2.5 mm, so cell centres lie at odd multiples of 1.25 mm).
    const CENTRE_M: [f64; 3] = [1.25e-3, 1.25e-3, 29e-3];

    fn motion(velocity_m_per_s: [f64; 3], angular_velocity_rad_per_s: [f64; 3]) -> BallMotion {
        BallMotion { centre_m: CENTRE_M, velocity_m_per_s, angular_velocity_rad_per_s }
    }

    /// Field's answer: 10 N of pressure on one cell, `dx` cells to the right of the centre and `dy` above, and the
    /// friction `drag` there.
    fn answer(drag: [f64; 2], dx: usize, dy: usize) -> (Wrench, Vec<f64>) {
        let mut pressure_pa = vec![0.0; 3600];
        pressure_pa[(29 - dy) * 60 + 30 + dx] = 10.0 / 2.5e-3_f64.powi(2);
        let [x, y] = [dx, dy].map(|d| 2.5e-3 * f64::from(u32::try_from(d).unwrap()));
        let h = (0.03_f64.powi(2) - x * x - y * y).sqrt();
        let wrench = Wrench {
            force_n: [drag[0], drag[1], 10.0],
            torque_nm: [y * 10.0 + h * drag[1], -x * 10.0 - h * drag[0], x * drag[1] - y * drag[0]],
        };
        (wrench, pressure_pa)
    }

    /// A smooth sphere is not turned; its traction points from the contact to the centre.
    #[test]
    fn pressure_acts_through_the_centre() {
        let (wrench, pressure) = answer([0.0; 2], 4, 2);
        let out = ball().wrench(&wrench, &pressure, &motion([0.0; 3], [0.0; 3]), 1e-4);
        // round-off of torques of 0.1 N m
        assert!(out.torque_nm.iter().all(|t| t.abs() < 1e-15), "{out:?}");
        // (10, 5, −h) mm from the centre
        let h = (30.0_f64.powi(2) - 10.0_f64.powi(2) - 5.0_f64.powi(2)).sqrt();
        assert_relative_eq!(out.force_n[0], -10.0 * 10.0 / h, max_relative = 1e-12);
        assert_relative_eq!(out.force_n[1], -10.0 * 5.0 / h, max_relative = 1e-12);
        assert_relative_eq!(out.force_n[2], 10.0);
    }

    /// Whatever the step, friction slows the slip and does not turn it round; for a short step it is the field's own.
    #[test]
    fn friction_never_turns_the_slip_round() {
        let slip = 1e-3;
        // 6 N of drag at 1 mm/s on 0.06 kg: explicit steps above 8 µs throw the slip past its mirror image
        let (wrench, pressure) = answer([-6.0, 0.0], 0, 0);
        let sliding = motion([slip, 0.0, 0.0], [0.0; 3]);
        for dt_s in [1e-6, 1e-4, 1e-2, 1.0] {
            let out = ball().wrench(&wrench, &pressure, &sliding, dt_s);
            let inertia = 2.0 / 3.0 * 0.06 * 0.03 * 0.03;
            let after = slip + dt_s * (out.force_n[0] / 0.06 - 0.03 * out.torque_nm[1] / inertia);
            assert!((0.0..slip).contains(&after), "{dt_s}: {after}");
        }
        // s c = 1e-9 s · 42 /kg · 6000 N s/m = 2.5e-4
        let out = ball().wrench(&wrench, &pressure, &sliding, 1e-9);
        assert_relative_eq!(out.force_n[0], -6.0, max_relative = 5e-4);
        assert_relative_eq!(out.torque_nm[1], wrench.torque_nm[1], max_relative = 5e-4);
    }

    /// The sums stay inside the grid for a ball over the rim, a corner and beside the skin.
    #[test]
    fn cells_are_cut_to_the_skin() {
        let pressure = vec![1e4; 3600];
        for (x, y, over) in [(0.075, 0.0, true), (-0.08, 0.08, true), (0.2, 0.0, false), (0.0, -1e9, false)] {
            let sums = ball().sums(&pressure, [x, y, 0.02]);
            assert_eq!(sums.force_n > 0.0, over, "{x} {y}");
        }
        let rim = ball().sums(&pressure, [0.075, 0.0, 0.02]);
        // 30 mm × 60 mm under the ball's box, whole cells of 2.5 mm
        assert_relative_eq!(rim.force_n, 0.03 * 0.06 * 1e4, max_relative = 1e-9);
        // the skin is on its −x side and pushes it off
        assert!(rim.side_n[0] < 0.0 && rim.side_n[1].abs() < 1e-9);
    }

    #[test]
    fn nothing_without_contact() {
        let none = Wrench { force_n: [0.0; 3], torque_nm: [0.0; 3] };
        assert_eq!(ball().wrench(&none, &[0.0; 3600], &motion([1.0; 3], [1.0; 3]), 1e-3), none);
    }
}
