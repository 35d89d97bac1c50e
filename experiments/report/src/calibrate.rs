//! `spts calibrate` as text, and the picture of `spts calibrate --skin`.

use crate::figures::{Sheet, Tile, TileRow, save_sheet};
use spts_eval::Table;
use spts_eval::training::GainCheck;
use spts_input::Refusal;
use spts_recon::statistics::mean;
use spts_studies::calibrate::{
    Beat, CalibrationReport, Estimated, GainPlane, NOT_IDENTIFIABLE, NOT_MODELLED, NUMBERS, PredictedInside, Remounted,
    SessionEstimates, SessionGains, SkinReport,
};
use std::path::Path;

/// Side of a picture, CSS pixels.
const TILE_PX: usize = 240;

/// Most columns of a sheet whose gains are printed.
const MOST_SHOWN: usize = 20;

/// The estimates as a text table, with what the recordings cannot determine.
pub fn text(report: &CalibrationReport) -> String {
    let label = |(name, unit): (&str, &str)| match unit {
        "" => name.to_owned(),
        unit => format!("{name} [{unit}]"),
    };
    let numbers = report.sessions.iter().fold(Table::new("numbers", NUMBERS).shown("", label), |table, s| {
        table.shown(&s.session, |(name, _)| s.numbers.get(name).map_or_else(String::new, estimated))
    });
    let table = numbers.text();
    format!(
        "{table}{}\n{}not identifiable from these recordings:\n- {}\nin the recordings, not modelled:\n- {}",
        report.sessions.iter().flat_map(remarks).collect::<Vec<_>>().join("\n"),
        report.predicted_inside.as_ref().map_or_else(String::new, predictions),
        NOT_IDENTIFIABLE.join("\n- "),
        NOT_MODELLED.join("\n- ")
    )
}

fn estimated(e: &Estimated) -> String {
    match (e.n, e.standard_error) {
        (0, _) => "not identified".to_owned(),
        (_, None) => format!("{:.4}", e.value),
        (_, Some(error)) => format!("{:.4} ± {error:.4}", e.value),
    }
}

/// What was found in a session beside its numbers, a line each.
fn remarks(s: &SessionEstimates) -> Vec<String> {
    let beat = |b: &Beat| format!("{:.2} (taxel {})", b.period_measurements, b.taxel);
    let beats = match &s.beats[..] {
        [] => "none seen".to_owned(),
        beats => beats.iter().map(beat).collect::<Vec<_>>().join(", "),
    };
    let grid =
        s.steps.map_or_else(|| "values on no grid".to_owned(), |steps| format!("step {:.4} mV", 1e3 * steps.step_v));
    let presses = s.presses.len();
    let mut found = vec![format!("{presses} presses, {grid}, beats [measurements]: {beats}")];
    if let Some(SessionGains { taxels, log_sd, standard_error, plane }) = &s.gains {
        let taxels = taxels.len();
        let tilt = plane.map_or_else(String::new, |GainPlane { slopes: [a, b], standard_errors: [da, db], log_sd }| {
            format!(", {log_sd:.3} about a plane with slopes {a:.2} ± {da:.2} and {b:.2} ± {db:.2} a half sheet")
        });
        found.push(format!(
            "gains of {taxels} taxels against the raster session: log-sd {log_sd:.3} ± {standard_error:.3}{tilt}"
        ));
    }
    found.extend(s.faults.iter().map(ToString::to_string));
    found.extend(s.overdriven.iter().map(ToString::to_string));
    found.extend(s.missed.iter().map(ToString::to_string));
    if presses == 1 {
        found.push("one press only: no number has an uncertainty".to_owned());
    }
    found.into_iter().map(|what| format!("{}: {what}", s.session)).collect()
}

/// How many sessions lie in the spans that the others predict, parameter by parameter.
fn predictions(found: &PredictedInside) -> String {
    let mut out = format!(
        "each session left out, inside the {:.0} % span that the others predict: {:.0} % of all numbers (between the others' smallest and \
         largest: {:.0} %)\n",
        100.0 * found.coverage,
        100.0 * found.share,
        100.0 * found.share_of_range
    );
    for n in &found.numbers {
        let outside = match &n.outside[..] {
            [] => String::new(),
            names => format!(", not {}", names.join(", ")),
        };
        out.push_str(&format!("- {}: {} of {}{outside}\n", n.name, n.inside, n.sessions));
    }
    out
}

