//! Calibration: estimates the parameters of a skin's readout from recordings, with their uncertainty.
//!
//! Every press of a session is fitted separately, y = Φx + c, in windows short enough to follow creep. Outliers are
//! found first and then left out, and so are presses that missed. The values of a session are medians over its presses;
//! their scatter gives the standard error. A profile from several sessions has spans in which a new session is
//! expected.

use cells::gains;
use late::{Counts, beat};
use press::{PressAnalysis, analyse, missed};
use profile::predicted_inside;
use rayon::prelude::*;
use serde::Serialize;
use spts::data::SessionSet;
use spts::progress::Progress;
use spts::session::Recorded;
use spts_circuit::{LevelSource, Recording, WeightMode, Weights};
use spts_eval::protocol::{PLATEAU, Protocol};
use spts_eval::{SessionSlip, follow_slips};
use spts_input::Refusal;
use statistics::{mean, middle, steps};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

mod cells;
mod late;
mod predict;
mod press;
mod profile;
mod skin;
mod statistics;
#[cfg(test)]
mod tests;
mod windows;

pub use cells::{CellFault, GainPlane, Overdriven, SessionGains, TaxelGain, reseeded};
pub use late::{Beat, LateCell};
pub use predict::{COVERAGE, PredictedInside, PredictedNumber, predicted};
pub use press::{MissedPress, NUMBERS};
pub use profile::{FittedParameter, FittedReadout, NOT_IDENTIFIABLE, NOT_MODELLED, fitted_profile};
pub use skin::{ObjectCheck, Remounted, SkinReport, SkinStudy};
pub use statistics::{ConverterSteps, Estimated, quantiles};
pub(crate) use windows::fit_windows;
pub use windows::{Reseeded, WINDOW_FRAMES};

/// Both recordings of a session; the raster recording may be missing.
#[derive(Debug, Clone)]
pub struct SessionPair {
    /// Name of the session.
    pub session: String,
    /// What was pressed.
    pub object: String,
    /// Compressive recording.
    pub compressive: Recording,
    /// Frames of the compressive recording in which the contact is steady.
    pub hold: Range<usize>,
    /// Raster recording, and its frames in which the contact is steady.
    pub raster: Option<(Recording, Range<usize>)>,
    /// Slips of the compressive recording, which has been realigned.
    pub slips: Vec<SessionSlip>,
}

/// The sessions in `root` with a compressive recording of presses, all usable for calibration.
///
/// # Errors
/// [`Refusal`] if a session is not usable, has weights that are not binary, or holds its contact for less than
/// [`WINDOW_FRAMES`]; or if there is no session.
pub fn read(root: &Path) -> Result<Vec<SessionPair>, Refusal> {
    let mut set = SessionSet::open(root)?;
    let slips = follow_slips(&mut set).slips;
    let mut pairs = Vec::new();
    for session in set.presses() {
        let Some(recorded) = &session.compressive else {
            continue;
        };
        let compressive = &recorded.recording;
        let unfit = |field: &str, value: String, needed: String| {
            let problem = format!("`{field}` = {value}; calibration needs {needed}");
            let session = format!("{} compressive session", session.name);
            Refusal::new(problem).at(session).at(root.display())
        };
        let mode = compressive.weights().mode();
        if mode != WeightMode::Binary {
            let (value, needed) = (format!("{:?}", mode.name()), format!("{:?}", WeightMode::Binary.name()));
            return Err(unfit("weights.mode", value, needed));
        }
        let wires = compressive.weights().wire_count();
        if wires > 1 {
            return Err(unfit("wires", wires.to_string(), "one wire".to_owned()));
        }
        let held = held_frames(recorded, session.hold_s).unwrap_or_default();
        if held.len() < WINDOW_FRAMES {
            let value = format!("{} frames of {}", held.len(), compressive.frames());
            return Err(unfit("hold_s", value, format!("at least {WINDOW_FRAMES} frames")));
        }
        let raster = session.raster.as_ref();
        pairs.push(SessionPair {
            session: session.name.clone(),
            object: session.object.clone(),
            compressive: compressive.clone(),
            hold: held,
            slips: slips.iter().filter(|slip| slip.session == session.name).cloned().collect(),
            raster: raster.and_then(|r| Some((r.recording.clone(), held_frames(r, session.hold_s)?))),
        });
    }
    if pairs.is_empty() {
        let problem = "no session of presses has a compressive recording; calibration needs one";
        return Err(Refusal::new(problem).at(root.display()));
    }
    Ok(pairs)
}

