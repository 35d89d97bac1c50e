//! Flash images of the cells.

use std::io;
use std::path::{Path, PathBuf};

use ihex::{ReaderError, Record};

/// Size of the flash of an ATtiny412, bytes.
pub const FLASH_BYTES: usize = 4096;

/// Longest file that is read: hex text of one byte a record would be a fifth of it.
const FILE_BYTES: u64 = 1 << 18;

/// Why Intel hex text is not an image of an ATtiny412.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Cause reported by the system.
        source: io::Error,
    },
    /// The text of the file is not valid.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: Box<ImageError>,
    },
    /// A line that is not a record.
    #[error("line {line}: {source}")]
    Record {
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        source: ReaderError,
    },
    /// Data outside flash.
    #[error("line {line}: data record of {bytes} bytes at {address:#x} is outside flash [0x0, 0x1000)")]
    Outside {
        /// Line, from 1.
        line: usize,
        /// First address of the record.
        address: usize,
        /// Length of the record.
        bytes: usize,
    },
    /// Two records with the same address.
    #[error("line {line}: data record repeats address {address:#x}")]
    Overlap {
        /// Line of the second, from 1.
        line: usize,
        /// The address.
        address: usize,
    },
    /// Text after the end-of-file record.
    #[error("line {line}: record after the end-of-file record")]
    BehindEnd {
        /// Line, from 1.
        line: usize,
    },
    /// The end-of-file record is missing.
    #[error("line {line}: end-of-file record is missing")]
    NoEnd {
        /// Last line, from 1.
        line: usize,
    },
    /// There is no data record.
    #[error("no data record")]
    Empty,
}

/// The content of every cell's flash.
///
/// ```
/// use spts_firmware::Image;
///
/// assert_eq!(Image::shipped().flash().len(), 4096);
/// // four bytes at 0x1000, behind the end of flash
/// let error = Image::from_hex(":041000000000000AE2\n:00000001FF\n").unwrap_err();
/// assert!(error.to_string().starts_with("line 1: data record of 4 bytes at 0x1000 is outside flash"));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    flash: Vec<u8>,
}

impl Image {
    /// The cell's firmware, `cell/cell.hex`.
    ///
    /// # Panics
    /// Never: the image is part of the crate, and a test reads it.
    #[must_use]
    pub fn shipped() -> Self {
        Self::from_hex(include_str!("../cell/cell.hex")).expect("the committed image is valid")
    }

    /// The same protocol in a simple implementation, `cell/cell_plain.hex`: it computes before it outputs, and a
    /// millisecond timer delays it.
    ///
    /// # Panics
    /// Never: the image is part of the crate, and a test reads it.
    #[must_use]
    pub fn plain() -> Self {
        Self::from_hex(include_str!("../cell/cell_plain.hex")).expect("the committed image is valid")
    }

    /// Reads an image from Intel hex text.
    ///
    /// # Errors
    /// [`ImageError`], with the line.
    pub fn from_hex(text: &str) -> Result<Self, ImageError> {
        let mut flash: Vec<Option<u8>> = vec![None; FLASH_BYTES];
        let (mut base, mut ended, mut last) = (0, false, 0);
        let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
        for (line, record) in lines.enumerate().filter(|(_, text)| !text.is_empty()) {
            let line = line + 1;
            last = line;
            if ended {
                return Err(ImageError::BehindEnd { line });
            }
            match Record::from_record_string(record).map_err(|source| ImageError::Record { line, source })? {
                Record::Data { offset, value } => place(&mut flash, line, base + usize::from(offset), &value)?,
                Record::EndOfFile => ended = true,
                Record::ExtendedSegmentAddress(segment) => base = usize::from(segment) << 4,
                Record::ExtendedLinearAddress(upper) => base = usize::from(upper) << 16,
                // where a debugger would start; a cell starts at its reset vector
                Record::StartSegmentAddress { .. } | Record::StartLinearAddress(_) => {}
            }
        }
        if flash.iter().all(Option::is_none) {
            return Err(ImageError::Empty);
        }
        if !ended {
            return Err(ImageError::NoEnd { line: last });
        }
        let flash = flash.into_iter().map(|byte| byte.unwrap_or(u8::MAX)).collect();
        Ok(Self { flash })
    }

