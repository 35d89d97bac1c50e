//! The time step of the dynamics: as requested, the automatic choice, and the limit that stiffness, damping and mass
//! set.

use serde::de::{self, Deserialize, Deserializer, Visitor};
use serde::{Serialize, Serializer};
use spts_contact::{ContactField, PosedMesh};
use spts_input::Refusal;
use spts_models::in_range;
use std::fmt;
use std::str::FromStr;

/// Length of one recorded block: 1000 frames × 100 measurements at 64.3 kHz, s.
pub const BLOCK_S: f64 = 100_000.0 / 64_300.0;

/// Longest time step for any contact, s. It must also resolve the arm's servos and the free fall.
pub const LONGEST_STEP_S: f64 = 2e-3;

/// Shortest time step, s.
pub const SHORTEST_STEP_S: f64 = 1e-6;

/// Time step of the dynamics, as written in a scene: a number of seconds, or `"auto"`.
///
/// `auto` is the longest stable step that divides the time between frames: `frame_interval_s` divided by the smallest
/// whole number that gives a stable step. Frames are then at the same instants as with the default step. A
/// [`Mechanics`](super::Mechanics) holds the resulting number.
///
/// ```
/// use spts_sim::{Mechanics, mechanics::Timestep};
///
/// assert_eq!("auto".parse(), Ok(Timestep::Auto));
/// let scene = Mechanics::from_toml("timestep_s = \"auto\"\n[press]\nobject = \"T\"", ".".as_ref())?;
/// let steps = scene.frame_interval_s() / scene.timestep_s();
/// assert!((steps - steps.round()).abs() < 1e-9, "the step divides the time between frames");
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Timestep {
    /// A fixed step, s; from [`SHORTEST_STEP_S`] to the stable limit.
    Seconds(f64),
    /// The longest stable step that divides the time between frames.
    Auto,
}

impl Timestep {
    /// Itself when it may be a step of some scene.
    pub(super) fn checked(self) -> Result<Self, Refusal> {
        if let Self::Seconds(step_s) = self {
            let valid = (SHORTEST_STEP_S..f64::INFINITY).contains(&step_s);
            in_range("timestep_s", step_s, valid, "[1e-6, stable limit] s")?;
        }
        Ok(self)
    }

    /// The step as TOML.
    pub fn to_toml(self) -> toml::Value {
        match self {
            Self::Seconds(step_s) => step_s.into(),
            Self::Auto => "auto".into(),
        }
    }
}

impl From<f64> for Timestep {
    fn from(step_s: f64) -> Self {
        Self::Seconds(step_s)
    }
}

impl FromStr for Timestep {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "auto" => Ok(Self::Auto),
            _ => text.parse().map(Self::Seconds).map_err(|_| WANTED.to_owned()),
        }
    }
}

/// What can be written for a step.
const WANTED: &str = "a number of seconds or \"auto\" is needed";

impl Serialize for Timestep {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Seconds(step_s) => serializer.serialize_f64(*step_s),
            Self::Auto => serializer.serialize_str("auto"),
        }
    }
}

impl<'de> Deserialize<'de> for Timestep {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(TimestepVisitor)
    }
}

struct TimestepVisitor;

impl Visitor<'_> for TimestepVisitor {
    type Value = Timestep;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number of seconds or \"auto\"")
    }

    fn visit_f64<E: de::Error>(self, step_s: f64) -> Result<Timestep, E> {
        Ok(Timestep::Seconds(step_s))
    }

    fn visit_i64<E: de::Error>(self, step_s: i64) -> Result<Timestep, E> {
        Ok(Timestep::Seconds(step_s as f64))
    }

    fn visit_u64<E: de::Error>(self, step_s: u64) -> Result<Timestep, E> {
        Ok(Timestep::Seconds(step_s as f64))
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Timestep, E> {
        match text {
            "auto" => Ok(Timestep::Auto),
            _ => Err(E::invalid_value(de::Unexpected::Str(text), &self)),
        }
    }
}

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
    pub(super) fn new(mass_kg: f64, stiffness_n_per_m: f64, damping_n_s_per_m: f64) -> Self {
        let root = damping_n_s_per_m.hypot((4.0 * mass_kg * stiffness_n_per_m).sqrt());
        let stable_s = 4.0 * mass_kg / (damping_n_s_per_m + root);
        Self { limit_s: (SHARE * stable_s).min(LONGEST_STEP_S), stiffness_n_per_m, mass_kg }
    }

    /// The largest stable step, s.
    pub(super) fn limit_s(&self) -> f64 {
        self.limit_s
    }

    /// The step of a scene that asks for `asked`. `auto` is `longest_s` over the smallest whole number that brings it
    /// within the limit.
    pub(super) fn resolve(&self, asked: Timestep, longest_s: f64) -> Result<f64, Refusal> {
        let (limit_s, mass_kg) = (self.limit_s, self.mass_kg);
        let timestep_s = match asked {
            Timestep::Seconds(step_s) => step_s,
            Timestep::Auto => longest_s / (longest_s / limit_s).ceil().max(1.0),
        };
        // a limit that is not a number refuses too
        if timestep_s <= limit_s && timestep_s >= SHORTEST_STEP_S {
            return Ok(timestep_s);
        }
        let contact = format!("the contact reaches {:.3e} N/m on {mass_kg:.3} kg", self.stiffness_n_per_m);
        Err(Refusal::new(if limit_s >= SHORTEST_STEP_S && asked != Timestep::Auto {
            format!(
                "`timestep_s` = {timestep_s} is outside [1e-6, {limit_s:.2e}]: {contact}; \"auto\" takes a step that fits"
            )
        } else {
            format!(
                "no valid `timestep_s`: {contact} and allows at most {limit_s:.2e} s, but the shortest step is 1e-6 s; soften \
                 the contact (`contact.stiffness_pa_per_m`, `contact.damping_s`) or drop from lower"
            )
        }))
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
pub(super) fn impact_damping(
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
