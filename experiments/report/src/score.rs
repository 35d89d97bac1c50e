//! Files and figures of `spts score`.

use super::write_all_or_none;
use crate::figures::{Chart, Curve, Plot, Stroke, Style, save_charts};
use spts::output::OutputFolder;
use spts_eval::algorithm::Subject;
use spts_eval::anytime::{self, AnytimeBoard, AnytimeRow, Stated};
use spts_eval::board::{self, BoardRow, ScoreBoard};
use spts_eval::decoders::short_label;
use spts_eval::in_time::{self, ContactKind, InTimeBoard, InTimeRow};
use spts_eval::place::{PlaceRow, locator_label};
use spts_eval::{Sensing, unique};
use spts_input::Refusal;
use std::path::Path;

/// Writes `board.json`, `board.csv`, `objects.csv`, `localisation.csv` and the figures into the folder `out`: all of
/// them, or none.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub fn write(scores: &ScoreBoard, out: OutputFolder) -> Result<(), Refusal> {
    write_all_or_none(out, |out| {
        board::write(scores, out)?;
        draw_board(scores, &out.folder("figures")?)
    })
}

/// Writes `anytime.json`, `anytime.csv`, `objects.csv` and the figures `anytime` and `reliability` into the folder
/// `out`: all of them, or none.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub fn write_anytime(scores: &AnytimeBoard, out: OutputFolder) -> Result<(), Refusal> {
    write_all_or_none(out, |out| {
        anytime::write(scores, out)?;
        let figures = out.folder("figures")?;
        save_charts(&reliability(scores), &figures, "reliability")?;
        save_charts(&stops(scores), &figures, "anytime")
    })
}

/// Writes `in_time.json`, `in_time.csv`, `objects.csv` and the figure `in_time` into the folder `out`: all of them, or
/// none.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub fn write_in_time(scores: &InTimeBoard, out: OutputFolder) -> Result<(), Refusal> {
    write_all_or_none(out, |out| {
        in_time::write(scores, out)?;
        save_charts(&since_touch(scores), &out.folder("figures")?, "in_time")
    })
}

/// The charts with a curve, and in them the curves with a point: what was not timed is not over time.
fn drawn(charts: impl IntoIterator<Item = Chart>) -> Vec<Chart> {
    let without_empty = |mut chart: Chart| {
        chart.series.retain(|series| !series.points.is_empty());
        (!chart.series.is_empty()).then_some(chart)
    };
    charts.into_iter().filter_map(without_empty).collect()
}

/// Writes `reconstruction`, `classification` and, with a ball, `localisation` for each session of drops, each as .svg
/// and .png.
fn draw_board(board: &ScoreBoard, folder: &Path) -> Result<(), Refusal> {
    let (iou, single): (Score, Score) = (|r| r.scores.iou, |r| r.scores.class_single);
    let same = "The same over acquisition + decode";
    let mut images = vec![
        scores(board, "IoU, learned objects", "IoU", Over::M, false, iou),
        scores(board, same, "", Over::Time, false, iou),
    ];
    if board.rows.iter().any(|r| r.key.left_out) {
        images.push(scores(board, "IoU, object left out", "IoU", Over::M, true, iou));
    }
    save_charts(&drawn(images), folder, "reconstruction")?;
    let right = "classified correctly";
    let votes = |r: &BoardRow| r.scores.class_vote20;
    let classes = [
        scores(board, "Single windows", right, Over::M, false, single),
        scores(board, same, "", Over::Time, false, single),
        scores(board, "Votes of 20 windows", right, Over::M, false, votes),
    ];
    save_charts(&drawn(classes), folder, "classification")?;
    // drops alone are located with their taxels relabelled, too
    let drops = unique(board.localisation.iter().filter(|row| row.relabelled).map(|row| row.contact.as_str()));
    for (k, name) in drops.iter().enumerate() {
        let own: Vec<&PlaceRow> = board.localisation.iter().filter(|row| row.contact == *name).collect();
        let file = if k == 0 { "localisation".to_owned() } else { format!("localisation_{name}") };
        save_charts(&localisation(&own), folder, &file)?;
    }
    Ok(())
}

/// A score of a row.
type Score = fn(&BoardRow) -> Option<f64>;

