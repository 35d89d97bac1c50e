//! `spts explore` as text, files and figures.

use super::write_all_or_none;
use crate::error::write_parameters;
use crate::figures::{Chart, Curve, Plot, Style, save_charts};
use spts::output::{OutputFolder, write_json};
use spts::provenance::Machine;
use spts_circuit::amplifier::Limit;
use spts_eval::{Cell, Table};
use spts_input::Refusal;
use spts_studies::electronics::ElectronicsStudy;
use spts_studies::explore::{CostFit, ExploreReport, ExploreStudy, ExploreTrial, SizeRow, Way};

/// The results in words.
pub fn text(report: &ExploreReport) -> String {
    let mut out = sizes(report).text();
    if let Ok(designed) = ElectronicsStudy::as_designed() {
        let one_wire = designed.one_wire_text(report.one_wire_taxels);
        out.push_str(&format!("\nas designed, {one_wire}\n"));
    }
    if !report.fits.is_empty() {
        let fits = fits("fits", &report.fits).text();
        out.push_str(&format!("\ncost ∝ taxels^p, p ± one standard error:\n{fits}"));
    }
    out
}

/// Writes the tables, the figures and what they depend on into the folder `out`: all of them, or none.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub fn write(study: &ExploreStudy, report: &ExploreReport, out: OutputFolder) -> Result<(), Refusal> {
    write_all_or_none(out, |out| {
        write_parameters(out, study, study.seed)?;
        sizes(report).write(out)?;
        trials("trials", report)
            .file("wires", |(r, _)| r.wiring.wires)
            .file("measurements", |(_, t)| t.measurements)
            .file("iou", |(_, t)| t.iou)
            .file("located", |(_, t)| t.located)
            .file("bytes", |(_, t)| t.bytes)
            .write(out)?;
        trials("timings", report)
            .file("measurements", |(_, t)| t.measurements)
            .file("decode_s", |(_, t)| t.decode_s)
            .write_csv(&out.timed_path("timings.csv"))?;
        let (timed, others): (Vec<_>, Vec<_>) = report.fits.iter().partition(|fit| fit.is_of_this_machine());
        fits("fits", others).write(out)?;
        write_json(&out.timed_path("timing.json"), &(Machine::here(), fits("timing", timed)))?;
        let figures = out.folder("figures")?;
        save_charts(&charts(report), &figures, "explore")?;
        save_charts(&[timing(report)], &figures, "timing")?;
        Ok(())
    })
}

fn sizes(report: &ExploreReport) -> Table<'_, &SizeRow> {
    Table::new("explore", &report.rows)
        .column("taxels", "taxels", |r| r.taxels)
        .file("contacts", |r| r.contacts)
        .file("way", |r| Cell::name_of(r.wiring.way))
        .shown("readout", |r| r.wiring.way.name())
        .column("wires", "wires", |r| r.wiring.wires)
        .file("limit", |r| r.wiring.limit.map_or("", Limit::name))
        .shown("fails by", |r| r.wiring.limit.map(Limit::name))
        .file("feedback_ohm", |r| r.wiring.feedback_ohm)
        .file("noise_gain", |r| r.wiring.noise_gain)
        .file("settle_s", |r| r.wiring.settle_s)
        .column("period_s", "period", |r| r.wiring.period_s)
        .unit("µs", 1e6)
        .digits(1)
        .file("steps_per_taxel", |r| r.wiring.steps_per_taxel)
        .column("m_iou", "M, IoU .8", |r| r.m_iou)
        .shown("M/N", |r| r.m_iou.map(|m| m as f64 / r.taxels as f64))
        .unit("%", 100.0)
        .digits(2)
        .column("m_located", "M, 1 px", |r| r.m_located)
        .column("best_iou", "best IoU", SizeRow::best_iou)
        .digits(3)
        .column("acquire_s", "acquire", |r| r.acquire_s)
        .unit("ms", 1e3)
        .digits(2)
        .column("raster_s", "raster", |r| r.raster_s)
        .unit("ms", 1e3)
        .digits(1)
        .shown("decode", |r| r.deciding().map(|t| t.decode_s))
        .unit("ms", 1e3)
        .digits(1)
        .file("bytes", |r| r.deciding().map(|t| t.bytes))
        .shown("MB", |r| r.deciding().map(|t| t.bytes as f64 / 1e6))
        .digits(1)
}

/// A line for every number of measurements that was tried.
fn trials<'a>(name: &str, report: &'a ExploreReport) -> Table<'a, (&'a SizeRow, &'a ExploreTrial)> {
    let tried = report.rows.iter().flat_map(|r| r.trials.iter().map(move |t| (r, t)));
    Table::new(name, tried).file("taxels", |(r, _)| r.taxels).file("way", |(r, _)| Cell::name_of(r.wiring.way))
}

fn fits<'a>(name: &str, fits: impl IntoIterator<Item = &'a CostFit>) -> Table<'a, &'a CostFit> {
    Table::new(name, fits)
        .file("way", |f| Cell::name_of(f.way))
        .shown("readout", |f| f.way.name())
        .column("cost", "cost", |f| f.cost)
        .file("exponent", |f| f.law.exponent)
        .shown("p", |f| format!("{:.2} ± {:.2}", f.law.exponent, f.law.exponent_se))
        .file("exponent_se", |f| f.law.exponent_se)
        .file("prefactor", |f| f.law.prefactor)
        .column("points", "sizes", |f| f.law.points)
}

/// One quantity of every readout over the number of taxels.
fn panel(report: &ExploreReport, title: &str, y_label: &str, value: fn(&SizeRow) -> Option<f64>) -> Chart {
    let rows = Way::ALL.into_iter().flat_map(|way| report.rows.iter().filter(move |r| r.wiring.way == way));
    let curve = |r: &SizeRow| {
        let style = match r.wiring.way {
            Way::Ideal => Style::Baseline,
            Way::AsDesigned => Style::Real,
            Way::Fitted => Style::Raster,
            Way::Wires => Style::Twin,
        };
        Curve::new(r.wiring.way.name(), style, 0)
    };
    Plot::new(rows).x("taxels", |r| r.taxels as f64).log_x().y(y_label, value).log_y().by(curve).chart(title)
}

/// Measurements, acquisition and memory: nothing that depends on the machine.
fn charts(report: &ExploreReport) -> Vec<Chart> {
    let near = "Measurements for 95 % of the contacts within 1 px";
    vec![
        panel(report, "Measurements for an IoU of 0.8", "measurements", |r| r.m_iou.map(|m| m as f64)),
        panel(report, near, "measurements", |r| r.m_located.map(|m| m as f64)),
        panel(report, "Acquisition for an IoU of 0.8", "time, ms", |r| r.acquire_s.map(|s| s * 1e3)),
        panel(report, "Scan of every taxel, for comparison", "time, ms", |r| Some(r.raster_s * 1e3)),
        panel(report, "Memory of the decoder", "MB", |r| r.m_iou.and(r.deciding()).map(|t| t.bytes as f64 / 1e6)),
    ]
}

/// Time of decoding, on this machine.
fn timing(report: &ExploreReport) -> Chart {
    panel(report, "Decoding for an IoU of 0.8", "time, s", |r| r.m_iou.and(r.deciding()).map(|t| t.decode_s))
}
