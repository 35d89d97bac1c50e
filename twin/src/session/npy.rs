//! NumPy arrays of doubles and of unsigned integers, read from untrusted files.

use spts_input::Refusal;
use std::fmt::Display;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek as _};
use std::path::Path;

/// First bytes of every array.
const MAGIC: &[u8; 6] = b"\x93NUMPY";
/// Longest header that is read, bytes: type, order and a few sides, padded.
const MAX_HEADER: usize = 1 << 10;

/// What an array says of itself.
#[derive(Debug, PartialEq)]
struct Header {
    /// Type of the values, in NumPy's words.
    kind: String,
    c_order: bool,
    shape: Vec<usize>,
}

impl Header {
    /// Reads the header at the start of `reader`, which is left at the first value.
    ///
    /// # Errors
    /// [`io::Error`]: `InvalidData` with the cause for a header that is not valid, or the error of the reader.
    fn read(reader: &mut impl Read) -> io::Result<Self> {
        let invalid = |reason: String| io::Error::new(io::ErrorKind::InvalidData, reason);
        let mut start = [0; 10];
        reader.read_exact(&mut start).map_err(|error| match error.kind() {
            io::ErrorKind::UnexpectedEof => invalid("it ends before the header does".to_owned()),
            _ => error,
        })?;
        if start[..6] != *MAGIC {
            return Err(invalid("it does not begin with \\x93NUMPY".to_owned()));
        }
        let length = match start[6] {
            1 => usize::from(u16::from_le_bytes([start[8], start[9]])),
            2 | 3 => {
                let mut more = [0; 2];
                reader.read_exact(&mut more)?;
                u32::from_le_bytes([start[8], start[9], more[0], more[1]]) as usize
            }
            other => return Err(invalid(format!("version = {other} is outside [1, 3]"))),
        };
        if length > MAX_HEADER {
            return Err(invalid(format!("header length = {length} bytes is outside [0, {MAX_HEADER}]")));
        }
        let mut text = vec![0; length];
        reader.read_exact(&mut text)?;
        let form = "its header is not {'descr': TYPE, 'fortran_order': ORDER, 'shape': (SIDES)}";
        Self::parse(&String::from_utf8_lossy(&text)).ok_or_else(|| invalid(form.to_owned()))
    }

    /// The header as every writer of arrays forms it: a dictionary in order of its keys. The type may be any text.
    fn parse(text: &str) -> Option<Self> {
        let text: String = text.split_whitespace().collect();
        let (kind, rest) = text.strip_prefix("{'descr':")?.split_once(",'fortran_order':")?;
        let (order, rest) = rest.split_once(",'shape':(")?;
        let sides = rest.strip_suffix('}')?.trim_end_matches(',').strip_suffix(')')?;
        let sides = sides.split(',').filter(|side| !side.is_empty()).map(str::parse);
        Some(Self { kind: kind.to_owned(), c_order: order == "False", shape: sides.collect::<Result<_, _>>().ok()? })
    }
}

/// Number of values of an array with these sides.
fn count_of(sides: &[usize]) -> io::Result<usize> {
    let values = sides.iter().try_fold(1_usize, |n, &side| n.checked_mul(side));
    values.ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, "the shape is too large"))
}

/// An empty vector with capacity for `values` values.
///
/// # Errors
/// [`io::ErrorKind::OutOfMemory`] if the memory cannot be reserved.
pub(super) fn room<T>(values: usize) -> io::Result<Vec<T>> {
    let mut room = Vec::new();
    room.try_reserve_exact(values).map_err(|_| {
        let reason = format!("not enough memory for {values} values of {} bytes", size_of::<T>());
        io::Error::new(io::ErrorKind::OutOfMemory, reason)
    })?;
    Ok(room)
}

/// Largest array that is read, bytes: a session of 400 presses of the published skin in volts is 320 MB.
pub(super) const MAX_BYTES: u64 = 1 << 30;
/// Largest number of samples of a recording that is read, as codes of 16 bits.
pub const MOST_SAMPLES: u64 = MAX_BYTES / 2;
/// Values that are read at a time.
const PIECE: usize = 1 << 13;
/// No header is longer, bytes: type, order and three sides.
const HEADER_BYTES: u64 = 256;

/// Bytes of the file of an array of this shape with values of `width` bytes, or a little more.
pub(super) fn npy_bytes(shape: &[usize], width: usize) -> u64 {
    let sides = shape.iter().map(|side| *side as u64);
    sides.fold(width as u64, u64::saturating_mul).saturating_add(HEADER_BYTES)
}

/// An array in C order, as NumPy stores it.
#[derive(Debug, Clone, PartialEq)]
pub struct NpyArray<T = f64> {
    /// Size along each dimension.
    pub shape: Vec<usize>,
    /// Values, last index fastest.
    pub values: Vec<T>,
}

