//! The figure of a budget.

use crate::figures::{BarChart, BarGroup, BarRow, Style};
use spts_eval::decoders::short_label;
use spts_studies::budget::{BudgetReport, CONTACT, Change, Direction, MeanWithError, WHOLE_STAGE};

/// IoU lost to every effect with `decode`, one panel an M: when the effect is taken from the whole chain, and when it
/// is added to the ideal one. `iou` is the IoU's change by the truth called `truth`.
pub(super) fn bars(report: &BudgetReport, decode: &str, truth: &str, iou: Change) -> BarChart {
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
