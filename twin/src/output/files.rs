//! Files that are written completely or not at all: bytes, NumPy arrays, CSV tables and JSON. Their bytes depend only
//! on the values.

use super::disk::{self, NewFile, not_ours, unwritable};
use crate::cleanup::{Entry, Leftover, listed};
use npyz::WriterBuilder as _;
use serde::Serialize;
use spts_input::Refusal;
use std::fs::File;
use std::io::{self, BufWriter, Read as _, Seek as _, Write as _};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

/// A file being written. [`AtomicFile::finish`] gives it its name. If it is dropped before, nothing is left behind, and
/// an earlier file of that name stays unchanged.
///
/// ```
/// use spts::output::AtomicFile;
/// use std::io::Write as _;
///
/// # let path = std::env::temp_dir().join(format!("spts-doc-atomic-{}.txt", std::process::id()));
/// let mut file = AtomicFile::create(&path)?;
/// file.write_all(b"results")?;
/// assert!(!path.exists(), "the name comes last");
/// file.finish()?;
/// assert_eq!(std::fs::read(&path)?, b"results");
/// # std::fs::remove_file(&path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct AtomicFile {
    buffer: BufWriter<NewFile>,
    temporary: tempfile::TempPath,
    path: PathBuf,
    /// Lets a signal remove the unfinished file.
    _entry: Entry,
}

impl AtomicFile {
    /// Starts the file `path`. It will replace a regular file of that name.
    ///
    /// # Errors
    /// [`Refusal`] if the file cannot be created, or `path` is something other than a regular file.
    pub fn create(path: &Path) -> Result<Self, Refusal> {
        let failed = unwritable(path);
        if std::fs::metadata(path).is_ok_and(|found| !found.is_file()) {
            return Err(Refusal::new("is not a regular file and is not replaced").at(path.display()));
        }
        if path.file_name().is_none() {
            return Err(failed(io::ErrorKind::InvalidInput.into()));
        }
        let make = || {
            tempfile::Builder::new()
                .prefix(TEMPORARY[0])
                .suffix(TEMPORARY[1])
                .rand_bytes(RANDOM)
                .make_in(disk::parent(path), NewFile::create)
        };
        let (made, entry) = listed(make, |made| Leftover::Each(vec![made.path().to_owned()])).map_err(failed)?;
        let (file, temporary) = made.into_parts();
        let buffer = BufWriter::with_capacity(PIECE, file);
        Ok(Self { buffer, temporary, path: path.to_owned(), _entry: entry })
    }

    /// Cuts the file off after `length` bytes, of which the first become `start`. What has not reached the file is
    /// lost.
    fn cut(self, length: u64, start: &[u8]) -> Result<Self, Refusal> {
        let failed = unwritable(&self.path);
        // bytes that a full disk did not take would be tried again
        let (mut file, _) = self.buffer.into_parts();
        file.cut(length, start).map_err(failed)?;
        Ok(Self { buffer: BufWriter::with_capacity(PIECE, file), ..self })
    }

    /// Waits until the bytes are on the disk, then gives the file its name.
    ///
    /// # Errors
    /// [`Refusal`] if the disk is full or reports an error.
    pub fn finish(mut self) -> Result<(), Refusal> {
        let failed = unwritable(&self.path);
        self.sync()?;
        disk::rename(&self.temporary, &self.path).map_err(&failed)?;
        // the temporary name is gone, so there is nothing to remove
        let _ = self.temporary.keep();
        Ok(())
    }

    /// Waits until all bytes are on the disk.
    fn sync(&mut self) -> Result<(), Refusal> {
        let failed = unwritable(&self.path);
        self.buffer.flush().map_err(&failed)?;
        // a full disk may only show when the data reach it
        self.buffer.get_ref().sync().map_err(&failed)
    }
}

impl io::Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.buffer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.buffer.flush()
    }
}

