//! Recordings: the interface between a skin, real or simulated, and everything that decodes it.

use crate::converter::Converter;
use crate::weights::{Mode, WeightRows, Weights};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use spts_input::Refusal;
use spts_models::SkinLayout;
use std::ops::Range;

/// Metadata of a recording: everything that a decoder needs beside the samples.
///
/// ```
/// use spts_circuit::{Mode, RecordingInfo, Seeding, WeightMode, Weights};
/// use spts_models::SkinLayout;
///
/// let weights = Weights::new(WeightMode::Raster, Seeding::Address, 100);
/// let info = RecordingInfo::new(SkinLayout::default(), weights, 64_300.0);
/// assert_eq!((info.mode(), info.measurements_per_frame), (Mode::Raster, 100));
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingInfo {
    /// Layout of the recorded skin. In files `electrode_m` may be left out.
    #[serde(deserialize_with = "told_layout")]
    pub layout: SkinLayout,
    /// Weights that the cells were meant to put out, one for each taxel. They also determine the readout: raster
    /// weights mean a raster scan.
    pub weights: Weights,
    /// Measurements a second, Hz. Range (0, ∞).
    pub sample_rate_hz: f64,
    /// Measurements in a frame. Range [1, ∞); 100 in the published recordings.
    pub measurements_per_frame: usize,
    /// Scale of the converter; `None` if no converter acted or its scale is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub converter: Option<Converter>,
    /// Unit of the samples where they are frames of a skin or a simulator of any kind; `None` for volts of the wire.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<FrameUnit>,
}

/// What the numbers of frames are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FrameUnit {
    /// Mean pressure over a taxel's area, Pa.
    Pressure,
    /// Conductance of a taxel, S.
    Conductance,
    /// Codes of a converter, which grow with the load.
    Codes,
    /// Any number that grows with the load.
    Relative,
}

impl FrameUnit {
    /// All units and the names by which files and options know them.
    pub const ALL: [(&str, Self); 4] = [
        ("pressure", Self::Pressure),
        ("conductance", Self::Conductance),
        ("codes", Self::Codes),
        ("relative", Self::Relative),
    ];
}

/// A layout whose rows, columns and pitch are told: a recording has no usual ones.
fn told_layout<'de, D: Deserializer<'de>>(from: D) -> Result<SkinLayout, D::Error> {
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Told {
        rows: usize,
        cols: usize,
        pitch_m: f64,
        electrode_m: Option<f64>,
    }
    let Told { rows, cols, pitch_m, electrode_m } = Told::deserialize(from)?;
    let electrode_m = electrode_m.unwrap_or(SkinLayout::usual_electrode_m(pitch_m));
    SkinLayout::new(rows, cols, pitch_m, electrode_m).map_err(D::Error::custom)
}

impl RecordingInfo {
    /// Metadata of a skin whose frames have one measurement for each taxel, without a converter.
    pub fn new(layout: SkinLayout, weights: Weights, sample_rate_hz: f64) -> Self {
        Self { measurements_per_frame: layout.taxels(), layout, weights, sample_rate_hz, converter: None, unit: None }
    }

    /// The readout that made the recording.
    pub fn mode(&self) -> Mode {
        self.weights.mode().readout()
    }

    /// Checks what does not depend on the samples.
    pub(crate) fn check(&self) -> Result<(), Refusal> {
        if self.measurements_per_frame == 0 {
            return Err(Refusal::range("measurements_per_frame", 0, "[1, ∞)"));
        }
        let (weights, layout) = (self.weights.taxels(), self.layout.taxels());
        if weights != layout {
            return Err(Refusal::new(format!("`weights` are those of {weights} taxels; `layout` has {layout}")));
        }
        let rate_hz = self.sample_rate_hz;
        let ok = rate_hz > 0.0 && rate_hz.is_finite();
        ok.then_some(()).ok_or_else(|| Refusal::range("sample_rate_hz", rate_hz, "(0, ∞)"))
    }
}

/// One press: consecutive frames without a gap.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Frames from loading the seeds to the END of the block.
    pub frame_position: u64,
    /// Frames at the start of the block in which nothing touches the skin; `None` if that is not known.
    pub idle_frames: Option<usize>,
    /// Output of the summing amplifier, sign-flipped, V; measurement `m` of frame `f` is entry
    /// `f · measurements_per_frame + m`. NaN where the instrument lost a sample.
    pub volts: Vec<f64>,
}

