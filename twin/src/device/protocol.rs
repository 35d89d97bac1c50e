//! Both ends of the serial protocol.

use spts_circuit::Mode;
use spts_input::Refusal;
use std::io::{self, BufRead as _, BufReader, Read, Write};
use std::thread::sleep;
use std::time::Duration;

/// What wakes the device.
const START: u8 = b'*';
/// Its first answer.
const SENDING: &str = "Sending.";
/// Its answer when the cells are loaded.
const SENT: &str = "Sent!.";

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
/// use spts::{Mode, Refusal};
/// use spts::device::{BlockSource, DeviceBlock};
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
///     fn next_block(&mut self) -> Result<Option<DeviceBlock>, Refusal> {
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
    /// [`Refusal`] if the block cannot be made.
    fn next_block(&mut self) -> Result<Option<DeviceBlock>, Refusal>;
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
    /// [`Refusal`] if the port or the source fails.
    pub fn serve(&mut self, source: &mut dyn BlockSource, mut sent: impl FnMut(u64)) -> Result<u64, Refusal> {
        let mut byte = [0];
        while byte[0] != START {
            self.port.read_exact(&mut byte).map_err(of_port)?;
        }
        writeln!(self.port, "{SENDING}").map_err(of_port)?;
        self.pause(LOADING_S);
        writeln!(self.port, "{SENT}").map_err(of_port)?;
        let mut count = 0;
        while let Some(block) = source.next_block()? {
            self.pause(wait_s(source.mode()) + block.codes.len() as f64 / source.sample_rate_hz());
            write_block(&mut self.port, &block).map_err(of_port)?;
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

/// The error of the port, or of a device that was silent for too long.
fn of_port(error: io::Error) -> Refusal {
    Refusal::from_error(error).at("serial port")
}

/// A connection to a device that has answered and is ready to be read.
pub struct Host<P> {
    port: BufReader<P>,
    /// Number of blocks read so far.
    read: usize,
}

/// Longest line of a greeting, bytes.
const GREETING: u64 = 256;
/// Most characters of an answer that an error shows.
const SHOWN: usize = 40;
/// Most bytes of a field, with its comma.
const FIELD: usize = 24;
/// Bytes at the end of a block: the last field is a space.
const END: [&str; 2] = [" \r", " "];

impl<P: Read + Write> Host<P> {
    /// Wakes the device on `port`, and waits until its cells are loaded.
    ///
    /// # Errors
    /// [`Refusal`] if the device does not answer, or answers with unexpected text.
    pub fn greet(mut port: P) -> Result<Self, Refusal> {
        port.write_all(&[START]).and_then(|()| port.flush()).map_err(of_port)?;
        let mut host = Self { port: BufReader::new(port), read: 0 };
        for needed in [SENDING, SENT] {
            let mut line = Vec::new();
            host.port.by_ref().take(GREETING).read_until(b'\n', &mut line).map_err(of_port)?;
            let found = String::from_utf8_lossy(&line);
            if found.trim_end() != needed {
                return Err(said(&found, &format!("{needed:?}")));
            }
        }
        Ok(host)
    }

    /// Reads the next block of `measurements` measurements. The device does not send the last code, so the block has
    /// one code less.
    ///
    /// # Errors
    /// [`Refusal`] if the port fails, the block is too short or too long, or a field is not a number.
    pub fn block(&mut self, measurements: usize) -> Result<DeviceBlock, Refusal> {
        let needed = measurements + 1;
        let mut line = Vec::with_capacity(4 * needed);
        let most = needed.saturating_mul(FIELD) as u64;
        self.port.by_ref().take(most).read_until(b'\n', &mut line).map_err(of_port)?;
        let text = String::from_utf8_lossy(&line);
        let Some(text) = text.strip_suffix('\n') else {
            let (block, fields) = (self.read, text.matches(',').count());
            let problem = format!("the device ended in block {block}, after {fields} of {needed} fields");
            return Err(Refusal::new(problem));
        };
        let fields: Vec<&str> = text.split(',').collect();
        let [position, codes @ .., end] = fields.as_slice() else {
            return Err(said(text, "a block: numbers with commas"));
        };
        if !END.contains(end) || fields.len() != needed {
            let found = format!("{} fields that end in {end:?}", fields.len());
            return Err(said(&found, &format!("a block of {needed} fields, the last one a space")));
        }
        let number = |field: &&str| field.parse().map_err(|_| said(field, "a code of the converter"));
        let block = DeviceBlock {
            frame_position: position.parse().map_err(|_| said(position, "a number of frames"))?,
            codes: codes.iter().map(number).collect::<Result<_, _>>()?,
        };
        self.read += 1;
        Ok(block)
    }
}

fn said(found: &str, needed: &str) -> Refusal {
    let found: String = found.chars().take(SHOWN).collect();
    Refusal::new(format!("the device said {found:?}; {needed} was expected"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A port that says `self.0` and hears nothing.
    struct Says(io::Cursor<Vec<u8>>);

    impl Read for Says {
        fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
            self.0.read(out)
        }
    }

    impl Write for Says {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            assert_eq!(bytes, b"*");
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn greeted(text: &str) -> Result<Host<Says>, Refusal> {
        Host::greet(Says(io::Cursor::new(text.as_bytes().to_vec())))
    }

    #[test]
    fn what_a_device_should_not_say_is_refused() {
        for text in ["", "Hello\n", "Sending.\nnot yet\n", &"x".repeat(10_000)] {
            let said = greeted(text).map(drop).unwrap_err().to_string();
            assert!(said.starts_with("the device said "), "{text:.20}: {said}");
        }
        for (text, reason) in [
            ("7,1,2, \r\n", ""),
            ("7,1,2", "the device ended in block 0, after 2 of 4 fields"),
            ("", "the device ended in block 0, after 0 of 4 fields"),
            ("7,1, \r\n", "3 fields"),
            ("7,1,2,3, \r\n", "5 fields"),
            ("7,1,2,3\r\n", "4 fields"),
            ("7,1,x, \r\n", "a code"),
            ("x,1,2, \r\n", "a number of frames"),
            ("7,1,-2, \r\n", "a code"),
            ("\n", "a block"),
        ] {
            let mut host = greeted(&format!("Sending.\nSent!.\n{text}")).unwrap();
            match host.block(3) {
                Ok(block) => assert_eq!((block.frame_position, block.codes, reason), (7, vec![1, 2], "")),
                Err(error) => assert!(!reason.is_empty() && error.to_string().contains(reason), "{text:?}: {error}"),
            }
        }
    }
}
