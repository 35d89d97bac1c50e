//! `spts compare`: the twin against recordings of its skin.

use super::context::{Common, note};
use super::error::CliError;
use super::options::seed;
use super::progress::Bars;
use clap::Args;
use spts::data::DataError;
use spts::output::OutputFolder;
use spts_eval::PublishedSkin;
use spts_studies::calibrate::read;
use spts_studies::compare::CompareStudy;
use std::path::PathBuf;

/// Compares the twin with recordings of the skin it is the twin of.
///
/// First calibrates the readout on the odd presses of every compressive session in RECORDINGS (see `spts validate
/// --help` for the layout). Then measures the images of the even presses by least squares, sends them through the
/// twin's readout at the same rows of weights, and applies the same estimators to both recordings. Last, scores both on
/// the even ones of presses 6-15 and compares the curves, with the published dictionary and library, and with the
/// skin's raster images as the truth.
///
/// Two things are not modelled, and are shown without a verdict: the even/odd pattern with nothing on the skin
/// (idle_parity; idle_sd contains it, idle_noise does not), and outliers that no late update explains.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts compare recordings/
  spts compare recordings/ --no-curves --out out/look
  spts compare recordings/ --json > compare.json

Files in DIR:
  compare.csv curves.csv     what is printed
  figures/residuals.png      histograms of the residuals; quantiles.png quantile against quantile
  figures/scores.png         score curves
Each figure is there as .svg too.")]
pub(super) struct CompareCommand {
    /// Directory of the recordings
    recordings: PathBuf,
    /// Folder of the table and the figures
    #[arg(long, value_name = "DIR", default_value = "out/compare")]
    out: PathBuf,
    /// Leave out the score curves, which take most of the time
    #[arg(long)]
    no_curves: bool,
    /// Root of the twin's random numbers
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed)]
    seed: u64,
    #[command(flatten)]
    common: Common,
}

impl CompareCommand {
    /// Runs the command.
    pub(super) fn run(&self) -> Result<(), CliError> {
        self.common.start()?;
        let out = OutputFolder::open(&self.out, spts_report::compare::FILES)?;
        let pairs = read(&self.recordings)?;
        let real = if self.no_curves { None } else { self.scored()? };
        let study = CompareStudy {
            recordings: &self.recordings,
            pairs: &pairs,
            real: real.as_ref(),
            seed: self.seed,
        };
        let report = study.run(&Bars::default())?;
        spts_report::compare::write(&report, out)?;
        let folder = self.out.join("figures");
        let text = || format!("{}\nfigures: {}", report.text(), folder.display());
        self.common.print(&report, text)
    }

    /// What the scores need; `None`, with a note, when it is not published with the recordings.
    fn scored(&self) -> Result<Option<PublishedSkin>, CliError> {
        match PublishedSkin::open(&self.recordings) {
            Err(e @ DataError::Missing { .. }) => {
                note(&format!("no score curves: {e}"));
                Ok(None)
            }
            real => Ok(Some(real?)),
        }
    }
}