/// Reads the array at `path`: little-endian doubles in C order, as [`crate::output::write_npy`] writes them.
///
/// # Errors
/// [`Refusal`] if the file is not a regular one, cannot be read, is larger than 1 GB, or is not exactly such an
/// array.
pub fn read_npy(path: &Path) -> Result<NpyArray, Refusal> {
    read_doubles(path, None)
}

/// Reads an array of doubles as [`read_npy`] does. One of another shape than `expected` is not read at all.
pub(super) fn read_doubles(path: &Path, expected: Option<Expected<'_>>) -> Result<NpyArray, Refusal> {
    let mut open = Open::new(path, &[("'<f8'", size_of::<f64>())], expected)?;
    let values = open.values::<8, f64>(f64::from_le_bytes)?;
    Ok(NpyArray { shape: open.shape, values })
}

/// Reads the array at `path`: little-endian unsigned integers of 16 or 32 bits in C order, as
/// [`crate::output::NpyFile`] writes them. One of another shape than `expected` is not read at all.
///
/// # Errors
/// As for [`read_npy`].
pub(super) fn read_codes(path: &Path, expected: Option<Expected<'_>>) -> Result<NpyArray<u32>, Refusal> {
    let kinds = [("'<u2'", size_of::<u16>()), ("'<u4'", size_of::<u32>())];
    let mut open = Open::new(path, &kinds, expected)?;
    let values = if open.width == size_of::<u16>() {
        open.values::<2, u32>(|bytes| u16::from_le_bytes(bytes).into())?
    } else {
        open.values::<4, u32>(u32::from_le_bytes)?
    };
    Ok(NpyArray { shape: open.shape, values })
}

/// The shape that an array has to have.
#[derive(Debug, Clone, Copy)]
pub(super) struct Expected<'a> {
    pub(super) shape: &'a [usize],
    /// What its dimensions are.
    pub(super) dimensions: &'static str,
}

fn not_npy(path: &Path, reason: impl Display) -> Refusal {
    Refusal::new(format!("{}: not a readable NumPy array ({reason})", path.display()))
}

/// A file of which the header has been read and checked.
struct Open<'a> {
    path: &'a Path,
    reader: BufReader<File>,
    shape: Vec<usize>,
    /// Bytes a value.
    width: usize,
    /// Number of values.
    count: usize,
}

impl<'a> Open<'a> {
    /// The array at `path`, of one of the `kinds`: type in NumPy's words, and bytes a value.
    fn new(path: &'a Path, kinds: &[(&str, usize)], expected: Option<Expected<'_>>) -> Result<Self, Refusal> {
        let (file, length) = spts_input::open(path, MAX_BYTES).map_err(Refusal::in_file(path))?;
        let mut reader = BufReader::new(file);
        let wrong = |error: io::Error| not_npy(path, error);
        let Header { kind, c_order, shape } = Header::read(&mut reader).map_err(wrong)?;
        let width = kinds.iter().find(|(known, _)| *known == kind).map(|(_, width)| *width);
        let Some(width) = width.filter(|_| c_order) else {
            let wanted: Vec<&str> = kinds.iter().map(|(kind, _)| *kind).collect();
            let (wanted, order) = (wanted.join(" or "), if c_order { "C" } else { "Fortran" });
            let problem = format!("values of type {kind} in {order} order; expected {wanted} in C order");
            return Err(not_npy(path, problem));
        };
        if let Some(expected) = expected.filter(|expected| expected.shape != shape) {
            let Expected { shape: needed, dimensions } = expected;
            let path = path.display();
            return Err(Refusal::new(format!("{path}: shape {shape:?}; expected {needed:?} ({dimensions})")));
        }
        let count = count_of(&shape).map_err(wrong)?;
        let there = length - reader.stream_position().map_err(wrong)?.min(length);
        let needed = (count as u64).checked_mul(width as u64);
        if needed != Some(there) {
            let needed = needed.map_or_else(|| "too many".to_owned(), |bytes| bytes.to_string());
            return Err(not_npy(path, format!("shape {shape:?} needs {needed} bytes of values; there are {there}")));
        }
        Ok(Self { path, reader, shape, width, count })
    }

