//! Every stage between the pressure on the skin and the recording, and the presses of one session, recorded a few at a
//! time.

use super::cells::FirmwareCells;
use super::config::{
    ChainConfig, DEFAULT_READOUT, DEFAULT_TRANSDUCER, DEFAULT_WEIGHTS, ProfileFile, RowsFile, WeightSource,
};
use crate::session::{PressFacts, PressPose};
use spts_circuit::{Constant, FaultConfig, Interpolated, Mode, PROFILES, Profile, Readout, Recording, Wires};
use spts_contact::Frame;
use spts_input::Refusal;
use spts_models::{
    ConductanceMap, PressureMap, REFERENCE_PA, SkinLayout, Snapshot, Streams, TRANSDUCERS, Transducer,
    build_transducer, in_section, parsed,
};
use std::fmt;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Transducer, readout and source of weights of a skin. A `Chain` is valid by construction: a recording cannot fail
/// because of its configuration.
///
/// ```
/// use spts::{Chain, ChainConfig, SkinLayout};
///
/// let chain = Chain::new(&ChainConfig::default(), &SkinLayout::default(), 0, ".".as_ref())?;
/// assert!((chain.sample_rate_hz() - 64_300.0).abs() < 1e-9);
/// # Ok::<(), spts::Refusal>(())
/// ```
#[derive(Clone)]
pub struct Chain {
    /// The transducer of a fresh skin. Every session works on a copy.
    transducer: Arc<dyn Transducer>,
    profile: Profile,
    profile_file: Option<ProfileFile>,
    rows_file: Option<RowsFile>,
    weights: WeightSource,
    skin: SkinLayout,
    /// Number of wires.
    wires: usize,
    streams: Streams,
    /// Number of codes of emulated cells that differ from those of fault-free cells.
    unlike_codes: Arc<AtomicU64>,
}

impl fmt::Debug for Chain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut all = f.debug_struct("Chain");
        let all = all.field("profile", &self.profile).field("weights", &self.weights);
        all.field("skin", &self.skin).finish_non_exhaustive()
    }
}

impl Chain {
    /// The chain of the skin `skin` with the stages in `config`. A readout that ends in `.toml` is a file in `folder`.
    /// Chains with the same `seed` have the same specimen of the skin.
    ///
    /// # Errors
    /// [`Refusal`] for an unknown transducer, profile, fault or source of weights, a value outside its range, or a
    /// file that cannot be used.
    pub fn new(config: &ChainConfig, skin: &SkinLayout, seed: u64, folder: &Path) -> Result<Self, Refusal> {
        let streams = Streams::new(seed);
        let transducer = transducer(config, skin, streams)?;
        let readout = config.readout.as_deref().unwrap_or(DEFAULT_READOUT);
        let profile_file = match config.profile {
            Some(_) => None,
            None => ProfileFile::of(readout, folder)?,
        };
        let path = profile_file.as_ref().map(|file| file.path.as_path());
        let in_file = |error: Refusal| refused_profile(path, &error);
        let profile = match (&config.profile, &profile_file) {
            (Some(profile), _) => Ok(profile.clone()),
            (None, Some(file)) => Profile::from_toml(&file.text),
            (None, None) if PROFILES.iter().all(|(known, _)| *known != readout) => {
                let known: Vec<&str> = PROFILES.iter().map(|(known, _)| *known).collect();
                return Err(Refusal::new(format!(
                    "`readout` = \"{readout}\" is not a readout profile; known: {}",
                    known.join(", ")
                )));
            }
            (None, None) => Profile::named(readout),
        };
        let (mut profile, rows_file) = config.rows.applied(profile.map_err(in_file)?, skin, folder)?;
        if !config.wires.is_empty() {
            Wires::new(&config.wires, skin)?;
            profile.wires.clone_from(&config.wires);
        }
        profile.validate(taxels(skin)).map_err(in_file)?;
        profile.on(skin).map_err(in_file)?;
        let chain = Self {
            wires: wires(&profile, skin).map_err(in_file)?,
            transducer: transducer.into(),
            profile: with_faults(profile, &config.faults, taxels(skin))?,
            profile_file,
            rows_file,
            weights: WeightSource::named(config.weights.as_deref().unwrap_or(DEFAULT_WEIGHTS))?,
            skin: *skin,
            streams,
            unlike_codes: Arc::default(),
        };
        chain.check(Mode::Compressive)?;
        Ok(chain)
    }

