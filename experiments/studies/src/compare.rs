//! Compares the twin with recordings of its real skin: same images, same rows of weights, same estimators.
//!
//! The readout is calibrated on every other press of a session and compared on the others, or fitted to other sessions.
//! The comparison can therefore fail.

use crate::calibrate::{
    FitRequest, FittedReadout, SessionEstimates, SessionPair, WINDOW_FRAMES, fit_windows, fitted_profile, predicted,
    reseeded,
};
use rayon::prelude::*;
use serde::{Serialize, Serializer};
use spts::progress::Progress;
use spts::record::Twin;
use spts::scene::Scene;
use spts_circuit::{Block, Interpolated, Mode, Profile, Readout, Recording};
use spts_contact::objects::OBJECTS;
use spts_eval::decoders::PublishedDecode;
use spts_eval::protocol::{PLATEAU, PUBLISHED_RATE_HZ, PUBLISHED_TAXELS, Protocol};
use spts_eval::{PublishedSkin, ScoreError, ScoreRow, ScoredSession, footprint_scene, mean_rows, score_session};
use spts_input::Refusal;
use spts_models::{ConductanceMap, Streams, TaxelGains};
use std::path::Path;

/// Estimates of one session of the real skin and of the twin, and the twin's recording.
#[derive(Debug, Clone)]
pub struct ComparedSession {
    /// Estimates from the skin's compared presses.
    pub real: SessionEstimates,
    /// Estimates from the twin's presses.
    pub twin: SessionEstimates,
    /// The readout fitted to the calibration presses.
    pub readings: FittedReadout,
    /// The twin's session. Presses that are not compared are the skin's own.
    pub recording: Recording,
}

/// Presses (from 0) for calibration, and for comparison: the first, third, … and the second, fourth, …. They alternate
/// because the readout drifts during a session (the first tap of the memory by 0.01). `None` for one press.
pub fn split(recording: &Recording) -> Option<(Vec<usize>, Vec<usize>)> {
    let presses = recording.blocks().len();
    (presses > 1).then(|| ((0..presses).step_by(2).collect(), (1..presses).step_by(2).collect()))
}

/// Presses of a session that are compared.
///
/// # Errors
/// [`Refusal`] for a session of one press.
fn compared_presses(pair: &SessionPair) -> Result<Vec<usize>, Refusal> {
    let (_, compared) = split(&pair.compressive).ok_or_else(|| one_press(pair))?;
    Ok(compared)
}

fn one_press(pair: &SessionPair) -> Refusal {
    Refusal::new(format!(
        "{} compressive: `presses` = 1 is outside [2, ∞): some calibrate, the others are compared",
        pair.session
    ))
}

fn unfit(pair: &SessionPair) -> Refusal {
    Refusal::new(format!("{} compressive: no press can be fitted", pair.session))
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
    let blocks = compared_presses(pair)?;
    let readout = streams.child(&format!("compare/{}", pair.session), 0);
    match images {
        Images::Recorded => {
            let images = recorded_images(real, fitted, profile);
            replay(real, &blocks, &images, profile, readout, draw)
        }
        Images::Simulated { gains } => {
            let presses = SimulatedPresses::of(pair, skin_seed(streams, draw), gains.as_ref())?;
            replay(real, &blocks, &|block| Ok(presses.press(block)), profile, readout, draw)
        }
    }
}

/// Calibrates, replays and analyses one session.
///
/// # Errors
/// [`Refusal`] if there are too few presses, a press cannot be fitted, or the readout refuses the fitted values.
pub fn compare(pair: &SessionPair, images: &Images, streams: Streams) -> Result<ComparedSession, Refusal> {
    let (calibration, compared) = split(&pair.compressive).ok_or_else(|| one_press(pair))?;
    let estimate = |recording: &Recording, blocks: &[usize]| SessionEstimates::of(pair, recording, blocks);
    let fitted = estimate(&pair.compressive, &calibration).ok_or_else(|| unfit(pair))?;
    let real = estimate(&pair.compressive, &compared).ok_or_else(|| unfit(pair))?;
    let readings = FittedReadout::of(std::slice::from_ref(&fitted));
    let taxels = u32::try_from(pair.compressive.taxels()).unwrap_or(u32::MAX);
    let (profile, _) = fitted_profile(&readings, taxels).map_err(not_a_profile)?;
    let recording = twin_of(pair, images, (&fitted, &profile), streams, 0)?;
    let twin = estimate(&recording, &compared).ok_or_else(|| unfit(pair))?;
    Ok(ComparedSession {
        real,
        twin,
        readings,
        recording,
    })
}

