//! The files of a budget.

use crate::figures::{BarChart, BarGroup, BarRow, Style, save_bars};
use crate::{ReportError, write_all_or_none};
use spts::output::{OutputFolder, write_bytes, write_json, write_table};
use spts_eval::decoders::short_label;
use spts_studies::budget::{BudgetReport, BudgetRow, CONTACT, Change, Direction, MeanWithError, WHOLE_STAGE};

/// Files outside of folders of their own.
pub const FILES: &[&str] = &["budget.csv", "end_points.csv", "summary.md", "provenance.json"];

/// Writes the tables, their summary, the figures and the provenance of `report` into the folder `out`.
///
/// # Errors
/// [`ReportError`] when a file cannot be written or a figure cannot be drawn.
pub fn write(report: &BudgetReport, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        write_table(&out.path("budget.csv"), &report.rows)?;
        write_table(&out.path("end_points.csv"), &report.end_points)?;
        write_bytes(&out.path("summary.md"), report.markdown().as_bytes())?;
        let folder = out.folder("figures")?;
        for decode in report.decodes() {
            for (name, truth, iou) in [
                ("budget", "truth from the raster scan", BudgetRow::iou as Change),
                ("contact", "truth from the contact alone", BudgetRow::iou_contact),
            ] {
                let chart = bars(report, decode, truth, iou);
                save_bars(&chart, &folder, &format!("{name}_{decode}"))?;
            }
        }
        write_json(&out.path("provenance.json"), &report.provenance)?;
        Ok(())
    })
}

/// IoU lost to every effect with `decode`, one panel an M: when the effect is taken from the whole chain, and when it
/// is added to the ideal one. `iou` is the IoU's change by the truth called `truth`.
fn bars(report: &BudgetReport, decode: &str, truth: &str, iou: Change) -> BarChart {
    let measurements = report.measurements();
    let rows = report.effects().into_iter().map(|effect| {
        let (stage, name) = effect;
        let lost = |m: usize| {
            let find = |direction| report.find(effect, direction, (decode, m)).map(iou);
            let pair = |e: MeanWithError| (e.mean, e.se);
            let removed = find(Direction::Ablation).map(pair);
            // adding an effect loses what it lowers the score by
            let added = find(Direction::Addition).map(|e| pair(MeanWithError { mean: -e.mean, ..e }));
            vec![removed, added]
        };
        let heading = name == WHOLE_STAGE;
        BarRow {
            label: if heading {
                stage.to_owned()
            } else {
                readable(stage, name)
            },
            heading,
            values: measurements.iter().map(|&m| lost(m)).collect(),
        }
    });
    BarChart {
        title: format!("IoU lost to each effect, {} decode, {truth}", short_label(decode)),
        x_label: "IoU lost".to_owned(),
        panels: measurements.iter().map(|m| format!("M = {m}")).collect(),
        groups: [
            ("regained when taken from the whole chain", Style::Twin),
            ("lost when added to the ideal chain", Style::Raster),
        ]
        .map(|(name, style)| BarGroup {
            name: name.to_owned(),
            style,
        })
        .to_vec(),
        rows: rows.collect(),
    }
}

fn readable(stage: &str, effect: &str) -> String {
    if stage == CONTACT {
        return "contact: columns → elastic layer".to_owned();
    }
    effect.replace('_', " ")
}
