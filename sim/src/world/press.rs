//! The motion of the arm in a press: approach, touch, follow the force, lift.

use super::arm;
use super::model::tool_length_m;
use crate::mechanics::{Mechanics, PressConfig, RAMP_CORNER, ramp_s};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};
use spts_contact::{DepthCurve, Frame};
use spts_input::Refusal;
use spts_models::Streams;
use std::sync::Arc;

/// The error of an arm or a ball that has touched nothing by `time_s`.
pub fn no_touch(time_s: f64) -> Refusal {
    Refusal::new(format!("nothing has touched the skin by {time_s:.3} s"))
}

/// Height of the object above its place before a press, m.
pub(super) const CLEARANCE_M: f64 = 0.03;
/// Speed of the last stretch before the touch, m/s, and how long it takes, s.
const GUARD_M_PER_S: f64 = 5e-3;
const GUARD_S: f64 = 0.1;
/// Share of the target force that counts as touch.
pub(super) const TOUCH: f64 = 0.01;
/// Time constant of the filter on the measured force, s.
const FILTER_S: f64 = 5e-3;
/// Rate at which the loop removes an error of force, 1/s: a third of the servos' bandwidth.
const LOOP_PER_S: f64 = 28.0;
/// Delay between command and measured force, s: the servos (critically damped at about 100 rad/s, 2/ω) and the filter,
/// as equal poles in a row.
pub(super) const LAG_S: f64 = 25e-3;
const LAG_POLES: usize = 3;
/// Fastest motion of the command, m/s, and its acceleration when lifting off, m/s².
const MAX_M_PER_S: f64 = 0.1;
pub(super) const LIFT_M_PER_S2: f64 = 0.3;

/// Where the press is in its course.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Approach,
    Force { touch_s: f64 },
    Retract { speed_m_per_s: f64 },
}

/// The arm's program for one press.
///
/// The force follows the reference r(t) through ż = −c (ṙ + λ (r − F)): c is the compliance of skin and arm at r, known
/// from the static curve (the operator's first, slow press), so that the first term alone would do on a known skin; the
/// second corrects what the curve does not know (damping, jitter, tilt). It compares the force with the reference as it
/// comes through the servos' own lag, since correcting that lag would overshoot when the ramp ends.
#[derive(Debug, Clone)]
pub(crate) struct PressDriver {
    plan: PressPlan,
    curve: Arc<DepthCurve>,
    arm_m_per_n: f64,
    /// Expected height of the origin at the touch, m.
    touch_height_m: f64,
    height_m: f64,
    joints_rad: [f64; 6],
    force_n: f64,
    expected_n: [f64; LAG_POLES],
    phase: Phase,
}

/// What is drawn for one press, and how the tool holds the object.
#[derive(Debug, Clone)]
pub(super) struct PressPlan {
    pub(super) config: PressConfig,
    /// Rotation of the object.
    pub(super) rotation: UnitQuaternion<f64>,
    /// Position of the object's origin, m.
    pub(super) xy_m: [f64; 2],
    /// Error of the arm's height, upwards, m.
    rise_m: f64,
    /// Transformation from the flange to the object.
    pub(super) tool: Isometry3<f64>,
    pub(super) onset_s: f64,
    pub(super) lift_s: f64,
}

impl PressPlan {
    /// Plan of press `index`.
    pub(super) fn new(scene: &Mechanics, config: &PressConfig, index: u64) -> Self {
        let mut rng = Streams::new(scene.seed()).rng("press", index);
        let mut spread = |half_s: f64| half_s * (2.0 * rng.random::<f64>() - 1.0);
        let onset_s = config.onset_s + spread(config.onset_spread_s);
        let lift_s = config.lift_s + spread(config.lift_spread_s);
        let mut normal = |sd: f64| {
            let x: f64 = StandardNormal.sample(&mut rng);
            sd * x
        };
        let jitter_m: [f64; 3] = std::array::from_fn(|_| normal(config.position_sd_m));
        let jitter_rad = Vector3::from_fn(|_, _| normal(config.rotation_sd_deg.to_radians()));
        let place = config.placement_of(index);
        let matrix = Matrix3::from_fn(|i, j| place.matrix()[i][j]);
        let nominal = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
        let [x, y] = scene.skin().position_m(place.row, place.col);
        Self {
            config: config.clone(),
            rotation: UnitQuaternion::from_scaled_axis(jitter_rad) * nominal,
            xy_m: [x + jitter_m[0], y + jitter_m[1]],
            rise_m: jitter_m[2],
            tool: Isometry3::from_parts(
                Translation3::new(0.0, 0.0, tool_length_m(scene.mesh())),
                UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI),
            ),
            onset_s,
            lift_s,
        }
    }

    /// Pose of the flange that brings the object's origin to `height_m`.
    pub(super) fn flange(&self, height_m: f64) -> Isometry3<f64> {
        let [x, y] = self.xy_m;
        Isometry3::from_parts(Translation3::new(x, y, height_m), self.rotation) * self.tool.inverse()
    }

    /// Reference force, N, and its rate, N/s, when the touch was felt at `touch_s`.
    pub(super) fn reference(&self, time_s: f64, touch_s: f64) -> (f64, f64) {
        let c = &self.config;
        let [up_s, down_s] = [c.rise_s, c.fall_s].map(ramp_s);
        let (up, up_rate) = ramp((time_s - touch_s) / up_s);
        let (down, down_rate) = ramp((time_s - self.lift_s) / down_s);
        let level = TOUCH + (1.0 - TOUCH) * up;
        (
            c.force_n * level * (1.0 - down),
            c.force_n * ((1.0 - TOUCH) * up_rate / up_s * (1.0 - down) - level * down_rate / down_s),
        )
    }
}

