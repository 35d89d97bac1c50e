//! Results as files, and as text.

use super::{AnytimeBoard, AnytimeObject, AnytimeRow, StopScores};
use crate::algorithm::Subject;
use crate::decoders::short_label;
use crate::sensing::Sensing;
use crate::table::{Cell, Table, TextTable};
use crate::tally::{ScoreColumn, unique};
use spts::output::{OutputError, OutputFolder, write_json};

/// Columns of the scores in files.
const SCORES: [ScoreColumn<StopScores>; 7] = [
    ("samples", |s| s.samples),
    ("samples_median", |s| s.samples_median),
    ("samples_p90", |s| s.samples_p90),
    ("attained", |s| s.attained),
    ("attained_reached", |s| s.attained_reached),
    ("stated", |s| s.stated),
    ("never", |s| s.never),
];

/// Writes `anytime.json`, `anytime.csv` and `objects.csv` into the folder `out`.
///
/// # Errors
/// [`OutputError`] if a file cannot be written.
pub fn write(board: &AnytimeBoard, out: &mut OutputFolder) -> Result<(), OutputError> {
    write_json(&out.path("anytime.json"), board)?;
    let rows = Table::new("anytime", &board.rows)
        .file("decoder", |r| &r.decoder)
        .file("subject", |r| Cell::name_of(r.subject))
        .file("sensing", |r| r.sensing.name())
        .file("left_out", |r| r.left_out)
        .file("learned_from", |r| &r.learned_from)
        .file("confidence", |r| r.confidence);
    with_scores(rows, |r: &AnytimeRow| &r.scores)
        .interval("samples", |r| r.samples_ci)
        .interval("attained", |r| r.attained_ci)
        .file("most", |r| r.most)
        .file("windows", |r| r.windows)
        .file("failed", |r| r.failed)
        .write(out)?;
    let objects = Table::new("objects", &board.objects)
        .file("decoder", |r| &r.decoder)
        .file("subject", |r| Cell::name_of(r.subject))
        .file("sensing", |r| r.sensing.name())
        .file("left_out", |r| r.left_out)
        .file("learned_from", |r| &r.learned_from)
        .file("confidence", |r| r.confidence)
        .file("object", |r| &r.object);
    with_scores(objects, |r: &AnytimeObject| &r.scores)
        .file("windows", |r| r.windows)
        .write(out)
}

fn with_scores<'a, R: Copy + 'a>(table: Table<'a, R>, of: impl Fn(R) -> &'a StopScores + Copy + 'a) -> Table<'a, R> {
    let columns = SCORES.into_iter();
    columns.fold(table, |table, (name, get)| table.file(name, move |r| get(of(r))))
}

/// Tables of classes, of images of known objects, and of images of left-out objects, with one line for every stopping
/// rule; then a table of objects.
#[must_use]
pub fn table(board: &AnytimeBoard) -> String {
    let mut out = String::new();
    for (subject, left_out) in [(Subject::Class, false), (Subject::Image, false), (Subject::Image, true)] {
        let here = |r: &&AnytimeRow| r.subject == subject && r.left_out == left_out;
        let rows: Vec<&AnytimeRow> = board.rows.iter().filter(here).collect();
        if rows.is_empty() {
            continue;
        }
        out.push_str(match (subject, left_out) {
            (Subject::Class, _) => "\nclass: stop when the most probable class has the wanted probability\n",
            (Subject::Image, false) => "\nimage, objects that were learned from: stop at the wanted expected IoU\n",
            (Subject::Image, true) => "\nimage, the object was not learned from: stop at the wanted expected IoU\n",
        });
        out.push_str(&text(rows, if subject == Subject::Class { "right" } else { "IoU" }));
    }
    out.push_str("\nwanted: confidence at which a window ends, fixed: all windows take as many samples; stated: mean confidence of the windows that reached it; never: share that did not, which count with all of their samples\n");
    if board.rows.iter().any(|r| r.sensing == Sensing::Chosen) {
        out.push_str("chosen rows: picked from those of a press for what was learned, before a sample is seen; their order in time is lost\n");
    }
    out.push_str(&objects(board));
    out.truncate(out.trim_end().len());
    out.trim_start().to_owned()
}

fn text(rows: Vec<&AnytimeRow>, attained: &str) -> String {
    let failed = rows.iter().any(|r| r.failed > 0);
    let sure = |r: &AnytimeRow, value: Option<f64>| value.filter(|_| r.confidence.is_some());
    let table = Table::new("", rows)
        .shown("decoder", |r: &AnytimeRow| short_label(&r.decoder))
        .shown("learned", |r| &r.learned_from)
        .shown("rows", |r| r.sensing.name())
        .shown("wanted", |r| wanted(r.confidence))
        .shown("samples", |r| r.scores.samples)
        .digits(2)
        .shown("(95 %)", |r| Cell::span(r.samples_ci, 1))
        .shown("median", |r| r.scores.samples_median)
        .digits(0)
        .shown("90 %", |r| r.scores.samples_p90)
        .digits(0)
        .shown(attained, |r| r.scores.attained)
        .digits(3)
        .shown("(95 %)", |r| Cell::span(r.attained_ci, 3))
        .shown("stated", move |r| sure(r, r.scores.stated))
        .digits(3)
        .shown("never", move |r| sure(r, r.scores.never))
        .digits(3);
    if !failed {
        return table.text();
    }
    let failed = table.shown("", |r| match r.failed {
        0 => String::new(),
        failed => format!("({failed} windows failed)"),
    });
    failed.text()
}

fn wanted(confidence: Option<f64>) -> String {
    confidence.map_or_else(|| "fixed".to_owned(), |c| format!("{c}"))
}

/// Samples and what is attained, object by object, of the windows that end with a wanted confidence.
fn objects(board: &AnytimeBoard) -> String {
    let names = unique(board.objects.iter().map(|row| row.object.as_str()));
    let rows: Vec<&AnytimeRow> = board.rows.iter().filter(|r| r.confidence.is_some()).collect();
    if names.len() < 2 || rows.is_empty() {
        return String::new();
    }
    let number = |value: Option<f64>, digits: usize| value.map_or_else(|| "–".to_owned(), |v| format!("{v:.digits$}"));
    let line = |row: &&AnytimeRow| {
        let learned = if row.left_out { "left out" } else { &row.learned_from };
        let same = board.objects.iter().filter(|o| {
            let way = (o.left_out, o.sensing, o.confidence.map(f64::to_bits))
                == (row.left_out, row.sensing, row.confidence.map(f64::to_bits));
            way && o.decoder == row.decoder && o.learned_from == row.learned_from
        });
        let cells = same.map(|o| format!("{}/{}", number(o.scores.samples, 1), number(o.scores.attained, 3)));
        let key = [short_label(&row.decoder), learned, row.sensing.name()].map(str::to_owned);
        key.into_iter().chain([wanted(row.confidence)]).chain(cells).collect()
    };
    let head = ["decoder", "learned", "rows", "wanted"].into_iter();
    let table = TextTable {
        head: head.chain(names.iter().copied()).map(str::to_owned).collect(),
        rows: rows.iter().map(line).collect(),
    };
    format!("\nobject by object: samples / attained\n{table}")
}
