//! `spts calibrate` as text, and the picture of `spts calibrate --skin`.

use crate::figures::{Sheet, Tile, TileRow, save_sheet};
use spts::output::OutputError;
use spts_eval::{Table, TextTable};
use spts_recon::statistics::mean;
use spts_studies::calibrate::{
    CalibrationReport, Estimated, NOT_IDENTIFIABLE, NOT_MODELLED, NUMBERS, PredictedInside, SessionEstimates,
    SkinReport,
};
use std::path::Path;

/// Side of a picture, CSS pixels.
const TILE_PX: usize = 240;

/// Most columns of a sheet whose gains are printed.
const MOST_SHOWN: usize = 20;

/// The estimates as a text table, with what the recordings cannot determine.
#[must_use]
pub fn text(report: &CalibrationReport) -> String {
    let number = |(name, unit, _): &(&str, &str, _)| {
        let label = if unit.is_empty() {
            (*name).to_owned()
        } else {
            format!("{name} [{unit}]")
        };
        let values = report
            .sessions
            .iter()
            .map(|s| s.numbers.get(*name).map_or_else(String::new, estimated));
        [label].into_iter().chain(values).collect()
    };
    let sessions = report.sessions.iter().map(|s| s.session.clone());
    let table = TextTable {
        head: [String::new()].into_iter().chain(sessions).collect(),
        rows: NUMBERS.iter().map(number).collect(),
    };
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
    let beats: Vec<String> = s
        .beats
        .iter()
        .map(|b| format!("{:.2} (taxel {})", b.period_measurements, b.taxel))
        .collect();
    let grid = s.steps.map_or_else(
        || "values on no grid".to_owned(),
        |steps| format!("step {:.4} mV", 1e3 * steps.step_v),
    );
    let beats = if beats.is_empty() {
        "none seen".to_owned()
    } else {
        beats.join(", ")
    };
    let mut found = vec![format!(
        "{} presses, {grid}, beats [measurements]: {beats}",
        s.presses.len()
    )];
    found.extend(s.gains.as_ref().map(|gains| {
        format!(
            "gains of {} taxels against the raster session: log-sd {:.3} ± {:.3}",
            gains.taxels.len(),
            gains.log_sd,
            gains.standard_error
        )
    }));
    found.extend(s.faults.iter().map(ToString::to_string));
    found.extend(s.overdriven.iter().map(ToString::to_string));
    found.extend(s.missed.iter().map(ToString::to_string));
    if s.presses.len() == 1 {
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
        let outside = if n.outside.is_empty() {
            String::new()
        } else {
            format!(", not {}", n.outside.join(", "))
        };
        out.push_str(&format!("- {}: {} of {}{outside}\n", n.name, n.inside, n.sessions));
    }
    out
}

/// The gains of a skin as text.
#[must_use]
pub fn skin_text(report: &SkinReport) -> String {
    let [rows, cols] = report.shape;
    let skin = &report.skin;
    let mountings = if report.mountings.is_empty() {
        "(not measured: no session has both recordings)".to_owned()
    } else {
        let each = report
            .mountings
            .iter()
            .map(|m| format!("{} {:.3}", m.session, m.log_sd));
        format!("(median of {})", each.collect::<Vec<_>>().join(", "))
    };
    let mut out = format!(
        "gains of {rows} × {cols} taxels, {} of them touched; objects: {}\n\
         standard deviation of log gain: {:.3} over the skin, {:.3} from a simulated contact, {:.3} from a mounting {mountings}\n",
        skin.sessions.iter().filter(|n| **n > 0).count(),
        skin.fitted_objects,
        skin.spread_log_sd,
        skin.contact_log_sd,
        skin.gains.mounting_log_sd,
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
    let checks_of = || report.objects.iter().map(|o| &o.check);
    let means = [
        mean(checks_of().map(|c| c.correlation)),
        mean(checks_of().map(|c| c.correlation_with_gains)),
        mean(checks_of().map(|c| c.inside)),
    ];
    let [plain, with_gains, inside] = means.map(Option::unwrap_or_default);
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
/// [`OutputError`] when a file cannot be written.
pub fn write_gains(report: &SkinReport, path: &Path) -> Result<(), OutputError> {
    let [rows, cols] = report.shape;
    let tile = |values: Vec<f64>, what: &str| {
        let (least, most) = values
            .iter()
            .fold((f64::INFINITY, 0.0_f64), |(low, high), &v| (low.min(v), high.max(v)));
        Tile::Heat {
            values,
            rows,
            cols,
            max: None,
            caption: format!("{what}: {least:.2} to {most:.2}"),
            outline: None,
        }
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
