//! Compares the twin with recordings of its real skin: same images, same rows of weights, same estimators.
//!
//! The readout is calibrated on every other press of a session and compared on the others, or fitted to other sessions.
//! The comparison can therefore fail.

use crate::calibrate::{
    Estimated, FittedReadout, SessionEstimates, SessionPair, WINDOW_FRAMES, fit_windows, fitted_profile, predicted,
    reseeded,
};
use rand::RngExt as _;
use rayon::prelude::*;
use spts::progress::Progress;
use spts::record::Twin;
use spts::scene::Scene;
use spts_circuit::{Block, Interpolated, Mode, Profile, Readout, Recording};
use spts_contact::objects::OBJECTS;
use spts_eval::decoders::published_decodes;
use spts_eval::protocol::{PLATEAU, PUBLISHED_RATE_HZ, PUBLISHED_TAXELS, Protocol};
use spts_eval::{PublishedSkin, ScoreRow, ScoredSession, footprint_scene, mean_rows, score_sessions, unique};
use spts_input::Refusal;
use spts_models::{ConductanceMap, Streams, TaxelGains};
use std::path::Path;

/// A value of the real skin, and the band of its twins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Banded {
    /// Value of the real skin.
    pub real: f64,
    /// Mean of the twins.
    pub twin: f64,
    /// Lower end of the band, in which a further twin lies with a probability of 90 %.
    pub low: f64,
    /// Upper end of the band.
    pub high: f64,
}

impl Banded {
    /// The band of the values `twins`, cut off at `limits`; `None` without values.
    pub fn of(real: f64, twins: &[f64], limits: [f64; 2]) -> Option<Self> {
        let (low, high) = predicted(twins)?;
        Some(Self {
            real,
            twin: twins.iter().sum::<f64>() / twins.len() as f64,
            low: low.max(limits[0]),
            high: high.min(limits[1]),
        })
    }

    /// twin − real.
    pub fn difference(&self) -> f64 {
        self.twin - self.real
    }

    /// Whether the real value lies in the band; `None` for another value than that of all twins, which are equal: how
    /// far a further twin may lie from them is not known then.
    pub fn inside(&self) -> Option<bool> {
        let inside = (self.low..=self.high).contains(&self.real);
        (inside || self.low < self.high).then_some(inside)
    }
}

/// Limits of a band of values that have none, of values that are not negative, and of shares.
pub(crate) const UNLIMITED: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
pub(crate) const POSITIVE: [f64; 2] = [0.0, f64::INFINITY];
pub(crate) const SHARE: [f64; 2] = [0.0, 1.0];

/// Estimates of one session of the real skin and of the twin, and the twin's recording.
#[derive(Debug, Clone)]
pub struct ComparedSession {
    /// Estimates from the skin's compared presses.
    pub real: SessionEstimates,
    /// Estimates from the twin's presses.
    pub twin: SessionEstimates,
    /// The twin's session. Presses that are not compared are the skin's own.
    pub recording: Recording,
}

/// Presses (from 0) for calibration, and for comparison: the first, third, … and the second, fourth, …. They alternate
/// because the readout drifts during a session (the first tap of the memory by 0.01). `None` for one press.
fn split(recording: &Recording) -> Option<(Vec<usize>, Vec<usize>)> {
    let presses = recording.blocks().len();
    (presses > 1).then(|| ((0..presses).step_by(2).collect(), (1..presses).step_by(2).collect()))
}

/// Presses of a session for calibration, and those that are compared.
///
/// # Errors
/// [`Refusal`] for a session of one press.
fn halves(pair: &SessionPair) -> Result<(Vec<usize>, Vec<usize>), Refusal> {
    split(&pair.compressive).ok_or_else(|| {
        Refusal::new(format!(
            "{} compressive: `presses` = 1 is outside [2, ∞): some calibrate, the others are compared",
            pair.session
        ))
    })
}

/// Estimates from the presses `blocks` of `recording`, the compressive recording of `pair` or one like it.
fn estimated(pair: &SessionPair, recording: &Recording, blocks: &[usize]) -> Result<SessionEstimates, Refusal> {
    SessionEstimates::of(pair, recording, blocks)
        .ok_or_else(|| Refusal::new(format!("{} compressive: no press can be fitted", pair.session)))
}

