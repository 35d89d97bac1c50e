//! Samples that are needed against the error, with random and with chosen rows.

use crate::figures::{Chart, FigureError, Series, Style, save_charts};
use spts_eval::Sensing;
use spts_eval::algorithm::Subject;
use spts_eval::anytime::{AnytimeBoard, AnytimeRow};
use spts_eval::decoders::short_label;
use spts_eval::unique;
use std::path::Path;

/// Writes `anytime` as .svg and .png: a panel of the classes and one of the images. Images are those of objects that
/// were left out, where there are such.
///
/// # Errors
/// [`FigureError`].
pub(super) fn draw(board: &AnytimeBoard, folder: &Path) -> Result<(), FigureError> {
    let left_out = board.rows.iter().any(|r| r.left_out);
    let images = if left_out { ", object left out" } else { "" };
    let charts = [
        ("Class", "share of wrong classes", Subject::Class, false),
        ("Image", "1 − IoU", Subject::Image, left_out),
    ];
    let charts = charts.map(|(title, y_label, subject, left_out)| {
        let here = board
            .rows
            .iter()
            .filter(|r| r.subject == subject && r.left_out == left_out);
        let series = series(&here.collect::<Vec<_>>());
        let more = if subject == Subject::Image { images } else { "" };
        Chart {
            title: format!("{title}{more}"),
            x_label: "samples, mean".to_owned(),
            y_label: y_label.to_owned(),
            x_log: true,
            series,
            ..Chart::default()
        }
    });
    let mut charts = charts.to_vec();
    charts.retain(|chart| !chart.series.is_empty());
    save_charts(&charts, folder, "anytime")
}

/// Curves of rows of one subject: for either kind of rows those that stop, and those with a fixed number of samples.
fn series(rows: &[&AnytimeRow]) -> Vec<Series> {
    let kinds = unique(rows.iter().map(|r| {
        (
            r.decoder.as_str(),
            r.learned_from.as_str(),
            r.sensing,
            r.confidence.is_some(),
        )
    }));
    let several = unique(kinds.iter().map(|kind| (kind.0, kind.1))).len() > 1;
    let each = kinds.iter().map(|kind @ (decoder, from, sensing, stops)| {
        let same = |r: &&&AnytimeRow| {
            (
                r.decoder.as_str(),
                r.learned_from.as_str(),
                r.sensing,
                r.confidence.is_some(),
            ) == *kind
        };
        let point = |r: &&AnytimeRow| Some((r.scores.samples?, 1.0 - r.scores.attained?));
        let points = rows.iter().filter(same).filter_map(point).collect();
        let style = match sensing {
            Sensing::Random => Style::Twin,
            Sensing::Chosen => Style::Raster,
        };
        let shade = if *stops { 0 } else { 1 };
        let how = if *stops { "stops when sure" } else { "fixed number" };
        let whose = if several {
            format!(", {}, {from}", short_label(decoder))
        } else {
            String::new()
        };
        Series::new(format!("{} rows, {how}{whose}", sensing.name()), style, shade, points)
    });
    each.filter(|series: &Series| !series.points.is_empty()).collect()
}
