//! The budget in words.

use super::estimate::{CHANCE, MeanWithError};
use super::report::BudgetReport;
use super::table::{BudgetRow, Change, EndPoint};
use super::variants::{Direction, WHOLE_STAGE};
use spts_eval::decoders::short_label;

/// Changes of all scores, with their headings.
const CHANGES: [(&str, Change); 5] = [
    ("support", |r| r.change(r.support_delta, r.support_se)),
    ("IoU", BudgetRow::iou),
    ("IoU, contact", BudgetRow::iou_contact),
    ("class", |r| r.change(r.class_single_delta, r.class_single_se)),
    ("vote of 20", |r| r.change(r.class_vote20_delta, r.class_vote20_se)),
];

impl BudgetReport {
    /// The end points and the change of the IoU with every effect, as tables to read.
    #[must_use]
    pub fn text(&self) -> String {
        overview(self)
    }

    /// Every score of every effect, as Markdown tables.
    #[must_use]
    pub fn markdown(&self) -> String {
        markdown(self)
    }
}

/// End points and the change of the IoU with every effect.
fn overview(report: &BudgetReport) -> String {
    let mut out = ends(report);
    for decode in report.decodes() {
        out.push_str(&format!(
            "\n{}: change of the IoU without each effect (against everything) and with it alone (against ideal)\n\n",
            short_label(decode)
        ));
        let mut heads = Vec::new();
        for m in report.measurements() {
            heads.extend([format!("without, M = {m}"), format!("alone, M = {m}")]);
        }
        out.push_str(&table(report, &heads, &|stage, effect| {
            let of = |m| move |direction| report.find((stage, effect), direction, (decode, m)).map(BudgetRow::iou);
            let cells = report.measurements().into_iter().map(of);
            cells
                .flat_map(|find| [find(Direction::Ablation), find(Direction::Addition)])
                .collect()
        }));
    }
    out.push_str(&footnote(report, &[BudgetRow::iou]));
    out
}

/// What the signs mean, and how many stars are nothing but chance among the numbers `shown` of every row.
fn footnote(report: &BudgetReport, shown: &[Change]) -> String {
    let numbers = report.rows.iter().flat_map(|row| shown.iter().map(move |get| get(row)));
    let (all, stars) = numbers.fold((0_usize, 0_usize), |(all, stars), number| {
        (
            all + usize::from(number.can_stand_out()),
            stars + usize::from(number.stands_out()),
        )
    });
    let sessions = report.rows.first().map_or(0, |row| row.sessions);
    format!(
        "\n± one standard error over {sessions} sessions: presses, gains, noise and dictionaries; * further from 0 than chance brings it \
         in {:.0} % (Student's t).\n{stars} of {all} numbers that are not 0 throughout have a *; chance alone gives about {:.1}.\n",
        CHANCE * 100.0,
        CHANCE * all as f64,
    )
}

/// The overview and, for every decode and M, every score.
fn markdown(report: &BudgetReport) -> String {
    let mut out = overview(report);
    for decode in report.decodes() {
        for m in report.measurements() {
            for (direction, heading) in [
                (Direction::Ablation, "without each effect, against everything"),
                (Direction::Addition, "with each effect alone, against ideal"),
            ] {
                out.push_str(&format!("\n{}, M = {m}, {heading}\n\n", short_label(decode)));
                let heads: Vec<String> = CHANGES.iter().map(|(head, _)| (*head).to_owned()).collect();
                out.push_str(&table(report, &heads, &|stage, effect| {
                    let row = report.find((stage, effect), direction, (decode, m));
                    CHANGES.iter().map(|(_, change)| row.map(change)).collect()
                }));
            }
        }
    }
    out.push_str(&footnote(report, &CHANGES.map(|(_, change)| change)));
    out
}

/// One line an effect; lines without any cell are left out.
fn table(report: &BudgetReport, heads: &[String], cells: &dyn Fn(&str, &str) -> Vec<Option<MeanWithError>>) -> String {
    let mut out = format!("| {:<11} | {:<14} |", "stage", "effect");
    heads.iter().for_each(|head| out.push_str(&format!(" {head:>17} |")));
    out.push_str(&format!("\n|{:-<13}|{:-<16}|", "", ""));
    heads.iter().for_each(|_| out.push_str(&format!("{:->18}:|", "")));
    out.push('\n');
    for (stage, effect) in report.effects() {
        let cells = cells(stage, effect);
        if cells.iter().all(Option::is_none) {
            continue;
        }
        let name = if effect == WHOLE_STAGE { "all of it" } else { effect };
        out.push_str(&format!("| {stage:<11} | {name:<14} |"));
        for cell in cells {
            let text = cell.map_or_else(|| "–".to_owned(), show);
            out.push_str(&format!(" {text:>17} |"));
        }
        out.push('\n');
    }
    out
}

fn show(change: MeanWithError) -> String {
    let mark = if change.stands_out() { "*" } else { " " };
    format!("{:+.3} ± {:.3}{mark}", change.mean, change.se)
}

/// End points with the published truth, and what that truth is worth.
fn ends(report: &BudgetReport) -> String {
    let mut out = String::from(
        "| chain       | decode           |    M | truth   | support | IoU   | class | vote of 20 |\n\
         |-------------|------------------|-----:|---------|--------:|------:|------:|-----------:|\n",
    );
    for p in &report.end_points {
        out.push_str(&format!(
            "| {:<11} | {:<16} | {:>4} | {:<7} | {:>7.3} | {:.3} | {:.3} | {:>10} |\n",
            p.chain,
            short_label(p.decode),
            p.m,
            p.truth,
            p.support,
            p.iou,
            p.class_single,
            p.class_vote20.map_or_else(|| "–".to_owned(), |v| format!("{v:.3}")),
        ));
    }
    out.push_str(&unexplained(&report.end_points));
    out
}

/// What no effect explains: the ideal chain's distance from 1, part by part.
fn unexplained(points: &[EndPoint]) -> String {
    let mut out = String::from(
        "\nIoU that the ideal chain loses to the decoder, and to the noise of the frame that is the truth:\n",
    );
    let ideal = |truth| points.iter().filter(move |p| p.chain == "ideal" && p.truth == truth);
    for (image, raster) in ideal("image").zip(ideal("raster")) {
        out.push_str(&format!(
            "{}, M = {}: {:.3}, {:.3}\n",
            short_label(image.decode),
            image.m,
            1.0 - image.iou,
            image.iou - raster.iou
        ));
    }
    out
}
