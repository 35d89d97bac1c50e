//! The twin as a recording device: scenes in, recordings of the same type as those of a real skin out.

use crate::chain::{Acquisition, ReadoutSession, SkinSession, press_facts};
use crate::provenance::Provenance;
use crate::scene::{PressConfig, Scene, Task};
use crate::session::{Event, PressFacts, Recorded, Session};
use rayon::prelude::*;
use spts_circuit::{Interpolated, Mode};
use spts_contact::Frame;
use spts_contact::objects::FINGER;
use spts_input::Refusal;
use spts_models::fits_memory;
use spts_sim::World;
use spts_sim::world::{Bounce, PressCourse};
use std::ops::Range;

/// The twin of a scene: the skin, what presses on it, and its readout.
///
/// Presses run in parallel. No result depends on the number of threads.
///
/// ```
/// use spts::{Mode, Scene, Twin};
///
/// let scene = "contact.model = \"footprint\"\n[press]\nobject = \"T\"\npresses = 2";
/// let session = Twin::new(&Scene::from_toml(scene, ".".as_ref())?)?.record(Mode::Raster)?;
/// let force_n = session.raster.as_ref().and_then(|raster| raster.facts(1)?.force_n);
/// assert!((force_n.unwrap_or_default() - 20.0).abs() < 0.1);
/// # Ok::<(), spts::Refusal>(())
/// ```
#[derive(Debug, Clone)]
pub struct Twin {
    scene: Scene,
    scene_hash: String,
}

/// Number of the raster session of [`Twin::record`]. The skin has noise of its own in every session.
const RASTER_SESSION: u64 = 0;
/// Number of the compressive session of [`Twin::record`].
const COMPRESSIVE_SESSION: u64 = 1;
/// Most values of one kind that are kept at once: 1 GiB.
const MOST_VALUES: usize = 1 << 27;
/// Values of a taxel in a frame that are kept at once: two pressures and the conductances of two sessions.
const MAPS: f64 = 4.0;
/// Values of one kind that are simulated together at most: 256 MiB.
const MOST_TOGETHER: f64 = (1_u64 << 25) as f64;

