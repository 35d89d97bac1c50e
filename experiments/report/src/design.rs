//! `spts design` as text, files and figures, and its folder, read again.

use super::write_all_or_none;
use crate::figures::{Chart, Curve, Plot, Series, Style, save_charts};
use spts::output::{OutputFolder, write_bytes, write_json};
use spts::session::parse_json;
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
/// [`Refusal`] when a file cannot be written.
pub fn write(report: &DesignReport, out: OutputFolder) -> Result<(), Refusal> {
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
    let points = report.curves.iter().flat_map(|curve| curve.points.iter().map(move |p| (curve, p)));
    Table::new("curves", points)
        .file("wires", |(c, _)| c.wires)
        .file("rows", |(c, _)| c.rows.name())
        .file("m_per_wire", |(_, p)| p.m_per_wire)
        .file("acquisition_s", move |(_, p)| p.m_per_wire as f64 * period_s)
        .file("iou", |(_, p)| p.iou.mean)
        .interval("iou", |(_, p)| Some([p.iou.low, p.iou.high]))
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
    // the file says more than the design
    let file = path.join("design.json");
    let design: Design = parse_json(&file, &text)?;
    design.check().map_err(|refusal| refusal.at(file.display()))?;
    let text = read("profile.toml", MAX_BYTES)?;
    let profile = Profile::from_toml(&text).map_err(|e| content("profile.toml", e.to_string()))?;
    let pattern = match design.row_source {
        RowSource::Generator => None,
        RowSource::Designer(_) => Some(read("rows.txt", MAX_PATTERNS_BYTES)?),
    };
    Ok(DesignCheck { design, profile, pattern, seed })
}

/// The design as text.
pub fn text(report: &DesignReport) -> String {
    let (d, w, e, c) = (&report.design, &report.design.wire, &report.design.expected, &report.cost);
    let wanted = format!("an IoU of {}", report.iou_wanted);
    let limit = ms(report.latency.limit_s);
    let heading = if report.reached {
        format!("{wanted} is expected within {limit} ms")
    } else {
        format!("NOT REACHABLE: {wanted} within {limit} ms; this is the best there is")
    };
    let [least, most] = [d.sub_arrays.iter().min(), d.sub_arrays.iter().max()].map(|n| n.copied().unwrap_or_default());
    let each = if least == most { most.to_string() } else { format!("{least} or {most}") };
    let decides = match w.feedback_limit {
        FeedbackLimit::Range => "range decides",
        FeedbackLimit::Settling => "time to settle decides",
        FeedbackLimit::SlowerClock => "range decides, at a slower clock",
    };
    let rows = match &d.row_source {
        RowSource::Generator => "random: the cells' generators, seeded with a mix of their addresses".to_owned(),
        RowSource::Designer(name) => format!("designed: {name}, a pattern of {} bits a cell", d.m_per_wire),
    };
    let each_wire =
        if d.wires == 1 { String::new() } else { format!(": {} on each of {} wires", d.m_per_wire, d.wires) };
    let class = match (&e.class, &e.no_class) {
        (Some(class), _) => promise(class, 3),
        (None, why) => format!("not said: {}", why.as_deref().unwrap_or_default()),
    };
    let buses = format!("{} bus{}", c.buses, if c.buses == 1 { "" } else { "es" });
    let mut lines = String::new();
    let mut line = |what: &str, says: String| lines.push_str(&format!("{what:<16} {says}\n"));
    let (pitch_mm, electrode_mm) = (mm(d.pitch_m), mm(d.electrode_m));
    line(
        "skin",
        format!("{} × {} = {} taxels, pitch {pitch_mm} mm, electrodes {electrode_mm} mm", d.rows, d.cols, d.taxels),
    );
    let wires = counted(d.wires, "wire");
    line("wires", format!("{wires}, {each} taxels each, read at the same time"));
    let (rate_khz, settle_us, available_us) = (1e-3 * w.rate_hz, 1e6 * w.settle_s, 1e6 * w.available_s);
    line("clock", format!("{rate_khz:.1} kHz; the output settles in {settle_us:.2} of {available_us:.2} µs"));
    line(
        "amplifier",
        format!(
            "{} with {:.0} Ω of feedback, which the {decides}; noise gain {:.1}, sums up to {:.1} of {:.1} V",
            w.amplifier, w.feedback_ohm, w.noise_gain, w.excursion_v, w.range_v
        ),
    );
    let (bits, step_mv, steps) = (w.adc_bits, 1e3 * w.adc_step_v, w.steps_per_taxel);
    line("converter", format!("{bits} bits, steps of {step_mv:.1} mV; a pressed taxel is worth {steps:.1} of them"));
    if let Some(limit) = &w.limit {
        line("", format!("beyond its closed form: {limit}"));
    }
    line("rows", rows);
    line("measurements", format!("M = {}{each_wire}", d.m));
    let (decoder, places, memory) = (&d.decoder.name, d.decoder.places, bytes(d.decoder.bytes));
    let how = if decoder == "SheetDecoder" {
        format!("separable Gaussian prior, non-negative on {places} taxels at most")
    } else {
        "contacts as patches, nothing learned; as `spts decode` has it".to_owned()
    };
    line("decoder", format!("{decoder}: {how}; {memory}"));
    line("expected IoU", promise(&e.iou, 3));
    line("expected place", format!("{} taxels", promise(&e.place_px, 2)));
    line("", format!("{} mm", promise(&e.place_mm, 2)));
    line("expected class", class);
    let (repetitions, touches, outside) = (e.repetitions, e.touches, 100.0 * e.outside);
    line(
        "",
        format!(
            "means of {repetitions} repetitions of {touches} touches; in brackets the band for a check of as many, \
             {outside:.0} % of which lie outside"
        ),
    );
    let (acquisition, decode) = (ms(report.latency.acquisition_s), ms(report.latency.decode_estimate_s));
    line(
        "latency",
        format!(
            "{acquisition} ms of acquisition; about {decode} ms of decoding beside it, at 10⁹ multiplications a second"
        ),
    );
    line(
        "cost drivers",
        format!(
            "{} cells, {}, {}, {}; {} bytes a cell over {buses}, {} ms",
            c.cells,
            counted(c.wires, "wire"),
            counted(c.amplifiers, "amplifier"),
            counted(c.converters, "converter"),
            c.bytes_a_cell,
            ms(c.load_s)
        ),
    );
    line("binding", format!("{}: {}", report.binding.name(), report.binding_reason));
    if let Ok(designed) = ElectronicsStudy::as_designed() {
        line("", format!("with the electronics of `as_designed`, {}", designed.one_wire_text(report.one_wire_taxels)));
    }
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
    format!("{heading}\n\n{lines}\n{}", alternatives.text())
}

