//! The cell firmware of the single-pixel tactile skin: its protocol and behaviour.
//!
//! Every taxel has a microcontroller that is an I²C client and drives the taxel from its DAC. All cells share the bus and
//! one clock line; on every edge of that line each cell puts out its next level. This crate is a behavioural model of the
//! device's published firmware: same bytes in, same DAC codes out, edge by edge. It has no timing; delays and missed edges
//! are effects of the circuit model.
//!
//! # Protocol
//!
//! A cell answers to its own address, 8…107. The master writes pairs of bytes, mode and seed:
//!
//! | mode | on each edge | DAC code |
//! |---|---|---|
//! | 0 raster | counter += 1 | 255 if counter = address, else 126; after 107 the counter is 7 again |
//! | 1 analog | state = 1664525·state + 1013904223 mod 2³² | top byte of the state |
//! | 2 binary | the same | 255 if the top byte is 128 or more, else 0 |
//!
//! The seed byte becomes the state (the master sends each cell its address), and every pair resets the counter to 7, so that
//! the first edge selects the cell at address 8.
//!
//! # Decided here
//!
//! The published firmware leaves open, and this model decides: a cell that has not been written to is in raster mode with
//! counter 7 and its address as the state; before the first edge the DAC is at mid-scale, code 126, and a pair of bytes does not
//! change the DAC until the next edge; a pair with an unknown mode is ignored; a mode byte without a seed is dropped at
//! the end of the write; a read returns the present DAC code.
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

pub use array::{Array, ArrayError, BusError, BusEvent, BusReply, Clock};
pub use cell::{
    AddressError, Cell, CellMode, FIRST_ADDRESS, LAST_ADDRESS, LAST_BUS_ADDRESS, NEUTRAL_CODE, REPLY_BYTES,
};
pub use image::{FLASH_BYTES, Image, ImageError};
