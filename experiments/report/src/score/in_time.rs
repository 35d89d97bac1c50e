//! Images of presses, and the place of the ball, over the time since the touch: windows alone and in time.

use crate::figures::{Chart, FigureError, Series, Style, save_charts};
use spts_eval::in_time::{ContactKind, InTimeBoard, InTimeRow};
use spts_eval::unique;
use std::path::Path;

/// Writes `in_time` as .svg and .png: a panel of the rise of presses and one of drops. Presses are of objects that
/// were left out, where there are such.
///
/// # Errors
/// [`FigureError`].
pub(super) fn draw(board: &InTimeBoard, folder: &Path) -> Result<(), FigureError> {
    let left_out = board.rows.iter().any(|r| r.left_out);
    let images = if left_out { ", object left out" } else { "" };
    let presses = panel(board, ContactKind::Press, left_out, |r| {
        [r.scores.iou_alone, r.scores.iou_in_time]
    });
    let drops = panel(board, ContactKind::Drop, false, |r| {
        [r.scores.error_alone_px, r.scores.error_in_time_px]
    });
    let mut charts = vec![
        Chart {
            title: format!("Presses{images}"),
            y_label: "IoU".to_owned(),
            ..presses
        },
        Chart {
            title: "Drops of the ball".to_owned(),
            y_label: "distance of the place, taxels".to_owned(),
            ..drops
        },
    ];
    charts.retain(|chart| !chart.series.is_empty());
    save_charts(&charts, folder, "in_time")
}

/// Curves of one kind of contact: for every M, windows alone and in time.
fn panel(
    board: &InTimeBoard,
    kind: ContactKind,
    left_out: bool,
    values: impl Fn(&InTimeRow) -> [Option<f64>; 2],
) -> Chart {
    let here = board
        .rows
        .iter()
        .filter(|r| r.contact == kind && r.left_out == left_out);
    let rows: Vec<&InTimeRow> = here.collect();
    let sources = unique(rows.iter().map(|r| r.learned_from.as_str()));
    let mut series = Vec::new();
    for from in &sources {
        for (m, shade) in unique(rows.iter().map(|r| r.m)).into_iter().zip(0_u8..) {
            let own = rows.iter().filter(|r| r.m == m && r.learned_from == *from);
            let own: Vec<&&InTimeRow> = own.collect();
            let whose = if sources.len() > 1 {
                format!(", {from}")
            } else {
                String::new()
            };
            for (k, (how, style)) in [("alone", Style::Raster), ("in time", Style::Twin)]
                .into_iter()
                .enumerate()
            {
                let point = |r: &&&InTimeRow| Some((1e3 * r.since_touch_s?, values(r)[k]?));
                let points: Vec<(f64, f64)> = own.iter().filter_map(point).collect();
                series.push(Series::new(format!("M = {m} {how}{whose}"), style, shade, points));
            }
        }
    }
    series.retain(|series| !series.points.is_empty());
    Chart {
        x_label: "time since the touch, ms".to_owned(),
        x_log: true,
        series,
        ..Chart::default()
    }
}
