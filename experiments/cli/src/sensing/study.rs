//! `spts sensing study`: what designed rows are worth in the twin.

use super::{DesignerArg, layout, named, skin};
use crate::context::{Common, open_folder};
use crate::error::CliError;
use crate::options::{decoders_named, parse_measurements, seed, sorted, whole, within};
use crate::progress::Bars;
use clap::Args;
use clap::builder::PossibleValuesParser;
use spts_circuit::PROFILES;
use spts_recon::rows::{Tolerances, designer};
use spts_report::sensing::{STUDY_FILES, write_study};
use spts_studies::sensing::SensingStudy;
use std::path::PathBuf;

/// Measures on simulated skins what designed rows are worth against random ones, and what they cost.
///
/// Every repetition has a specimen of the skin, touches and noise of its own. Touches are procedural shapes and the
/// seventeen objects, at random places, rotations and forces. Rows and decoder know none of them: both have the same
/// prior, random outlines anywhere on the skin. The truth is the conductance of the taxels. Bands are 90 % intervals of
/// the mean over the repetitions.
///
/// Classes are the seventeen objects at their published places. Templates, and the rows of this part, come from twelve
/// other skins.
///
/// A cost is the error that one cause alone adds to the samples.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts sensing study
  spts sensing study --quick
  spts sensing study --designers random,cosine_signs,greedy --measurements 13,20,40 --json
  spts sensing study --largest-sum 1.5 --out out/headroom
  spts sensing study --skin 16x16 --readout as_built

Files in DIR:
  study.csv             one line a kind of touches, readout, designer and M: IoU, its gain over random rows, bands, place, clipped samples
  equal.csv             how many random rows each design is worth
  classes.csv           share of the seventeen objects classified, one line a readout, designer and M
  costs.csv             sums, headroom and errors by cause, in the order of design and in that of fewest flips
  objects.csv           IoU of every object and of every family of shapes
  study.json            all of them
  figures/sensing.png   IoU over M with bands; sensing.svg the same")]
pub(super) struct StudyCommand {
    /// Designers that are compared; random is always one [default: all that need no classes]
    #[arg(long, value_delimiter = ',', value_name = "NAME,…", value_parser = named(SensingStudy::designers()))]
    designers: Vec<DesignerArg>,
    /// Numbers of measurements M; each [1, 1000] [default: 5,7,10,13,20,25,30,40,50; with --quick 7,13,20,40]
    #[arg(long, value_delimiter = ',', value_name = "M,…", value_parser = parse_measurements)]
    measurements: Vec<usize>,
    /// Readout profiles
    #[arg(long, value_delimiter = ',', value_name = "NAME,…", default_values = ["ideal", "as_built"],
          value_parser = PossibleValuesParser::new(PROFILES.iter().map(|(name, _)| *name)))]
    readout: Vec<String>,
    /// Decoder for all rows: lmmse, or another decoder that makes images and needs no classes
    #[arg(long, value_name = "NAME", default_value = "nn_lmmse")]
    decoder: String,
    /// Taxels of the skin, rows and columns; at most 2048 in all
    #[arg(long, value_name = "ROWSxCOLS", default_value = "10x10", value_parser = skin)]
    skin: [usize; 2],
    /// Repetitions; [2, 1000] [default: 12, 4 with --quick]
    #[arg(long, value_name = "COUNT", value_parser = whole::<usize>(2..=1000))]
    skins: Option<usize>,
    /// Touches a repetition, of shapes and of objects each; [1, 10000] [default: 68, 34 with --quick]
    #[arg(long, value_name = "COUNT", value_parser = whole::<usize>(1..=10_000))]
    touches: Option<usize>,
    /// Largest root mean square of a row's sum, as a multiple of a random row's: headroom of the amplifier; [0.05,
    /// 1000]
    #[arg(long, value_name = "TIMES", value_parser = within(0.05, 1e3, "[0.05, 1000]"))]
    largest_sum: Option<f64>,
    /// Standard deviation of the logarithm of the taxels' gains that rows are designed for; [0, 3]
    #[arg(long, value_name = "SD", default_value_t = 0.0, value_parser = within(0.0, 3.0, "[0, 3]"))]
    gains: f64,
    /// Fewer M, repetitions and touches
    #[arg(long)]
    quick: bool,
    /// Root of every random number
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed)]
    seed: u64,
    /// Folder of the results
    #[arg(long, value_name = "DIR", default_value = "out/sensing_study")]
    out: PathBuf,
    #[command(flatten)]
    common: Common,
}

impl StudyCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let out = open_folder(&self.out, STUDY_FILES)?;
        let measurements = match (self.measurements.is_empty(), self.quick) {
            (false, _) => self.measurements,
            (true, false) => vec![5, 7, 10, 13, 20, 25, 30, 40, 50],
            (true, true) => vec![7, 13, 20, 40],
        };
        let mut designers: Vec<_> = designer("random").into_iter().collect();
        let asked = self.designers.iter().map(|d| d.0);
        let all: Vec<_> = if self.designers.is_empty() {
            SensingStudy::designers().collect()
        } else {
            asked.collect()
        };
        for one in all {
            if designers.iter().all(|known| known.name != one.name) {
                designers.push(one);
            }
        }
        let decoder = decoders_named(std::slice::from_ref(&self.decoder))?;
        let &[decoder] = &decoder[..] else {
            return Err(CliError::Usage("`--decoder` = all: one is needed".to_owned()));
        };
        let mut readouts: Vec<String> = Vec::new();
        for name in self.readout {
            if !readouts.contains(&name) {
                readouts.push(name);
            }
        }
        let study = SensingStudy {
            layout: layout(self.skin)?,
            designers,
            measurements: sorted(measurements),
            readouts,
            decoder,
            skins: self.skins.unwrap_or(if self.quick { 4 } else { 12 }),
            touches: self.touches.unwrap_or(if self.quick { 34 } else { 68 }),
            largest_sum: self.largest_sum,
            tolerances: Tolerances {
                gain_log_sd: self.gains,
                shift: 0,
            },
            seed: self.seed,
        };
        let report = study.run(&Bars::default())?;
        write_study(&report, out)?;
        let picture = self.out.join("figures/sensing.png");
        let text = || format!("{}\npicture: {}", report.text().trim_end(), picture.display());
        self.common.print(&report, text)
    }
}
