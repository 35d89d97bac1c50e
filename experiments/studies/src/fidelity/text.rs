//! The study as text: one line for each setting, with means over all scenes of a task.

use super::FidelityReport;
use spts_sim::fidelity::{FidelityLevel, LEVELS, MeasuredSetting};

/// Cost and error of one contact model, resolution and time step: means over all scenes of one kind, presses or drops.
#[derive(Debug, Clone, PartialEq)]
pub struct SettingMeans<'a> {
    /// Row of the first scene. All rows share its level, resolution and time step.
    pub first: &'a MeasuredSetting,
    /// Number of scenes with this setting.
    pub scenes: usize,
    /// Wall time of a time step, µs.
    pub cost_us_per_step: f64,
    /// Wall time of a simulated second, s.
    pub cost_s_per_s: f64,
    /// Error of the fine pressure, relative root mean square.
    pub pressure_rms_rel: f64,
    /// Error of the taxels' pressures, relative root mean square.
    pub taxel_rms_rel: f64,
    /// Largest error of the taxels' pressures over the scenes, relative root mean square.
    pub worst_taxel_rms_rel: f64,
    /// Absolute change of the support accuracy.
    pub support_change: f64,
    /// Absolute change of the intersection over union.
    pub iou_change: f64,
    /// Absolute change of the share of correctly classified windows.
    pub class_change: f64,
}

/// Every setting of the scenes of `task`, the cheapest level first; means over the scenes.
#[must_use]
pub fn setting_means<'a>(rows: &'a [MeasuredSetting], task: &str) -> Vec<SettingMeans<'a>> {
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

impl FidelityReport {
    /// Means over the scenes as a text table.
    #[must_use]
    pub fn text(&self) -> String {
        markdown(self)
    }
}

/// The means as Markdown tables, which are readable as plain text too.
fn markdown(report: &FidelityReport) -> String {
    let mut out = String::new();
    for (task, heading) in [("press", "Presses"), ("drop", "Drops")] {
        let lines = setting_means(&report.rows, task);
        if lines.is_empty() {
            continue;
        }
        out.push_str(&format!(
            "{heading}: mean over {} scenes; errors against the layer at its finest, changes of the scores in size\n\n",
            most_scenes(&lines)
        ));
        out.push_str(
            "| fidelity level    | cells   | step, ms | µs/step | s a second | pressure | taxels | worst  | support | IoU    | class  |\n\
             |-------------------|---------|---------:|--------:|-----------:|---------:|-------:|-------:|--------:|-------:|-------:|\n",
        );
        for o in &lines {
            out.push_str(&format!(
                "| {:<17} | {:<7} | {:>8} | {:>7.1} | {:>10.4} | {:>8.4} | {:>6.4} | {:>6.4} | {:>7.3} | {:>6.3} | {:>6.3} |\n",
                label(&o.first.level),
                o.first.cells,
                o.first.timestep_s * 1e3,
                o.cost_us_per_step,
                o.cost_s_per_s,
                o.pressure_rms_rel,
                o.taxel_rms_rel,
                o.worst_taxel_rms_rel,
                o.support_change,
                o.iou_change,
                o.class_change,
            ));
        }
        out.push('\n');
    }
    if !report.refusals.is_empty() {
        out.push_str(&format!(
            "{} settings were refused (refused.csv)\n",
            report.refusals.len()
        ));
    }
    out
}

fn most_scenes(lines: &[SettingMeans<'_>]) -> usize {
    lines.iter().map(|o| o.scenes).max().unwrap_or_default()
}
