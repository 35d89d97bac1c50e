//! The skin of a press, and the recordings of one press or drop on it.

use super::touch::{Held, Moving, Touch, sum};
use crate::spec::{FramePress, RecordKind, Spec, whole};
use rand::RngExt as _;
use rand::seq::{IndexedRandom as _, index::sample};
use spts::chain::SkinSession;
use spts::data::{Courses, FrameLaw};
use spts::{Chain, Refusal};
use spts_circuit::{ConductanceSource, Constant, FAULTS, Interpolated, Mode, Readout};
use spts_models::{ConductanceMap, PressureMap};

/// Bits of a specimen's seed, so that a double holds it.
const SEED_BITS: u32 = 53;

/// Skin number `number` of a data set, in one session.
pub(crate) struct Skin {
    pub(crate) number: u64,
    /// Seed of the specimen.
    pub(crate) seed: u64,
    /// The skin before the first press.
    pub(crate) fresh: SkinSession,
    pub(crate) compressive: Readout,
    pub(crate) raster: Readout,
    /// Largest output of the amplifier in each mode, V: compressive, raster.
    pub(crate) rails_v: [Option<f64>; 2],
    /// Number of faulty cells.
    pub(crate) faults: usize,
}

impl Skin {
    pub(crate) fn new(spec: &Spec, number: u64) -> Result<Self, Refusal> {
        let streams = spec.streams();
        let seed = match &spec.config().skin.seed {
            Some(seed) => whole(seed.value(streams, "skin.seed", number)) as u64,
            None => streams.rng("skin.seed", number).random::<u64>() >> (u64::BITS - SEED_BITS),
        };
        let faults = faults(spec, number);
        let chain = Chain::new(&spec.chain_config(number, &faults)?, spec.skin(), seed, spec.folder())?;
        let rail_v = |mode| chain.profile().rail_v(mode).map_err(|error| error.at("readout"));
        Ok(Self {
            number,
            seed,
            fresh: chain.skin_session(number),
            compressive: chain.readout(Mode::Compressive, number)?,
            raster: chain.readout(Mode::Raster, number)?,
            rails_v: [rail_v(Mode::Compressive)?, rail_v(Mode::Raster)?],
            faults: faults.len(),
        })
    }
}

/// The faulty cells of skin `number`, each another one.
fn faults(spec: &Spec, number: u64) -> Vec<toml::Table> {
    let (config, streams) = (&spec.config().faults, spec.streams());
    let count = whole(config.count.value(streams, "faults.count", number));
    if count == 0 {
        return Vec::new();
    }
    let mut rng = streams.rng("faults", number);
    let mut taxels = sample(&mut rng, spec.skin().taxels(), count).into_vec();
    taxels.sort_unstable();
    let all: Vec<&str> = match &config.names {
        Some(names) => names.iter().map(String::as_str).collect(),
        None => FAULTS.iter().map(|(name, _)| *name).collect(),
    };
    let fault = |taxel: usize| {
        let name = all.choose(&mut rng).copied().unwrap_or_default();
        let taxel = i64::try_from(taxel).unwrap_or(i64::MAX);
        [("name".to_owned(), name.into()), ("taxel".to_owned(), taxel.into())].into_iter().collect()
    };
    taxels.into_iter().map(fault).collect()
}

/// Frames between loading the seeds and the first press, and the least from press to press, as on the device.
const LEAD_FRAMES: u64 = 243;
const PRESS_FRAMES: u64 = 1057;
/// Frames that are not recorded between two presses.
const GAP_FRAMES: u64 = 57;
/// Measurements from the start of a press to the first window of a hold, least and most: the published hold.
const HOLD_MEASUREMENTS: std::ops::Range<u64> = 50_000..70_000;

/// One press or drop and its recordings.
pub(crate) struct Press {
    pub(crate) number: u64,
    pub(super) touches: Vec<Touch>,
    /// Ground truth of each window, or one entry for all of them.
    states: Vec<State>,
    /// The samples of all windows, one after the other.
    pub(super) volts: Vec<f64>,
    /// Row of Φ at the first measurement.
    pub(super) first_row: u64,
    /// Time from the touch to the first measurement, s.
    pub(super) start_s: f64,
    pub(crate) presses_before: usize,
}

