//! `spts wire`: its page, its picture and its table.

use crate::figures::{Sheet, Tile, TileRow, save_sheet};
use crate::html::{Card, Page, PageFigure, PageTable, Section, html};
use spts::output::{OutputFolder, write_bytes};
use spts_eval::Table;
use spts_eval::decoders::short_label;
use spts_eval::unique;
use spts_input::Refusal;
use spts_models::SkinLayout;
use spts_recon::metrics::{SUPPORT_THRESHOLD, median, support};
use spts_studies::few_wires::{FewWires, FewWiresReport, Touched};
use spts_studies::frames::{FramesReport, LawCheck, ObjectFrames};

/// What a page is made from.
#[derive(Debug, Clone)]
pub struct FewWiresPage<'a> {
    /// Name of what was touched.
    pub title: String,
    /// The skin.
    pub layout: SkinLayout,
    /// Readout profile.
    pub readout: String,
    /// Results.
    pub report: &'a FewWiresReport,
    /// What the frames say of the skin.
    pub frames: &'a FramesReport,
    /// The touches.
    pub touches: &'a [Touched],
    /// What was assumed.
    pub notes: Vec<String>,
}

/// Side of a tile, CSS pixels.
const TILE_PX: usize = 120;
/// Kind of rows that are not designed.
const RANDOM: &str = "random";
/// Columns of images that the picture has at most beside the touch and the scan.
const MOST_COLUMNS: usize = 6;
/// Touches that the picture shows.
const SHOWN: usize = 5;

