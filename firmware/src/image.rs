//! Flash images of the cells.

use spts_input::Refusal;
use std::fmt::Display;
use std::path::Path;

use ihex::Record;

/// Size of the flash of an ATtiny412, bytes.
pub const FLASH_BYTES: usize = 4096;

/// Longest file that is read: hex text of one byte a record would be a fifth of it.
const FILE_BYTES: u64 = 1 << 18;

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
    pub fn shipped() -> Self {
        Self::from_hex(include_str!("../cell/cell.hex")).expect("the committed image is valid")
    }

    /// The same protocol in a simple implementation, `cell/cell_plain.hex`: it computes before it outputs, and a
    /// millisecond timer delays it.
    ///
    /// # Panics
    /// Never: the image is part of the crate, and a test reads it.
    pub fn plain() -> Self {
        Self::from_hex(include_str!("../cell/cell_plain.hex")).expect("the committed image is valid")
    }

    /// Reads an image from Intel hex text.
    ///
    /// # Errors
    /// [`Refusal`], with the line.
    pub fn from_hex(text: &str) -> Result<Self, Refusal> {
        let mut flash: Vec<Option<u8>> = vec![None; FLASH_BYTES];
        let (mut base, mut ended, mut last) = (0, false, 0);
        let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
        for (line, record) in lines.enumerate().filter(|(_, text)| !text.is_empty()) {
            let line = line + 1;
            last = line;
            if ended {
                return Err(at_line(line, "record after the end-of-file record"));
            }
            match Record::from_record_string(record).map_err(|e| at_line(line, e))? {
                Record::Data { offset, value } => place(&mut flash, line, base + usize::from(offset), &value)?,
                Record::EndOfFile => ended = true,
                Record::ExtendedSegmentAddress(segment) => base = usize::from(segment) << 4,
                Record::ExtendedLinearAddress(upper) => base = usize::from(upper) << 16,
                // where a debugger would start; a cell starts at its reset vector
                Record::StartSegmentAddress { .. } | Record::StartLinearAddress(_) => {}
            }
        }
        if flash.iter().all(Option::is_none) {
            return Err(Refusal::new("no data record"));
        }
        if !ended {
            return Err(at_line(last, "end-of-file record is missing"));
        }
        let flash = flash.into_iter().map(|byte| byte.unwrap_or(u8::MAX)).collect();
        Ok(Self { flash })
    }

    /// Reads an image from an Intel hex file.
    ///
    /// # Errors
    /// [`Refusal`], with the file and, if it could be read, the line.
    pub fn read(path: &Path) -> Result<Self, Refusal> {
        let text = spts_input::read_text(path, FILE_BYTES).map_err(Refusal::from_error);
        let image = text.and_then(|text| Self::from_hex(&text));
        image.map_err(|e| e.at(path.display()))
    }

    /// All of flash, [`FLASH_BYTES`] long. Bytes that are not part of the image are erased, 255.
    pub fn flash(&self) -> &[u8] {
        &self.flash
    }
}

fn at_line(line: usize, what: impl Display) -> Refusal {
    Refusal::new(format!("line {line}: {what}"))
}

fn place(flash: &mut [Option<u8>], line: usize, address: usize, value: &[u8]) -> Result<(), Refusal> {
    let bytes = value.len();
    let outside = || {
        let record = format!("data record of {bytes} bytes at {address:#x}");
        at_line(line, format!("{record} is outside flash [0x0, 0x1000)"))
    };
    let target = flash.get_mut(address..address + bytes).ok_or_else(outside)?;
    for (k, (byte, new)) in target.iter_mut().zip(value).enumerate() {
        if byte.replace(*new).is_some() {
            return Err(at_line(line, format!("data record repeats address {:#x}", address + k)));
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
        let image =
            Image::from_hex(&format!("\u{feff}:020000020010EC\r\n:020004000102F7 \r\n\r\n{END}\r\n\t\n")).unwrap();
        assert_eq!(image.flash()[0x103..0x107], [255, 1, 2, 255]);
    }

    #[test]
    fn wrong_text_is_named_by_its_line() {
        let data = ":020000000102FB";
        for (text, expected) in [
            (format!("{data}\n:0100020001FD\n{END}"), "line 2: invalid checksum 'FC', expecting 'FD'"),
            (format!("{data}\nhello\n{END}"), "line 2: missing start code ':'"),
            (format!("{data}\n:0100010009F5\n{END}"), "line 2: data record repeats address 0x1"),
            (
                format!(":020FFF000102ED\n{END}"),
                "line 1: data record of 2 bytes at 0xfff is outside flash [0x0, 0x1000)",
            ),
            (
                format!("{data}\n:0200000400807A\n{data}\n{END}"),
                "line 3: data record of 2 bytes at 0x800000 is outside flash [0x0, 0x1000)",
            ),
            (format!("{data}\n{END}\n{data}"), "line 3: record after the end-of-file record"),
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
        for (bytes, words) in
            [(vec![0xFF; 9], "not utf-8"), (vec![b'x'; 1 << 19], "524288 bytes is outside [0, 262144]")]
        {
            let path = dir.path().join("wrong.hex");
            std::fs::write(&path, bytes).unwrap();
            let message = Image::read(&path).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }
}
