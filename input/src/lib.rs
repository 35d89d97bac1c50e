//! Opens input files safely: only regular files of a limited size, and text in UTF-8.
//!
//! An untrusted file may be a pipe that never answers, a link to an endless device, or larger than memory. Every reader
//! of such files opens them with these functions and a limit of its own.
//!
//! ```
//! let path = std::env::temp_dir().join(format!("spts-input-{}.toml", std::process::id()));
//! std::fs::write(&path, "\u{feff}seed = 3\n")?;
//! assert_eq!(spts_input::read_text(&path, 1 << 20)?, "seed = 3\n");
//! assert!(spts_input::read(&path, 4).is_err());
//! # std::fs::remove_file(&path)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod refusal;
mod tables;

pub use refusal::Refusal;
pub use tables::Tables;

use std::borrow::Cow;
use std::fs::{File, FileType, OpenOptions};
use std::io::{self, Read as _};
use std::path::Path;

/// Why a file was refused. The message has no path: the caller adds it, because it knows the file's purpose.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// The file system reports an error.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A folder, pipe, socket or device.
    #[error("is {found}, not a regular file")]
    NotRegular {
        /// Kind of the file.
        found: &'static str,
    },
    /// A file that is larger than the reader's limit.
    #[error("file size = {bytes} bytes is outside [0, {most}]")]
    TooLong {
        /// Size of the file, bytes; for a file that grows, the number of bytes read.
        bytes: u64,
        /// Largest size that is read, bytes.
        most: u64,
    },
    /// Text in UTF-16.
    #[error("the text is UTF-16; only utf-8 is read, save the file as utf-8")]
    Utf16,
    /// Bytes that are not UTF-8.
    #[error("the text is not utf-8: byte {byte} (from 0) is {value:#04x}")]
    NotUtf8 {
        /// Position of the first byte that is not valid, from 0.
        byte: usize,
        /// Its value.
        value: u8,
    },
}

impl From<InputError> for io::Error {
    fn from(error: InputError) -> Self {
        match error {
            InputError::Io(error) => error,
            other => io::Error::new(io::ErrorKind::InvalidData, other),
        }
    }
}

/// Opens the regular file at `path`, at most `most` bytes long. Returns the file and its length, bytes.
///
/// ```
/// use spts_input::open;
///
/// let folder = std::env::temp_dir();
/// assert_eq!(open(&folder, 1000).unwrap_err().to_string(), "is a folder, not a regular file");
/// ```
///
/// # Errors
/// [`InputError::Io`], [`InputError::NotRegular`] or [`InputError::TooLong`]. A pipe without a writer is refused at
/// once.
pub fn open(path: &Path, most: u64) -> Result<(File, u64), InputError> {
    // a device may act when it is opened, so it is not even opened
    regular(std::fs::metadata(path)?.file_type())?;
    let mut options = OpenOptions::new();
    options.read(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt as _;
        // whatever has taken the file's place meanwhile does not block; on a regular file the flag means nothing
        options.custom_flags(rustix::fs::OFlags::NONBLOCK.bits().cast_signed());
    }
    let file = options.open(path)?;
    let found = file.metadata()?;
    regular(found.file_type())?;
    let bytes = found.len();
    if bytes > most {
        return Err(InputError::TooLong { bytes, most });
    }
    Ok((file, bytes))
}

/// Reads the regular file at `path`, at most `most` bytes long.
///
/// # Errors
/// As [`open`], and [`InputError::Io`] if there is not enough memory.
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>, InputError> {
    let (file, length) = open(path, most)?;
    let mut bytes = Vec::new();
    // one byte more, so that a file that grows while it is read is noticed
    let length = usize::try_from(length).unwrap_or(usize::MAX).saturating_add(1);
    bytes.try_reserve_exact(length).map_err(io::Error::other)?;
    file.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    match bytes.len() as u64 {
        found if found > most => Err(InputError::TooLong { bytes: found, most }),
        _ => Ok(bytes),
    }
}

/// Reads the regular file at `path`, at most `most` bytes long, as text without its byte-order mark.
///
/// # Errors
/// As [`read`] and [`text`].
pub fn read_text(path: &Path, most: u64) -> Result<String, InputError> {
    let mut bytes = read(path, most)?;
    text(&bytes)?;
    if bytes.starts_with(MARK) {
        bytes.drain(..MARK.len());
    }
    String::from_utf8(bytes).map_err(|error| {
        let byte = error.utf8_error().valid_up_to();
        let value = error.as_bytes().get(byte).copied().unwrap_or_default();
        InputError::NotUtf8 { byte, value }
    })
}

/// The byte-order mark of UTF-8, which some editors put first.
const MARK: &[u8] = b"\xef\xbb\xbf";

/// Decodes `bytes` as UTF-8 text without a byte-order mark.
///
/// ```
/// use spts_input::{InputError, text};
///
/// assert_eq!(text(b"\xEF\xBB\xBFseed = 1")?, "seed = 1"); // without the byte-order mark
/// let error = text(b"seed = \xE9").unwrap_err();
/// assert_eq!(error.to_string(), "the text is not utf-8: byte 7 (from 0) is 0xe9");
/// # Ok::<(), InputError>(())
/// ```
///
/// # Errors
/// [`InputError::Utf16`] or [`InputError::NotUtf8`].
pub fn text(bytes: &[u8]) -> Result<&str, InputError> {
    // a zero in one of the first two bytes, as no text of ours has
    if is_utf16(bytes) || matches!(bytes, [first, second, ..] if (*first == 0) != (*second == 0)) {
        return Err(InputError::Utf16);
    }
    let plain = bytes.strip_prefix(MARK).unwrap_or(bytes);
    std::str::from_utf8(plain).map_err(|error| {
        let byte = bytes.len() - plain.len() + error.valid_up_to();
        let value = bytes.get(byte).copied().unwrap_or_default();
        InputError::NotUtf8 { byte, value }
    })
}

