//! Decoded sessions as files: one table, and one archive of arrays for each session.

use super::{DecodedSession, DecodedWindow, arrays};
use spts::Session;
use spts::output::{OutputError, OutputFolder, write_csv};

/// Columns of `windows.csv`.
const COLUMNS: [&str; 13] = [
    "session",
    "block",
    "window",
    "decoder",
    "m",
    "start",
    "support",
    "iou",
    "correlation",
    "label",
    "label_true",
    "row",
    "col",
];

/// Names of the result files that do not depend on the session.
pub const FILES: &[&str] = &["windows.csv"];

/// Writes `windows.csv` and one `NAME.npz` for each session into the folder `out`.
///
/// # Errors
/// [`OutputError`] if a file cannot be written.
pub fn write(decoded: &[(&Session, DecodedSession)], out: &mut OutputFolder) -> Result<(), OutputError> {
    let rows = decoded.iter().flat_map(|(_, session)| &session.rows);
    let line = |r: &DecodedWindow| {
        let [row, col] = r.place.map_or([None; 2], |place| place.map(Some));
        let key = (r.session.clone(), r.block, r.window, r.decoder, r.m, r.start);
        (
            key,
            (r.support, r.iou, r.correlation),
            (r.label.clone(), r.label_true.clone()),
            (row, col),
        )
    };
    write_csv(&out.path("windows.csv"), &COLUMNS, rows.map(line))?;
    for (_, session) in decoded {
        arrays::write(&out.path(&format!("{}.npz", session.session)), session)?;
    }
    Ok(())
}