    /// Number of compressive measurements a second, of all wires together, Hz.
    pub fn sample_rate_hz(&self) -> f64 {
        self.profile.sample_rate_hz * self.wires as f64
    }

    /// Number of wires.
    pub fn wires(&self) -> usize {
        self.wires
    }

    /// The file from which the readout profile was read; `None` for a profile by name.
    pub fn profile_file(&self) -> Option<&ProfileFile> {
        self.profile_file.as_ref()
    }

    /// The file from which seeds or a pattern were read; `None` if there is none.
    pub fn rows_file(&self) -> Option<&RowsFile> {
        self.rows_file.as_ref()
    }

    /// Layout of the skin.
    pub fn skin(&self) -> &SkinLayout {
        &self.skin
    }

    /// The readout profile, including the rows and faults of the scene. Its values hold for electrodes of 10 mm × 10
    /// mm.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// Checks whether presses can be recorded in `mode`, before the first one is simulated.
    ///
    /// # Errors
    /// [`Refusal`] if the source of the weights cannot provide them.
    pub fn check(&self, mode: Mode) -> Result<(), Refusal> {
        match self.weights {
            WeightSource::Model => Ok(()),
            WeightSource::Firmware => {
                let weights = self.profile.weights(mode, taxels(&self.skin)).map_err(of_readout)?;
                let wires = Wires::new(&self.profile.wires, &self.skin).map_err(of_readout)?;
                let weights = weights.wired(wires).map_err(of_readout)?;
                (0..weights.wire_count()).try_for_each(|wire| {
                    let own = weights.of_wire(wire);
                    FirmwareCells::check(&own, self.profile.sample_rate_hz).map_err(of_cells)
                })
            }
        }
    }

    /// The readout for session number `session` in `mode`, with freshly loaded seeds.
    ///
    /// # Errors
    /// [`Refusal`] if the source of the weights cannot provide them.
    pub fn readout(&self, mode: Mode, session: u64) -> Result<Readout, Refusal> {
        self.driven(Readout::new(&self.profile, mode, &self.skin, self.streams, session))
    }

    /// [`Chain::readout`] of touches by hand and robot: few of many taxels conduct. On more than 1,024 the cells are
    /// drawn apart.
    pub(crate) fn readout_of_touches(&self, mode: Mode, session: u64) -> Result<Readout, Refusal> {
        let apart = self.skin.taxels() > 1024;
        self.driven(Readout::with_cells(&self.profile, mode, &self.skin, self.streams, session, apart))
    }

    fn driven(&self, readout: Result<Readout, Refusal>) -> Result<Readout, Refusal> {
        let readout = readout.map_err(of_readout)?;
        match self.weights {
            WeightSource::Model => Ok(readout),
            WeightSource::Firmware => readout.with_codes(|weights| {
                let cells = FirmwareCells::new(weights, self.profile.sample_rate_hz).map_err(of_cells)?;
                Ok(Box::new(cells.counting(Arc::clone(&self.unlike_codes))))
            }),
        }
    }

    /// Number of codes in all recordings by this chain and its copies in which the emulated cells differ from the
    /// model. Such codes show edges that cells have lost because the clock is too fast.
    pub fn unlike_codes(&self) -> u64 {
        self.unlike_codes.load(Ordering::Relaxed)
    }

