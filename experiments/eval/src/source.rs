//! Sessions for scoring or training: of the real skin or of the twin.

use crate::alignment::{Alignment, follow_slips};
use crate::labels::Labels;
use crate::protocol::Truth;
use crate::session::ScoredSession;
use crate::training::{Learned, SHIFT_REACH, TrainingData, TrainingPresses};
use spts::Refusal;
use spts::Session;
use spts::data::{Published, SessionSet, missing_file, nothing_found};
use spts::session::Event;
use spts_circuit::{Mode, Recording};
use spts_models::{SkinLayout, Streams};
use spts_recon::Matrix;
use spts_recon::dictionary::shifted;
use std::path::{Path, PathBuf};

/// All sessions of one folder, real or simulated, prepared for scoring.
#[derive(Debug, Clone)]
pub struct Source {
    /// The folder that was opened.
    pub root: PathBuf,
    /// Sessions of presses, all of one skin.
    pub sessions: Vec<ScoredSession>,
    /// Recordings of a bouncing ball, with the names of their sessions.
    pub drops: Vec<(String, Recording)>,
    /// Recordings of touches at unknown times, with the names of their sessions.
    pub touches: Vec<(String, Recording)>,
    /// Dictionary and library published with them.
    pub published: Option<Published>,
    /// Parts of the published layout that this folder lacks.
    pub missing: Vec<String>,
    /// Whether all sessions are simulated.
    pub simulated: bool,
    /// Layout of the skin.
    pub layout: SkinLayout,
    /// Numbers of the classes.
    pub labels: Labels,
    /// Slips of the recordings, which have been realigned, and contacts that fit no rows.
    pub alignment: Alignment,
    /// As [`SessionSet::note`].
    pub note: Option<String>,
}

/// Everything on which a skin, real or simulated, is scored.
#[derive(Debug, Clone)]
pub struct ScoredSkin {
    /// Sessions of the objects.
    pub sessions: Vec<ScoredSession>,
    /// Recording of the bouncing ball.
    pub bounces: Option<Recording>,
    /// Training results of the published decoder.
    pub learned: Learned,
}

/// Recordings of a real skin, with the published dictionary and library.
#[derive(Debug, Clone)]
pub struct PublishedSkin {
    /// Sessions of the available objects in order of label, and the training results of the published decoder.
    pub skin: ScoredSkin,
    /// Parts that were not found.
    pub missing: Vec<String>,
}

impl PublishedSkin {
    /// Reads the recordings in `root` with the published dictionary and library.
    ///
    /// # Errors
    /// As [`Source::open`] and [`Source::published_skin`].
    pub fn open(root: &Path) -> Result<Self, Refusal> {
        Source::open(root)?.published_skin()
    }
}

impl Source {
    /// Reads the sessions in `root`, like [`SessionSet::open`].
    ///
    /// # Errors
    /// [`Refusal`] if there is no session, or one of them cannot be scored.
    pub fn open(root: &Path) -> Result<Self, Refusal> {
        Self::new(SessionSet::open(root)?)
    }

    /// Prepares the sessions of `set`. Samples that slipped are realigned ([`follow_slips`]).
    ///
    /// # Errors
    /// [`Refusal`] for a session with nothing to score, or of another skin than the first.
    pub fn new(mut set: SessionSet) -> Result<Self, Refusal> {
        let alignment = follow_slips(&mut set);
        Self::aligned(set, alignment)
    }