impl FewWiresPage<'_> {
    /// Writes `wire.html`, `figures/wire.svg`, `figures/wire.png`, and `wire.csv`, `frames.csv` and `laws.csv` in
    /// `tables/` into the folder `out`.
    ///
    /// # Errors
    /// [`Refusal`] when a file cannot be written.
    pub fn write(&self, out: &OutputFolder) -> Result<(), Refusal> {
        save_sheet(&self.sheet(), &out.folder("figures")?, "wire")?;
        let tables = out.folder("tables")?;
        table(self.report).write_csv(&tables.join("wire.csv"))?;
        objects(self.frames).write_csv(&tables.join("frames.csv"))?;
        laws(self.frames).write_csv(&tables.join("laws.csv"))?;
        write_bytes(&out.path("wire.html"), html(&self.page()).as_bytes())
    }

    /// The rows of the report that the picture shows: of every number of wires the measurements in the middle, with
    /// random rows, and with the designed ones that show most.
    fn columns(&self) -> Vec<&FewWires> {
        let mut found: Vec<&FewWires> = Vec::new();
        for wires in self.wires() {
            let own = || self.report.rows.iter().filter(move |row| row.wires == wires);
            let random: Vec<&FewWires> = own().filter(|row| row.rows == RANDOM).collect();
            let Some(middle) = random.get(random.len() / 2) else { continue };
            let designed = own().filter(|row| row.rows != RANDOM && row.m == middle.m);
            found.push(middle);
            found.extend(designed.max_by(|a, b| a.iou.total_cmp(&b.iou)));
        }
        found.truncate(MOST_COLUMNS);
        found
    }

    /// Numbers of wires, each once.
    fn wires(&self) -> Vec<usize> {
        unique(self.report.rows.iter().map(|row| row.wires))
    }

    fn sheet(&self) -> Sheet {
        let columns = self.columns();
        let head =
            |row: &&FewWires| format!("{} {}, {} rows, M = {}", row.wires, wire_word(row.wires), row.rows, row.m);
        let heat = |values: Vec<f64>, caption: String, outline: Option<Vec<bool>>| Tile::Heat {
            values,
            rows: self.layout.rows(),
            cols: self.layout.cols(),
            max: None,
            caption,
            outline,
        };
        let step = self.touches.len().div_ceil(SHOWN).max(1);
        let rows = self.touches.iter().enumerate().step_by(step).map(|(index, shown)| {
            let touch = shown.conductance.values();
            let mut mask = Vec::new();
            support(touch, SUPPORT_THRESHOLD, &mut mask);
            let peak = format!("peak {:.0} µS", 1e6 * shown.conductance.max());
            let of = |image: Vec<f64>| {
                let caption = format!("IoU {:.2}", shown.iou_of(&image));
                heat(image, caption, Some(mask.clone()))
            };
            let mut tiles = vec![heat(touch.to_vec(), peak, Some(mask.clone())), of(shown.scan.clone())];
            tiles.extend(columns.iter().map(|row| of(row.images.get(index).cloned().unwrap_or_default())));
            TileRow { label: shown.name.clone(), tiles }
        });
        let touched = format!("the touch; outlined: above {:.0} % of its peak", 100.0 * SUPPORT_THRESHOLD);
        let mut column_titles = vec![touched, "a scan of all taxels".to_owned()];
        column_titles.extend(columns.iter().map(head));
        let title = format!("{}: what one wire and a few would show", self.title);
        Sheet { title, column_titles, rows: rows.collect(), tile_px: TILE_PX }
    }

    fn page(&self) -> Page {
        let report = self.report;
        let [rows, cols] = [self.layout.rows(), self.layout.cols()];
        let best_of = |wires: usize| {
            let own = report.rows.iter().filter(move |row| row.wires == wires);
            own.max_by(|a, b| a.iou.total_cmp(&b.iou).then(b.m.cmp(&a.m)))
        };
        let cards = self.wires().into_iter().filter_map(best_of).map(|row| Card {
            label: format!("{} {}", row.wires, wire_word(row.wires)),
            of: format!("{} rows", row.rows),
            value: format!("IoU {:.2}", row.iou),
            others: vec![("a scan of all taxels".to_owned(), format!("{:.2}", report.scan_iou.unwrap_or(0.0)))],
            note: format!(
                "worst touch {:.2}; with {} measurements in {:.2} ms; a scan takes {:.2} ms",
                row.worst_iou,
                row.m,
                1e3 * row.time_s,
                1e3 * report.scan_s
            ),
        });
        let summary = format!(
            "{} touches of {rows} × {cols} taxels, measured in the simulation with the readout `{}` and decoded by `{}`, \
             which has seen none of them. IoU is the intersection over union of the image with the touch, both above {:.0} % \
             of their peak.{}",
            report.touches,
            self.readout,
            report.decoder,
            100.0 * SUPPORT_THRESHOLD,
            self.notes.iter().map(|note| format!("\n\nAssumed: {note}")).collect::<String>()
        );
        let figure = PageFigure::new(
            "wire",
            "Touches as tactile images, beside what a scan and a few wires show of them",
            "Touches, a scan of all taxels, and what is decoded of a few measurements by one wire and more. The outline is \
             the touch.",
        );
        let section = Section {
            id: "wires".to_owned(),
            title: "One wire and a few".to_owned(),
            lead:
                "Every wire reads a band of whole rows of taxels, all at the same time. Random rows have mixed seeds; \
                   designed ones repeat at most 64 rows."
                    .to_owned(),
            figures: vec![figure],
            tables: vec![PageTable::new("Images and signals", &table(report), "wire")],
        };
        let mut tables = vec![PageTable::new("Presses", &objects(self.frames), "frames")];
        if !self.frames.laws.is_empty() {
            tables.push(PageTable::new("Laws of the simulated transducer", &laws(self.frames), "laws"));
        }
        let frames = Section {
            id: "frames".to_owned(),
            title: "What the frames say".to_owned(),
            lead: format!(
                "How well the presses of an object repeat, and how far they drift while they are held. {} {}",
                medians(self.frames),
                ceiling(report)
            ),
            figures: Vec::new(),
            tables,
        };
        Page {
            title: format!("{}: one wire and a few", self.title),
            summary,
            cards: cards.collect(),
            sections: vec![section, frames],
            ..Page::default()
        }
    }
}

/// The rows of a report, for files and readers.
pub fn table(report: &FewWiresReport) -> Table<'_, &FewWires> {
    Table::new("wire", &report.rows)
        .column("wires", "wires", |r| r.wires)
        .column("rows", "rows", |r| r.rows.as_str())
        .column("m_per_wire", "M a wire", |r| r.m_per_wire)
        .column("m", "M", |r| r.m)
        .file("time_s", |r| r.time_s)
        .number("time, ms", 2, |r| 1e3 * r.time_s)
        .column("iou", "IoU", |r| r.iou)
        .digits(2)
        .column("worst_iou", "worst touch", |r| r.worst_iou)
        .digits(2)
        .column("worst", "which", |r| r.worst.as_str())
        .column("left_out_iou", "IoU, left out", |r| r.left_out_iou)
        .digits(2)
        .column("classes", "recognised", |r| r.classes)
        .digits(2)
        .column("saturated", "saturated", |r| r.saturated)
        .digits(3)
        .column("used", "range used", |r| r.used)
        .digits(2)
        .column("signal_to_noise", "signal to noise", |r| r.signal_to_noise)
        .digits(1)
}