    /// The same skin with another readout profile, with the usual seeds if it says nothing of them.
    ///
    /// # Errors
    /// [`Refusal`] for a profile with an unknown effect or a value outside its range.
    pub fn with_profile(&self, profile: Profile) -> Result<Self, Refusal> {
        let profile = profile.seeded(&self.skin);
        let valid = profile.validate(taxels(&self.skin));
        let valid = valid.and_then(|()| profile.on(&self.skin).map(drop));
        valid.map_err(|error| refused_profile(None, &error))?;
        let wires = wires(&profile, &self.skin)?;
        Ok(Self { profile, wires, profile_file: None, rows_file: None, ..self.clone() })
    }

    /// The same skin with `transducer`, a transducer of your own. The transducer starts as on a fresh skin, and its
    /// conductances are used unchanged: one for every electrode of this skin.
    ///
    /// ```
    /// use spts::models::{Linear, LinearConfig};
    /// use spts::{Chain, ChainConfig, SkinLayout};
    ///
    /// let chain = Chain::new(&ChainConfig::default(), &SkinLayout::default(), 0, ".".as_ref())?;
    /// let linear = Linear::try_from(LinearConfig { slope_s_per_pa: 2e-8 })?;
    /// let chain = chain.with_transducer(Box::new(linear));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn with_transducer(&self, transducer: Box<dyn Transducer>) -> Self {
        Self { transducer: transducer.into(), ..self.clone() }
    }

    /// Records `presses` of `duration_s` seconds each, in order. Foam and Velostat remember earlier presses.
    ///
    /// # Errors
    /// [`Refusal`] if the readout refuses a conductance, or a press is too long to record.
    pub fn record(
        &self,
        presses: &[&[Frame]],
        duration_s: f64,
        acquisition: &Acquisition,
    ) -> Result<Recording, Refusal> {
        let mut sources = self.conductance(presses, acquisition)?;
        self.record_sources(&mut sources, duration_s, acquisition)
    }

    /// Records presses of `duration_s` seconds each, in order, from their conductances ([`Chain::conductance`]).
    ///
    /// # Errors
    /// As [`Chain::record`].
    pub fn record_sources(
        &self,
        sources: &mut [Interpolated],
        duration_s: f64,
        acquisition: &Acquisition,
    ) -> Result<Recording, Refusal> {
        self.readout_session(duration_s, acquisition)?.record(sources)
    }

    /// Conductance of every press as a function of time, in the session and with the conditioning of `acquisition`.
    ///
    /// # Errors
    /// [`Refusal`] if the frames of a press are not in order of time.
    pub fn conductance(&self, presses: &[&[Frame]], acquisition: &Acquisition) -> Result<Vec<Interpolated>, Refusal> {
        let mut skin = self.skin_session(acquisition.session);
        for frames in presses.iter().cycle().take(acquisition.conditioning_presses) {
            skin.press(frames);
        }
        presses.iter().map(|frames| skin.conductance(frames)).collect()
    }

    /// Conductance of every taxel, S, at every frame of every press: a vector for each press, with a map for each
    /// frame. `session` is the number of the session: the gains of its mounting are drawn by this number. The skin
    /// rests between presses.
    pub fn conductance_maps(&self, presses: &[&[Frame]], session: u64) -> Vec<Vec<ConductanceMap>> {
        let mut skin = self.skin_session(session);
        presses.iter().map(|frames| skin.press(frames)).collect()
    }
}

/// The transducer of `config` on the skin `skin`.
fn transducer(config: &ChainConfig, skin: &SkinLayout, streams: Streams) -> Result<Box<dyn Transducer>, Refusal> {
    let name = config.transducer.as_deref().unwrap_or(DEFAULT_TRANSDUCER);
    let built = build_transducer(name, config.transducer_parameters.clone(), skin, streams);
    built.map_err(|error| refused_transducer(name, error))
}

/// Number of wires of a skin with this `profile`.
fn wires(profile: &Profile, skin: &SkinLayout) -> Result<usize, Refusal> {
    Ok(Wires::new(&profile.wires, skin)?.map_or(1, |wires| wires.count()))
}

fn taxels(skin: &SkinLayout) -> u32 {
    u32::try_from(skin.taxels()).unwrap_or(u32::MAX)
}

