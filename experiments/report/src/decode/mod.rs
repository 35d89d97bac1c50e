//! Decoded sessions as files: a table, arrays, and one picture.

mod picture;

pub use picture::save_picture;

use crate::{ReportError, write_all_or_none};
use spts::Session;
use spts::output::OutputFolder;
use spts_eval::decode::{self, DecodedSession};

/// Files outside of folders of their own.
pub const FILES: &[&str] = &["windows.csv", "decoded.svg", "decoded.png"];

/// Writes `windows.csv`, one `NAME.npz` a session and the picture `decoded` (.svg and .png) into the folder `out`: all
/// of them, or none.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write(decoded: &[(&Session, DecodedSession)], out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        decode::write(decoded, out)?;
        save_picture(decoded, &out.path(""), "decoded")?;
        Ok(())
    })
}
