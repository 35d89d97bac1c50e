//! Estimates the gains of a skin's taxels from raster presses of objects that the simulation knows, or under known
//! pressures.

use super::statistics::middle;
use super::{CalibrationStudy, GainPlane, SessionEstimates, read};
use serde::Serialize;
use spts::chain::{ChainConfig, SkinSession};
use spts::data::SessionSet;
use spts::progress::Progress;
use spts::session::Event;
use spts_contact::objects::OBJECTS;
use spts_eval::training::{BAND_SD, GainCheck, SkinGains, Skins, TrainingPresses, templates};
use spts_eval::{ScoredSession, Source};
use spts_input::Refusal;
use spts_models::{Mounting, Streams, TaxelGains, VelostatConfig};
use spts_recon::Matrix;
use spts_recon::classify::Library;
use spts_recon::statistics::mean;
use std::path::Path;

/// First and last press of a compressive session that tell what its mounting changes: none that is scored where there
/// are fifteen or more.
const MOUNTED_PRESSES: (usize, usize) = (1, 5);
/// Time for which a pressure that is known has acted, s: creep is over for the most part.
const PRESSED_S: f64 = 0.5;
/// Simulated presses of every object: they differ by the arm's repeatability alone.
const PRESSES: usize = 4;

/// Settings of `spts calibrate --skin`, which estimates the gains of a skin's taxels.
#[derive(Debug, Clone, Copy)]
pub struct SkinStudy {
    /// Seed of the simulated presses.
    pub seed: u64,
}

/// Results of `spts calibrate --skin`: the gains of a skin's taxels, and how well they predict objects that they were
/// not estimated from.
#[derive(Debug, Clone, Serialize)]
pub struct SkinReport {
    /// Rows and columns.
    pub shape: [usize; 2],
    /// Posterior of the gains, and the standard deviations of the random effects.
    #[serde(flatten)]
    pub skin: SkinGains,
    /// Sessions from which the mounting is estimated. Empty if no session has both recordings; the transducer's default
    /// is then used.
    pub mountings: Vec<Remounted>,
    /// Sessions in which all presses are scored, so that scored presses had to be used.
    pub scored: Vec<String>,
    /// For every object, how well it is predicted with the gains estimated from the other objects.
    pub objects: Vec<ObjectCheck>,
}

/// Change of the gains by mounting the skin, from two sessions with one object.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Remounted {
    /// Session.
    pub session: String,
    /// Standard deviation of the logarithm of a taxel's gain in one session, about the plane if there is one.
    pub log_sd: f64,
    /// The plane in the logarithm of the ratio of the two sessions' gains; `None` with fewer than six loaded taxels.
    pub plane: Option<GainPlane>,
}

/// A simulated image compared with that of the skin, without and with the gains estimated from other objects.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObjectCheck {
    /// Object.
    pub object: String,
    /// The comparison.
    #[serde(flatten)]
    pub check: GainCheck,
}

impl SkinStudy {
    /// Fits the gains to the recordings in `root`. Scored raster presses are used only if there are no others.
    ///
    /// # Errors
    /// [`Refusal`] if the recordings are not usable, or neither the simulation knows one of their objects nor the
    /// sessions have pressures.
    pub fn run(&self, root: &Path, progress: &dyn Progress) -> Result<SkinReport, Refusal> {
        let source = Source::open(root)?;
        if source.sessions.iter().all(|s| s.raster.is_none()) {
            return Err(Refusal::new(format!(
                "gains of the skin: {}: no session of presses has a raster recording to fit them to",
                root.display()
            )));
        }
        let mountings = mountings(root, progress)?;
        let mounting = mounting(&mountings);
        let known = known_pressures(root, &source)?;
        let is_known = |s: &ScoredSession| s.raster.is_none() || known.iter().any(|known| known.label == s.label);
        let simulated = if source.sessions.iter().all(is_known) {
            Vec::new()
        } else {
            let skins = Skins { skins: PRESSES, ..Skins::median(source.layout) };
            progress.stage("simulating presses", Some(PRESSES * OBJECTS.len()));
            let simulated = skins.press(self.seed, &|| progress.step());
            progress.end();
            simulated.map_err(unknown_gains)?
        };
        let simulated = with_known(&simulated, &known, source.layout.taxels())?;
        let estimate = |used: &dyn Fn(&ScoredSession) -> bool| -> Result<SkinGains, Refusal> {
            let skin = without_offsets(&images(&source.sessions, used)?, &known)?;
            SkinGains::estimate(&skin, &simulated, &source.layout, mounting).map_err(unknown_gains)
        };
        let mut objects = Vec::new();
        for session in source.sessions.iter().filter(|s| s.raster.is_some() && !s.again) {
            // the only object has no others
            let Ok(others) = estimate(&|s| s.object != session.object) else {
                continue;
            };
            let own = without_offsets(&images(&source.sessions, &|s| s.object == session.object)?, &known)?;
            let Some(k) = simulated.labels().iter().position(|l| *l == session.label) else {
                continue;
            };
            if let Some(check) = others.check(&own.images().column(0), &simulated.images().column(k), &source.layout) {
                objects.push(ObjectCheck { object: session.object.clone(), check });
            }
        }
        Ok(SkinReport {
            shape: [source.layout.rows(), source.layout.cols()],
            skin: estimate(&|_| true)?,
            mountings,
            scored: source.sessions.iter().filter(|s| falls_back(s)).map(|s| s.name.clone()).collect(),
            objects,
        })
    }
}

