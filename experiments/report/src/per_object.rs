//! Tables and the figure of twin and skin object by object, for `spts compare` and the report.

use crate::figures::{FigureError, Interval, IntervalChart, IntervalLine, IntervalPanel, save_intervals};
use crate::labels::{object_label, object_list};
use crate::{PageFigure, PageTable, Section};
use spts::output::{OutputError, write_json, write_table};
use spts_eval::Table;
use spts_eval::decoders::label;
use spts_studies::per_object::{MEASUREMENTS, ObjectBand, PerObjectReport, ReadoutImages, SCORES};
use std::path::Path;

/// Name of the figure.
pub(crate) const FIGURE: &str = "per_object";
/// Tables, in the folder they are written to.
pub(crate) const TABLES: [&str; 3] = ["per_object.csv", "per_object_distances.csv", "per_object.json"];

/// Writes [`TABLES`], each to the path that `path` gives its name.
pub(crate) fn write_tables(
    report: &PerObjectReport,
    path: impl Fn(&str) -> std::path::PathBuf,
) -> Result<(), OutputError> {
    write_table(&path(TABLES[0]), &report.objects)?;
    write_table(&path(TABLES[1]), &report.distances)?;
    write_json(&path(TABLES[2]), report)
}

/// Draws the bands of the twin and the marks of the skin into `folder`: a line of panels a score and decoder, a panel
/// an M, a row an object.
pub(crate) fn draw(report: &PerObjectReport, folder: &Path) -> Result<(), FigureError> {
    save_intervals(&chart(report), folder, FIGURE)
}

/// In words.
fn score_label(score: &str) -> &str {
    match score {
        "iou" => "IoU",
        "class_single" => "single windows classified",
        other => other,
    }
}

fn of_twin(report: &PerObjectReport) -> impl Iterator<Item = &ObjectBand> {
    report.objects.iter().filter(|b| b.images == ReadoutImages::Twin)
}

fn chart(report: &PerObjectReport) -> IntervalChart {
    let mut rows: Vec<String> = Vec::new();
    let mut lines: Vec<(&str, &str)> = Vec::new();
    for band in of_twin(report) {
        if !rows.contains(&band.object) {
            rows.push(band.object.clone());
        }
        if !lines.contains(&(band.score, &band.decoder)) {
            lines.push((band.score, &band.decoder));
        }
    }
    lines.sort_by_key(|(score, _)| SCORES.iter().position(|(name, _)| name == score));
    let panel = |score: &str, decoder: &str, m: usize| {
        let interval = |object: &String| {
            let same = |b: &&ObjectBand| b.score == score && b.decoder == decoder && b.m == m && b.object == *object;
            of_twin(report).find(same).map(|b| Interval {
                low: b.low,
                middle: b.twin,
                high: b.high,
                mark: b.real,
            })
        };
        IntervalPanel {
            title: format!("M = {m}"),
            intervals: rows.iter().map(interval).collect(),
        }
    };
    let line = |(score, decoder): &(&str, &str)| IntervalLine {
        title: format!("{}, {}", label(decoder), score_label(score)),
        panels: MEASUREMENTS.map(|m| panel(score, decoder, m)).into(),
    };
    IntervalChart {
        title: format!("Twin and real skin, object by object; {} simulated skins", report.skins),
        legend: [
            "twin: mean, and where one more simulated skin lies (90 %)".to_owned(),
            "real skin".to_owned(),
        ],
        rows: rows.iter().map(|name| object_label(name).to_owned()).collect(),
        lines: lines.iter().map(line).collect(),
    }
}

/// Distances, then a line an object, as text tables.
#[must_use]
pub fn text(report: &PerObjectReport) -> String {
    let distances = spts_eval::Table::new("distances", &report.distances)
        .shown("images", |d| d.images.label())
        .shown("decoder", |d| &d.decoder)
        .shown("M", |d| d.m)
        .shown("score", |d| d.score)
        .shown("|twin − real|", |d| d.mean_abs_difference)
        .digits(3)
        .shown("between skins", |d| d.between_skins)
        .digits(3)
        .shown("means, twin − real", |d| format!("{:+.3}", d.difference_of_means))
        .shown("outside the 90 % band", |d| {
            if d.outside.is_empty() { "none" } else { &d.outside }
        });
    let objects = spts_eval::Table::new("objects", &report.objects)
        .shown("images", |b| b.images.label())
        .shown("decoder", |b| &b.decoder)
        .shown("M", |b| b.m)
        .shown("score", |b| b.score)
        .shown("object", |b| &b.object)
        .shown("real", |b| b.real)
        .digits(3)
        .shown("twin", |b| b.twin)
        .digits(3)
        .shown("90 % band", |b| format!("{:.3} – {:.3}", b.low, b.high))
        .shown("", |b| if b.inside { "" } else { "outside" });
    format!(
        "mean over the objects of |twin − real|, twin: mean of {} simulated skins\n{}\n{}",
        report.skins,
        distances.text(),
        objects.text().trim_end()
    )
}

/// Section of the report's page.
pub(crate) fn section(report: &PerObjectReport) -> Section {
    Section {
        id: "per_object".to_owned(),
        title: "Twin and real skin".to_owned(),
        lead: format!(
            "{} simulated skins, each with taxels, mounting and noise of its own, feel the objects that the real skin recorded in compressed \
             form. Their scores give every object a band in which one more simulated skin lies nine times in ten. The distance of twin and \
             real skin is the mean over the objects of |twin − real|, in which errors of opposite sign do not cancel. “Between skins” is the \
             distance of one simulated skin from the others: the real skin cannot be expected to be closer.",
            report.skins
        ),
        figures: vec![PageFigure::new(
            FIGURE,
            "Panels by decoder and number of measurements: for every object a blue band of the simulated skins and a mark for the real skin.",
            "Scores object by object. Blue: band and mean of the simulated skins. Circle: the real skin, a red square where it lies \
             outside the band. “IoU” is the overlap of decoded and true contact, “single windows classified” the share of them that \
             are classified correctly."
                .to_owned(),
        )],
        tables: vec![distances(report), objects(report)],
    }
}

fn distances(report: &PerObjectReport) -> PageTable {
    let rows = report.distances.iter().filter(|d| d.images == ReadoutImages::Twin);
    let table = Table::new("", rows)
        .shown("decoder", |d| label(&d.decoder))
        .shown("score", |d| score_label(d.score))
        .shown("M", |d| d.m)
        .shown("|twin − real|", |d| d.mean_abs_difference)
        .digits(3)
        .shown("between skins", |d| d.between_skins)
        .digits(3)
        .shown("means: twin − real", |d| format!("{:+.3}", d.difference_of_means))
        .shown("outside", |d| object_list(&d.outside));
    let caption = "Mean over the objects of |twin − real|, and the difference of their means, in which errors cancel";
    PageTable::new(caption, &table, TABLES[1])
}

fn objects(report: &PerObjectReport) -> PageTable {
    let table = Table::new("", of_twin(report))
        .shown("decoder", |b| label(&b.decoder))
        .shown("score", |b| score_label(b.score))
        .shown("M", |b| b.m)
        .shown("object", |b| object_label(&b.object))
        .shown("real skin", |b| b.real)
        .digits(3)
        .shown("twin, mean", |b| b.twin)
        .digits(3)
        .shown("band", |b| format!("{:.3} – {:.3}", b.low, b.high))
        .shown("", |b| if b.inside { "" } else { "outside" });
    PageTable::new("Scores object by object", &table, TABLES[0])
}