/// Presses of one session in one mode, as the amplifier's output in volts. Recordings of the real skin and simulated
/// ones have this same type.
///
/// ```
/// use spts_circuit::{Block, Recording, RecordingInfo, Seeding, WeightMode, Weights};
/// use spts_models::SkinLayout;
///
/// let weights = Weights::new(WeightMode::Binary, Seeding::Address, 100);
/// let info = RecordingInfo::new(SkinLayout::default(), weights, 64_300.0);
/// let block = Block {
///     frame_position: 1243,
///     idle_frames: Some(150),
///     volts: vec![0.0; 1000 * 100],
/// };
/// let recording = Recording::new(info, vec![block])?;
/// // weights and samples of twenty measurements of the hold: what a decoder is given
/// let measurements = 50_000..50_020;
/// let phi = recording.rows(0, measurements.clone()).to_vec();
/// let y = &recording.blocks()[0].volts[measurements];
/// assert_eq!((phi.len(), y.len()), (20 * 100, 20));
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    info: RecordingInfo,
    frames: usize,
    blocks: Vec<Block>,
}

impl Recording {
    /// A recording of `blocks`, all equally long, with the metadata `info`.
    ///
    /// # Errors
    /// [`Refusal`] for no block, measurement or frame; a sample rate that is not positive; weights of another
    /// skin; blocks of different lengths or an incomplete frame; an infinite sample; or a block that begins before the
    /// seeds are loaded, ends beyond the largest row number, or is idle for longer than it lasts.
    pub fn new(info: RecordingInfo, blocks: Vec<Block>) -> Result<Self, Refusal> {
        info.check()?;
        let measurements = info.measurements_per_frame;
        let Some(first) = blocks.first() else {
            return Err(Refusal::range("blocks", 0, "[1, ∞)"));
        };
        let frames = first.volts.len() / measurements;
        if frames == 0 {
            return Err(Refusal::range("frames", 0, "[1, ∞)"));
        }
        for (block, b) in blocks.iter().enumerate() {
            let refuse = |what: String| Err(Refusal::new(format!("block {block}{what}")));
            let (len, position) = (b.volts.len(), b.frame_position);
            if len != frames * measurements {
                return refuse(format!(" has {len} samples; expected {frames} frames of {measurements}"));
            }
            if position < frames as u64 {
                let why = format!("the block is {frames} frames long");
                return refuse(format!(" has `frame_position` = {position}, outside [{frames}, ∞): {why}"));
            }
            let limit = u64::MAX / measurements as u64;
            if position > limit {
                return refuse(format!(" has `frame_position` = {position}, outside [{frames}, {limit}]"));
            }
            if let Some(idle) = b.idle_frames.filter(|idle| *idle > frames) {
                return refuse(format!(" has `idle_frames` = {idle}, outside [0, {frames}]"));
            }
            if let Some(sample) = b.volts.iter().position(|v| v.is_infinite()) {
                let value = b.volts[sample];
                return refuse(format!(", sample {sample} = {value} V is not finite; NaN marks a lost sample"));
            }
        }
        Ok(Self { info, frames, blocks })
    }

    /// The same recording with other blocks. The converter's scale is kept only if it could have produced every sample.
    ///
    /// # Errors
    /// As [`Recording::new`].
    pub fn with_blocks(&self, blocks: Vec<Block>) -> Result<Self, Refusal> {
        let mut info = self.info.clone();
        let made = |converter: &Converter| blocks.iter().all(|block| converter.made(&block.volts));
        info.converter = info.converter.filter(made);
        Self::new(info, blocks)
    }

    /// The same recording, in which the samples of these ranges of measurements of blocks count as lost (NaN).
    pub fn without(&self, lost: &[(usize, Range<usize>)]) -> Self {
        let mut blocks = self.blocks.clone();
        for (block, range) in lost {
            let volts = blocks.get_mut(*block).and_then(|block| block.volts.get_mut(range.clone()));
            volts.into_iter().for_each(|volts| volts.fill(f64::NAN));
        }
        self.with_samples_of(blocks)
    }

    /// The same recording with blocks whose samples are this recording's own at other places, or lost.
    pub(crate) fn with_samples_of(&self, blocks: Vec<Block>) -> Self {
        Self { info: self.info.clone(), frames: self.frames, blocks }
    }

    /// The same recording, in which the first `idle_frames` frames of every block are marked as idle (at most the whole
    /// block); `None` if it is not known.
    pub fn with_idle_frames(mut self, idle_frames: Option<usize>) -> Self {
        let idle_frames = idle_frames.map(|idle| idle.min(self.frames));
        for block in &mut self.blocks {
            block.idle_frames = idle_frames;
        }
        self
    }