/// `profile` with the `faults` of a scene added to its own, for a skin of `taxels` taxels.
fn with_faults(mut profile: Profile, faults: &[toml::Table], taxels: u32) -> Result<Profile, Refusal> {
    let own = profile.faults.len();
    for (index, fault) in faults.iter().enumerate() {
        let fault = parsed::<FaultConfig>(fault.clone());
        let refused = |message: &str| Refusal::new(in_section(&format!("faults[{index}]"), message));
        profile.faults.push(fault.map_err(|e| refused(&e.to_string()))?);
        profile.validate(taxels).map_err(|error| {
            // its place in the scene, not behind the profile's own faults
            let message = error.to_string();
            let (found, meant) = (format!("faults[{}]", own + index), format!("faults[{index}]"));
            Refusal::new(message.replacen(&found, &meant, 1))
        })?;
    }
    Ok(profile)
}

/// What is refused of the transducer called `name`: the name itself, or its parameters.
fn refused_transducer(name: &str, error: Refusal) -> Refusal {
    if TRANSDUCERS.iter().all(|(known, _)| *known != name) {
        return error;
    }
    let message = in_section("transducer_parameters", &error.to_string());
    Refusal::new(format!("{message} (transducer `{name}`)"))
}

/// What is wrong with the readout profile, which is in the file `path` unless it goes by a name.
fn refused_profile(path: Option<&Path>, error: &Refusal) -> Refusal {
    let refusal = match path {
        // a line of the file says more than the section of the scene
        Some(_) if error.to_string().starts_with("line ") => error.clone(),
        _ => Refusal::new(in_section("readout", &error.to_string())),
    };
    match path {
        Some(path) => refusal.at(path.display()),
        None => refusal,
    }
}

/// What cannot be read out.
pub(crate) fn of_readout(error: Refusal) -> Refusal {
    error.at("readout")
}

/// A conductance that the readout cannot use.
pub(crate) fn of_conductance(error: Refusal) -> Refusal {
    error.at("conductance")
}

/// Weights that cannot come from the firmware.
fn of_cells(error: Refusal) -> Refusal {
    error.at("`weights` = \"firmware\"")
}

/// How a session is recorded: in which mode, as which session of the skin, and with how many frames before and between
/// its blocks. A block is one press or drop; a frame is as many measurements as there are taxels.
///
/// ```
/// use spts::{Acquisition, Mode};
///
/// let presses = Acquisition::presses(Mode::Compressive, 3);
/// let drops = Acquisition::drops(Mode::Compressive, 3);
/// assert_eq!((presses.gap_frames, drops.gap_frames), (57, 0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Acquisition {
    /// Raster scan or compressive.
    pub mode: Mode,
    /// Number of the session. Sessions of one skin differ in their noise and, if the transducer varies between
    /// sessions, in their gains.
    pub session: u64,
    /// Frames from the loading of the cells' seeds to the first block. They are not recorded.
    pub lead_frames: u64,
    /// Frames after each block that are not recorded.
    pub gap_frames: u64,
    /// Whether nothing touches the skin in the first 0.233 s of every block (15,000 measurements at 64.3 kHz).
    pub starts_idle: bool,
    /// Number of presses that condition the sheet before the recording. The session's own presses are used, repeated
    /// from the first as often as needed.
    pub conditioning_presses: usize,
}

impl Acquisition {
    /// The way in which the published device records presses: 57 frames are not recorded after each block, while the
    /// arm returns, and a block begins with an untouched skin.
    pub fn presses(mode: Mode, session: u64) -> Self {
        Self { mode, session, lead_frames: 243, gap_frames: 57, starts_idle: true, conditioning_presses: 0 }
    }

    /// The way in which the published device records touches by a finger: block follows block without a gap, as for
    /// [`Acquisition::drops`], and nothing says when in a block the skin is touched.
    pub fn touches(mode: Mode, session: u64) -> Self {
        Self::drops(mode, session)
    }

