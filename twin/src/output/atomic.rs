//! Files that are written completely or not at all.

use super::disk::{self, NewFile};
use super::error::OutputError;
use std::fs::File;
use std::io::{self, BufWriter, Read as _, Seek as _, Write as _};
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
/// file.fill(|buffer| buffer.write_all(b"results"))?;
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
}

impl AtomicFile {
    /// Starts the file `path`. It will replace a regular file of that name.
    ///
    /// # Errors
    /// [`OutputError`] if the file cannot be created, or `path` is something other than a regular file.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let failed = OutputError::write(path);
        if std::fs::metadata(path).is_ok_and(|found| !found.is_file()) {
            return Err(OutputError::NotRegular { path: path.to_owned() });
        }
        if path.file_name().is_none() {
            return Err(failed(io::ErrorKind::InvalidInput.into()));
        }
        let made = tempfile::Builder::new()
            .prefix(TEMPORARY[0])
            .suffix(TEMPORARY[1])
            .rand_bytes(RANDOM)
            .make_in(parent(path), NewFile::create);
        let (file, temporary) = made.map_err(failed)?.into_parts();
        file.show_in_use();
        Ok(Self {
            buffer: BufWriter::with_capacity(PIECE, file),
            temporary,
            path: path.to_owned(),
        })
    }

    /// Writes the bytes that `fill` puts into the buffer.
    ///
    /// # Errors
    /// [`OutputError::Write`] if `fill` fails.
    pub fn fill(&mut self, fill: impl FnOnce(&mut BufWriter<NewFile>) -> io::Result<()>) -> Result<(), OutputError> {
        fill(&mut self.buffer).map_err(OutputError::write(&self.path))
    }

    /// Waits until the bytes are on the disk, then gives the file its name.
    ///
    /// # Errors
    /// [`OutputError::Write`] if the disk is full or reports an error.
    pub fn finish(mut self) -> Result<(), OutputError> {
        let failed = OutputError::write(&self.path);
        self.buffer.flush().map_err(&failed)?;
        // a full disk may only show when the data reach it
        self.buffer.get_ref().sync().map_err(&failed)?;
        disk::rename(&self.temporary, &self.path).map_err(&failed)?;
        // the temporary name is gone, so there is nothing to remove
        let _ = self.temporary.keep();
        Ok(())
    }

    /// Hands what was written so far, from byte `start` on, to `each` in pieces of at most `piece` bytes.
    pub(super) fn read_back(
        &mut self,
        start: u64,
        piece: usize,
        mut each: impl FnMut(&[u8]) -> Result<(), OutputError>,
    ) -> Result<(), OutputError> {
        let failed = OutputError::write(&self.path);
        self.buffer.flush().map_err(&failed)?;
        let mut file = File::open(&self.temporary).map_err(&failed)?;
        file.seek(io::SeekFrom::Start(start)).map_err(&failed)?;
        let mut bytes = Vec::with_capacity(piece);
        loop {
            bytes.clear();
            let wanted = u64::try_from(piece).unwrap_or(u64::MAX);
            if (&file).take(wanted).read_to_end(&mut bytes).map_err(&failed)? == 0 {
                return Ok(());
            }
            each(&bytes)?;
        }
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

/// Writes `path` with the bytes that `fill` puts into the buffer. A regular file of that name is replaced.
///
/// # Errors
/// [`OutputError`] if the file cannot be written, or `path` is something other than a regular file. Nothing is left
/// behind then, and an earlier file stays unchanged.
pub fn write_with(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<NewFile>) -> io::Result<()>,
) -> Result<(), OutputError> {
    let mut file = AtomicFile::create(path)?;
    file.fill(fill)?;
    file.finish()
}

/// Start and end of the name of a file that is being written.
const TEMPORARY: [&str; 2] = [".spts-", ".part"];

/// Whether `name` is a name that unfinished files have.
#[must_use]
pub fn is_temporary(name: &str) -> bool {
    name.starts_with(TEMPORARY[0]) && name.ends_with(TEMPORARY[1])
}

/// Removes the unfinished file `path` (see [`is_temporary`]) if the run that wrote it has ended. A file that is still
/// being written, or may be, stays.
///
/// # Errors
/// [`io::Error`] if the file cannot be removed.
pub fn remove_left(path: &Path) -> io::Result<()> {
    let left = File::open(path).is_ok_and(|file| file.try_lock().is_ok());
    if left { std::fs::remove_file(path) } else { Ok(()) }
}

/// Bytes that reach the disk together.
const PIECE: usize = 1 << 17;

/// Random letters and digits in the name of what waits: no two runs choose the same.
pub(super) const RANDOM: usize = 12;

/// Folder of the file `path`.
pub(super) fn parent(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// Checks that a file `path` can be written, and leaves nothing there. A long run calls this before it computes.
///
/// # Errors
/// As [`write_with`].
pub fn check_writable(path: &Path) -> Result<(), OutputError> {
    AtomicFile::create(path).map(drop)
}

/// Writes `bytes` as `path`.
///
/// # Errors
/// As [`write_with`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    write_with(path, |out| out.write_all(bytes))
}
