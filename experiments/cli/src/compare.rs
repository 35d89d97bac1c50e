//! `spts compare`: the twin against recordings of its skin.

use crate::context::{Bars, Common, note, notes, open_folder};
use crate::error::CliError;
use crate::options::{seed, skin_gains};
use clap::Args;
use spts::chain::MAX_TOML_BYTES;
use spts_circuit::Profile;
use spts_eval::{PublishedSkin, SessionSlip, Source, slips_text};
use spts_models::TaxelGains;
use spts_report::compare::{arm_json, arm_text, json, text, write, write_arm};
use spts_studies::arm::ArmStudy;
use spts_studies::calibrate::{SessionPair, read};
use spts_studies::compare::{CompareStudy, Images, Prediction};
use spts_studies::per_object::{PerObjectReport, PerObjectStudy};
use std::path::{Path, PathBuf};

/// Compares the twin with recordings of the real skin.
///
/// The command takes three steps. First it calibrates the readout on the odd presses of every compressive session in
/// RECORDINGS (see `spts validate --help` for the layout). Then it measures the images of the even presses by least
/// squares, sends them through the twin's readout with the same rows of weights, and computes the same statistics of
/// both recordings. Last it scores both recordings on the even ones of presses 6-15 and compares the curves, with the
/// published dictionary and library, and with the skin's raster images as the truth.
///
/// With --skins N, N simulated skins press every object that the skin recorded compressively, and are scored like the
/// skin: IoU and single windows classified at M = 7, 20 and 50, for `matched`, `nn_lmmse` and `evidence`. The table
/// shows each object's real score beside the band in which one more simulated skin lies nine times in ten, and the mean
/// over the objects of |twin − real|, in which errors of opposite sign do not cancel.
///
/// With --images simulated, the twin is given the simulation's images in place of the skin's own: the same objects on a
/// simulated skin, which may have gains that `spts calibrate --skin` found (--gains).
///
/// With --profile, every session is a new one: its readout is not calibrated on its own presses. (Its recorded images
/// are used all the same, and so is the list of its cells that do not run their sequence.) Its twins have readouts
/// drawn from the spans of a profile that was fitted to other sessions, `others` for all others in RECORDINGS, and each
/// of its numbers is shown beside the band in which one more twin lies nine times in ten.
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
  spts compare recordings/ --no-curves --images simulated --gains my_gains.toml
  spts compare recordings/ --profile others --draws 8
  spts compare new_recordings/ --profile my_skin.toml
  spts compare recordings/ --arm --skins 8
  spts compare recordings/ --json > compare.json

Files in DIR:
  compare.csv curves.csv     what is printed
  predicted.csv              with --profile: this and nothing else
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
    #[arg(long, conflicts_with_all = ["no_curves", "causes", "profile", "gains", "images", "draws"])]
    arm: bool,
    /// Number of simulated skins on which every recorded object is pressed; their scores are a band for the real
    /// skin's; [2, 1000] [default: none; with --arm 8]
    #[arg(long, value_name = "N", visible_alias = "seeds", value_parser = clap::value_parser!(u64).range(2..=1000))]
    skins: Option<u64>,
    /// With --skins: also read the skin's own images out by the twin, to see where a difference comes from
    #[arg(long, requires = "skins")]
    causes: bool,
    /// Images that the twin's readout is given: recorded are the skin's own, simulated those of a simulated skin
    #[arg(long, value_name = "KIND", value_parser = ["recorded", "simulated"], default_value = "recorded")]
    images: String,
    /// Gains of the simulated skin's taxels, a file that `spts calibrate --skin` writes [default: gains drawn at
    /// random]
    #[arg(long, value_name = "FILE.toml", conflicts_with = "skins")]
    gains: Option<PathBuf>,
    /// Predict every session with a profile that was fitted to other ones: a file, or `others` [default: calibrate on
    /// the session's own odd presses]
    #[arg(long, value_name = "FILE.toml|others", conflicts_with = "skins")]
    profile: Option<String>,
    /// Number of twins of every session, with --profile; [2, 1000]
    #[arg(long, value_name = "N", default_value_t = 8, requires = "profile", value_parser = clap::value_parser!(u64).range(2..=1000))]
    draws: u64,
    /// Root of the twin's random numbers
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed)]
    seed: u64,
    #[command(flatten)]
    common: Common,
}