/// Frames of `recorded` in which the contact is steady: those that are scored; of a hold like the published one,
/// [`PLATEAU`]. `None` when the recording ends before them.
fn held_frames(recorded: &Recorded, hold_s: Option<[f64; 2]>) -> Option<Range<usize>> {
    let recording = &recorded.recording;
    let measurements = recording.frames() * recording.measurements_per_frame();
    let end_s = measurements as f64 / recording.sample_rate_hz();
    if hold_s.is_some_and(|[start_s, _]| start_s >= end_s) {
        return None;
    }
    let scored = Protocol::of(recorded, hold_s);
    let held = scored.first_frame..scored.first_frame + scored.frames;
    let published = Protocol::default();
    let published = published.first_frame..(published.first_frame + published.frames).min(recording.frames());
    Some(if held == published && held.end >= PLATEAU.end { PLATEAU } else { held })
}

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
        self.fit_all(read(recordings)?, progress)
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
        let (_, text) = fitted_profile(&self.profile, taxels).map_err(|e| e.at("the fitted profile"))?;
        Ok(text)
    }
}

/// Number of quantiles of the output that are compared.
pub(crate) const QUANTILES: usize = 100;

/// What the calibration finds in one session: parameters of the readout with their standard errors, faulty cells and
/// gains.
#[derive(Debug, Clone, Serialize)]
pub struct SessionEstimates {
    /// Name of the session.
    pub session: String,
    /// Presses that were used, from 1.
    pub presses: Vec<usize>,
    /// Presses that missed and were left out.
    pub missed: Vec<MissedPress>,
    /// Median over the presses and standard error, by name.
    pub numbers: BTreeMap<&'static str, Estimated>,
    /// Grid of the converter; `None` if the values are not on a grid.
    pub steps: Option<ConverterSteps>,
    /// Rate of late flips of the taxels with enough load to be distinguished.
    pub late_cells: Vec<LateCell>,
    /// Beats of the cells whose late updates can be distinguished.
    pub beats: Vec<Beat>,
    /// Cells that do not run their own sequence.
    pub faults: Vec<CellFault>,
    /// Mis-seeded cells whose output is not ±1.
    pub overdriven: Vec<Overdriven>,
    /// Image of the plateau, median over the presses, V.
    pub image_v: Vec<f64>,
    /// Taxels compared with the raster session; `None` without one, or if too few taxels are loaded.
    pub gains: Option<SessionGains>,
    /// Quantiles of the output on the plateau, V.
    #[serde(skip)]
    pub output_quantiles_v: Vec<f64>,
    /// Clean residuals of all presses, V.
    #[serde(skip)]
    pub clean_v: Vec<f64>,
    /// Weights of the recording.
    #[serde(skip)]
    pub weights: Weights,
    /// Measurements a second of the recording, Hz.
    #[serde(skip)]
    pub sample_rate_hz: f64,
}

impl SessionEstimates {
    /// Median over the presses of the value `name`; NaN if there is none.
    pub fn value(&self, name: &str) -> f64 {
        self.numbers.get(name).map_or(f64::NAN, |e| e.value)
    }

