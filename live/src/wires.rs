//! The wires that are measured, and the shelf of what decoders and designed rows take time to make.

use crate::settings::{MEASUREMENTS, NOISES, Settings};
use spts::chain::RowsConfig;
use spts::{Chain, ChainConfig, Mode, Profile, Refusal, Wire};
use spts_circuit::Patterns;
use spts_eval::algorithm::Trained;
use spts_eval::decoders::{DecoderSpec, Needs};
use spts_eval::training::TrainingData;
use spts_eval::{Press, PressRows};
use spts_models::{PressureMap, SkinLayout, Streams};
use spts_recon::Matrix;
use spts_recon::recover::ImagePrior;
use spts_recon::rows::{Designer, Expected, RowTask, Tolerances};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// Measurements of every update: those that are decoded come first.
const RECORDED: usize = MEASUREMENTS[1];

/// Measurements before those that are shown, so that the amplifier knows the one before.
const SETTLING: usize = 8;

/// A wire with one kind of rows.
pub(crate) struct Line {
    /// Name of the rows.
    pub(crate) rows: &'static str,
    wire: Wire,
    idle_v: f64,
    sample_rate_hz: f64,
    /// Time that the skin has felt so far, s.
    felt_s: f64,
    /// Measurements in that time, those that nobody looks at included.
    passed: u64,
    recorded: Option<Press>,
    volts: Vec<f64>,
}

impl Line {
    fn new(rows: &'static str, chain: &Chain) -> Result<Self, Refusal> {
        let wire = Wire::new(chain, 0)?;
        Ok(Self {
            rows,
            idle_v: wire.idle_v(Mode::Compressive),
            sample_rate_hz: chain.sample_rate_hz(),
            wire,
            felt_s: 0.0,
            passed: 0,
            recorded: None,
            volts: Vec::new(),
        })
    }

    /// Lets the skin feel the pressure for `dt_s`, and measures it.
    pub(crate) fn record(&mut self, electrode_pressure: &PressureMap, dt_s: f64) -> Result<(), Refusal> {
        self.wire.feel(electrode_pressure, dt_s)?;
        self.catch_up(dt_s);
        self.wire.measure(Mode::Compressive, &mut [0.0; SETTLING])?;
        let rows = PressRows::new(self.wire.rows(Mode::Compressive, RECORDED));
        self.volts.resize(RECORDED, 0.0);
        self.wire.measure(Mode::Compressive, &mut self.volts)?;
        self.passed += (SETTLING + RECORDED) as u64;
        self.recorded = Some(Press::on(Arc::new(rows), self.volts.clone(), self.idle_v));
        Ok(())
    }

    /// Lets the measurements pass that the wire takes in `dt_s` and nobody looks at, in whole frames.
    fn catch_up(&mut self, dt_s: f64) {
        self.felt_s += dt_s;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "casts saturate")]
        let due = (self.felt_s * self.sample_rate_hz) as u64;
        let frame = self.wire.info(Mode::Compressive).measurements_per_frame as u64;
        let frames = (due / frame).saturating_sub(self.passed / frame);
        if frames > 0 {
            self.wire.pass(Mode::Compressive, frames);
            self.passed = (self.passed / frame + frames) * frame;
        }
    }

    /// What was measured last.
    pub(crate) fn recorded(&self) -> Option<&Press> {
        self.recorded.as_ref()
    }

    /// Output of the amplifier, V.
    pub(crate) fn volts(&self) -> &[f64] {
        &self.volts
    }

    pub(crate) fn idle_v(&self) -> f64 {
        self.idle_v
    }

    pub(crate) fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }
}

/// The wires that `settings` need, in the order of the panels, each of the same specimen of the skin. Wires that are
/// `there` go on. Those whose rows are not designed yet are left out, and then the second value is false.
pub(crate) fn wires(
    settings: &Settings,
    shelf: &Arc<Shelf>,
    seed: u64,
    mut there: Vec<Line>,
) -> Result<(Vec<Line>, bool), Refusal> {
    let mut lines: Vec<Line> = Vec::new();
    let mut complete = true;
    for panel in &settings.panels {
        let name = panel.rows_name();
        if lines.iter().any(|line| line.rows == name) {
            continue;
        }
        if let Some(k) = there.iter().position(|line| line.rows == name) {
            lines.push(there.swap_remove(k));
            continue;
        }
        let patterns = match panel.rows.map(|designer| shelf.design(designer)) {
            None => None,
            Some(Made::Ready(design)) => Some(first_rows(&design, settings.measurements)?),
            Some(Made::Waiting) => {
                complete = false;
                continue;
            }
            Some(Made::Refused(_)) => continue,
        };
        lines.push(Line::new(name, &chain(settings, patterns, shelf, seed)?)?);
    }
    Ok((lines, complete))
}

