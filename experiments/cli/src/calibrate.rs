//! `spts calibrate`: a readout profile from recordings.

use crate::context::{Bars, Common, note, notes};
use crate::error::CliError;
use crate::options::seed;
use clap::Args;
use spts::output::{check_replaceable, write_bytes};
use spts_circuit::Profile;
use spts_eval::slips_text;
use spts_models::TaxelGains;
use spts_report::calibrate::write_gains;
use spts_studies::calibrate::{CalibrationStudy, SkinStudy};
use std::path::{Path, PathBuf};

/// Fits a readout profile to recordings of a skin.
///
/// Every press of every compressive session in RECORDINGS (see `spts validate --help` for the layout) is fitted
/// separately. The image and a constant are fitted by least squares. The residual gives the memory, late updates and
/// their beat, the noise with and without contact, offset and asymmetry, the converter's step, and cells that do not
/// run their own sequence. Prints each number with its standard error, and lists what recordings of presses cannot
/// identify.
///
/// With --skin, fits the gains of the taxels instead, each with a band. A gain is the factor by which a taxel's values
/// in the images of all objects differ from those in a simulation of the same contacts on a median skin. Prints how
/// well the gains predict objects that they were not fitted to.
///
/// Two effects are reported but not included in the profile: outliers that no late update explains, and the difference
/// between even and odd rows of weights on the untouched skin (`idle_parity`) where it is not the one in contact
/// (`parity`).
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts calibrate recordings/ --out my_skin.toml
  spts calibrate recordings/ --session brain --presses 1-5 --out brain.toml
  spts calibrate recordings/ --json > numbers.json
  spts calibrate recordings/ --skin --out my_gains.toml
  spts score recordings/ --learn-from my_gains.toml --decoder evidence
  spts decode recordings/ --skin my_gains.toml --decoder evidence

Use the profile in a scene with `readout = \"my_skin.toml\"`, and the gains with `transducer_parameters.gains =
\"my_gains.toml\"`: every seed then draws a skin that these recordings allow. The spec of a data set takes them as
`transducer.gains`.")]
pub(super) struct CalibrateCommand {
    /// Directory of the recordings: sessions, or the published ones (see `spts validate --help`)
    recordings: PathBuf,
    /// File of the profile [default: none, only the numbers are printed]
    #[arg(long, value_name = "FILE.toml", value_parser = parse_out)]
    out: Option<PathBuf>,
    /// Fit this session alone [default: all sessions; a parameter of the profile is then a range in which a new session
    /// is expected]
    #[arg(long, value_name = "NAME")]
    session: Option<String>,
    /// Fit the gains of the taxels, each with a band, in place of the readout. They are fitted to raster presses of
    /// objects that the simulation knows. Presses that `spts score` scores are left out, so scores with these gains
    /// stay independent; if a session has only scored presses, they are used and a note names the session. `--out` then
    /// writes the gains, with figures (.png, .svg) beside the file
    #[arg(long, conflicts_with_all = ["session", "presses"])]
    skin: bool,
    /// Root of the random numbers of simulated presses (--skin)
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed, requires = "skin")]
    seed: u64,
    /// Presses that are used, counted from 1, as FIRST-LAST [default: all]
    #[arg(long, value_name = "A-B", value_parser = parse_presses)]
    presses: Option<(usize, usize)>,
    #[command(flatten)]
    common: Common,
}

/// A scene takes a name without .toml for a profile that is shipped.
fn parse_out(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if path.extension().is_some_and(|e| e == "toml") {
        Ok(path)
    } else {
        Err("valid: a file name that ends in .toml; a scene takes any other for a profile that is shipped".to_owned())
    }
}

/// FIRST-LAST, both from 1 on.
fn parse_presses(text: &str) -> Result<(usize, usize), String> {
    let ends = text.split_once('-').and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
    ends.filter(|(a, b)| 1 <= *a && a <= b).ok_or_else(|| "valid: A-B with whole numbers 1 ≤ A ≤ B".to_owned())
}

impl CalibrateCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        if self.skin {
            return self.fit_skin();
        }
        if let Some(path) = &self.out {
            check_ours(path, |text| !text.contains('#') && Profile::from_toml(text).is_ok())?;
        }
        let study = CalibrationStudy { session: self.session, presses: self.presses };
        let report = study.run(&self.recordings, &Bars::default())?;
        if let Some(slips) = slips_text(&report.slips) {
            note(&format!("note: {slips}"));
        }
        if let Some(path) = &self.out {
            write_bytes(path, report.profile_toml()?.as_bytes())?;
            note(&format!("profile: {}", path.display()));
        }
        self.common.print(&report, || spts_report::calibrate::text(&report))
    }
}

impl CalibrateCommand {
    /// Fits the gains of the taxels.
    fn fit_skin(&self) -> Result<(), CliError> {
        if let Some(path) = &self.out {
            check_ours(path, |text| TaxelGains::from_toml(text).is_ok())?;
            for picture in ["png", "svg"].map(|extension| path.with_extension(extension)) {
                // pictures of our own stand beside gains
                check_replaceable(&picture, |_| path.exists())?;
            }
        }
        let study = SkinStudy { seed: self.seed };
        let report = study.run(&self.recordings, &Bars::default())?;
        notes(&report.scored_text());
        self.common.print(&report, || spts_report::calibrate::skin_text(&report))?;
        if let Some(path) = &self.out {
            write_bytes(path, report.toml()?.as_bytes())?;
            let picture = path.with_extension("png");
            write_gains(&report, &picture)?;
            note(&format!("gains: {}, picture: {}", path.display(), picture.display()));
        }
        Ok(())
    }
}

/// Largest profile that is taken for one of this command's, bytes.
const MAX_PROFILE_BYTES: u64 = 1 << 20;

/// Refuses to write where no file can be written, and in place of a file that this command did not write: one whose
/// text is not `ours`.
fn check_ours(path: &Path, ours: impl Fn(&str) -> bool) -> Result<(), CliError> {
    let is_ours = |path: &Path| spts_input::read_text(path, MAX_PROFILE_BYTES).is_ok_and(|text| ours(&text));
    Ok(check_replaceable(path, is_ours)?)
}
