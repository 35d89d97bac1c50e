//! Frames of any skin, recorded as a skin with one wire would.

use super::frames::Frames;
use crate::chain::{Acquisition, Chain, SkinSession, of_conductance};
use crate::provenance::{Provenance, combined_hash, hash_text};
use crate::session::{Event, PressFacts, Recorded, Session};
use spts_circuit::{FrameUnit, Interpolated, Mode};
use spts_input::Refusal;
use spts_models::{ConductanceMap, PressureMap, within};
use spts_recon::metrics::median;
use std::ops::Range;

/// Time in which nothing touches the skin before the frames of a press, s, and the last part of it, in which the first
/// frame comes.
const IDLE_S: f64 = 0.25;
const RISE_S: f64 = 1e-3;
/// Maps before the first frame: the untouched skin at the begin and at the end of that time.
const LEAD: usize = 2;
/// Time for which the reference pressure is held, s.
const REFERENCE_S: f64 = 0.5;
/// Share of its sum in the hold above which a frame is that of a touch.
const TOUCHED: f64 = 0.5;
/// Most samples of a recording: 1 GB of doubles.
const MOST_SAMPLES: f64 = (1 << 27) as f64;

/// A session of frames, recorded through a wire.
#[derive(Debug, Clone)]
pub struct WiredFrames {
    /// The session with both recordings.
    pub session: Session,
    /// Conductance of every taxel in the middle of the hold, S, press by press, without that of the untouched skin.
    pub touches: Vec<ConductanceMap>,
    /// What was assumed.
    pub notes: Vec<String>,
}

/// The frames of the presses of a session without the idle ones, not below 0. What conditions the skin is left out.
#[derive(Debug, Clone)]
pub struct Courses {
    shape: [usize; 4],
    values: Vec<f64>,
    frame_s: f64,
    hold_s: [f64; 2],
    unit: Option<FrameUnit>,
    touch: usize,
    /// What was assumed.
    pub notes: Vec<String>,
}

/// How the values of a frame become conductances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrameLaw {
    /// Pressures, Pa, on the transducer.
    Transducer,
    /// Times this, S.
    Scaled(f64),
}

/// One press of [`Courses`] on a skin, over time.
#[derive(Debug, Clone)]
pub struct PlayedPress {
    /// Times of the maps, s: two before the press, then one a frame.
    pub times_s: Vec<f64>,
    /// Conductance of every taxel at these times, S.
    pub maps: Vec<ConductanceMap>,
}