/// The presses of every object.
fn objects(report: &FramesReport) -> Table<'_, &ObjectFrames> {
    Table::new("frames", &report.objects)
        .column("object", "object", |o| o.object.as_str())
        .column("presses", "presses", |o| o.presses)
        .column("touched", "taxels", |o| o.touched)
        .column("repeatability", "images alike, r", |o| o.repeatability)
        .digits(4)
        .column("spread", "sums differ by", |o| o.spread)
        .unit("%", 100.0)
        .digits(1)
        .column("drift", "drift of the hold", |o| o.drift)
        .unit("%", 100.0)
        .digits(1)
}

/// How far the laws of the simulated transducer hold.
fn laws(report: &FramesReport) -> Table<'_, &LawCheck> {
    Table::new("laws", &report.laws)
        .column("law", "law", |l| l.law)
        .column("fitted", "fitted", |l| l.fitted)
        .digits(3)
        .column("twin", "simulation's", |l| l.twin)
        .digits(3)
        .file("fitted_on", |l| l.objects[0])
        .file("held_against", |l| l.objects[1])
        .shown("objects, fitted and others", |l| format!("{} and {}", l.objects[0], l.objects[1]))
        .column("without", "error without the law", |l| l.without)
        .unit("%", 100.0)
        .digits(2)
        .column("with_fitted", "with the fitted value", |l| l.with_fitted)
        .unit("%", 100.0)
        .digits(2)
        .column("with_twin", "with the simulation's", |l| l.with_twin)
        .unit("%", 100.0)
        .digits(2)
        .column("worst", "worst object", |l| l.worst.0.as_str())
        .column("worst_error", "its error", |l| l.worst.1)
        .unit("%", 100.0)
        .digits(2)
}

/// The medians over the objects of what their presses have.
fn medians(report: &FramesReport) -> String {
    let of = |get: fn(&ObjectFrames) -> Option<f64>| median(&report.objects.iter().filter_map(get).collect::<Vec<_>>());
    let said = [
        of(|o| o.repeatability).map(|r| format!("images alike r = {r:.4}")),
        of(|o| o.spread).map(|spread| format!("sums differ by {:.1} %", 100.0 * spread)),
        of(|o| o.drift).map(|drift| format!("drift of the hold {:.1} %", 100.0 * drift)),
    ];
    let said = said.into_iter().flatten().collect::<Vec<_>>().join(", ");
    if said.is_empty() { String::new() } else { format!("Medians of the objects: {said}.") }
}

/// What a scan and another press of the same object have.
fn ceiling(report: &FewWiresReport) -> String {
    let again = report.again_iou.map(|iou| format!("; another press of the same object has {iou:.2}"));
    let classes = report.scan_classes.map(|share| format!(", {share:.2} of its images are recognised"));
    format!(
        "A scan of all taxels takes {:.2} ms and has an IoU of {:.2}{}{}.",
        1e3 * report.scan_s,
        report.scan_iou.unwrap_or(0.0),
        classes.unwrap_or_default(),
        again.unwrap_or_default()
    )
}

/// The tables as text, with what they are of.
pub fn text(report: &FewWiresReport, frames: &FramesReport) -> String {
    let laws = if frames.laws.is_empty() { String::new() } else { format!("{}\n", laws(frames).text()) };
    format!(
        "{}{}\n\n{laws}{}{} touches of {}, decoder {}. {}",
        objects(frames).text(),
        medians(frames),
        table(report).text(),
        report.touches,
        if report.objects == 1 { "one object".to_owned() } else { format!("{} objects", report.objects) },
        short_label(report.decoder),
        ceiling(report)
    )
}

fn wire_word(wires: usize) -> &'static str {
    if wires == 1 { "wire" } else { "wires" }
}
