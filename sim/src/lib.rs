//! UR5 arm, ball and MuJoCo simulation around a contact field: scenes in, pressure frames out.
//!
//! ```
//! use spts_sim::{Mechanics, World};
//! let scene = Mechanics::from_toml("[drop]\nheight_m = 0.05\nduration_s = 0.3", ".".as_ref())?;
//! let mut world = World::new(&scene)?;
//! let frames = world.frames().collect::<Result<Vec<_>, _>>()?;
//! let peak_pa = frames.iter().map(|f| f.pressure.max()).fold(0.0, f64::max);
//! assert!(peak_pa > 1e3 && world.bounces()[0].restitution() < 1.0);
//! # Ok::<(), spts_input::Refusal>(())
//! ```

pub mod engine;
pub mod fidelity;
pub mod mechanics;
pub mod render;
pub mod world;

pub use mechanics::Mechanics;
pub use world::World;
