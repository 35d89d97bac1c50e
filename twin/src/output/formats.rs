//! NumPy arrays, CSV tables and JSON, with bytes that depend on the values alone.

use super::atomic::write_with;
use super::error::OutputError;
use npyz::WriterBuilder as _;
use serde::Serialize;
use std::io::{self, Write as _};
use std::path::Path;

/// Writes `values` as a NumPy array of little-endian doubles in C order.
///
/// # Errors
/// [`OutputError`] when the values do not fill the shape or the file cannot be written.
pub fn write_npy(path: &Path, shape: &[usize], values: &[f64]) -> Result<(), OutputError> {
    if shape.iter().product::<usize>() != values.len() {
        return Err(OutputError::Shape {
            path: path.to_owned(),
            shape: shape.to_vec(),
            values: values.len(),
        });
    }
    write_npy_with(path, shape, |push| push(values))
}

/// [`write_npy`] of as many values as the shape takes, which `fill` hands over piece by piece while they are made. The
/// file is there before `fill` is called.
///
/// # Errors
/// [`OutputError`] when the file cannot be written or `fill` says so.
pub fn write_npy_with(
    path: &Path,
    shape: &[usize],
    fill: impl FnOnce(&mut dyn FnMut(&[f64]) -> io::Result<()>) -> io::Result<()>,
) -> Result<(), OutputError> {
    let sides: Vec<u64> = shape.iter().map(|side| *side as u64).collect();
    write_with(path, |out| {
        let kind = "<f8"
            .parse()
            .map_err(|e| io::Error::new(io::ErrorKind::InvalidInput, e))?;
        let mut writer = npyz::WriteOptions::new()
            .dtype(npyz::DType::Plain(kind))
            .shape(&sides)
            .writer(out)
            .begin_nd()?;
        fill(&mut |values| writer.extend(values.iter().copied()))?;
        writer.finish()
    })
}

/// Writes `codes` as a NumPy array of little-endian unsigned integers in C order: of 16 bits where all of them fit,
/// else of 32.
///
/// # Errors
/// [`OutputError`] when the codes do not fill the shape or the file cannot be written.
pub fn write_npy_codes(path: &Path, shape: &[usize], codes: &[u32]) -> Result<(), OutputError> {
    if shape.iter().product::<usize>() != codes.len() {
        return Err(OutputError::Shape {
            path: path.to_owned(),
            shape: shape.to_vec(),
            values: codes.len(),
        });
    }
    let narrow: Option<Vec<u16>> = codes.iter().map(|code| u16::try_from(*code).ok()).collect();
    match narrow {
        Some(narrow) => write_integers(path, shape, &narrow),
        None => write_integers(path, shape, codes),
    }
}

fn write_integers<T: npyz::AutoSerialize + Copy>(
    path: &Path,
    shape: &[usize],
    values: &[T],
) -> Result<(), OutputError> {
    let sides: Vec<u64> = shape.iter().map(|side| *side as u64).collect();
    write_with(path, |out| {
        let options = npyz::WriteOptions::new().default_dtype().shape(&sides);
        let mut writer = options.writer(out).begin_nd()?;
        writer.extend(values.iter().copied())?;
        writer.finish()
    })
}

/// Writes a table. A row may be a tuple with arrays in it: its fields follow each other. Numbers have the fewest digits
/// that read back as the same number.
///
/// # Errors
/// [`OutputError`] when a row has another number of fields than the header or the file cannot be written.
pub fn write_csv<R: Serialize>(
    path: &Path,
    header: &[&str],
    rows: impl IntoIterator<Item = R>,
) -> Result<(), OutputError> {
    write_with(path, |out| {
        let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(out);
        writer.write_record(header)?;
        for row in rows {
            writer.serialize(row)?;
        }
        writer.flush()
    })
}

/// Writes a table whose header is the field names of its rows.
///
/// # Errors
/// [`OutputError`] when the file cannot be written.
pub fn write_table<R: Serialize>(path: &Path, rows: &[R]) -> Result<(), OutputError> {
    write_with(path, |out| {
        let mut writer = csv::Writer::from_writer(out);
        for row in rows {
            writer.serialize(row)?;
        }
        writer.flush()
    })
}

/// Writes `value` as indented JSON with a line end.
///
/// # Errors
/// [`OutputError`] when the file cannot be written.
pub fn write_json<T: Serialize>(path: &Path, value: &T) -> Result<(), OutputError> {
    write_with(path, |out| {
        serde_json::to_writer_pretty(&mut *out, value)?;
        out.write_all(b"\n")
    })
}
