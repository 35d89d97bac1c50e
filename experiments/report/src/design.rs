//! `spts design` as text, files and figures, and its folder, read again.

use super::write_all_or_none;
use crate::figures::{Chart, Series, Style, save_charts};
use spts::output::{OutputError, OutputFolder, write_bytes, write_json};
use spts_circuit::{MAX_PATTERNS_BYTES, Profile};
use spts_eval::Table;
use spts_input::Refusal;
use spts_recon::statistics::Band;
use spts_studies::design::{
    CheckReport, Design, DesignCheck, DesignCurve, DesignPoint, DesignReport, FeedbackLimit, RowSource, counted,
};
use spts_studies::electronics::ElectronicsStudy;
use std::path::Path;

/// Largest file of a design, bytes.
const MAX_BYTES: u64 = 1 << 24;

/// Writes the design, the profile and the scene that simulate it, its pattern where it has one, what was tried and a
/// picture of it into the folder `out`: all of them, or none.
///
/// # Errors
/// [`OutputError`] when a file cannot be written.
pub fn write(report: &DesignReport, out: OutputFolder) -> Result<(), OutputError> {
    write_all_or_none(out, |out| {
        write_json(&out.path("design.json"), report)?;
        write_bytes(&out.path("profile.toml"), report.profile.as_bytes())?;
        write_bytes(&out.path("scene.toml"), report.scene.as_bytes())?;
        if let Some(pattern) = &report.pattern {
            write_bytes(&out.path("rows.txt"), pattern.as_bytes())?;
        }
        curves_table(report).write(out)?;
        save_charts(&charts(report), &out.folder("figures")?, "design")?;
        Ok(())
    })
}

fn curves_table(report: &DesignReport) -> Table<'_, (&DesignCurve, &DesignPoint)> {
    let period_s = report.design.wire.period_s;
    let points = report
        .curves
        .iter()
        .flat_map(|curve| curve.points.iter().map(move |p| (curve, p)));
    Table::new("curves", points)
        .file("wires", |(c, _)| c.wires)
        .file("rows", |(c, _)| c.rows.name())
        .file("m_per_wire", |(_, p)| p.m_per_wire)
        .file("acquisition_s", move |(_, p)| p.m_per_wire as f64 * period_s)
        .file("iou", |(_, p)| p.iou.mean)
        .file("iou_low", |(_, p)| p.iou.low)
        .file("iou_high", |(_, p)| p.iou.high)
        .file("place_px", |(_, p)| p.place_px)
}

/// Reads the folder `path` that `spts design` has written: the design, its readout profile and, if its rows are
/// designed, their pattern. `seed` is the root of the random numbers of the check that is to be run on it.
///
/// # Errors
/// [`Refusal`] with the name of the file that is missing or wrong.
pub fn read_design(path: &Path, seed: u64) -> Result<DesignCheck, Refusal> {
    let read = |name: &str, most: u64| {
        let path = path.join(name);
        let text = spts_input::read_text(&path, most);
        text.map_err(|e| Refusal::new(format!("{}: {e}; a design is made by `spts design`", path.display())))
    };
    let content = |name: &str, reason: String| Refusal::new(reason).at(path.join(name).display());
    let text = read("design.json", MAX_BYTES)?;
    let design = design_of(&text).map_err(|e| content("design.json", e.to_string()))?;
    let text = read("profile.toml", MAX_BYTES)?;
    let profile = Profile::from_toml(&text).map_err(|e| content("profile.toml", e.to_string()))?;
    let pattern = match design.row_source {
        RowSource::Generator => None,
        RowSource::Designer(_) => Some(read("rows.txt", MAX_PATTERNS_BYTES)?),
    };
    Ok(DesignCheck {
        design,
        profile,
        pattern,
        seed,
    })
}

