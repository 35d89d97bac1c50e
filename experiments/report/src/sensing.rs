//! Files and figures of `spts sensing design`.

use crate::figures::{Sheet, Tile, TileRow, save_sheet};
use crate::write_all_or_none;
use spts::chain::start_message;
use spts::output::{OutputFolder, write_bytes, write_json};
use spts_circuit::FIRST_ADDRESS;
use spts_eval::Table;
use spts_firmware::LAST_BUS_ADDRESS;
use spts_input::Refusal;
use spts_studies::sensing::RowDesignReport;

/// Rows that are drawn, at most.
const SHOWN: usize = 40;
/// Rows of the sensing matrix a line of the figure.
const A_LINE: usize = 8;
/// Side of a row's picture, CSS pixels.
const TILE_PX: usize = 96;

/// Writes the rows, what they are like, what is written to the cells, and a picture of every row into the folder `out`:
/// all of them, or none.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub fn write(report: &RowDesignReport, out: OutputFolder) -> Result<(), Refusal> {
    write_all_or_none(out, |out| {
        write_bytes(&out.path("rows.txt"), report.patterns.to_text().as_bytes())?;
        write_json(&out.path("design.json"), report)?;
        write_json(&out.path("weights.json"), &report.weights)?;
        if let Some(writes) = writes(report) {
            Table::new("bus", &writes)
                .file("taxel", |(taxel, ..)| *taxel)
                .file("address", |(_, address, _)| *address)
                .file("bytes", |(.., bytes)| bytes)
                .write(out)?;
        }
        if let Some(seeds) = &report.seeds {
            let cols = report.skin[1].max(1);
            let lines = seeds.chunks(cols).map(|row| {
                let words: Vec<String> = row.iter().map(|seed| format!("0x{seed:08x}")).collect();
                words.join(" ") + "\n"
            });
            write_bytes(&out.path("seeds.txt"), lines.collect::<String>().as_bytes())?;
        }
        save_sheet(&rows(report), &out.folder("figures")?, "rows")?;
        Ok(())
    })
}

/// What the master writes to give every cell its pattern: taxel, address, and bytes in hexadecimal in the order they
/// are sent, which are mode, number of bits and bits. `None` unless one bus has addresses for all of them and the cells
/// hold it.
fn writes(report: &RowDesignReport) -> Option<Vec<(usize, u8, String)>> {
    report.bytes_a_cell?;
    let write = |taxel: usize| {
        let address = u8::try_from(FIRST_ADDRESS as usize + taxel).ok()?;
        let bytes = start_message(&report.weights, taxel, address).ok()?;
        let bytes: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        (address <= LAST_BUS_ADDRESS).then(|| (taxel, address, bytes.join(" ")))
    };
    (0..report.patterns.taxels()).map(write).collect()
}

/// Every row as a picture of the skin: dark −1, bright +1.
fn rows(report: &RowDesignReport) -> Sheet {
    let [rows, cols] = report.skin;
    let tile = |r: usize| Tile::Heat {
        values: report.patterns.row(r as u64).iter().map(|code| f64::from(*code)).collect(),
        rows,
        cols,
        max: Some(255.0),
        caption: format!("row {r}"),
        outline: None,
    };
    let shown: Vec<usize> = (0..report.m.min(SHOWN)).collect();
    let lines = shown
        .chunks(A_LINE)
        .map(|line| TileRow { label: String::new(), tiles: line.iter().map(|r| tile(*r)).collect() });
    let first = if report.m > SHOWN { format!("first {SHOWN} of ") } else { String::new() };
    Sheet {
        title: format!("{}: {first}{} rows, bright +1, dark −1", report.label, report.m),
        column_titles: Vec::new(),
        rows: lines.collect(),
        tile_px: TILE_PX,
    }
}