/// [`compare`] for every session. `done` is called after each.
///
/// # Errors
/// The error of the first session that cannot be compared.
pub fn compare_all(
    pairs: &[SessionPair],
    images: &Images,
    streams: Streams,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<ComparedSession>, Refusal> {
    let one = |pair| {
        let compared = compare(pair, images, streams);
        done();
        compared
    };
    pairs.par_iter().map(one).collect()
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
#[derive(Debug, Clone, Serialize)]
pub struct CompareReport {
    /// Sessions.
    #[serde(skip)]
    pub compared: Vec<ComparedSession>,
    /// Statistics that must agree.
    pub statistics: Vec<Statistic>,
    /// Score curves, if requested. Only their distances are serialised.
    #[serde(serialize_with = "distances_only")]
    pub curves: Option<ScoreCurves>,
    /// Statistics compared with the band of a profile fitted to others, if requested.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub predicted: Vec<PredictedStatistic>,
    /// Statistics of effects that the readout does not model.
    pub not_modelled: Vec<Statistic>,
}

fn distances_only<S: Serializer>(curves: &Option<ScoreCurves>, serializer: S) -> Result<S::Ok, S::Error> {
    distances(curves.as_ref()).serialize(serializer)
}

fn distances(curves: Option<&ScoreCurves>) -> &[CurveDistance] {
    curves.map_or(&[], |c| &c.distances)
}

impl CompareStudy<'_> {
    /// Calibrates and replays every session, and scores it if the published dictionary and library are given.
    ///
    /// # Errors
    /// [`Refusal`] if a session cannot be compared.
    pub fn run(&self, progress: &dyn Progress) -> Result<CompareReport, Refusal> {
        if let Some(prediction) = &self.prediction {
            #[expect(clippy::cast_possible_truncation, reason = "at most 1000 draws")]
            let twins = self.pairs.len() * prediction.draws as usize;
            progress.stage("predicting sessions", Some(twins));
            let streams = Streams::new(self.seed);
            let predicted = predicted_statistics(self.pairs, prediction, &self.images, streams, &|| progress.step());
            progress.end();
            return Ok(CompareReport {
                compared: Vec::new(),
                statistics: Vec::new(),
                curves: None,
                predicted: predicted.map_err(|source| self.at(source))?,
                not_modelled: Vec::new(),
            });
        }
        progress.stage("replaying sessions", Some(self.pairs.len()));
        let compared = compare_all(self.pairs, &self.images, Streams::new(self.seed), &|| progress.step());
        let compared = compared.map_err(|source| self.at(source))?;
        progress.end();
        let scored = self.real.map(|real| {
            progress.stage("scoring presses", Some(steps(&compared, real)));
            let scored = curves(&compared, real, &|| progress.step());
            progress.end();
            scored
        });
        let curves = scored.transpose().map_err(Refusal::from_error)?;
        Ok(CompareReport {
            statistics: statistics(&compared),
            not_modelled: not_modelled(&compared),
            compared,
            predicted: Vec::new(),
            curves,
        })
    }

    fn at(&self, source: Refusal) -> Refusal {
        source.at(self.recordings.display())
    }
}

impl CompareReport {
    /// Statistics of both kinds.
    pub fn all_statistics(&self) -> Vec<Statistic> {
        [self.statistics.as_slice(), &self.not_modelled].concat()
    }

    /// Distances of the score curves; empty without curves.
    pub fn distances(&self) -> &[CurveDistance] {
        distances(self.curves.as_ref())
    }
}

/// One statistic of a session, such as the noise, in the recordings of the real skin and in those of its twin.
#[derive(Debug, Clone, PartialEq, Serialize)]
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

/// Numbers that are compared, the tolerance, and its words.
const COMPARED: [(&str, Allowed, &str); 7] = [
    ("residual", Allowed::Share(0.15), "15 %"),
    ("h1", Allowed::Difference(0.01), "0.01"),
    ("h2", Allowed::Difference(0.01), "0.01"),
    ("outliers_5sd", Allowed::Factor(1.5), "factor 1.5"),
    ("late_per_flip", Allowed::Share(0.30), "30 %"),
    ("idle_noise", Allowed::Share(0.20), "20 %"),
    ("kurtosis", Allowed::Factor(2.0), "factor 2"),
];

/// Names of [`COMPARED`].
const COMPARED_NAMES: [&str; COMPARED.len()] = {
    let mut names = [""; COMPARED.len()];
    let mut k = 0;
    while k < names.len() {
        names[k] = COMPARED[k].0;
        k += 1;
    }
    names
};

/// The number `name` of a session, where it has one.
fn value_of(session: &SessionEstimates, name: &str) -> Option<f64> {
    session.numbers.get(name).map(|n| n.value).filter(|v| v.is_finite())
}

/// Rounding of a step that is found as a range over a whole number: relative.
const STEP_ROUNDING: f64 = 1e-9;
/// Largest distance of two quantiles over the range of the output.
const QUANTILE_SHARE: f64 = 0.10;

/// Every statistic of every session.
pub fn statistics(compared: &[ComparedSession]) -> Vec<Statistic> {
    compared.iter().flat_map(|c| session(&c.real, &c.twin)).collect()
}

fn session(real: &SessionEstimates, twin: &SessionEstimates) -> Vec<Statistic> {
    let mut rows = Vec::new();
    let mut push = |name, values: [f64; 2], errors: [Option<f64>; 2], tolerance, ok| {
        rows.push(Statistic {
            session: real.session.clone(),
            name,
            real: values[0],
            real_standard_error: errors[0],
            twin: values[1],
            twin_standard_error: errors[1],
            tolerance,
            ok,
        });
    };
    for (name, allowed, words) in COMPARED {
        let (Some(r), Some(t)) = (real.numbers.get(name), twin.numbers.get(name)) else {
            continue;
        };
        let ok = allowed.holds(r.value, t.value);
        push(
            name,
            [r.value, t.value],
            [r.standard_error, t.standard_error],
            words,
            Some(ok),
        );
    }
    let step_v = |s: &SessionEstimates| s.steps.map_or(f64::NAN, |s| s.step_v);
    let steps_v = [step_v(real), step_v(twin)];
    let same = (steps_v[0] - steps_v[1]).abs() <= STEP_ROUNDING * steps_v[0].abs();
    push("step_v", steps_v, [None; 2], "exact", Some(same));
    let gap = quantile_gap(&real.output_quantiles_v, &twin.output_quantiles_v);
    push(
        "quantile_gap",
        [0.0, gap],
        [None; 2],
        "10 % of the range",
        Some(gap <= QUANTILE_SHARE),
    );
    rows
}

/// Numbers of the recordings that the readout does not model.
const NOT_MODELLED: [&str; 3] = ["idle_sd", "idle_parity", "unexplained_outliers"];

/// Statistics of effects that the readout does not model, for every session, without a verdict.
pub fn not_modelled(compared: &[ComparedSession]) -> Vec<Statistic> {
    let row = |c: &ComparedSession, name: &'static str| {
        let (r, t) = (c.real.numbers.get(name)?, c.twin.numbers.get(name)?);
        Some(Statistic {
            session: c.real.session.clone(),
            name,
            real: r.value,
            real_standard_error: r.standard_error,
            twin: t.value,
            twin_standard_error: t.standard_error,
            tolerance: "not modelled",
            ok: None,
        })
    };
    let rows = compared.iter().flat_map(|c| NOT_MODELLED.map(|name| row(c, name)));
    rows.flatten().collect()
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
const METRICS: [Metric; 3] = [
    ("support", 0.02, |r| r.support),
    ("iou", 0.06, |r| r.iou),
    ("class_vote20", 0.05, |r| r.class_vote20),
];

/// How far the twin's curve of a score over M is from the real skin's.
#[derive(Debug, Clone, PartialEq, Serialize)]
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

/// Number of progress reports of [`curves`].
pub fn steps(compared: &[ComparedSession], real: &PublishedSkin) -> usize {
    2 * compared
        .iter()
        .filter_map(|c| {
            let session = real.skin.sessions.iter().find(|s| s.name == c.real.session)?;
            compared_only(&c.recording, &session.protocol)
        })
        .map(|(recording, _)| recording.blocks().len())
        .sum::<usize>()
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
    let protocol = Protocol {
        first_press: 0,
        presses: blocks.len(),
        ..*protocol
    };
    Some((recording.with_blocks(blocks).ok()?, protocol))
}

/// Scores the compared sessions of both skins, on presses of the protocol that were not used for calibration. True
/// images, dictionary and library are the published ones for both: the ground truth is the skin's own raster session.
///
/// # Errors
/// [`ScoreError`] if the published dictionary or library is not usable.
pub fn curves(
    compared: &[ComparedSession],
    real: &PublishedSkin,
    done: &(dyn Fn() + Sync),
) -> Result<ScoreCurves, ScoreError> {
    let decoders = PublishedDecode::named(&real.skin.learned).map_err(ScoreError::from)?;
    let score = |is_twin: bool| {
        let mut rows = Vec::new();
        for c in compared {
            let Some(session) = real.skin.sessions.iter().find(|s| s.name == c.real.session) else {
                continue;
            };
            let recording = if is_twin {
                Some(&c.recording)
            } else {
                session.compressive.as_ref()
            };
            let Some((compressive, protocol)) = recording.and_then(|r| compared_only(r, &session.protocol)) else {
                continue;
            };
            let session = ScoredSession {
                compressive: Some(compressive),
                protocol,
                ..session.clone()
            };
            rows.extend(score_session(&session, &decoders, &MEASUREMENTS, done)?);
        }
        Ok::<_, ScoreError>(mean_rows(&rows))
    };
    let (skin, twin) = (score(false)?, score(true)?);
    Ok(ScoreCurves {
        distances: curve_distances(&skin, &twin),
        real: skin,
        twin,
    })
}

fn curve_distances(real: &[ScoreRow], twin: &[ScoreRow]) -> Vec<CurveDistance> {
    let mut decodes: Vec<&'static str> = real.iter().map(|r| r.decode).collect();
    decodes.dedup();
    let mut out = Vec::new();
    for decode in decodes {
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

/// Which profile predicts a session: one fitted to the other sessions, or a given one.
#[derive(Debug, Clone)]
pub enum Predictor {
    /// A profile fitted to all presses of the other sessions.
    Others,
    /// The given profile.
    Profile(Box<Profile>),
}

/// Settings of `spts compare --profile`: sessions are predicted by a profile that was not fitted to them.
#[derive(Debug, Clone)]
pub struct Prediction {
    /// The profile.
    pub predictor: Predictor,
    /// Number of twins of every session, each with other values from the spans of the profile; [2, 1000].
    pub draws: u64,
}

/// One statistic of one session, compared with the band of its twins.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PredictedStatistic {
    /// Session.
    pub session: String,
    /// Name.
    pub name: &'static str,
    /// Value in the recordings of the skin.
    pub real: f64,
    /// Mean of the twins.
    pub twin: f64,
    /// Lower end of the span in which a further twin lies with a probability of 90 %.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
    /// Whether the real value lies in the span.
    pub inside: bool,
}

fn not_a_profile(error: impl std::error::Error + Send + Sync + 'static) -> Refusal {
    Refusal::from_error(error).at("the fitted profile")
}

/// Numbers of every session, each beside the band of its twins; `done` is called after every twin.
///
/// # Errors
/// [`Refusal`] when a session cannot be fitted, or with one session and no profile.
fn predicted_statistics(
    pairs: &[SessionPair],
    asked: &Prediction,
    images: &Images,
    streams: Streams,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<PredictedStatistic>, Refusal> {
    let whole = |pair: &SessionPair| {
        let blocks: Vec<usize> = (0..pair.compressive.blocks().len()).collect();
        SessionEstimates::of(pair, &pair.compressive, &blocks).ok_or_else(|| unfit(pair))
    };
    let sessions: Vec<SessionEstimates> = pairs.par_iter().map(whole).collect::<Result<_, _>>()?;
    let mut rows = Vec::new();
    for (k, pair) in pairs.iter().enumerate() {
        let taxels = u32::try_from(pair.compressive.taxels()).unwrap_or(u32::MAX);
        let profile = match &asked.predictor {
            Predictor::Profile(profile) => profile.as_ref().clone(),
            Predictor::Others => {
                let others: Vec<SessionEstimates> = sessions
                    .iter()
                    .enumerate()
                    .filter(|(other, _)| *other != k)
                    .map(|(_, s)| s.clone())
                    .collect();
                if others.is_empty() {
                    return Err(Refusal::new(format!(
                        "{} compressive: the only session, and no other to fit a profile to; name a profile",
                        pair.session
                    )));
                }
                fitted_profile(&FittedReadout::of(&others), taxels)
                    .map_err(not_a_profile)?
                    .0
            }
        };
        let blocks = compared_presses(pair)?;
        let real = SessionEstimates::of(pair, &pair.compressive, &blocks).ok_or_else(|| unfit(pair))?;
        let twin = |draw: u64| -> Result<SessionEstimates, Refusal> {
            let recording = twin_of(pair, images, (&sessions[k], &profile), streams, draw)?;
            done();
            SessionEstimates::of(pair, &recording, &blocks).ok_or_else(|| unfit(pair))
        };
        let twins: Vec<SessionEstimates> = (0..asked.draws).into_par_iter().map(twin).collect::<Result<_, _>>()?;
        for name in COMPARED_NAMES {
            let Some(value) = value_of(&real, name) else { continue };
            let drawn: Vec<f64> = twins.iter().filter_map(|twin| value_of(twin, name)).collect();
            let Some((low, high)) = predicted(&drawn).filter(|_| drawn.len() > 1) else {
                continue;
            };
            rows.push(PredictedStatistic {
                session: pair.session.clone(),
                name,
                real: value,
                twin: drawn.iter().sum::<f64>() / drawn.len() as f64,
                low,
                high,
                inside: (low..=high).contains(&value),
            });
        }
    }
    Ok(rows)
}

/// Conductance of a press as a function of time, by the number of the press.
pub type PressSource<'a> = dyn Fn(usize) -> Result<Interpolated, Refusal> + Sync + 'a;

/// Records the presses `blocks` of `real` again: with the conductance from `source`, the same rows of weights, and the
/// readout `profile`, in session number `session`. The other presses are unchanged.
///
/// # Errors
/// [`Refusal`] if a press has no conductance, or the readout refuses it.
pub fn replay(
    real: &Recording,
    blocks: &[usize],
    source: &PressSource<'_>,
    profile: &Profile,
    streams: Streams,
    session: u64,
) -> Result<Recording, Refusal> {
    let profile = profile
        .on(real.layout())
        .and_then(|profile| profile.with_weights(real.weights()));
    let profile = &profile.map_err(readout_refused)?;
    let anew: Vec<(usize, Block)> = blocks
        .par_iter()
        .map(|&block| {
            let mut readout =
                Readout::new(profile, Mode::Compressive, real.layout(), streams, session).map_err(readout_refused)?;
            Ok((block, record_again(real, block, &mut source(block)?, &mut readout)?))
        })
        .collect::<Result<_, Refusal>>()?;
    let mut all = real.blocks().to_vec();
    for (block, recorded) in anew {
        all[block] = recorded;
    }
    real.with_blocks(all)
}

fn record_again(
    real: &Recording,
    block: usize,
    source: &mut Interpolated,
    readout: &mut Readout,
) -> Result<Block, Refusal> {
    let Block {
        frame_position,
        idle_frames,
        ..
    } = real.blocks()[block];
    readout.seek(block as u64, frame_position - real.frames() as u64);
    let anew = readout
        .acquire(source, real.frames() * real.measurements_per_frame())
        .map_err(readout_refused)?;
    Ok(Block { idle_frames, ..anew })
}

/// Conductance of the skin in the presses of `real`, measured by least squares in windows of [`WINDOW_FRAMES`], for a
/// readout with `profile`.
///
/// The noise of the windows adds √(p/n) = 0.2 of one measurement's noise to the twin's output, 4 % of its variance. It
/// is constant within a window, so the estimators, which fit the image again, are not affected.
pub fn recorded_images<'a>(
    real: &'a Recording,
    fitted: &'a SessionEstimates,
    profile: &'a Profile,
) -> impl Fn(usize) -> Result<Interpolated, Refusal> + Sync + 'a {
    move |block| conductance(real, block, fitted, profile)
}

/// Conductance of the skin in the course of a press, S: the image at the middle of every window, joined by straight
/// lines.
fn conductance(
    real: &Recording,
    block: usize,
    fitted: &SessionEstimates,
    profile: &Profile,
) -> Result<Interpolated, Refusal> {
    let cells = reseeded(&fitted.faults);
    let ask = FitRequest {
        block,
        reseeded: &cells,
        parity: false,
    };
    let windows = fit_windows(real, ask, 0..real.frames(), WINDOW_FRAMES);
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
    Interpolated::new(times_s, maps).map_err(|e| Refusal::from_error(e).at("conductance"))
}

pub(crate) fn readout_refused(error: impl std::error::Error + Send + Sync + 'static) -> Refusal {
    Refusal::from_error(error).at("readout")
}

/// The lift begins so long after the hold at least, s: as much as it scatters by.
const LIFT_AFTER_S: f64 = 0.04;

/// Presses of one object on one simulated skin.
struct SimulatedPresses(Vec<Interpolated>);

impl SimulatedPresses {
    /// As many presses of the object of `pair` as its session has, on the skin that follows from `seed`: one with the
    /// given `gains`, or any.
    ///
    /// # Errors
    /// [`Refusal`] when the simulation does not know the object, or fails.
    fn of(pair: &SessionPair, seed: u64, gains: Option<&TaxelGains>) -> Result<Self, Refusal> {
        let Some(object) = OBJECTS.iter().find(|object| object.name == pair.object) else {
            return Err(Refusal::new(format!(
                "{} compressive: `object` = {:?} is not known to the simulation; known: {}",
                pair.session,
                pair.object,
                OBJECTS.iter().map(|o| o.name).collect::<Vec<_>>().join(", ")
            )));
        };
        let presses = pair.compressive.blocks().len();
        let mut config = footprint_scene(object.name, presses, seed);
        config.skin = *pair.compressive.layout();
        // the hold of the session, and everything that comes before and after it as usual
        let frame_s = pair.compressive.measurements_per_frame() as f64 / pair.compressive.sample_rate_hz();
        let published_s = PUBLISHED_TAXELS as f64 / PUBLISHED_RATE_HZ;
        let later_s = pair.hold.start as f64 * frame_s - PLATEAU.start as f64 * published_s;
        if let Some(press) = &mut config.press {
            press.onset_s += later_s;
            press.lift_s = (press.lift_s + later_s).max(pair.hold.end as f64 * frame_s + LIFT_AFTER_S);
            press.duration_s = (pair.compressive.frames() as f64 * frame_s).max(press.lift_s + press.fall_s);
        }
        if let Some(gains) = gains {
            let gains = toml::Value::try_from(gains).map_err(|e| Refusal::from_error(e).at("gains"))?;
            config.transducer_parameters.insert("gains".to_owned(), gains);
        }
        let failed = |error: spts::TwinError| Refusal::from_error(error).at("simulated presses");
        let scene = Scene::new(config, Path::new("")).map_err(failed)?;
        let twin = Twin::new(&scene).map_err(failed)?;
        let frames = twin.presses(0..presses, &|| ()).map_err(failed)?;
        let acquisition = twin.acquisition(spts_circuit::Mode::Compressive);
        Ok(Self(twin.conductance(&frames, &acquisition).map_err(failed)?))
    }

    /// Conductance over time of press `block`.
    fn press(&self, block: usize) -> Interpolated {
        self.0[block].clone()
    }
}

/// Seed of the simulated skin number `draw`.
fn skin_seed(streams: Streams, draw: u64) -> u64 {
    use rand::RngExt as _;
    streams.rng("compare/skin", draw).random::<u64>() >> 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_mean_what_they_say() {
        assert!(Allowed::Share(0.15).holds(0.2, 0.229) && !Allowed::Share(0.15).holds(0.2, 0.231));
        assert!(Allowed::Factor(1.5).holds(0.01, 0.0149) && !Allowed::Factor(1.5).holds(0.01, 0.0066));
        assert!(
            !Allowed::Factor(2.0).holds(0.0, 0.0),
            "nothing is not a factor of nothing"
        );
        assert!(Allowed::Difference(0.01).holds(-0.02, -0.012) && !Allowed::Difference(0.01).holds(0.0, f64::NAN));
        // quantiles 1 V apart at most, over a range of 10 V
        assert!((quantile_gap(&[-5.0, 0.0, 5.0], &[-4.0, 0.5, 5.0]) - 0.1).abs() < 1e-15);
    }
}
