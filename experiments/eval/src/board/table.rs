//! The board as files, and as text.

use super::{BoardRow, ObjectRow, RowKey, ScoreBoard};
use crate::decoders::short_label;
use crate::place::{PlaceRow, locator_label};
use crate::sensing::Sensing;
use crate::table::{Cell, Table, TextTable, fixed};
use crate::tally::Scores;
use crate::training::{LAYOUT, PUBLISHED, RASTER};
use crate::truth::TruthKind;
use crate::unique;
use spts::output::{OutputFolder, write_json};
use spts_input::Refusal;

/// Writes `board.json`, `board.csv`, `objects.csv` and `localisation.csv` into the folder `out`.
///
/// # Errors
/// [`Refusal`] if a file cannot be written.
pub fn write(board: &ScoreBoard, out: &mut OutputFolder) -> Result<(), Refusal> {
    write_json(&out.path("board.json"), board)?;
    rows(&board.rows).write(out)?;
    keyed(Table::new("objects", &board.objects), |r| &r.key)
        .file("object", |r| &r.object)
        .file("truth", |r| r.truth.map(TruthKind::name))
        .files(&Scores::COLUMNS, |r| &r.scores)
        .files(&Scores::TRUTH, |r| &r.scores)
        .interval("iou", |r| r.iou_ci)
        .interval("class_single", |r| r.class_single_ci)
        .write(out)?;
    if !board.localisation.is_empty() {
        places(&board.localisation).write(out)?;
    }
    Ok(())
}

fn keyed<'a, R: Copy + 'a>(table: Table<'a, R>, of: impl Fn(R) -> &'a RowKey + Copy + 'a) -> Table<'a, R> {
    table
        .file("decoder", move |r| &of(r).decoder)
        .file("m", move |r| of(r).m)
        .file("left_out", move |r| of(r).left_out)
        .file("learned_from", move |r| &of(r).learned_from)
        .file("sensing", move |r| of(r).sensing.name())
}

/// `board.csv`, and what a reader sees of it.
fn rows<'a>(rows: impl IntoIterator<Item = &'a BoardRow>) -> Table<'a, &'a BoardRow> {
    let rows: Vec<&BoardRow> = rows.into_iter().collect();
    let rows_with_remarks = rows.iter().any(|r| r.too_slow == Some(true) || r.failed > 0);
    let mut table = keyed(Table::new("board", rows), |r: &BoardRow| &r.key)
        .files(&Scores::COLUMNS, |r| &r.scores)
        .files(&Scores::TRUTH, |r| &r.scores)
        .file("look_up", |r| r.look_up)
        .file("worst_object", |r| r.worst_object.as_deref())
        .file("worst_iou", |r| r.worst_iou)
        .interval("support", |r| r.support_ci)
        .interval("iou", |r| r.iou_ci)
        .interval("class_single", |r| r.class_single_ci)
        .file("decode_us", |r| r.decode_us)
        .file("acquire_us", |r| r.acquire_us)
        .file("too_slow", |r| r.too_slow)
        .file("failed", |r| r.failed)
        .shown("decoder", |r| {
            let mark = if r.look_up { " (look-up)" } else { "" };
            format!("{}{mark}", short_label(&r.key.decoder))
        })
        .shown("learned", |r| &r.key.learned_from)
        .shown("rows", |r| r.key.sensing.name())
        .shown("M", |r| r.key.m)
        .number("IoU", 3, |r| r.scores.iou)
        .shown("(95 %)", |r| Cell::span(r.iou_ci, 3))
        .shown("worst", |r| Some(format!("{:.3} {}", r.worst_iou?, r.worst_object.as_deref()?)))
        .number("ceiling", 3, |r| r.scores.ceiling)
        .number("cosine", 3, |r| r.scores.cosine)
        .number("by raster", 3, |r| r.scores.iou_raster)
        .number("support", 3, |r| r.scores.support)
        .number("single", 3, |r| r.scores.class_single)
        .number("vote20", 3, |r| r.scores.class_vote20)
        .number("evidence", 3, |r| r.scores.class_evidence)
        .number("decode, µs", 1, |r| r.decode_us)
        .number("window, µs", 0, |r| r.acquire_us);
    // a remark on some rows has a column where there are such rows
    if rows_with_remarks {
        table = table.shown("", |r| {
            let slow = if r.too_slow == Some(true) { "TOO SLOW " } else { "" };
            match r.failed {
                0 => slow.trim_end().to_owned(),
                failed => format!("{slow}({failed} windows failed)"),
            }
        });
    }
    table
}

/// `localisation.csv`, and what a reader sees of it.
fn places(rows: &[PlaceRow]) -> Table<'_, &PlaceRow> {
    Table::new("localisation", rows)
        .column("contact", "contact", |r| &r.contact)
        .file("decoder", |r| &r.decoder)
        .shown("locator", |r| locator_label(&r.decoder))
        .shown("taxels", |r| if r.relabelled { "relabelled" } else { "as recorded" })
        .shown("rows", |r| r.sensing.name())
        .column("m", "M", |r| r.m)
        .file("relabelled", |r| r.relabelled)
        .file("sensing", |r| r.sensing.name())
        .column("mean_px", "mean px", |r| r.mean_px)
        .digits(2)
        .column("share_under_1px", "under 1 px", |r| r.share_under_1px)
        .digits(3)
}

