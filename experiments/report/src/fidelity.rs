//! The files of a fidelity study.

use crate::figures::colour::heat;
use crate::figures::{Chart, Series, Sheet, Style, Tile, TileRow, save_charts, save_sheet};
use crate::{Origin, write_all_or_none};
use spts::output::{OutputError, OutputFolder, write_bytes, write_json, write_table};
use spts_eval::{Table, unique};
use spts_sim::fidelity::{FidelityLevel, LEVELS, MeasuredSetting};
use spts_studies::fidelity::{FidelityReport, FinePressure};

/// Files outside of folders of their own.
pub const FILES: &[&str] = &[
    "errors.csv",
    "fidelity.csv",
    "refused.csv",
    "summary.md",
    "provenance.json",
];

/// Writes the tables, their summary, the figures and the provenance of `report` beside the scenes that wait in `out`.
///
/// # Errors
/// [`OutputError`] when a file cannot be written or a figure cannot be drawn.
pub fn write(report: &FidelityReport, out: OutputFolder) -> Result<(), OutputError> {
    write_all_or_none(out, |out| {
        // without what depends on the machine
        Table::new("errors", &report.rows)
            .file("scene", |r| &r.scene)
            .file("rung", |r| &r.level)
            .file("cells", |r| &r.cells)
            .file("timestep_s", |r| r.timestep_s)
            .file("pressure_rms_rel", |r| r.pressure_rms_rel)
            .file("taxel_rms_rel", |r| r.taxel_rms_rel)
            .file("support_delta", |r| r.support_delta)
            .file("iou_delta", |r| r.iou_delta)
            .file("class_delta", |r| r.class_delta)
            .write(out)?;
        write_table(&out.path("fidelity.csv"), &report.rows)?;
        write_table(&out.path("refused.csv"), &report.refusals)?;
        write_bytes(&out.path("summary.md"), text(report).as_bytes())?;
        let folder = out.folder("figures")?;
        save_charts(&pareto(&report.rows), &folder, "pareto")?;
        save_sheet(&pressures(&report.rows, &report.fine), &folder, "pressure")?;
        write_json(&out.path("provenance.json"), &Origin::here(report.provenance.clone()))?;
        Ok(())
    })
}

/// The means over the scenes as Markdown tables, which are readable as plain text too.
#[must_use]
pub fn text(report: &FidelityReport) -> String {
    let mut out = String::new();
    for (task, heading) in [("press", "Presses"), ("drop", "Drops")] {
        let lines = setting_means(&report.rows, task);
        let Some(scenes) = lines.iter().map(|o| o.scenes).max() else {
            continue;
        };
        let table = Table::new("means", &lines)
            .shown("fidelity level", |o| label(&o.first.level))
            .shown("cells", |o| &o.first.cells)
            .shown("step", |o| o.first.timestep_s)
            .unit("ms", 1e3)
            .shown("µs/step", |o| o.cost_us_per_step)
            .digits(1)
            .shown("s a second", |o| o.cost_s_per_s)
            .digits(4)
            .shown("pressure", |o| o.pressure_rms_rel)
            .digits(4)
            .shown("taxels", |o| o.taxel_rms_rel)
            .digits(4)
            .shown("worst", |o| o.worst_taxel_rms_rel)
            .digits(4)
            .shown("support", |o| o.support_change)
            .digits(3)
            .shown("IoU", |o| o.iou_change)
            .digits(3)
            .shown("class", |o| o.class_change)
            .digits(3);
        out.push_str(&format!(
            "{heading}: mean over {scenes} scenes; errors against the layer at its finest, changes of the scores in size\n\n{}\n",
            table.text()
        ));
    }
    if !report.refusals.is_empty() {
        out.push_str(&format!(
            "{} settings were refused (refused.csv)\n",
            report.refusals.len()
        ));
    }
    out
}