    /// The values, of `N` bytes each.
    fn values<const N: usize, T>(&mut self, value: impl Fn([u8; N]) -> T) -> Result<Vec<T>, Refusal> {
        let failed = Refusal::in_file(self.path);
        let mut values = room(self.count).map_err(&failed)?;
        let mut piece = vec![0; N * PIECE.min(self.count)];
        while values.len() < self.count {
            let bytes = &mut piece[..N * PIECE.min(self.count - values.len())];
            self.reader.read_exact(bytes).map_err(&failed)?;
            let (chunks, _) = bytes.as_chunks::<N>();
            values.extend(chunks.iter().map(|chunk| value(*chunk)));
        }
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::{NpyFile, NpyValue, write_npy};

    const NOT_NPY: &str = "not a readable NumPy array";

    /// What is said of a header of version 1 with this text.
    fn said(text: &str) -> String {
        let length = u16::try_from(text.len()).unwrap().to_le_bytes();
        said_of(&[&b"\x93NUMPY\x01\0"[..], &length, text.as_bytes()].concat())
    }

    fn said_of(bytes: &[u8]) -> String {
        Header::read(&mut &*bytes).unwrap_err().to_string()
    }

    #[test]
    fn a_header_is_measured_before_room_is_made_for_it() {
        for (bytes, fact) in [
            (&b"\x93NUMPY\x02\0\xff\xff\xff\xff"[..], "header length = 4294967295 bytes"),
            (b"\x93NUMPY\x01\0\xff\xff", "outside [0, 1024]"),
            (b"\x93NUMPY\x07\0\xff\xff", "version = 7"),
            (b"PK", "ends before"),
        ] {
            assert!(said_of(bytes).contains(fact), "{fact}");
        }
        for text in
            ["", "{'descr':", "{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999, 2), }\n"]
        {
            assert!(said(text).contains("its header is not"), "{text}");
        }
        assert!(count_of(&[usize::MAX, 2]).is_err());
    }

    /// NumPy and others differ in the spaces and commas.
    #[test]
    fn headers_of_other_writers_are_read() {
        for (sides, shape) in [("2, 3", &[2, 3][..]), ("2, 3, ", &[2, 3]), ("3,", &[3]), ("", &[])] {
            let text = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({sides}), }}  \n");
            let header = Header::parse(&text).unwrap();
            assert_eq!((header.kind.as_str(), header.c_order, &*header.shape), ("'<f8'", true, shape));
        }
    }

    fn write<T: NpyValue>(path: &Path, codes: &[T]) {
        let mut file = NpyFile::create(path, &[2, 2]).unwrap();
        file.push(codes.iter().copied()).unwrap();
        file.finish().unwrap();
    }

    #[test]
    fn an_array_comes_back_and_a_cut_one_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npy");
        let values = [0.1, -0.0, 5e-324, 1.0 / 3.0, 7.0, -1e300];
        write_npy(&path, &[3, 1, 2], &values).unwrap();
        let array = read_npy(&path).unwrap();
        assert_eq!(array.shape, [3, 1, 2]);
        assert!(array.values.iter().zip(&values).all(|(a, b)| a.to_bits() == b.to_bits()));
        let whole = std::fs::read(&path).unwrap();
        for length in 0..whole.len() {
            std::fs::write(&path, &whole[..length]).unwrap();
            let said = read_npy(&path).unwrap_err().to_string();
            assert!(said.contains("a.npy"), "{length}: {said}");
        }
        std::fs::write(&path, [whole.clone(), vec![0]].concat()).unwrap();
        assert!(read_npy(&path).unwrap_err().to_string().contains(NOT_NPY));
    }

    #[test]
    fn codes_come_back_in_both_widths() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("codes.npy");
        write(&path, &[0_u16, 1023, 65_535, 7]);
        let array = read_codes(&path, None).unwrap();
        assert_eq!((array.shape, array.values), (vec![2, 2], vec![0, 1023, 65_535, 7]));
        let wide = [0, 1 << 20, u32::MAX, 7];
        write(&path, &wide);
        let array = read_codes(&path, None).unwrap();
        assert_eq!((array.shape, array.values), (vec![2, 2], wide.to_vec()));
        assert!(read_npy(&path).unwrap_err().to_string().contains(NOT_NPY));
    }

    /// The header is text that follows 10 bytes; other types and orders of the same length are not taken for ours.
    #[test]
    fn other_kinds_of_arrays_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npy");
        write_npy(&path, &[2], &[1.0, 2.0]).unwrap();
        let whole = std::fs::read(&path).unwrap();
        let text = String::from_utf8_lossy(&whole[10..]).into_owned();
        for (ours, other) in [("<f8", ">f8"), ("<f8", "<i8"), ("False", "True "), ("(2", "(3")] {
            let at = 10 + text.find(ours).unwrap();
            let mut changed = whole.clone();
            changed[at..at + ours.len()].copy_from_slice(other.as_bytes());
            std::fs::write(&path, &changed).unwrap();
            let error = read_npy(&path).unwrap_err().to_string();
            assert!(error.contains(NOT_NPY), "{ours} as {other}: {error}");
        }
    }
}