    /// The way in which the published device records drops of a ball: block follows block without a gap, and nothing
    /// says when in a block the ball lands.
    pub fn drops(mode: Mode, session: u64) -> Self {
        Self { lead_frames: 0, gap_frames: 0, starts_idle: false, ..Self::presses(mode, session) }
    }
}

/// No press touches the skin in the first so many measurements at [`IDLE_RATE_HZ`], 0.233 s: the earliest begins at
/// 0.25 s.
const IDLE_MEASUREMENTS: f64 = 15_000.0;
/// Rate of [`IDLE_MEASUREMENTS`], Hz.
const IDLE_RATE_HZ: f64 = 64_300.0;

/// Frames at the start of a block in which no press touches the skin, of `frame` measurements each at `rate_hz`.
fn idle_frames(rate_hz: f64, frame: usize) -> usize {
    #[expect(clippy::cast_possible_truncation, reason = "casts saturate")]
    let frames = (IDLE_MEASUREMENTS * rate_hz / IDLE_RATE_HZ / frame as f64) as usize;
    frames
}

/// Rest between two presses: the arm's way back, s.
const REST_S: f64 = 2.0;
/// Time for which a bent skin has been under its preload before a session, s: creep is over for the most part.
const BENT_S: f64 = 3600.0;
/// Most measurements recorded of one press: ten minutes at 64.3 kHz, 320 MB.
const MAX_MEASUREMENTS: f64 = 4e7;

/// The skin during one session. Foam and Velostat remember earlier presses.
///
/// ```
/// use spts::{Chain, ChainConfig, PressureMap, SkinLayout};
///
/// let chain = Chain::new(&ChainConfig::default(), &SkinLayout::default(), 0, ".".as_ref())?;
/// let pressure = PressureMap::from_values(10, 10, vec![10e3; 100]);
/// let mut skin = chain.skin_session(0);
/// let first = skin.hold(&pressure, 0.5).sum();
/// skin.rest();
/// assert!(skin.hold(&pressure, 0.5).sum() > first, "Velostat conducts better at the second press");
/// # Ok::<(), spts::Refusal>(())
/// ```
pub struct SkinSession {
    transducer: Box<dyn Transducer>,
    rows: usize,
    cols: usize,
    /// Whether the skin has been pressed in this session.
    pressed: bool,
}

impl Clone for SkinSession {
    fn clone(&self) -> Self {
        Self { transducer: self.transducer.boxed(), ..*self }
    }
}

impl SkinSession {
    /// A skin with the transducer of `config`, ready for session number `session`. Equal `streams` give the same
    /// specimen.
    ///
    /// # Errors
    /// [`Refusal`] for an unknown transducer, or parameters that it refuses.
    pub fn new(config: &ChainConfig, skin: &SkinLayout, streams: Streams, session: u64) -> Result<Self, Refusal> {
        Ok(Self::begun(transducer(config, skin, streams)?, skin, session))
    }

    fn begun(mut transducer: Box<dyn Transducer>, skin: &SkinLayout, session: u64) -> Self {
        transducer.start_session(session);
        Self { transducer, rows: skin.rows(), cols: skin.cols(), pressed: false }
    }

    /// Rows and columns of taxels.
    pub(crate) fn shape(&self) -> [usize; 2] {
        [self.rows, self.cols]
    }

    /// Conductance of every taxel, S, `hold_s` seconds after the start of a press with the constant pressure
    /// `electrode_pressure`.
    pub fn hold(&mut self, electrode_pressure: &PressureMap, hold_s: f64) -> ConductanceMap {
        let mut map = ConductanceMap::zeros(self.rows, self.cols);
        self.transducer.step(electrode_pressure, hold_s, &mut map);
        map
    }

    /// [`hold`](Self::hold) with pressure on the taxels `pressed` alone, Pa, in order. `out` is what of the conductance
    /// is not zero or was not before, S, in order.
    pub(crate) fn hold_touched(&mut self, pressed: &[(u32, f64)], hold_s: f64, out: &mut Vec<(u32, f64)>) {
        if self.transducer.step_touched(pressed, hold_s, out) {
            return;
        }
        let mut pressure = PressureMap::zeros(self.rows, self.cols);
        pressed.iter().for_each(|(taxel, pa)| pressure.values_mut()[*taxel as usize] = *pa);
        out.clear();
        out.extend((0..).zip(self.hold(&pressure, hold_s).values().iter().copied()));
    }

