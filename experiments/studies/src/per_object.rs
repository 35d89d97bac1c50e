//! Compares twin and skin object by object: the twin's scores over many simulated skins form a band, with which the
//! real skin's score is compared.
//!
//! One simulated skin says little: its taxels, session and noise are a single draw, and in a mean over objects errors
//! cancel. Here the band of an object shows what a further skin of the twin would score, and the distance between twin
//! and skin is the mean over objects of |twin − real|.

use crate::calibrate::{SessionEstimates, SessionPair, read};
use crate::compare::{Banded, SHARE, readout_refused};
use rayon::prelude::*;
use serde::Serialize;
use spts::chain::DEFAULT_READOUT;
use spts::data::SessionSet;
use spts::progress::Progress;
use spts::scene::{Scene, SceneConfig};
use spts::session::Recorded;
use spts_circuit::{Interpolated, Mode, Profile, Readout, Recording};
use spts_contact::objects::OBJECTS;
use spts_eval::board::{BoardSettings, ObjectRow, find};
use spts_eval::protocol::Protocol;
use spts_eval::training::{SkinGains, TrainingPresses, TrainingSource, templates};
use spts_eval::{ScoredSession, Scores, Sensing, SkinRun, Source, footprint_scene, twin_set, unique};
use spts_input::Refusal;
use spts_models::{ConductanceMap, SkinLayout, Streams, VelostatConfig};
use spts_recon::classify::Library;
use std::path::Path;

/// Numbers of measurements.
pub const MEASUREMENTS: [usize; 3] = [7, 20, 50];
/// Decoders: the published pursuit with matched weights, and the two best decoders.
pub const DECODERS: [&str; 3] = ["matched", "nn_lmmse", "evidence"];

/// Settings of `spts compare --skins`: every recorded object is pressed on many simulated skins, and scored like the
/// real one.
#[derive(Debug, Clone, Copy)]
pub struct PerObjectStudy<'a> {
    /// Folder of the recordings.
    pub recordings: &'a Path,
    /// Number of simulated skins.
    pub skins: u64,
    /// Seed of the first skin; the others have the following seeds.
    pub seed: u64,
    /// Whether the twin also reads out the skin's own images ([`ReadoutImages`]).
    pub causes: bool,
}

/// Results of `spts compare --skins`: each object's score on the real skin beside the band of the simulated skins.
#[derive(Debug, Clone, PartialEq)]
pub struct PerObjectReport {
    /// Number of simulated skins.
    pub skins: u64,
    /// Distances, one for each score.
    pub distances: Vec<ScoreDistance>,
    /// Bands, one for each object and score.
    pub objects: Vec<ObjectBand>,
}

impl PerObjectStudy<'_> {
    /// Simulates, records and scores. The result depends only on the recordings and the seed.
    ///
    /// # Errors
    /// [`Refusal`] for recordings that cannot be used, or a simulation that fails.
    pub fn run(&self, progress: &dyn Progress) -> Result<PerObjectReport, Refusal> {
        progress.stage("scoring the real skin", None);
        let real = Source::open(self.recordings)?;
        let with_sums = real.sessions.iter().filter(|s| s.scorable());
        let known: Vec<&str> = OBJECTS.iter().map(|o| o.name).collect();
        let objects = with_sums.map(|s| s.object.clone());
        let objects: Vec<String> = objects.filter(|name| known.contains(&name.as_str())).collect();
        if objects.is_empty() {
            return Err(Refusal::new(format!(
                "the recordings hold no compressive session of an object that the twin has; it has {}",
                known.join(", ")
            )));
        }
        let of_real = scores(&real, &objects, self.seed)?;
        progress.end();
        let mut all = Vec::new();
        let mut of =
            |images: ReadoutImages, what, steps: usize, skin: &(dyn Fn(u64) -> Result<Source, Refusal> + Sync)| {
                progress.stage(what, Some(usize::try_from(self.skins).unwrap_or(usize::MAX) * steps));
                let seeds = self.seed..self.seed.saturating_add(self.skins);
                let skins = seeds.into_par_iter().map(|seed| scores(&skin(seed)?, &objects, seed));
                all.extend(bands(images, &of_real, &skins.collect::<Result<Vec<_>, Refusal>>()?));
                progress.end();
                Ok::<_, Refusal>(())
            };
        let done = || progress.step();
        let presses = OBJECTS.len() * SCANNED + objects.len() * SCORED;
        of(ReadoutImages::Twin, "pressing simulated skins", presses, &|seed| {
            Ok(Source::new(twin(seed, &objects, true, &done)?)?.against_scans())
        })?;
        if self.causes {
            of(ReadoutImages::TwinWithSkinGains, "with the skin's gains", presses, &|seed| {
                with_skin_gains(&twin(seed, &objects, false, &done)?, &real, seed)
            })?;
            let raster = raster_images(&real, &objects)?;
            let compressive = compressive_images(self.recordings, &objects)?;
            for (images, volts) in [(ReadoutImages::SkinRaster, raster), (ReadoutImages::SkinCompressive, compressive)]
            {
                of(images, images.label(), real.sessions.len(), &|seed| with_images(&real, &volts, seed, &done))?;
            }
        }
        Ok(PerObjectReport { skins: self.skins, distances: distances(&all), objects: all })
    }
}