/// The fields of the design itself among all that the file says.
fn design_of(text: &str) -> Result<Design, serde_json::Error> {
    const FIELDS: [&str; 15] = [
        "rows",
        "cols",
        "taxels",
        "pitch_m",
        "electrode_m",
        "objects",
        "wires",
        "sub_arrays",
        "wire",
        "row_source",
        "m_per_wire",
        "m",
        "decoder",
        "expected",
        "seed",
    ];
    let mut all: serde_json::Map<String, serde_json::Value> = serde_json::from_str(text)?;
    all.retain(|field, _| FIELDS.contains(&field.as_str()));
    serde_json::from_value(all.into())
}

/// The design as text.
#[must_use]
pub fn text(report: &DesignReport) -> String {
    let (d, w, e, c) = (
        &report.design,
        &report.design.wire,
        &report.design.expected,
        &report.cost,
    );
    let wanted = format!("an IoU of {}", report.iou_wanted);
    let limit = ms(report.latency.limit_s);
    let heading = if report.reached {
        format!("{wanted} is expected within {limit} ms")
    } else {
        format!("NOT REACHABLE: {wanted} within {limit} ms; this is the best there is")
    };
    let [least, most] = [d.sub_arrays.iter().min(), d.sub_arrays.iter().max()].map(|n| n.copied().unwrap_or_default());
    let each = if least == most {
        most.to_string()
    } else {
        format!("{least} or {most}")
    };
    let decides = match w.feedback_limit {
        FeedbackLimit::Range => "range decides",
        FeedbackLimit::Settling => "time to settle decides",
        FeedbackLimit::SlowerClock => "range decides, at a slower clock",
    };
    let rows = match &d.row_source {
        RowSource::Generator => "random: the cells' generators, seeded with a mix of their addresses".to_owned(),
        RowSource::Designer(name) => format!("designed: {name}, a pattern of {} bits a cell", d.m_per_wire),
    };
    let each_wire = if d.wires == 1 {
        String::new()
    } else {
        format!(": {} on each of {} wires", d.m_per_wire, d.wires)
    };
    let class = match (&e.class, &e.no_class) {
        (Some(class), _) => promise(class, 3),
        (None, why) => format!("not said: {}", why.as_deref().unwrap_or_default()),
    };
    let buses = if c.buses == 1 {
        "1 bus".to_owned()
    } else {
        format!("{} buses", c.buses)
    };
    let designed = ElectronicsStudy::as_designed().map(|s| s.one_wire_text(report.one_wire_taxels));
    // lines that do not apply are None
    let lines = [
        (
            "skin",
            Some(format!(
                "{} × {} = {} taxels, pitch {} mm, electrodes {} mm",
                d.rows,
                d.cols,
                d.taxels,
                mm(d.pitch_m),
                mm(d.electrode_m)
            )),
        ),
        (
            "wires",
            Some(format!(
                "{}, {each} taxels each, read at the same time",
                counted(d.wires, "wire")
            )),
        ),
        (
            "clock",
            Some(format!(
                "{:.1} kHz; the output settles in {:.2} of {:.2} µs",
                1e-3 * w.rate_hz,
                1e6 * w.settle_s,
                1e6 * w.available_s
            )),
        ),
        (
            "amplifier",
            Some(format!(
                "{} with {:.0} Ω of feedback, which the {decides}; noise gain {:.1}, sums up to {:.1} of {:.1} V",
                w.amplifier, w.feedback_ohm, w.noise_gain, w.excursion_v, w.range_v
            )),
        ),
        (
            "converter",
            Some(format!(
                "{} bits, steps of {:.1} mV; a pressed taxel is worth {:.1} of them",
                w.adc_bits,
                1e3 * w.adc_step_v,
                w.steps_per_taxel
            )),
        ),
        (
            "",
            w.limit.as_ref().map(|limit| format!("beyond its closed form: {limit}")),
        ),
        ("rows", Some(rows)),
        ("measurements", Some(format!("M = {}{each_wire}", d.m))),
        (
            "decoder",
            Some(format!(
                "{}: separable Gaussian prior, non-negative on {} taxels at most; {}",
                d.decoder.name,
                d.decoder.places,
                bytes(d.decoder.bytes)
            )),
        ),
        ("expected IoU", Some(promise(&e.iou, 3))),
        ("expected place", Some(format!("{} taxels", promise(&e.place_px, 2)))),
        ("", Some(format!("{} mm", promise(&e.place_mm, 2)))),
        ("expected class", Some(class)),
        (
            "",
            Some(format!(
                "means of {} repetitions of {} touches; in brackets the band for a check of as many, {:.0} % of which lie outside",
                e.repetitions,
                e.touches,
                100.0 * e.outside
            )),
        ),
        (
            "latency",
            Some(format!(
                "{} ms of acquisition; about {} ms of decoding beside it, at 10⁹ multiplications a second",
                ms(report.latency.acquisition_s),
                ms(report.latency.decode_estimate_s)
            )),
        ),
        (
            "cost drivers",
            Some(format!(
                "{} cells, {}, {}, {}; {} bytes a cell over {buses}, {} ms",
                c.cells,
                counted(c.wires, "wire"),
                counted(c.amplifiers, "amplifier"),
                counted(c.converters, "converter"),
                c.bytes_a_cell,
                ms(c.load_s)
            )),
        ),
        (
            "binding",
            Some(format!("{}: {}", report.binding.name(), report.binding_reason)),
        ),
        ("", designed.ok().map(|one_wire| format!("as designed, {one_wire}"))),
    ];
    let lines = lines
        .into_iter()
        .filter_map(|(what, says)| Some(format!("{what:<16} {}\n", says?)));
    let alternatives = Table::new("alternatives", &report.alternatives)
        .shown("alternative", |a| &a.what)
        .shown("taxels", |a| a.taxels)
        .shown("pitch", |a| a.pitch_m)
        .unit("mm", 1e3)
        .digits(2)
        .shown("wires", |a| a.wires)
        .shown("rows", |a| &a.rows)
        .shown("M a wire", |a| a.m_per_wire)
        .shown("acquisition, ms", |a| ms(a.acquisition_s))
        .shown("IoU", |a| a.iou)
        .digits(2)
        .shown("place, mm", |a| a.place_mm)
        .digits(2);
    format!("{heading}\n\n{}\n{}", lines.collect::<String>(), alternatives.text())
}

