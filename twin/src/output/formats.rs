//! NumPy arrays, CSV tables and JSON. Their bytes depend only on the values.

use super::atomic::{AtomicFile, write_with};
use super::error::OutputError;
use npyz::WriterBuilder as _;
use serde::Serialize;
use std::io::{self, Write as _};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

/// A type that a NumPy array can hold.
///
/// ```
/// use spts::output::NpyValue;
///
/// assert_eq!(1.5_f64.bytes().as_ref(), 1.5_f64.to_le_bytes());
/// ```
pub trait NpyValue: Copy {
    /// Type as NumPy writes it, such as `f8`.
    const KIND: &'static str;
    /// Bytes of the value, little-endian.
    fn bytes(self) -> impl AsRef<[u8]>;
}

macro_rules! values {
    ($($of:ty: $kind:literal),*) => {
        $(impl NpyValue for $of {
            const KIND: &'static str = $kind;
            fn bytes(self) -> impl AsRef<[u8]> {
                self.to_le_bytes()
            }
        })*
    };
}

values!(f64: "<f8", u16: "<u2", u32: "<u4");

/// A NumPy array that is written piece by piece, in C order and little-endian.
///
/// ```
/// use spts::output::NpyFile;
/// use spts::session::read_npy;
///
/// # let path = std::env::temp_dir().join(format!("spts-doc-npy-{}.npy", std::process::id()));
/// let mut file = NpyFile::create(&path, &[2, 3])?;
/// file.push([1.0, 2.0, 3.0])?;
/// file.push([4.0, 5.0, 6.0])?;
/// file.finish()?;
/// assert_eq!(read_npy(&path)?.values, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
/// # std::fs::remove_file(&path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct NpyFile<T> {
    file: AtomicFile,
    path: PathBuf,
    shape: Vec<usize>,
    written: usize,
    header_bytes: u64,
    kind: PhantomData<T>,
}

impl<T: NpyValue> NpyFile<T> {
    /// Starts the array `path` with shape `shape`.
    ///
    /// # Errors
    /// [`OutputError`] if the file cannot be created.
    pub fn create(path: &Path, shape: &[usize]) -> Result<Self, OutputError> {
        let sides: Vec<u64> = shape.iter().map(|side| *side as u64).collect();
        let mut file = AtomicFile::create(path)?;
        let mut header = Vec::new();
        file.fill(|out| {
            let kind = T::KIND
                .parse()
                .map_err(|e| io::Error::new(io::ErrorKind::InvalidInput, e))?;
            let options = npyz::WriteOptions::new_header_only().dtype(npyz::DType::Plain(kind));
            options.shape(&sides).writer(&mut header).write_header_only()?;
            out.write_all(&header)
        })?;
        Ok(Self {
            file,
            path: path.to_owned(),
            shape: shape.to_vec(),
            written: 0,
            header_bytes: header.len() as u64,
            kind: PhantomData,
        })
    }

    /// Writes the next values.
    ///
    /// # Errors
    /// [`OutputError::Write`] if the disk is full or reports an error.
    pub fn push(&mut self, values: impl IntoIterator<Item = T>) -> Result<(), OutputError> {
        let written = &mut self.written;
        self.file.fill(|out| {
            values.into_iter().try_for_each(|value| {
                *written += 1;
                out.write_all(value.bytes().as_ref())
            })
        })
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// [`OutputError`] if the number of values differs from that of the shape, or the file cannot be written.
    pub fn finish(self) -> Result<(), OutputError> {
        if self.shape.iter().product::<usize>() != self.written {
            return Err(OutputError::Shape {
                path: self.path,
                shape: self.shape,
                values: self.written,
            });
        }
        self.file.finish()
    }

    /// Hands the bytes of the values that were written so far to `each`, some thousand values at a time.
    pub(crate) fn read_back(&mut self, each: impl FnMut(&[u8]) -> Result<(), OutputError>) -> Result<(), OutputError> {
        self.file.read_back(self.header_bytes, size_of::<T>() << 13, each)
    }
}

/// Writes `values` as a NumPy array of little-endian doubles in C order.
///
/// # Errors
/// [`OutputError`] if the number of values differs from that of the shape, or the file cannot be written.
pub fn write_npy(path: &Path, shape: &[usize], values: &[f64]) -> Result<(), OutputError> {
    let mut file = NpyFile::create(path, shape)?;
    file.push(values.iter().copied())?;
    file.finish()
}

/// A table that is written row by row.
///
/// ```
/// use spts::output::CsvFile;
///
/// # let path = std::env::temp_dir().join(format!("spts-doc-csv-{}.csv", std::process::id()));
/// let mut table = CsvFile::create(&path, &["name", "x", "y"])?;
/// table.push(("cup", [0.1, 2.0]))?;
/// table.finish()?;
/// assert_eq!(std::fs::read_to_string(&path)?, "name,x,y\ncup,0.1,2.0\n");
/// # std::fs::remove_file(&path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct CsvFile {
    writer: csv::Writer<AtomicFile>,
    path: PathBuf,
}

impl CsvFile {
    /// Starts the table `path` with the header `header`.
    ///
    /// # Errors
    /// [`OutputError`] if the file cannot be created.
    pub fn create(path: &Path, header: &[&str]) -> Result<Self, OutputError> {
        let mut options = csv::WriterBuilder::new();
        let mut writer = options.has_headers(false).from_writer(AtomicFile::create(path)?);
        let written = writer.write_record(header);
        written.map_err(|e| OutputError::write(path)(e.into()))?;
        Ok(Self {
            writer,
            path: path.to_owned(),
        })
    }

    /// Writes the next row. A row may be a tuple that contains arrays; their elements become fields in order. Numbers
    /// have the fewest digits that read back as the same number.
    ///
    /// # Errors
    /// [`OutputError::Write`] if the number of fields differs from that of the header, or the disk is full or reports
    /// an error.
    pub fn push(&mut self, row: impl Serialize) -> Result<(), OutputError> {
        let written = self.writer.serialize(row);
        written.map_err(|e| OutputError::write(&self.path)(e.into()))
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// [`OutputError`] if the file cannot be written.
    pub fn finish(self) -> Result<(), OutputError> {
        let failed = OutputError::write(&self.path);
        let file = self.writer.into_inner().map_err(|e| failed(e.into_error()))?;
        file.finish()
    }
}

/// Writes a table with rows as in [`CsvFile::push`].
///
/// # Errors
/// [`OutputError`] if the number of fields of a row differs from that of the header, or the file cannot be written.
pub fn write_csv<R: Serialize>(
    path: &Path,
    header: &[&str],
    rows: impl IntoIterator<Item = R>,
) -> Result<(), OutputError> {
    let mut file = CsvFile::create(path, header)?;
    rows.into_iter().try_for_each(|row| file.push(row))?;
    file.finish()
}

/// Writes a table whose header is the field names of its rows.
///
/// # Errors
/// [`OutputError`] if the file cannot be written.
pub fn write_table<R: Serialize>(path: &Path, rows: &[R]) -> Result<(), OutputError> {
    write_with(path, |out| {
        let mut writer = csv::Writer::from_writer(out);
        for row in rows {
            writer.serialize(row)?;
        }
        writer.flush()
    })
}

/// Writes `value` as indented JSON that ends with a newline.
///
/// # Errors
/// [`OutputError`] if the file cannot be written.
pub fn write_json<T: Serialize>(path: &Path, value: &T) -> Result<(), OutputError> {
    write_with(path, |out| {
        serde_json::to_writer_pretty(&mut *out, value)?;
        out.write_all(b"\n")
    })
}
