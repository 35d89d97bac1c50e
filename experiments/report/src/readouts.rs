//! `spts readouts` as text, files and figures.

use super::write_all_or_none;
use crate::error::write_parameters;
use crate::figures::{Chart, Claim, Curve, Plot, Style, save_charts};
use spts::output::{OutputFolder, write_bytes, write_json, write_table};
use spts_eval::Table;
use spts_input::Refusal;
use spts_recon::statistics::Band;
use spts_studies::readouts::{GOOD_IOU, READOUTS, ReadoutRow, ReadoutTrial, ReadoutsReport, ReadoutsStudy};

/// A line of the table: a readout with a number of measurements, and how long a measurement takes, s.
type Line<'a> = (&'a ReadoutRow, &'a ReadoutTrial, f64);

/// Writes the tables, the figure and what they depend on into the folder `out`: all of them, or none.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub fn write(study: &ReadoutsStudy, report: &ReadoutsReport, out: OutputFolder) -> Result<(), Refusal> {
    write_all_or_none(out, |out| {
        write_parameters(out, &study.parameters(), study.seed)?;
        table(lines(report)).write(out)?;
        write_table(&out.path("published.csv"), report.published)?;
        write_json(&out.path("readouts.json"), report)?;
        write_bytes(&out.path("readouts.md"), text(report).as_bytes())?;
        save_charts(&charts(report), &out.folder("figures")?, "readouts")?;
        Ok(())
    })
}

/// The results in words: one table for each size.
pub fn text(report: &ReadoutsReport) -> String {
    let mut out = String::new();
    for wire in &report.wires {
        let own = lines(report).filter(|(row, ..)| row.taxels == wire.taxels);
        out.push_str(&format!(
            "{} taxels, {:.2} µs a measurement\n\n{}\n",
            wire.taxels,
            1e6 * wire.period_s,
            table(own).text()
        ));
    }
    out.push_str(&format!(
        "Marked like **this** is, for every readout, the smallest M with a mean IoU of {GOOD_IOU} or, if there is none, \
         the M with the largest IoU. The number after ± is half the width of the 90 % band over the repetitions.\n"
    ));
    out
}

fn lines(report: &ReadoutsReport) -> impl Iterator<Item = Line<'_>> {
    let period_s = |row: &ReadoutRow| {
        let wire = report.wires.iter().find(|wire| wire.taxels == row.taxels);
        wire.map_or(0.0, |wire| wire.period_s)
    };
    let of_row = move |row| {
        let period_s = period_s(row);
        row.trials.iter().map(move |trial| (row, trial, period_s))
    };
    report.rows.iter().flat_map(of_row)
}

fn table<'a>(lines: impl Iterator<Item = Line<'a>>) -> Table<'a, Line<'a>> {
    let marked = |(row, trial, _): Line<'_>| {
        let mark = if row.deciding() == Some(trial) { "**" } else { "" };
        format!("{mark}{}{mark}", trial.measurements)
    };
    let table = Table::new("readouts", lines)
        .file("readout", |(r, ..)| r.readout)
        .shown("readout", |(r, ..)| r.label)
        .column("wires", "wires", |(r, ..)| r.wires)
        .file("taxels", |(r, ..)| r.taxels)
        .file("period_s", |(.., period_s)| period_s)
        .column("feedback_ohm", "Rf", |(r, ..)| r.feedback_ohm)
        .unit("kΩ", 1e-3)
        .digits(2)
        .file("measurements", |(_, t, _)| t.measurements)
        .shown("M", marked)
        .column("frames_hz", "images/s", |(_, t, _)| t.frames_hz)
        .digits(0);
    let table = banded(table, ("iou", "IoU", 1.0, 2), |t| t.iou);
    let table = banded(table, ("place_px", "place, px", 1.0, 2), |t| t.place_px);
    let table = banded(table, ("accuracy", "class", 1.0, 2), |t| t.accuracy);
    let table = banded(table, ("noticed_s", "touch noticed, ms", 1e3, 3), |t| t.noticed_s);
    let table = banded(table, ("placed_s", "and placed, ms", 1e3, 2), |t| t.placed_s);
    table
        .column("lost", "no image", |(_, t, _)| t.lost)
        .unit("%", 100.0)
        .digits(0)
        .column("unnoticed", "not noticed", |(_, t, _)| t.unnoticed)
        .unit("%", 100.0)
        .digits(0)
}

