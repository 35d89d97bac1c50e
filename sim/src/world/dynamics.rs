//! A press or drop simulated by MuJoCo, with the contact field as an external force.

use super::drop::{Ball, BallMotion, Bounce, BounceLog, Sample, Start};
use super::model;
use super::press::{PressDriver, PressPlan};
use crate::mechanics::{FLIGHT_INTERVAL_S, Mechanics, Task};
use mujoco_rs::prelude::{MjData, MjModel, MjtObjBase};
use spts_contact::{ContactField, Frame, Pose, PosedMesh, PreparedMesh, TaxelBins};
use spts_input::Refusal;

/// The error of a frame under the normal force `force_n`, N, whose pressure the contact field cannot compute.
pub fn no_pressure(force_n: f64, time_s: f64, reason: &str) -> Refusal {
    Refusal::new(format!("no pressure under {force_n:e} N at {time_s:.4} s: {reason}"))
}

/// A ball is near the skin when its lowest point is below this, m (and not below the skin altogether, having rolled
/// off).
const NEAR_M: f64 = 5e-3;

/// What moves the body.
#[derive(Debug)]
enum Driver {
    Press(Box<PressDriver>),
    Drop(Box<DropDriver>),
}

/// The free ball: where it starts, and what it did.
#[derive(Debug)]
struct DropDriver {
    start: Start,
    ball: Ball,
    log: BounceLog,
}

/// MuJoCo's state and what acts on it.
///
/// Every step gives MuJoCo the contact field's wrench as an external force: positions and velocities first, then the
/// field's answer to them, then accelerations and the step.
pub(super) struct Dynamics {
    scene: Mechanics,
    pub(super) data: MjData<Box<MjModel>>,
    field: Box<dyn ContactField>,
    bins: TaxelBins,
    mesh: PreparedMesh,
    stiffness_pa_per_m: f64,
    body: usize,
    driver: Driver,
    pub(super) step: u64,
    pub(super) last_step: u64,
    /// Time step of the next frame near the skin. Away from it a drop has fewer frames.
    next_frame: u64,
}

impl Dynamics {
    /// Repeat `index` of the scene with `field`, nothing moved yet.
    ///
    /// # Errors
    /// [`Refusal`] when the arm cannot reach the place or MuJoCo does not take the model.
    #[expect(clippy::cast_possible_truncation, reason = "a scene's duration is at most 60 s in steps of at least 1 µs")]
    pub(super) fn new(scene: &Mechanics, index: u64, field: Box<dyn ContactField>) -> Result<Self, Refusal> {
        let (contact_body, _) = scene.contact_body();
        let stiffness_pa_per_m = contact_body.stiffness_pa_per_m;
        let driver = match scene.task() {
            Task::Press(press) => {
                let plan = PressPlan::new(scene, press, index);
                Driver::Press(Box::new(PressDriver::new(scene, plan)?))
            }
            Task::Drop(ball) => Driver::Drop(Box::new(DropDriver {
                start: Start::new(scene, ball, index),
                ball: Ball::new(ball.mass_kg, ball.radius_m, scene.skin(), field.cells_per_taxel()),
                log: BounceLog::new(ball.mass_kg),
            })),
        };
        let mut data = MjData::new(Box::new(model::compile(scene, None)?));
        let body = data
            .model()
            .name_to_id(MjtObjBase::mjOBJ_BODY, model::BODY)
            .ok_or_else(|| model::rejected(&format!("no body `{}`", model::BODY)))?;
        match &driver {
            Driver::Press(press) => {
                data.qpos_mut().copy_from_slice(press.joints_rad());
                data.ctrl_mut().copy_from_slice(press.joints_rad());
            }
            Driver::Drop(ball) => {
                let qpos = data.qpos_mut();
                qpos[..3].copy_from_slice(&ball.start.centre_m);
                qpos[3..].copy_from_slice(&ball.start.quaternion);
            }
        }
        Ok(Self {
            bins: TaxelBins::new(scene.skin(), field.cells_per_taxel()),
            mesh: scene.mesh().clone(),
            last_step: (scene.duration_s() / scene.timestep_s()).round() as u64,
            scene: scene.clone(),
            data,
            field,
            stiffness_pa_per_m,
            body,
            driver,
            step: 0,
            next_frame: 0,
        })
    }

    /// Time since the start, s.
    pub(super) fn time_s(&self) -> f64 {
        self.step as f64 * self.scene.timestep_s()
    }

    /// Bounces that the ball has finished so far, in order of time; empty for a press.
    pub(super) fn bounces(&self) -> &[Bounce] {
        match &self.driver {
            Driver::Press(_) => &[],
            Driver::Drop(ball) => &ball.log.done,
        }
    }

    /// The first bounce of the ball so far, finished or not; none for a press.
    pub(super) fn first_bounce(&self) -> Option<Bounce> {
        match &self.driver {
            Driver::Press(_) => None,
            Driver::Drop(ball) => ball.log.first(),
        }
    }

