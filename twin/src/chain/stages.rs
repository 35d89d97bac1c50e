//! Every stage between the pressure on the skin and the recording.

use super::acquisition::Acquisition;
use super::cells::FirmwareCells;
use super::config::{ChainConfig, DEFAULT_READOUT, DEFAULT_TRANSDUCER};
use super::error::ChainError;
use super::rows::RowsFile;
use super::weights::{DEFAULT_WEIGHTS, WeightSource};
use spts_circuit::{FaultConfig, Interpolated, Mode, PROFILES, Profile, Readout, Recording};
use spts_contact::Frame;
use spts_input::Refusal;
use spts_models::{ConductanceMap, SkinLayout, Streams, Transducer, build_transducer, explain_toml, in_section};
use std::fmt;
use std::path::{Path, PathBuf};
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
/// # Ok::<(), spts::ChainError>(())
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

/// The file from which a readout profile was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProfileFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
}

impl Chain {
    /// The chain of the skin `skin` with the stages in `config`. A readout that ends in `.toml` is a file in `folder`.
    /// Chains with the same `seed` have the same specimen of the skin.
    ///
    /// # Errors
    /// [`ChainError`] for an unknown transducer, profile, fault or source of weights, a value outside its range, or a
    /// file that cannot be used.
    pub fn new(config: &ChainConfig, skin: &SkinLayout, seed: u64, folder: &Path) -> Result<Self, ChainError> {
        let streams = Streams::new(seed);
        let name = config.transducer.as_deref().unwrap_or(DEFAULT_TRANSDUCER);
        let transducer = build_transducer(name, config.transducer_parameters.clone(), skin, streams);
        let transducer = transducer.map_err(|source| ChainError::transducer(name, &source))?;
        let readout = config.readout.as_deref().unwrap_or(DEFAULT_READOUT);
        let profile_file = ProfileFile::of(readout, folder)?;
        let path = profile_file.as_ref().map(|file| file.path.as_path());
        let in_file = |error: Refusal| ChainError::profile(path, &error);
        let profile = match &profile_file {
            Some(file) => Profile::from_toml(&file.text),
            None if PROFILES.iter().all(|(known, _)| *known != readout) => {
                let known: Vec<&str> = PROFILES.iter().map(|(known, _)| *known).collect();
                return Err(ChainError::UnknownProfile {
                    name: readout.to_owned(),
                    known: known.join(", "),
                });
            }
            None => Profile::named(readout),
        };
        let (profile, rows_file) = config.rows.applied(profile.map_err(in_file)?, skin, folder)?;
        profile.validate(taxels(skin)).map_err(in_file)?;
        profile.on(skin).map_err(in_file)?;
        let chain = Self {
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

    /// Number of measurements a second, Hz.
    #[must_use]
    pub fn sample_rate_hz(&self) -> f64 {
        self.profile.sample_rate_hz
    }

    /// The file from which the readout profile was read; `None` for a profile by name.
    #[must_use]
    pub fn profile_file(&self) -> Option<&ProfileFile> {
        self.profile_file.as_ref()
    }

    /// The file from which seeds or a pattern were read; `None` if there is none.
    #[must_use]
    pub fn rows_file(&self) -> Option<&RowsFile> {
        self.rows_file.as_ref()
    }

    /// Layout of the skin.
    pub fn skin(&self) -> &SkinLayout {
        &self.skin
    }

    /// Random streams of the skin.
    pub(super) fn streams(&self) -> Streams {
        self.streams
    }

    /// The transducer of a fresh skin.
    pub(super) fn fresh_transducer(&self) -> Box<dyn Transducer> {
        self.transducer.boxed()
    }

    /// The readout profile, including the rows and faults of the scene. Its values hold for electrodes of 10 mm × 10
    /// mm.
    #[must_use]
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// Checks whether presses can be recorded in `mode`, before the first one is simulated.
    ///
    /// # Errors
    /// [`ChainError::Cells`] if the source of the weights cannot provide them.
    pub fn check(&self, mode: Mode) -> Result<(), ChainError> {
        match self.weights {
            WeightSource::Model => Ok(()),
            WeightSource::Firmware => {
                let weights = self.profile.weights(mode, taxels(&self.skin))?;
                Ok(FirmwareCells::check(&weights, self.profile.sample_rate_hz)?)
            }
        }
    }

    /// The readout for session number `session` in `mode`, with freshly loaded seeds.
    ///
    /// # Errors
    /// [`ChainError`] if the source of the weights cannot provide them.
    pub fn readout(&self, mode: Mode, session: u64) -> Result<Readout, ChainError> {
        let readout = Readout::new(&self.profile, mode, &self.skin, self.streams, session)?;
        match self.weights {
            WeightSource::Model => Ok(readout),
            WeightSource::Firmware => {
                let weights = self.profile.weights(mode, taxels(&self.skin))?;
                let cells = FirmwareCells::new(&weights, self.profile.sample_rate_hz)?;
                let cells = cells.counting(Arc::clone(&self.unlike_codes));
                Ok(readout.with_codes(Box::new(cells))?)
            }
        }
    }

    /// Number of codes in all recordings by this chain and its copies in which the emulated cells differ from the
    /// model. Such codes show edges that cells have lost because the clock is too fast.
    #[must_use]
    pub fn unlike_codes(&self) -> u64 {
        self.unlike_codes.load(Ordering::Relaxed)
    }

    /// The same skin with another readout profile.
    ///
    /// # Errors
    /// [`ChainError`] for a profile with an unknown effect or a value outside its range.
    pub fn with_profile(&self, profile: Profile) -> Result<Self, ChainError> {
        let valid = profile.validate(taxels(&self.skin));
        let valid = valid.and_then(|()| profile.on(&self.skin).map(drop));
        valid.map_err(|error| ChainError::profile(None, &error))?;
        Ok(Self {
            profile,
            profile_file: None,
            rows_file: None,
            ..self.clone()
        })
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
    #[must_use]
    pub fn with_transducer(&self, transducer: Box<dyn Transducer>) -> Self {
        Self {
            transducer: transducer.into(),
            ..self.clone()
        }
    }

    /// Records `presses` of `duration_s` seconds each, in order. Foam and Velostat remember earlier presses.
    ///
    /// # Errors
    /// [`ChainError`] if the readout refuses a conductance, or a press is too long to record.
    pub fn record(
        &self,
        presses: &[&[Frame]],
        duration_s: f64,
        acquisition: &Acquisition,
    ) -> Result<Recording, ChainError> {
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
    ) -> Result<Recording, ChainError> {
        self.readout_session(duration_s, acquisition)?.record(sources)
    }

    /// Conductance of every press as a function of time, in the session and with the conditioning of `acquisition`.
    ///
    /// # Errors
    /// [`ChainError::Source`] if the frames of a press are not in order of time.
    pub fn conductance(
        &self,
        presses: &[&[Frame]],
        acquisition: &Acquisition,
    ) -> Result<Vec<Interpolated>, ChainError> {
        let mut skin = self.skin_session(acquisition.session);
        for frames in presses.iter().cycle().take(acquisition.conditioning_presses) {
            skin.press(frames);
        }
        presses.iter().map(|frames| skin.conductance(frames)).collect()
    }

    /// Conductance of every taxel, S, at every frame of every press: a vector for each press, with a map for each
    /// frame. `session` is the number of the session: the gains of its mounting are drawn by this number. The skin
    /// rests between presses.
    #[must_use]
    pub fn conductance_maps(&self, presses: &[&[Frame]], session: u64) -> Vec<Vec<ConductanceMap>> {
        let mut skin = self.skin_session(session);
        presses.iter().map(|frames| skin.press(frames)).collect()
    }
}

fn taxels(skin: &SkinLayout) -> u32 {
    u32::try_from(skin.taxels()).unwrap_or(u32::MAX)
}

/// Size of the largest scene or readout profile that is read, bytes. The limit keeps parsing small, because a parsed
/// file takes some hundred times its size. The seeds of 100,000 taxels fill 1 MB; larger skins name a file of seeds.
pub const MAX_TOML_BYTES: u64 = 1 << 21;

impl ProfileFile {
    /// The file that `readout` names, in `folder`; `None` when it is the name of a profile.
    fn of(readout: &str, folder: &Path) -> Result<Option<Self>, ChainError> {
        if Path::new(readout).extension().is_none_or(|e| e != "toml") {
            return Ok(None);
        }
        let path = folder.join(readout);
        match spts_input::read_text(&path, MAX_TOML_BYTES) {
            Ok(text) => Ok(Some(Self { path, text })),
            Err(error) => Err(ChainError::Io {
                path,
                source: error.into(),
            }),
        }
    }
}

/// `profile` with the `faults` of a scene added to its own, for a skin of `taxels` taxels.
fn with_faults(mut profile: Profile, faults: &[toml::Table], taxels: u32) -> Result<Profile, ChainError> {
    let own = profile.faults.len();
    for (index, fault) in faults.iter().enumerate() {
        let fault = fault.clone().try_into::<FaultConfig>();
        let refused = |message: &str| ChainError::Fault(in_section(&format!("faults[{index}]"), message));
        profile.faults.push(fault.map_err(|e| refused(&explain_toml(&e)))?);
        profile.validate(taxels).map_err(|error| {
            // its place in the scene, not behind the profile's own faults
            let message = error.to_string();
            let (found, meant) = (format!("faults[{}]", own + index), format!("faults[{index}]"));
            ChainError::Fault(message.replacen(&found, &meant, 1))
        })?;
    }
    Ok(profile)
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

    /// Taxels differ between two sessions of one skin by the factor that `session_log_sd` says, and otherwise not at
    /// all.
    #[test]
    fn a_session_has_its_own_spread() {
        let frames = [pressed(0.0), pressed(1.0)];
        let maps = |log_sd: f64, session| {
            let config = ChainConfig {
                transducer_parameters: [("session_log_sd".to_owned(), log_sd.into())].into_iter().collect(),
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