/// Horizontal axis.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Over {
    M,
    Time,
}

/// One score of all decoders; a decoder has a curve for every source that it learned from, and for every kind of rows.
fn scores(board: &ScoreBoard, title: &str, y_label: &str, over: Over, left_out: bool, get: Score) -> Chart {
    let rows: Vec<&BoardRow> = board.rows.iter().filter(|r| r.key.left_out == left_out).collect();
    let names = unique(board.rows.iter().map(|r| r.key.decoder.as_str()));
    let sources = |name: &str| {
        let own = rows.iter().filter(|r| r.key.decoder == name);
        unique(own.map(|r| (r.key.learned_from.as_str(), r.key.sensing)))
    };
    let curve = |r: &BoardRow| {
        let sources = sources(&r.key.decoder);
        let own = (r.key.learned_from.as_str(), r.key.sensing);
        let mut words = short_label(&r.key.decoder).to_owned();
        if sources.iter().any(|(other, _)| *other != own.0) {
            words.push_str(&format!(", {}", r.key.learned_from));
        }
        if sources.iter().any(|(_, other)| *other != own.1) {
            words.push_str(&format!(", {} rows", r.key.sensing.name()));
        }
        let k = sources.iter().position(|source| *source == own).unwrap_or(0);
        Curve::of_decoder(words, &r.key.decoder, Stroke::of(k))
    };
    let by_name = names.iter().flat_map(|name| rows.iter().copied().filter(move |r| r.key.decoder == *name));
    let plot = Plot::new(by_name).y(y_label, get).by(curve).log_x().within(0.0, 1.02);
    let plot = match over {
        Over::M => plot.x("measurements M", |r| r.key.m as f64),
        Over::Time => plot.x("time, µs", |r| Some(r.acquire_us + r.decode_us?)),
    };
    plot.chart(title)
}

fn localisation(ball: &[&PlaceRow]) -> [Chart; 2] {
    let plot = |y_label: &str, get: fn(&PlaceRow) -> f64| {
        let curve = |r: &PlaceRow| {
            let taxels = if r.relabelled { ", relabelled" } else { "" };
            let stroke = Stroke::of(usize::from(r.relabelled));
            Curve::of_decoder(format!("{}{taxels}", locator_label(&r.decoder)), &r.decoder, stroke)
        };
        Plot::new(ball.iter().copied()).x("measurements M", |r| r.m as f64).y(y_label, get).by(curve)
    };
    [
        plot("mean, taxels", |r| r.mean_px).chart("Distance from the true centre"),
        plot("share", |r| r.share_under_1px).within(0.0, 1.02).chart("Windows within one taxel"),
    ]
}

/// Samples that are needed against the error, for random and for chosen rows, those that stop and those with a fixed
/// number: a panel of the classes and one of the images. Images are those of objects that were left out, where there
/// are such.
fn stops(board: &AnytimeBoard) -> Vec<Chart> {
    let left_out = board.rows.iter().any(|r| r.key.left_out);
    let panel = |title: &str, y_label: &str, subject: Subject, left_out: bool| {
        let here = board.rows.iter().filter(|r| r.key.subject == subject && r.key.left_out == left_out);
        let several = unique(here.clone().map(|r| (r.key.decoder.as_str(), r.key.learned_from.as_str()))).len() > 1;
        let curve = move |r: &AnytimeRow| {
            let style = match r.key.sensing {
                Sensing::Random => Style::Twin,
                Sensing::Chosen | Sensing::WorstKind => Style::Raster,
            };
            let (shade, how) = match r.key.confidence {
                Some(_) => (0, "stops when sure"),
                None => (1, "fixed number"),
            };
            let mut name = format!("{} rows, {how}", r.key.sensing.name());
            if several {
                name.push_str(&format!(", {}, {}", short_label(&r.key.decoder), r.key.learned_from));
            }
            Curve::new(name, style, shade)
        };
        Plot::new(here)
            .x("samples, mean", |r| r.scores.samples.filter(|_| r.scores.attained.is_some()))
            .log_x()
            .y(y_label, |r| Some(1.0 - r.scores.attained?))
            .by(curve)
            .chart(title)
    };
    let image = if left_out { "Image, object left out" } else { "Image" };
    drawn([
        panel("Class", "share of wrong classes", Subject::Class, false),
        panel(image, "1 − IoU", Subject::Image, left_out),
    ])
}