impl PerObjectReport {
    /// The distance of the twin in the score `score` of `decoder` at `m`.
    pub fn distance(&self, decoder: &str, m: usize, score: &str) -> Option<&ScoreDistance> {
        let key = (ReadoutImages::Twin, decoder, m, score);
        let mut distances = self.distances.iter();
        distances.find(|d| (d.images, d.decoder.as_str(), d.m, d.score) == key)
    }
}

/// Scores of `objects` in `source`. The published pursuit learns its dictionary from raster presses that are not scored
/// unless one is published; the others learn from such presses.
fn scores(source: &Source, objects: &[String], seed: u64) -> Result<Vec<(ObjectScore, f64)>, Refusal> {
    let settings = BoardSettings {
        network: None,
        decoders: DECODERS.iter().filter_map(|name| find(name)).collect(),
        external: Vec::new(),
        measurements: MEASUREMENTS.to_vec(),
        objects: objects.to_vec(),
        localisation: Vec::new(),
        left_out: false,
        training: vec![TrainingSource::Published],
        sensing: vec![Sensing::Random],
        times: false,
        seed,
    };
    let board = settings.learn(source)?.score(&|| ())?;
    let of_row = |row: &ObjectRow| {
        let value = |&(score, get): &ScoreOf| {
            let key = ObjectScore { decoder: row.key.decoder.clone(), m: row.key.m, score, object: row.object.clone() };
            Some((key, get(&row.scores)?))
        };
        SCORES.iter().filter_map(value).collect::<Vec<_>>()
    };
    Ok(board.objects.iter().flat_map(of_row).collect())
}

/// Mean raster images of `objects`, V, from presses that are not scored.
fn raster_images(real: &Source, objects: &[String]) -> Result<Vec<(String, Vec<f64>)>, Refusal> {
    let sessions = real.sessions.iter().filter(|s| objects.contains(&s.object));
    let trained = sessions.filter_map(|session| Some((session, TrainingPresses::unscored(session)?)));
    let images = trained.filter(|(_, training)| !training.is_empty()).map(|(session, training)| {
        let library = templates(&[training]).map_err(|e| e.at("raster images"))?;
        Ok((session.object.clone(), library.images().column(0)))
    });
    images.collect()
}

/// Images of `objects` in their compressive sessions, V: by least squares, median over the presses.
fn compressive_images(recordings: &Path, objects: &[String]) -> Result<Vec<(String, Vec<f64>)>, Refusal> {
    let pairs = read(recordings)?;
    let pairs = pairs.iter().filter(|pair| objects.contains(&pair.session));
    let image = |pair: &SessionPair| {
        let blocks: Vec<usize> = (0..pair.compressive.blocks().len()).collect();
        let found = SessionEstimates::of(pair, &pair.compressive, &blocks)?;
        let mut image = found.image_v;
        for cell in &found.overdriven {
            image[cell.taxel as usize] *= cell.over_binary;
        }
        Some((pair.session.clone(), image))
    };
    Ok(pairs.filter_map(image).collect())
}

/// Name of a score and its value; `None` for a decoder without it.
pub(crate) type ScoreOf = (&'static str, fn(&Scores) -> Option<f64>);

/// The scores that are compared: intersection over union of the supports, and the share of single windows classified.
pub const SCORES: [ScoreOf; 2] = [("iou", |s| s.iou), ("class_single", |s| s.class_single)];

/// Which score of which object, such as its IoU.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ObjectScore {
    /// Decoder.
    pub decoder: String,
    /// Number of measurements, M.
    pub m: usize,
    /// One of [`SCORES`].
    pub score: &'static str,
    /// Object.
    pub object: String,
}

/// One score of one object: simulated skins and real skin.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectBand {
    /// The images of the twin's recordings.
    pub images: ReadoutImages,
    /// The score.
    pub score: ObjectScore,
    /// Its value on the real skin, and the band of the simulated ones within [0, 1].
    pub of: Banded,
    /// Its values on the simulated skins.
    skins: Vec<f64>,
}

