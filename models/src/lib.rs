//! Skin layout, typed taxel maps, seeded random streams and transducers (pressure → conductance) of the single-pixel
//! tactile skin.
//!
//! A transducer turns the pressure over each taxel's electrode into the conductance of its Velostat; everything
//! upstream (contact) and downstream (circuit) sees only the maps defined here.

mod config;
mod grid;
mod layout;
mod streams;
mod transducer;

pub use config::{ConfigError, in_range};
pub use grid::{ConductanceMap, Grid, Pascal, PressureMap, Siemens};
pub use layout::SkinLayout;
pub use streams::Streams;
pub use transducer::Transducer;
