//! The host's end of the serial protocol.

use super::virtual_device::DeviceBlock;
use super::{SENDING, SENT, START};
use std::io::{self, BufRead as _, BufReader, Read, Write};

/// A connection to a device that has answered and is ready to be read.
pub struct Host<P> {
    port: BufReader<P>,
    /// Number of blocks read so far.
    read: usize,
}

/// Why a device cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HostError {
    /// The port failed, or the device was silent for too long.
    #[error("serial port: {0}")]
    Port(#[from] io::Error),
    /// The connection ended within a block.
    #[error("the device ended in block {block}, after {fields} of {needed} fields")]
    Ended {
        /// Number of the block, from 0.
        block: usize,
        /// Fields that came.
        fields: usize,
        /// Fields of a block.
        needed: usize,
    },
    /// The device sent unexpected text.
    #[error("the device said {found:?}; {needed} was expected")]
    Said {
        /// The text, shortened.
        found: String,
        /// The expected text.
        needed: String,
    },
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
    /// [`HostError`] if the device does not answer, or answers with unexpected text.
    pub fn greet(mut port: P) -> Result<Self, HostError> {
        port.write_all(&[START])?;
        port.flush()?;
        let mut host = Self {
            port: BufReader::new(port),
            read: 0,
        };
        for needed in [SENDING, SENT] {
            let mut line = Vec::new();
            host.port.by_ref().take(GREETING).read_until(b'\n', &mut line)?;
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
    /// [`HostError`] if the port fails, the block is too short or too long, or a field is not a number.
    pub fn block(&mut self, measurements: usize) -> Result<DeviceBlock, HostError> {
        let needed = measurements + 1;
        let mut line = Vec::with_capacity(4 * needed);
        let most = needed.saturating_mul(FIELD) as u64;
        self.port.by_ref().take(most).read_until(b'\n', &mut line)?;
        let text = String::from_utf8_lossy(&line);
        let Some(text) = text.strip_suffix('\n') else {
            return Err(HostError::Ended {
                block: self.read,
                fields: text.matches(',').count(),
                needed,
            });
        };
        let fields: Vec<&str> = text.split(',').collect();
        let [position, codes @ .., end] = fields.as_slice() else {
            return Err(said(text, "a block: numbers with commas"));
        };
        if !END.contains(end) || fields.len() != needed {
            let found = format!("{} fields that end in {end:?}", fields.len());
            return Err(said(
                &found,
                &format!("a block of {needed} fields, the last one a space"),
            ));
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

fn said(found: &str, needed: &str) -> HostError {
    HostError::Said {
        found: found.chars().take(SHOWN).collect(),
        needed: needed.to_owned(),
    }
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

    fn greeted(text: &str) -> Result<Host<Says>, HostError> {
        Host::greet(Says(io::Cursor::new(text.as_bytes().to_vec())))
    }

    #[test]
    fn what_a_device_should_not_say_is_refused() {
        for text in ["", "Hello\n", "Sending.\nnot yet\n", &"x".repeat(10_000)] {
            assert!(matches!(greeted(text), Err(HostError::Said { .. })), "{text:.20}");
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
                Err(error) => assert!(
                    !reason.is_empty() && error.to_string().contains(reason),
                    "{text:?}: {error}"
                ),
            }
        }
    }
}
