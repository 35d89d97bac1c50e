//! Files and figures of `spts seeds`.

mod picture;

use super::{ReportError, write_all_or_none};
use crate::figures::{save_charts, save_sheet};
use serde::Serialize;
use spts::output::{OutputFolder, write_bytes, write_json, write_table};
use spts_circuit::{FIRST_ADDRESS, PROFILES, WeightMode};
use spts_firmware::{CellMode, LAST_BUS_ADDRESS};
use spts_studies::seeds::{SeedFacts, SeedReport, SeedSet};
use std::fmt::Write as _;

/// Sets that are written as files of their own.
const PROPOSALS: [&str; 3] = ["mixed", "searched", "bytes"];

/// What the master writes to a cell.
#[derive(Debug, Serialize)]
struct BusWrite {
    taxel: usize,
    address: u8,
    seed: u32,
    /// Bytes in hexadecimal, in the order they are sent: mode and one byte of seed, or mode with 0x80 and four.
    bytes: String,
}

/// A line of `facts.csv`: constant rows as one field.
#[derive(Debug, Serialize)]
struct FactsLine<'a> {
    seeds: &'a str,
    taxels: usize,
    period_rows: u64,
    least_phase_rows: u64,
    constant_rows: String,
    nearly_constant_share: f64,
    first_rank: usize,
}

/// Files outside of folders of their own.
pub const FILES: &[&str] = &[
    "facts.csv",
    "windows.csv",
    "worth.csv",
    "seeds.json",
    "readout_mixed.toml",
];

/// Writes tables, proposals and figures into the folder `out`: all of them, or none.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write(report: &SeedReport, out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        write_table(&out.path("facts.csv"), &facts_lines(report))?;
        write_table(&out.path("windows.csv"), &report.windows)?;
        write_table(&out.path("worth.csv"), &report.worth)?;
        write_json(&out.path("seeds.json"), report)?;
        let proposals = report.sets.iter().filter(|set| PROPOSALS.contains(&set.name.as_str()));
        for set in proposals {
            write_bytes(&out.path(&format!("{}_seeds.txt", set.name)), seed_list(set).as_bytes())?;
            if let Some(writes) = bus_writes(set, report.mode) {
                write_table(&out.path(&format!("{}_bus.csv", set.name)), &writes)?;
            }
        }
        write_bytes(&out.path("readout_mixed.toml"), mixed_profile().as_bytes())?;
        let figures = out.folder("figures")?;
        save_charts(&picture::charts(report), &figures, "seeds")?;
        save_sheet(&picture::matrices(report), &figures, "matrices")?;
        Ok(())
    })
}

fn facts_lines(report: &SeedReport) -> Vec<FactsLine<'_>> {
    let rows = |facts: &SeedFacts| {
        let rows: Vec<String> = facts.constant_rows.iter().map(usize::to_string).collect();
        rows.join(" ")
    };
    let lines = report.facts.iter().map(|facts| FactsLine {
        seeds: &facts.seeds,
        taxels: facts.taxels,
        period_rows: facts.period_rows,
        least_phase_rows: facts.least_phase_rows,
        constant_rows: rows(facts),
        nearly_constant_share: facts.nearly_constant_share,
        first_rank: facts.first_rank,
    });
    lines.collect()
}

/// The set as [`SeedSet::read`] takes it.
fn seed_list(set: &SeedSet) -> String {
    let mut text = format!("# {}: seeds of {} taxels, row by row\n", set.name, set.seeds.len());
    for row in set.seeds.chunks(set.side().max(1)) {
        let seeds: Vec<String> = row.iter().map(|seed| format!("0x{seed:08x}")).collect();
        let _ = writeln!(text, "{}", seeds.join(" "));
    }
    text
}

/// What the master writes to give every cell its seed, when one bus has addresses for all of them.
fn bus_writes(set: &SeedSet, mode: WeightMode) -> Option<Vec<BusWrite>> {
    let cell_mode = match mode {
        WeightMode::Raster => CellMode::Raster,
        WeightMode::Analog => CellMode::Analog,
        WeightMode::Binary => CellMode::Binary,
    };
    let write = |(taxel, &seed): (usize, &u32)| {
        let address = u8::try_from(FIRST_ADDRESS as usize + taxel).ok()?;
        let bytes = match u8::try_from(seed) {
            Ok(seed) => cell_mode.pair(seed).to_vec(),
            Err(_) => cell_mode.extended(seed).to_vec(),
        };
        let bytes: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        (address <= LAST_BUS_ADDRESS).then_some(BusWrite {
            taxel,
            address,
            seed,
            bytes: bytes.join(" "),
        })
    };
    set.seeds.iter().enumerate().map(write).collect()
}

/// The readout as built, but with mixed addresses: a profile for `--readout`.
fn mixed_profile() -> String {
    let as_built = PROFILES
        .iter()
        .find(|(name, _)| *name == "as_built")
        .map_or("", |p| p.1);
    format!("# as_built, with a 32-bit mix of every cell's address for its seed\nseeding = \"mixed\"\n\n{as_built}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::{Profile, Seeding};

    #[test]
    fn proposals_are_read_back() {
        let set = SeedSet::of(Seeding::Mixed, 10);
        let again = SeedSet::parse("mixed", "file", &seed_list(&set)).unwrap();
        assert_eq!(again, set);
        let profile = Profile::from_toml(&mixed_profile()).unwrap();
        profile.validate(100).unwrap();
        let as_built = Profile::named("as_built").unwrap();
        assert_eq!((profile.seeding, as_built.seeding), (Seeding::Mixed, Seeding::Address));
        assert_eq!(
            profile,
            Profile {
                seeding: Seeding::Mixed,
                ..as_built
            }
        );
    }

    #[test]
    fn writes_are_the_firmwares() {
        let set = SeedSet::parse("list", "list", &["0x01020304"; 16].join(" ")).unwrap();
        let writes = bus_writes(&set, WeightMode::Binary).unwrap();
        assert_eq!((writes[15].address, writes[15].bytes.as_str()), (23, "82 04 03 02 01"));
        let short = SeedSet::parse("list", "list", &["255"; 16].join(" ")).unwrap();
        assert_eq!(bus_writes(&short, WeightMode::Analog).unwrap()[0].bytes, "01 ff");
        let large = SeedSet::of(Seeding::Mixed, 11);
        assert!(
            bus_writes(&large, WeightMode::Binary).is_none(),
            "121 cells share one bus"
        );
    }
}
