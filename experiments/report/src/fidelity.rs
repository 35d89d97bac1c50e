//! The files of a fidelity study.

use crate::figures::colour::heat;
use crate::figures::{Chart, Series, Sheet, Style, Tile, TileRow, save_charts, save_sheet};
use crate::{Origin, write_all_or_none};
use spts::output::{OutputFolder, write_bytes, write_json, write_table};
use spts_eval::{Table, unique};
use spts_input::Refusal;
use spts_sim::fidelity::{FidelityLevel, LEVELS, MeasuredSetting, Tolerance};
use spts_studies::fidelity::{FidelityReport, FinePressure, ToleranceCheck};
use spts_studies::tolerances::{ToleranceReport, ToleranceRow};

/// Writes the tables, their summary, the figures and the provenance of `report` beside the scenes that wait in `out`.
///
/// # Errors
/// [`Refusal`] when a file cannot be written or a figure cannot be drawn.
pub fn write(report: &FidelityReport, out: OutputFolder) -> Result<(), Refusal> {
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
pub fn text(report: &FidelityReport) -> String {
    let mut out = String::new();
    for (task, heading) in [("press", "Presses"), ("drop", "Drops")] {
        let settings = settings(&report.rows, task);
        let Some(scenes) = settings.iter().map(Vec::len).max() else {
            continue;
        };
        let table = Table::new("means", &settings)
            .shown("fidelity level", |s| label(&s[0].level))
            .shown("cells", |s| &s[0].cells)
            .shown("step", |s| s[0].timestep_s)
            .unit("ms", 1e3)
            .shown("µs/step", |s| mean(s, |r| r.cost_us_per_step))
            .digits(1)
            .shown("s a second", |s| mean(s, |r| r.cost_s_per_s))
            .digits(4)
            .shown("chain, s", |s| mean(s, |r| r.chain_s))
            .digits(2)
            .shown("pressure", |s| mean(s, |r| r.pressure_rms_rel))
            .digits(4)
            .shown("taxels", |s| mean(s, |r| r.taxel_rms_rel))
            .digits(4)
            .shown("worst", |s| s.iter().map(|r| r.taxel_rms_rel).fold(0.0, f64::max))
            .digits(4)
            // sizes: a gain on one scene does not make up for a loss on another
            .shown("support", |s| mean(s, |r| r.support_delta.abs()))
            .digits(3)
            .shown("IoU", |s| mean(s, |r| r.iou_delta.abs()))
            .digits(3)
            .shown("class", |s| mean(s, |r| r.class_delta.abs()))
            .digits(3);
        out.push_str(&format!(
            "{heading}: mean over {scenes} scenes; errors against the layer at its finest, changes of the scores in size\n\n{}\n",
            table.text()
        ));
    }
    if !report.refusals.is_empty() {
        out.push_str(&format!("{} settings were refused (refused.csv)\n", report.refusals.len()));
    }
    out
}

/// Writes the rows of a study of tolerances, their summary and their provenance.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub fn write_tolerances(report: &ToleranceReport, out: OutputFolder) -> Result<(), Refusal> {
    write_all_or_none(out, |out| {
        write_table(&out.path("tolerances.csv"), &report.rows)?;
        write_bytes(&out.path("summary.md"), tolerances_text(report).as_bytes())?;
        write_json(&out.path("provenance.json"), &Origin::here(report.provenance.clone()))
    })
}

