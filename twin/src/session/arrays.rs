//! NumPy arrays of doubles and of unsigned integers.

use super::error::SessionError;
use super::npy_header::{npy_values, read_npy_header, room};
use npyz::Order;
use std::fs::File;
use std::io::{BufReader, Read as _, Seek as _};
use std::path::Path;

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
    sides
        .fold(width as u64, u64::saturating_mul)
        .saturating_add(HEADER_BYTES)
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
/// [`SessionError`] if the file is not a regular one, cannot be read, is larger than 1 GB, or is not exactly such an
/// array.
pub fn read_npy(path: &Path) -> Result<NpyArray, SessionError> {
    read_doubles(path, None)
}

/// Reads an array of doubles as [`read_npy`] does. One of another shape than `expected` is not read at all.
pub(super) fn read_doubles(path: &Path, expected: Option<Expected<'_>>) -> Result<NpyArray, SessionError> {
    let mut open = Open::new(path, &[("'<f8'", size_of::<f64>())], expected)?;
    let values = open.values::<8, f64>(f64::from_le_bytes)?;
    Ok(NpyArray {
        shape: open.shape,
        values,
    })
}

/// Reads the array at `path`: little-endian unsigned integers of 16 or 32 bits in C order, as
/// [`crate::output::NpyFile`] writes them. One of another shape than `expected` is not read at all.
///
/// # Errors
/// As for [`read_npy`].
pub(super) fn read_codes(path: &Path, expected: Option<Expected<'_>>) -> Result<NpyArray<u32>, SessionError> {
    let kinds = [("'<u2'", size_of::<u16>()), ("'<u4'", size_of::<u32>())];
    let mut open = Open::new(path, &kinds, expected)?;
    let values = if open.width == size_of::<u16>() {
        open.values::<2, u32>(|bytes| u16::from_le_bytes(bytes).into())?
    } else {
        open.values::<4, u32>(u32::from_le_bytes)?
    };
    Ok(NpyArray {
        shape: open.shape,
        values,
    })
}

/// The shape that an array has to have.
#[derive(Debug, Clone, Copy)]
pub(super) struct Expected<'a> {
    pub(super) shape: &'a [usize],
    /// What its dimensions are.
    pub(super) dimensions: &'static str,
}

fn not_npy(path: &Path, reason: String) -> SessionError {
    SessionError::NotNpy {
        path: path.to_owned(),
        reason,
    }
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
    fn new(path: &'a Path, kinds: &[(&str, usize)], expected: Option<Expected<'_>>) -> Result<Self, SessionError> {
        let (file, length) = spts_input::open(path, MAX_BYTES).map_err(|error| SessionError::Io {
            path: path.to_owned(),
            source: error.into(),
        })?;
        let mut reader = BufReader::new(file);
        let wrong = |error: std::io::Error| not_npy(path, error.to_string());
        let (header, shape) = read_npy_header(&mut reader).map_err(wrong)?;
        let found = header.dtype().descr();
        let width = kinds.iter().find(|(kind, _)| *kind == found).map(|(_, width)| *width);
        let Some(width) = width.filter(|_| header.order() == Order::C) else {
            let wanted: Vec<&str> = kinds.iter().map(|(kind, _)| *kind).collect();
            return Err(not_npy(
                path,
                format!(
                    "values of type {found} in {:?} order; expected {} in C order",
                    header.order(),
                    wanted.join(" or ")
                ),
            ));
        };
        if let Some(expected) = expected.filter(|expected| expected.shape != shape) {
            return Err(SessionError::Shape {
                path: path.to_owned(),
                found: shape,
                expected: expected.shape.to_vec(),
                dimensions: expected.dimensions,
            });
        }
        let count = npy_values(&shape).map_err(wrong)?;
        let there = length - reader.stream_position().map_err(wrong)?.min(length);
        let needed = (count as u64).checked_mul(width as u64);
        if needed != Some(there) {
            let needed = needed.map_or_else(|| "too many".to_owned(), |bytes| bytes.to_string());
            return Err(not_npy(
                path,
                format!("shape {shape:?} needs {needed} bytes of values; there are {there}"),
            ));
        }
        Ok(Self {
            path,
            reader,
            shape,
            width,
            count,
        })
    }

    /// The values, of `N` bytes each.
    fn values<const N: usize, T>(&mut self, value: impl Fn([u8; N]) -> T) -> Result<Vec<T>, SessionError> {
        let failed = |source| SessionError::Io {
            path: self.path.to_owned(),
            source,
        };
        let mut values = room(self.count).map_err(failed)?;
        let mut piece = vec![0; N * PIECE.min(self.count)];
        while values.len() < self.count {
            let bytes = &mut piece[..N * PIECE.min(self.count - values.len())];
            self.reader.read_exact(bytes).map_err(failed)?;
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
        assert!(
            array
                .values
                .iter()
                .zip(&values)
                .all(|(a, b)| a.to_bits() == b.to_bits())
        );
        let whole = std::fs::read(&path).unwrap();
        for length in 0..whole.len() {
            std::fs::write(&path, &whole[..length]).unwrap();
            let said = read_npy(&path).unwrap_err().to_string();
            assert!(said.contains("a.npy"), "{length}: {said}");
        }
        std::fs::write(&path, [whole.clone(), vec![0]].concat()).unwrap();
        assert!(matches!(read_npy(&path), Err(SessionError::NotNpy { .. })));
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
        assert!(matches!(read_npy(&path), Err(SessionError::NotNpy { .. })));
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
            assert!(
                matches!(read_npy(&path), Err(SessionError::NotNpy { .. })),
                "{ours} as {other}"
            );
        }
    }
}