    /// Saves or loads what the skin remembers of this session.
    pub(crate) fn exchange(&mut self, state: &mut Snapshot) {
        state.flag(&mut self.pressed);
        self.transducer.exchange(state);
    }

    /// Lets the skin rest as long as between two presses.
    pub fn rest(&mut self) {
        self.transducer.rest(REST_S);
    }

    /// Conductance of every taxel at every frame of the next press; afterwards the skin rests. A bent skin rests under
    /// its preload, which has acted since long before the session.
    pub fn press(&mut self, frames: &[Frame]) -> Vec<ConductanceMap> {
        let preload = preload(frames);
        if let Some(preload) = preload.filter(|_| !self.pressed) {
            self.hold(preload, BENT_S);
        }
        self.pressed = true;
        let mut last_s = 0.0;
        let maps = frames.iter().map(|frame| {
            let mut map = ConductanceMap::zeros(self.rows, self.cols);
            self.transducer.step(&frame.electrode_pressure, frame.time_s - last_s, &mut map);
            last_s = frame.time_s;
            map
        });
        let maps = maps.collect();
        match preload {
            Some(preload) => drop(self.hold(preload, REST_S)),
            None => self.rest(),
        }
        maps
    }

    /// [`SkinSession::press`] as a function of time, interpolated between the frames.
    ///
    /// # Errors
    /// [`Refusal`] if the frames are not in order of time.
    pub fn conductance(&mut self, frames: &[Frame]) -> Result<Interpolated, Refusal> {
        let times_s = frames.iter().map(|frame| frame.time_s).collect();
        Interpolated::new(times_s, self.press(frames)).map_err(of_conductance)
    }
}

/// Pressure on the electrodes of a bent skin before `frames`' touch; `None` for a flat one. It is pressure without a
/// force.
fn preload(frames: &[Frame]) -> Option<&PressureMap> {
    let first = frames.first().filter(|frame| frame.wrench.force_n[2] <= 0.0)?;
    let loaded = first.electrode_pressure.values().iter().any(|p| *p > 0.0);
    loaded.then_some(&first.electrode_pressure)
}

/// The readout during one session. The seeds are loaded before the first block.
pub struct ReadoutSession {
    readout: Readout,
    measurements: usize,
    gap_frames: u64,
    idle_frames: Option<usize>,
}

impl ReadoutSession {
    /// Records one block for each of `sources`, in order.
    ///
    /// # Errors
    /// [`Refusal`] if the readout refuses a conductance.
    pub fn record(&mut self, sources: &mut [Interpolated]) -> Result<Recording, Refusal> {
        let recording = self.readout.record(sources, self.measurements, self.gap_frames);
        let recording = recording.map_err(of_readout)?;
        Ok(recording.with_idle_frames(self.idle_frames))
    }
}

impl Chain {
    /// The skin, ready for session number `session`.
    pub fn skin_session(&self, session: u64) -> SkinSession {
        SkinSession::begun(self.transducer.boxed(), self.skin(), session)
    }