    /// The same of a set that [`follow_slips`] has realigned, with what it returned.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn aligned(set: SessionSet, alignment: Alignment) -> Result<Self, Refusal> {
        let SessionSet { root, sessions, published, mut missing, note } = set;
        let simulated = sessions.iter().all(|s| s.provenance.is_some());
        let (presses, others): (Vec<Session>, Vec<Session>) =
            sessions.into_iter().partition(|s| s.event == Event::Press);
        let layout = presses.iter().find_map(|s| s.layout().copied());
        let of = |event: Event| others.iter().filter(move |s| s.event == event);
        let recordings = |event: Event| of(event).filter_map(|s| Some((s.name.clone(), s.compressive()?.clone())));
        let layout = layout.or_else(|| recordings(Event::Drop).next().map(|(_, drops)| *drops.layout()));
        let layout = layout.unwrap_or_default();
        let labels = Labels::of(presses.iter().map(|s| s.object.as_str()));
        for session in &presses {
            check_session(&root, session, &layout)?;
        }
        let shape = |layout: &SkinLayout| (layout.rows(), layout.cols());
        let fits = |(_, recording): &(String, Recording)| shape(recording.layout()) == shape(&layout);
        let (drops, elsewhere): (Vec<_>, Vec<_>) = recordings(Event::Drop).partition(fits);
        let names = elsewhere.iter().map(|(name, _)| format!("{name}: drops on the skin of the presses"));
        missing.extend(names);
        let touches = recordings(Event::Touch).filter(fits).collect();
        let mut scored: Vec<ScoredSession> = Vec::with_capacity(presses.len());
        for session in presses {
            let label = labels.number(&session.object).unwrap_or_default();
            let session = ScoredSession::new(session, label);
            let same = || scored.iter().filter(|s| s.object == session.object);
            let (again, shared_raster) = (same().next().is_some(), same().any(|s| s.raster == session.raster));
            scored.push(ScoredSession { again, shared_raster, ..session });
        }
        let sessions = scored;
        let mut note = note;
        if sessions.iter().any(ScoredSession::scorable) {
            let others = sessions.iter().filter(|s| s.without_scan()).map(|s| s.name.as_str());
            let others: Vec<&str> = others.collect();
            if !others.is_empty() {
                let said =
                    format!("sessions without a raster scan are not scored beside others: {}", others.join(", "));
                note = Some(note.map_or_else(|| said.clone(), |note| format!("{note}\n{said}")));
            }
        }
        Ok(Self { sessions, root, drops, touches, published, missing, simulated, layout, labels, alignment, note })
    }

    /// The same, scored against raster scans as recordings of the real skin are, and not against what a simulation
    /// knows.
    pub fn against_scans(mut self) -> Self {
        self.sessions.iter_mut().for_each(|session| session.simulated.clear());
        self
    }

    /// The sessions that can be scored. Sessions of compressive recordings alone are among them where no session has a
    /// scan: beside others they would be scored by decoders that know nothing of their objects.
    pub fn scorable(&self) -> impl Iterator<Item = &ScoredSession> {
        let scans = self.sessions.iter().any(ScoredSession::scorable);
        self.sessions.iter().filter(move |s| s.scorable() || !scans && s.without_scan())
    }

    /// Whether there are raster presses that are not scored, to learn from.
    pub fn learns(&self) -> bool {
        self.sessions.iter().filter_map(TrainingPresses::unscored).any(|presses| !presses.is_empty())
    }

    /// Training data for this skin: raster presses that are not scored, with the published dictionary and library if
    /// they exist, and the names of the classes. Without such presses, it is a prior made for the layout, without
    /// classes.
    ///
    /// # Errors
    /// [`Refusal`] if the images are not usable.
    pub fn training(&self, streams: Streams) -> Result<(TrainingData, Option<&Labels>), Refusal> {
        let presses = self.sessions.iter().filter_map(TrainingPresses::unscored);
        let presses: Vec<TrainingPresses<'_>> = presses.filter(|t| !t.is_empty()).collect();
        if presses.is_empty() {
            return Ok((TrainingData::for_layout(&self.layout, streams)?, None));
        }
        let data = TrainingData::new(&presses, self.layout.cols(), Vec::new(), streams)?;
        let data = match &self.published {
            Some(published) => data.with_published(&published.dictionary, &published.library),
            None => data,
        };
        Ok((data, Some(&self.labels)))
    }

    /// Whether one of the raster recordings is also in `other`.
    pub fn shares_raster(&self, other: &Self) -> bool {
        let same = |a: &ScoredSession| a.raster.is_some() && other.sessions.iter().any(|b| a.raster == b.raster);
        self.sessions.iter().any(same)
    }

    /// The dictionary at all places: the published one, or shifted copies of `dictionary`.
    pub fn shifted(&self, dictionary: &Matrix) -> Matrix {
        let published = self.published.as_ref().and_then(|p| p.shifted.clone());
        published.unwrap_or_else(|| shifted(dictionary, self.layout.cols(), SHIFT_REACH))
    }

    /// The skin with the published dictionary and library, as the published evaluation scores it. Missing parts are
    /// added to [`Source::missing`].
    ///
    /// # Errors
    /// [`Refusal`] without a published dictionary or library, or a session of presses.
    pub fn published_skin(mut self) -> Result<PublishedSkin, Refusal> {
        if self.sessions.is_empty() {
            return Err(nothing_found(&self.root));
        }
        let published = self.published.take().ok_or_else(|| {
            let needed_by =
                "scoring a skin of 10 × 10 taxels with the published decoder (both files, in the folder itself)";
            missing_file(&self.root.join("{dictionary,SRC_lib}.mat"), needed_by)
        })?;
        if published.shifted.is_none() {
            self.missing.push("permuted_dictionary.mat: shifted dictionary".to_owned());
        }
        let cols = self.layout.cols();
        let learned = Learned::new(published.dictionary, published.shifted, published.library, cols);
        let bounces = self.drops.into_iter().next().map(|(_, recording)| recording);
        let skin = ScoredSkin { sessions: self.sessions, bounces, learned };
        Ok(PublishedSkin { skin, missing: self.missing })
    }
}