/// Records the frames of `frames`, a session with a raster scan, by the wire and by the scan of `chain`, whose random
/// numbers have the root `seed`. `number` tells sessions of one skin apart: each has noise of its own.
///
/// Every press begins with 0.25 s without a touch. Its idle frames are subtracted; what is then below 0 counts as no
/// touch, and a missing value as the one before. Pressures go through the transducer of the chain. Conductances are
/// taken as they are. Codes and relative values are scaled as [`Courses::law`] says, by `peak`: the pressure, Pa, and
/// the value that it stands for, the largest one of the session if `None`.
///
/// # Errors
/// [`Refusal`] if there are no frames, they are of another layout than the chain, or they are too long to record.
pub fn wired(
    frames: &Session,
    chain: &Chain,
    peak: (f64, Option<f64>),
    seed: u64,
    number: u64,
) -> Result<WiredFrames, Refusal> {
    let courses = Courses::of(frames)?;
    let [presses, _, rows, cols] = courses.shape();
    let layout = chain.skin();
    if [layout.rows(), layout.cols()] != [rows, cols] {
        return Err(Refusal::new(format!("frames of {rows} × {cols} taxels are not those of the skin")));
    }
    check_length(presses, courses.duration_s() * chain.sample_rate_hz())?;
    let mut notes = courses.notes.clone();
    let (law, said) = courses.law(chain, peak)?;
    notes.extend(said);
    let middle = LEAD + courses.middle();
    let record = |mode, number| -> Result<(Recorded, Vec<ConductanceMap>), Refusal> {
        let mut skin = chain.skin_session(number);
        let (mut facts, mut touches, mut sources) = (Vec::new(), Vec::new(), Vec::new());
        for press in 0..presses {
            let played = courses.played(press, &mut skin, law);
            facts.push(PressFacts {
                time_s: Some(played.times_s[middle]),
                pressure: courses.pressure(press, courses.middle()),
                conductance: Some(played.maps[middle].clone()),
                ..PressFacts::default()
            });
            touches.push(played.touch(middle));
            sources.push(played.source()?);
        }
        let acquisition = Acquisition::presses(mode, number);
        let recording = chain.record_sources(&mut sources, courses.duration_s(), &acquisition)?;
        Ok((Recorded { presses: facts, ..Recorded::new(recording) }, touches))
    };
    let sessions = [2 * number, 2 * number + 1];
    let scanned = record(Mode::Raster, sessions[0])?.0;
    let (compressive, touches) = record(Mode::Compressive, sessions[1])?;
    let blocks = frames.raster().map_or(&[][..], |raster| raster.blocks());
    let hashes = blocks.iter().map(|b| hash_text(&b.volts.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>()));
    let hash = combined_hash(&hashes.collect::<Vec<_>>());
    let session = Session {
        object: frames.object.clone(),
        hold_s: Some(courses.hold_s.map(|time_s| time_s + IDLE_S)),
        raster: Some(scanned),
        compressive: Some(compressive),
        provenance: Some(Provenance::new(seed, hash)),
        ..Session::new(&frames.name, frames.event)
    };
    Ok(WiredFrames { session, touches, notes })
}

/// Refuses more than [`MOST_SAMPLES`].
fn check_length(presses: usize, samples: f64) -> Result<(), Refusal> {
    if presses as f64 * samples <= MOST_SAMPLES {
        return Ok(());
    }
    let most = (MOST_SAMPLES / samples).floor();
    Err(Refusal::new(format!(
        "{presses} presses of {samples:.0} samples each are more than {MOST_SAMPLES:.0}; {most:.0} such presses fit"
    )))
}