/// The gains of a skin as text.
pub fn skin_text(report: &SkinReport) -> String {
    let [rows, cols] = report.shape;
    let skin = &report.skin;
    let mountings = if report.mountings.is_empty() {
        "(not measured: no session has both recordings)".to_owned()
    } else {
        let slopes = |m: &Remounted| match m.plane {
            Some(GainPlane { slopes: [a, b], .. }) => format!(" with slopes {a:.2} and {b:.2}"),
            None => String::new(),
        };
        let each = |m: &Remounted| format!("{} {:.3}{}", m.session, m.log_sd, slopes(m));
        format!("({})", report.mountings.iter().map(each).collect::<Vec<_>>().join(", "))
    };
    let mut out = format!(
        "gains of {rows} × {cols} taxels, {} of them touched; objects: {}\n\
         standard deviation of log gain: {:.3} over the skin, {:.3} from a simulated contact, {:.3} from a mounting and\n\
         {:.3} by which it tilts from the middle to the edge {mountings}\n",
        skin.sessions.iter().filter(|n| **n > 0).count(),
        skin.fitted_objects,
        skin.spread_log_sd,
        skin.contact_log_sd,
        skin.gains.mounting.log_sd,
        skin.gains.mounting.tilt_log_sd,
    );
    if cols <= MOST_SHOWN {
        let gains: Vec<f64> = skin.gains.log_mean.iter().map(|log| log.exp()).collect();
        let factors = "factor by which it may be larger or smaller (90 %)";
        for (title, values) in [("gain", gains), (factors, report.bands().collect())] {
            out.push_str(&format!("\n{title}\n"));
            for line in values.chunks(cols) {
                let line: String = line.iter().map(|v| format!("{v:5.2}")).collect();
                out.push_str(&format!("{line}\n"));
            }
        }
    }
    if report.objects.is_empty() {
        return out + "\nno other object to check them with";
    }
    let checks = Table::new("objects", &report.objects)
        .shown("object", |o| &o.object)
        .shown("taxels", |o| o.check.taxels)
        .shown("correlation", |o| o.check.correlation)
        .digits(3)
        .shown("with gains", |o| o.check.correlation_with_gains)
        .digits(3)
        .shown("ratios inside 90 %", |o| o.check.inside)
        .digits(2);
    let mean_of = |get: fn(&GainCheck) -> f64| mean(report.objects.iter().map(|o| get(&o.check))).unwrap_or_default();
    let (plain, with_gains) = (mean_of(|c| c.correlation), mean_of(|c| c.correlation_with_gains));
    let inside = mean_of(|c| c.inside);
    format!(
        "{out}\nsimulated image beside the skin's, with the gains that the other objects tell\n{}\
         mean: correlation {plain:.3}, with gains {with_gains:.3}, ratios inside {inside:.2}",
        checks.text()
    )
}

/// Writes pictures of the gains and of what is not known of them beside the file `path`, with its name: `.svg` and
/// `.png`.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub fn write_gains(report: &SkinReport, path: &Path) -> Result<(), Refusal> {
    let [rows, cols] = report.shape;
    let tile = |values: Vec<f64>, what: &str| {
        let (least, most) = values.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), &v| (low.min(v), high.max(v)));
        Tile::Heat { values, rows, cols, max: None, caption: format!("{what}: {least:.2} to {most:.2}"), outline: None }
    };
    let gains = report.skin.gains.log_mean.iter().map(|log| log.exp()).collect();
    let known = report.bands().map(|factor| factor - 1.0).collect();
    let sheet = Sheet {
        title: "Gains of the taxels".to_owned(),
        column_titles: vec!["gain".to_owned(), "not known".to_owned()],
        rows: vec![TileRow {
            label: String::new(),
            tiles: vec![tile(gains, "gain"), tile(known, "90 % band, relative")],
        }],
        tile_px: TILE_PX,
    };
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    save_sheet(&sheet, path.parent().unwrap_or(Path::new("")), &name)?;
    Ok(())
}
