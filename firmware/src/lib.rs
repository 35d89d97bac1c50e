//! The cell firmware of the single-pixel tactile skin: flash images, the controllers that run them, and the protocol.
//!
//! Every taxel has an ATtiny412 that is an I²C client and drives the taxel with its DAC. All cells share the bus and
//! one clock line; at every edge of that line each cell puts out its next level. The crate has three models of such a
//! cell:
//!
//! - [`Image`]: the content of its flash, built from C and assembly in `firmware/cell`. `firmware/cell/README.md`
//!   describes the protocol, the choices made where the published device leaves it open, and the timing.
//! - [`attiny412::Device`]: an emulated ATtiny412, cycle by cycle, on an AVRxt core ([`avr`]). [`Array`] has up to 112
//!   of them on one bus and one clock.
//! - [`Cell`]: the behaviour of the protocol without timing. It is the specification for testing the images.
//!
//! The levels equal the circuit model's weights bit for bit. An emulated cell adds timing: when its DAC changes after
//! an edge, and which edges it misses.
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
//! # Ok::<(), spts_input::Refusal>(())
//! ```

mod array;
pub mod attiny412;
pub mod avr;
mod cell;
mod image;

pub use array::{Array, BusEvent, BusReply, Clock, SKIN_EDGE_HZ, SKIN_SAMPLE_DELAY_S};
pub use cell::{
    Cell, CellMode, FIRST_ADDRESS, LAST_ADDRESS, LAST_BUS_ADDRESS, NEUTRAL_CODE, PATTERN_BITS, Pattern, REPLY_BYTES,
};
pub use image::{FLASH_BYTES, Image};