    /// Estimates from the given presses of `recording`, the compressive recording of `pair` or one like it. The raster
    /// recording of `pair` shows to which cell a foreign sequence belongs, and is the reference for the taxels. Presses
    /// that missed are left out. `None` if no press determines an image.
    pub fn of(pair: &SessionPair, recording: &Recording, blocks: &[usize]) -> Option<Self> {
        let hold = &pair.hold;
        let raster = pair.raster.as_ref();
        let contact = raster.and_then(|(raster, hold)| mean_contact(raster, hold));
        let faults = cells::find(recording, hold, contact.as_deref(), blocks);
        let cells = reseeded(&faults);
        let overdriven: Vec<Overdriven> =
            cells.iter().filter_map(|cell| cells::fit(recording, hold, blocks, *cell)).collect();
        let analysed: Vec<(usize, PressAnalysis)> = blocks
            .par_iter()
            .filter_map(|&block| Some((block, analyse(recording, hold, block, &cells, &overdriven)?)))
            .collect();
        if analysed.is_empty() {
            return None;
        }
        let missed = missed(&analysed);
        if !missed.is_empty() {
            // their outliers and residuals reach the faults, too: everything is found anew without them
            let hit = |block: &usize| missed.iter().all(|m| m.press != block + 1);
            let kept: Vec<usize> = blocks.iter().copied().filter(hit).collect();
            let mut found = Self::of(pair, recording, &kept)?;
            found.missed.extend(missed);
            found.missed.sort_by_key(|m| m.press);
            return Some(found);
        }
        let number = |(name, _): (&'static str, &str)| {
            let values: Vec<f64> = analysed.iter().map(|(_, press)| press.numbers[name]).collect();
            (name, Estimated::median_of(&values))
        };
        let image_v = middle_image(&analysed);
        let faulty: Vec<usize> = cells.iter().map(|cell| cell.taxel as usize).collect();
        let used: Vec<usize> = analysed.iter().map(|(block, _)| *block).collect();
        Some(Self {
            session: pair.session.clone(),
            presses: used.iter().map(|block| block + 1).collect(),
            missed,
            numbers: NUMBERS.into_iter().map(number).collect(),
            steps: steps(recording, &used),
            late_cells: late_cells(&analysed),
            beats: beats(&analysed),
            overdriven,
            faults,
            gains: contact.and_then(|raster_v| gains(&image_v, &raster_v, &faulty, recording.layout())),
            image_v,
            output_quantiles_v: quantiles(&plateau_volts(recording, hold, &used), QUANTILES),
            clean_v: analysed.into_iter().flat_map(|(_, press)| press.clean_v).collect(),
            weights: recording.weights().clone(),
            sample_rate_hz: recording.sample_rate_hz(),
        })
    }
}

/// Mean over the presses of the raster images in the frames `hold`, less their idle mean, V. Lost samples do not count.
/// `None` when it is not known which of the frames are idle.
fn mean_contact(raster: &Recording, hold: &Range<usize>) -> Option<Vec<f64>> {
    let idle = raster.blocks().iter().map(|block| Some(0..block.idle_frames?));
    let idle = idle.collect::<Option<Vec<Range<usize>>>>()?;
    let plateaus = vec![hold.clone(); raster.blocks().len()];
    let of = |taxel: usize, frames: &[Range<usize>]| -> f64 {
        let blocks = frames.iter().cloned().enumerate();
        let values = blocks.flat_map(|(block, frames)| frames.map(move |frame| raster.volts(block, frame)[taxel]));
        mean(&values.collect::<Vec<_>>())
    };
    Some((0..raster.taxels()).map(|k| of(k, &plateaus) - of(k, &idle)).collect())
}

/// Median over the presses of every taxel's image, V.
fn middle_image(analysed: &[(usize, PressAnalysis)]) -> Vec<f64> {
    let taxels = analysed.first().map_or(0, |(_, press)| press.image.len());
    (0..taxels).map(|k| middle(&analysed.iter().map(|(_, press)| press.image[k]).collect::<Vec<_>>())).collect()
}

/// Counts of all presses together, of the taxels that are loaded enough.
fn late_cells(analysed: &[(usize, PressAnalysis)]) -> Vec<LateCell> {
    let taxels = analysed.first().map_or(0, |(_, press)| press.late.len());
    (0..taxels)
        .filter_map(|k| {
            let sum = analysed.iter().fold(Counts::default(), |sum, (_, press)| sum.plus(press.late[k]));
            sum.cell(k)
        })
        .collect()
}

/// Most cells that a beat is looked for in, the loaded ones first: others' late updates cannot be told apart.
const BEATING_CELLS: usize = 16;

fn beats(analysed: &[(usize, PressAnalysis)]) -> Vec<Beat> {
    let image = middle_image(analysed);
    let mut taxels: Vec<usize> = (0..image.len()).collect();
    taxels.sort_by(|a, b| image[*b].total_cmp(&image[*a]));
    let rows = |taxel: usize, press: &PressAnalysis| -> Vec<u64> {
        press.events.iter().filter(|(k, _)| *k == taxel).map(|(_, row)| *row).collect()
    };
    taxels
        .into_par_iter()
        .take(BEATING_CELLS)
        .filter_map(|k| beat(k, &analysed.iter().map(|(_, press)| rows(k, press)).collect::<Vec<_>>()))
        .collect()
}

/// Output in the frames `hold` of the given presses, V.
fn plateau_volts(recording: &Recording, hold: &Range<usize>, blocks: &[usize]) -> Vec<f64> {
    let per_frame = recording.measurements_per_frame();
    let range = hold.start * per_frame..hold.end * per_frame;
    blocks.iter().flat_map(|&block| recording.blocks()[block].volts[range.clone()].iter().copied()).collect()
}