    /// Metadata of the recording.
    pub fn info(&self) -> &RecordingInfo {
        &self.info
    }

    /// Layout of the recorded skin.
    pub fn layout(&self) -> &SkinLayout {
        &self.info.layout
    }

    /// Weights that the cells were meant to put out. Decoders use [`Recording::rows`] instead.
    pub fn weights(&self) -> &Weights {
        &self.info.weights
    }

    /// Scale of the converter; `None` if no converter acted or its scale is not known.
    pub fn converter(&self) -> Option<&Converter> {
        self.info.converter.as_ref()
    }

    /// Rows of the weight matrix Φ of the measurements `measurements` of block `block`, both from 0; measurements are
    /// counted within the block.
    ///
    /// # Panics
    /// If the recording has no such block, or the block no such measurements.
    pub fn rows(&self, block: usize, measurements: Range<usize>) -> WeightRows<'_> {
        let len = self.blocks[block].volts.len();
        assert!(
            measurements.start <= measurements.end && measurements.end <= len,
            "measurements {measurements:?} of {len}"
        );
        let first_row = self.first_row(block, 0) + measurements.start as u64;
        WeightRows::new(&self.info.weights, first_row, measurements.len())
    }

    /// The readout that made the recording.
    pub fn mode(&self) -> Mode {
        self.info.mode()
    }

    /// Number of taxels, N.
    pub fn taxels(&self) -> usize {
        self.info.layout.taxels()
    }

    /// Measurements in a frame (100 in the published recordings).
    pub fn measurements_per_frame(&self) -> usize {
        self.info.measurements_per_frame
    }

    /// Frames in a block (1000 in the published recordings).
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Measurements a second, Hz.
    pub fn sample_rate_hz(&self) -> f64 {
        self.info.sample_rate_hz
    }

    /// The blocks, in order of recording.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Samples of frame `frame` of block `block`, V.
    ///
    /// # Panics
    /// If the recording has no such block or frame.
    pub fn volts(&self, block: usize, frame: usize) -> &[f64] {
        let m = self.info.measurements_per_frame;
        &self.blocks[block].volts[frame * m..(frame + 1) * m]
    }

    /// Row of the weight matrix at the first measurement of this frame; the following measurements use the following
    /// rows. It is `((frame_position − frames) + frame) · measurements_per_frame`, verified against the published
    /// recordings.
    ///
    /// # Panics
    /// If the recording has no such block.
    pub fn first_row(&self, block: usize, frame: usize) -> u64 {
        (self.blocks[block].frame_position - self.frames as u64 + frame as u64)
            * self.info.measurements_per_frame as u64
    }

    /// Time of the first measurement of a frame since the start of its block, s.
    pub fn time_s(&self, frame: usize) -> f64 {
        (frame * self.info.measurements_per_frame) as f64 / self.info.sample_rate_hz
    }
}

impl Recording {
    /// Number of saturated samples: those at an end of the converter's range, and those within one code of `rail_v`,
    /// the amplifier's largest output, V, if it is given. Missing samples do not count.
    ///
    /// If negative voltages were set to 0, an output below the range cannot be distinguished from 0.
    ///
    /// ```
    /// use spts_circuit::{Block, Recording, RecordingInfo, Seeding, WeightMode, Weights};
    /// use spts_models::SkinLayout;
    ///
    /// let weights = Weights::new(WeightMode::Raster, Seeding::Address, 4);
    /// let info = RecordingInfo::new(SkinLayout::with_pitch(1, 4, 5e-3)?, weights, 1e3);
    /// let block = Block { frame_position: 1, idle_frames: None, volts: vec![0.0, 3.0, 15.0, -15.0] };
    /// let recording = Recording::new(info, vec![block])?;
    /// assert_eq!((recording.saturated(None), recording.saturated(Some(15.0))), (0, 2));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn saturated(&self, rail_v: Option<f64>) -> usize {
        let blocks = self.blocks().iter();
        blocks.map(|block| self.info().saturated(&block.volts, rail_v)).sum()
    }
}

impl RecordingInfo {
    /// As [`Recording::saturated`], for samples outside a recording.
    pub fn saturated(&self, volts: &[f64], rail_v: Option<f64>) -> usize {
        let converter = self.converter.as_ref();
        let step_v = converter.map_or(0.0, |c| c.volts(0) - c.volts(1));
        let subtracted_v = converter.map_or(0.0, Converter::subtracted_v);
        let ends = converter.map(Ends::of);
        let at_end = |v: f64| {
            let output_v = v + subtracted_v;
            ends.is_some_and(|ends| ends.reached(v)) || rail_v.is_some_and(|rail_v| output_v.abs() >= rail_v - step_v)
        };
        volts.iter().filter(|v| v.is_finite() && at_end(**v)).count()
    }
}