    /// Steps until a frame is due; `None` at the end.
    pub(super) fn advance(&mut self) -> Result<Option<Frame>, Refusal> {
        while self.step <= self.last_step {
            let time_s = self.time_s();
            let frame = self.one_step(time_s)?;
            self.step += 1;
            if frame.is_some() {
                return Ok(frame);
            }
        }
        Ok(None)
    }

    pub(super) fn one_step(&mut self, time_s: f64) -> Result<Option<Frame>, Refusal> {
        self.data.step1();
        let b = self.body;
        let position_m = self.data.xpos()[b];
        let m = self.data.xmat()[b];
        // angular velocity first, both at the centre of mass in world axes
        let v = self.data.object_velocity(MjtObjBase::mjOBJ_BODY, b, false);
        let posed = PosedMesh {
            mesh: &self.mesh,
            rotation: [[m[0], m[1], m[2]], [m[3], m[4], m[5]], [m[6], m[7], m[8]]],
            position_m,
            centre_of_mass_m: self.data.xipos()[b],
            velocity_m_per_s: [v[3], v[4], v[5]],
            angular_velocity_rad_per_s: [v[0], v[1], v[2]],
            stiffness_pa_per_m: self.stiffness_pa_per_m,
        };
        let response = self.field.respond(&posed);
        let wrench = match &self.driver {
            Driver::Press(_) => response.wrench,
            Driver::Drop(free) => {
                let motion = BallMotion {
                    centre_m: posed.centre_of_mass_m,
                    velocity_m_per_s: posed.velocity_m_per_s,
                    angular_velocity_rad_per_s: posed.angular_velocity_rad_per_s,
                };
                free.ball.wrench(&response.wrench, response.pressure_pa, &motion, self.scene.timestep_s())
            }
        };
        let ([fx, fy, fz], [tx, ty, tz]) = (wrench.force_n, wrench.torque_nm);
        if ![fx, fy, fz, tx, ty, tz].iter().all(|v| v.is_finite()) {
            let unknown = || "pose or velocity of the body are not finite, or the contact field gave up".to_owned();
            let (force_n, reason) = (wrench.force_n, self.field.failure().unwrap_or_else(unknown));
            return Err(Refusal::new(format!("contact force {force_n:?} N at {time_s:.4} s is not finite: {reason}")));
        }
        let near = match &self.driver {
            Driver::Press(_) => true,
            Driver::Drop(free) => {
                let radius_m = free.ball.radius_m;
                (-2.0 * radius_m..NEAR_M).contains(&(position_m[2] - radius_m))
            }
        };
        let mut maps = None;
        if is_due(&self.scene, self.step, self.next_frame, near) {
            let patch = response.patch;
            let answered = self.bins.means(response.pressure_pa, patch);
            let refined = self.field.refine(&posed, fz);
            maps = match refined.map(|fine| self.bins.means(fine, patch)) {
                None => match self.field.failure() {
                    None => Some(answered),
                    Some(reason) => return Err(no_pressure(fz, time_s, &reason)),
                },
                refined => refined,
            };
        }
        let frame = maps.map(|[pressure, electrode_pressure]| Frame {
            time_s,
            pressure,
            electrode_pressure,
            wrench,
            pose: Pose { position_m, quaternion: self.data.xquat()[b] },
        });
        if frame.is_some() {
            self.next_frame = self.step + stride(self.scene.frame_interval_s(), self.scene.timestep_s());
        }
        let dt_s = self.scene.timestep_s();
        match &mut self.driver {
            Driver::Press(press) => {
                press.step(time_s, dt_s, fz)?;
                self.data.ctrl_mut().copy_from_slice(press.joints_rad());
            }
            Driver::Drop(ball) => {
                if time_s < ball.start.release_s {
                    // held: nothing moves
                    return Ok(frame);
                }
                ball.log.push(Sample {
                    time_s,
                    height_m: posed.centre_of_mass_m[2],
                    velocity_m_per_s: posed.velocity_m_per_s,
                    force_n: wrench.force_n,
                });
            }
        }
        self.data.xfrc_applied_mut()[b] = [fx, fy, fz, tx, ty, tz];
        self.data.step2();
        match self.data.warning().iter().position(|w| w.number > 0) {
            Some(warning) => {
                Err(Refusal::new(format!("MuJoCo warning {warning} at {time_s:.4} s: the dynamics are not stable")))
            }
            None => Ok(frame),
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "a scene's intervals are at most 0.1 s in steps of at least 1 µs")]
fn stride(interval_s: f64, timestep_s: f64) -> u64 {
    ((interval_s / timestep_s).round() as u64).max(1)
}

/// Whether a frame is due at `step`, the next one near the skin being due at `next`.
fn is_due(scene: &Mechanics, step: u64, next: u64, near: bool) -> bool {
    let timestep_s = scene.timestep_s();
    let wait = match scene.task() {
        Task::Drop(_) if !near && step > 0 => {
            stride(FLIGHT_INTERVAL_S, timestep_s).saturating_sub(stride(scene.frame_interval_s(), timestep_s))
        }
        _ => 0,
    };
    step >= next + wait
}
