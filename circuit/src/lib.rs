//! Weights, summing amplifier, readout effects and ADC of the single-pixel tactile skin.
//!
//! Every cell drives its taxel with a level of its own pseudorandom sequence; one amplifier sums all taxels onto one wire,
//! and one converter reads it: y = Σ wᵢ·xᵢ, with xᵢ = Rf·Vd·Gᵢ. A [`Readout`] turns the conductance of a skin into the
//! [`Block`]s of a [`Recording`], the type that recordings of the real skin have too.
//!
//! ```
//! use spts_circuit::{Constant, Mode, Profile, Readout, Weights, WeightMode, Seeding};
//! use spts_models::{ConductanceMap, Streams};
//!
//! let mut conductance = ConductanceMap::zeros(10, 10);
//! conductance.values_mut()[42] = 200e-6;
//! let mut skin = Constant::new(conductance)?;
//!
//! let mut readout = Readout::new(&Profile::named("as_built")?, Mode::Compressive, 100, Streams::new(1))?;
//! readout.skip(243);
//! let mut blocks = Vec::new();
//! for _press in 0..3 {
//!     blocks.push(readout.acquire(&mut skin, 10 * 100)?);
//!     readout.skip(57);
//! }
//! let recording = readout.recording(blocks)?;
//! assert_eq!(recording.volts(2, 9).len(), 100);
//!
//! let weights = Weights::new(WeightMode::Binary, Seeding::Address, 100);
//! let mut row = [0.0; 100];
//! weights.fill_row(recording.first_row(2, 9), &mut row);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod effect;
mod effects;
mod lcg;
mod profile;
mod readout;
mod recording;
mod source;
mod span;
mod weights;

pub use effect::{BlockStart, BuildEffect, Effect, ProfileError, Sample, Session};
pub use effects::{Adc, EFFECTS, build_chain};
pub use lcg::{INCREMENT, Jump, MULTIPLIER};
pub use profile::{CompressiveWeights, PROFILES, Profile};
pub use readout::{AcquireError, Readout};
pub use recording::{Block, Mode, Recording, RecordingError};
pub use source::{ConductanceSource, Constant, Interpolated, SourceError};
pub use span::Span;
pub use weights::{FIRST_ADDRESS, Seeding, WeightClock, WeightMode, Weights};