    /// Reads an image from an Intel hex file.
    ///
    /// # Errors
    /// [`ImageError`], with the file and, if it could be read, the line.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let unreadable = |source| ImageError::Read {
            path: path.to_path_buf(),
            source,
        };
        let text = read_text(path).map_err(unreadable)?;
        Self::from_hex(&text).map_err(|source| ImageError::File {
            path: path.to_path_buf(),
            source: Box::new(source),
        })
    }

    /// All of flash, [`FLASH_BYTES`] long. Bytes that are not part of the image are erased, 255.
    #[must_use]
    pub fn flash(&self) -> &[u8] {
        &self.flash
    }
}

/// Text of a regular file that is not larger than any hex file of such a flash.
fn read_text(path: &Path) -> io::Result<String> {
    Ok(spts_input::read_text(path, FILE_BYTES)?)
}

fn place(flash: &mut [Option<u8>], line: usize, address: usize, value: &[u8]) -> Result<(), ImageError> {
    let bytes = value.len();
    let outside = ImageError::Outside { line, address, bytes };
    let target = flash.get_mut(address..address + bytes).ok_or(outside)?;
    for (k, (byte, new)) in target.iter_mut().zip(value).enumerate() {
        if byte.replace(*new).is_some() {
            let address = address + k;
            return Err(ImageError::Overlap { line, address });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const END: &str = ":00000001FF";

    #[test]
    fn the_committed_images_are_whole() {
        for image in [Image::shipped(), Image::plain()] {
            assert_eq!(image.flash().len(), FLASH_BYTES);
            // rjmp in each of the 26 vectors: 1100 kkkk kkkk kkkk
            assert!(image.flash()[..52].chunks(2).all(|word| word[1] >> 4 == 0xc));
        }
        assert_ne!(Image::shipped(), Image::plain());
    }

    /// Checksums by hand: minus the sum of the bytes, modulo 256.
    #[test]
    fn records_go_where_they_say() {
        let image = Image::from_hex(&format!(
            "\u{feff}:020000020010EC\r\n:020004000102F7 \r\n\r\n{END}\r\n\t\n"
        ))
        .unwrap();
        assert_eq!(image.flash()[0x103..0x107], [255, 1, 2, 255]);
    }

    #[test]
    fn wrong_text_is_named_by_its_line() {
        let data = ":020000000102FB";
        for (text, expected) in [
            (
                format!("{data}\n:0100020001FD\n{END}"),
                "line 2: invalid checksum 'FC', expecting 'FD'",
            ),
            (format!("{data}\nhello\n{END}"), "line 2: missing start code ':'"),
            (
                format!("{data}\n:0100010009F5\n{END}"),
                "line 2: data record repeats address 0x1",
            ),
            (
                format!(":020FFF000102ED\n{END}"),
                "line 1: data record of 2 bytes at 0xfff is outside flash [0x0, 0x1000)",
            ),
            (
                format!("{data}\n:0200000400807A\n{data}\n{END}"),
                "line 3: data record of 2 bytes at 0x800000 is outside flash [0x0, 0x1000)",
            ),
            (
                format!("{data}\n{END}\n{data}"),
                "line 3: record after the end-of-file record",
            ),
            (format!("{data}\n"), "line 1: end-of-file record is missing"),
            (END.to_owned(), "no data record"),
        ] {
            assert_eq!(Image::from_hex(&text).unwrap_err().to_string(), expected);
        }
    }

    #[test]
    fn files_are_named() {
        let path = Path::new("no/such/cell.hex");
        let message = Image::read(path).unwrap_err().to_string();
        assert!(message.starts_with("no/such/cell.hex: "), "{message}");
        let dir = tempfile::tempdir().unwrap();
        let folder = Image::read(dir.path()).unwrap_err().to_string();
        assert!(folder.ends_with(": is a folder, not a regular file"), "{folder}");
        for (bytes, words) in [
            (vec![0xFF; 9], "not utf-8"),
            (vec![b'x'; 1 << 19], "524288 bytes is outside [0, 262144]"),
        ] {
            let path = dir.path().join("wrong.hex");
            std::fs::write(&path, bytes).unwrap();
            let message = Image::read(&path).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }
}