/// The skin in a window.
pub(super) struct State {
    pub(super) pressure: PressureMap,
    pub(super) conductance: ConductanceMap,
    /// Raster scan, V; empty where none is recorded.
    pub(super) image: Vec<f64>,
    /// Height of every object's origin, m.
    pub(super) heights_m: Vec<f64>,
}

impl Press {
    /// The skin in window number `window`.
    pub(super) fn state(&self, window: usize) -> &State {
        &self.states[window.min(self.states.len() - 1)]
    }

    /// Press number `number`, in which the objects `held` lie on `skin`.
    pub(super) fn of_held(spec: &Spec, skin: &mut Skin, number: u64, held: Vec<Held>) -> Result<Self, Refusal> {
        let (config, timing) = (spec.config(), spec.timing());
        let streams = spec.streams();
        let pressure = sum(spec, &held, |object| &object.pressure);
        let felt = sum(spec, &held, |object| &object.electrode_pressure);
        let hold_s = config.press.hold_s.value(streams, "press.hold_s", number);
        let before = presses_before(spec, number);
        let mut sheet = skin.fresh.clone();
        for _press in 0..before {
            sheet.hold(&felt, hold_s);
            sheet.rest();
        }
        let block = Block::of(spec, number);
        let heights_m: Vec<f64> = held.iter().map(|object| object.height_m).collect();
        let mut conductance = sheet.hold(&felt, hold_s);
        let (mut states, mut volts) = (Vec::new(), Vec::new());
        for window in 0..block.parts() {
            if window > 0 {
                let since = timing.row_of(window) - timing.row_of(window - 1);
                conductance = sheet.hold(&felt, since as f64 / timing.rate_hz);
            }
            let mut source = Constant::new(conductance.clone())?;
            let (samples, image) = block.record(spec, skin, window, &mut source)?;
            volts.extend(samples);
            states.push(State {
                pressure: pressure.clone(),
                conductance: conductance.clone(),
                image,
                heights_m: heights_m.clone(),
            });
        }
        Ok(Self {
            number,
            touches: held.into_iter().map(|object| object.touch).collect(),
            states,
            volts,
            first_row: block.first_row,
            start_s: hold_s,
            presses_before: before,
        })
    }

    /// Press number `number`, in which `moving` meets `skin`.
    pub(super) fn of_moving(spec: &Spec, skin: &mut Skin, number: u64, moving: Moving) -> Result<Self, Refusal> {
        let timing = spec.timing();
        let before = presses_before(spec, number);
        let mut sheet = skin.fresh.clone();
        for _press in 0..before {
            sheet.press(&moving.frames);
        }
        let mut conductance = sheet.conductance(&moving.frames)?;
        let block = Block::of(spec, number);
        let start_s = match timing.what {
            RecordKind::Hold => spec.config().press.hold_s.value(spec.streams(), "press.hold_s", number),
            RecordKind::Course | RecordKind::Drop => -timing.before_s,
        };
        let windows = followed(spec, skin, &block, moving.touch_s + start_s, &mut conductance, |time_s| {
            let (pressure, height_m) = moving.at(time_s);
            (pressure, vec![height_m])
        });
        let (states, volts) = windows?;
        let first_row = block.first_row;
        Ok(Self { number, touches: vec![moving.touch], states, volts, first_row, start_s, presses_before: before })
    }

    /// Press number `number`, in which the skin shows `frames`, whose values become conductances by `law`.
    pub(super) fn of_frames(
        spec: &Spec,
        skin: &mut Skin,
        number: u64,
        (frames, law): (&FramePress, FrameLaw),
    ) -> Result<Self, Refusal> {
        let FramePress { courses, press } = frames;
        let timing = spec.timing();
        let before = presses_before(spec, number);
        let mut sheet = skin.fresh.clone();
        for _press in 0..before {
            courses.played(*press, &mut sheet, law);
        }
        let mut conductance = courses.played(*press, &mut sheet, law).source()?;
        let block = Block::of(spec, number);
        let start_s = match timing.what {
            RecordKind::Hold => courses.since_touch_s(courses.hold().start),
            RecordKind::Course | RecordKind::Drop => -timing.before_s,
        };
        let [rows, cols] = [spec.skin().rows(), spec.skin().cols()];
        let touch_s = Courses::LEAD_S + courses.touch() as f64 * courses.frame_s();
        let windows = followed(spec, skin, &block, touch_s + start_s, &mut conductance, |time_s| {
            let pressure = courses.pressure_at(*press, time_s - Courses::LEAD_S);
            let unknown = || PressureMap::from_values(rows, cols, vec![f64::NAN; rows * cols]);
            (pressure.unwrap_or_else(unknown), vec![f64::NAN])
        });
        let (states, volts) = windows?;
        let first_row = block.first_row;
        Ok(Self { number, touches: vec![Touch::UNKNOWN], states, volts, first_row, start_s, presses_before: before })
    }
}

