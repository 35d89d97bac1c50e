//! `spts budget` as text, files and figures.

use crate::figures::{BarChart, BarGroup, BarRow, Style, save_bars};
use crate::write_all_or_none;
use serde::Serialize;
use spts::output::{OutputFolder, write_bytes, write_json};
use spts::provenance::Provenance;
use spts_eval::decoders::short_label;
use spts_eval::{Table, unique};
use spts_input::Refusal;
use spts_recon::statistics::Sample;
use spts_studies::budget::{
    BudgetReport, BudgetRow, CHANCE, CHANGES, CONTACT, Direction, EndPoint, WHOLE_STAGE, stands_out,
};

/// Headings of [`CHANGES`], in the order in which readers see them: place of the change, and what it is called.
const SHOWN: [(usize, &str); CHANGES.len()] =
    [(0, "support"), (IOU, "IoU"), (IOU_CONTACT, "IoU, contact"), (2, "class"), (3, "vote of 20")];
/// Place of the intersection over union in [`CHANGES`], and of that with the truth of the contact alone.
const IOU: usize = 1;
const IOU_CONTACT: usize = 4;

/// What `--json` prints.
pub fn json(report: &BudgetReport) -> impl Serialize + '_ {
    #[derive(Serialize)]
    struct Printed<'a> {
        rows: Table<'a, &'a BudgetRow>,
        end_points: Table<'a, &'a EndPoint>,
        provenance: &'a Provenance,
    }
    Printed { rows: costs(&report.rows), end_points: end_points(report), provenance: &report.provenance }
}

/// Writes the tables, their summary, the figures and the provenance of `report` into the folder `out`.
///
/// # Errors
/// [`Refusal`] when a file cannot be written or a figure cannot be drawn.
pub fn write(report: &BudgetReport, out: OutputFolder) -> Result<(), Refusal> {
    write_all_or_none(out, |out| {
        costs(&report.rows).write(out)?;
        end_points(report).write(out)?;
        write_bytes(&out.path("summary.md"), markdown(report).as_bytes())?;
        let folder = out.folder("figures")?;
        for decode in decodes(report) {
            for (name, truth, change) in [
                ("budget", "truth from the raster scan", IOU),
                ("contact", "truth from the contact alone", IOU_CONTACT),
            ] {
                save_bars(&bars(report, decode, truth, change), &folder, &format!("{name}_{decode}"))?;
            }
        }
        write_json(&out.path("provenance.json"), &report.provenance)?;
        Ok(())
    })
}

fn costs(rows: &[BudgetRow]) -> Table<'_, &BudgetRow> {
    let mut table = Table::new("budget", rows)
        .file("stage", |r| r.stage)
        .file("effect", |r| r.effect)
        .file("mode", |r| r.mode.name())
        .file("decode", |r| r.decode)
        .file("m", |r| r.m)
        .file("taxels", |r| r.taxels)
        .file("sessions", |r| r.changes[0].count);
    for (place, name) in CHANGES.into_iter().enumerate() {
        table = table
            .file(format!("{name}_delta"), move |r| r.changes[place].mean)
            .file(format!("{name}_se"), move |r| r.changes[place].standard_error());
    }
    table
}

fn end_points(report: &BudgetReport) -> Table<'_, &EndPoint> {
    let mut table = Table::new("end_points", &report.end_points)
        .column("chain", "chain", |p| p.chain)
        .file("decode", |p| p.decode)
        .shown("decode", |p| short_label(p.decode))
        .column("m", "M", |p| p.m)
        .file("taxels", |p| p.taxels)
        .column("truth", "truth", |p| p.truth);
    let scores = [("support", "support"), ("iou", "IoU"), ("class_single", "class"), ("class_vote20", "vote of 20")];
    for (place, (key, head)) in scores.into_iter().enumerate() {
        table = table
            // the scan is one press, and nothing votes
            .column(key, head, move |p| (place < 3 || !p.is_scan()).then_some(p.scores[place].mean))
            .digits(3)
            .file(format!("{key}_se"), move |p| (!p.is_scan()).then_some(p.scores[place].standard_error()));
    }
    table
}

/// Stage and effect of every row, without duplicates.
fn effects(report: &BudgetReport) -> Vec<(&'static str, &'static str)> {
    unique(report.rows.iter().map(|r| (r.stage, r.effect)))
}

fn decodes(report: &BudgetReport) -> Vec<&'static str> {
    unique(report.rows.iter().map(|r| r.decode))
}

fn measurements(report: &BudgetReport) -> Vec<usize> {
    unique(report.rows.iter().map(|r| r.m))
}

/// The change with the place `change` of an effect; `None` if it was not measured.
fn find(
    report: &BudgetReport,
    (stage, effect): (&str, &str),
    direction: Direction,
    (decode, m): (&str, usize),
    change: usize,
) -> Option<Sample> {
    let key = (stage, effect, direction, decode, m);
    let mut rows = report.rows.iter();
    let row = rows.find(|r| (r.stage, r.effect, r.mode, r.decode, r.m) == key)?;
    Some(row.changes[change])
}