/// Writes `path` with the bytes that `fill` puts into the file. A regular file of that name is replaced.
///
/// # Errors
/// [`Refusal`] if the file cannot be written, or `path` is something other than a regular file. Nothing is left
/// behind then, and an earlier file stays unchanged.
fn write_with(path: &Path, fill: impl FnOnce(&mut AtomicFile) -> io::Result<()>) -> Result<(), Refusal> {
    let mut file = AtomicFile::create(path)?;
    fill(&mut file).map_err(unwritable(path))?;
    file.finish()
}

/// Start and end of the name of a file that is being written.
const TEMPORARY: [&str; 2] = [".spts-", ".part"];

/// Whether `name` is a name that unfinished files have.
pub fn is_temporary(name: &str) -> bool {
    name.starts_with(TEMPORARY[0]) && name.ends_with(TEMPORARY[1])
}

/// Removes the unfinished file `path` (see [`is_temporary`]) if the run that wrote it has ended. A file that is still
/// being written, or may be, stays.
///
/// # Errors
/// [`io::Error`] if the file cannot be removed.
pub fn remove_left(path: &Path) -> io::Result<()> {
    let left = spts_input::open(path, u64::MAX).is_ok_and(|(file, _)| file.try_lock().is_ok());
    if left { std::fs::remove_file(path) } else { Ok(()) }
}

/// Bytes that reach the disk together.
const PIECE: usize = 1 << 17;

/// Random letters and digits in the name of what waits: no two runs choose the same.
const RANDOM: usize = 12;

/// Checks that a file `path` can be written, and leaves nothing there. A long run calls this before it computes.
///
/// # Errors
/// [`Refusal`] if the file cannot be written, or `path` is something other than a regular file.
pub fn check_writable(path: &Path) -> Result<(), Refusal> {
    AtomicFile::create(path).map(drop)
}

/// Writes `bytes` as `path`.
///
/// # Errors
/// [`Refusal`] if the file cannot be written, or `path` is something other than a regular file.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), Refusal> {
    write_with(path, |out| out.write_all(bytes))
}

/// Writes `bytes` as `path` if nothing has this name; of two runs that try at once, one does. Returns whether it did.
///
/// # Errors
/// [`Refusal`] if the file cannot be written.
pub fn write_new(path: &Path, bytes: &[u8]) -> Result<bool, Refusal> {
    if disk::exists(path) {
        return Ok(false);
    }
    let failed = unwritable(path);
    let mut file = AtomicFile::create(path)?;
    file.write_all(bytes).map_err(&failed)?;
    file.sync()?;
    match disk::link(&file.temporary, path) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(false),
        other => other.map(|()| true).map_err(failed),
    }
}

/// Checks that a single file `path` can be written, and that nothing is lost by it: whatever has this name has to be an
/// earlier result, which `ours` tells.
///
/// # Errors
/// [`Refusal`] as [`check_writable`], and for a link or a file that is not ours.
pub fn check_replaceable(path: &Path, ours: impl FnOnce(&Path) -> bool) -> Result<(), Refusal> {
    check_writable(path)?;
    match path.symlink_metadata() {
        Ok(found) if !found.is_file() || !ours(path) => Err(not_ours(path)),
        _ => Ok(()),
    }
}

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
    shape: Vec<usize>,
    written: usize,
    header: Vec<u8>,
    kind: PhantomData<T>,
}

impl<T: NpyValue> NpyFile<T> {
    /// Starts the array `path` with shape `shape`.
    ///
    /// # Errors
    /// [`Refusal`] if the file cannot be created.
    pub fn create(path: &Path, shape: &[usize]) -> Result<Self, Refusal> {
        let mut file = AtomicFile::create(path)?;
        let header = npy_header::<T>(shape).map_err(unwritable(path))?;
        file.write_all(&header).map_err(unwritable(path))?;
        Ok(Self { file, shape: shape.to_vec(), written: 0, header, kind: PhantomData })
    }

