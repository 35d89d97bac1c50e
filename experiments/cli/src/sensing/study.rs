//! `spts sensing study`: what designed rows of the sensing matrix are worth in the twin, and what they cost.

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

/// Compares ways to choose the rows of the sensing matrix on simulated skins.
///
/// A row is one weight a taxel, and M samples taken with M rows are decoded to one image. The study asks: how much
/// better is the image with rows that a designer has chosen than with random rows, how many random rows would be as
/// good, and which errors of the electronics grow with the chosen rows?
///
/// Images: every repetition simulates a skin with gains, noise and touches of its own. The touches are procedural
/// shapes and the seventeen objects, at random places, rotations and forces. Neither the rows nor the decoder know
/// them: both are made for random outlines anywhere on the skin. An image is scored against the conductance of the
/// taxels.
///
/// Classes: `evidence` names which of the seventeen objects is pressed, at their published places. Its templates, and
/// the rows of the designer `classes`, come from twelve other simulated skins.
///
/// Costs: each source of error alone, such as noise or late updates, as a share of the samples' root mean square.
///
/// Bands are 90 % intervals of the mean over the repetitions. `spts sensing design` writes the rows of one designer.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts sensing study
  spts sensing study --quick
  spts sensing study --designers random,cosine_signs,greedy --measurements 13,20,40 --json
  spts sensing study --largest-sum 1.5 --out out/headroom
  spts sensing study --skin 16x16 --readout as_built

Files in DIR:
  study.csv             one line a kind of touches, readout, designer and M: IoU, how much it exceeds that of random
                        rows, bands, error of the place, share of clipped samples
  equal.csv             how many random rows give the same IoU as the rows of each designer
  classes.csv           share of the touches whose object is named rightly, one line a readout, designer and M
  costs.csv             largest sample, headroom and errors by cause, for the rows in the designer's order and in the
                        order in which the fewest weights change from row to row
  objects.csv           IoU of every object and of every family of shapes
  study.json            all of them
  figures/sensing.png   IoU over M with bands; sensing.svg the same")]
pub(super) struct StudyCommand {
    /// Designers of rows to compare; `random` is always one of them, and where objects are named, `classes` too
    /// [default: all of the list but classes]
    #[arg(long, value_delimiter = ',', value_name = "NAME,…", value_parser = named(SensingStudy::designers()))]
    designers: Vec<DesignerArg>,
    /// Numbers of samples M that an image is decoded from, each with M rows; [1, 1000] [default:
    /// 5,7,10,13,20,25,30,40,50; with --quick 7,13,20,40]
    #[arg(long, value_delimiter = ',', value_name = "M,…", value_parser = parse_measurements)]
    measurements: Vec<usize>,
    /// Readout profiles: the electronics whose errors the samples have
    #[arg(long, value_delimiter = ',', value_name = "NAME,…", default_value = "ideal,as_built",
          value_parser = PossibleValuesParser::new(PROFILES.iter().map(|(name, _)| *name)))]
    readout: Vec<String>,
    /// Decoder that makes the images from all rows: one of those in docs/decoders.md that make images and need no
    /// classes, such as lmmse
    #[arg(long, value_name = "NAME", default_value = "nn_lmmse")]
    decoder: String,
    /// Taxels of the skin, rows and columns; at most 2048 in all
    #[arg(long, value_name = "ROWSxCOLS", default_value = "10x10", value_parser = skin)]
    skin: [usize; 2],
    /// Number of repetitions, each on a simulated skin of its own; [2, 1000] [default: 12, with --quick 4]
    #[arg(long, value_name = "COUNT", value_parser = whole::<usize>(2..=1000))]
    skins: Option<usize>,
    /// Number of touches in a repetition: so many by shapes, and as many by objects; [1, 10000] [default: 68, with
    /// --quick 34]
    #[arg(long, value_name = "COUNT", value_parser = whole::<usize>(1..=10_000))]
    touches: Option<usize>,
    /// Largest root mean square of a designed row's samples, as a multiple of a random row's, so that the amplifier
    /// does not clip; [0.05, 1000] [default: no limit]
    #[arg(long, value_name = "TIMES", value_parser = within(0.05, 1e3, "[0.05, 1000]"))]
    largest_sum: Option<f64>,
    /// Spread of the taxels' gains that the designs assume: standard deviation of their natural logarithm; [0, 3]
    #[arg(long, value_name = "SD", default_value_t = 0.0, value_parser = within(0.0, 3.0, "[0, 3]"))]
    gains: f64,
    /// Fewer M, repetitions and touches: about a tenth of the time
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
