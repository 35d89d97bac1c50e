//! Everything between the pressure on the skin and the recording.

use super::cells::FirmwareCells;
use super::error::TwinError;
use super::weights::{DEFAULT_WEIGHTS, WeightSource};
use spts_circuit::{AcquireError, Interpolated, Mode, Profile, ProfileError, Readout, Recording};
use spts_models::{ConductanceMap, SkinLayout, Streams, Transducer, build_transducer};
use spts_sim::Frame;
use spts_sim::scene::Scene;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Transducer, readout and source of weights of a scene, by name.
#[derive(Debug, Clone)]
pub struct Chain {
    transducer: String,
    parameters: toml::Table,
    profile: Profile,
    weights: WeightSource,
    skin: SkinLayout,
    streams: Streams,
    /// Of the codes that emulated cells put out for this chain, those that sound cells would not.
    unlike_codes: Arc<AtomicU64>,
}

/// Transducer of a scene that names none.
pub const DEFAULT_TRANSDUCER: &str = "velostat";
/// Readout profile of a scene that names none.
pub const DEFAULT_READOUT: &str = "as_built";

/// How a session is recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Take {
    /// Raster scan or compressive.
    pub mode: Mode,
    /// Number of the session: two sessions of one skin have noise of their own, and where the transducer has it, a spread.
    pub session: u64,
    /// Frames between loading the seeds and the first block.
    pub lead_frames: u64,
    /// Unrecorded frames after each block.
    pub gap_frames: u64,
    /// Whether nothing touches the skin in the first 0.233 s of every block: 15,000 measurements at 64.3 kHz.
    pub starts_idle: bool,
    /// Presses that work the sheet in before the recording; the session's own, from the first on and over again.
    pub worked_in: usize,
}

impl Take {
    /// Presses as on the device: the arm takes about 57 frames to come back.
    #[must_use]
    pub fn presses(mode: Mode, session: u64) -> Self {
        Self {
            mode,
            session,
            lead_frames: 243,
            gap_frames: 57,
            starts_idle: true,
            worked_in: 0,
        }
    }

    /// Drops as on the device: blocks follow each other without a gap. When the ball is let go is not known to the recording.
    #[must_use]
    pub fn drops(mode: Mode, session: u64) -> Self {
        Self {
            lead_frames: 0,
            gap_frames: 0,
            starts_idle: false,
            ..Self::presses(mode, session)
        }
    }
}

/// No press touches the skin in the first so many measurements at [`IDLE_RATE_HZ`], 0.233 s: the earliest begins at 0.25 s.
const IDLE_MEASUREMENTS: f64 = 15_000.0;
/// Rate of [`IDLE_MEASUREMENTS`], Hz.
const IDLE_RATE_HZ: f64 = 64_300.0;
/// Rest between two presses: the arm's way back, s.
const REST_S: f64 = 2.0;
/// Most measurements recorded of one press: ten minutes at 64.3 kHz, 320 MB.
const MAX_MEASUREMENTS: f64 = 4e7;

impl Chain {
    /// Chain of `scene`. The readout is a profile's name or, when it ends in `.toml`, a file. The skin is the same
    /// specimen for every scene with the same seed.
    ///
    /// # Errors
    /// [`TwinError`] for an unknown transducer, profile, fault or source of weights, or an unusable file.
    pub fn new(scene: &Scene) -> Result<Self, TwinError> {
        let config = scene.config();
        let readout = config.readout.as_deref().unwrap_or(DEFAULT_READOUT);
        let profile = if Path::new(readout).extension().is_some_and(|e| e == "toml") {
            let text = std::fs::read_to_string(readout).map_err(|source| TwinError::Io {
                path: readout.into(),
                source,
            })?;
            Profile::from_toml(&text)?
        } else {
            Profile::named(readout)?
        };
        let mut chain = Self {
            parameters: config.transducer_parameters.clone(),
            transducer: config
                .transducer
                .clone()
                .unwrap_or_else(|| DEFAULT_TRANSDUCER.to_owned()),
            profile,
            weights: WeightSource::named(config.weights.as_deref().unwrap_or(DEFAULT_WEIGHTS))?,
            skin: *scene.skin(),
            streams: Streams::new(scene.seed()),
            unlike_codes: Arc::default(),
        };
        chain.build_transducer()?;
        chain.profile.validate(chain.taxels())?;
        chain.add_faults(&config.faults).map_err(TwinError::Fault)?;
        Ok(chain)
    }

