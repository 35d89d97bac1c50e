//! Frames of any skin, recorded as a skin with one wire would.

use super::frames::Frames;
use crate::chain::{Acquisition, Chain, SkinSession, of_conductance};
use crate::provenance::{Provenance, combined_hash, hash_text};
use crate::session::{Event, PressFacts, Recorded, Session};
use spts_circuit::{FrameUnit, Interpolated, Mode};
use spts_input::Refusal;
use spts_models::{ConductanceMap, PressureMap, within};
use spts_recon::metrics::median;

/// Time in which nothing touches the skin before the frames of a press, s, and the last part of it, in which the first
/// frame comes.
const IDLE_S: f64 = 0.25;
const RISE_S: f64 = 1e-3;
/// Maps before the first frame: the untouched skin at the begin and at the end of that time.
const LEAD: usize = 2;
/// Time for which the reference pressure is held, s.
const REFERENCE_S: f64 = 0.5;
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

/// The frames of one press without the idle ones, not below 0: frames × taxels.
struct Course {
    values: Vec<f64>,
}

/// How the values of a frame become conductances.
#[derive(Clone, Copy)]
enum Law {
    /// Pressures, Pa, on the transducer.
    Transducer,
    /// Times this, S.
    Scaled(f64),
}

/// Records the frames of `frames`, a session with a raster scan, by the wire and by the scan of `chain`, whose random
/// numbers have the root `seed`. `number` tells sessions of one skin apart: each has noise of its own.
///
/// Every press begins with 0.25 s without a touch. Its idle frames are subtracted; what is then below 0 counts as no
/// touch, and a missing value as the one before. Pressures go through the transducer of the chain. Conductances are
/// taken as they are. Of codes and relative values the largest one of the session is taken for the conductance that
/// `peak_pa` gives on this skin, and the others in proportion.
///
/// # Errors
/// [`Refusal`] if there are no frames, they are of another layout than the chain, or they are too long to record.
pub fn wired(frames: &Session, chain: &Chain, peak_pa: f64, seed: u64, number: u64) -> Result<WiredFrames, Refusal> {
    within("--peak", peak_pa, 100.0, 1e6, "[100, 1e6] Pa")?;
    if frames.event != Event::Press {
        return Err(Refusal::new("is no session of presses: frames of held contacts are needed"));
    }
    let values = Frames::of_session(frames)?;
    let Some(raster) = frames.raster() else { return Err(Refusal::new("has no frames: `raster` is null")) };
    let layout = chain.skin();
    let [blocks, count, rows, cols] = values.shape();
    // blocks that condition the skin are no presses
    let first = frames.raster.as_ref().map_or(0, |recorded| recorded.conditioning).min(blocks - 1);
    if [layout.rows(), layout.cols()] != [rows, cols] {
        return Err(Refusal::new(format!("frames of {rows} × {cols} taxels are not those of the skin")));
    }
    let frame_s = raster.measurements_per_frame() as f64 / raster.sample_rate_hz();
    let duration_s = IDLE_S + count as f64 * frame_s;
    check_length(blocks - first, duration_s * chain.sample_rate_hz())?;
    let mut notes = Vec::new();
    let courses = courses(frames, &values, first, &mut notes);
    let largest = courses.iter().flat_map(|course| &course.values).copied().fold(0.0, f64::max);
    if largest <= 0.0 {
        return Err(Refusal::new("nothing touches the skin: no frame is above the idle ones"));
    }
    let unit = raster.info().unit;
    let law = match unit {
        Some(FrameUnit::Pressure) => Law::Transducer,
        Some(FrameUnit::Conductance) => Law::Scaled(1.0),
        Some(FrameUnit::Codes | FrameUnit::Relative) | None => {
            let even = PressureMap::from_values(rows, cols, vec![peak_pa; rows * cols]);
            let usual_s = median(chain.skin_session(0).hold(&even, REFERENCE_S).values()).unwrap_or_default();
            notes.push(format!(
                "the frames are not in pascals or siemens: their largest value, {largest:.4}, is taken for {:.1} µS, which \
                 {:.1} kPa give on this skin; --peak says otherwise",
                1e6 * usual_s,
                1e-3 * peak_pa
            ));
            Law::Scaled(usual_s / largest)
        }
    };
    let hold_s = frames.hold_s.unwrap_or([0.0, count as f64 * frame_s]);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the frames")]
    let middle = ((0.5 * (hold_s[0] + hold_s[1]) / frame_s) as usize).min(count - 1);
    let times_s = [0.0, IDLE_S - RISE_S].into_iter().chain((0..count).map(|k| IDLE_S + k as f64 * frame_s));
    let times_s: Vec<f64> = times_s.collect();
    let record = |mode, number| -> Result<(Recorded, Vec<ConductanceMap>), Refusal> {
        let mut skin = chain.skin_session(number);
        let maps = courses.iter().map(|course| course.conductances(&mut skin, law, frame_s, [rows, cols]));
        let maps: Vec<Vec<ConductanceMap>> = maps.collect();
        let facts = courses.iter().zip(&maps).map(|(course, maps)| PressFacts {
            time_s: Some(times_s[LEAD + middle]),
            pressure: matches!(law, Law::Transducer)
                .then(|| PressureMap::from_values(rows, cols, course.frame(middle, rows * cols).to_vec())),
            conductance: Some(maps[LEAD + middle].clone()),
            ..PressFacts::default()
        });
        let presses = facts.collect();
        let touches = maps.iter().map(|maps| {
            let above = maps[LEAD + middle].values().iter().zip(maps[0].values()).map(|(g, bare)| (g - bare).max(0.0));
            ConductanceMap::from_values(rows, cols, above.collect())
        });
        let touches = touches.collect();
        let sources = maps.into_iter().map(|maps| Interpolated::new(times_s.clone(), maps).map_err(of_conductance));
        let mut sources = sources.collect::<Result<Vec<_>, _>>()?;
        let recording = chain.record_sources(&mut sources, duration_s, &Acquisition::presses(mode, number))?;
        Ok((Recorded { presses, ..Recorded::new(recording) }, touches))
    };
    let sessions = [2 * number, 2 * number + 1];
    let scanned = record(Mode::Raster, sessions[0])?.0;
    let (compressive, touches) = record(Mode::Compressive, sessions[1])?;
    let blocks = values.values().chunks(count * rows * cols);
    let hashes = blocks.map(|block| hash_text(&block.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>()));
    let hash = combined_hash(&hashes.collect::<Vec<_>>());
    let session = Session {
        object: frames.object.clone(),
        hold_s: Some(hold_s.map(|time_s| time_s + IDLE_S)),
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

/// The frames of every press from number `first` on, without its mean idle frame.
fn courses(session: &Session, frames: &Frames, first: usize, notes: &mut Vec<String>) -> Vec<Course> {
    let [presses, count, rows, cols] = frames.shape();
    let taxels = rows * cols;
    let blocks = session.raster().map_or(&[][..], |raster| raster.blocks());
    if blocks.iter().any(|block| block.idle_frames.unwrap_or(0) == 0) {
        notes.push("the session names no idle frames: nothing is subtracted".to_owned());
    }
    let course = |press: usize| {
        let own = &frames.values()[press * count * taxels..][..count * taxels];
        let idle = blocks.get(press).and_then(|block| block.idle_frames).unwrap_or(0);
        let untouched = |taxel: usize| {
            let values: Vec<f64> = (0..idle).map(|k| own[k * taxels + taxel]).filter(|v| v.is_finite()).collect();
            if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / values.len() as f64 }
        };
        let mut last = vec![0.0; taxels];
        let idle: Vec<f64> = (0..taxels).map(untouched).collect();
        let mut values = Vec::with_capacity(own.len());
        for frame in own.chunks_exact(taxels) {
            for ((last, value), idle) in last.iter_mut().zip(frame).zip(&idle) {
                if value.is_finite() {
                    *last = (value - idle).max(0.0);
                }
            }
            values.extend_from_slice(&last);
        }
        Course { values }
    };
    (first..presses).map(course).collect()
}

impl Course {
    fn frame(&self, frame: usize, taxels: usize) -> &[f64] {
        &self.values[frame * taxels..][..taxels]
    }

    /// Conductances of the untouched skin, twice, and of every frame.
    fn conductances(
        &self,
        skin: &mut SkinSession,
        law: Law,
        frame_s: f64,
        [rows, cols]: [usize; 2],
    ) -> Vec<ConductanceMap> {
        let idle = PressureMap::zeros(rows, cols);
        let mut maps = Vec::with_capacity(LEAD + self.values.len() / (rows * cols));
        let frames = self.values.chunks_exact(rows * cols);
        match law {
            Law::Scaled(siemens) => {
                maps.extend([ConductanceMap::zeros(rows, cols), ConductanceMap::zeros(rows, cols)]);
                let scaled = |frame: &[f64]| frame.iter().map(|v| siemens * v).collect();
                maps.extend(frames.map(|frame| ConductanceMap::from_values(rows, cols, scaled(frame))));
            }
            Law::Transducer => {
                maps.push(skin.hold(&idle, 0.0));
                maps.push(skin.hold(&idle, IDLE_S - RISE_S));
                let mut step_s = RISE_S;
                for frame in frames {
                    maps.push(skin.hold(&PressureMap::from_values(rows, cols, frame.to_vec()), step_s));
                    step_s = frame_s;
                }
                skin.rest();
            }
        }
        maps
    }
}