/// The check of a design as text.
#[must_use]
pub fn check_text(report: &CheckReport) -> String {
    let quantities = report.quantities.iter().map(|q| {
        let verdict = if q.agrees { "agrees" } else { "DOES NOT AGREE" };
        format!(
            "\n{:<20} {:.3}, promised {}: {verdict}",
            q.quantity,
            q.found,
            promise(&q.promised, 3)
        )
    });
    format!(
        "{} repetitions of {} touches with seed {}, none of which the design has seen{}",
        report.repetitions,
        report.touches,
        report.seed,
        quantities.collect::<String>()
    )
}

/// A mean and its band.
fn promise(p: &Band, digits: usize) -> String {
    format!("{:.digits$} [{:.digits$}, {:.digits$}]", p.mean, p.low, p.high)
}

/// Millimetres, to a thousandth.
fn mm(metres: f64) -> f64 {
    (1e6 * metres).round() / 1e3
}

/// Milliseconds with three digits.
fn ms(seconds: f64) -> String {
    let ms = 1e3 * seconds;
    if ms >= 100.0 {
        format!("{ms:.0}")
    } else if ms >= 10.0 {
        format!("{ms:.1}")
    } else {
        format!("{ms:.2}")
    }
}

/// Bytes with a prefix.
fn bytes(count: usize) -> String {
    let count = count as f64;
    if count >= 1e6 {
        format!("{:.1} MB", count * 1e-6)
    } else {
        format!("{:.0} kB", count * 1e-3)
    }
}

/// Vertical axis of IoU.
const IOU: (f64, f64) = (0.0, 1.0);

