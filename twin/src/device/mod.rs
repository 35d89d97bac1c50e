//! The skin's serial port: both ends of the published protocol.
//!
//! The device ignores every byte until it reads `*`. It answers `Sending.`, loads its cells, answers `Sent!.`, and
//! reads nothing more. From then on it sends block after block, one a line: the number of frames from loading the seeds
//! to the end of the block, then the codes of the converter. Every field is followed by a comma, and the line ends with
//! a space. The last code of a block is never sent.
//!
//! [`VirtualDevice`] is the device. It sends the blocks of a [`BlockSource`]: a recorded session, or an object pressed
//! while it measures. [`Host`] reads a device, real or virtual.
//!
//! ```
//! use spts::device::{DeviceBlock, write_block};
//!
//! let mut sent = Vec::new();
//! write_block(&mut sent, &DeviceBlock { frame_position: 1020, codes: vec![500, 499, 498] })?;
//! assert_eq!(sent, b"1020,500,499, \r\n");
//! # Ok::<(), std::io::Error>(())
//! ```

mod protocol;
mod sources;

pub use protocol::{BlockSource, DeviceBlock, Heard, HeardBlock, Host, VirtualDevice, write_block};
pub use sources::{Played, Pressed, PressedConfig};
