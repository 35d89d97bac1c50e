//! Tables and the figure of twin and skin object by object, for `spts compare` and the report.

use crate::figures::{Interval, IntervalChart, IntervalLine, IntervalPanel, save_intervals};
use crate::labels::{object_label, object_list, score_label};
use crate::{PageFigure, PageTable, Section};
use serde::Serialize;
use spts::output::write_json;
use spts_eval::decoders::label;
use spts_eval::{Cell, Table, unique};
use spts_input::Refusal;
use spts_studies::compare::Banded;
use spts_studies::per_object::{MEASUREMENTS, ObjectBand, PerObjectReport, ReadoutImages, SCORES, ScoreDistance};
use std::path::{Path, PathBuf};

/// Name of the figure.
pub(crate) const FIGURE: &str = "per_object";
/// Tables, in the folder they are written to.
pub(crate) const TABLES: [&str; 3] = ["per_object.csv", "per_object_distances.csv", "per_object.json"];

/// Adds a value of the real skin and the band of the twins.
pub(crate) fn banded<'a, R: Copy + 'a>(
    table: Table<'a, R>,
    digits: usize,
    of: impl Fn(R) -> Banded + Copy + 'a,
) -> Table<'a, R> {
    table
        .column("real", "real skin", move |row| of(row).real)
        .digits(digits)
        .column("twin", "twin, mean", move |row| of(row).twin)
        .digits(digits)
        .file("low", move |row| of(row).low)
        .file("high", move |row| of(row).high)
        .shown("90 % band", move |row| format!("{:.digits$} – {:.digits$}", of(row).low, of(row).high))
}

/// Adds whether the real value lies in the band; nothing is said of a band without a width.
pub(crate) fn marked<'a, R: Copy + 'a>(table: Table<'a, R>, of: impl Fn(R) -> Banded + Copy + 'a) -> Table<'a, R> {
    table.named(
        "inside",
        "",
        move |row| of(row).inside(),
        |inside| match inside {
            Some(true) => "",
            Some(false) => "outside",
            None => "twins are equal",
        },
    )
}

/// What is written as JSON.
#[derive(Serialize)]
pub(crate) struct Printed<'a> {
    skins: u64,
    distances: Table<'a, &'a ScoreDistance>,
    objects: Table<'a, &'a ObjectBand>,
}

/// What is written as JSON.
pub(crate) fn json(report: &PerObjectReport) -> Printed<'_> {
    Printed { skins: report.skins, distances: distances(report), objects: objects(report) }
}

/// Writes [`TABLES`], each to the path that `path` gives its name.
pub(crate) fn write_tables(report: &PerObjectReport, path: impl Fn(&str) -> PathBuf) -> Result<(), Refusal> {
    objects(report).write_csv(&path(TABLES[0]))?;
    distances(report).write_csv(&path(TABLES[1]))?;
    write_json(&path(TABLES[2]), &json(report))
}

fn distances(report: &PerObjectReport) -> Table<'_, &ScoreDistance> {
    with_images(Table::new("distances", &report.distances), report, |d| d.images)
        .named("decoder", "decoder", |d| d.decoder.as_str(), label)
        .column("m", "M", |d| d.m)
        .named("score", "score", |d| d.score, score_label)
        .column("mean_abs_difference", "|twin − real|", |d| d.mean_abs_difference)
        .digits(3)
        .column("between_skins", "between skins", |d| d.between_skins)
        .digits(3)
        .file("difference_of_means", |d| d.difference_of_means)
        .shown("means, twin − real", |d| format!("{:+.3}", d.difference_of_means))
        .file("objects", |d| d.objects)
        .named("outside", "outside the 90 % band", |d| d.outside.as_str(), object_list)
}

fn objects(report: &PerObjectReport) -> Table<'_, &ObjectBand> {
    let table = with_images(Table::new("objects", &report.objects), report, |b| b.images)
        .named("decoder", "decoder", |b| b.score.decoder.as_str(), label)
        .column("m", "M", |b| b.score.m)
        .named("score", "score", |b| b.score.score, score_label)
        .named("object", "object", |b| b.score.object.as_str(), object_label);
    let table = banded(table, 3, |b| b.of).file("difference", |b| b.of.difference());
    marked(table, |b| b.of)
}

/// The images of the twin's recordings; readers see them where there are several.
fn with_images<'a, R: Copy + 'a>(
    table: Table<'a, R>,
    report: &PerObjectReport,
    images: impl Fn(R) -> ReadoutImages + Copy + 'a,
) -> Table<'a, R> {
    let table = table.file("images", move |row| Cell::name_of(images(row)));
    if unique(report.objects.iter().map(|b| b.images)).len() < 2 {
        return table;
    }
    table.shown("images", move |row| images(row).label())
}

/// Draws the bands of the twin and the marks of the skin into `folder`: a line of panels a score and decoder, a panel
/// an M, a row an object.
pub(crate) fn draw(report: &PerObjectReport, folder: &Path) -> Result<(), Refusal> {
    save_intervals(&chart(report), folder, FIGURE)
}

/// Distances, then a line an object, as text tables.
pub fn text(report: &PerObjectReport) -> String {
    format!(
        "mean over the objects of |twin − real|, twin: mean of {} simulated skins\n{}\n{}",
        report.skins,
        distances(report).text(),
        objects(report).text().trim_end()
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
        tables: vec![
            PageTable::new(
                "Mean over the objects of |twin − real|, and the difference of their means, in which errors cancel",
                &distances(report),
                TABLES[1],
            ),
            PageTable::new("Scores object by object", &objects(report), TABLES[0]),
        ],
    }
}

fn chart(report: &PerObjectReport) -> IntervalChart {
    let twin: Vec<&ObjectBand> = report.objects.iter().filter(|b| b.images == ReadoutImages::Twin).collect();
    let rows = unique(twin.iter().map(|b| b.score.object.as_str()));
    let mut lines = unique(twin.iter().map(|b| (b.score.score, b.score.decoder.as_str())));
    lines.sort_by_key(|(score, _)| SCORES.iter().position(|(name, _)| name == score));
    let panel = |score: &str, decoder: &str, m: usize| {
        let interval = |object: &&str| {
            let key = (score, decoder, m, *object);
            let same = |b: &&&ObjectBand| (b.score.score, &*b.score.decoder, b.score.m, &*b.score.object) == key;
            twin.iter().find(same).map(|b| Interval {
                low: b.of.low,
                middle: b.of.twin,
                high: b.of.high,
                mark: b.of.real,
            })
        };
        IntervalPanel { title: format!("M = {m}"), intervals: rows.iter().map(interval).collect() }
    };
    let line = |(score, decoder): (&str, &str)| IntervalLine {
        title: format!("{}, {}", label(decoder), score_label(score)),
        panels: MEASUREMENTS.map(|m| panel(score, decoder, m)).into(),
    };
    IntervalChart {
        title: format!("Twin and real skin, object by object; {} simulated skins", report.skins),
        legend: ["twin: mean, and where one more simulated skin lies (90 %)".to_owned(), "real skin".to_owned()],
        rows: rows.iter().map(|name| object_label(name).to_owned()).collect(),
        lines: lines.into_iter().map(line).collect(),
    }
}
