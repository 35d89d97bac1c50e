//! Tar files (POSIX.1-1988 "ustar") whose bytes depend only on names and contents.

use spts::output::{AtomicFile, OutputError};
use std::io::{self, Write as _};
use std::path::Path;

/// A tar file is made of blocks of so many bytes; contents are filled up with zeros.
const BLOCK: usize = 512;
/// Longest name of a member, bytes, and largest content, which 11 octal digits can say.
const NAME_BYTES: usize = 100;
const MAX_BYTES: u64 = (1 << 33) - 1;

/// A tar file that is being written.
pub(super) struct Tar(AtomicFile);

impl Tar {
    /// Begins the file `path`.
    ///
    /// # Errors
    /// [`OutputError`] when the file cannot be made.
    pub(super) fn create(path: &Path) -> Result<Self, OutputError> {
        AtomicFile::create(path).map(Self)
    }

    /// Adds the regular file `name`.
    ///
    /// # Errors
    /// [`OutputError`] when the name or the content is too long for the format, or the disk says no.
    pub(super) fn add(&mut self, name: &str, content: &[u8]) -> Result<(), OutputError> {
        self.0.fill(|out| {
            out.write_all(&header(name, content.len() as u64)?)?;
            out.write_all(content)?;
            out.write_all(&[0; BLOCK][..content.len().next_multiple_of(BLOCK) - content.len()])
        })
    }

    /// Ends the file, with two empty blocks, and gives it its name.
    ///
    /// # Errors
    /// [`OutputError`] when the disk says no.
    pub(super) fn finish(mut self) -> Result<(), OutputError> {
        self.0.fill(|out| out.write_all(&[0; 2 * BLOCK]))?;
        self.0.finish()
    }
}

/// Header of a regular file with mode 0644, of user and group 0, last changed at time 0.
fn header(name: &str, bytes: u64) -> io::Result<[u8; BLOCK]> {
    if name.len() > NAME_BYTES {
        return Err(io::ErrorKind::InvalidFilename.into());
    }
    if bytes > MAX_BYTES {
        return Err(io::ErrorKind::FileTooLarge.into());
    }
    let mut header = [0; BLOCK];
    let mut put = |at: usize, text: &[u8]| header[at..][..text.len()].copy_from_slice(text);
    put(0, name.as_bytes());
    put(100, b"0000644\0");
    put(108, b"0000000\0");
    put(116, b"0000000\0");
    put(124, format!("{bytes:011o}\0").as_bytes());
    put(136, b"00000000000\0");
    // the sum of the header's bytes, for which its own field counts as blanks
    put(148, b"        ");
    put(156, b"0");
    put(257, b"ustar\x0000");
    let sum: u32 = header.iter().map(|byte| u32::from(*byte)).sum();
    header[148..156].copy_from_slice(format!("{sum:06o}\0 ").as_bytes());
    Ok(header)
}
