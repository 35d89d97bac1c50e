//! A NumPy array of doubles.

use super::error::DataError;
use npyz::{NpyFile, Order};
use std::path::Path;

/// Largest array that is read: a session of 400 presses of the published skin is 320 MB.
const MAX_BYTES: u64 = 1 << 30;

/// An array in C order.
#[derive(Debug, Clone, PartialEq)]
pub struct NpyArray {
    /// Size along each dimension.
    pub shape: Vec<usize>,
    /// Values, last index fastest.
    pub values: Vec<f64>,
}

/// Reads the array at `path`: little-endian doubles in C order, as [`crate::output::write_npy`] writes them.
///
/// # Errors
/// [`DataError`] when the file cannot be read, is larger than 1 GB, or is not such an array from its first byte to its last.
pub fn read_npy(path: &Path) -> Result<NpyArray, DataError> {
    let io = |source| DataError::Io {
        path: path.to_owned(),
        source,
    };
    let not_npy = |reason: String| DataError::NotNpy {
        path: path.to_owned(),
        reason,
    };
    let length = std::fs::metadata(path).map_err(io)?.len();
    if length > MAX_BYTES {
        return Err(not_npy(format!("{length} bytes; at most {MAX_BYTES} are read")));
    }
    let bytes = std::fs::read(path).map_err(io)?;
    let mut data = bytes.as_slice();
    let header = npyz::NpyHeader::from_reader(&mut data).map_err(|e| not_npy(e.to_string()))?;
    let kind = header.dtype().descr();
    if kind != "'<f8'" || header.order() != Order::C {
        return Err(not_npy(format!(
            "values of type {kind} in {:?} order; expected '<f8' in C order",
            header.order()
        )));
    }
    let sides: Option<Vec<usize>> = header.shape().iter().map(|&s| usize::try_from(s).ok()).collect();
    let needed = sides
        .as_ref()
        .and_then(|s| s.iter().try_fold(size_of::<f64>(), |n, &side| n.checked_mul(side)));
    let (Some(shape), Some(needed)) = (sides, needed) else {
        return Err(not_npy(format!("shape {:?} is too large", header.shape())));
    };
    if needed != data.len() {
        return Err(not_npy(format!(
            "shape {shape:?} needs {needed} bytes of values; there are {}",
            data.len()
        )));
    }
    let values = NpyFile::with_header(header, data).into_vec().map_err(io)?;
    Ok(NpyArray { shape, values })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::write_npy;

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
        assert!(matches!(read_npy(&path), Err(DataError::NotNpy { .. })));
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
                matches!(read_npy(&path), Err(DataError::NotNpy { .. })),
                "{ours} as {other}"
            );
        }
    }
}