    /// Writes the next values.
    ///
    /// # Errors
    /// [`Refusal`] if the disk is full or reports an error.
    pub fn push(&mut self, values: impl IntoIterator<Item = T>) -> Result<(), Refusal> {
        let written = values.into_iter().try_for_each(|value| {
            self.written += 1;
            self.file.write_all(value.bytes().as_ref())
        });
        written.map_err(unwritable(&self.file.path))
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// [`Refusal`] if the number of values differs from that of the shape, or the file cannot be written.
    pub fn finish(self) -> Result<(), Refusal> {
        if self.shape.iter().product::<usize>() != self.written {
            let problem = format!("{} values for an array of shape {:?}", self.written, self.shape);
            return Err(Refusal::new(problem).at(self.file.path.display()));
        }
        self.file.finish()
    }

    /// Waits until all values have left the program.
    pub(crate) fn flush(&mut self) -> Result<(), Refusal> {
        self.file.flush().map_err(unwritable(&self.file.path))
    }

    /// As [`NpyFile::finish`], with `entries` in place of the first side of the shape. Values behind them are dropped.
    /// Where the disk takes no more, all of the entries have to be on it, as after a [`NpyFile::flush`].
    pub(crate) fn finish_with(mut self, entries: usize) -> Result<(), Refusal> {
        let values: usize = self.shape.iter().skip(1).product::<usize>() * entries;
        if self.shape.first() == Some(&entries) || values > self.written {
            return self.finish();
        }
        if let Some(side) = self.shape.first_mut() {
            *side = entries;
        }
        let mut header = npy_header::<T>(&self.shape).map_err(unwritable(&self.file.path))?;
        // a header of fewer digits is as long: blanks stand before its line end
        let blanks = self.header.len().saturating_sub(header.len());
        let end = header.len() - 1;
        header.splice(end..end, vec![b' '; blanks]);
        header[8..10].copy_from_slice(&self.header[8..10]);
        let bytes = header.len() as u64 + (values * size_of::<T>()) as u64;
        // what a full disk does not take is dropped
        let _ = self.flush();
        self.file.cut(bytes, &header)?.finish()
    }

    /// Hands the bytes of the values that were written so far to `each`, some thousand values at a time.
    pub(crate) fn read_back(&mut self, mut each: impl FnMut(&[u8]) -> Result<(), Refusal>) -> Result<(), Refusal> {
        let failed = unwritable(&self.file.path);
        self.file.flush().map_err(&failed)?;
        let mut file = File::open(&self.file.temporary).map_err(&failed)?;
        file.seek(io::SeekFrom::Start(self.header.len() as u64)).map_err(&failed)?;
        let (piece, mut bytes) = ((size_of::<T>() as u64) << 13, Vec::new());
        while (&file).take(piece).read_to_end(&mut bytes).map_err(&failed)? > 0 {
            each(&bytes)?;
            bytes.clear();
        }
        Ok(())
    }
}

/// Header of an array of `shape`.
fn npy_header<T: NpyValue>(shape: &[usize]) -> io::Result<Vec<u8>> {
    let sides: Vec<u64> = shape.iter().map(|side| *side as u64).collect();
    let kind = T::KIND.parse().map_err(io::Error::other)?;
    let mut header = Vec::new();
    let options = npyz::WriteOptions::new_header_only().dtype(npyz::DType::Plain(kind)).shape(&sides);
    options.writer(&mut header).write_header_only()?;
    Ok(header)
}

/// Writes `values` as a NumPy array of little-endian doubles in C order.
///
/// # Errors
/// [`Refusal`] if the number of values differs from that of the shape, or the file cannot be written.
pub fn write_npy(path: &Path, shape: &[usize], values: &[f64]) -> Result<(), Refusal> {
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
pub struct CsvFile(csv::Writer<AtomicFile>);

impl CsvFile {
    /// Starts the table `path` with the header `header`.
    ///
    /// # Errors
    /// [`Refusal`] if the file cannot be created.
    pub fn create(path: &Path, header: &[&str]) -> Result<Self, Refusal> {
        let mut options = csv::WriterBuilder::new();
        let mut writer = options.has_headers(false).from_writer(AtomicFile::create(path)?);
        writer.write_record(header).map_err(unwritable(path))?;
        Ok(Self(writer))
    }

    /// Writes the next row. A row may be a tuple that contains arrays; their elements become fields in order. Numbers
    /// have the fewest digits that read back as the same number.
    ///
    /// # Errors
    /// [`Refusal`] if the number of fields differs from that of the header, or the disk is full or reports
    /// an error.
    pub fn push(&mut self, row: impl Serialize) -> Result<(), Refusal> {
        let written = self.0.serialize(row);
        written.map_err(|error| unwritable(&self.0.get_ref().path)(error))
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// [`Refusal`] if the file cannot be written.
    pub fn finish(self) -> Result<(), Refusal> {
        let failed = unwritable(&self.0.get_ref().path);
        let file = self.0.into_inner().map_err(|e| failed(e.into_error()))?;
        file.finish()
    }
}

/// Writes a table whose header is the field names of its rows.
///
/// # Errors
/// [`Refusal`] if the file cannot be written.
pub fn write_table<R: Serialize>(path: &Path, rows: &[R]) -> Result<(), Refusal> {
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
/// [`Refusal`] if the file cannot be written.
pub fn write_json<T: Serialize>(path: &Path, value: &T) -> Result<(), Refusal> {
    write_bytes(path, json_text(path, value)?.as_bytes())
}

/// What [`write_json`] writes. Errors name the file `path`.
///
/// # Errors
/// [`Refusal`] if `value` has no JSON.
pub fn json_text<T: Serialize>(path: &Path, value: &T) -> Result<String, Refusal> {
    let text = serde_json::to_string_pretty(value).map_err(unwritable(path))?;
    Ok(text + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_array_is_read_back_bit_for_bit() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npy");
        let values = [0.1, -0.0, f64::NAN, f64::INFINITY, 5e-324, 1.0 / 3.0];
        write_npy(&path, &[2, 3], &values).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let npy = npyz::NpyFile::new(&bytes[..]).unwrap();
        let found = (npy.shape(), npy.order(), npy.dtype().descr());
        assert_eq!(found, (&[2, 3][..], npyz::Order::C, "'<f8'".to_owned()));
        let back: Vec<f64> = npy.into_vec().unwrap();
        assert!(back.iter().zip(&values).all(|(b, v)| b.to_bits() == v.to_bits()));
        write_npy(&path, &[2, 3], &values).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), bytes, "same values, other bytes");
        let error = write_npy(&path, &[4], &values).unwrap_err().to_string();
        assert!(error.ends_with("6 values for an array of shape [4]"), "{error}");
    }

    #[test]
    fn an_array_that_ends_early_is_a_whole_one() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npy");
        // headers of one length and of two
        for (most, kept) in [(9, 2), (10_usize.pow(12), 3), (4, 4)] {
            let mut file = NpyFile::create(&path, &[most, 2]).unwrap();
            file.push((0_u16..9).take(2 * most.min(4) + usize::from(most > 4))).unwrap();
            file.finish_with(kept).unwrap();
            let bytes = std::fs::read(&path).unwrap();
            let npy = npyz::NpyFile::new(&bytes[..]).unwrap();
            assert_eq!(npy.shape(), [kept as u64, 2]);
            let values: Vec<u16> = npy.into_vec().unwrap();
            assert_eq!(values, (0..2 * u16::try_from(kept).unwrap()).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.csv");
        let mut table = CsvFile::create(&path, &["press", "time_s", "x", "y"]).unwrap();
        table.push((0_usize, 0.1, [1e-7, 2.0 / 3.0])).unwrap();
        table.finish().unwrap();
        let text = "press,time_s,x,y\n0,0.1,1e-7,0.6666666666666666\n";
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        let mut table = CsvFile::create(&path, &["one"]).unwrap();
        assert!(table.push((1, 2)).is_err());
        drop(table);
        let full = write_with(&path, |out| {
            out.write_all(b"new, and then the disk is full")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert!(full.unwrap_err().to_string().contains("t.csv"));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text, "damaged");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
        let error = write_bytes(dir.path(), b"").unwrap_err().to_string();
        assert!(error.contains("is not a regular file"), "{error}");
        assert!(write_bytes(Path::new("/dev/full"), b"x").is_err());
    }
}