/// The presses of `pair` that are compared, with `images`, through the readout with `profile`, in its session number
/// `draw`. Simulated images are of skin number `draw`, the same for all sessions. `fitted` says which cells of the
/// skin's own recording do not run their sequence.
///
/// # Errors
/// [`Refusal`] when a press has no image or the readout refuses it.
fn twin_of(
    pair: &SessionPair,
    images: &Images,
    (fitted, profile): (&SessionEstimates, &Profile),
    streams: Streams,
    draw: u64,
) -> Result<Recording, Refusal> {
    let real = &pair.compressive;
    let (_, blocks) = halves(pair)?;
    let readout = streams.child(&format!("compare/{}", pair.session), 0);
    match images {
        Images::Recorded => {
            let images = |block| recorded_image(real, block, fitted, profile);
            replay(real, &blocks, &images, profile, readout, draw)
        }
        Images::Simulated { gains } => {
            let seed = streams.rng("compare/skin", draw).random::<u64>() >> 1;
            let presses = simulated_presses(pair, seed, gains.as_ref())?;
            replay(real, &blocks, &|block| Ok(presses[block].clone()), profile, readout, draw)
        }
    }
}

/// Calibrates, replays and analyses one session.
///
/// # Errors
/// [`Refusal`] if there are too few presses, a press cannot be fitted, or the readout refuses the fitted values.
fn compare(pair: &SessionPair, images: &Images, streams: Streams) -> Result<ComparedSession, Refusal> {
    let (calibration, compared) = halves(pair)?;
    let fitted = estimated(pair, &pair.compressive, &calibration)?;
    let real = estimated(pair, &pair.compressive, &compared)?;
    let profile = profile_of(std::slice::from_ref(&fitted), pair)?;
    let recording = twin_of(pair, images, (&fitted, &profile), streams, 0)?;
    let twin = estimated(pair, &recording, &compared)?;
    Ok(ComparedSession { real, twin, recording })
}

/// The profile that is fitted to `sessions`, on the skin of `pair`.
fn profile_of(sessions: &[SessionEstimates], pair: &SessionPair) -> Result<Profile, Refusal> {
    let taxels = u32::try_from(pair.compressive.taxels()).unwrap_or(u32::MAX);
    let fitted = fitted_profile(&FittedReadout::of(sessions), taxels);
    Ok(fitted.map_err(|e| e.at("the fitted profile"))?.0)
}

/// The images that the twin's readout is given.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Images {
    /// Those measured on the skin.
    #[default]
    Recorded,
    /// Those of the simulation: the same object on a simulated skin.
    Simulated {
        /// Gains of that skin; `None` for an arbitrary skin.
        gains: Option<TaxelGains>,
    },
}

/// Settings of `spts compare`, which compares the twin's recordings with those of the real skin.
#[derive(Debug, Clone)]
pub struct CompareStudy<'a> {
    /// Folder from which the sessions were read.
    pub recordings: &'a Path,
    /// Its sessions.
    pub pairs: &'a [SessionPair],
    /// What is needed for scoring; without it there are no score curves.
    pub real: Option<&'a PublishedSkin>,
    /// The images for the twin.
    pub images: Images,
    /// Predicts every session with a profile fitted to others, instead of calibrating on its own odd presses.
    pub prediction: Option<Prediction>,
    /// Seed of the twin's random numbers.
    pub seed: u64,
}

/// Results of `spts compare`: statistics and score curves of the twin beside those of the real skin.
#[derive(Debug, Clone, Default)]
pub struct CompareReport {
    /// Sessions.
    pub compared: Vec<ComparedSession>,
    /// Statistics that must agree.
    pub statistics: Vec<Statistic>,
    /// Score curves, if requested.
    pub curves: Option<ScoreCurves>,
    /// Statistics compared with the band of a profile fitted to others, if requested.
    pub predicted: Vec<PredictedStatistic>,
    /// Statistics of effects that the readout does not model.
    pub not_modelled: Vec<Statistic>,
}

