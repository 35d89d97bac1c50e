//! The whole calibration: from recordings to estimates and a readout profile.

use super::parameters::predicted_inside;
use super::predict::PredictedInside;
use super::profile::{FittedReadout, NOT_IDENTIFIABLE, NOT_MODELLED};
use super::profile_text::fitted_profile;
use super::session::SessionEstimates;
use super::text::{predictions, table};
use super::{SessionPair, read};
use serde::Serialize;
use spts::progress::Progress;
use spts_circuit::{LevelSource, Recording};
use spts_eval::SessionSlip;
use spts_input::Refusal;
use std::path::Path;

/// Settings of `spts calibrate`: which sessions and presses the readout is fitted to.
#[derive(Debug, Clone, Default)]
pub struct CalibrationStudy {
    /// The only session to use; `None` for all.
    pub session: Option<String>,
    /// First and last press to use, from 1; `None` for all.
    pub presses: Option<(usize, usize)>,
}

/// Results of `spts calibrate`: the readout that recordings of a skin show, session by session and from all of them.
#[derive(Debug, Clone, Serialize)]
pub struct CalibrationReport {
    /// Estimates of every session.
    pub sessions: Vec<SessionEstimates>,
    /// Parameters of the readout, from all sessions.
    pub profile: FittedReadout,
    /// Whether each session lies in the spans predicted from the others; `None` for fewer than three sessions.
    pub predicted_inside: Option<PredictedInside>,
    /// Slips of the recordings, which have been realigned.
    pub slips: Vec<SessionSlip>,
    /// Parameters that recordings of presses cannot distinguish, and why.
    pub not_identifiable: [&'static str; NOT_IDENTIFIABLE.len()],
    /// Effects in the recordings that the readout does not model.
    pub not_modelled: [&'static str; NOT_MODELLED.len()],
    /// Number of taxels of the largest skin.
    #[serde(skip)]
    taxels: usize,
}

impl CalibrationStudy {
    /// Fits the sessions in the folder `recordings`.
    ///
    /// # Errors
    /// [`Refusal`] if the recordings are not usable, the session does not exist, sessions differ in their
    /// weights or rate, or no press of a session can be fitted.
    pub fn run(&self, recordings: &Path, progress: &dyn Progress) -> Result<CalibrationReport, Refusal> {
        self.fit_all(read(recordings).map_err(Refusal::from_error)?, progress)
    }

    /// Fits the sessions `pairs`.
    pub(super) fn fit_all(
        &self,
        mut pairs: Vec<SessionPair>,
        progress: &dyn Progress,
    ) -> Result<CalibrationReport, Refusal> {
        if let Some(name) = &self.session {
            let known: Vec<&str> = pairs.iter().map(|pair| pair.session.as_str()).collect();
            let known = known.join(", ");
            pairs.retain(|pair| pair.session == *name);
            if pairs.is_empty() {
                return Err(Refusal::new(format!(
                    "`--session` = {name}: no compressive session of it; there are: {known}"
                )));
            }
        }
        alike(&pairs)?;
        progress.stage("fitting sessions", Some(pairs.len()));
        let mut sessions = Vec::new();
        for pair in &pairs {
            sessions.push(self.fit(pair)?);
            progress.step();
        }
        progress.end();
        Ok(CalibrationReport {
            profile: FittedReadout::of(&sessions),
            predicted_inside: predicted_inside(&sessions),
            sessions,
            slips: pairs.iter().flat_map(|pair| pair.slips.clone()).collect(),
            not_identifiable: NOT_IDENTIFIABLE,
            not_modelled: NOT_MODELLED,
            taxels: pairs.iter().map(|p| p.compressive.taxels()).max().unwrap_or(0),
        })
    }

    fn fit(&self, pair: &SessionPair) -> Result<SessionEstimates, Refusal> {
        let presses = pair.compressive.blocks().len();
        let (first, last) = self.presses.unwrap_or((1, presses));
        let blocks: Vec<usize> = (first - 1..last.min(presses)).collect();
        let found = SessionEstimates::of(pair, &pair.compressive, &blocks);
        found.ok_or_else(|| {
            Refusal::new(format!(
                "{} compressive: no press of {first}-{last} can be fitted; the session has presses 1-{presses}",
                pair.session
            ))
        })
    }
}

/// Checks that one profile can describe all `pairs`.
fn alike(pairs: &[SessionPair]) -> Result<(), Refusal> {
    let Some((first, others)) = pairs.split_first() else {
        return Ok(());
    };
    for other in others {
        let differ = |field: &str, value: &dyn Fn(&Recording) -> String| {
            Refusal::new(format!(
                "{} compressive: `{field}` = {}; {} has {}, and one profile has one: choose a session with `--session`",
                other.session,
                value(&other.compressive),
                first.session,
                value(&first.compressive)
            ))
        };
        if other.compressive.weights().source() != first.compressive.weights().source() {
            return Err(differ("weights", &|r| source(r.weights().source())));
        }
        let rate = |pair: &SessionPair| pair.compressive.sample_rate_hz().to_bits();
        if rate(other) != rate(first) {
            return Err(differ("sample_rate_hz", &|r| r.sample_rate_hz().to_string()));
        }
    }
    Ok(())
}

/// Where the weights come from, in short.
fn source(source: &LevelSource) -> String {
    match source {
        LevelSource::Seeding(seeding) => format!("seeding {seeding:?}").to_lowercase(),
        LevelSource::Seeds(seeds) => match &seeds[..] {
            [a, b, c, _, ..] => format!("seeds [{a}, {b}, {c}, …]"),
            seeds => format!("seeds {seeds:?}"),
        },
        LevelSource::Patterns(patterns) => format!("patterns of period {}", patterns.period()),
    }
}

impl CalibrationReport {
    /// The fitted readout profile as TOML. Undetermined parameters are taken from the default readout.
    ///
    /// # Errors
    /// [`Refusal`] if a value is outside its range.
    pub fn profile_toml(&self) -> Result<String, Refusal> {
        let taxels = u32::try_from(self.taxels).unwrap_or(u32::MAX);
        let (_, text) =
            fitted_profile(&self.profile, taxels).map_err(|e| Refusal::from_error(e).at("the fitted profile"))?;
        Ok(text)
    }

    /// The estimates as a text table, with what the recordings cannot determine.
    #[must_use]
    pub fn text(&self) -> String {
        format!(
            "{}\n{}not identifiable from these recordings:\n- {}\nin the recordings, not modelled:\n- {}",
            table(&self.sessions),
            self.predicted_inside
                .as_ref()
                .map_or_else(String::new, |found| predictions(found) + "\n"),
            NOT_IDENTIFIABLE.join("\n- "),
            NOT_MODELLED.join("\n- ")
        )
    }
}