/// How far the twin is from the real skin in one score, over all objects.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoreDistance {
    /// The images of the twin's recordings.
    pub images: ReadoutImages,
    /// Decoder.
    pub decoder: String,
    /// Number of measurements, M.
    pub m: usize,
    /// One of [`SCORES`].
    pub score: &'static str,
    /// Mean over the objects of |twin − real|, where "twin" is the mean over the simulated skins. Errors of opposite
    /// sign do not cancel.
    pub mean_abs_difference: f64,
    /// The same distance for a simulated skin in place of the real one, from the mean of the others: the expected
    /// distance if the real skin were one of the twin's.
    pub between_skins: f64,
    /// Mean over the objects of twin − real, in which errors cancel.
    pub difference_of_means: f64,
    /// Number of objects.
    pub objects: usize,
    /// Objects whose real score lies outside the band, separated by spaces.
    pub outside: String,
}

/// The band of every score of the real skin that all `skins` also have, in the order of `real`.
fn bands(images: ReadoutImages, real: &[(ObjectScore, f64)], skins: &[Vec<(ObjectScore, f64)>]) -> Vec<ObjectBand> {
    let band = |(score, real): &(ObjectScore, f64)| {
        let same = |skin: &Vec<(ObjectScore, f64)>| skin.iter().find(|(of, _)| of == score).map(|(_, value)| *value);
        let skins: Vec<f64> = skins.iter().map(same).collect::<Option<_>>()?;
        Some(ObjectBand { images, score: score.clone(), of: Banded::of(*real, &skins, SHARE)?, skins })
    };
    real.iter().filter_map(band).collect()
}

/// The distance in every score of `bands`, in order.
fn distances(bands: &[ObjectBand]) -> Vec<ScoreDistance> {
    fn key(band: &ObjectBand) -> (ReadoutImages, &str, usize, &'static str) {
        (band.images, &band.score.decoder, band.score.m, band.score.score)
    }
    let distance = |(images, decoder, m, score)| {
        let of: Vec<&ObjectBand> = bands.iter().filter(|b| key(b) == (images, decoder, m, score)).collect();
        let mean = |get: &dyn Fn(&ObjectBand) -> f64| of.iter().map(|b| get(b)).sum::<f64>() / of.len() as f64;
        let outside: Vec<&str> =
            of.iter().filter(|b| b.of.inside() == Some(false)).map(|b| b.score.object.as_str()).collect();
        ScoreDistance {
            images,
            decoder: decoder.to_owned(),
            m,
            score,
            mean_abs_difference: mean(&|b| b.of.difference().abs()),
            between_skins: mean(&|b| one_to_others(&b.skins)),
            difference_of_means: mean(&|b| b.of.difference()),
            objects: of.len(),
            outside: outside.join(" "),
        }
    };
    unique(bands.iter().map(key)).into_iter().map(distance).collect()
}

/// Mean distance of a value to the mean of the others; 0 of one value.
fn one_to_others(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let sum: f64 = values.iter().sum();
    if values.len() < 2 {
        return 0.0;
    }
    let off = |v: &f64| (v - (sum - v) / (n - 1.0)).abs();
    values.iter().map(off).sum::<f64>() / n
}

/// Images that the twin's readout records, to see where a difference between twin and skin comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ReadoutImages {
    /// The twin's own: simulated contact, with gains drawn for every skin.
    Twin,
    /// Simulated contact, with the gains of the real skin as estimated from raster presses of the OTHER objects.
    TwinWithSkinGains,
    /// The real skin's raster image of the object, in both modes: shape and gains are real, and do not change between
    /// the raster and the compressive session.
    SkinRaster,
    /// The real skin's image in its compressive session, by least squares: shape, gains and mounting are real.
    SkinCompressive,
}

impl ReadoutImages {
    /// The kind of images in words.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Twin => "twin",
            Self::TwinWithSkinGains => "twin, gains of the skin",
            Self::SkinRaster => "raster image of the skin",
            Self::SkinCompressive => "compressive image of the skin",
        }
    }
}

/// Raster presses of every object: those that are learned from, and the last, which is the truth.
const SCANNED: usize = 6;
/// Compressive presses of every scored object. Presses of one session differ by 2 %: more of them say little.
const SCORED: usize = 4;
/// Presses before the compressive session, as in the published evaluation.
const CONDITIONING: usize = 5;