impl Twin {
    /// The twin of `scene`.
    ///
    /// # Errors
    /// [`Refusal`], as [`Scene::hash`].
    pub fn new(scene: &Scene) -> Result<Self, Refusal> {
        Ok(Self { scene_hash: scene.hash()?, scene: scene.clone() })
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Runs all presses or drops of the scene, and records them in `mode` one after the other, as the real skin is
    /// recorded.
    ///
    /// # Errors
    /// [`Refusal`], as [`Twin::check`], [`Twin::presses`] and [`Twin::recorded`].
    pub fn record(&self, mode: Mode) -> Result<Session, Refusal> {
        self.check(mode)?;
        let presses = self.presses(0..self.scene.repeats(), &|| ())?;
        let recorded = self.recorded(&presses, &self.acquisition(mode))?;
        Ok(match mode {
            Mode::Raster => self.session(Some(recorded), None),
            Mode::Compressive => self.session(None, Some(recorded)),
        })
    }

    /// Checks whether the scene can be recorded in `mode`, before the first press is simulated.
    ///
    /// # Errors
    /// [`Refusal`] if the source of the weights cannot provide them in this mode, and for more frames or measurements
    /// than are kept in memory.
    pub fn check(&self, mode: Mode) -> Result<(), Refusal> {
        self.check_presses(self.scene.repeats(), mode)
    }

    /// [`Twin::check`] for a run that keeps only one press at a time.
    ///
    /// # Errors
    /// As [`Twin::check`].
    pub(crate) fn check_press(&self, mode: Mode) -> Result<(), Refusal> {
        self.check_presses(1, mode)
    }

    fn check_presses(&self, presses: usize, mode: Mode) -> Result<(), Refusal> {
        let chain = self.scene.chain();
        self.check_frames(presses)?;
        self.check_size(presses, chain.sample_rate_hz(), 1, "presses × measurements")?;
        chain.check(mode)
    }

    /// Number of presses to simulate together: two a thread, as long as their frames and samples fit easily into
    /// memory. No result depends on it.
    pub(crate) fn presses_at_once(&self) -> usize {
        let taxels = self.scene.skin().taxels() as f64;
        let rate_hz = taxels / self.scene.mechanics().frame_interval_s() + self.scene.chain().sample_rate_hz();
        #[expect(clippy::cast_possible_truncation, reason = "casts saturate")]
        let fit = (MOST_TOGETHER / (rate_hz * self.scene.duration_s())) as usize;
        fit.min(2 * rayon::current_num_threads()).max(1)
    }

    /// Runs the presses or drops with numbers `indices`, in parallel, and calls `done` after each. Every press has its
    /// own place and timing.
    ///
    /// # Errors
    /// [`Refusal`] for more frames than are kept in memory, if the mechanics fail, or a number is out of range.
    pub fn presses(&self, indices: Range<usize>, done: &(dyn Fn() + Sync)) -> Result<Vec<PressFrames>, Refusal> {
        self.check_frames(indices.len())?;
        let presses = indices.into_par_iter().map(|index| {
            let frames = press_frames(&self.scene, index);
            done();
            frames
        });
        presses.collect()
    }

    /// The acquisition that [`Twin::record`] uses in `mode`.
    pub fn acquisition(&self, mode: Mode) -> Acquisition {
        let session = match mode {
            Mode::Raster => RASTER_SESSION,
            Mode::Compressive => COMPRESSIVE_SESSION,
        };
        match event(&self.scene) {
            Event::Press => Acquisition::presses(mode, session),
            Event::Touch => Acquisition::touches(mode, session),
            Event::Drop => Acquisition::drops(mode, session),
        }
    }

    /// Conductance of each of `presses` as a function of time, in the session of `acquisition`.
    ///
    /// # Errors
    /// [`Refusal`] if the frames are not in order of time.
    pub fn conductance(
        &self,
        presses: &[PressFrames],
        acquisition: &Acquisition,
    ) -> Result<Vec<Interpolated>, Refusal> {
        let frames: Vec<&[Frame]> = presses.iter().map(|press| press.frames.as_slice()).collect();
        self.scene.chain().conductance(&frames, acquisition)
    }

    /// Records `presses` in order, together with the facts that the simulation knows about each.
    ///
    /// # Errors
    /// [`Refusal`] if the readout refuses the conductance, or a press is too long to record.
    pub fn recorded(&self, presses: &[PressFrames], acquisition: &Acquisition) -> Result<Recorded, Refusal> {
        let mut conductance = self.conductance(presses, acquisition)?;
        self.read_out(presses, &mut conductance, acquisition)
    }

    /// [`Twin::recorded`] for presses whose conductances are known from [`Twin::conductance`].
    ///
    /// # Errors
    /// As [`Twin::recorded`].
    pub fn read_out(
        &self,
        presses: &[PressFrames],
        conductance: &mut [Interpolated],
        acquisition: &Acquisition,
    ) -> Result<Recorded, Refusal> {
        let chain = self.scene.chain();
        Ok(Recorded {
            presses: self.facts(presses, conductance),
            ..Recorded::new(chain.record_sources(conductance, self.scene.duration_s(), acquisition)?)
        })
    }

    /// The session of these recordings, with the scene's name, object, event, hold and provenance.
    pub fn session(&self, raster: Option<Recorded>, compressive: Option<Recorded>) -> Session {
        Session { raster, compressive, ..header(&self.scene, &self.scene_hash) }
    }

    /// Checks that the frames of `presses` presses can be kept.
    fn check_frames(&self, presses: usize) -> Result<(), Refusal> {
        let rate_hz = 1.0 / self.scene.mechanics().frame_interval_s();
        let values = self.check_size(presses, rate_hz, self.scene.skin().taxels(), "presses × frames × taxels")?;
        fits_memory(&format!("presses × frames × taxels = {values}"), MAPS * 8.0 * values as f64)
    }

    /// The number of values of `presses` presses with `values` values at `rate_hz` instants a second, if they can be
    /// kept.
    fn check_size(&self, presses: usize, rate_hz: f64, values: usize, what: &'static str) -> Result<usize, Refusal> {
        #[expect(clippy::cast_possible_truncation, reason = "at most 60 s at 1 GHz")]
        let instants = (self.scene.duration_s() * rate_hz).ceil() as usize;
        let values = instants.saturating_mul(presses).saturating_mul(values);
        if values > MOST_VALUES {
            return Err(Refusal::new(format!("{what} = {values} is outside [1, {MOST_VALUES}]")));
        }
        Ok(values)
    }
}

/// What happens in every block of a recording of `scene`: a finger touches, anything else is pressed or dropped.
fn event(scene: &Scene) -> Event {
    match scene.task() {
        Task::Press(press) if press.object.as_deref() == Some(FINGER.name) => Event::Touch,
        Task::Press(_) => Event::Press,
        Task::Drop(_) => Event::Drop,
    }
}

/// The session of `scene`, with this hash, without its recordings.
pub(crate) fn header(scene: &Scene, scene_hash: &str) -> Session {
    Session {
        object: scene.object().to_owned(),
        hold_s: hold_s(scene),
        provenance: Some(Provenance::new(scene.seed(), scene_hash.to_owned())),
        ..Session::new(scene.name(), event(scene))
    }
}

/// Records presses as they come. Skin and readout remember earlier presses.
pub struct TwinSession<'a> {
    twin: &'a Twin,
    skin: SkinSession,
    readout: Option<ReadoutSession>,
}

