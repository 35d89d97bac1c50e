//! NumPy arrays of doubles and of unsigned integers.

use super::error::SessionError;
use npyz::{NpyFile, NpyHeader, Order};
use std::path::{Path, PathBuf};

/// Largest array that is read, bytes: a session of 400 presses of the published skin in volts is 320 MB.
pub(super) const MAX_BYTES: u64 = 1 << 30;
/// Most samples of a recording that are read, as codes of 16 bits.
pub const MOST_SAMPLES: u64 = MAX_BYTES / 2;
/// No header is longer, bytes: type, order and three sides.
const HEADER_BYTES: u64 = 256;

/// Bytes of the file of an array of this shape with values of `width` bytes, or a little more.
pub(super) fn npy_bytes(shape: &[usize], width: usize) -> u64 {
    let sides = shape.iter().map(|side| *side as u64);
    sides
        .fold(width as u64, u64::saturating_mul)
        .saturating_add(HEADER_BYTES)
}

/// An array in C order.
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
/// [`SessionError`] when the file cannot be read, is larger than 1 GB, or is not such an array from its first byte to
/// its last.
pub fn read_npy(path: &Path) -> Result<NpyArray, SessionError> {
    let bytes = read(path)?;
    let (header, shape, data) = open(path, &bytes, &[("'<f8'", size_of::<f64>())])?;
    let values = NpyFile::with_header(header, data).into_vec();
    let values = values.map_err(|e| not_npy(path, e.to_string()))?;
    Ok(NpyArray { shape, values })
}

/// Reads the array at `path`: little-endian unsigned integers of 16 or 32 bits in C order, as
/// [`crate::output::NpyFile`] writes them.
///
/// # Errors
/// As for [`read_npy`].
pub(super) fn read_codes(path: &Path) -> Result<NpyArray<u32>, SessionError> {
    let bytes = read(path)?;
    let kinds = [("'<u2'", size_of::<u16>()), ("'<u4'", size_of::<u32>())];
    let (header, shape, data) = open(path, &bytes, &kinds)?;
    let narrow = header.dtype().descr() == "'<u2'";
    let values = if narrow {
        let values: std::io::Result<Vec<u16>> = NpyFile::with_header(header, data).into_vec();
        values.map(|values| values.into_iter().map(u32::from).collect())
    } else {
        NpyFile::with_header(header, data).into_vec()
    };
    let values = values.map_err(|e| not_npy(path, e.to_string()))?;
    Ok(NpyArray { shape, values })
}

fn not_npy(path: &Path, reason: String) -> SessionError {
    SessionError::NotNpy {
        path: path.to_owned(),
        reason,
    }
}

fn read(path: &Path) -> Result<Vec<u8>, SessionError> {
    let io = |source| SessionError::Io {
        path: PathBuf::from(path),
        source,
    };
    let length = std::fs::metadata(path).map_err(io)?.len();
    if length > MAX_BYTES {
        return Err(not_npy(path, format!("{length} bytes; at most {MAX_BYTES} are read")));
    }
    std::fs::read(path).map_err(io)
}

/// Header, shape and values of an array of one of the `kinds`: type in NumPy's words, and bytes a value.
fn open<'a>(
    path: &Path,
    bytes: &'a [u8],
    kinds: &[(&str, usize)],
) -> Result<(NpyHeader, Vec<usize>, &'a [u8]), SessionError> {
    let mut data = bytes;
    let header = NpyHeader::from_reader(&mut data).map_err(|e| not_npy(path, e.to_string()))?;
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
    let sides: Option<Vec<usize>> = header.shape().iter().map(|&s| usize::try_from(s).ok()).collect();
    let needed = sides
        .as_ref()
        .and_then(|s| s.iter().try_fold(width, |n, &side| n.checked_mul(side)));
    let (Some(shape), Some(needed)) = (sides, needed) else {
        return Err(not_npy(path, format!("shape {:?} is too large", header.shape())));
    };
    if needed != data.len() {
        return Err(not_npy(
            path,
            format!(
                "shape {shape:?} needs {needed} bytes of values; there are {}",
                data.len()
            ),
        ));
    }
    Ok((header, shape, data))
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
        let array = read_codes(&path).unwrap();
        assert_eq!((array.shape, array.values), (vec![2, 2], vec![0, 1023, 65_535, 7]));
        let wide = [0, 1 << 20, u32::MAX, 7];
        write(&path, &wide);
        let array = read_codes(&path).unwrap();
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