impl CompareStudy<'_> {
    /// Calibrates and replays every session, and scores it if the published dictionary and library are given.
    ///
    /// # Errors
    /// [`Refusal`] if a session cannot be compared.
    pub fn run(&self, progress: &dyn Progress) -> Result<CompareReport, Refusal> {
        let report = self.compared(progress);
        report.map_err(|refusal| refusal.at(self.recordings.display()))
    }

    fn compared(&self, progress: &dyn Progress) -> Result<CompareReport, Refusal> {
        let streams = Streams::new(self.seed);
        let done = || progress.step();
        if let Some(prediction) = &self.prediction {
            let draws = usize::try_from(prediction.draws).unwrap_or(usize::MAX);
            progress.stage("predicting sessions", Some(self.pairs.len() * draws));
            let predicted = predicted_statistics(self.pairs, prediction, &self.images, streams, &done)?;
            progress.end();
            return Ok(CompareReport { predicted, ..CompareReport::default() });
        }
        progress.stage("replaying sessions", Some(self.pairs.len()));
        let compared = self.pairs.par_iter().map(|pair| {
            let compared = compare(pair, &self.images, streams);
            done();
            compared
        });
        let compared = compared.collect::<Result<Vec<_>, Refusal>>()?;
        progress.end();
        let curves = match self.real {
            Some(real) => {
                let sessions = scored_sessions(&compared, real);
                let presses = sessions.iter().flatten().map(|session| session.scored().len());
                progress.stage("scoring presses", Some(presses.sum()));
                let curves = curves(&sessions, real, &done)?;
                progress.end();
                Some(curves)
            }
            None => None,
        };
        Ok(CompareReport {
            statistics: compared.iter().flat_map(ComparedSession::statistics).collect(),
            not_modelled: compared.iter().flat_map(ComparedSession::not_modelled).collect(),
            compared,
            predicted: Vec::new(),
            curves,
        })
    }
}

impl CompareReport {
    /// Statistics of both kinds.
    pub fn all_statistics(&self) -> impl Iterator<Item = &Statistic> {
        self.statistics.iter().chain(&self.not_modelled)
    }

    /// Distances of the score curves; empty without curves.
    pub fn distances(&self) -> &[CurveDistance] {
        self.curves.as_ref().map_or(&[], |curves| &curves.distances)
    }
}

/// One statistic of a session, such as the noise, in the recordings of the real skin and in those of its twin.
#[derive(Debug, Clone, PartialEq)]
pub struct Statistic {
    /// Object.
    pub session: String,
    /// Name.
    pub name: &'static str,
    /// Value in the recordings of the skin.
    pub real: f64,
    /// Standard error of that value; `None` if there is none.
    pub real_standard_error: Option<f64>,
    /// Value in the twin's recordings.
    pub twin: f64,
    /// Standard error of that value; `None` if there is none.
    pub twin_standard_error: Option<f64>,
    /// Allowed difference, in words.
    pub tolerance: &'static str,
    /// Whether the difference is allowed; `None` for effects that the readout does not model.
    pub ok: Option<bool>,
}

/// What difference is allowed.
#[derive(Debug, Clone, Copy)]
enum Allowed {
    /// |twin − real| relative to |real|.
    Share(f64),
    /// |twin − real|.
    Difference(f64),
    /// The larger value divided by the smaller; both must be positive.
    Factor(f64),
}

impl Allowed {
    fn holds(self, real: f64, twin: f64) -> bool {
        match self {
            Self::Share(share) => (twin - real).abs() <= share * real.abs(),
            Self::Difference(most) => (twin - real).abs() <= most,
            Self::Factor(factor) => real > 0.0 && twin > 0.0 && (twin / real).max(real / twin) <= factor,
        }
    }
}

/// Numbers that are compared, the tolerance, its words, and the limits of the number.
const COMPARED: [(&str, Allowed, &str, [f64; 2]); 7] = [
    ("residual", Allowed::Share(0.15), "15 %", POSITIVE),
    ("h1", Allowed::Difference(0.01), "0.01", UNLIMITED),
    ("h2", Allowed::Difference(0.01), "0.01", UNLIMITED),
    ("outliers_5sd", Allowed::Factor(1.5), "factor 1.5", SHARE),
    ("late_per_flip", Allowed::Share(0.30), "30 %", SHARE),
    ("idle_noise", Allowed::Share(0.20), "20 %", POSITIVE),
    ("kurtosis", Allowed::Factor(2.0), "factor 2", UNLIMITED),
];