/// What decoders with a fixed number of samples state, and what they attain, over all numbers of samples: a panel of
/// the classes and one of the images.
fn reliability(board: &AnytimeBoard) -> Vec<Chart> {
    let panel = |title: &str, y_label: &str, subject: Subject| {
        let here = board.rows.iter().filter(|r| r.key.subject == subject && r.key.confidence.is_none());
        let keys = unique(here.clone().map(|r| (&*r.key.decoder, r.key.sensing, r.key.left_out, &*r.key.learned_from)));
        let mut points = Vec::new();
        for (at, key) in keys.iter().enumerate() {
            let same =
                |r: &&&AnytimeRow| *key == (&*r.key.decoder, r.key.sensing, r.key.left_out, &*r.key.learned_from);
            let own = here.clone().filter(|r| same(&r)).flat_map(|r| &r.reliability);
            let stroke = Stroke::of(keys[..at].iter().filter(|other| other.0 == key.0).count());
            points.extend(Stated::tenths(own.copied()).into_iter().map(|tenth| (*key, stroke, tenth)));
        }
        let curve =
            |((decoder, sensing, left_out, learned), stroke, _): ((&str, Sensing, bool, &str), Stroke, Stated)| {
                let whose = if left_out { "left out" } else { learned };
                let name = format!("{}, {} rows, {whose}", short_label(decoder), sensing.name());
                Curve::of_decoder(name, decoder, stroke)
            };
        Plot::new(points)
            .x("stated", |(.., tenth)| tenth.stated)
            .y(y_label, |(.., tenth)| tenth.attained)
            .within(0.0, 1.02)
            .by(curve)
            .chart(title)
    };
    drawn([
        panel("Class: a good confidence is on the diagonal", "share of right classes", Subject::Class),
        panel("Image: a good confidence is on the diagonal", "mean IoU", Subject::Image),
    ])
}

/// Images of presses, and the place of the ball, over the time since the touch, by windows alone and in time. Presses
/// are of objects that were left out, where there are such.
fn since_touch(board: &InTimeBoard) -> Vec<Chart> {
    /// A score alone and in time.
    type Both = fn(&InTimeRow) -> [Option<f64>; 2];
    let left_out = board.rows.iter().any(|r| r.left_out);
    let panel = |title: &str, y_label: &str, kind: ContactKind, left_out: bool, both: Both| {
        let here = board.rows.iter().filter(|r| r.contact == kind && r.left_out == left_out);
        let here: Vec<&InTimeRow> = here.collect();
        let sources = unique(here.iter().map(|r| r.learned_from.as_str()));
        let measurements = unique(here.iter().map(|r| r.m));
        let several = sources.len() > 1;
        let mut rows = Vec::new();
        for from in &sources {
            for (m, shade) in measurements.iter().zip(0_u8..) {
                for k in [0, 1] {
                    let own = here.iter().filter(|r| r.m == *m && r.learned_from == *from);
                    rows.extend(own.map(|r| (*r, shade, k)));
                }
            }
        }
        let curve = move |(r, shade, k): (&InTimeRow, u8, usize)| {
            let (how, style) = [("alone", Style::Raster), ("in time", Style::Twin)][k];
            let whose = if several { format!(", {}", r.learned_from) } else { String::new() };
            Curve::new(format!("M = {} {how}{whose}", r.m), style, shade)
        };
        Plot::new(rows)
            .x("time since the touch, ms", |(r, ..)| Some(1e3 * r.since_touch_s?))
            .log_x()
            .y(y_label, move |(r, _, k)| both(r)[k])
            .by(curve)
            .chart(title)
    };
    let presses = if left_out { "Presses, object left out" } else { "Presses" };
    drawn([
        panel(presses, "IoU", ContactKind::Press, left_out, |r| [r.scores.iou_alone, r.scores.iou_in_time]),
        panel("Drops of the ball", "distance of the place, taxels", ContactKind::Drop, false, |r| {
            [r.scores.error_alone_px, r.scores.error_in_time_px]
        }),
    ])
}
