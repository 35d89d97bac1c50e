//! `spts wire`: its page, its picture and its table.

use crate::figures::{Sheet, Tile, TileRow, save_sheet};
use crate::html::{Card, Page, PageFigure, PageTable, Section, html};
use spts::output::{OutputFolder, write_bytes};
use spts_eval::Table;
use spts_eval::decoders::short_label;
use spts_eval::unique;
use spts_input::Refusal;
use spts_models::{ConductanceMap, SkinLayout};
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
use spts_studies::few_wires::{FewWires, FewWiresReport};

/// A touch that is shown: its name, what the frames have, and what a scan of the same skin has.
#[derive(Debug, Clone)]
pub struct ShownTouch {
    /// Name.
    pub name: String,
    /// Number of the touch in the report.
    pub index: usize,
    /// Conductance of every taxel, S.
    pub touch: ConductanceMap,
    /// The scan, V.
    pub scan: Vec<f64>,
}

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
    /// The touches that are shown.
    pub shown: Vec<ShownTouch>,
    /// Mean IoU of the scan with the frames.
    pub scan_iou: f64,
    /// What was assumed.
    pub notes: Vec<String>,
}

/// Side of a tile, CSS pixels.
const TILE_PX: usize = 120;
/// Kind of rows that are not designed.
const RANDOM: &str = "random";
/// Columns of images that the picture has at most beside the touch and the scan.
const MOST_COLUMNS: usize = 6;

impl FewWiresPage<'_> {
    /// Writes `wire.html`, `figures/wire.svg`, `figures/wire.png` and `tables/wire.csv` into the folder `out`.
    ///
    /// # Errors
    /// [`Refusal`] when a file cannot be written.
    pub fn write(&self, out: &OutputFolder) -> Result<(), Refusal> {
        save_sheet(&self.sheet(), &out.folder("figures")?, "wire")?;
        table(self.report).write_csv(&out.folder("tables")?.join("wire.csv"))?;
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
        let rows = self.shown.iter().map(|shown| {
            let iou = |image: &[f64]| SupportScore::of_images(image, shown.touch.values()).iou;
            let mut mask = Vec::new();
            support(shown.touch.values(), SUPPORT_THRESHOLD, &mut mask);
            let mut tiles = vec![
                heat(
                    shown.touch.values().to_vec(),
                    format!("peak {:.0} µS", 1e6 * shown.touch.max()),
                    Some(mask.clone()),
                ),
                heat(shown.scan.clone(), format!("IoU {:.2}", iou(&shown.scan)), Some(mask.clone())),
            ];
            tiles.extend(columns.iter().map(|row| {
                let image = row.images.get(shown.index).cloned().unwrap_or_default();
                let caption = format!("IoU {:.2}", iou(&image));
                heat(image, caption, Some(mask.clone()))
            }));
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
            others: vec![("a scan of all taxels".to_owned(), format!("{:.2}", self.scan_iou))],
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
        Page {
            title: format!("{}: one wire and a few", self.title),
            summary,
            cards: cards.collect(),
            sections: vec![section],
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
        .column("saturated", "saturated", |r| r.saturated)
        .digits(3)
        .column("used", "range used", |r| r.used)
        .digits(2)
        .column("signal_to_noise", "signal to noise", |r| r.signal_to_noise)
        .digits(1)
}

/// The table as text, with what it is of.
pub fn text(report: &FewWiresReport, scan_iou: f64) -> String {
    format!(
        "{}{} touches, decoder {}; a scan of all taxels takes {:.2} ms: IoU {scan_iou:.2}",
        table(report).text(),
        report.touches,
        short_label(report.decoder),
        1e3 * report.scan_s
    )
}

fn wire_word(wires: usize) -> &'static str {
    if wires == 1 { "wire" } else { "wires" }
}