impl TwinSession<'_> {
    /// Conductance of the next `presses` and, if they are read out, their blocks.
    ///
    /// # Errors
    /// [`Refusal`] if the frames are not in order of time, or the readout refuses the conductance.
    pub fn record(&mut self, presses: &[PressFrames]) -> Result<(Vec<Interpolated>, Option<Recorded>), Refusal> {
        let sources = presses.iter().map(|press| self.skin.conductance(&press.frames));
        let mut sources = sources.collect::<Result<Vec<_>, _>>()?;
        let recording = self.readout.as_mut().map(|readout| readout.record(&mut sources));
        let recorded = recording
            .transpose()?
            .map(|recording| Recorded { presses: self.twin.facts(presses, &sources), ..Recorded::new(recording) });
        Ok((sources, recorded))
    }
}

impl Twin {
    /// Starts the session of `acquisition`, before its first press, on an unconditioned sheet. If `read_out`, presses
    /// are recorded; otherwise only their conductance is computed.
    ///
    /// # Errors
    /// [`Refusal`] if a press is too long to record, or the source of the weights cannot provide them.
    pub fn start_session(&self, acquisition: &Acquisition, read_out: bool) -> Result<TwinSession<'_>, Refusal> {
        let chain = self.scene().chain();
        let readout = read_out.then(|| chain.readout_session(self.scene().duration_s(), acquisition));
        Ok(TwinSession { twin: self, skin: chain.skin_session(acquisition.session), readout: readout.transpose()? })
    }

    /// What is known of `presses`, whose conductance is `sources`.
    fn facts(&self, presses: &[PressFrames], sources: &[Interpolated]) -> Vec<PressFacts> {
        let hold_s = hold_s(self.scene());
        let pairs = presses.iter().zip(sources);
        let facts = pairs.map(|(press, source)| press_facts(&press.frames, source.maps(), hold_s));
        facts.collect()
    }
}

/// Frames of one press or drop, and what the mechanics did.
#[derive(Debug, Clone)]
pub struct PressFrames {
    /// Frames in time order.
    pub frames: Vec<Frame>,
    /// Time course of the force, for a press that reached its target.
    pub course: Option<PressCourse>,
    /// Bounces, for a drop.
    pub bounces: Vec<Bounce>,
}

impl PressFrames {
    /// Largest relative difference |force − Σ p·A| / force over all frames; see [`Frame::imbalance`].
    pub fn imbalance(&self, cell_area_m2: f64) -> f64 {
        self.frames.iter().map(|f| f.imbalance(cell_area_m2)).fold(0.0, f64::max)
    }
}

/// Runs press or drop number `index` of `scene`.
///
/// # Errors
/// [`Refusal`] if the mechanics fail.
pub fn press_frames(scene: &Scene, index: usize) -> Result<PressFrames, Refusal> {
    let mut world = World::repeat(scene.mechanics(), index)?;
    let frames = world.frames().collect::<Result<Vec<Frame>, _>>()?;
    let course = match scene.task() {
        Task::Press(press) => PressCourse::of(&frames, press.force_n, press.plateau_s(), scene.skin().cell_area_m2()),
        Task::Drop(_) => None,
    };
    Ok(PressFrames { course, bounces: world.bounces().to_vec(), frames })
}

/// Span of a recorded press in which the published evaluation takes the contact as steady, s: frames 500 to 700 of 100
/// measurements at 64.3 kHz.
const PUBLISHED_HOLD_S: [f64; 2] = [50_000.0 / 64_300.0, 70_000.0 / 64_300.0];

/// Span [start, end) of a press of `scene` in which the contact is steady, s; `None` for a drop. A press with the
/// default time course, which is that of the recorded presses, has the published span, so that skin and twin are scored
/// at the same instants.
pub fn hold_s(scene: &Scene) -> Option<[f64; 2]> {
    let Task::Press(press) = scene.task() else {
        return None;
    };
    let course = |p: &PressConfig| [p.duration_s, p.onset_s, p.onset_spread_s, p.rise_s, p.lift_s, p.lift_spread_s];
    let default = course(&PressConfig::default()).map(f64::to_bits);
    if course(press).map(f64::to_bits) == default { Some(PUBLISHED_HOLD_S) } else { Some(press.plateau_s()) }
}