/// Simulated skins of `--arm` when none are asked for.
const ARM_SKINS: u64 = 8;

impl CompareCommand {
    /// Runs the command.
    pub(super) fn run(&self) -> Result<(), CliError> {
        self.common.start()?;
        let out = open_folder(&self.out)?;
        if self.arm {
            let study =
                ArmStudy { recordings: &self.recordings, skins: self.skins.unwrap_or(ARM_SKINS), seed: self.seed };
            let report = study.run(&Bars::default())?;
            write_arm(&report, out)?;
            return self.common.print(&arm_json(&report), || arm_text(&report));
        }
        let pairs = read(&self.recordings)?;
        let slips: Vec<SessionSlip> = pairs.iter().flat_map(|pair| pair.slips.clone()).collect();
        if let Some(slips) = slips_text(&slips) {
            note(&format!("note: {slips}"));
        }
        let real = if self.no_curves || self.profile.is_some() { None } else { self.scored()? };
        let simulated = self.images == "simulated";
        if self.gains.is_some() && !simulated {
            let message = "`--gains` is of a simulated skin; it needs `--images simulated`";
            return Err(CliError::usage(message.to_owned()));
        }
        let study = CompareStudy {
            images: if simulated {
                let gains = self.skin_gains(&pairs)?;
                Images::Simulated { gains }
            } else {
                Images::Recorded
            },
            prediction: self.prediction()?,
            recordings: &self.recordings,
            pairs: &pairs,
            real: real.as_ref(),
            seed: self.seed,
        };
        let report = study.run(&Bars::default())?;
        let objects = self.per_object()?;
        write(&report, objects.as_ref(), out)?;
        let folder = if self.profile.is_some() { "predicted.csv" } else { "figures" };
        self.common.print(&json(&report, objects.as_ref()), || {
            let objects = objects
                .as_ref()
                .map_or_else(String::new, |found| format!("\n{}\n", spts_report::per_object::text(found)));
            format!("{}{objects}\nresults: {}", text(&report), self.out.join(folder).display())
        })
    }

    /// Gains of the simulated skin, which is that of the recordings.
    fn skin_gains(&self, pairs: &[SessionPair]) -> Result<Option<TaxelGains>, CliError> {
        let (Some(path), Some(pair)) = (&self.gains, pairs.first()) else {
            return Ok(None);
        };
        Ok(Some(skin_gains(path, pair.compressive.layout())?))
    }

    /// How sessions are predicted, if that is asked for.
    fn prediction(&self) -> Result<Option<Prediction>, CliError> {
        let Some(name) = &self.profile else { return Ok(None) };
        let read = |path: &Path| Profile::from_toml(&spts_input::read_text(path, MAX_TOML_BYTES)?);
        let profile = match name.as_str() {
            "others" => None,
            file => Some(read(Path::new(file)).map_err(|e| e.at(file))?),
        };
        let draws = self.draws;
        Ok(Some(Prediction { profile, draws }))
    }

    /// Twin and skin object by object, if that is asked for.
    fn per_object(&self) -> Result<Option<PerObjectReport>, CliError> {
        let Some(skins) = self.skins else { return Ok(None) };
        let study = PerObjectStudy { recordings: &self.recordings, skins, seed: self.seed, causes: self.causes };
        Ok(Some(study.run(&Bars::default())?))
    }

    /// What the scores need; `None`, with a note, when it is not published with the recordings.
    fn scored(&self) -> Result<Option<PublishedSkin>, CliError> {
        let source = Source::open(&self.recordings)?;
        notes(&source.note);
        let unpublished = source.published.is_none() && !source.sessions.is_empty();
        match source.published_skin() {
            Err(e) if unpublished => {
                note(&format!("no score curves: {e}"));
                Ok(None)
            }
            real => Ok(Some(real?)),
        }
    }
}
