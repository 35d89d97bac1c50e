//! Skin layout, typed taxel maps, seeded random streams and transducers (pressure → conductance) of the single-pixel
//! tactile skin.
//!
//! A transducer turns the pressure on each taxel's electrode into the conductance of its Velostat. Everything before it
//! (contact) and after it (circuit) uses only the maps defined here. Parameters of transducers are for the electrodes
//! of the published skin, 10 mm × 10 mm; [`build_transducer`] scales the conductance with the area of other electrodes.
//!
//! ```
//! use spts_models::{ConductanceMap, PressureMap, SkinLayout, Streams, build_transducer};
//!
//! let skin = SkinLayout::default();
//! let mut velostat = build_transducer("velostat", Default::default(), &skin, Streams::new(1))?;
//! let mut pressure = PressureMap::zeros(10, 10);
//! pressure.values_mut()[42] = 20e3;
//! let mut conductance = ConductanceMap::zeros(10, 10);
//! for _press in 0..3 {
//!     velostat.step(&pressure, 1.0, &mut conductance);
//!     velostat.rest(10.0);
//! }
//! assert!(conductance.values()[42] > 0.0);
//! # Ok::<(), spts_input::Refusal>(())
//! ```

mod check;
mod conformance;
mod gains;
mod layout;
mod memory;
mod snapshot;
mod streams;
mod transducer;
mod transducers;

pub use check::{fits_memory, in_interval, in_range, in_section, parsed, parsed_text, within};
pub use conformance::check_transducer;
pub use gains::{Mounting, TaxelGains};
pub use layout::{ConductanceMap, Grid, Pascal, PressureMap, Siemens, SkinLayout};
pub use memory::{Conditioning, Creep, CreepConfig, CreepDecays, CreepKind, Hysteresis, HysteresisConfig, Presses};
pub use snapshot::Snapshot;
pub use streams::Streams;
pub use transducer::Transducer;
pub use transducers::{
    BuildTransducer, Linear, LinearConfig, REFERENCE_C, REFERENCE_PA, TRANSDUCERS, Velostat, VelostatConfig,
    build_transducer,
};