fn chain(settings: &Settings, patterns: Option<Patterns>, shelf: &Shelf, seed: u64) -> Result<Chain, Refusal> {
    let fault = |(taxel, name): (&u32, &&'static str)| -> toml::Table {
        let entries = [("name", toml::Value::from(*name)), ("taxel", i64::from(*taxel).into())];
        entries.map(|(key, value)| (key.to_owned(), value)).into_iter().collect()
    };
    let config = ChainConfig {
        readout: Some(settings.readout.to_owned()),
        rows: RowsConfig { patterns, ..RowsConfig::default() },
        faults: settings.faults.iter().map(fault).collect(),
        ..ChainConfig::default()
    };
    let chain = Chain::new(&config, shelf.layout(), seed, Path::new(""))?;
    let louder = with_noise(chain.profile().clone(), settings.noise);
    chain.with_profile(louder)
}

/// `profile` with `factor` times the noise.
fn with_noise(mut profile: Profile, factor: f64) -> Profile {
    for (effect, parameter) in NOISES {
        let value = profile.compressive.get_mut(effect).and_then(|effect| effect.get_mut(parameter));
        match value {
            Some(toml::Value::Float(value)) => *value *= factor,
            Some(toml::Value::Array(ends)) => {
                for end in ends {
                    if let toml::Value::Float(value) = end {
                        *value *= factor;
                    }
                }
            }
            _ => {}
        }
    }
    profile
}

/// What decoders and designers know is the same for every seed of the skin: the root of its random numbers.
const SEED: u64 = 0;

/// A decoder that has learned.
pub(crate) type Decoder = Box<dyn Trained>;
/// Rows in the order of their worth.
pub(crate) type Design = Matrix;

/// Something that takes time to make.
pub(crate) enum Made<T> {
    /// It is being made.
    Waiting,
    Ready(Arc<T>),
    /// Why it cannot be made.
    Refused(String),
}

/// What has been asked for so far, by name.
type ByName<T> = Mutex<BTreeMap<&'static str, Made<T>>>;

impl<T> Clone for Made<T> {
    fn clone(&self) -> Self {
        match self {
            Self::Waiting => Self::Waiting,
            Self::Ready(made) => Self::Ready(Arc::clone(made)),
            Self::Refused(reason) => Self::Refused(reason.clone()),
        }
    }
}

/// Decoders and designed rows for the published layout, shared by all sessions. Each is made once, when it is first
/// asked for, on a thread of its own.
#[derive(Default)]
pub struct Shelf {
    layout: SkinLayout,
    decoders: ByName<Decoder>,
    designs: ByName<Design>,
    /// One thing at a time is made.
    making: Mutex<()>,
    outlines: OnceLock<Result<TrainingData, String>>,
    shapes: OnceLock<Result<TrainingData, String>>,
}

impl Shelf {
    /// An empty one.
    pub fn new() -> Self {
        Self::default()
    }

    /// The skin that everything is for.
    pub fn layout(&self) -> &SkinLayout {
        &self.layout
    }

    /// The decoder, as far as it is.
    pub(crate) fn decoder(self: &Arc<Self>, spec: &'static DecoderSpec) -> Made<Decoder> {
        self.get(
            |shelf| &shelf.decoders,
            spec.name,
            move |shelf| {
                let data = match spec.needs {
                    Needs::Shapes => shelf.shapes()?,
                    _ => shelf.outlines()?,
                };
                (spec.train)(data).map_err(|e| e.to_string())
            },
        )
    }

    /// As many rows of `designer` as the largest M, as far as they are.
    pub(crate) fn design(self: &Arc<Self>, designer: &'static Designer) -> Made<Design> {
        self.get(
            |shelf| &shelf.designs,
            designer.name,
            move |shelf| {
                let prior = shelf.outlines()?.prior(ImagePrior::UNSEEN).map_err(|e| e.to_string())?;
                let shape = [shelf.layout.rows(), shelf.layout.cols()];
                let expected = Expected::like(&prior, shape, Tolerances::default());
                let expected = expected.map_err(|e| e.to_string())?;
                let task = RowTask::new(MEASUREMENTS[1].min(shelf.layout.taxels()), &expected);
                (designer.build)().design(&task).map_err(|e| e.to_string())
            },
        )
    }

