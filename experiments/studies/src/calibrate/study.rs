//! The whole calibration: recordings in, estimates and a readout profile out.

use super::error::CalibrateError;
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
use std::path::Path;

/// Which sessions and presses are used.
#[derive(Debug, Clone, Default)]
pub struct CalibrationStudy {
    /// Session that alone is used; every session when there is none.
    pub session: Option<String>,
    /// First and last press that are used, 1-based; all when there are none.
    pub presses: Option<(usize, usize)>,
}

/// What a calibration found.
#[derive(Debug, Clone, Serialize)]
pub struct CalibrationReport {
    /// Estimates of every session.
    pub sessions: Vec<SessionEstimates>,
    /// Parameters of the readout, from all sessions together.
    pub profile: FittedReadout,
    /// Whether every session lies in the spans that the other sessions predict; `None` with fewer than three.
    pub predicted_inside: Option<PredictedInside>,
    /// Samples that lagged behind their rows, and were put back on them.
    pub slips: Vec<SessionSlip>,
    /// What recordings of presses cannot tell apart, and why.
    pub not_identifiable: [&'static str; NOT_IDENTIFIABLE.len()],
    /// What the recordings show and the readout does not model.
    pub not_modelled: [&'static str; NOT_MODELLED.len()],
    /// Taxels of the largest skin.
    #[serde(skip)]
    taxels: usize,
}

impl CalibrationStudy {
    /// Fits the sessions in the directory `recordings`, each reported to `progress`.
    ///
    /// # Errors
    /// [`CalibrateError`] when the recordings cannot be used, the session is not there, the sessions differ in their
    /// weights or their rate, or no press of a session can be fitted.
    pub fn run(&self, recordings: &Path, progress: &dyn Progress) -> Result<CalibrationReport, CalibrateError> {
        let mut pairs = read(recordings)?;
        if let Some(name) = &self.session {
            let known: Vec<&str> = pairs.iter().map(|pair| pair.session.as_str()).collect();
            let known = known.join(", ");
            pairs.retain(|pair| pair.session == *name);
            if pairs.is_empty() {
                return Err(CalibrateError::NoSession {
                    name: name.clone(),
                    known,
                });
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

    fn fit(&self, pair: &SessionPair) -> Result<SessionEstimates, CalibrateError> {
        let presses = pair.compressive.blocks().len();
        let (first, last) = self.presses.unwrap_or((1, presses));
        let blocks: Vec<usize> = (first - 1..last.min(presses)).collect();
        let found = SessionEstimates::of(pair, &pair.compressive, &blocks);
        found.ok_or_else(|| CalibrateError::NoPress {
            session: pair.session.clone(),
            first,
            last,
            presses,
        })
    }
}

/// Checks that one profile can describe all `pairs`.
fn alike(pairs: &[SessionPair]) -> Result<(), CalibrateError> {
    let Some((first, others)) = pairs.split_first() else {
        return Ok(());
    };
    for other in others {
        let differ = |field, value: &dyn Fn(&Recording) -> String| CalibrateError::Differ {
            field,
            session: other.session.clone(),
            value: value(&other.compressive),
            first: first.session.clone(),
            first_value: value(&first.compressive),
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
    /// The fitted readout profile as TOML; what the recordings do not identify is kept from the default readout.
    ///
    /// # Errors
    /// [`CalibrateError::Fitted`] when the numbers are outside of what a readout takes.
    pub fn profile_toml(&self) -> Result<String, CalibrateError> {
        let taxels = u32::try_from(self.taxels).unwrap_or(u32::MAX);
        let (_, text) = fitted_profile(&self.profile, taxels)?;
        Ok(text)
    }

    /// The estimates as a table to read, and what the recordings cannot say.
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
