//! `spts compare`: the twin against recordings of its skin.

use super::context::{Common, note};
use super::error::CliError;
use super::options::seed;
use super::progress::Bars;
use clap::Args;
use serde::Serialize;
use spts::data::DataError;
use spts::output::OutputFolder;
use spts_eval::PublishedSkin;
use spts_studies::calibrate::read;
use spts_studies::compare::{CompareReport, CompareStudy};
use spts_studies::per_object::{PerObjectReport, PerObjectStudy};
use std::path::PathBuf;

/// Compares the twin with recordings of the skin it is the twin of.
///
/// First calibrates the readout on the odd presses of every compressive session in RECORDINGS (see `spts validate
/// --help` for the layout). Then measures the images of the even presses by least squares, sends them through the
/// twin's readout at the same rows of weights, and applies the same estimators to both recordings. Last, scores both on
/// the even ones of presses 6-15 and compares the curves, with the published dictionary and library, and with the
/// skin's raster images as the truth.
///
/// With --skins N, N simulated skins press every object that the skin recorded compressively, and are scored like the
/// skin: IoU and single windows classified at M = 7, 20 and 50, for `matched`, `nn_lmmse` and `evidence`. Printed are
/// each object's real score beside the band in which one more simulated skin lies nine times in ten, and the mean over
/// the objects of |twin − real|, in which errors of opposite sign do not cancel.
///
/// With --arm, the bent skin is compared instead: N skins of `spts simulate arm`, wrapped round a robot's arm, under
/// preload and touched by a finger, beside the recording of touches in RECORDINGS (robot_arm/): output without a touch,
/// size of a touch, and how far from the touched taxel it is located.
///
/// Two things are not modelled, and are shown without a verdict: the even/odd pattern with nothing on the skin
/// (idle_parity; idle_sd contains it, idle_noise does not), and outliers that no late update explains.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts compare recordings/
  spts compare recordings/ --no-curves --out out/look
  spts compare recordings/ --no-curves --skins 8
  spts compare recordings/ --arm --skins 8
  spts compare recordings/ --json > compare.json

Files in DIR:
  compare.csv curves.csv     what is printed
  figures/residuals.png      histograms of the residuals; quantiles.png quantile against quantile
  figures/scores.png         score curves
  per_object.csv .json per_object_distances.csv figures/per_object.png   with --skins: twin and skin object by object
  arm.csv arm.json           with --arm: these and nothing else
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
    /// Compare the bent skin, touched by a finger, and nothing else
    #[arg(long, conflicts_with_all = ["no_curves", "causes"])]
    arm: bool,
    /// Simulated skins that press every recorded object; their scores are a band for the real skin's [default: none, 8
    /// with --arm]
    #[arg(long, value_name = "N", visible_alias = "seeds", value_parser = clap::value_parser!(u64).range(2..=1000))]
    skins: Option<u64>,
    /// With --skins: also read the skin's own images out by the twin, to see where a difference comes from
    #[arg(long, requires = "skins")]
    causes: bool,
    /// Root of the twin's random numbers
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed)]
    seed: u64,
    #[command(flatten)]
    common: Common,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    #[serde(flatten)]
    compared: &'a CompareReport,
    #[serde(skip_serializing_if = "Option::is_none")]
    per_object: Option<&'a PerObjectReport>,
}

impl CompareCommand {
    /// Runs the command.
    pub(super) fn run(&self) -> Result<(), CliError> {
        self.common.start()?;
        let out = OutputFolder::open(&self.out, spts_report::compare::FILES)?;
        if self.arm {
            return super::compare_arm::run(&self.recordings, self.skins, self.seed, out, &self.common);
        }
        let pairs = read(&self.recordings)?;
        let real = if self.no_curves { None } else { self.scored()? };
        let study = CompareStudy {
            recordings: &self.recordings,
            pairs: &pairs,
            real: real.as_ref(),
            seed: self.seed,
        };
        let report = study.run(&Bars::default())?;
        let objects = self.per_object()?;
        spts_report::compare::write(&report, objects.as_ref(), out)?;
        let folder = self.out.join("figures");
        let text = || {
            let objects = objects
                .as_ref()
                .map_or_else(String::new, |found| format!("\n{}\n", found.text()));
            format!("{}{objects}\nfigures: {}", report.text(), folder.display())
        };
        let printed = Printed {
            compared: &report,
            per_object: objects.as_ref(),
        };
        self.common.print(&printed, text)
    }

    /// Twin and skin object by object, if that is asked for.
    fn per_object(&self) -> Result<Option<PerObjectReport>, CliError> {
        let Some(skins) = self.skins else { return Ok(None) };
        let study = PerObjectStudy {
            recordings: &self.recordings,
            skins,
            seed: self.seed,
            causes: self.causes,
        };
        Ok(Some(study.run(&Bars::default())?))
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
