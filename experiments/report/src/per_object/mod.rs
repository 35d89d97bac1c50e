//! Tables and the figure of twin and skin object by object, for `spts compare` and the report.

use crate::figures::{FigureError, Interval, IntervalChart, IntervalPanel, save_intervals};
use crate::{Section, Table};
use spts::output::{OutputError, write_json, write_table};
use spts_eval::decoders::label;
use spts_studies::per_object::{MEASUREMENTS, ObjectBand, PerObjectReport, ReadoutImages, SCORES, ScoreDistance};
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

/// In a word, for the heading of a panel.
fn short_label(score: &str) -> &str {
    match score {
        "class_single" => "class",
        other => score_label(other),
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
            title: format!("{}, {decoder}, M = {m}", short_label(score)),
            intervals: rows.iter().map(interval).collect(),
        }
    };
    let panels = lines
        .iter()
        .flat_map(|(score, decoder)| MEASUREMENTS.map(|m| panel(score, decoder, m)));
    IntervalChart {
        title: format!("Twin and skin, object by object; {} simulated skins", report.skins),
        legend: [
            "twin: mean, and where one more simulated skin lies (90 %)".to_owned(),
            "sensor".to_owned(),
        ],
        panels: panels.collect(),
        rows,
        columns: MEASUREMENTS.len(),
    }
}

/// Section of the report's page.
pub(crate) fn section(report: &PerObjectReport) -> Section {
    Section {
        id: "per_object".to_owned(),
        title: "Twin and skin, object by object".to_owned(),
        lead: format!(
            "{} simulated skins, each with taxels, sessions and noise of its own, press the objects that the skin recorded compressively. Their \
             scores give every object a band in which one more simulated skin lies nine times in ten. The distance of twin and skin is the mean \
             over the objects of |twin − real|: errors of opposite sign do not cancel. “Between skins” is what one of the simulated skins has in \
             place of the real one.",
            report.skins
        ),
        figures: vec![(
            FIGURE.to_owned(),
            "Band and mean of the simulated skins, and the real skin's score; red where it lies outside. “Class” is the share of single windows \
             classified rightly."
                .to_owned(),
        )],
        tables: vec![distances(report), objects(report)],
    }
}

fn distances(report: &PerObjectReport) -> Table {
    let row = |d: &ScoreDistance| {
        vec![
            label(&d.decoder).to_owned(),
            score_label(d.score).to_owned(),
            d.m.to_string(),
            format!("{:.3}", d.mean_abs_difference),
            format!("{:.3}", d.between_skins),
            format!("{:+.3}", d.difference_of_means),
            d.outside.clone(),
        ]
    };
    let header = [
        "decode",
        "score",
        "M",
        "|twin − real|",
        "between skins",
        "means: twin − real",
        "outside",
    ];
    Table {
        caption: "Mean over the objects of |twin − real|, and the difference of their means, in which errors cancel"
            .to_owned(),
        header: header.map(str::to_owned).to_vec(),
        rows: report
            .distances
            .iter()
            .filter(|d| d.images == ReadoutImages::Twin)
            .map(row)
            .collect(),
        file: Some(TABLES[1].to_owned()),
    }
}

fn objects(report: &PerObjectReport) -> Table {
    let row = |b: &ObjectBand| {
        vec![
            label(&b.decoder).to_owned(),
            score_label(b.score).to_owned(),
            b.m.to_string(),
            b.object.clone(),
            format!("{:.3}", b.real),
            format!("{:.3}", b.twin),
            format!("{:.3} – {:.3}", b.low, b.high),
            if b.inside { "" } else { "outside" }.to_owned(),
        ]
    };
    let header = ["decode", "score", "M", "object", "real", "twin", "band", ""];
    Table {
        caption: "Object by object".to_owned(),
        header: header.map(str::to_owned).to_vec(),
        rows: of_twin(report).map(row).collect(),
        file: Some(TABLES[0].to_owned()),
    }
}