/// Checks that a session can be scored: it must be of the skin `layout`, and have enough content that a score means
/// something. `root` is the folder named in errors.
///
/// # Errors
/// [`Refusal`], with the session and what it lacks.
pub fn check_session(root: &Path, session: &Session, layout: &SkinLayout) -> Result<(), Refusal> {
    let refuse = |mode: &str, field: &str, value: String, needed: String| {
        let (path, name) = (root.display(), &session.name);
        let problem = format!("session {name:?}, {mode} recording: `{field}` = {value}; scoring needs {needed}");
        Err(Refusal::new(problem).at(path))
    };
    let scored = ScoredSession::new(session.clone(), 0);
    let recordings = [
        ("raster", scored.raster.as_ref(), &scored.raster_protocol),
        ("compressive", scored.compressive.as_ref(), &scored.protocol),
    ];
    for (mode, recording, protocol) in recordings {
        let Some(recording) = recording else { continue };
        let found = recording.layout();
        if (found.rows(), found.cols()) != (layout.rows(), layout.cols()) {
            let value = format!("{} × {}", found.rows(), found.cols());
            let needed = format!("{} × {}, as the first session", layout.rows(), layout.cols());
            return refuse(mode, "taxels", value, needed);
        }
        if let Some([_, end_s]) = session.hold_s {
            // half a frame is rounded away
            let end = recording.time_s(recording.frames()) + 0.5 * recording.time_s(1);
            if end_s > end {
                let frames = recording.frames().to_string();
                let needed = format!("at least {}", protocol_frames(recording, end_s));
                return refuse(mode, "frames", frames, needed);
            }
        }
        // windows with lost samples are left out, so that one frame without a loss will do
        let frames = || protocol.first_frame..protocol.first_frame + protocol.frames;
        let whole = |press: usize| frames().any(|frame| recording.volts(press, frame).iter().all(|v| v.is_finite()));
        if let Some(press) = protocol.presses_of(recording).find(|&press| !whole(press)) {
            let value = format!("lost in every scored frame of press {press}");
            let needed = "finite samples in one of them".to_owned();
            return refuse(mode, "samples", value, needed);
        }
        if recording.mode() == Mode::Raster {
            let (press, frame) = protocol.truth;
            if recording.volts(press, frame).iter().any(|v| !v.is_finite()) {
                let value = format!("lost in frame {frame} of press {press}");
                let needed = "finite samples in the frame that is the truth".to_owned();
                return refuse(mode, "samples", value, needed);
            }
            let truth = Truth::new(recording, protocol).image;
            let peak = truth.iter().copied().fold(0.0, f64::max);
            let is_truth = scored.simulated.iter().all(Option::is_none);
            if is_truth && !(peak > 0.0 && peak.is_finite()) {
                let needed = "a contact above 0 V".to_owned();
                return refuse(mode, "peak of the true image, V", peak.to_string(), needed);
            }
        }
    }
    Ok(())
}

/// Frames of `recording` up to `time_s`.
#[expect(clippy::cast_possible_truncation, reason = "only shown in an error")]
fn protocol_frames(recording: &Recording, time_s: f64) -> usize {
    (time_s / recording.time_s(1)).round() as usize
}
