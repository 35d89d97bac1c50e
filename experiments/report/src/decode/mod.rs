//! Decoded sessions as files: a table, arrays, and one picture.

mod arrays;
mod picture;

pub use picture::save_picture;

use crate::{ReportError, write_all_or_none};
use spts::Session;
use spts::output::{OutputFolder, write_csv};
use spts_eval::decode::DecodedSession;

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

/// Files outside of folders of their own.
pub const FILES: &[&str] = &["windows.csv", "decoded.svg", "decoded.png"];

/// Writes `windows.csv`, one `NAME.npz` a session and the picture `decoded` (.svg and .png) into the folder `out`: all
/// of them, or none.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write(decoded: &[(&Session, DecodedSession)], out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        let rows = decoded.iter().flat_map(|(_, session)| &session.rows);
        let line = |r: &spts_eval::decode::DecodedWindow| {
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
        save_picture(decoded, &out.path(""), "decoded")?;
        Ok(())
    })
}