/// Presses all objects on the skin that follows from `seed`, and those named in `scored` in both modes. Nothing is
/// stepped (contact field `footprint`), so that a press takes milliseconds; `done` is called after each. `gains` says
/// whether the taxels have gains of their own.
fn twin(seed: u64, scored: &[String], gains: bool, done: &(dyn Fn() + Sync)) -> Result<SessionSet, Refusal> {
    let sessions = OBJECTS.par_iter().map(|object| {
        let spread = (!gains).then(|| ("spread_log_sd".to_owned(), 0.0.into()));
        let config = SceneConfig {
            transducer_parameters: spread.into_iter().collect(),
            ..footprint_scene(object.name, SCANNED + SCORED, seed)
        };
        let is_scored = scored.iter().any(|name| name == object.name);
        let run = SkinRun {
            scene: &Scene::new(config, Path::new(""))?,
            number: u64::from(object.label),
            scanned: SCANNED,
            summed: if is_scored { SCORED } else { 0 },
            conditioning: CONDITIONING,
        };
        Ok(run.record(done)?.session)
    });
    Ok(twin_set(sessions.collect::<Result<_, Refusal>>()?))
}

/// The sessions of `set`, simulated at gain 1, as the skin of `real` would have shown them. The gains that apply to an
/// object are those that unscored raster presses of the other objects tell.
fn with_skin_gains(set: &SessionSet, real: &Source, seed: u64) -> Result<Source, Refusal> {
    let simulated = Source::new(set.clone())?;
    let mut source = simulated.clone();
    for (scored, session) in source.sessions.iter_mut().zip(&set.sessions) {
        let [skin, median] = [real, &simulated].map(|source| others(&source.sessions, &scored.object));
        let mounting = VelostatConfig::default().mounting();
        let known = SkinGains::estimate(&skin?, &median?, &real.layout, mounting);
        let known = known.map_err(|e| e.at("gains of the skin"))?;
        let gains: Vec<f64> = known.gains.log_mean.iter().map(|log| log.exp()).collect();
        let readout = ReadoutOfImages::new(seed, scored)?;
        let again = |recorded: Option<&Recorded>, mode: Mode| -> Result<Option<Recording>, Refusal> {
            let Some(recorded) = recorded else { return Ok(None) };
            let images = recorded.presses.iter().filter_map(|press| press.conductance.as_ref());
            let with_gains = |image: &ConductanceMap| image.values().iter().zip(&gains).map(|(c, g)| c * g).collect();
            Ok(Some(readout.record(mode, &images.map(with_gains).collect::<Vec<Vec<f64>>>())?))
        };
        scored.raster = again(session.raster.as_ref(), Mode::Raster)?;
        scored.compressive = again(session.compressive.as_ref(), Mode::Compressive)?;
        scored.simulated = Vec::new();
    }
    Ok(source)
}

/// Mean raster images of all objects but `object`, from presses that are not scored.
fn others(sessions: &[ScoredSession], object: &str) -> Result<Library, Refusal> {
    let others = sessions.iter().filter(|s| s.object != object);
    let training: Vec<TrainingPresses<'_>> = others.filter_map(TrainingPresses::unscored).collect();
    templates(&training).map_err(|e| e.at("raster images"))
}

/// The sessions of `real`, each with a compressive recording of its image in `images` (object, V a taxel)
/// through the twin's readout in place of its own, or with none.
fn with_images(
    real: &Source,
    images: &[(String, Vec<f64>)],
    seed: u64,
    done: &(dyn Fn() + Sync),
) -> Result<Source, Refusal> {
    let mut source = real.clone();
    for session in &mut source.sessions {
        let image = images.iter().find(|(object, _)| *object == session.object);
        session.compressive = match image {
            Some((_, volts)) => {
                let readout = ReadoutOfImages::new(seed, session)?;
                let siemens: Vec<f64> = volts.iter().map(|v| v.max(0.0) / readout.volts_per_siemens()).collect();
                Some(readout.record(Mode::Compressive, &vec![siemens; SCORED])?)
            }
            None => None,
        };
        session.protocol = Protocol { first_press: 0, presses: SCORED, ..session.protocol };
        done();
    }
    Ok(source)
}

/// The twin's readout of one object's session.
struct ReadoutOfImages {
    profile: Profile,
    layout: SkinLayout,
    streams: Streams,
    session: u64,
}

/// Frames of a block of the published recordings, without load at its beginning, and those in which the load rises and
/// is full: as the published presses, full in the frames that are scored.
const FRAMES: usize = 1000;
const IDLE: usize = 250;
const FULL: usize = 450;
/// Unrecorded frames between two presses.
const GAP: u64 = 57;