/// States and samples of the windows of `block`, the first from `start_s` on, while the skin conducts as `conductance`
/// says; `truth` gives the pressure and the heights of the objects at a time.
fn followed(
    spec: &Spec,
    skin: &mut Skin,
    block: &Block,
    start_s: f64,
    conductance: &mut Interpolated,
    truth: impl Fn(f64) -> (PressureMap, Vec<f64>),
) -> Result<(Vec<State>, Vec<f64>), Refusal> {
    let timing = spec.timing();
    let half_s = 0.5 * spec.config().record.measurements as f64 / timing.rate_hz;
    let (mut states, mut volts) = (Vec::new(), Vec::new());
    for window in 0..block.parts() {
        let time_s = start_s + timing.row_of(window) as f64 / timing.rate_hz;
        let mut source = conductance.starting_at(time_s);
        let (samples, image) = block.record(spec, skin, window, &mut source)?;
        volts.extend(samples);
        // the truth of a window is that of its middle
        let (pressure, heights_m) = truth(time_s + half_s);
        states.push(State { pressure, conductance: conductance.at(time_s + half_s), image, heights_m });
    }
    Ok((states, volts))
}

fn presses_before(spec: &Spec, number: u64) -> usize {
    let presses = &spec.config().skin.presses_before;
    whole(presses.value(spec.streams(), "skin.presses_before", number))
}

/// Where the recordings of a press lie in those of its skin.
struct Block {
    number: u64,
    first_row: u64,
    /// Whether the windows are consecutive and recorded together.
    together: bool,
    windows: u64,
}

impl Block {
    fn of(spec: &Spec, number: u64) -> Self {
        let (timing, taxels) = (spec.timing(), spec.skin().taxels() as u64);
        let number_on_skin = number % (spec.rows_per_skin() / timing.windows);
        let start = match timing.what {
            RecordKind::Hold => spec.streams().rng("hold", number).random_range(HOLD_MEASUREMENTS),
            RecordKind::Course | RecordKind::Drop => 0,
        };
        let longest = match timing.what {
            RecordKind::Hold => HOLD_MEASUREMENTS.end,
            RecordKind::Course | RecordKind::Drop => 0,
        } + timing.span();
        let frames = PRESS_FRAMES.max(longest.div_ceil(taxels) + GAP_FRAMES);
        Self {
            number: number_on_skin,
            first_row: (LEAD_FRAMES + frames * number_on_skin) * taxels + start,
            together: timing.interval_s.is_none() && !spec.is_moving(),
            windows: timing.windows,
        }
    }

    /// Recordings that make the windows of the press.
    fn parts(&self) -> u64 {
        if self.together { 1 } else { self.windows }
    }

    /// Records part number `part` of a press, whose conductance is that of `source` from time 0 on: samples and image.
    fn record(
        &self,
        spec: &Spec,
        skin: &mut Skin,
        part: u64,
        source: &mut dyn ConductanceSource,
    ) -> Result<(Vec<f64>, Vec<f64>), Refusal> {
        let record = &spec.config().record;
        let (timing, taxels) = (spec.timing(), spec.skin().taxels());
        let (block, row) = (self.number * self.parts() + part, self.first_row + timing.row_of(part));
        let windows = if self.together { whole(self.windows as f64) } else { 1 };
        skin.compressive.seek_row(block, row);
        let volts = skin.compressive.measure(source, windows * record.measurements)?;
        let image = if record.raster {
            skin.raster.seek(block, row / taxels as u64);
            skin.raster.measure(source, taxels)?
        } else {
            Vec::new()
        };
        Ok((volts, image))
    }
}
