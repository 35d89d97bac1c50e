//! Decoded sessions as files: a table, arrays, and one picture.

use crate::figures::{Sheet, Tile, TileRow, save_sheet};
use crate::write_all_or_none;
use spts::Session;
use spts::output::OutputFolder;
use spts_circuit::{LevelSource, Seeding};
use spts_eval::decode::{self, DecodedSession, DecodedWindow};
use spts_eval::decoders::short_label;
use spts_eval::unique;
use spts_input::Refusal;
use spts_recon::metrics::{SUPPORT_THRESHOLD, support};
use std::path::Path;

/// Writes `windows.csv`, one `NAME.npz` a session and the picture `decoded` (.svg and .png) into the folder `out`: all
/// of them, or none.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub fn write(decoded: &[(&Session, DecodedSession)], out: OutputFolder) -> Result<(), Refusal> {
    write_all_or_none(out, |out| {
        decode::write(decoded, out)?;
        save_picture(decoded, &out.path(""), "decoded")?;
        Ok(())
    })
}

/// Rows that are shown at most.
const MOST_ROWS: usize = 6;
/// Measurements of the wire that are shown at most.
const MOST_BARS: usize = 100;
const TILE_PX: usize = 120;
/// Side of a tile of a skin of more taxels along one side than [`FINE`].
const FINE_TILE_PX: usize = 200;
const FINE: usize = 24;

/// Writes `NAME.svg` and `NAME.png` into `folder`: a row for each of the first blocks, with the true image, the trace
/// of the wire, and the images at each M with the true support outlined.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub(crate) fn save_picture(decoded: &[(&Session, DecodedSession)], folder: &Path, name: &str) -> Result<(), Refusal> {
    let mut rows = Vec::new();
    let outlined = format!("what the taxels conduct; outlined: above {:.0} % of the peak", 100.0 * SUPPORT_THRESHOLD);
    let mut columns = vec![outlined, "the wire".to_owned()];
    let rows_of: Vec<&str> = unique(decoded.iter().filter_map(|(session, _)| rows_words(session)));
    if let [words] = rows_of[..] {
        columns[1] = format!("the wire, {words}");
    }
    // sessions of other skins are decoded from other numbers of measurements
    let same_m = decoded.iter().all(|(_, found)| measurements(found) == measurements(&decoded[0].1));
    let most_blocks = MOST_ROWS.div_ceil(decoded.len().max(1)).max(1);
    for (session, found) in decoded {
        for block in 0..found.truth.len().min(most_blocks) {
            if rows.len() == MOST_ROWS {
                break;
            }
            let first: Vec<&DecodedWindow> = found.rows.iter().filter(|r| r.block == block && r.window == 0).collect();
            if columns.len() == 2 {
                columns.extend(first.iter().map(|r| {
                    let name = short_label(r.decoder);
                    if same_m { format!("{name}, M = {}", r.m) } else { name.to_owned() }
                }));
            }
            let mut tiles = vec![pressed(session, found, block), wire(found, block)];
            tiles.extend(first.iter().map(|row| image(found, row, !same_m)));
            rows.push(TileRow {
                label: if decoded.len() > 1 { session.name.clone() } else { format!("block {block}") },
                tiles,
            });
        }
    }
    let title = match decoded {
        [(session, _)] => format!("{}: pressed, measured on one wire, decoded", session.name),
        _ => "Pressed, measured on one wire, decoded".to_owned(),
    };
    let sheet = Sheet {
        title,
        column_titles: columns,
        rows,
        tile_px: if decoded.iter().any(|(_, found)| found.shape.iter().any(|side| *side > FINE)) {
            FINE_TILE_PX
        } else {
            TILE_PX
        },
    };
    save_sheet(&sheet, folder, name)
}

/// What kind of rows of the sensing matrix a session was measured with.
fn rows_words(session: &Session) -> Option<&'static str> {
    Some(match session.compressive()?.weights().source() {
        LevelSource::Seeding(Seeding::Address) => "random rows as published",
        LevelSource::Seeding(Seeding::Mixed) => "random rows, mixed seeds",
        LevelSource::Seeds(_) => "random rows, given seeds",
        LevelSource::Patterns(_) => "rows of a pattern",
    })
}

/// The true image.
fn pressed(session: &Session, found: &DecodedSession, block: usize) -> Tile {
    let facts = session.compressive.as_ref().and_then(|r| r.facts(block));
    let [rows, cols] = found.shape;
    let outline = found.truth.get(block).and_then(Option::as_ref).map(|truth| above(truth));
    let heat = |values: Vec<f64>, caption: String| Tile::Heat { values, rows, cols, max: None, caption, outline };
    match found.truth.get(block).and_then(Option::as_ref) {
        Some(truth) => {
            let peak = truth.iter().copied().fold(0.0, f64::max);
            let pressure = facts.and_then(|f| f.pressure.as_ref());
            match facts.and_then(|f| f.conductance.as_ref()) {
                Some(_) => {
                    let of = pressure.map_or_else(String::new, |map| format!(" at {:.0} kPa", 1e-3 * map.max()));
                    heat(truth.clone(), format!("peak {:.0} µS{of}", 1e6 * peak))
                }
                None => heat(truth.clone(), format!("raster scan, peak {peak:.2} V")),
            }
        }
        None => Tile::Text("not known".to_owned()),
    }
}

/// The first measurements of the longest window.
fn wire(found: &DecodedSession, block: usize) -> Tile {
    let of_block = found.measured.iter().filter(|w| w.block == block && w.window == 0);
    let Some(window) = of_block.max_by_key(|w| w.m) else {
        return Tile::Empty;
    };
    let values: Vec<f64> = window.y.iter().copied().take(MOST_BARS).collect();
    let largest = values.iter().map(|v| v.abs()).fold(0.0, f64::max);
    Tile::Bars {
        highlight: values.len(),
        caption: format!("{} measurements, up to {largest:.1} V", values.len()),
        values,
    }
}

/// Numbers of measurements that `found` was decoded from.
fn measurements(found: &DecodedSession) -> Vec<usize> {
    let first = found.rows.iter().filter(|r| r.block == 0 && r.window == 0);
    first.map(|r| r.m).collect()
}

/// The image of a window; `with_m` says its number of measurements as well.
fn image(found: &DecodedSession, row: &DecodedWindow, with_m: bool) -> Tile {
    let [rows, cols] = found.shape;
    if row.image.len() != rows * cols {
        return Tile::Text(row.label.clone().unwrap_or_else(|| "no image".to_owned()));
    }
    let mut words: Vec<String> = with_m.then(|| format!("M = {}", row.m)).into_iter().collect();
    words.extend(row.label.clone());
    words.extend(row.iou.map(|iou| format!("IoU {iou:.2}")));
    let truth = found.truth.get(row.block).and_then(Option::as_ref);
    Tile::Heat {
        values: row.image.clone(),
        rows,
        cols,
        max: None,
        caption: words.join(", "),
        outline: truth.map(|truth| above(truth)),
    }
}

/// The taxels of `image` that count as touched.
fn above(image: &[f64]) -> Vec<bool> {
    let mut mask = Vec::new();
    support(image, SUPPORT_THRESHOLD, &mut mask);
    mask
}