/// The check of a design as text.
pub fn check_text(report: &CheckReport) -> String {
    let quantities = report.quantities.iter().map(|q| {
        let verdict = if q.agrees { "agrees" } else { "DOES NOT AGREE" };
        format!("\n{:<20} {:.3}, promised {}: {verdict}", q.quantity, q.found, promise(&q.promised, 3))
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
    if count >= 1e6 { format!("{:.1} MB", count * 1e-6) } else { format!("{:.0} kB", count * 1e-3) }
}

/// IoU and place error against the time of acquisition, with the target, the latency and the design itself: everything
/// that was tried with as many wires as the design, and with one.
fn charts(report: &DesignReport) -> Vec<Chart> {
    let (d, e) = (&report.design, &report.design.expected);
    let (limit_ms, at) = (1e3 * report.latency.limit_s, 1e3 * report.latency.acquisition_s);
    let period_ms = 1e3 * d.wire.period_s;
    let shown: Vec<&DesignCurve> = report.curves.iter().filter(|c| c.wires == d.wires || c.wires == 1).collect();
    let points = || shown.iter().flat_map(|c| c.points.iter().map(move |p| (*c, p)));
    let curve = |(c, _): (&DesignCurve, &DesignPoint)| {
        let random = |c: &DesignCurve| c.rows == RowSource::Generator;
        let before = shown.iter().take_while(|other| !std::ptr::eq(**other, c));
        let like = before.filter(|other| random(other) == random(c)).count();
        let rows = c.rows.name().replace('_', " ");
        let name = match d.wires {
            1 => format!("{rows} rows"),
            _ => format!("{rows} rows, wires: {}", c.wires),
        };
        let style = if random(c) { Style::Twin } else { Style::Baseline };
        Curve::new(name, style, u8::try_from(like % 4).unwrap_or_default())
    };
    let panel = |title: String, y_label: &str, of: &dyn Fn(&DesignPoint) -> f64| {
        Plot::new(points())
            .x("acquisition, ms", |(_, p)| p.m_per_wire as f64 * period_ms)
            .log_x()
            .y(y_label, |(_, p)| of(p))
            .by(curve)
            .chart(title)
    };
    let (pitch_mm, wires) = (mm(d.pitch_m), counted(d.wires, "wire"));
    let title = format!("{} × {} taxels, {pitch_mm} mm, {wires}, M = {}", d.rows, d.cols, d.m);
    let mut image = panel(title, "IoU", &|p| p.iou.mean);
    image.y_range = Some((0.0, 1.0));
    let place_mm = |p: &DesignPoint| 1e3 * d.pitch_m * p.place_px;
    let mut place = panel("Place of the touch".to_owned(), "median place error, mm", &place_mm);
    let of_design = |band: &Band| {
        let points = vec![(at, band.low), (at, band.mean), (at, band.high)];
        Series::new("the design, with the band of its check", Style::Raster, 0, points)
    };
    image.series.push(of_design(&e.iou));
    place.series.push(of_design(&e.place_mm));
    let ends = |chart: &Chart, of: fn(&(f64, f64)) -> f64| -> Vec<f64> {
        chart.series.iter().flat_map(|s| s.points.iter().map(of)).collect()
    };
    let first = ends(&image, |(time_ms, _)| *time_ms).into_iter().fold(limit_ms, f64::min);
    let farthest = ends(&place, |(_, mm)| *mm).into_iter().fold(0.0, f64::max);
    let asked = report.iou_wanted;
    let level = vec![(first, asked), (limit_ms, asked)];
    image.series.push(Series::new(format!("IoU of {asked} asked for"), Style::Paper, 0, level));
    for (chart, top) in [(&mut image, 1.0), (&mut place, farthest)] {
        let line = vec![(limit_ms, 0.0), (limit_ms, top)];
        let name = format!("latency of {limit_ms} ms");
        chart.series.push(Series::new(name, Style::Paper, 1, line));
    }
    vec![image, place]
}
