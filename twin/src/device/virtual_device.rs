//! The device's end of the serial protocol.

use super::{SENDING, SENT, START};
use crate::chain::ChainError;
use spts_circuit::Mode;
use std::io::{self, Read, Write};
use std::thread::sleep;
use std::time::Duration;

/// One block of samples as the device sends it over the serial port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceBlock {
    /// Frames since the seeds were loaded, at the end of the block.
    pub frame_position: u64,
    /// Codes of the converter, in order of measurement.
    pub codes: Vec<u32>,
}

/// Where a virtual device gets its blocks from: a simulated press, or a recording.
///
/// ```
/// use spts::Mode;
/// use spts::device::{BlockSource, DeviceBlock, DeviceError};
///
/// /// Two blocks of the same codes.
/// struct Twice(u64);
///
/// impl BlockSource for Twice {
///     fn mode(&self) -> Mode {
///         Mode::Compressive
///     }
///     fn sample_rate_hz(&self) -> f64 {
///         64_300.0
///     }
///     fn next_block(&mut self) -> Result<Option<DeviceBlock>, DeviceError> {
///         self.0 += 1;
///         Ok((self.0 <= 2).then(|| DeviceBlock { frame_position: self.0, codes: vec![512; 100] }))
///     }
/// }
/// let mut source = Twice(0);
/// assert_eq!(std::iter::from_fn(|| source.next_block().ok().flatten()).count(), 2);
/// ```
pub trait BlockSource {
    /// Mode of the readout.
    fn mode(&self) -> Mode;

    /// Measurements a second, Hz.
    fn sample_rate_hz(&self) -> f64;

    /// The next block; `None` after the last.
    ///
    /// # Errors
    /// [`DeviceError`] if the block cannot be made.
    fn next_block(&mut self) -> Result<Option<DeviceBlock>, DeviceError>;
}

/// Why a virtual device stopped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// The port failed.
    #[error("serial port: {0}")]
    Port(#[from] io::Error),
    /// Skin or readout failed.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// The source has no codes to send.
    #[error("{0}")]
    Source(String),
}

/// A stand-in for the skin's hardware that speaks the published serial protocol on a port.
pub struct VirtualDevice<P> {
    port: P,
    real_time: bool,
}

/// Time from the touch to the beginning of the recording, s.
fn wait_s(mode: Mode) -> f64 {
    match mode {
        Mode::Raster => 1.3,
        Mode::Compressive => 1.4,
    }
}

/// Time in which the cells are loaded, s: a hundred of them, one after the other, over the bus.
const LOADING_S: f64 = 0.1;

impl<P: Read + Write> VirtualDevice<P> {
    /// A device on `port`. If `real_time`, it sends at the rate of the real device; otherwise as fast as the host
    /// reads.
    pub fn new(port: P, real_time: bool) -> Self {
        Self { port, real_time }
    }

    /// Waits for the host, then sends all blocks of `source`. Calls `sent` after each. Returns the number of blocks.
    ///
    /// # Errors
    /// [`DeviceError`] if the port or the source fails.
    pub fn serve(&mut self, source: &mut dyn BlockSource, mut sent: impl FnMut(u64)) -> Result<u64, DeviceError> {
        let mut byte = [0];
        while byte[0] != START {
            self.port.read_exact(&mut byte)?;
        }
        writeln!(self.port, "{SENDING}")?;
        self.pause(LOADING_S);
        writeln!(self.port, "{SENT}")?;
        let mut count = 0;
        while let Some(block) = source.next_block()? {
            self.pause(wait_s(source.mode()) + block.codes.len() as f64 / source.sample_rate_hz());
            write_block(&mut self.port, &block)?;
            count += 1;
            sent(count);
        }
        Ok(count)
    }

    fn pause(&self, seconds: f64) {
        if self.real_time {
            sleep(Duration::from_secs_f64(seconds));
        }
    }
}

/// Sends all codes of `block` but the last, as the real device does.
///
/// # Errors
/// The error of the port.
pub fn write_block(port: &mut impl Write, block: &DeviceBlock) -> io::Result<()> {
    let mut text = String::with_capacity(4 * block.codes.len() + 32);
    let kept = block.codes.len().saturating_sub(1);
    text.push_str(&block.frame_position.to_string());
    text.push(',');
    for code in &block.codes[..kept] {
        text.push_str(&code.to_string());
        text.push(',');
    }
    text.push_str(" \r\n");
    port.write_all(text.as_bytes())?;
    port.flush()
}
