//! Few-wire readouts compared: the same skins, touches, amplifier, noise, converter and clock for all of them.
//!
//! A [`WireReadout`] asks a [`HeldWire`] for measurements and answers with images; [`READOUTS`] is the table of them,
//! and [`conformance`] runs on every line. [`ReadoutsStudy`] measures them, and the protocol is docs/readouts.md.
//!
//! ```no_run
//! use spts_studies::readouts::{READOUTS, ReadoutsStudy};
//!
//! let study = ReadoutsStudy {
//!     readouts: READOUTS.iter().collect(),
//!     sides: vec![10],
//!     repetitions: 2,
//!     shapes: 4,
//!     seed: 1,
//! };
//! println!("{}", study.run(&())?.text());
//! # Ok::<(), spts_studies::readouts::ReadoutsError>(())
//! ```

mod adaptive;
mod classify;
mod code_division;
mod conformance;
mod decode;
mod designed;
mod error;
mod events;
mod messages;
mod polish;
mod published;
mod random;
mod raster;
mod readout;
mod report;
mod rows;
mod study;
mod table;
mod text;
mod wire;
mod wiring;

pub use classify::Templates;
pub use conformance::conformance;
pub use error::ReadoutsError;
pub use published::{PUBLISHED, PublishedSystem};
pub use readout::{PreparedReadout, Reading, ReadoutSkin, WireReadout, until_noticed};
pub use report::{GOOD_IOU, ReadoutRow, ReadoutsReport, SizeWire, Trial};
pub use rows::{StoredRows, WalshRows};
pub use study::{ReadoutsParameters, ReadoutsStudy};
pub use table::{READOUTS, ReadoutLine, readout};
pub use wire::{FALSE_ALARM_S, Frame, HeldWire, WireSession};
pub use wiring::{ReadoutWire, SkinWire};