/// Rounding of a step that is found as a range over a whole number: relative.
const STEP_ROUNDING: f64 = 1e-9;
/// Largest distance of two quantiles over the range of the output.
const QUANTILE_SHARE: f64 = 0.10;

/// Numbers of the recordings that the readout does not model.
const NOT_MODELLED: [&str; 3] = ["idle_sd", "idle_parity", "unexplained_outliers"];

impl ComparedSession {
    fn statistic(
        &self,
        name: &'static str,
        [real, twin]: [Estimated; 2],
        tolerance: &'static str,
        ok: Option<bool>,
    ) -> Statistic {
        Statistic {
            session: self.real.session.clone(),
            name,
            real: real.value,
            real_standard_error: real.standard_error,
            twin: twin.value,
            twin_standard_error: twin.standard_error,
            tolerance,
            ok,
        }
    }

    /// The number `name` of skin and twin.
    fn numbers(&self, name: &str) -> Option<[Estimated; 2]> {
        Some([*self.real.numbers.get(name)?, *self.twin.numbers.get(name)?])
    }

    /// Statistics that must agree.
    fn statistics(&self) -> Vec<Statistic> {
        let compared = COMPARED.iter().filter_map(|&(name, allowed, words, _)| {
            let numbers = self.numbers(name)?;
            let ok = allowed.holds(numbers[0].value, numbers[1].value);
            Some(self.statistic(name, numbers, words, Some(ok)))
        });
        let mut rows: Vec<Statistic> = compared.collect();
        let exact = |value| Estimated { value, standard_error: None, n: 1 };
        let (real, twin) = (&self.real, &self.twin);
        let [real_v, twin_v] = [real, twin].map(|s| s.steps.map_or(f64::NAN, |s| s.step_v));
        let same = (real_v - twin_v).abs() <= STEP_ROUNDING * real_v.abs();
        rows.push(self.statistic("step_v", [real_v, twin_v].map(exact), "exact", Some(same)));
        let gap = quantile_gap(&real.output_quantiles_v, &twin.output_quantiles_v);
        let small = Some(gap <= QUANTILE_SHARE);
        rows.push(self.statistic("quantile_gap", [0.0, gap].map(exact), "10 % of the range", small));
        rows
    }

    /// Statistics of effects that the readout does not model, without a verdict.
    fn not_modelled(&self) -> Vec<Statistic> {
        let row = |name| Some(self.statistic(name, self.numbers(name)?, "not modelled", None));
        NOT_MODELLED.into_iter().filter_map(row).collect()
    }
}

/// Largest distance of the quantiles over the range of the real ones.
fn quantile_gap(real: &[f64], twin: &[f64]) -> f64 {
    let range = real.last().unwrap_or(&0.0) - real.first().unwrap_or(&0.0);
    real.iter().zip(twin).map(|(r, t)| (r - t).abs()).fold(0.0, f64::max) / range
}

/// Numbers of measurements of the comparison.
pub const MEASUREMENTS: [usize; 11] = [7, 10, 13, 15, 20, 25, 30, 40, 50, 75, 100];

/// A score of a row: name, largest mean |twin − real| allowed, value.
type Metric = (&'static str, f64, fn(&ScoreRow) -> f64);

/// Scores that are compared.
const METRICS: [Metric; 3] =
    [("support", 0.02, |r| r.support), ("iou", 0.06, |r| r.iou), ("class_vote20", 0.05, |r| r.class_vote20)];

/// How far the twin's curve of a score over M is from the real skin's.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveDistance {
    /// Score.
    pub metric: &'static str,
    /// Decoding variant.
    pub decode: &'static str,
    /// Mean over [`MEASUREMENTS`] of |twin − real|, each the mean over the objects.
    pub mean_abs_difference: f64,
    /// Largest |twin − real|.
    pub max_abs_difference: f64,
    /// Largest allowed mean difference.
    pub tolerance: f64,
    /// Whether the mean difference is allowed.
    pub ok: bool,
}

/// Score curves, and the rows from which they are computed.
#[derive(Debug, Clone)]
pub struct ScoreCurves {
    /// Distances.
    pub distances: Vec<CurveDistance>,
    /// Mean rows of the skin.
    pub real: Vec<ScoreRow>,
    /// Mean rows of the twin.
    pub twin: Vec<ScoreRow>,
}