/// As [`text`], with U+FFFD in place of what is not UTF-8: for formats whose keywords and numbers are ASCII, and whose
/// names and comments may be in any encoding that has ASCII in it, such as Latin-1 or GBK.
///
/// ```
/// assert_eq!(spts_input::lossy_text(b"o T\xFCr")?, "o T\u{fffd}r");
/// # Ok::<(), spts_input::InputError>(())
/// ```
///
/// # Errors
/// [`InputError::Utf16`].
pub fn lossy_text(bytes: &[u8]) -> Result<Cow<'_, str>, InputError> {
    match text(bytes) {
        Ok(text) => Ok(Cow::Borrowed(text)),
        Err(InputError::NotUtf8 { .. }) => Ok(String::from_utf8_lossy(bytes.strip_prefix(MARK).unwrap_or(bytes))),
        Err(error) => Err(error),
    }
}

/// Whether `bytes` are surely text in UTF-16: they begin with its mark, or most of their first characters have a zero
/// in the same one of their two bytes, and none in the other.
pub fn is_utf16(bytes: &[u8]) -> bool {
    let pairs = bytes.as_chunks::<2>().0;
    let pairs = &pairs[..pairs.len().min(128)];
    let Some(first) = pairs.first() else { return false };
    let [high, low] = [0, 1].map(|k| pairs.iter().filter(|pair| pair[k] == 0).count());
    let mark = matches!(first, [0xff, 0xfe] | [0xfe, 0xff]);
    mark || (high.min(low) == 0 && 2 * high.max(low) > pairs.len())
}

fn regular(found: FileType) -> Result<(), InputError> {
    if found.is_file() {
        return Ok(());
    }
    Err(InputError::NotRegular { found: name(found) })
}

#[cfg(unix)]
fn name(found: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt as _;
    match found {
        _ if found.is_dir() => "a folder",
        _ if found.is_fifo() => "a pipe",
        _ if found.is_socket() => "a socket",
        _ => "a device",
    }
}

#[cfg(not(unix))]
fn name(found: FileType) -> &'static str {
    if found.is_dir() { "a folder" } else { "a device" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_comes_without_its_mark_and_other_encodings_are_named() {
        assert_eq!(text(b"\xef\xbb\xbfv 0").unwrap(), "v 0");
        assert_eq!(text(b"").unwrap(), "");
        for wide in [&b"\xff\xfev\0"[..], b"\xfe\xff\0v", b"v\0 \0", b"\0v\0 "] {
            assert!(matches!(text(wide), Err(InputError::Utf16)), "{wide:?}");
        }
        let said = text(b"\xef\xbb\xbfab\xc3(").unwrap_err().to_string();
        assert!(said.contains("byte 5") && said.contains("0xc3"), "{said}");
    }

    #[test]
    fn utf16_without_a_mark_is_told_by_its_zeros() {
        let wide = |text: &str| text.encode_utf16().flat_map(u16::to_be_bytes).collect::<Vec<u8>>();
        assert!(is_utf16(&wide("v 0 0 0\nv 1 0 0")) && is_utf16(&wide("# Kugel \u{7403}\nv 0 0 0")));
        assert!(matches!(lossy_text(&wide("\u{7403} is a ball")), Err(InputError::Utf16)));
        // a binary header
        assert!(!is_utf16(&[0; 80]) && !is_utf16(b"x\0\0\0\x01\0") && !is_utf16(b"v 0 0 0") && !is_utf16(b""));
        assert_eq!(lossy_text(b"\xef\xbb\xbfv \xe4").unwrap(), "v \u{fffd}");
    }

    #[test]
    fn only_regular_files_of_the_right_size_are_read() {
        let dir = tempfile::tempdir().unwrap();
        let said = read(dir.path(), 10).unwrap_err().to_string();
        assert!(said.contains("a folder, not a regular file"), "{said}");
        let path = dir.path().join("a");
        std::fs::write(&path, [7; 11]).unwrap();
        let said = read(&path, 10).unwrap_err().to_string();
        assert!(said.contains("11 bytes is outside [0, 10]"), "{said}");
        assert_eq!(read(&path, 11).unwrap(), [7; 11]);
    }

    #[cfg(unix)]
    #[test]
    fn devices_pipes_and_links_to_them_are_refused_at_once() {
        let dir = tempfile::tempdir().unwrap();
        let pipe = dir.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        let endless = dir.path().join("endless");
        std::os::unix::fs::symlink("/dev/zero", &endless).unwrap();
        for (path, kind) in [(pipe, "a pipe"), (endless, "a device")] {
            let said = read(&path, u64::MAX).unwrap_err().to_string();
            assert!(said.contains(kind) && said.contains("not a regular file"), "{said}");
        }
    }
}
