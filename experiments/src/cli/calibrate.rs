//! `spts calibrate`: a readout profile from recordings.

use super::context::{Common, note, print, print_json, progress};
use super::error::CliError;
use crate::calibrate::{NOT_IDENTIFIABLE, NOT_MODELLED, Pair, Readings, SessionEstimates, fitted_profile, read, table};
use crate::output::write_bytes;
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;

/// Fits a readout profile to recordings of a skin.
///
/// Every press of every compressive session in RECORDINGS (see `spts validate --help` for the layout) is fitted by itself: image
/// and constant by least squares, then memory, late updates, their beat, noise with and without contact, offset and asymmetry,
/// the converter's step, and cells that do not run their own sequence. Prints each number with its standard error, and what
/// recordings of presses cannot identify.
///
/// The even/odd pattern of the rows is written as it is in contact (`parity`); where it is another with nothing on the skin
/// (`idle_parity`), that is reported and not modelled. So are outliers that no late update explains.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts calibrate recordings/ --out my_skin.toml
  spts calibrate recordings/ --session brain --presses 1-5 --out brain.toml
  spts calibrate recordings/ --json > numbers.json

Use the profile in a scene with `readout = \"my_skin.toml\"`.")]
pub(super) struct Calibrate {
    /// Directory of the recordings
    recordings: PathBuf,
    /// File of the profile [default: none, only the numbers are printed]
    #[arg(long, value_name = "FILE.toml", value_parser = parse_out)]
    out: Option<PathBuf>,
    /// Object whose session alone is used [default: every session, their values as spans]
    #[arg(long, value_name = "NAME")]
    session: Option<String>,
    /// Presses that are used, 1-based, as FIRST-LAST [default: all]
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
    let ends = text
        .split_once('-')
        .and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
    ends.filter(|(a, b)| 1 <= *a && a <= b)
        .ok_or_else(|| "valid: A-B with whole numbers 1 ≤ A ≤ B".to_owned())
}

/// What the command reports.
#[derive(Debug, Serialize)]
struct Report {
    sessions: Vec<SessionEstimates>,
    profile: Readings,
    not_identifiable: [&'static str; NOT_IDENTIFIABLE.len()],
    not_modelled: [&'static str; NOT_MODELLED.len()],
}

impl Calibrate {
    /// Runs the command.
    pub(super) fn run(&self) -> Result<(), CliError> {
        self.common.start()?;
        let mut pairs = read(&self.recordings)?;
        if let Some(name) = &self.session {
            let known: Vec<&str> = pairs.iter().map(|pair| pair.object).collect();
            let known = known.join(", ");
            pairs.retain(|pair| pair.object == name);
            if pairs.is_empty() {
                let message = format!("`--session` = {name}: no compressive session of it; there are: {known}");
                return Err(CliError::Usage(message));
            }
        }
        let bar = progress(pairs.len(), "fitting sessions");
        let mut sessions = Vec::new();
        for pair in &pairs {
            sessions.push(self.fit(pair)?);
            bar.inc(1);
        }
        bar.finish_and_clear();
        let profile = Readings::of(&sessions);
        if let Some(path) = &self.out {
            let taxels = pairs.iter().map(|p| p.compressive.taxels()).max().unwrap_or(0);
            let taxels = u32::try_from(taxels).unwrap_or(u32::MAX);
            let fitted = fitted_profile(&profile, taxels);
            let (_, text) = fitted.map_err(|e| CliError::Usage(format!("the fitted profile: {e}")))?;
            write_bytes(path, text.as_bytes())?;
            note(&format!("profile: {}", path.display()));
        }
        if self.common.json {
            let report = Report {
                sessions,
                profile,
                not_identifiable: NOT_IDENTIFIABLE,
                not_modelled: NOT_MODELLED,
            };
            print_json(&report)?;
        } else {
            print(&table(&sessions))?;
            print(&format!(
                "not identifiable from these recordings:\n- {}\nin the recordings, not modelled:\n- {}",
                NOT_IDENTIFIABLE.join("\n- "),
                NOT_MODELLED.join("\n- ")
            ))?;
        }
        Ok(())
    }

    fn fit(&self, pair: &Pair) -> Result<SessionEstimates, CliError> {
        let last = pair.compressive.blocks().len();
        let (from, to) = self.presses.unwrap_or((1, last));
        let blocks: Vec<usize> = (from - 1..to.min(last)).collect();
        SessionEstimates::of(pair.object, &pair.compressive, pair.raster.as_ref(), &blocks).ok_or_else(|| {
            CliError::Usage(format!(
                "{} compressive: no press of {from}-{to} can be fitted; the session has presses 1-{last}",
                pair.object
            ))
        })
    }
}