/// The presses of `recording` that `protocol` scores and the readout was not calibrated on, and a protocol that scores
/// them all. `None` when there are none.
fn compared_only(recording: &Recording, protocol: &Protocol) -> Option<(Recording, Protocol)> {
    let scored = protocol.presses_of(recording);
    let (_, compared) = split(recording)?;
    let blocks: Vec<_> = compared
        .into_iter()
        .filter(|block| scored.contains(block))
        .map(|block| recording.blocks()[block].clone())
        .collect();
    let protocol = Protocol { first_press: 0, presses: blocks.len(), ..*protocol };
    Some((recording.with_blocks(blocks).ok()?, protocol))
}

/// The compared sessions of the skin and of the twin, with the presses of the protocol that were not used for
/// calibration.
fn scored_sessions(compared: &[ComparedSession], real: &PublishedSkin) -> [Vec<ScoredSession>; 2] {
    [false, true].map(|is_twin| {
        let scored = compared.iter().filter_map(|c| {
            let session = real.skin.sessions.iter().find(|s| s.name == c.real.session)?;
            let own = session.compressive.as_ref();
            let recording = if is_twin { Some(&c.recording) } else { own };
            let (compressive, protocol) = compared_only(recording?, &session.protocol)?;
            Some(ScoredSession { compressive: Some(compressive), protocol, ..session.clone() })
        });
        scored.collect()
    })
}

/// Score curves of the `sessions` of the skin and of the twin. True images, dictionary and library are the published
/// ones for both: the ground truth is the skin's own raster session.
fn curves(
    sessions: &[Vec<ScoredSession>; 2],
    real: &PublishedSkin,
    done: &(dyn Fn() + Sync),
) -> Result<ScoreCurves, Refusal> {
    let decoders = published_decodes(&real.skin.learned)?;
    let [skin, twin] = sessions.each_ref().map(|sessions| {
        let sessions: Vec<&ScoredSession> = sessions.iter().collect();
        let rows = score_sessions(&sessions, &decoders, &MEASUREMENTS, done)?;
        Ok::<_, Refusal>(mean_rows(&rows))
    });
    let (real, twin) = (skin?, twin?);
    Ok(ScoreCurves { distances: curve_distances(&real, &twin), real, twin })
}

fn curve_distances(real: &[ScoreRow], twin: &[ScoreRow]) -> Vec<CurveDistance> {
    let mut out = Vec::new();
    for decode in unique(real.iter().map(|r| r.decode)) {
        for (metric, tolerance, get) in METRICS {
            let pairs = real.iter().filter(|r| r.decode == decode).filter_map(|r| {
                let t = twin.iter().find(|t| t.decode == decode && t.m == r.m)?;
                Some((get(t) - get(r)).abs())
            });
            let gaps: Vec<f64> = pairs.collect();
            let mean_abs_difference = gaps.iter().sum::<f64>() / gaps.len() as f64;
            out.push(CurveDistance {
                metric,
                decode,
                mean_abs_difference,
                max_abs_difference: gaps.iter().copied().fold(0.0, f64::max),
                tolerance,
                ok: mean_abs_difference <= tolerance,
            });
        }
    }
    out
}

/// Settings of `spts compare --profile`: sessions are predicted by a profile that was not fitted to them.
#[derive(Debug, Clone)]
pub struct Prediction {
    /// The profile; `None` for one that is fitted to all presses of the other sessions.
    pub profile: Option<Profile>,
    /// Number of twins of every session, each with other values from the spans of the profile; [2, 1000].
    pub draws: u64,
}

/// One statistic of one session, compared with the band of its twins.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictedStatistic {
    /// Session.
    pub session: String,
    /// Name.
    pub name: &'static str,
    /// Value and band.
    pub of: Banded,
}

