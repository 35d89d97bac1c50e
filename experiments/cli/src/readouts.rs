//! `spts readouts`: few-wire readouts side by side.

use crate::context::{Bars, Common, open_folder};
use crate::error::CliError;
use crate::options::{Side, seed, sorted, square, whole};
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use spts_report::readouts::write;
use spts_studies::readouts::{READOUTS, ReadoutLine, ReadoutsStudy, readout};
use std::path::PathBuf;

/// Compares readouts that need few wires on the same skins, touches, amplifier, noise, converter and clock.
///
/// Every readout reads the same held touches through the circuit: random shapes at random places for the image, its
/// place and the latency, and the seventeen known objects for their names. Each readout has the largest feedback
/// resistance that its own sums permit. All readouts of one size have the same clock. Bands are 90 % intervals over
/// repetitions, each with a specimen of the skin, parts, noise and touches of its own. The protocol is
/// docs/readouts.md.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts readouts
  spts readouts --quick
  spts readouts --taxels 100 --readout raster,events --repetitions 8
  spts readouts --taxels 1024,10000 --json

Readouts:
  raster          one taxel after another
  random          pseudorandom signs, the published cells' own
  designed        signs designed for smooth images, in pattern mode
  code_division   Walsh functions, one a taxel
  adaptive        taxels on ever finer grids, densely where one is touched (after ACTS)
  events          signatures that touched taxels send at moments of their own (after ACES)

Files in DIR:
  readouts.csv           one line a readout, size and number of measurements, with bands
  readouts.json          the same, the clocks, and what published systems state
  published.csv          published systems with their sources
  readouts.md            the tables that the command prints
  parameters.json, provenance.json
  figures/readouts.png   image, rate, place, latency and class of every readout; readouts.svg the same")]
pub(super) struct ReadoutsCommand {
    /// Sizes of the skins, N: square numbers in [64, 16384] [default: 100,1024,10000, with --quick 100,1024]
    #[arg(long, value_delimiter = ',', value_name = "N,…", value_parser = square(8..=128))]
    taxels: Vec<Side>,
    /// Readouts [default: all]
    #[arg(long, value_delimiter = ',', value_name = "NAME,…", value_parser = readout_named())]
    readout: Vec<&'static ReadoutLine>,
    /// Repetitions; [1, 1000] [default: 5, with --quick 2]
    #[arg(long, value_name = "N", value_parser = whole::<usize>(1..=1000))]
    repetitions: Option<usize>,
    /// Shapes a repetition; [1, 1000] [default: 12, with --quick 4]
    #[arg(long, value_name = "N", value_parser = whole::<usize>(1..=1000))]
    shapes: Option<usize>,
    /// Two repetitions of a few shapes, on 100 and 1024 taxels
    #[arg(long)]
    quick: bool,
    /// Root of every random number
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed)]
    seed: u64,
    /// Folder of the results
    #[arg(long, value_name = "DIR", default_value = "out/readouts")]
    out: PathBuf,
    #[command(flatten)]
    common: Common,
}

/// Sides of the skins by default; the first two with `--quick`.
const SIDES: [usize; 3] = [10, 32, 100];

fn readout_named() -> impl TypedValueParser<Value = &'static ReadoutLine> {
    PossibleValuesParser::new(READOUTS.iter().map(|line| line.name))
        .map(|name: String| readout(&name).unwrap_or(&READOUTS[0]))
}

impl ReadoutsCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let out = open_folder(&self.out)?;
        let asked = |line: &&ReadoutLine| self.readout.is_empty() || self.readout.iter().any(|r| r.name == line.name);
        let study = ReadoutsStudy {
            readouts: READOUTS.iter().filter(asked).collect(),
            sides: match (&self.taxels[..], self.quick) {
                ([], true) => SIDES[..2].to_vec(),
                ([], false) => SIDES.to_vec(),
                (asked, _) => sorted(asked.iter().map(|side| side.0).collect()),
            },
            repetitions: self.repetitions.unwrap_or(if self.quick { 2 } else { 5 }),
            shapes: self.shapes.unwrap_or(if self.quick { 4 } else { 12 }),
            seed: self.seed,
        };
        let report = study.run(&Bars::default())?;
        write(&study, &report, out)?;
        let text = || {
            format!("{}\ntables and pictures: {}", spts_report::readouts::text(&report).trim_end(), self.out.display())
        };
        self.common.print(&report, text)
    }
}
