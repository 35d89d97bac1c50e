//! Compares readouts with few wires: skins, touches, amplifier, noise, converter and clock are the same for all.
//!
//! A [`WireReadout`] requests measurements from a [`HeldWire`] and returns images. [`READOUTS`] is the table of
//! readouts, and [`conformance`] checks every line. [`ReadoutsStudy`] measures them; docs/readouts.md describes the
//! protocol.
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
//! # Ok::<(), spts_input::Refusal>(())
//! ```

mod adaptive;
mod classify;
mod code_division;
mod conformance;
mod decode;
mod designed;
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
pub use published::{PUBLISHED, PublishedSystem};
pub use readout::{PreparedReadout, Reading, ReadoutSkin, WireReadout, until_noticed};
pub use report::{GOOD_IOU, ReadoutRow, ReadoutTrial, ReadoutsReport, SizeWire};
pub use rows::{StoredRows, WalshRows};
pub use study::{ReadoutsParameters, ReadoutsStudy};
pub use table::{READOUTS, ReadoutLine, readout};
pub use wire::{FALSE_ALARM_S, HeldWire, WireFrame, WireSession};
pub use wiring::{ReadoutWire, SkinWire};