/// IoU and place error against the time of acquisition, with the target, the latency and the design itself.
fn charts(report: &DesignReport) -> Vec<Chart> {
    let (d, e) = (&report.design, &report.design.expected);
    let (limit_ms, at) = (1e3 * report.latency.limit_s, 1e3 * report.latency.acquisition_s);
    let place_mm = |p: &DesignPoint| 1e3 * d.pitch_m * p.place_px;
    let mut image = curves(report, &|p| p.iou.mean);
    let mut place = curves(report, &place_mm);
    for (series, band) in [(&mut image, &e.iou), (&mut place, &e.place_mm)] {
        let points = vec![(at, band.low), (at, band.mean), (at, band.high)];
        series.push(Series::new(
            "the design, with the band of its check",
            Style::Raster,
            0,
            points,
        ));
    }
    let times = image.iter().flat_map(|s| s.points.iter().map(|(t, _)| *t));
    let first = times.fold(limit_ms, f64::min);
    let farthest = place
        .iter()
        .flat_map(|s| s.points.iter().map(|(_, mm)| *mm))
        .fold(0.0, f64::max);
    let level = vec![(first, report.iou_wanted), (limit_ms, report.iou_wanted)];
    image.push(Series::new(
        format!("IoU of {} asked for", report.iou_wanted),
        Style::Paper,
        0,
        level,
    ));
    for (series, top) in [(&mut image, IOU.1), (&mut place, farthest)] {
        let line = vec![(limit_ms, 0.0), (limit_ms, top)];
        series.push(Series::new(format!("latency of {limit_ms} ms"), Style::Paper, 1, line));
    }
    let (pitch_mm, wires) = (mm(d.pitch_m), counted(d.wires, "wire"));
    let title = format!("{} × {} taxels, {pitch_mm} mm, {wires}, M = {}", d.rows, d.cols, d.m);
    let panel = |title: String, y_label: &str, series: Vec<Series>| Chart {
        title,
        x_label: "acquisition, ms".to_owned(),
        y_label: y_label.to_owned(),
        x_log: true,
        series,
        ..Chart::default()
    };
    vec![
        Chart {
            y_range: Some(IOU),
            ..panel(title, "IoU", image)
        },
        panel("Place of the touch".to_owned(), "median place error, mm", place),
    ]
}

/// A curve of everything that was tried with as many wires as the design, and with one.
fn curves(report: &DesignReport, of: &dyn Fn(&DesignPoint) -> f64) -> Vec<Series> {
    let wires = report.design.wires;
    let several = wires > 1;
    let shown: Vec<&DesignCurve> = report
        .curves
        .iter()
        .filter(|c| c.wires == wires || c.wires == 1)
        .collect();
    let series = shown.iter().map(|c| {
        let name = match (&c.rows, several) {
            (rows, false) => format!("{} rows", plain(rows)),
            (rows, true) => format!("{} rows, wires: {}", plain(rows), c.wires),
        };
        let style = match c.rows {
            RowSource::Generator => Style::Twin,
            RowSource::Designer(_) => Style::Baseline,
        };
        let like = shown
            .iter()
            .take_while(|other| !std::ptr::eq(**other, *c))
            .filter(|other| (other.rows == RowSource::Generator) == (c.rows == RowSource::Generator));
        let variant = u8::try_from(like.count() % 4).unwrap_or_default();
        Series::new(name, style, variant, points(report, c, of))
    });
    series.collect()
}

/// Name of rows in the figure.
fn plain(rows: &RowSource) -> String {
    rows.name().replace('_', " ")
}

/// Points of a curve, ms.
fn points(report: &DesignReport, curve: &DesignCurve, of: &dyn Fn(&DesignPoint) -> f64) -> Vec<(f64, f64)> {
    let period_ms = 1e3 * report.design.wire.period_s;
    let point = |p: &DesignPoint| (p.m_per_wire as f64 * period_ms, of(p));
    curve.points.iter().map(point).collect()
}