/// Adds a mean with its band: three columns of the file, and "0.87 ± 0.03" for readers, scaled and with so many digits.
fn banded<'a>(
    table: Table<'a, Line<'a>>,
    (key, head, scale, digits): (&str, &str, f64, usize),
    band: fn(&ReadoutTrial) -> Option<Band>,
) -> Table<'a, Line<'a>> {
    let shown = move |b: Band| {
        let half = 0.5 * (b.high - b.low);
        format!("{:.digits$} ± {:.digits$}", scale * b.mean, scale * half)
    };
    table
        .file(key, move |(_, t, _)| band(t).map(|b| b.mean))
        .interval(key, move |(_, t, _)| band(t).map(|b| [b.low, b.high]))
        .shown(head, move |(_, t, _)| band(t).map(shown))
}

/// Image and class over the number of measurements, size after size; then rate, latency and place over the number of
/// taxels.
fn charts(report: &ReadoutsReport) -> Vec<Chart> {
    let over_measurements = |what: &str, y_label: &str, value: fn(&ReadoutTrial) -> Option<Band>| {
        Plot::new(lines(report))
            .x("measurements M", |(_, t, _)| t.measurements as f64)
            .log_x()
            .y(y_label, move |(_, t, _)| value(t).map(|b| b.mean))
            .within(0.0, 1.0)
            .band(move |(_, t, _)| value(t).map(|b| (b.low, b.high)))
            .by(|(row, ..)| curve(row))
            .facets(|(row, ..)| format!("{what}, {} taxels", row.taxels))
    };
    let over_taxels = |title: &str, y_label: &str, value: fn(&ReadoutRow) -> Option<Band>, scale: f64| {
        Plot::new(&report.rows)
            .x("taxels", |row| row.taxels as f64)
            .log_x()
            .y(y_label, move |row| value(row).map(|b| scale * b.mean))
            .log_y()
            .band(move |row| value(row).map(|b| (scale * b.low, scale * b.high)))
            .by(curve)
            .chart(title)
    };
    let published = report.published.iter().map(|system| Claim {
        label: system.name.to_owned(),
        x: Some(system.taxels as f64),
        y: Some(system.frames_hz),
    });
    let rate = |row: &ReadoutRow| {
        let hz = row.deciding().filter(|t| t.is_good())?.frames_hz;
        Some(Band::around(hz, 0.0))
    };
    let mut charts = over_measurements("Image", "IoU", |t| t.iou);
    charts.extend(over_measurements("17 objects", "share named rightly", |t| t.accuracy));
    charts.push(Chart {
        published: published.collect(),
        ..over_taxels(&format!("Rate of images with IoU ≥ {GOOD_IOU}"), "images a second", rate, 1.0)
    });
    let placed = |row: &ReadoutRow| row.deciding()?.placed_s;
    charts.push(over_taxels("From a touch to its place", "time, ms", placed, 1e3));
    let place = |row: &ReadoutRow| row.deciding()?.place_px;
    charts.push(over_taxels("Error of the place", "taxels", place, 1.0));
    charts
}

/// The curve of a readout: its ink is its place in the table, the same in every panel.
fn curve(row: &ReadoutRow) -> Curve {
    let place = READOUTS.iter().position(|line| line.name == row.readout);
    let ink = place.and_then(|place| u8::try_from(place).ok()).unwrap_or(0);
    Curve::new(row.label, Style::Alternative, ink)
}