    /// What is on `shelf` under `name`; begins to make it when nothing is.
    fn get<T: Send + Sync + 'static>(
        self: &Arc<Self>,
        table: fn(&Self) -> &ByName<T>,
        name: &'static str,
        make: impl FnOnce(&Self) -> Result<T, String> + Send + 'static,
    ) -> Made<T> {
        let mut known = locked(table(self));
        if let Some(made) = known.get(name) {
            return made.clone();
        }
        let shelf = Arc::clone(self);
        let started = std::thread::Builder::new().name(format!("make {name}")).spawn(move || {
            let one = locked(&shelf.making);
            // pages wait for it: it is refused, too, when it panics
            let made = catch_unwind(AssertUnwindSafe(|| make(&shelf)));
            drop(one);
            let made = match made {
                Ok(Ok(made)) => Made::Ready(Arc::new(made)),
                Ok(Err(reason)) => Made::Refused(reason),
                Err(_) => Made::Refused("an error of the program; its standard error says more".to_owned()),
            };
            locked(table(&shelf)).insert(name, made);
        });
        let made = match started {
            Ok(_) => Made::Waiting,
            Err(error) => Made::Refused(error.to_string()),
        };
        known.insert(name, made.clone());
        made
    }

    /// Random outlines, for priors and dictionary.
    fn outlines(&self) -> Result<&TrainingData, String> {
        let learn = || TrainingData::for_layout(&self.layout, Streams::new(SEED)).map_err(|e| e.to_string());
        self.outlines.get_or_init(learn).as_ref().map_err(String::clone)
    }

    /// Simulated shapes.
    fn shapes(&self) -> Result<&TrainingData, String> {
        let learn = || TrainingData::for_shapes(&self.layout, Streams::new(SEED)).map_err(|e| e.to_string());
        self.shapes.get_or_init(learn).as_ref().map_err(String::clone)
    }
}

/// The first `count` rows as a pattern that repeats.
pub(crate) fn first_rows(design: &Design, count: usize) -> Result<Patterns, Refusal> {
    let count = count.min(design.nrows());
    let patterns = Patterns::of_levels(count, &design.view().values()[..count * design.ncols()]);
    patterns.map_err(|e| e.at("message"))
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The wire's clock goes on with the skin's: a cell that loses 1 % of its output a second has lost a tenth of it
    /// after ten seconds of updates. The ideal readout has no noise, and both wires feel the same.
    #[test]
    fn a_drifting_cell_drifts_in_the_time_of_the_skin() {
        let shelf = Arc::new(Shelf::new());
        let line = |faulty: bool| {
            let mut settings = Settings::usual().unwrap();
            settings.panels[1].rows = None;
            settings.read_out("ideal", 1.0).unwrap();
            if faulty {
                settings.fault(44, Some("drifting"), 100).unwrap();
            }
            wires(&settings, &shelf, 3, Vec::new()).unwrap().0.swap_remove(0)
        };
        let mut pressure = PressureMap::zeros(10, 10);
        pressure.values_mut()[44] = 2e4;
        let [mut sound, mut drifting] = [line(false), line(true)];
        for _ in 0..400 {
            sound.record(&pressure, 0.025).unwrap();
            drifting.record(&pressure, 0.025).unwrap();
        }
        let size = |line: &Line| line.volts().iter().map(|v| v.abs()).sum::<f64>();
        let lost = 1.0 - size(&drifting) / size(&sound);
        // 2000 idle measurements come before, .03 s; a window begins within a frame, .0016 s, of its time
        assert!((0.0995..0.1010).contains(&lost), "{lost}");
    }

    /// The scatter of an untouched wire is the noise that was asked for, converter and late updates aside.
    #[test]
    fn the_factor_is_on_the_noise() {
        let shelf = Arc::new(Shelf::new());
        let sd = |noise: f64| {
            let mut settings = Settings::usual().unwrap();
            settings.panels[1].rows = None;
            settings.noise = noise;
            let (mut lines, complete) = wires(&settings, &shelf, 3, Vec::new()).unwrap();
            assert!(complete && lines.len() == 1);
            let mut squares = 0.0;
            for _ in 0..20 {
                lines[0].record(&PressureMap::zeros(10, 10), 0.025).unwrap();
                squares += lines[0].volts().iter().map(|v| (v - lines[0].idle_v()).powi(2)).sum::<f64>();
            }
            (squares / 2000.0).sqrt()
        };
        let (none, one, ten) = (sd(0.0), sd(1.0), sd(10.0));
        assert!(none < one && one < ten, "{none} {one} {ten}");
        // ten times as loud; a step of the converter, 63 mV, is a third of the loudest and all of the quiet ones
        assert!((3.0..11.0).contains(&(ten / one)), "{ten} / {one}");
    }
}