/// Cost and error of one contact model, resolution and time step: means over all scenes of one kind, presses or drops.
#[derive(Debug, Clone, PartialEq)]
struct SettingMeans<'a> {
    /// Row of the first scene. All rows share its level, resolution and time step.
    first: &'a MeasuredSetting,
    /// Number of scenes with this setting.
    scenes: usize,
    /// Wall time of a time step, µs.
    cost_us_per_step: f64,
    /// Wall time of a simulated second, s.
    cost_s_per_s: f64,
    /// Error of the fine pressure, relative root mean square.
    pressure_rms_rel: f64,
    /// Error of the taxels' pressures, relative root mean square.
    taxel_rms_rel: f64,
    /// Largest error of the taxels' pressures over the scenes, relative root mean square.
    worst_taxel_rms_rel: f64,
    /// Absolute change of the support accuracy.
    support_change: f64,
    /// Absolute change of the intersection over union.
    iou_change: f64,
    /// Absolute change of the share of correctly classified windows.
    class_change: f64,
}

/// Every setting of the scenes of `task`, the cheapest level first; means over the scenes.
fn setting_means<'a>(rows: &'a [MeasuredSetting], task: &str) -> Vec<SettingMeans<'a>> {
    let rows: Vec<&MeasuredSetting> = rows.iter().filter(|r| r.task == task).collect();
    let mut settings: Vec<&MeasuredSetting> = Vec::new();
    for &row in &rows {
        if !settings.iter().any(|s| alike(s, row)) {
            settings.push(row);
        }
    }
    settings.sort_by_key(|r| {
        let level = LEVELS.iter().position(|level| level.name == r.level);
        (level, r.cells_per_taxel, r.timestep_s.to_bits())
    });
    let of = |first: &'a MeasuredSetting| {
        let same: Vec<&&MeasuredSetting> = rows.iter().filter(|r| alike(r, first)).collect();
        let mean = |get: fn(&MeasuredSetting) -> f64| same.iter().map(|r| get(r)).sum::<f64>() / same.len() as f64;
        SettingMeans {
            first,
            scenes: same.len(),
            cost_us_per_step: mean(|r| r.cost_us_per_step),
            cost_s_per_s: mean(|r| r.cost_s_per_s),
            pressure_rms_rel: mean(|r| r.pressure_rms_rel),
            taxel_rms_rel: mean(|r| r.taxel_rms_rel),
            worst_taxel_rms_rel: same.iter().map(|r| r.taxel_rms_rel).fold(0.0, f64::max),
            // sizes: a gain on one scene does not make up for a loss on another
            support_change: mean(|r| r.support_delta.abs()),
            iou_change: mean(|r| r.iou_delta.abs()),
            class_change: mean(|r| r.class_delta.abs()),
        }
    };
    settings.into_iter().map(of).collect()
}

/// What a fidelity level is called in tables.
fn label(name: &str) -> &str {
    FidelityLevel::named(name).map_or(name, |level| level.label)
}

fn alike(a: &MeasuredSetting, b: &MeasuredSetting) -> bool {
    a.level == b.level && a.cells == b.cells && a.timestep_s.to_bits() == b.timestep_s.to_bits()
}