/// An object whose pressures are known.
struct Known {
    label: usize,
    /// Sum over its presses of the conductances at gain 1, S.
    image: Vec<f64>,
    /// Mean output of taxels without a pressure in the raster scans, V: cells that are not selected do not put out 0 V
    /// exactly, which adds the same to every taxel.
    offset_v: f64,
    /// Number of samples that this is the mean of.
    samples: f64,
}

/// The objects that the simulation does not know, but whose pressures the sessions in `root` have.
fn known_pressures(root: &Path, source: &Source) -> Result<Vec<Known>, Refusal> {
    let median = [("spread_log_sd".to_owned(), 0.0.into()), ("session_log_sd".to_owned(), 0.0.into())];
    let config = ChainConfig { transducer_parameters: median.into_iter().collect(), ..ChainConfig::default() };
    let mut known: Vec<Known> = Vec::new();
    for session in SessionSet::open(root)?.sessions.iter().filter(|session| session.event == Event::Press) {
        let is_simulated = OBJECTS.iter().any(|object| object.name == session.object);
        let scored = source.sessions.iter().find(|scored| scored.name == session.name);
        let (Some(scored), Some(raster), false) = (scored, &session.raster, is_simulated) else { continue };
        if raster.recording.info().unit.is_some() {
            return Err(Refusal::new(format!(
                "session {:?}: frames of another skin, which no readout has measured; `spts wire` records them",
                session.name
            ))
            .at(root.display()));
        }
        let mut skin = SkinSession::new(&config, &source.layout, Streams::new(0), 0)?;
        let mut image = vec![0.0; source.layout.taxels()];
        let mut offsets_v = Vec::new();
        for (press, facts) in raster.presses.iter().enumerate().skip(raster.conditioning) {
            let Some(pressure) = &facts.pressure else { continue };
            let conductance = skin.hold(pressure, PRESSED_S);
            skin.rest();
            image.iter_mut().zip(conductance.values()).for_each(|(total, g)| *total += g);
            let hold = &scored.raster_protocol;
            let frames = hold.first_frame..(hold.first_frame + hold.frames).min(raster.recording.frames());
            let volts = frames.flat_map(|frame| raster.recording.volts(press, frame).iter().zip(pressure.values()));
            offsets_v.extend(volts.filter(|(v, p)| **p <= 0.0 && v.is_finite()).map(|(v, _)| *v));
        }
        let (offset_v, samples) = (mean(&offsets_v).unwrap_or(0.0), offsets_v.len() as f64);
        match known.iter_mut().find(|known| known.label == scored.label) {
            // several sessions of one object: the mean of all their presses
            Some(before) => {
                before.image.iter_mut().zip(&image).for_each(|(total, g)| *total += g);
                let all = before.samples + samples;
                before.offset_v += samples / all.max(1.0) * (offset_v - before.offset_v);
                before.samples = all;
            }
            None if image.iter().any(|g| *g > 0.0) => {
                known.push(Known { label: scored.label, image, offset_v, samples })
            }
            None => {}
        }
    }
    Ok(known)
}

/// The images of the `simulated` sessions and the `known` ones, of `taxels` taxels each.
fn with_known(simulated: &[ScoredSession], known: &[Known], taxels: usize) -> Result<Library, Refusal> {
    let mut labels: Vec<usize> = known.iter().map(|known| known.label).collect();
    let mut columns: Vec<Vec<f64>> = known.iter().map(|known| known.image.clone()).collect();
    if !simulated.is_empty() {
        let library = images(simulated, &|_| true)?;
        labels.extend(library.labels());
        columns.extend((0..library.labels().len()).map(|k| library.images().column(k)));
    }
    Library::new(&Matrix::from_column_slices(taxels, &columns), &labels).map_err(unknown_gains)
}

/// The images without the offsets of the objects whose pressures are known.
fn without_offsets(images: &Library, known: &[Known]) -> Result<Library, Refusal> {
    let column = |(k, label): (usize, &usize)| {
        let offset_v = known.iter().find(|known| known.label == *label).map_or(0.0, |known| known.offset_v);
        images.images().column(k).iter().map(|v| (v - offset_v).max(0.0)).collect()
    };
    let columns: Vec<Vec<f64>> = images.labels().iter().enumerate().map(column).collect();
    let matrix = Matrix::from_column_slices(images.images().nrows(), &columns);
    Library::new(&matrix, images.labels()).map_err(unknown_gains)
}

