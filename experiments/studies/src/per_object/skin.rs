//! Simulated skins for scoring: the twin's presses, and given images through the twin's readout.

use super::study::PerObjectError;
use crate::pressed::footprint_scene;
use rayon::prelude::*;
use spts::Session;
use spts::chain::{Acquisition, DEFAULT_READOUT};
use spts::data::SessionSet;
use spts::record::{Twin, TwinError};
use spts::scene::{Scene, SceneConfig};
use spts::session::Recorded;
use spts_circuit::{Interpolated, Mode, Profile, Readout, Recording};
use spts_contact::objects::{OBJECTS, ObjectSpec};
use spts_eval::protocol::Protocol;
use spts_eval::training::{SkinGains, TrainingPresses, templates};
use spts_eval::{ScoredSession, Source};
use spts_models::{ConductanceMap, SkinLayout, Streams, VelostatConfig};
use spts_recon::classify::Library;
use std::path::{Path, PathBuf};

/// Raster presses of every object: those that are learned from, and the last, which is the truth.
const SCANNED: usize = 6;
/// Compressive presses of every scored object. Presses of one session differ by 2 %: more of them say little.
pub(super) const SCORED: usize = 4;
/// Presses before the compressive session, as in the published evaluation.
const CONDITIONING: usize = 5;

/// Number of presses of a simulated skin on which `scored` objects are scored.
pub(super) fn presses(scored: usize) -> usize {
    OBJECTS.len() * SCANNED + scored * SCORED
}

/// Presses all objects on the skin that follows from `seed`, and those named in `scored` in both modes. Nothing is
/// stepped (contact field `footprint`), so that a press takes milliseconds; `done` is called after each. `gains` says
/// whether the taxels have gains of their own.
pub(super) fn twin(
    seed: u64,
    scored: &[String],
    gains: bool,
    done: &(dyn Fn() + Sync),
) -> Result<SessionSet, TwinError> {
    let sessions = OBJECTS.par_iter().map(|object| {
        let is_scored = scored.iter().any(|name| name == object.name);
        session(object, seed, is_scored, gains, done)
    });
    Ok(SessionSet {
        root: PathBuf::from("the twin"),
        sessions: sessions.collect::<Result<_, _>>()?,
        published: None,
        missing: Vec::new(),
    })
}

fn session(
    object: &ObjectSpec,
    seed: u64,
    scored: bool,
    gains: bool,
    done: &(dyn Fn() + Sync),
) -> Result<Session, TwinError> {
    let spread = (!gains).then(|| ("spread_log_sd".to_owned(), 0.0.into()));
    let config = SceneConfig {
        transducer_parameters: spread.into_iter().collect(),
        ..footprint_scene(object.name, SCANNED + SCORED, seed)
    };
    let twin = Twin::new(&Scene::new(config, Path::new(""))?)?;
    // sessions are numbered, so that every one has noise of its own
    let number = 2 * u64::from(object.label);
    let scan = Acquisition::presses(Mode::Raster, number);
    let raster = Recorded {
        conditioning: SCANNED - 1,
        ..twin.recorded(&twin.presses(0..SCANNED, done)?, &scan)?
    };
    let sums = Acquisition {
        conditioning_presses: CONDITIONING,
        ..Acquisition::presses(Mode::Compressive, number + 1)
    };
    let presses = SCANNED..SCANNED + if scored { SCORED } else { 0 };
    let compressive = match presses.is_empty() {
        true => None,
        false => Some(twin.recorded(&twin.presses(presses, done)?, &sums)?),
    };
    Ok(twin.session(Some(raster), compressive))
}