/// Volts of the first and the last code.
#[derive(Clone, Copy)]
struct Ends {
    first: u64,
    /// `None` if the last codes are all set to 0 V.
    last: Option<u64>,
}

impl Ends {
    fn of(converter: &Converter) -> Self {
        let [last, before] = [0, 1].map(|k| converter.volts(converter.max_code().saturating_sub(k)).to_bits());
        Self { first: converter.volts(0).to_bits(), last: (last != before).then_some(last) }
    }

    fn reached(self, v: f64) -> bool {
        let bits = v.to_bits();
        bits == self.first || self.last == Some(bits)
    }
}

/// From measurement `from` of a block on, the cells are `rows` clock edges behind the count of measurements:
/// measurement i has the row that belongs to measurement i − `rows`. This holds until the next slip of the block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Slip {
    /// Block of the recording, from 0.
    pub block: usize,
    /// First measurement of the block that lags.
    pub from: usize,
    /// Total number of rows by which the measurements lag; negative if the cells are ahead.
    pub rows: i64,
}

impl Recording {
    /// The same recording with every sample moved to the row with which it was taken, so that [`Recording::rows`] is
    /// correct again. Positions without a sample are marked as lost (NaN). If edges were missed within a block, the
    /// cells repeated some rows; the first sample of such a row is kept. Samples that move out of their block are
    /// dropped. `slips` must be in order of block and measurement.
    ///
    /// ```
    /// use spts_circuit::{Block, Recording, RecordingInfo, Seeding, Slip, WeightMode, Weights};
    /// use spts_models::SkinLayout;
    ///
    /// let layout = SkinLayout::new(1, 2, 5e-3, 3e-3)?;
    /// let info = RecordingInfo::new(layout, Weights::new(WeightMode::Binary, Seeding::Mixed, 2), 64_300.0);
    /// let block = Block { frame_position: 9, idle_frames: None, volts: vec![0.0, 1.0, 1.5, 2.0, 3.0, 4.0] };
    /// let recording = Recording::new(info, vec![block])?;
    /// // one edge was missed before the third measurement
    /// let aligned = recording.realigned(&[Slip { block: 0, from: 2, rows: 1 }]);
    /// assert_eq!(aligned.blocks()[0].volts[..5], [0.0, 1.0, 2.0, 3.0, 4.0]);
    /// assert!(aligned.blocks()[0].volts[5].is_nan());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn realigned(&self, slips: &[Slip]) -> Self {
        let mut blocks = self.blocks().to_vec();
        for (number, block) in blocks.iter_mut().enumerate() {
            let of_block: Vec<&Slip> = slips.iter().filter(|slip| slip.block == number).collect();
            if !of_block.is_empty() {
                put_back(block, &of_block);
            }
        }
        self.with_samples_of(blocks)
    }
}

