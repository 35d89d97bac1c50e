//! One file at a time, whole or not at all.

use super::error::OutputError;
use std::fs::File;
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};

/// Temporary file that is removed unless it was renamed.
struct Temporary {
    path: PathBuf,
    renamed: bool,
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.renamed {
            // nothing more can be done about a file that does not go away
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// Writes `path` with what `fill` puts into the buffer. A regular file of that name is replaced.
///
/// # Errors
/// [`OutputError`] when the file cannot be written or something that is not a regular file has its name. Nothing is
/// left behind then, and a file that was there before is as it was.
pub fn write_with(path: &Path, fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<(), OutputError> {
    let failed = OutputError::write(path);
    if std::fs::metadata(path).is_ok_and(|found| !found.is_file()) {
        return Err(OutputError::NotRegular { path: path.to_owned() });
    }
    let Some(name) = path.file_name() else {
        return Err(failed(io::ErrorKind::InvalidInput.into()));
    };
    let mut hidden = std::ffi::OsString::from(".");
    hidden.push(name);
    hidden.push(format!(".{}.part", std::process::id()));
    let mut temporary = Temporary {
        path: path.with_file_name(hidden),
        renamed: false,
    };
    let mut buffer = BufWriter::new(File::create(&temporary.path).map_err(&failed)?);
    fill(&mut buffer).and_then(|()| buffer.flush()).map_err(&failed)?;
    // a full disk may only show when the data reach it
    buffer.get_ref().sync_all().map_err(&failed)?;
    std::fs::rename(&temporary.path, path).map_err(&failed)?;
    temporary.renamed = true;
    Ok(())
}

/// Writes `bytes` as `path`.
///
/// # Errors
/// As for [`write_with`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    write_with(path, |out| out.write_all(bytes))
}
