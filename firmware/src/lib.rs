//! The cell firmware of the single-pixel tactile skin: flash images, the controllers that run them, and the protocol.
//!
//! Every taxel has an ATtiny412 that is an I²C client and drives the taxel from its DAC. All cells share the bus and
//! one clock line; on every edge of that line each cell puts out its next level. There are three views of such a cell
//! here:
//!
//! - [`Image`]: what is in its flash, built from C and assembly in `firmware/cell`. `firmware/cell/README.md` has the
//!   protocol, what was decided where the published device leaves it open, and the timing.
//! - [`attiny412::Device`]: an emulated ATtiny412, cycle by cycle, on an AVRxt core ([`avr`]). [`Array`] has up to 112
//!   of them on one bus and one clock.
//! - [`Cell`]: the protocol as behaviour, without timing: the specification that the images are tested against.
//!
//! The levels are the circuit model's weights bit for bit. What an emulated cell adds is time: when its DAC changes
//! after an edge, and which edges it loses.
//!
//! ```
//! use spts_firmware::{Array, CellMode, Clock, Image};
//!
//! let mut array = Array::new(100, &Image::shipped())?;
//! array.start(CellMode::Binary)?;
//! let mut codes = [0; 100];
//! array.clock(Clock::default(), &mut codes)?;
//! // with seeds this close together, the first binary measurement is all zeros
//! assert_eq!(codes, [0; 100]);
//! # Ok::<(), spts_firmware::ArrayError>(())
//! ```

mod array;
pub mod attiny412;
pub mod avr;
mod cell;
mod image;
mod pattern;

pub use array::{Array, ArrayError, BusError, BusEvent, BusReply, Clock, SKIN_EDGE_HZ, SKIN_SAMPLE_DELAY_S};
pub use cell::{
    AddressError, Cell, CellMode, FIRST_ADDRESS, LAST_ADDRESS, LAST_BUS_ADDRESS, NEUTRAL_CODE, REPLY_BYTES,
};
pub use image::{FLASH_BYTES, Image, ImageError};
pub use pattern::{PATTERN_BITS, Pattern, PatternError};