    /// The readout, ready to record presses of `duration_s` seconds each as `acquisition` says.
    ///
    /// # Errors
    /// [`Refusal`] if a press is too long to record, or the source of the weights cannot provide them.
    pub(crate) fn readout_session(
        &self,
        duration_s: f64,
        acquisition: &Acquisition,
    ) -> Result<ReadoutSession, Refusal> {
        let mut readout = self.readout(acquisition.mode, acquisition.session)?;
        readout.skip(acquisition.lead_frames);
        let frame = readout.measurements_per_frame();
        let measurements = duration_s * readout.sample_rate_hz();
        if measurements > MAX_MEASUREMENTS {
            return Err(Refusal::new(format!(
                "`duration_s` = {duration_s}: {measurements:.0} measurements a press are outside [1, {MAX_MEASUREMENTS:.0}]"
            )));
        }
        #[expect(clippy::cast_possible_truncation, reason = "limited to MAX_MEASUREMENTS")]
        let frames = (measurements / frame as f64).round() as usize;
        let idle_frames = idle_frames(readout.sample_rate_hz(), frame);
        // no whole frame of a large skin passes before the earliest press
        let known = acquisition.starts_idle && idle_frames > 0;
        Ok(ReadoutSession {
            measurements: frames.max(1) * frame,
            gap_frames: acquisition.gap_frames,
            idle_frames: known.then_some(idle_frames),
            readout,
        })
    }
}

/// Facts about one press or drop at the middle of its hold or, without a hold, at the instant of the largest force.
/// `maps` are the conductances at `frames`.
pub fn press_facts(frames: &[Frame], maps: &[ConductanceMap], hold_s: Option<[f64; 2]>) -> PressFacts {
    let at = match hold_s {
        Some([start_s, end_s]) => frames.iter().position(|f| f.time_s >= 0.5 * (start_s + end_s)),
        None => {
            let force = |k: &usize| frames[*k].wrench.force_n[2];
            // the first of several
            (0..frames.len()).rev().max_by(|a, b| force(a).total_cmp(&force(b)))
        }
    };
    let Some(frame) = at.and_then(|at| frames.get(at)) else {
        return PressFacts::default();
    };
    PressFacts {
        time_s: Some(frame.time_s),
        pose: Some(PressPose { position_m: frame.pose.position_m, quaternion: frame.pose.quaternion }),
        force_n: Some(frame.wrench.force_n[2]),
        pressure: Some(frame.pressure.clone()),
        conductance: at.and_then(|at| maps.get(at)).cloned(),
        course: None,
    }
}

/// Signal and noise of one pressed taxel in a measurement of the compressive readout.
///
/// ```
/// use spts::{Chain, ChainConfig, SkinLayout};
///
/// let chain = Chain::new(&ChainConfig::default(), &SkinLayout::default(), 0, ".".as_ref())?;
/// let taxel = chain.taxel_signal()?;
/// assert!(!taxel.below_noise() && taxel.signal_v > 5.0 * taxel.step_v);
/// # Ok::<(), spts::Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaxelSignal {
    /// Output of a taxel of median gain under 10 kPa, V.
    pub signal_v: f64,
    /// Standard deviation of a measurement of this taxel alone, V. All effects of the profile contribute, including the
    /// taxel's contact noise.
    pub noise_v: f64,
    /// Step of the converter, V; 0 if the profile has no converter.
    pub step_v: f64,
}

/// Time for which the taxel has been pressed, s: creep is over for the most part.
const HOLD_S: f64 = 0.5;
/// Measurements that the noise is found from: its standard error is 1 %.
const MEASUREMENTS: usize = 5000;
/// A taxel of less than so many standard deviations of a measurement is below the noise.
const LEAST_RATIO: f64 = 2.0;

impl TaxelSignal {
    /// Whether the signal is less than twice the noise, or less than one step of the converter. An image then needs
    /// many more measurements than there are taxels.
    pub fn below_noise(&self) -> bool {
        self.signal_v < LEAST_RATIO * self.noise_v || self.signal_v < self.step_v
    }
}

