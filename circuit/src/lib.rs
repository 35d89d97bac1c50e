//! Weights, summing amplifier, readout effects and ADC of the single-pixel tactile skin.
//!
//! Every cell drives its taxel with a level from its pseudorandom sequence. One amplifier sums all taxels onto one
//! wire, and one converter reads it: y = Σ wᵢ·xᵢ, with xᵢ = Rf·Vd·Gᵢ. A [`Readout`] turns the conductance of a skin
//! into the [`Block`]s of a [`Recording`]. Recordings of the real skin have the same type.
//!
//! ```
//! use spts_circuit::{Interpolated, Mode, Profile, Readout};
//! use spts_models::{ConductanceMap, PressureMap, SkinLayout, Streams, build_transducer};
//!
//! // ten presses of 0.2 s with one frame a millisecond, on a skin that remembers them
//! let (skin, streams) = (SkinLayout::default(), Streams::new(1));
//! let mut velostat = build_transducer("velostat", Default::default(), &skin, streams)?;
//! let mut presses = Vec::new();
//! for _press in 0..10 {
//!     let (mut times_s, mut maps) = (Vec::new(), Vec::new());
//!     let (mut pressure, mut conductance) = (PressureMap::zeros(10, 10), ConductanceMap::zeros(10, 10));
//!     for frame in 0..200 {
//!         let time_s = f64::from(frame) * 1e-3;
//!         pressure.values_mut()[44] = 30e3 * (time_s / 0.1).min(1.0);
//!         velostat.step(&pressure, 1e-3, &mut conductance);
//!         times_s.push(time_s);
//!         maps.push(conductance.clone());
//!     }
//!     velostat.rest(2.0);
//!     presses.push(Interpolated::new(times_s, maps)?);
//! }
//!
//! let profile = Profile::named("as_built")?;
//! let mut compressive = Readout::new(&profile, Mode::Compressive, &skin, streams, 0)?;
//! let recording = compressive.record(&mut presses, 100 * 100, 57)?;
//! assert_eq!((recording.blocks().len(), recording.frames()), (10, 100));
//! assert_eq!(recording.volts(9, 99).len(), 100);
//!
//! // the rows of the weight matrix that frame 99 of press 9 used
//! let rows = recording.rows(9, 99 * 100..100 * 100).to_vec();
//! assert_eq!(rows.len(), 100 * 100);
//!
//! let mut raster = Readout::new(&profile, Mode::Raster, &skin, streams, 0)?;
//! let scans = raster.record(&mut presses, 100 * 100, 57)?;
//! assert!(scans.volts(9, 99)[44] > 0.5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod amplifier;
mod batch;
mod converter;
mod effect;
mod effects;
mod engine;
mod faults;
mod profile;
mod readout;
mod recording;
mod source;
mod weights;
mod wires;

pub use batch::{Batch, CellRun};
pub use converter::{Adc, CodeScale, Converter, ConverterConfig};
pub use effect::{BlockStart, BuildEffect, BuildFault, Effect, EffectSession, Fault, FaultConfig, Span};
pub use effects::{EFFECTS, build_chain, check_effect};
pub use faults::FAULTS;
pub use profile::{CompressiveWeights, PROFILES, Profile};
pub use readout::Readout;
pub use recording::{Block, FrameUnit, Recording, RecordingInfo, Slip};
pub use source::{ConductanceSource, Constant, Interpolated, Segment, Started};
pub use weights::{
    CellCodes, FIRST_ADDRESS, INCREMENT, Jump, LevelSource, MAX_PATTERNS_BYTES, MAX_SEEDS_BYTES, MULTIPLIER, Mode,
    Patterns, Seeding, WeightMode, WeightRows, Weights, check_codes, parse_patterns, parse_seeds,
    seeds_of_first_window,
};
pub use wires::{WireConfig, Wires};