/// A quantity of the setting_means.
type Quantity = fn(&SettingMeans<'_>) -> f64;

/// Error against cost: one panel a kind of scene and quantity, one curve a level over its resolutions, at the time step
/// that a scene takes by itself.
fn pareto(rows: &[MeasuredSetting]) -> Vec<Chart> {
    let quantities: [(&str, Quantity); 2] = [
        ("taxel pressure, relative RMS error", |o| o.taxel_rms_rel),
        ("IoU of the support, size of the change", |o| o.iou_change),
    ];
    let mut charts = Vec::new();
    for (task, heading, step_s) in [("press", "Presses", 5e-4), ("drop", "Ball drop", 1e-4)] {
        let lines = setting_means(rows, task);
        if lines.is_empty() {
            continue;
        }
        for (k, (label, quantity)) in quantities.into_iter().enumerate() {
            charts.push(Chart {
                title: format!("{heading}: {label}"),
                x_label: "wall time of a simulated second, s".to_owned(),
                y_label: label.to_owned(),
                x_log: true,
                // scores differ by shares of one, pressures by orders of magnitude
                y_log: k == 0,
                series: LEVELS
                    .iter()
                    .zip(STYLES)
                    .map(|(level, (style, variant))| {
                        Series::new(level.label, style, variant, points(&lines, level, step_s, quantity))
                    })
                    .collect(),
                ..Chart::default()
            });
        }
    }
    charts
}

/// Ink of every level, in the order of [`LEVELS`].
const STYLES: [(Style, u8); 5] = [
    (Style::Baseline, 0),
    (Style::Raster, 0),
    (Style::Twin, 1),
    (Style::Twin, 0),
    (Style::Paper, 0),
];

/// Points of a level, coarse to fine. The reference itself, without an error, has no place on a logarithmic axis.
fn points(lines: &[SettingMeans<'_>], level: &FidelityLevel, step_s: f64, quantity: Quantity) -> Vec<(f64, f64)> {
    let usual = |o: &&SettingMeans<'_>| !level.dynamic || (o.first.timestep_s - step_s).abs() <= 1e-9;
    let of_level = lines.iter().filter(|o| o.first.level == level.name).filter(usual);
    of_level.map(|o| (o.cost_s_per_s, quantity(o))).collect()
}

/// Side of the part of the skin that is shown, as a share of it.
const SHOWN: f64 = 0.9;

/// Fine pressure of every scene on every level at its finest measured step, at 6 × 6 cells a taxel or the finest there
/// is.
fn pressures(rows: &[MeasuredSetting], fine: &[FinePressure]) -> Sheet {
    let scenes = unique(rows.iter().map(|row| row.scene.as_str()));
    let tile = |scene: &str, level: &FidelityLevel| {
        let of = |row: &&(&MeasuredSetting, &FinePressure)| row.0.scene == scene && row.0.level == level.name;
        let pairs: Vec<(&MeasuredSetting, &FinePressure)> = rows.iter().zip(fine).collect();
        let best = pairs.iter().filter(of).min_by(|a, b| {
            let key = |row: &MeasuredSetting| (row.cells_per_taxel.abs_diff(6), row.timestep_s);
            let (ka, kb) = (key(a.0), key(b.0));
            ka.0.cmp(&kb.0).then(ka.1.total_cmp(&kb.1))
        });
        best.map_or(Tile::Empty, |(row, fine)| picture(row, fine))
    };
    Sheet {
        title: "Pressure in the middle of the plateau, or at the middle of the first contact".to_owned(),
        column_titles: LEVELS.iter().map(|level| level.label.to_owned()).collect(),
        rows: scenes
            .iter()
            .map(|scene| TileRow {
                label: (*scene).to_owned(),
                tiles: LEVELS.iter().map(|level| tile(scene, level)).collect(),
            })
            .collect(),
        tile_px: 130,
    }
}

fn picture(row: &MeasuredSetting, fine: &FinePressure) -> Tile {
    #[expect(clippy::cast_possible_truncation, reason = "a share of a cell count")]
    let margin = |cells: usize| (0.5 * (1.0 - SHOWN) * cells as f64) as usize;
    let (top, left) = (margin(fine.rows), margin(fine.cols));
    let (height, width) = (fine.rows - 2 * top, fine.cols - 2 * left);
    let peak_pa = fine.pressure_pa.iter().copied().fold(0.0, f64::max);
    let mut rgb = Vec::with_capacity(3 * width * height);
    for line in fine.pressure_pa.chunks_exact(fine.cols).skip(top).take(height) {
        for value in &line[left..left + width] {
            let colour = heat(if peak_pa > 0.0 { value / peak_pa } else { 0.0 });
            rgb.extend([colour.0, colour.1, colour.2]);
        }
    }
    Tile::Picture {
        width,
        height,
        rgb,
        caption: format!(
            "peak {:.0} kPa, error {:.1} %",
            peak_pa * 1e-3,
            100.0 * row.pressure_rms_rel
        ),
    }
}