/// Numbers of every session, each beside the band of its twins; `done` is called after every twin.
///
/// # Errors
/// [`Refusal`] when a session cannot be fitted, or with fewer than three sessions and no profile.
fn predicted_statistics(
    pairs: &[SessionPair],
    asked: &Prediction,
    images: &Images,
    streams: Streams,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<PredictedStatistic>, Refusal> {
    let whole = |pair: &SessionPair| {
        let blocks: Vec<usize> = (0..pair.compressive.blocks().len()).collect();
        estimated(pair, &pair.compressive, &blocks)
    };
    let sessions: Vec<SessionEstimates> = pairs.par_iter().map(whole).collect::<Result<_, _>>()?;
    let mut rows = Vec::new();
    for (pair, fitted) in pairs.iter().zip(&sessions) {
        let profile = match &asked.profile {
            Some(profile) => profile.clone(),
            None if sessions.len() < 3 => {
                return Err(Refusal::new(format!(
                    "{} compressive: sessions beside it: {}; valid: two or more, to fit the spans of a profile to; or name \
                     a profile",
                    pair.session,
                    sessions.len() - 1
                )));
            }
            None => {
                let others = sessions.iter().filter(|other| !std::ptr::eq(*other, fitted));
                profile_of(&others.cloned().collect::<Vec<_>>(), pair)?
            }
        };
        let (_, blocks) = halves(pair)?;
        let real = estimated(pair, &pair.compressive, &blocks)?;
        let twins = (0..asked.draws).into_par_iter().map(|draw| {
            let recording = twin_of(pair, images, (fitted, &profile), streams, draw)?;
            done();
            estimated(pair, &recording, &blocks)
        });
        let twins = twins.collect::<Result<Vec<_>, Refusal>>()?;
        rows.extend(COMPARED.iter().filter_map(|&(name, _, _, limits)| {
            let value = |session: &SessionEstimates| Some(session.value(name)).filter(|v| v.is_finite());
            let drawn: Vec<f64> = twins.iter().filter_map(value).collect();
            let of = Banded::of(value(&real)?, &drawn, limits).filter(|_| drawn.len() > 1)?;
            let session = pair.session.clone();
            Some(PredictedStatistic { session, name, of })
        }));
    }
    Ok(rows)
}

/// Records the presses `blocks` of `real` again: with the conductance from `source`, the same rows of weights, and the
/// readout `profile`, in session number `session`. The other presses are unchanged.
///
/// # Errors
/// [`Refusal`] if a press has no conductance, or the readout refuses it.
pub(crate) fn replay(
    real: &Recording,
    blocks: &[usize],
    source: &(dyn Fn(usize) -> Result<Interpolated, Refusal> + Sync),
    profile: &Profile,
    streams: Streams,
    session: u64,
) -> Result<Recording, Refusal> {
    let profile = profile.on(real.layout()).and_then(|profile| profile.with_weights(real.weights()));
    let profile = profile.map_err(readout_refused)?;
    let again = |&block: &usize| {
        let mut press = source(block)?;
        let before = &real.blocks()[block];
        let mut record = || {
            let mut readout = Readout::new(&profile, Mode::Compressive, real.layout(), streams, session)?;
            readout.seek(block as u64, before.frame_position - real.frames() as u64);
            readout.acquire(&mut press, real.frames() * real.measurements_per_frame())
        };
        let anew = record().map_err(readout_refused)?;
        let idle_frames = before.idle_frames;
        Ok((block, Block { idle_frames, ..anew }))
    };
    let anew = blocks.par_iter().map(again).collect::<Result<Vec<_>, Refusal>>()?;
    let mut all = real.blocks().to_vec();
    for (block, recorded) in anew {
        all[block] = recorded;
    }
    real.with_blocks(all)
}

/// Conductance of the skin in the course of a press of `real`, S, for a readout with `profile`: the image measured by
/// least squares in windows of [`WINDOW_FRAMES`], at the middle of each, joined by straight lines.
///
/// The noise of the windows adds √(p/n) = 0.2 of one measurement's noise to the twin's output, 4 % of its variance. It
/// is constant within a window, so the estimators, which fit the image again, are not affected.
pub(crate) fn recorded_image(
    real: &Recording,
    block: usize,
    fitted: &SessionEstimates,
    profile: &Profile,
) -> Result<Interpolated, Refusal> {
    let cells = reseeded(&fitted.faults);
    let windows = fit_windows(real, block, &cells, false, 0..real.frames(), WINDOW_FRAMES);
    let middle_s = |first_row: u64| {
        let before = (first_row - real.first_row(block, 0)) as f64;
        (before + 0.5 * (WINDOW_FRAMES * real.measurements_per_frame()) as f64) / profile.sample_rate_hz
    };
    let (mut times_s, mut maps) = (Vec::new(), Vec::new());
    for window in windows {
        times_s.push(middle_s(window.first_row));
        let mut image = window.image;
        for cell in &fitted.overdriven {
            image[cell.taxel as usize] *= cell.over_binary;
        }
        // noise of taxels that carry nothing may be below 0; no conductance is
        let siemens = image.iter().map(|x| x.max(0.0) / profile.volts_per_siemens());
        maps.push(ConductanceMap::from_values(1, real.taxels(), siemens.collect()));
    }
    Interpolated::new(times_s, maps).map_err(|e| e.at("conductance"))
}

pub(crate) fn readout_refused(error: Refusal) -> Refusal {
    error.at("readout")
}

/// The lift begins so long after the hold at least, s: as much as it scatters by.
const LIFT_AFTER_S: f64 = 0.04;

/// Conductance over time in as many presses of the object of `pair` as its session has, on the skin that follows from
/// `seed`: one with the given `gains`, or any.
///
/// # Errors
/// [`Refusal`] when the simulation does not know the object, or fails.
fn simulated_presses(pair: &SessionPair, seed: u64, gains: Option<&TaxelGains>) -> Result<Vec<Interpolated>, Refusal> {
    let Some(object) = OBJECTS.iter().find(|object| object.name == pair.object) else {
        return Err(Refusal::new(format!(
            "{} compressive: `object` = {:?} is not known to the simulation; known: {}",
            pair.session,
            pair.object,
            OBJECTS.iter().map(|o| o.name).collect::<Vec<_>>().join(", ")
        )));
    };
    let real = &pair.compressive;
    let mut config = footprint_scene(object.name, real.blocks().len(), seed);
    config.skin = *real.layout();
    // the hold of the session, and everything that comes before and after it as usual
    let frame_s = real.measurements_per_frame() as f64 / real.sample_rate_hz();
    let published_s = PUBLISHED_TAXELS as f64 / PUBLISHED_RATE_HZ;
    let later_s = pair.hold.start as f64 * frame_s - PLATEAU.start as f64 * published_s;
    if let Some(press) = &mut config.press {
        press.onset_s += later_s;
        press.lift_s = (press.lift_s + later_s).max(pair.hold.end as f64 * frame_s + LIFT_AFTER_S);
        press.duration_s = (real.frames() as f64 * frame_s).max(press.lift_s + press.fall_s);
    }
    if let Some(gains) = gains {
        let gains = toml::Value::try_from(gains).map_err(|e| Refusal::from_error(e).at("gains"))?;
        config.transducer_parameters.insert("gains".to_owned(), gains);
    }
    let pressed = || {
        let twin = Twin::new(&Scene::new(config, Path::new(""))?)?;
        let presses = twin.presses(0..real.blocks().len(), &|| ())?;
        twin.conductance(&presses, &twin.acquisition(Mode::Compressive))
    };
    pressed().map_err(|refusal: Refusal| refusal.at("simulated presses"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_mean_what_they_say() {
        assert!(Allowed::Share(0.15).holds(0.2, 0.229) && !Allowed::Share(0.15).holds(0.2, 0.231));
        assert!(Allowed::Factor(1.5).holds(0.01, 0.0149) && !Allowed::Factor(1.5).holds(0.01, 0.0066));
        assert!(!Allowed::Factor(2.0).holds(0.0, 0.0), "nothing is not a factor of nothing");
        assert!(Allowed::Difference(0.01).holds(-0.02, -0.012) && !Allowed::Difference(0.01).holds(0.0, f64::NAN));
        // a value beside a band without a width has no verdict
        let band = |real, twins: &[f64]| Banded::of(real, twins, SHARE).unwrap();
        assert_eq!(band(0.9, &[1.0, 1.0, 1.0]).inside(), None);
        assert_eq!(band(1.0, &[1.0, 1.0, 1.0]).inside(), Some(true));
        let wide = band(0.2, &[0.1, 0.5, 0.3]);
        assert_eq!((wide.inside(), wide.low), (Some(true), 0.0));
        assert_eq!(band(0.0, &[0.8, 0.81, 0.79]).inside(), Some(false));
        // quantiles 1 V apart at most, over a range of 10 V
        assert!((quantile_gap(&[-5.0, 0.0, 5.0], &[-4.0, 0.5, 5.0]) - 0.1).abs() < 1e-15);
    }
}