impl ReadoutOfImages {
    fn new(seed: u64, session: &ScoredSession) -> Result<Self, Refusal> {
        let layout = session.raster.as_ref().map(|r| *r.layout()).unwrap_or_default();
        Ok(Self {
            profile: Profile::named(DEFAULT_READOUT)
                .and_then(|profile| profile.on(&layout))
                .map_err(readout_refused)?,
            layout,
            streams: Streams::new(seed).child("per_object/readout", 0),
            session: 2 * session.label as u64,
        })
    }

    fn volts_per_siemens(&self) -> f64 {
        self.profile.volts_per_siemens()
    }

    /// One press an image (S a taxel): idle, rising, held to the end.
    fn record(&self, mode: Mode, images: &[Vec<f64>]) -> Result<Recording, Refusal> {
        let frame_s = self.layout.taxels() as f64 / self.profile.sample_rate_hz;
        let times_s = [0, IDLE, FULL].map(|frame| frame as f64 * frame_s).to_vec();
        let map = |values| ConductanceMap::from_values(self.layout.rows(), self.layout.cols(), values);
        let press = |image: &Vec<f64>| {
            let idle = map(vec![0.0; image.len()]);
            Interpolated::new(times_s.clone(), vec![idle.clone(), idle, map(image.clone())])
        };
        let presses = images.iter().map(press).collect::<Result<Vec<_>, _>>();
        let mut presses = presses.map_err(|e| e.at("conductance"))?;
        let session = self.session + u64::from(mode == Mode::Compressive);
        let mut readout =
            Readout::new(&self.profile, mode, &self.layout, self.streams, session).map_err(readout_refused)?;
        let recording = readout.record(&mut presses, FRAMES * self.layout.taxels(), GAP).map_err(readout_refused)?;
        Ok(recording.with_idle_frames(Some(IDLE - 1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    /// The number of threads does not show, and neighbouring seeds are other skins.
    #[test]
    fn a_simulated_skin_is_a_function_of_its_seed() {
        let objects = vec!["rec".to_owned()];
        let of = |seed: u64, threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let run = || {
                let source = Source::new(twin(seed, &objects, true, &|| ()).unwrap()).unwrap();
                scores(&source, &objects, seed).unwrap()
            };
            pool.install(run)
        };
        let (one, two, other) = (of(1, 1), of(1, 2), of(2, 2));
        assert_eq!(one, two);
        assert_ne!(one, other);
        // every decoder, M and score of the one object; `nn_lmmse` says no classes
        let with_classes = DECODERS.len() - 1;
        assert!(one.len() >= (DECODERS.len() + with_classes) * MEASUREMENTS.len(), "{}", one.len());
    }

    fn score(object: &str, value: f64) -> (ObjectScore, f64) {
        let score = ObjectScore { decoder: "matched".to_owned(), m: 20, score: "iou", object: object.to_owned() };
        (score, value)
    }

    /// The twin is .4 low on one object and .4 high on another: the means agree, the distance is .4.
    #[test]
    fn opposite_errors_do_not_cancel() {
        let real = [score("brain", 0.7), score("trig", 0.3)];
        let skins = [[0.31, 0.69], [0.29, 0.71]].map(|[a, b]| vec![score("brain", a), score("trig", b)]);
        let bands = bands(ReadoutImages::Twin, &real, &skins);
        let distances = distances(&bands);
        assert_eq!(distances.len(), 1);
        assert_abs_diff_eq!(distances[0].difference_of_means, 0.0, epsilon = 1e-12);
        assert_abs_diff_eq!(distances[0].mean_abs_difference, 0.4, epsilon = 1e-12);
        assert_abs_diff_eq!(distances[0].between_skins, 0.02, epsilon = 1e-12);
        assert_eq!(distances[0].outside, "brain trig");
    }

    /// Four skins score .5 ± .1 on average: s = .1155, t = 2.353, √(5/4): the band reaches .304 to either side.
    #[test]
    fn a_real_skin_like_the_twin_s_lies_within_the_band() {
        let skins = [0.4, 0.6, 0.4, 0.6].map(|v| vec![score("brain", v)]);
        let within =
            |real: f64| bands(ReadoutImages::Twin, &[score("brain", real)], &skins)[0].of.inside() == Some(true);
        assert!(within(0.5) && within(0.79) && !within(0.81) && !within(0.19));
    }

    #[test]
    fn a_score_that_a_skin_lacks_has_no_band() {
        let skins = [vec![score("brain", 0.5)], vec![]];
        assert!(bands(ReadoutImages::Twin, &[score("brain", 0.5)], &skins).is_empty());
    }
}