impl PressDriver {
    /// Program of the press `plan`, and nothing moved yet.
    pub(crate) fn new(scene: &Mechanics, plan: PressPlan) -> Result<Self, Refusal> {
        let curve = Arc::clone(scene.depth_curve());
        let [lowest_m, _] = scene.contact_body().0.heights_m();
        let force_n = plan.config.force_n;
        let meant_m = -lowest_m - curve.depth_m(TOUCH * force_n);
        let touch_height_m = meant_m + plan.rise_m;
        // the deepest pose has to be within reach too
        let start = arm::solve(&plan.flange(touch_height_m + CLEARANCE_M), &arm::HOME_RAD)?;
        let pressed = arm::solve(&plan.flange(meant_m - curve.depth_m(force_n)), &start)?;
        Ok(Self {
            arm_m_per_n: arm_compliance(&pressed, plan.tool.translation.vector),
            plan,
            curve,
            touch_height_m,
            height_m: touch_height_m + CLEARANCE_M,
            joints_rad: start,
            force_n: 0.0,
            expected_n: [0.0; LAG_POLES],
            phase: Phase::Approach,
        })
    }

    /// Joint angles commanded now, rad.
    pub(crate) fn joints_rad(&self) -> &[f64; 6] {
        &self.joints_rad
    }

    /// Moves the command on by `dt_s` at time `time_s`, `measured_n` being the normal force on the object.
    pub(crate) fn step(&mut self, time_s: f64, dt_s: f64, measured_n: f64) -> Result<(), Refusal> {
        self.force_n += dt_s / (FILTER_S + dt_s) * (measured_n - self.force_n);
        match self.phase {
            Phase::Approach => {
                self.height_m = self.touch_height_m + approach_m(self.plan.onset_s - time_s, self.plan.onset_s);
                if self.force_n > TOUCH * self.plan.config.force_n {
                    self.phase = Phase::Force { touch_s: time_s };
                    self.expected_n = [self.force_n; LAG_POLES];
                } else if time_s >= self.plan.lift_s {
                    return Err(no_touch(time_s));
                }
            }
            Phase::Force { touch_s } => {
                let (reference_n, rate_n_per_s) = self.plan.reference(time_s, touch_s);
                let compliance = self.curve.compliance_m_per_n(reference_n) + self.arm_m_per_n;
                let pole_s = LAG_S / 3.0;
                let mut input_n = reference_n;
                for state_n in &mut self.expected_n {
                    *state_n += dt_s / (pole_s + dt_s) * (input_n - *state_n);
                    input_n = *state_n;
                }
                let speed = compliance * (rate_n_per_s + LOOP_PER_S * (input_n - self.force_n));
                self.height_m -= dt_s * speed.clamp(-MAX_M_PER_S, MAX_M_PER_S);
                if time_s > self.plan.lift_s && reference_n <= TOUCH * self.plan.config.force_n {
                    self.phase = Phase::Retract { speed_m_per_s: -speed.min(0.0) };
                }
            }
            Phase::Retract { speed_m_per_s } => {
                let above_m = self.height_m - self.touch_height_m;
                // brake in time to stand still at the clearance
                let braked = (2.0 * LIFT_M_PER_S2 * (CLEARANCE_M - above_m).max(0.0)).sqrt();
                let speed = (speed_m_per_s + LIFT_M_PER_S2 * dt_s).min(MAX_M_PER_S).min(braked);
                self.height_m += dt_s * speed;
                self.phase = Phase::Retract { speed_m_per_s: speed };
            }
        }
        arm::improve(&self.plan.flange(self.height_m), &mut self.joints_rad);
        Ok(())
    }
}