/// What became of each tolerance, with the scenes that missed it.
pub fn tolerances_text(report: &ToleranceReport) -> String {
    let mut rows: Vec<&ToleranceRow> = report.rows.iter().collect();
    rows.sort_by(|a, b| a.tolerance.total_cmp(&b.tolerance));
    let asked: Vec<&[&ToleranceRow]> = rows.chunk_by(|a, b| a.tolerance.to_bits() == b.tolerance.to_bits()).collect();
    let sum = |rows: &[&ToleranceRow], get: fn(&ToleranceRow) -> f64| rows.iter().map(|r| get(r)).sum::<f64>();
    let most = |rows: &[&ToleranceRow], get: fn(&ToleranceRow) -> f64| rows.iter().map(|r| get(r)).fold(0.0, f64::max);
    // not a number is not kept
    let kept = |row: &ToleranceRow| row.error <= row.tolerance;
    let table = Table::new("tolerances", &asked)
        .shown("asked", |rows| rows[0].tolerance)
        .shown("scenes", |rows| rows.len())
        .shown("kept", |rows| rows.iter().filter(|r| kept(r)).count())
        .shown("worst error / asked", |rows| most(rows, |r| r.error / r.tolerance))
        .digits(2)
        .shown("mean error", |rows| sum(rows, |r| r.error) / rows.len() as f64)
        .digits(3)
        .shown("finest not converged", |rows| rows.iter().filter(|r| r.finest_error > r.tolerance).count())
        .shown("finest takes, times", |rows| {
            let timed = rows.iter().filter_map(|r| Some([r.finest_cost_s?, r.cost_s]));
            let [finest_s, own_s] = timed.fold([0.0; 2], |sum, r| [sum[0] + r[0], sum[1] + r[1]]);
            finest_s / own_s
        })
        .digits(1);
    let mut out = format!(
        "Errors of the taxels' pressures against the finest level, and where halving its cells moved it by more than was \
         asked\n\n{}\n",
        table.text()
    );
    for row in rows.iter().filter(|r| !kept(r)) {
        out.push_str(&format!(
            "{} asked: {:.4} for {} of {} N, foam of {} m and {:e} Pa/m, pitch of {} m ({}, {} cells; expected {:.4})\n",
            row.tolerance,
            row.error,
            row.object,
            row.force_n,
            row.thickness_m,
            row.stiffness_pa_per_m,
            row.pitch_m,
            row.contact,
            row.cells_per_taxel,
            row.expected
        ));
    }
    if !report.refused.is_empty() {
        out.push_str(&format!(
            "{} scenes cannot be, such as: {}\n",
            report.refused.len(),
            report.refused[0].join(": ")
        ));
    }
    out
}

/// The check of a tolerance as a table, and whether it is met.
pub fn check_text(check: &ToleranceCheck) -> String {
    let rows = [("chosen", &check.chosen), ("full", &check.full)];
    let table = Table::new("check", &rows[..])
        .shown("chain", |(name, _)| *name)
        .shown("contact", |(_, c)| &c.contact)
        .shown("cells", |(_, c)| c.cells_per_taxel)
        .shown("step", |(_, c)| c.timestep_s)
        .unit("ms", 1e3)
        .shown("support", |(_, c)| c.support)
        .digits(3)
        .shown("IoU", |(_, c)| c.iou)
        .digits(3)
        .shown("class", |(_, c)| c.class)
        .digits(3)
        .shown("contact, s", |(_, c)| c.contact_s)
        .digits(2)
        .shown("readout and decoding, s", |(_, c)| c.readout_s)
        .digits(2);
    let ToleranceCheck { tolerance, difference, pressure_error, saves, .. } = check;
    let met = match tolerance {
        _ if check.met => "met",
        Tolerance::Iou(most) if check.full.iou <= *most => "NOT judged, since the full chain itself sees nothing here",
        Tolerance::Class(most) if check.full.class <= *most => "NOT judged, since the full chain itself knows no class",
        _ => "NOT met",
    };
    format!(
        "\n\n{}\ntolerance of {tolerance}: {met}, the difference is {difference:.4}; the taxels' pressures differ by \
         {pressure_error:.4}, and the full chain took {saves:.1} times as long",
        table.text()
    )
}

/// One contact model, resolution and time step on all scenes of one kind, presses or drops: at least one.
type Setting<'a> = Vec<&'a MeasuredSetting>;

/// Mean over the scenes.
fn mean(setting: &Setting<'_>, get: fn(&MeasuredSetting) -> f64) -> f64 {
    setting.iter().map(|r| get(r)).sum::<f64>() / setting.len() as f64
}

