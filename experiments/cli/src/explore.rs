//! `spts explore`: what a large skin takes.

use crate::context::{Bars, Common, open_folder};
use crate::error::CliError;
use crate::options::{Side, seed, sorted, square, whole};
use clap::{Args, ValueEnum};
use spts_circuit::Seeding;
use spts_report::explore;
use spts_studies::explore::ExploreStudy;
use std::path::PathBuf;

/// Finds how many measurements a skin of any size needs, on one wire or several, with the limits of its electronics in
/// the loop.
///
/// Scenes are half-ellipsoids of conductance at random places: one contact for 5760 taxels (40 on 480 × 480) and at
/// least two, with a radius of 1 to 4 taxels and a peak of 75 to 150 µS over the 1 µS of the idle skin.
///
/// There are four readouts: an ideal wire; one wire with the amplifier, converters and clock of the profile
/// as_designed; one wire with its feedback lowered until the sum fits and its clock slowed until the output settles;
/// and as many wires as those parts need, each for a band of rows. All but the ideal wire have the contact noise and
/// late updates of as_built. A recording of the idle skin with the same rows is subtracted, and so is the mean of every
/// wire.
///
/// M grows from 8 per contact until the IoU is 0.8 and 95 % of the contacts are found less than a taxel from their
/// place, or until M is 5 % of the taxels (at least 1000).
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts explore
  spts explore --quick
  spts explore --taxels 1024,10000 --scenes 5 --json
  spts explore --taxels 10000 --seeding address --out out/addresses

Files in DIR:
  explore.csv                one line a size and readout: electronics, M needed, times of the wire, bytes
  trials.csv                 every M that was tried, with its IoU and the share of contacts within 1 px
  fits.csv                   exponents of cost against taxels, each with its standard error
  timings.csv, timing.json   times of decoding, their fits, and the machine
  parameters.json, provenance.json
  figures/explore.png        measurements, times of the wire and bytes over the number of taxels; explore.svg the same
  figures/timing.png         times of decoding; timing.svg the same")]
pub(super) struct ExploreCommand {
    /// Sizes of the skins, N: square numbers in [64, 1000000]
    #[arg(long, value_delimiter = ',', value_name = "N,…", value_parser = square(8..=1000),
          default_value = "100,1024,10000,102400,230400")]
    taxels: Vec<Side>,
    /// Scenes a size; [1, 1000] [default: 4, with --quick 1]
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1..=1000))]
    scenes: Option<u64>,
    /// Seeds of the cells: a 32-bit mix of their addresses, or the addresses as the device has them
    #[arg(long, value_name = "SEEDS", default_value = "mixed")]
    seeding: SeedsArg,
    /// One scene a size, and M in factors of 2
    #[arg(long)]
    quick: bool,
    /// Folder of the results
    #[arg(long, value_name = "DIR", default_value = "out/explore")]
    out: PathBuf,
    /// Root of every random number
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed)]
    seed: u64,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum SeedsArg {
    Mixed,
    Address,
}

impl ExploreCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let out = open_folder(&self.out)?;
        let study = ExploreStudy {
            sides: sorted(self.taxels.iter().filter_map(|side| u32::try_from(side.0).ok()).collect()),
            scenes: self.scenes.unwrap_or(if self.quick { 1 } else { 4 }),
            seeding: match self.seeding {
                SeedsArg::Mixed => Seeding::Mixed,
                SeedsArg::Address => Seeding::Address,
            },
            quick: self.quick,
            seed: self.seed,
        };
        let report = study.run(&Bars::default())?;
        explore::write(&study, &report, out)?;
        let text = || format!("{}\ntables and pictures: {}", explore::text(&report), self.out.display());
        self.common.print(&report, text)
    }
}
