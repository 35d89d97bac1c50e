//! NumPy archives.

use npyz::{DType, NpyFile, Order, WriterBuilder as _};
use spts::session::{npy_values, read_npy_header};
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Seek, Write};
use std::path::Path;
use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// Shape and values, in C order.
pub enum NpzArray<'a> {
    /// Doubles.
    Doubles(&'a [usize], &'a [f64]),
    /// Signed bytes.
    Signs(&'a [usize], &'a [i8]),
}

/// Writes an archive of named arrays, without compression.
///
/// # Errors
/// [`io::Error`] when the file cannot be written or the values do not fill their shape.
pub fn write(path: &Path, arrays: &[(&str, NpzArray<'_>)]) -> io::Result<()> {
    let mut zip = ZipWriter::new(BufWriter::new(File::create(path)?));
    let stored = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .large_file(true);
    for (name, array) in arrays {
        zip.start_file(format!("{name}.npy"), stored)?;
        match array {
            NpzArray::Doubles(shape, values) => write_npy(&mut zip, "<f8", shape, values)?,
            NpzArray::Signs(shape, values) => write_npy(&mut zip, "|i1", shape, values)?,
        }
    }
    zip.finish()?.flush()
}

/// Largest archive that is read, bytes: the images of a million windows of a hundred taxels would be 800 MB.
const MAX_BYTES: u64 = 1 << 30;

/// Array `name` of the archive as doubles; `None` when the archive has none of that name. An array of more than `most`
/// values is refused before any of them is unfolded.
///
/// # Errors
/// [`io::Error`] when the file is not a regular one, cannot be read, or the array is of another kind.
pub fn read(path: &Path, name: &str, most: usize) -> io::Result<Option<Vec<f64>>> {
    let (file, _) = spts_input::open(path, MAX_BYTES)?;
    read_from(BufReader::new(file), name, most)
}

/// As [`read`], from an archive that is at hand.
///
/// # Errors
/// As [`read`].
pub fn read_from(archive: impl Read + Seek, name: &str, most: usize) -> io::Result<Option<Vec<f64>>> {
    let mut zip = ZipArchive::new(archive)?;
    let mut file = match zip.by_name(&format!("{name}.npy")) {
        Err(ZipError::FileNotFound) => return Ok(None),
        file => file?,
    };
    let (header, sides) = read_npy_header(&mut file)?;
    let values = npy_values(&sides)?;
    if values > most {
        return Err(invalid(format!(
            "`{name}` has shape {sides:?} = {values} values, outside [0, {most}]"
        )));
    }
    let npy = NpyFile::with_header(header, file);
    if npy.order() != Order::C {
        return Err(invalid(format!("`{name}` is in Fortran order; needed is C order")));
    }
    doubles(npy, name).map(Some)
}

fn write_npy<T: npyz::Serialize + Copy>(
    out: &mut impl Write,
    kind: &str,
    shape: &[usize],
    values: &[T],
) -> io::Result<()> {
    let kind = kind
        .parse()
        .map_err(|e| io::Error::new(io::ErrorKind::InvalidInput, e))?;
    let shape: Vec<u64> = shape.iter().map(|n| *n as u64).collect();
    let mut writer = npyz::WriteOptions::new()
        .dtype(DType::Plain(kind))
        .shape(&shape)
        .writer(out)
        .begin_nd()?;
    writer.extend(values.iter().copied())?;
    writer.finish()
}

fn doubles<R: Read>(npy: NpyFile<R>, name: &str) -> io::Result<Vec<f64>> {
    let kind = npy.dtype().descr();
    let kind = kind.trim_matches(['\'', '"', '<', '|', '=', ' ']).to_owned();
    match kind.as_str() {
        "f8" => npy.into_vec::<f64>(),
        "f4" => widen::<f32, R>(npy),
        "i4" => widen::<i32, R>(npy),
        "i2" => widen::<i16, R>(npy),
        "i1" => widen::<i8, R>(npy),
        "u1" => widen::<u8, R>(npy),
        "i8" => Ok(npy.into_vec::<i64>()?.into_iter().map(|v| v as f64).collect()),
        _ => Err(invalid(format!(
            "`{name}` has type {kind}; needed is f8, f4, i8, i4, i2, i1 or u1"
        ))),
    }
}

fn widen<T: npyz::Deserialize + Into<f64>, R: Read>(npy: NpyFile<R>) -> io::Result<Vec<f64>> {
    Ok(npy.into_vec::<T>()?.into_iter().map(Into::into).collect())
}

fn invalid(problem: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, problem)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npz");
        write(
            &path,
            &[
                ("y", NpzArray::Doubles(&[2, 2], &[1.0, -2.5, 3.0, 1e300])),
                ("phi", NpzArray::Signs(&[3], &[1, -1, 1])),
            ],
        )
        .unwrap();
        assert_eq!(read(&path, "y", 4).unwrap().unwrap(), [1.0, -2.5, 3.0, 1e300]);
        assert_eq!(read(&path, "phi", 3).unwrap().unwrap(), [1.0, -1.0, 1.0]);
        assert_eq!(read(&path, "labels", 3).unwrap(), None);
        std::fs::write(&path, b"no archive").unwrap();
        assert!(read(&path, "y", 4).is_err());
    }
}