/// The end points and the change of the IoU with every effect, as tables to read.
pub fn text(report: &BudgetReport) -> String {
    let mut out = end_points(report).text() + &unexplained(&report.end_points);
    for decode in decodes(report) {
        out.push_str(&format!(
            "\n{}: change of the IoU without each effect (against everything) and with it alone (against ideal)\n\n",
            short_label(decode)
        ));
        let columns = measurements(report).into_iter().flat_map(|m| {
            let without = (format!("without, M = {m}"), Direction::Ablation, m, IOU);
            [without, (format!("alone, M = {m}"), Direction::Addition, m, IOU)]
        });
        out.push_str(&by_effect(report, decode, &columns.collect::<Vec<_>>()));
    }
    out + &footnote(report, &[IOU])
}

/// The overview and, for every decode and M, every score.
fn markdown(report: &BudgetReport) -> String {
    let mut out = text(report);
    for decode in decodes(report) {
        for m in measurements(report) {
            for (direction, heading) in [
                (Direction::Ablation, "without each effect, against everything"),
                (Direction::Addition, "with each effect alone, against ideal"),
            ] {
                out.push_str(&format!("\n{}, M = {m}, {heading}\n\n", short_label(decode)));
                let columns = SHOWN.map(|(change, head)| (head.to_owned(), direction, m, change));
                out.push_str(&by_effect(report, decode, &columns));
            }
        }
    }
    out + &footnote(report, &SHOWN.map(|(change, _)| change))
}

/// One line an effect, with columns of a heading, direction, M and change; lines without any cell are left out.
fn by_effect(report: &BudgetReport, decode: &str, columns: &[(String, Direction, usize, usize)]) -> String {
    let rows = effects(report).into_iter().filter(|effect| {
        let mut found =
            columns.iter().map(|(_, direction, m, change)| find(report, *effect, *direction, (decode, *m), *change));
        found.any(|cell| cell.is_some())
    });
    let mut table = Table::new("", rows)
        .shown("stage", |(stage, _)| stage)
        .shown("effect", |(_, effect)| if effect == WHOLE_STAGE { "all of it" } else { effect });
    for (head, direction, m, change) in columns {
        table = table.shown(head, move |effect| {
            let cell = find(report, effect, *direction, (decode, *m), *change)?;
            let mark = if stands_out(&cell) { "*" } else { "" };
            Some(format!("{:+.3} ± {:.3}{mark}", cell.mean, cell.standard_error()))
        });
    }
    table.text()
}

/// What the signs mean, and how many stars are nothing but chance among the changes `shown` of every row.
fn footnote(report: &BudgetReport, shown: &[usize]) -> String {
    let numbers = report.rows.iter().flat_map(|row| shown.iter().map(|change| row.changes[*change]));
    let moved: Vec<Sample> = numbers.filter(|number| number.mean.abs() > 0.0 || number.variance > 0.0).collect();
    let (all, stars) = (moved.len(), moved.iter().filter(|number| stands_out(number)).count());
    let sessions = report.rows.first().map_or(0, |row| row.changes[0].count);
    format!(
        "\n± one standard error over {sessions} sessions: presses, gains, noise and dictionaries; * further from 0 than chance brings it \
         in {:.0} % (Student's t).\n{stars} of {all} numbers that are not 0 throughout have a *; chance alone gives about {:.1}.\n",
        CHANCE * 100.0,
        CHANCE * all as f64,
    )
}

/// What no effect explains: the ideal chain's distance from 1, part by part.
fn unexplained(points: &[EndPoint]) -> String {
    let mut out = String::from(
        "\nIoU that the ideal chain loses to the decoder, and to the noise of the frame that is the truth:\n",
    );
    let ideal = |truth| points.iter().filter(move |p| p.chain == "ideal" && p.truth == truth);
    for (image, raster) in ideal("image").zip(ideal("raster")) {
        let [image_iou, raster_iou] = [image, raster].map(|point| point.scores[IOU].mean);
        out.push_str(&format!(
            "{}, M = {}: {:.3}, {:.3}\n",
            short_label(image.decode),
            image.m,
            1.0 - image_iou,
            image_iou - raster_iou
        ));
    }
    out
}

/// IoU lost to every effect with `decode`, one panel an M: when the effect is taken from the whole chain, and when it
/// is added to the ideal one. `change` is the place of the IoU's change by the truth called `truth`.
fn bars(report: &BudgetReport, decode: &str, truth: &str, change: usize) -> BarChart {
    let all = measurements(report);
    let rows = effects(report).into_iter().map(|effect| {
        let (stage, name) = effect;
        let lost = |m: usize| {
            let change_of = |direction| find(report, effect, direction, (decode, m), change);
            let removed = change_of(Direction::Ablation).map(|change| (change.mean, change.standard_error()));
            // adding an effect loses what it lowers the score by
            let added = change_of(Direction::Addition).map(|change| (-change.mean, change.standard_error()));
            vec![removed, added]
        };
        let heading = name == WHOLE_STAGE;
        BarRow {
            label: if heading { stage.to_owned() } else { readable(stage, name) },
            heading,
            values: all.iter().map(|&m| lost(m)).collect(),
        }
    });
    BarChart {
        title: format!("IoU lost to each effect, {} decode, {truth}", short_label(decode)),
        x_label: "IoU lost".to_owned(),
        panels: all.iter().map(|m| format!("M = {m}")).collect(),
        groups: [
            ("regained when taken from the whole chain", Style::Twin),
            ("lost when added to the ideal chain", Style::Raster),
        ]
        .map(|(name, style)| BarGroup { name: name.to_owned(), style })
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