fn put_back(block: &mut Block, slips: &[&Slip]) {
    let len = block.volts.len();
    let mut volts = vec![f64::NAN; len];
    let mut taken = vec![false; len];
    for (i, &sample) in block.volts.iter().enumerate() {
        let rows = slips.iter().rfind(|slip| slip.from <= i).map_or(0, |slip| slip.rows);
        let place = i64::try_from(i).ok().and_then(|i| i.checked_sub(rows));
        let place = place.and_then(|place| usize::try_from(place).ok());
        if let Some(place) = place.filter(|&place| place < len && !taken[place]) {
            volts[place] = sample;
            taken[place] = true;
        }
    }
    block.volts = volts;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::weights::{Seeding, WeightMode};
    use crate::{Constant, Profile, Readout};
    use spts_models::{ConductanceMap, Streams};

    fn info(side: usize, mode: WeightMode, sample_rate_hz: f64) -> RecordingInfo {
        let layout = SkinLayout::new(side, side, 15e-3, 10e-3).unwrap();
        let taxels = u32::try_from(side * side).unwrap();
        RecordingInfo::new(layout, Weights::new(mode, Seeding::Address, taxels), sample_rate_hz)
    }

    fn block(frame_position: u64, len: usize) -> Block {
        Block { frame_position, idle_frames: None, volts: vec![0.0; len] }
    }

    #[test]
    fn rows_follow_the_published_alignment() {
        let info = info(10, WeightMode::Binary, 64_300.0);
        let r = Recording::new(info, vec![block(1243, 100_000)]).unwrap();
        assert_eq!((r.frames(), r.first_row(0, 0), r.first_row(0, 7)), (1000, 24_300, 25_000));
        assert_eq!(r.volts(0, 999).len(), 100);
        let rows = r.rows(0, 700..720);
        assert_eq!((rows.first_row(), rows.len(), rows.taxels()), (25_000, 20, 100));
    }

    #[test]
    fn contradictions_are_refused() {
        let other = RecordingInfo { layout: SkinLayout::default(), ..info(2, WeightMode::Binary, 1.0) };
        let said = Recording::new(other, vec![block(1, 100)]).unwrap_err().to_string();
        assert_eq!(said, "`weights` are those of 4 taxels; `layout` has 100");
        let new = |rate, blocks| Recording::new(info(2, WeightMode::Raster, rate), blocks);
        let idle_frames = Some(3);
        let idle = Block { idle_frames, ..block(2, 8) };
        let mut bad = block(1, 4);
        bad.volts[2] = f64::INFINITY;
        let limit = u64::MAX / 4;
        assert!(new(1.0, vec![block(limit, 8)]).is_ok());
        let late = format!("block 0 has `frame_position` = {}, outside [2, {limit}]", limit + 1);
        for (rate, blocks, expected) in [
            (1.0, vec![idle], "block 0 has `idle_frames` = 3, outside [0, 2]"),
            (1.0, vec![], "`blocks` = 0 is outside [1, ∞)"),
            (1.0, vec![block(1, 3)], "`frames` = 0 is outside [1, ∞)"),
            (f64::NAN, vec![block(1, 4)], "`sample_rate_hz` = NaN is outside (0, ∞)"),
            (1.0, vec![block(0, 4)], "block 0 has `frame_position` = 0, outside [1, ∞): the block is 1 frames long"),
            (1.0, vec![block(limit + 1, 8)], &late),
            (1.0, vec![block(2, 8), block(9, 7)], "block 1 has 7 samples; expected 2 frames of 4"),
            (1.0, vec![bad], "block 0, sample 2 = inf V is not finite; NaN marks a lost sample"),
        ] {
            assert_eq!(new(rate, blocks).unwrap_err().to_string(), expected);
        }
    }

    /// One taxel of a 10-bit converter of 32 V − 64.5 V: what is beyond is counted, in the mode in which it happens,
    /// and so is what a rail of 15 V cuts off.
    #[test]
    fn samples_beyond_the_range_are_counted() {
        let skin = SkinLayout::with_pitch(1, 4, 15e-3).unwrap();
        let count = |effects: &str, mode, volts: f64| {
            let ideal = crate::PROFILES[0].1;
            let adc = |mode: &str, divider: f64, offset_v: f64| {
                format!("[{mode}.adc]\nbits = 10\nreference_v = 3.3\ndivider = {divider:?}\noffset_v = {offset_v:?}\n")
            };
            let adcs = [adc("compressive", 20.0, 32.0), adc("raster", 3.0, 4.3)].concat();
            let profile = Profile::from_toml(&format!("{ideal}\n{adcs}{effects}")).unwrap();
            let siemens = volts / profile.volts_per_siemens();
            let map = ConductanceMap::from_values(1, 4, vec![siemens, 0.0, 0.0, 0.0]);
            let mut source = Constant::new(map).unwrap();
            let mut readout = Readout::new(&profile, mode, &skin, Streams::new(1), 0).unwrap();
            let block = readout.acquire(&mut source, 400).unwrap();
            let recording = readout.recording(vec![block]).unwrap();
            recording.saturated(profile.rail_v(mode).unwrap())
        };
        assert_eq!(count("", Mode::Compressive, 20.0), 0);
        assert_eq!(count("", Mode::Compressive, 40.0), 400);
        assert_eq!(count("[compressive.rails]\nlimit_v = 15.0", Mode::Compressive, 20.0), 400);
        assert_eq!(count("[compressive.rails]\nlimit_v = 15.0", Mode::Compressive, 14.0), 0);
        // a frame of a raster has one measurement of the taxel
        assert_eq!(count("", Mode::Raster, 5.0), 100);
        assert_eq!(count("[raster.clamp]\nsubtract_v = -0.1", Mode::Raster, 5.0), 100);
        assert_eq!(count("[raster.clamp]\nsubtract_v = -0.1", Mode::Raster, 4.0), 0);
    }
}