/// The sessions of `set`, simulated at gain 1, as the skin of `real` would have shown them. The gains that apply to an
/// object are those that unscored raster presses of the other objects tell.
pub(super) fn with_skin_gains(set: &SessionSet, real: &Source, seed: u64) -> Result<Source, PerObjectError> {
    let simulated = Source::new(set.clone())?;
    let mut source = simulated.clone();
    for (scored, session) in source.sessions.iter_mut().zip(&set.sessions) {
        let images = [&real.sessions, &simulated.sessions].map(|sessions| others(sessions, &scored.object));
        let [skin, median] = images;
        let mounting = VelostatConfig::default().session_log_sd;
        let known = SkinGains::estimate(&skin?, &median?, mounting)?.gains;
        let gains: Vec<f64> = known.log_mean.iter().map(|log| log.exp()).collect();
        let readout = ReadoutOfImages::new(seed, scored)?;
        let again = |recorded: Option<&Recorded>, mode: Mode| -> Result<Option<Recording>, PerObjectError> {
            let Some(recorded) = recorded else { return Ok(None) };
            let images = recorded.presses.iter().filter_map(|press| press.conductance.as_ref());
            let with_gains = |image: &ConductanceMap| image.values().iter().zip(&gains).map(|(c, g)| c * g).collect();
            readout
                .record(mode, &images.map(with_gains).collect::<Vec<Vec<f64>>>())
                .map(Some)
        };
        scored.raster = again(session.raster.as_ref(), Mode::Raster)?;
        scored.compressive = again(session.compressive.as_ref(), Mode::Compressive)?;
        scored.simulated = Vec::new();
    }
    Ok(source)
}

/// Mean raster images of all objects but `object`, from presses that are not scored.
fn others(sessions: &[ScoredSession], object: &str) -> Result<Library, PerObjectError> {
    let others = sessions.iter().filter(|s| s.object != object);
    let training: Vec<TrainingPresses<'_>> = others.filter_map(TrainingPresses::unscored).collect();
    Ok(templates(&training)?)
}

/// The sessions of `real`, each with a compressive recording of its image in `images` (object, V a taxel)
/// through the twin's readout in place of its own, or with none.
pub(super) fn with_images(
    real: &Source,
    images: &[(String, Vec<f64>)],
    seed: u64,
    done: &(dyn Fn() + Sync),
) -> Result<Source, PerObjectError> {
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
        session.protocol = Protocol {
            first_press: 0,
            presses: SCORED,
            ..session.protocol
        };
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
    fn new(seed: u64, session: &ScoredSession) -> Result<Self, PerObjectError> {
        let layout = session.raster.as_ref().map(|r| *r.layout()).unwrap_or_default();
        Ok(Self {
            profile: Profile::named(DEFAULT_READOUT)?.on(&layout)?,
            layout,
            streams: Streams::new(seed).child("per_object/readout", 0),
            session: 2 * session.label as u64,
        })
    }

    fn volts_per_siemens(&self) -> f64 {
        self.profile.volts_per_siemens()
    }

    /// One press an image (S a taxel): idle, rising, held to the end.
    fn record(&self, mode: Mode, images: &[Vec<f64>]) -> Result<Recording, PerObjectError> {
        let frame_s = self.layout.taxels() as f64 / self.profile.sample_rate_hz;
        let times_s = [0, IDLE, FULL].map(|frame| frame as f64 * frame_s).to_vec();
        let map = |values| ConductanceMap::from_values(self.layout.rows(), self.layout.cols(), values);
        let press = |image: &Vec<f64>| {
            let idle = map(vec![0.0; image.len()]);
            Interpolated::new(times_s.clone(), vec![idle.clone(), idle, map(image.clone())])
        };
        let mut presses = images
            .iter()
            .map(press)
            .collect::<Result<Vec<_>, _>>()
            .map_err(PerObjectError::Source)?;
        let session = self.session + u64::from(mode == Mode::Compressive);
        let mut readout = Readout::new(&self.profile, mode, &self.layout, self.streams, session)?;
        let recording = readout.record(&mut presses, FRAMES * self.layout.taxels(), GAP)?;
        Ok(recording.with_idle_frames(Some(IDLE - 1)))
    }
}