impl Chain {
    /// Signal and noise of one taxel of this skin and readout. They are measured on a skin of one taxel, without faults
    /// and with seeds by the rule, so that the result does not depend on the rows.
    ///
    /// # Errors
    /// [`Refusal`] if the readout cannot be set up.
    pub fn taxel_signal(&self) -> Result<TaxelSignal, Refusal> {
        let skin = self.skin();
        let shape = (skin.rows(), skin.cols());
        let pressure = PressureMap::from_values(shape.0, shape.1, vec![REFERENCE_PA; skin.taxels()]);
        let mut map = ConductanceMap::zeros(shape.0, shape.1);
        self.transducer.boxed().step(&pressure, HOLD_S, &mut map);
        let mut values = map.values().to_vec();
        let (_, median_s, _) = values.select_nth_unstable_by(skin.taxels() / 2, f64::total_cmp);
        let conductance = ConductanceMap::from_values(1, 1, vec![*median_s]);
        let one = SkinLayout::new(1, 1, skin.pitch_m(), skin.electrode_m()).unwrap_or_default();
        let profile =
            Profile { seeds: None, patterns: None, faults: Vec::new(), wires: Vec::new(), ..self.profile().clone() };
        let mut readout = Readout::new(&profile, Mode::Compressive, &one, self.streams, 0).map_err(of_readout)?;
        let mut pressed = Constant::new(conductance).map_err(of_conductance)?;
        let volts = readout.measure(&mut pressed, MEASUREMENTS).map_err(of_readout)?;
        let mut weights = vec![0.0; MEASUREMENTS];
        readout.weights().fill_rows(0, &mut weights);
        let converter = readout.info().converter;
        Ok(TaxelSignal {
            signal_v: *median_s * profile.on(&one).map_err(of_readout)?.volts_per_siemens(),
            noise_v: residual_sd(&weights, &volts),
            step_v: converter.map_or(0.0, |c| c.volts(0) - c.volts(1)),
        })
    }
}

/// Standard deviation of `y` about its regression on `x`.
fn residual_sd(x: &[f64], y: &[f64]) -> f64 {
    let n = x.len() as f64;
    let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
    let (x_mean, y_mean) = (mean(x), mean(y));
    let products = |a: &[f64], a_mean: f64, b: &[f64], b_mean: f64| {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| (a - a_mean) * (b - b_mean)).sum::<f64>()
    };
    let (xx, xy) = (products(x, x_mean, x, x_mean), products(x, x_mean, y, y_mean));
    let explained = if xx > 0.0 { xy * xy / xx } else { 0.0 };
    ((products(y, y_mean, y, y_mean) - explained).max(0.0) / n).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_contact::{Pose, Wrench};
    use spts_models::PressureMap;

    fn pressed(time_s: f64) -> Frame {
        let map = PressureMap::from_values(10, 10, vec![1e4; 100]);
        Frame {
            time_s,
            pressure: map.clone(),
            electrode_pressure: map,
            wrench: Wrench { force_n: [0.0, 0.0, 225.0], torque_nm: [0.0; 3] },
            pose: Pose { position_m: [0.0; 3], quaternion: [1.0, 0.0, 0.0, 0.0] },
        }
    }

    /// Taxels differ between two sessions of one skin by the factor that `session_log_sd` says, and otherwise not at
    /// all.
    #[test]
    fn a_session_has_its_own_spread() {
        let frames = [pressed(0.0), pressed(1.0)];
        let maps = |log_sd: f64, session| {
            let config = ChainConfig {
                transducer_parameters: [
                    ("session_log_sd".to_owned(), log_sd.into()),
                    ("session_tilt_log_sd".to_owned(), 0.0.into()),
                ]
                .into_iter()
                .collect(),
                ..ChainConfig::default()
            };
            let chain = Chain::new(&config, &SkinLayout::default(), 0, Path::new("")).unwrap();
            chain.conductance_maps(&[&frames], session)
        };
        assert_eq!(maps(0.0, 0), maps(0.0, 1));
        assert_eq!(maps(0.15, 1), maps(0.15, 1));
        let (a, b) = (maps(0.15, 0), maps(0.15, 1));
        let ratios = a[0][1].values().iter().zip(b[0][1].values()).map(|(a, b)| (a / b).ln());
        let sd = (ratios.map(|r| r * r).sum::<f64>() / 100.0).sqrt();
        // standard error of a log-sd σ from n taxels: σ/√(2n); five of them
        let expected = 0.15 * 2.0_f64.sqrt();
        assert!((sd - expected).abs() < 5.0 * expected / 200.0_f64.sqrt(), "{sd}");
    }
}