/// Every setting of the scenes of `task`, the cheapest level first.
fn settings<'a>(rows: &'a [MeasuredSetting], task: &str) -> Vec<Setting<'a>> {
    let key = |r: &&MeasuredSetting| {
        (LEVELS.iter().position(|level| level.name == r.level), r.cells_per_taxel, r.timestep_s.to_bits())
    };
    let mut rows: Setting<'_> = rows.iter().filter(|r| r.task == task).collect();
    rows.sort_by_key(key);
    let same = |a: &&MeasuredSetting, b: &&MeasuredSetting| key(a) == key(b) && a.cells == b.cells;
    rows.chunk_by(same).map(<[_]>::to_vec).collect()
}

/// What a fidelity level is called in tables.
fn label(name: &str) -> &str {
    FidelityLevel::named(name).map_or(name, |level| level.label)
}

/// Error against cost: one panel a kind of scene and quantity, one curve a level over its resolutions, at the time step
/// that a scene takes by itself. Pressures cost what the contact takes, scores what the whole chain takes.
fn pareto(rows: &[MeasuredSetting]) -> Vec<Chart> {
    type Quantity = fn(&MeasuredSetting) -> f64;
    let quantities: [(&str, Quantity, &str, Quantity); 2] = [
        ("taxel pressure, relative RMS error", |r| r.taxel_rms_rel, "contact alone", |r| r.cost_s_per_s),
        ("IoU of the support, size of the change", |r| r.iou_delta.abs(), "the whole chain", |r| r.chain_s),
    ];
    let mut charts = Vec::new();
    for (task, heading, step_s) in [("press", "Presses", 5e-4), ("drop", "Ball drop", 1e-4)] {
        let mut settings = settings(rows, task);
        settings.retain(|s| {
            let dynamic = FidelityLevel::named(&s[0].level).is_none_or(|level| level.dynamic);
            !dynamic || (s[0].timestep_s - step_s).abs() <= 1e-9
        });
        if settings.is_empty() {
            continue;
        }
        for (k, (y_label, quantity, of, cost)) in quantities.into_iter().enumerate() {
            let of_level = |(level, (style, variant)): (&FidelityLevel, (Style, u8))| {
                let own = settings.iter().filter(|s| s[0].level == level.name);
                let points = own.map(|s| (mean(s, cost), mean(s, quantity)));
                Series::new(level.label, style, variant, points.collect())
            };
            charts.push(Chart {
                title: format!("{heading}: {y_label}"),
                x_label: match k {
                    0 => format!("wall time of a simulated second, {of}, s"),
                    _ => format!("wall time of one {task}, {of}, s"),
                },
                y_label: y_label.to_owned(),
                x_log: true,
                // scores differ by shares of one, pressures by orders of magnitude
                y_log: k == 0,
                // every level, so that the panels share a legend
                series: LEVELS.iter().zip(STYLES).map(of_level).collect(),
                ..Chart::default()
            });
        }
    }
    charts
}

/// Ink of every level, in the order of [`LEVELS`].
const STYLES: [(Style, u8); 5] =
    [(Style::Baseline, 0), (Style::Raster, 0), (Style::Twin, 1), (Style::Twin, 0), (Style::Paper, 0)];

/// Side of the part of the skin that is shown, as a share of it.
const SHOWN: f64 = 0.9;

/// Fine pressure of every scene on every level at its finest measured step, at 6 × 6 cells a taxel or the finest there
/// is.
fn pressures(rows: &[MeasuredSetting], fine: &[FinePressure]) -> Sheet {
    let scenes = unique(rows.iter().map(|row| row.scene.as_str()));
    let tile = |scene: &str, level: &FidelityLevel| {
        let of = rows.iter().zip(fine).filter(|(row, _)| row.scene == scene && row.level == level.name);
        let best = of.min_by(|(a, _), (b, _)| {
            let coarse = |row: &MeasuredSetting| row.cells_per_taxel.abs_diff(6);
            coarse(a).cmp(&coarse(b)).then(a.timestep_s.total_cmp(&b.timestep_s))
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
        caption: format!("peak {:.0} kPa, error {:.1} %", peak_pa * 1e-3, 100.0 * row.pressure_rms_rel),
    }
}