    /// Adds the faults of the scene to those of the profile.
    fn add_faults(&mut self, faults: &[toml::Table]) -> Result<(), ProfileError> {
        for fault in faults {
            let fault = fault.clone().try_into();
            let fault =
                fault.map_err(|e: toml::de::Error| ProfileError::Syntax(e.to_string().trim_end().to_owned()))?;
            self.profile.faults.push(fault);
        }
        self.profile.validate(self.taxels())
    }

    /// Measurements a second, Hz.
    #[must_use]
    pub fn sample_rate_hz(&self) -> f64 {
        self.profile.sample_rate_hz
    }

    /// Readout profile.
    #[must_use]
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// Checks before the first press what would keep it from being recorded in `mode`.
    ///
    /// # Errors
    /// [`TwinError::Cells`] when its weights cannot come from where the scene says.
    pub fn check(&self, mode: Mode) -> Result<(), TwinError> {
        match self.weights {
            WeightSource::Model => Ok(()),
            WeightSource::Firmware => {
                let weights = self.profile.weights(mode, self.taxels())?;
                Ok(FirmwareCells::check(&weights, self.profile.sample_rate_hz)?)
            }
        }
    }

    /// Readout of session number `session` in `mode`, its seeds just loaded.
    ///
    /// # Errors
    /// [`TwinError`] when the weights cannot come from where the scene says.
    pub fn readout(&self, mode: Mode, session: u64) -> Result<Readout, TwinError> {
        let readout = Readout::new(&self.profile, mode, &self.skin, self.streams, session)?;
        match self.weights {
            WeightSource::Model => Ok(readout),
            WeightSource::Firmware => {
                let weights = self.profile.weights(mode, self.taxels())?;
                let cells = FirmwareCells::new(&weights, self.profile.sample_rate_hz)?;
                let cells = cells.counting(Arc::clone(&self.unlike_codes));
                Ok(readout.with_codes(Box::new(cells)).map_err(AcquireError::from)?)
            }
        }
    }

    /// Number of codes that emulated cells put out in the recordings so far, by this chain and its copies, and that are not the model's:
    /// edges lost to a clock that is too fast.
    #[must_use]
    pub fn unlike_codes(&self) -> u64 {
        self.unlike_codes.load(Ordering::Relaxed)
    }

    /// The same skin read out with another profile.
    ///
    /// # Errors
    /// [`TwinError`] for a profile with an unknown effect or a value outside its range.
    pub fn with_profile(&self, profile: Profile) -> Result<Self, TwinError> {
        profile.validate(self.taxels())?;
        Ok(Self {
            profile,
            ..self.clone()
        })
    }

    fn taxels(&self) -> u32 {
        u32::try_from(self.skin.taxels()).unwrap_or(u32::MAX)
    }

    fn build_transducer(&self) -> Result<Box<dyn Transducer>, TwinError> {
        build_transducer(&self.transducer, self.parameters.clone(), &self.skin, self.streams).map_err(|source| {
            TwinError::Transducer {
                name: self.transducer.clone(),
                source,
            }
        })
    }

    /// Records `presses`, `duration_s` each, one after the other. Foam and Velostat remember the presses before.
    ///
    /// # Errors
    /// [`TwinError`] when the readout refuses the conductance, or a press is too long to record.
    pub fn record(&self, presses: &[&[Frame]], duration_s: f64, take: &Take) -> Result<Recording, TwinError> {
        let mut sources = self.conductance(presses, take)?;
        self.record_sources(&mut sources, duration_s, take)
    }

