//! The mechanical part of a scene: what happens on the skin, read from TOML or built in code. A [`Mechanics`] is valid
//! by construction.
//!
//! ```toml
//! seed = 7
//! [contact]
//! model = "winkler"
//! stiffness_pa_per_m = 1.5e7
//! [press]
//! object = "T"
//! force_n = 20.0
//! presses = 10
//! ```

mod bend;
mod press;
mod scene;
#[cfg(test)]
mod tests;
mod timestep;

pub use bend::BendConfig;
pub use press::{DropConfig, MAX_LIDDED_TILT_DEG, PressConfig, PressedObject};
pub(crate) use press::{RAMP_CORNER, ramp_s};
pub use scene::{
    ARM_MASS_KG, Expected, FLIGHT_INTERVAL_S, GRAVITY_M_PER_S2, Mechanics, MechanicsConfig, Overhang, Task,
};
pub use timestep::{BLOCK_S, LONGEST_STEP_S, SHORTEST_STEP_S, Timestep};
