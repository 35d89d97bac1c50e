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
///
/// ```
/// use spts_eval::npz::{NpzArray, read, write};
///
/// # let path = std::env::temp_dir().join(format!("spts-doc-npz-{}.npz", std::process::id()));
/// write(&path, &[("y", NpzArray::Doubles(&[2], &[0.5, 1.5]))])?;
/// assert_eq!(read(&path, "y", &[2])?, Some(vec![0.5, 1.5]));
/// # std::fs::remove_file(&path)?;
/// # Ok::<(), std::io::Error>(())
/// ```
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

/// Refuses an archive with other arrays than `names`.
///
/// # Errors
/// [`io::Error`] with the name of the first such array, or when the file cannot be read.
pub fn check_names(path: &Path, names: &[&str]) -> io::Result<()> {
    let (file, _) = spts_input::open(path, MAX_BYTES)?;
    let zip = ZipArchive::new(BufReader::new(file))?;
    let array = |file: &str| file.strip_suffix(".npy").unwrap_or(file).to_owned();
    match zip.file_names().map(array).find(|name| !names.contains(&name.as_str())) {
        Some(name) => Err(invalid(format!("has an array {name:?}; valid: {}", names.join(", ")))),
        None => Ok(()),
    }
}

/// Array `name` of the archive as doubles in C order, whichever order it is stored in; `None` when the archive has none
/// of that name. An array of any other shape than `shape` is refused before any of its values is unfolded.
///
/// # Errors
/// [`io::Error`] when the file is not a regular one, cannot be read, or the array is of another shape or kind.
pub fn read(path: &Path, name: &str, shape: &[usize]) -> io::Result<Option<Vec<f64>>> {
    let (file, _) = spts_input::open(path, MAX_BYTES)?;
    read_from(BufReader::new(file), name, |found| {
        if found == shape {
            return Ok(());
        }
        Err(invalid(format!("`{name}` has shape {found:?}; needed is {shape:?}")))
    })
}

/// As [`read`], from an archive that is at hand, if `check` accepts the array's shape.
///
/// # Errors
/// As [`read`], and those of `check`.
pub fn read_from(
    archive: impl Read + Seek,
    name: &str,
    check: impl FnOnce(&[usize]) -> io::Result<()>,
) -> io::Result<Option<Vec<f64>>> {
    let mut zip = ZipArchive::new(archive)?;
    let mut file = match zip.by_name(&format!("{name}.npy")) {
        Err(ZipError::FileNotFound) => return Ok(None),
        file => file?,
    };
    let (header, sides) = read_npy_header(&mut file)?;
    npy_values(&sides)?;
    check(&sides)?;
    let npy = NpyFile::with_header(header, &mut file);
    let order = npy.order();
    let values = doubles(npy, name)?;
    // at the end the archive's checksum is compared, too
    if file.read(&mut [0])? > 0 {
        return Err(invalid(format!("`{name}` goes on behind its last value")));
    }
    Ok(Some(match order {
        Order::C => values,
        Order::Fortran => in_c_order(&values, &sides),
    }))
}

/// `values` of an array of `shape`, whose first index runs fastest, with the last one running fastest.
fn in_c_order(values: &[f64], shape: &[usize]) -> Vec<f64> {
    let place = |mut at: usize| {
        let mut place = 0;
        // index by index from the last on, each with the stride that it has where the first runs fastest
        let mut stride = values.len();
        for &side in shape.iter().rev() {
            stride /= side.max(1);
            place += at % side.max(1) * stride;
            at /= side.max(1);
        }
        place
    };
    (0..values.len())
        .filter_map(|at| values.get(place(at)).copied())
        .collect()
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
        assert_eq!(read(&path, "y", &[2, 2]).unwrap().unwrap(), [1.0, -2.5, 3.0, 1e300]);
        assert_eq!(read(&path, "phi", &[3]).unwrap().unwrap(), [1.0, -1.0, 1.0]);
        assert_eq!(read(&path, "labels", &[2]).unwrap(), None);
        for shape in [&[4][..], &[1, 4], &[2, 3], &[2, 2, 1]] {
            let said = read(&path, "y", shape).unwrap_err().to_string();
            assert!(said.contains("`y` has shape [2, 2]; needed is"), "{said}");
        }
        assert!(check_names(&path, &["y", "phi"]).is_ok());
        assert!(check_names(&path, &["y"]).unwrap_err().to_string().contains("\"phi\""));
        std::fs::write(&path, b"no archive").unwrap();
        assert!(read(&path, "y", &[2, 2]).is_err());
    }

    #[test]
    fn fortran_order_is_turned() {
        assert_eq!(
            in_c_order(&[1.0, 4.0, 2.0, 5.0, 3.0, 6.0], &[2, 3]),
            [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
        );
        assert_eq!(in_c_order(&[1.0, 2.0], &[2]), [1.0, 2.0]);
        let (shape, mut stored) = ([2, 3, 4], [0.0; 24]);
        for i in 0..24 {
            stored[i / 12 + 2 * (i / 4 % 3) + 6 * (i % 4)] = i as f64;
        }
        assert_eq!(in_c_order(&stored, &shape), (0..24).map(f64::from).collect::<Vec<_>>());
    }
}