impl Courses {
    /// The courses of `frames`, a session of presses with a raster scan. A missing value counts as the one before.
    ///
    /// # Errors
    /// [`Refusal`] if there are no frames, or nothing is above the idle ones.
    pub fn of(frames: &Session) -> Result<Self, Refusal> {
        if frames.event != Event::Press {
            return Err(Refusal::new("is no session of presses: frames of held contacts are needed"));
        }
        let all = Frames::of_session(frames)?;
        let Some(recorded) = &frames.raster else { return Err(Refusal::new("has no frames: `raster` is null")) };
        let raster = &recorded.recording;
        let [blocks, count, rows, cols] = all.shape();
        let (first, taxels) = (recorded.conditioning.min(blocks - 1), rows * cols);
        let mut notes = Vec::new();
        if raster.blocks().iter().any(|block| block.idle_frames.unwrap_or(0) == 0) {
            notes.push("the session names no idle frames: nothing is subtracted".to_owned());
        }
        let mut values = Vec::with_capacity((blocks - first) * count * taxels);
        for press in first..blocks {
            let own = &all.values()[press * count * taxels..][..count * taxels];
            let idle = raster.blocks()[press].idle_frames.unwrap_or(0).min(count);
            let untouched = |taxel: usize| {
                let values: Vec<f64> = (0..idle).map(|k| own[k * taxels + taxel]).filter(|v| v.is_finite()).collect();
                if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / values.len() as f64 }
            };
            let mut last = vec![0.0; taxels];
            let idle: Vec<f64> = (0..taxels).map(untouched).collect();
            for frame in own.chunks_exact(taxels) {
                for ((last, value), idle) in last.iter_mut().zip(frame).zip(&idle) {
                    if value.is_finite() {
                        *last = (value - idle).max(0.0);
                    }
                }
                values.extend_from_slice(&last);
            }
        }
        if values.iter().all(|v| *v <= 0.0) {
            return Err(Refusal::new("nothing touches the skin: no frame is above the idle ones"));
        }
        let frame_s = raster.measurements_per_frame() as f64 / raster.sample_rate_hz();
        let hold_s = frames.hold_s.unwrap_or([0.0, count as f64 * frame_s]);
        let shape = [blocks - first, count, rows, cols];
        let unit = raster.info().unit;
        let courses = Self { shape, values, frame_s, hold_s, unit, touch: 0, notes };
        Ok(Self { touch: courses.found_touch(), ..courses })
    }

    /// Presses, frames of a press, rows and columns.
    pub fn shape(&self) -> [usize; 4] {
        self.shape
    }

    /// Time from frame to frame, s.
    pub fn frame_s(&self) -> f64 {
        self.frame_s
    }

    /// Time of a press with what is before it, s.
    pub fn duration_s(&self) -> f64 {
        IDLE_S + self.shape[1] as f64 * self.frame_s
    }

    /// Frames of the hold, at least one.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the frames")]
    pub fn hold(&self) -> Range<usize> {
        let [start, end] = self.hold_s.map(|time_s| (time_s / self.frame_s + 1e-6) as usize);
        let start = start.min(self.shape[1] - 1);
        start..end.clamp(start + 1, self.shape[1])
    }

    /// Frame in the middle of the hold.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the frames")]
    pub fn middle(&self) -> usize {
        ((0.5 * (self.hold_s[0] + self.hold_s[1]) / self.frame_s) as usize).min(self.shape[1] - 1)
    }

    /// Time from the begin of [`PlayedPress::times_s`] to the begin of the frames, s.
    pub const LEAD_S: f64 = IDLE_S;

    /// Frame number `frame` of press number `press`: a value a taxel, in the unit of the frames.
    pub fn frame(&self, press: usize, frame: usize) -> &[f64] {
        let taxels = self.shape[2] * self.shape[3];
        &self.values[(press * self.shape[1] + frame) * taxels..][..taxels]
    }

    /// Largest value of all frames.
    pub fn largest(&self) -> f64 {
        self.values.iter().copied().fold(0.0, f64::max)
    }

    /// First frame in which the skin is touched in most presses.
    pub fn touch(&self) -> usize {
        self.touch
    }

    fn found_touch(&self) -> usize {
        let sum = |press: usize, frame: usize| self.frame(press, frame).iter().sum::<f64>();
        let first = |press: usize| {
            let held = sum(press, self.middle());
            (0..self.shape[1]).find(|&frame| sum(press, frame) > TOUCHED * held).unwrap_or(0)
        };
        let mut all: Vec<usize> = (0..self.shape[0]).map(first).collect();
        all.sort_unstable();
        all[all.len() / 2]
    }

    /// All values: presses × frames × taxels.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Time from the touch to the begin of frame number `frame`, s.
    pub fn since_touch_s(&self, frame: usize) -> f64 {
        (frame as f64 - self.touch as f64) * self.frame_s
    }

    /// Unit of the frames.
    pub fn unit(&self) -> Option<FrameUnit> {
        self.unit
    }

    /// Whether the frames are pressures.
    pub fn are_pressures(&self) -> bool {
        self.unit == Some(FrameUnit::Pressure)
    }

    /// The frame `frame` of press number `press` as pressure; `None` in another unit.
    pub fn pressure(&self, press: usize, frame: usize) -> Option<PressureMap> {
        let [_, _, rows, cols] = self.shape;
        self.are_pressures().then(|| PressureMap::from_values(rows, cols, self.frame(press, frame).to_vec()))
    }

    /// The pressure `time_s` after the begin of the frames, on a straight line between the frames; `None` in another
    /// unit.
    pub fn pressure_at(&self, press: usize, time_s: f64) -> Option<PressureMap> {
        let last = (self.shape[1] - 1) as f64;
        let at = (time_s / self.frame_s).clamp(0.0, last);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the frames")]
        let (before, after) = (at.floor() as usize, at.ceil() as usize);
        let mut map = self.pressure(press, before)?;
        for (p, next) in map.values_mut().iter_mut().zip(self.frame(press, after)) {
            *p += at.fract() * (next - *p);
        }
        Some(map)
    }

    /// How the values become conductances on the skin of `chain`, and what is assumed for that. Pressures go through
    /// its transducer. Conductances are taken as they are. Of codes and relative values the one that `peak` names is
    /// taken for the conductance that the pressure there, Pa, gives on this skin, and the others in proportion; without
    /// one the largest of these frames.
    ///
    /// # Errors
    /// [`Refusal`] if the pressure or the value is out of range.
    pub fn law(&self, chain: &Chain, peak: (f64, Option<f64>)) -> Result<(FrameLaw, Option<String>), Refusal> {
        let (peak_pa, value) = peak;
        within("--peak", peak_pa, 100.0, 1e6, "[100, 1e6] Pa")?;
        match self.unit {
            Some(FrameUnit::Pressure) => Ok((FrameLaw::Transducer, None)),
            Some(FrameUnit::Conductance) => Ok((FrameLaw::Scaled(1.0), None)),
            Some(FrameUnit::Codes | FrameUnit::Relative) | None => {
                let [_, _, rows, cols] = self.shape;
                let even = PressureMap::from_values(rows, cols, vec![peak_pa; rows * cols]);
                let usual_s = median(chain.skin_session(0).hold(&even, REFERENCE_S).values()).unwrap_or_default();
                let largest = value.unwrap_or_else(|| self.largest());
                let said = format!(
                    "the frames are not in pascals or siemens: their largest value, {largest:.4}, is taken for {:.1} µS, \
                     which {:.1} kPa give on this skin; --peak says otherwise",
                    1e6 * usual_s,
                    1e-3 * peak_pa
                );
                Ok((FrameLaw::Scaled(usual_s / largest), Some(said)))
            }
        }
    }

    /// Press number `press` on `skin`, which rests afterwards. It begins with 0.25 s without a touch.
    pub fn played(&self, press: usize, skin: &mut SkinSession, law: FrameLaw) -> PlayedPress {
        let [_, count, rows, cols] = self.shape;
        let frames = (0..count).map(|frame| self.frame(press, frame));
        let mut maps = Vec::with_capacity(LEAD + count);
        match law {
            FrameLaw::Scaled(siemens) => {
                maps.extend([ConductanceMap::zeros(rows, cols), ConductanceMap::zeros(rows, cols)]);
                let scaled = |frame: &[f64]| frame.iter().map(|v| siemens * v).collect();
                maps.extend(frames.map(|frame| ConductanceMap::from_values(rows, cols, scaled(frame))));
            }
            FrameLaw::Transducer => {
                let idle = PressureMap::zeros(rows, cols);
                maps.push(skin.hold(&idle, 0.0));
                maps.push(skin.hold(&idle, IDLE_S - RISE_S));
                let mut step_s = RISE_S;
                for frame in frames {
                    maps.push(skin.hold(&PressureMap::from_values(rows, cols, frame.to_vec()), step_s));
                    step_s = self.frame_s;
                }
                skin.rest();
            }
        }
        let times_s = (0..count).map(|k| IDLE_S + k as f64 * self.frame_s);
        PlayedPress { times_s: [0.0, IDLE_S - RISE_S].into_iter().chain(times_s).collect(), maps }
    }
}

impl PlayedPress {
    /// Conductances of map number `map` above those of the untouched skin, S.
    pub fn touch(&self, map: usize) -> ConductanceMap {
        let bare = &self.maps[0];
        let above = self.maps[map].values().iter().zip(bare.values()).map(|(g, bare)| (g - bare).max(0.0));
        ConductanceMap::from_values(bare.rows(), bare.cols(), above.collect())
    }

    /// The conductances as a function of time.
    ///
    /// # Errors
    /// [`Refusal`] for conductances that are none.
    pub fn source(self) -> Result<Interpolated, Refusal> {
        Interpolated::new(self.times_s, self.maps).map_err(of_conductance)
    }
}