fn unknown_gains(error: impl std::error::Error + Send + Sync + 'static) -> Refusal {
    Refusal::from_error(error).at("gains of the skin")
}

/// Mean raster images of the sessions that are `used`, from presses that are not scored where there are any.
fn images(sessions: &[ScoredSession], used: &dyn Fn(&ScoredSession) -> bool) -> Result<Library, Refusal> {
    let used = sessions.iter().filter(|s| used(s));
    let presses: Vec<TrainingPresses<'_>> = used.filter_map(presses).collect();
    templates(&presses).map_err(unknown_gains)
}

/// Whether `session` has raster presses, and all of them are scored.
fn falls_back(session: &ScoredSession) -> bool {
    TrainingPresses::unscored(session).is_some_and(|t| t.is_empty())
}

/// Presses of `session` that gains are fitted to.
fn presses(session: &ScoredSession) -> Option<TrainingPresses<'_>> {
    let unscored = TrainingPresses::unscored(session).filter(|t| !t.is_empty());
    unscored.or_else(|| TrainingPresses::all(session))
}

/// What a mounting changes, from every session with both recordings of one object.
fn mountings(root: &Path, progress: &dyn Progress) -> Result<Vec<Remounted>, Refusal> {
    let study = CalibrationStudy { session: None, presses: Some(MOUNTED_PRESSES) };
    // the recordings in `root` have been read before: those that are refused now are none to fit a readout to
    let Ok(pairs) = read(root) else { return Ok(Vec::new()) };
    let sessions = study.fit_all(pairs, progress)?.sessions;
    let mounting = |session: SessionEstimates| {
        let both = session.gains?;
        Some(Remounted {
            session: session.session,
            // two sessions differ by √2 of it
            log_sd: both.plane.map_or(both.log_sd, |plane| plane.log_sd) / std::f64::consts::SQRT_2,
            plane: both.plane,
        })
    };
    Ok(sessions.into_iter().filter_map(mounting).collect())
}

/// What a mounting changes by `sessions`: the median of their deviations, and the τ at which their slopes, each
/// ~ N(0, 2τ² + its error²), are most likely. The transducer's defaults stand in for what no session tells.
fn mounting(sessions: &[Remounted]) -> Mounting {
    let unknown = VelostatConfig::default().mounting();
    let logs: Vec<f64> = sessions.iter().map(|m| m.log_sd).collect();
    let planes = sessions.iter().filter_map(|m| m.plane);
    let slopes: Vec<(f64, f64)> = planes.flat_map(|p| p.slopes.into_iter().zip(p.standard_errors)).collect();
    let unlikely = |tilt: f64| -> f64 {
        let variance = |error: f64| 2.0 * tilt * tilt + error * error;
        slopes.iter().map(|&(slope, error)| variance(error).ln() + slope * slope / variance(error)).sum()
    };
    let tilts = (0..=200).map(|k| f64::from(k) / 100.0);
    let likeliest = tilts.min_by(|a, b| unlikely(*a).total_cmp(&unlikely(*b)));
    Mounting {
        log_sd: if logs.is_empty() { unknown.log_sd } else { middle(&logs) },
        tilt_log_sd: likeliest.filter(|_| !slopes.is_empty()).unwrap_or(unknown.tilt_log_sd),
    }
}

impl SkinReport {
    /// The gains as TOML, for scenes, specifications of data sets, `spts score --learn-from` and `spts decode --skin`.
    ///
    /// # Errors
    /// [`Refusal`], which no gains should cause.
    pub fn toml(&self) -> Result<String, Refusal> {
        let [rows, cols] = self.shape;
        let gains = TaxelGains { shape: Some(self.shape), ..self.skin.gains.clone() };
        let gains = toml::to_string(&gains).map_err(unknown_gains)?;
        Ok(format!(
            "# Gains of the taxels of a skin of {rows} x {cols} taxels, row by row: mean and standard deviation of their logarithms,\n\
             # and what a mounting changes. Objects in the raster presses that they are fitted to: {}; spread over the skin {:.3}, error of a\n\
             # simulated contact {:.3} (standard deviations of logarithms).\n{}{gains}",
            self.skin.fitted_objects,
            self.skin.spread_log_sd,
            self.skin.contact_log_sd,
            self.scored_text().map_or_else(String::new, |text| format!("# {text}\n")),
        ))
    }

    /// Text about sessions whose scored presses were used; `None` if there are none.
    pub fn scored_text(&self) -> Option<String> {
        (!self.scored.is_empty())
            .then(|| format!("fitted to presses that are scored, as there are no others: {}", self.scored.join(", ")))
    }

    /// Uncertainty of the gains, one factor a taxel, row by row: with a probability of 90 %, the true gain lies between
    /// the found one divided by the factor and the found one times the factor.
    pub fn bands(&self) -> impl Iterator<Item = f64> + '_ {
        self.skin.gains.log_sd.iter().map(|sd| (BAND_SD * sd).exp())
    }
}
