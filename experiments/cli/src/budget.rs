//! `spts budget`: what each effect costs.

use crate::context::{Bars, Common, open_folder};
use crate::error::CliError;
use crate::options::{Side, parse_measurements, seed, sorted, square};
use clap::Args;
use spts::chain::DEFAULT_READOUT;
use spts_eval::decoders::PUBLISHED_DECODES;
use spts_studies::budget::BudgetStudy;
use std::path::PathBuf;

/// Measures how much image quality each imperfection of the twin costs: of the transducer, of the electronics, of the
/// contact model.
///
/// Presses objects on the twin once, and records the same presses with many chains, a chain being everything between
/// the pressure and the samples: the whole chain; the whole chain without one effect (ablation); the ideal chain, which
/// has the transducer's static law and y = Φx alone; and the ideal chain with one effect (addition). What is compared
/// is support accuracy, IoU and classification.
///
/// The effects are those of the readout profile's compressive table; spread, session, hysteresis, creep and
/// conditioning of the transducer; every stage as a whole; and the contact model. All chains see the same presses and
/// the same noise, so that their scores differ by the effects alone.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts budget
  spts budget --quick --objects T,tape --measurements 20
  spts budget --readout my_readout.toml --decode matched --json
  spts budget --taxels 400 --out out/budget_400

Files in DIR:
  budget.csv                 one line a stage, effect, mode, decode and M: changes of the scores, each with its standard
                             error. In an ablation the cost is positive, in an addition negative
  end_points.csv             scores of the whole chain, the ideal one and the raster scan, by three truths: a frame of
                             the scan, as published; the noiseless image; and that image on a skin with the static law
                             alone
  summary.md                 both as tables
  figures/budget_DECODE.png  IoU lost to each effect; contact_DECODE.png the same by the third truth
  provenance.json            seed, scenes, versions

Dictionary, library and truth come from raster scans of each skin with the profile's raster table; all readouts of a
skin share them. The standard errors are over sessions (10, or 3 with --quick). Each session has its own press, gains,
noise and learned dictionary; the skin, its spread and its scan are the same. Another --seed is another skin. A * marks
p < 1 % by Student's t test: of a hundred numbers that differ from 0 by chance alone, about one has a star.")]
pub(super) struct BudgetCommand {
    /// Readout profile: as_built, as_published, as_designed, ideal, or FILE.toml
    #[arg(long, value_name = "NAME|FILE.toml", default_value = DEFAULT_READOUT)]
    readout: String,
    /// Numbers of measurements; each [1, 1000], or at most 938 on some skins, so that 20 windows fit into a press
    /// [default: 7, 20 and 50 a hundred taxels]
    #[arg(long, value_delimiter = ',', value_name = "M,…", value_parser = parse_measurements)]
    measurements: Vec<usize>,
    /// Variants of the published decoder to score with. script_s20: the published script, which takes the weights for 0
    /// and 1 and composes an image of 20 atoms. script_m4: the same with M/4 atoms. matched: M/4 atoms, with weights of
    /// ±1 and without the output of the idle skin
    #[arg(long, value_delimiter = ',', value_name = "DECODE,…", value_parser = parse_decode,
          default_value = "matched,script_s20")]
    decode: Vec<&'static str>,
    /// Objects that are pressed and told apart, or all [default: brain,center,eraser,rec,trig]
    #[arg(long, value_delimiter = ',', value_name = "NAME,…")]
    objects: Vec<String>,
    /// Taxels of the skin, N: a square number in [100, 1600]. A larger skin has the published pitch, and is pressed at
    /// the published distance from its middle
    #[arg(long, value_name = "N", default_value = "100", value_parser = square(10..=40))]
    taxels: Side,
    /// A short run of a few seconds: few presses, little learning
    #[arg(long)]
    quick: bool,
    /// Folder of the results
    #[arg(long, value_name = "DIR", default_value = "out/budget")]
    out: PathBuf,
    /// Root of every random number: of the skin's gains, the readout's noise, and the arm's deviations from press to
    /// press
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed)]
    seed: u64,
    #[command(flatten)]
    common: Common,
}

fn parse_decode(text: &str) -> Result<&'static str, String> {
    let found = PUBLISHED_DECODES.into_iter().find(|decode| *decode == text);
    found.ok_or_else(|| format!("known: {}", PUBLISHED_DECODES.join(", ")))
}

impl BudgetCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let out = open_folder(&self.out)?;
        let study = BudgetStudy {
            objects: self.objects,
            readout: self.readout,
            measurements: sorted(self.measurements),
            decodes: self.decode,
            side: self.taxels.0,
            seed: self.seed,
            quick: self.quick,
        };
        let report = study.run(&Bars::default())?;
        spts_report::budget::write(&report, out)?;
        let text = || format!("{}\ntables and pictures: {}", spts_report::budget::text(&report), self.out.display());
        self.common.print(&spts_report::budget::json(&report), text)
    }
}