    /// Records presses whose conductance is known ([`Chain::conductance`]), `duration_s` each, one after the other.
    ///
    /// # Errors
    /// As for [`Chain::record`].
    pub fn record_sources(
        &self,
        sources: &mut [Interpolated],
        duration_s: f64,
        take: &Take,
    ) -> Result<Recording, TwinError> {
        let mut readout = self.readout(take.mode, take.session)?;
        readout.skip(take.lead_frames);
        let frame = readout.measurements_per_frame();
        let measurements = duration_s * readout.sample_rate_hz();
        if measurements > MAX_MEASUREMENTS {
            return Err(TwinError::TooLong {
                duration_s,
                measurements,
                limit: MAX_MEASUREMENTS,
            });
        }
        #[expect(clippy::cast_possible_truncation, reason = "limited to MAX_MEASUREMENTS")]
        let frames = (measurements / frame as f64).round() as usize;
        let recording = readout.record(sources, frames.max(1) * frame, take.gap_frames)?;
        #[expect(clippy::cast_possible_truncation, reason = "casts saturate")]
        let idle_frames = (IDLE_MEASUREMENTS * readout.sample_rate_hz() / IDLE_RATE_HZ / frame as f64) as usize;
        Ok(recording.with_idle_frames(take.starts_idle.then_some(idle_frames)))
    }

    /// Conductance over time of every press of the session that `take` says, on a sheet that is worked in as it says.
    ///
    /// # Errors
    /// [`TwinError`] when the transducer cannot be built or gives an unusable conductance.
    pub fn conductance(&self, presses: &[&[Frame]], take: &Take) -> Result<Vec<Interpolated>, TwinError> {
        let before = presses
            .iter()
            .cycle()
            .take(if presses.is_empty() { 0 } else { take.worked_in });
        let all: Vec<&[Frame]> = before.chain(presses).copied().collect();
        let maps = self.conductance_maps(&all, take.session)?;
        let maps = maps.into_iter().skip(all.len() - presses.len());
        let sources = presses.iter().zip(maps).map(|(frames, maps)| {
            let times_s = frames.iter().map(|frame| frame.time_s).collect();
            Ok(Interpolated::new(times_s, maps)?)
        });
        sources.collect()
    }

    /// Conductance of the taxels at every frame of every press of session number `session`, the skin resting between the
    /// presses.
    ///
    /// # Errors
    /// [`TwinError`] when the transducer cannot be built.
    pub fn conductance_maps(&self, presses: &[&[Frame]], session: u64) -> Result<Vec<Vec<ConductanceMap>>, TwinError> {
        let mut transducer = self.build_transducer()?;
        transducer.start_session(session);
        let of_press = |frames: &&[Frame]| {
            let mut last_s = 0.0;
            let maps = frames.iter().map(|frame| {
                let mut map = ConductanceMap::zeros(self.skin.rows(), self.skin.cols());
                transducer.step(&frame.electrode_pressure, frame.time_s - last_s, &mut map);
                last_s = frame.time_s;
                map
            });
            let maps = maps.collect();
            transducer.rest(REST_S);
            maps
        };
        Ok(presses.iter().map(of_press).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_models::PressureMap;
    use spts_sim::frame::{Pose, Wrench};

    fn pressed(time_s: f64) -> Frame {
        let map = PressureMap::from_values(10, 10, vec![1e4; 100]);
        Frame {
            time_s,
            pressure: map.clone(),
            electrode_pressure: map,
            wrench: Wrench {
                force_n: [0.0, 0.0, 225.0],
                torque_nm: [0.0; 3],
            },
            pose: Pose {
                position_m: [0.0; 3],
                quaternion: [1.0, 0.0, 0.0, 0.0],
            },
        }
    }

    /// Taxels differ between two sessions of one skin by the factor that `session_log_sd` says, and otherwise not at all.
    #[test]
    fn a_session_has_its_own_spread() {
        let frames = [pressed(0.0), pressed(1.0)];
        let maps = |log_sd: f64, session| {
            let text = format!("[transducer_parameters]\nsession_log_sd = {log_sd:?}\n[press]\nobject = \"T\"");
            let chain = Chain::new(&Scene::from_toml(&text, Path::new(".")).unwrap()).unwrap();
            chain.conductance_maps(&[&frames], session).unwrap()
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
