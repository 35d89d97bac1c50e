//! The board as curves, over measurements and over wall time.

use crate::figures::{Chart, FigureError, Series, Stroke, save_charts};
use spts_eval::board::{BoardRow, ScoreBoard};
use spts_eval::decoders::short_label;
use spts_eval::place::{PlaceRow, locator_label};
use spts_eval::unique;
use std::path::Path;

/// Writes `reconstruction`, `classification` and, with a ball, `localisation`, each as .svg and .png.
///
/// # Errors
/// [`FigureError`].
pub(super) fn draw(board: &ScoreBoard, folder: &Path) -> Result<(), FigureError> {
    let closed = |r: &&BoardRow| !r.left_out;
    let mut reconstruction = vec![
        scores(board, "IoU, learned objects", "IoU", Over::M, &closed, |r| r.scores.iou),
        scores(
            board,
            "The same over acquisition + decode",
            "",
            Over::Time,
            &closed,
            |r| r.scores.iou,
        ),
    ];
    if board.rows.iter().any(|r| r.left_out) {
        let left_out = |r: &&BoardRow| r.left_out;
        reconstruction.push(scores(board, "IoU, object left out", "IoU", Over::M, &left_out, |r| {
            r.scores.iou
        }));
    }
    save_charts(&drawn(reconstruction), folder, "reconstruction")?;
    let classes = vec![
        scores(board, "Single windows", "classified correctly", Over::M, &closed, |r| {
            r.scores.class_single
        }),
        scores(
            board,
            "The same over acquisition + decode",
            "",
            Over::Time,
            &closed,
            |r| r.scores.class_single,
        ),
        scores(
            board,
            "Votes of 20 windows",
            "classified correctly",
            Over::M,
            &closed,
            |r| r.scores.class_vote20,
        ),
    ];
    save_charts(&drawn(classes), folder, "classification")?;
    if ball(board).next().is_none() {
        return Ok(());
    }
    save_charts(&localisation(board), folder, "localisation")
}

/// The charts with a curve; without times, those over time have none.
fn drawn(mut charts: Vec<Chart>) -> Vec<Chart> {
    charts.retain(|chart| !chart.series.is_empty());
    charts
}

/// Horizontal axis.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Over {
    M,
    Time,
}

fn scores(
    board: &ScoreBoard,
    title: &str,
    y_label: &str,
    over: Over,
    kept: &dyn Fn(&&BoardRow) -> bool,
    get: fn(&BoardRow) -> Option<f64>,
) -> Chart {
    let point = |r: &BoardRow| {
        let x = match over {
            Over::M => r.m as f64,
            Over::Time => r.acquire_us + r.decode_us?,
        };
        Some((x, get(r)?))
    };
    let rows: Vec<&BoardRow> = board.rows.iter().filter(kept).collect();
    let names = unique(board.rows.iter().map(|r| r.decoder.as_str()));
    let sources = |name: &str| {
        unique(
            rows.iter()
                .filter(|r| r.decoder == name)
                .map(|r| (r.learned_from.as_str(), r.sensing)),
        )
    };
    let mut series = Vec::new();
    for name in &names {
        let sources = sources(name);
        for (k, (from, sensing)) in sources.iter().enumerate() {
            let same = |r: &&&BoardRow| r.decoder == *name && r.learned_from == *from && r.sensing == *sensing;
            let points: Vec<(f64, f64)> = rows.iter().filter(same).filter_map(|r| point(r)).collect();
            let mut words = short_label(name).to_owned();
            if sources.iter().any(|(other, _)| other != from) {
                words.push_str(&format!(", {from}"));
            }
            if sources.iter().any(|(_, other)| other != sensing) {
                words.push_str(&format!(", {} rows", sensing.name()));
            }
            if !points.is_empty() {
                series.push(Series::of_decoder(words, name, Stroke::of(k), points));
            }
        }
    }
    Chart {
        title: title.to_owned(),
        x_label: match over {
            Over::M => "measurements M".to_owned(),
            Over::Time => "time, µs".to_owned(),
        },
        y_label: y_label.to_owned(),
        x_log: true,
        y_log: false,
        y_range: Some((0.0, 1.02)),
        series,
        ..Chart::default()
    }
}

/// Rows of the bouncing ball.
fn ball(board: &ScoreBoard) -> impl Iterator<Item = &PlaceRow> {
    board.localisation.iter().filter(|row| row.contact == "ball")
}

fn localisation(board: &ScoreBoard) -> Vec<Chart> {
    let kinds = unique(ball(board).map(|row| (row.decoder.as_str(), row.relabelled)));
    let chart = |title: &str, y_label: &str, get: fn(&PlaceRow) -> f64, range| {
        let series = kinds.iter().map(|(name, relabelled)| {
            let of = ball(board);
            let rows = of.filter(|r| r.decoder == *name && r.relabelled == *relabelled);
            let points = rows.map(|r| (r.m as f64, get(r))).collect();
            let taxels = if *relabelled { ", relabelled" } else { "" };
            let stroke = Stroke::of(usize::from(*relabelled));
            Series::of_decoder(format!("{}{taxels}", locator_label(name)), name, stroke, points)
        });
        Chart {
            title: title.to_owned(),
            x_label: "measurements M".to_owned(),
            y_label: y_label.to_owned(),
            y_range: range,
            series: series.collect(),
            ..Chart::default()
        }
    };
    vec![
        chart("Distance from the true centre", "mean, taxels", |r| r.mean_px, None),
        chart(
            "Windows within one taxel",
            "share",
            |r| r.share_under_1px,
            Some((0.0, 1.02)),
        ),
    ]
}
