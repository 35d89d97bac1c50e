//! The presses of one session, recorded a few at a time. Skin and readout keep their state between calls.

use super::acquisition::{Acquisition, idle_frames};
use super::error::ChainError;
use super::stages::Chain;
use spts_circuit::{Interpolated, Readout, Recording};
use spts_contact::Frame;
use spts_models::{ConductanceMap, PressureMap, Transducer};

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
/// # Ok::<(), spts::ChainError>(())
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
        Self {
            transducer: self.transducer.boxed(),
            ..*self
        }
    }
}

impl SkinSession {
    /// Conductance of every taxel, S, `hold_s` seconds after the start of a press with the constant pressure
    /// `electrode_pressure`.
    pub fn hold(&mut self, electrode_pressure: &PressureMap, hold_s: f64) -> ConductanceMap {
        let mut map = ConductanceMap::zeros(self.rows, self.cols);
        self.transducer.step(electrode_pressure, hold_s, &mut map);
        map
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
            self.transducer
                .step(&frame.electrode_pressure, frame.time_s - last_s, &mut map);
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
    /// [`ChainError::Source`] if the frames are not in order of time.
    pub fn conductance(&mut self, frames: &[Frame]) -> Result<Interpolated, ChainError> {
        let times_s = frames.iter().map(|frame| frame.time_s).collect();
        Interpolated::new(times_s, self.press(frames)).map_err(ChainError::Source)
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
    /// [`ChainError`] if the readout refuses a conductance.
    pub fn record(&mut self, sources: &mut [Interpolated]) -> Result<Recording, ChainError> {
        let recording = self.readout.record(sources, self.measurements, self.gap_frames)?;
        Ok(recording.with_idle_frames(self.idle_frames))
    }
}

impl Chain {
    /// The skin, ready for session number `session`.
    #[must_use]
    pub fn skin_session(&self, session: u64) -> SkinSession {
        let mut transducer = self.fresh_transducer();
        transducer.start_session(session);
        SkinSession {
            transducer,
            rows: self.skin().rows(),
            cols: self.skin().cols(),
            pressed: false,
        }
    }

    /// The readout, ready to record presses of `duration_s` seconds each as `acquisition` says.
    ///
    /// # Errors
    /// [`ChainError`] if a press is too long to record, or the source of the weights cannot provide them.
    pub fn readout_session(&self, duration_s: f64, acquisition: &Acquisition) -> Result<ReadoutSession, ChainError> {
        let mut readout = self.readout(acquisition.mode, acquisition.session)?;
        readout.skip(acquisition.lead_frames);
        let frame = readout.measurements_per_frame();
        let measurements = duration_s * readout.sample_rate_hz();
        if measurements > MAX_MEASUREMENTS {
            return Err(ChainError::TooLong {
                duration_s,
                measurements,
                limit: MAX_MEASUREMENTS,
            });
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