/// The board as tables: rows with known and with left-out objects, then places, then single objects at the largest M up
/// to 20.
pub fn table(board: &ScoreBoard) -> String {
    let mut out = String::new();
    for (left_out, title) in
        [(false, "objects that were learned from"), (true, "\nleft out: the object was not learned from")]
    {
        let own: Vec<&BoardRow> = board.rows.iter().filter(|r| r.key.left_out == left_out).collect();
        if !own.is_empty() {
            out.push_str(&format!("{title}\n{}", rows(own).text()));
        }
    }
    out.push_str(&truths(board));
    if board.rows.iter().any(|r| r.key.learned_from == LAYOUT) {
        out.push_str("layout: no raster press was left to learn from, so that images of random shapes on the layout were learned; record several presses a session\n");
    }
    if board.rows.iter().any(|r| r.look_up) {
        out.push_str("look-up: the answer is an image of a learned class, the scored object among them; it says nothing of other objects\n");
    }
    out.push_str("classes: share correct of single windows, of votes of 20, of evidence added over 20; support counts every taxel, so that an empty image is right about all that is not touched\n");
    if board.rows.iter().any(|r| r.key.sensing != Sensing::Random) {
        out.push_str("chosen rows: picked from those of a press for what was learned, before a sample is seen; their order in time is lost, and there are no votes\n");
    }
    if !board.localisation.is_empty() {
        out.push_str(&format!("\nplace of contacts\n{}", places(&board.localisation).text()));
    }
    out.push_str(&objects(board));
    out.push_str(&gaps(board));
    out.trim_end().to_owned()
}

/// What the scores of the images are held against.
fn truths(board: &ScoreBoard) -> String {
    let kinds = unique(board.objects.iter().filter_map(|object| object.truth));
    let lines = kinds.iter().map(|kind| {
        let names = unique(board.objects.iter().filter(|o| o.truth == Some(*kind)).map(|o| o.object.as_str()));
        let what = match kind {
            TruthKind::Simulated => "what the taxels conduct; ceiling: the image fitted to the samples of the press",
            TruthKind::Press => {
                "the least-squares image of the press, without the window's samples; ceiling: one half of the press \
                 against the other"
            }
            TruthKind::Raster => "one frame of a raster scan of another press; no ceiling is known",
        };
        format!("truth of {}: {what}\n", names.join(", "))
    });
    let mut out = format!("\n{}", lines.collect::<String>());
    if board.rows.iter().any(|r| r.scores.iou_raster.is_some()) {
        out.push_str("by raster: IoU with one frame of a raster scan of another press, the score of the publication");
        let ceilings: Vec<f64> = board.rows.iter().filter_map(|r| r.scores.ceiling_raster).collect();
        out.push_str(&ceilings.first().map_or_else(String::new, |c| format!("; all samples of a press reach {c:.3}")));
        out.push('\n');
    }
    if board.rows.iter().any(|r| r.worst_iou.is_some()) {
        out.push_str("(95 %): over objects, their sessions and presses; worst: the object with the lowest IoU\n");
    } else if !board.rows.is_empty() {
        out.push_str("(95 %): over the presses of one object; says nothing of others\n");
    }
    out
}

/// IoU and single windows, object by object, at one M.
fn objects(board: &ScoreBoard) -> String {
    let names = unique(board.objects.iter().map(|row| row.object.as_str()));
    let (Some(m), true) = (shown_m(board), names.len() > 1) else {
        return String::new();
    };
    let line = |BoardRow { key, .. }: &BoardRow| {
        let learned = if key.left_out { "left out" } else { &key.learned_from };
        let same = board.objects.iter().filter(|o| o.key == *key);
        let cells = same.map(|o| format!("{}/{}", fixed(o.scores.iou, 2), fixed(o.scores.class_single, 3)));
        let head = [short_label(&key.decoder), learned, key.sensing.name()].map(str::to_owned);
        head.into_iter().chain(cells).collect()
    };
    let head = ["decoder", "learned", "rows"].into_iter().chain(names);
    let table = TextTable::new(head, board.rows.iter().filter(|r| r.key.m == m).map(line));
    format!("\nobject by object at M = {m}: IoU / single windows\n{table}")
}

/// What learning from elsewhere costs beside learning from the recordings' own raster presses, object by object, at one
/// M.
fn gaps(board: &ScoreBoard) -> String {
    let Some(m) = shown_m(board) else {
        return String::new();
    };
    let elsewhere =
        |r: &&ObjectRow| r.key.m == m && ![RASTER, PUBLISHED, "nothing"].contains(&r.key.learned_from.as_str());
    let own = |row: &ObjectRow| {
        let key = RowKey { learned_from: RASTER.to_owned(), ..row.key.clone() };
        board.objects.iter().find(|o| o.key == key && o.object == row.object)
    };
    let pairs: Vec<(&ObjectRow, &ObjectRow)> =
        board.objects.iter().filter(elsewhere).filter_map(|row| Some((row, own(row)?))).collect();
    if pairs.is_empty() {
        return String::new();
    }
    let gap = |own: Option<f64>, other: Option<f64>| Some(format!("{:+.3}", other? - own?));
    let table = Table::new("", pairs)
        .shown("decoder", |(row, _)| short_label(&row.key.decoder))
        .shown("learned from", |(row, _)| &row.key.learned_from)
        .shown("object", |(row, _)| &row.object)
        .shown("IoU", |(row, own)| gap(own.scores.iou, row.scores.iou))
        .shown("single", |(row, own)| gap(own.scores.class_single, row.scores.class_single));
    format!("\ngap to learning from {RASTER} at M = {m}\n{}", table.text())
}

/// The M of the tables by object: the largest up to 20.
fn shown_m(board: &ScoreBoard) -> Option<usize> {
    board.rows.iter().map(|r| r.key.m).filter(|m| *m <= 20).max()
}
