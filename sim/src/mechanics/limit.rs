//! The largest time step for a scene's stiffness, damping and mass.

use super::{GRAVITY_M_PER_S2, LONGEST_STEP_S, Mechanics, MechanicsError, SHORTEST_STEP_S, Task, Timestep};
use spts_contact::{ContactField, PosedMesh};

/// Largest stable step of a scene, and what it comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StepLimit {
    limit_s: f64,
    stiffness_n_per_m: f64,
    mass_kg: f64,
}

/// Share of the stable step that is allowed. It leaves room for the modes in which an object rocks, for cells that the
/// static curve does not see, and keeps ω dt ≤ 1, where a bounce gains at most 1/√(1 − (ω dt)²/4) in speed even on a
/// spring without damping.
const SHARE: f64 = 0.5;

impl StepLimit {
    /// Limit for the mass m on a spring k beside a damper c. Stepped with forces of the step's start and velocities
    /// updated first it is stable while k dt² + 2 c dt < 4 m (Jury's criterion on its 2 × 2 map).
    fn new(mass_kg: f64, stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> Self {
        let root = damping_n_s_per_m.hypot((4.0 * mass_kg * stiffness_n_per_m).sqrt());
        let stable_s = 4.0 * mass_kg / (damping_n_s_per_m + root);
        Self {
            limit_s: (SHARE * stable_s).min(LONGEST_STEP_S),
            stiffness_n_per_m,
            mass_kg,
        }
    }

    /// The step of a scene that asks for `asked`. `auto` is `longest_s` over the smallest whole number that brings it
    /// within the limit.
    pub(super) fn resolve(&self, asked: Timestep, longest_s: f64) -> Result<f64, MechanicsError> {
        let (limit_s, stiffness_n_per_m, mass_kg) = (self.limit_s, self.stiffness_n_per_m, self.mass_kg);
        let timestep_s = match asked {
            Timestep::Seconds(step_s) => step_s,
            Timestep::Auto => longest_s / (longest_s / limit_s).ceil().max(1.0),
        };
        // a limit that is not a number refuses too
        if timestep_s <= limit_s && timestep_s >= SHORTEST_STEP_S {
            return Ok(timestep_s);
        }
        Err(if limit_s >= SHORTEST_STEP_S && asked != Timestep::Auto {
            MechanicsError::Timestep {
                timestep_s,
                limit_s,
                stiffness_n_per_m,
                mass_kg,
            }
        } else {
            MechanicsError::NoTimestep {
                limit_s,
                stiffness_n_per_m,
                mass_kg,
            }
        })
    }
}

impl Mechanics {
    /// Limit from the static curve, and for a drop from the damping that `field`, the scene's own, gives on the way
    /// down too.
    pub(super) fn step_limit(&self, field: &mut dyn ContactField) -> StepLimit {
        let stiffness_n_per_m = self.depth_curve().stiffness_n_per_m();
        let (body, mass_kg) = self.contact_body();
        let at_rest = field.damping_s() * stiffness_n_per_m;
        let damping_n_s_per_m = match self.task() {
            // comes down at millimetres a second
            Task::Press(_) => at_rest,
            Task::Drop(ball) => {
                let speed_m_per_s = (2.0 * GRAVITY_M_PER_S2 * ball.height_m).sqrt();
                let touch_m = ball.radius_m;
                at_rest.max(impact_damping(
                    field,
                    &body,
                    mass_kg,
                    stiffness_n_per_m,
                    [touch_m, speed_m_per_s],
                ))
            }
        };
        StepLimit::new(mass_kg, stiffness_n_per_m, damping_n_s_per_m)
    }

    /// The same scene with any step, its limit notwithstanding.
    #[cfg(test)]
    pub(crate) fn with_step(mut self, step_s: f64) -> Self {
        self.timestep_s = step_s;
        self.frame_interval_s = self.frame_interval_s.max(step_s);
        self.config.timestep_s = Some(step_s.into());
        self
    }
}

/// Steps of the descent: a quarter of an oscillation takes 16 of them.
const DESCENT_STEPS: u32 = 64;
/// Phase of the oscillation that a step of the descent covers, rad.
const DESCENT_PHASE: f64 = 0.1;
/// Share of the impact speed below which the descent is over: what is left moves as the static curve does.
const DESCENT_END: f64 = 0.05;
/// Largest damping (F(δ, v) − F(δ, 0))/|v|, N s/m, that `body` meets on its way down from the touch, its origin
/// `start[0]` m high and its speed `start[1]` m/s. A fast body meets a damped layer as if it were deeper by τ v, where
/// it is stiffer; a step throws it back faster than it came unless dt times this is below 2 m. The descent itself is
/// stepped with the damping taken implicitly, so that it is stable whatever it finds.
fn impact_damping(
    field: &mut dyn ContactField,
    body: &PosedMesh<'_>,
    mass_kg: f64,
    stiffness_n_per_m: f64,
    start: [f64; 2],
) -> f64 {
    let [mut height_m, speed_m_per_s] = start;
    let dt_s = DESCENT_PHASE * (mass_kg / stiffness_n_per_m).sqrt();
    let [x, y, _] = body.position_m;
    let mut force = |height_m: f64, velocity: f64| {
        let posed = PosedMesh {
            position_m: [x, y, height_m],
            centre_of_mass_m: [x, y, height_m],
            velocity_m_per_s: [0.0, 0.0, velocity],
            ..*body
        };
        field.respond(&posed).wrench.force_n[2]
    };
    let mut velocity = -speed_m_per_s;
    let mut largest = 0.0_f64;
    for _ in 0..DESCENT_STEPS {
        if velocity > -DESCENT_END * speed_m_per_s {
            break;
        }
        height_m += dt_s * velocity;
        let force_n = force(height_m, velocity);
        let damping = ((force_n - force(height_m, 0.0)) / -velocity).max(0.0);
        largest = largest.max(damping);
        velocity += dt_s * force_n / (mass_kg + dt_s * damping);
    }
    largest
}