/// Compliance of the servos at the tool along the vertical: Σ J_zi² / kp_i, m/N.
fn arm_compliance(joints_rad: &[f64; 6], tool_m: Vector3<f64>) -> f64 {
    let jacobian = arm::jacobian(joints_rad, &tool_m);
    let row = jacobian.row(2);
    let parts = arm::LINKS.iter().zip(row.iter());
    parts.map(|(link, j)| j * j / link.servo_nm_per_rad).sum()
}

/// Height above the touch, m, `left_s` before it, of a descent that takes `whole_s`: a minimum-jerk stretch from the
/// clearance, then the guarded one, which goes on below until the touch.
pub(super) fn approach_m(left_s: f64, whole_s: f64) -> f64 {
    if left_s <= GUARD_S {
        return GUARD_M_PER_S * left_s;
    }
    let low_m = GUARD_M_PER_S * GUARD_S;
    let s = ((left_s - GUARD_S) / (whole_s - GUARD_S)).clamp(0.0, 1.0);
    low_m + (CLEARANCE_M - low_m) * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
}

/// Ramp from 0 to 1 over u = 0…1 with parabolic corners: value and slope.
fn ramp(u: f64) -> (f64, f64) {
    let (b, full) = (RAMP_CORNER, 1.0 - RAMP_CORNER);
    if u <= 0.0 {
        (0.0, 0.0)
    } else if u < b {
        (u * u / (2.0 * b * full), u / (b * full))
    } else if u < full {
        ((u - 0.5 * b) / full, 1.0 / full)
    } else if u < 1.0 {
        let v = 1.0 - u;
        (1.0 - v * v / (2.0 * b * full), v / (b * full))
    } else {
        (1.0, 0.0)
    }
}

// Time course of the force in a press.

/// Time course of one press, from its frames. Times are interpolated between frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressCourse {
    /// First frame with a force, s.
    pub onset_s: f64,
    /// Time of the rise from 10 to 90 % of the plateau, s.
    pub rise_s: f64,
    /// Mean over the plateau, N.
    pub plateau_n: f64,
    /// Largest deviation from the target on the plateau, N.
    pub plateau_error_n: f64,
    /// Highest force above the target, relative to it.
    pub overshoot: f64,
    /// When the force falls below 90 % of the plateau, s.
    pub lift_s: f64,
    /// Time of the fall from 90 to 10 % of the plateau, s.
    pub fall_s: f64,
    /// Largest [`Frame::imbalance`] of all frames.
    pub imbalance: f64,
}

impl PressCourse {
    /// Time course of `frames` with the target force `target_n` and the plateau `plateau_s` = [start, end]. `None`
    /// unless the force exceeds 90 % of the target before the plateau's end and falls below 10 % afterwards.
    pub fn of(frames: &[Frame], target_n: f64, plateau_s: [f64; 2], cell_area_m2: f64) -> Option<Self> {
        let force = |f: &Frame| f.wrench.force_n[2];
        let onset_s = frames.iter().find(|f| force(f) > 0.0)?.time_s;
        let on: Vec<f64> =
            frames.iter().filter(|f| (plateau_s[0]..=plateau_s[1]).contains(&f.time_s)).map(force).collect();
        let plateau_n = on.iter().sum::<f64>() / on.len() as f64;
        let middle_s = 0.5 * (plateau_s[0] + plateau_s[1]);
        let up = |share: f64| crossing(frames, share * plateau_n, |t| t <= middle_s, false);
        let down = |share: f64| crossing(frames, share * plateau_n, |t| t >= middle_s, true);
        let lift_s = down(0.9)?;
        Some(Self {
            onset_s,
            rise_s: up(0.9)? - up(0.1)?,
            plateau_n,
            plateau_error_n: on.iter().map(|f| (f - target_n).abs()).fold(0.0, f64::max),
            overshoot: frames.iter().map(force).fold(0.0, f64::max) / target_n - 1.0,
            lift_s,
            fall_s: down(0.1)? - lift_s,
            imbalance: frames.iter().map(|f| f.imbalance(cell_area_m2)).fold(0.0, f64::max),
        })
    }
}

/// First time, among those `within`, at which the force passes `level_n`.
fn crossing(frames: &[Frame], level_n: f64, within: impl Fn(f64) -> bool, falling: bool) -> Option<f64> {
    let force = |f: &Frame| f.wrench.force_n[2];
    let pair = frames.windows(2).find(|w| {
        let below = [force(&w[0]) < level_n, force(&w[1]) < level_n];
        within(w[1].time_s) && below == [!falling, falling]
    })?;
    let share = (level_n - force(&pair[0])) / (force(&pair[1]) - force(&pair[0]));
    Some(pair[0].time_s + share * (pair[1].time_s - pair[0].time_s))
}
