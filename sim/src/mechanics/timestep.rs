//! The time step of the dynamics: as requested, its limits, and the automatic choice.

use super::MechanicsError;
use serde::de::{self, Deserialize, Deserializer, Visitor};
use serde::{Serialize, Serializer};
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
/// # Ok::<(), spts_sim::mechanics::MechanicsError>(())
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
    pub(super) fn checked(self) -> Result<Self, MechanicsError> {
        if let Self::Seconds(step_s) = self {
            let valid = (SHORTEST_STEP_S..f64::INFINITY).contains(&step_s);
            in_range("timestep_s", step_s, valid, "[1e-6, stable limit] s")?;
        }
        Ok(self)
    }
}

impl Timestep {
    /// The step as TOML.
    #[must_use]
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
