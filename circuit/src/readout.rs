//! The device: clock, cells, summing amplifier and converter.

use crate::effect::{BlockStart, Effect, ProfileError, Sample, Session};
use crate::profile::Profile;
use crate::recording::{Block, Mode, Recording, RecordingError};
use crate::source::ConductanceSource;
use crate::weights::WeightClock;
use spts_models::Streams;

/// A block that cannot be acquired.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AcquireError {
    /// A source of another skin.
    #[error("the source has {source_taxels} taxels; the readout {taxels}")]
    Taxels {
        /// Taxels of the source.
        source_taxels: usize,
        /// Taxels of the readout.
        taxels: usize,
    },
    /// Nothing, or a broken frame.
    #[error("{measurements} measurements are not a positive whole number of frames of {frame}")]
    PartialFrame {
        /// Measurements asked for.
        measurements: usize,
        /// Measurements a frame.
        frame: usize,
    },
    /// Blocks that do not make a recording.
    #[error(transparent)]
    Recording(#[from] RecordingError),
}

/// The readout of one skin in one mode for one session. The clock, and with it the row of the weight matrix, runs on from
/// block to block, as it does in the device; noise is a function of (streams, mode, number of the block).
pub struct Readout {
    mode: Mode,
    volts_per_siemens: f64,
    sample_rate_hz: f64,
    clock: WeightClock,
    effects: Vec<Box<dyn Effect>>,
    levels: Vec<f64>,
    previous_levels: Vec<f64>,
    conductance_s: Vec<f64>,
    block: u64,
    continuous: bool,
}

impl Readout {
    /// Readout with `profile` of a skin of `taxels` taxels whose seeds have just been loaded. A frame has as many
    /// measurements as the skin has taxels. Sessions that should differ need streams of their own ([`Streams::child`]).
    ///
    /// # Errors
    /// [`ProfileError`] when the profile holds an unknown effect or a value outside its range, or when there is no taxel.
    pub fn new(profile: &Profile, mode: Mode, taxels: u32, streams: Streams) -> Result<Self, ProfileError> {
        spts_models::in_range("taxels", f64::from(taxels), taxels > 0, "[1, ∞)")?;
        profile.validate(taxels)?;
        let label = match mode {
            Mode::Raster => "readout/raster",
            Mode::Compressive => "readout/compressive",
        };
        let weights = profile.weights(mode, taxels);
        let session = Session {
            streams: streams.child(label, 0),
            weights,
        };
        let n = weights.taxels();
        Ok(Self {
            mode,
            volts_per_siemens: profile.volts_per_siemens(),
            sample_rate_hz: profile.sample_rate_hz,
            clock: weights.clock(0),
            effects: profile.effects(mode, &session)?,
            levels: vec![0.0; n],
            previous_levels: vec![0.0; n],
            conductance_s: vec![0.0; n],
            block: 0,
            continuous: true,
        })
    }

    /// Which readout this is.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Measurements a frame.
    #[must_use]
    pub fn measurements_per_frame(&self) -> usize {
        self.levels.len()
    }

    /// Measurements a second, Hz.
    #[must_use]
    pub fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }

    /// Lets the clock run for `frames` frames without recording, as the device does between presses (about 57 frames).
    pub fn skip(&mut self, frames: u64) {
        if frames > 0 {
            self.seek(self.block, self.clock.row() / self.levels.len() as u64 + frames);
        }
    }

    /// Goes to the start of block number `block`, `frame` frames after the seeds were loaded. What is acquired there does not
    /// depend on what was acquired before (only the lag of cells that miss clocks does), so that the blocks of a session
    /// may be simulated in any order and on any thread.
    pub fn seek(&mut self, block: u64, frame: u64) {
        let weights = *self.clock.weights();
        let row = frame * self.levels.len() as u64;
        // `acquire` swaps the two buffers first
        match row.checked_sub(1) {
            Some(before) => weights.fill_row(before, &mut self.levels),
            None => self.levels.fill(0.0),
        }
        self.clock = weights.clock(row);
        self.block = block;
        self.continuous = false;
    }

    /// Records `measurements` measurements of `source`, whose time 0 is the first of them. The conductance is taken anew for
    /// every measurement.
    ///
    /// # Errors
    /// [`AcquireError`] when the source has another number of taxels or `measurements` is not a whole number of frames.
    #[expect(clippy::cast_precision_loss, reason = "sample indices stay far below 2^52")]
    pub fn acquire(&mut self, source: &mut dyn ConductanceSource, measurements: usize) -> Result<Block, AcquireError> {
        let taxels = self.levels.len();
        if source.taxels() != taxels {
            return Err(AcquireError::Taxels {
                source_taxels: source.taxels(),
                taxels,
            });
        }
        if measurements == 0 || !measurements.is_multiple_of(taxels) {
            return Err(AcquireError::PartialFrame {
                measurements,
                frame: taxels,
            });
        }
        let start = BlockStart {
            block: self.block,
            first_row: self.clock.row(),
            continuous: self.continuous,
        };
        for effect in &mut self.effects {
            effect.begin_block(&start);
        }
        let mut volts = Vec::with_capacity(measurements);
        for m in 0..measurements {
            volts.push(self.measure(source, m as f64 / self.sample_rate_hz));
        }
        self.block += 1;
        self.continuous = true;
        Ok(Block {
            frame_position: self.clock.row() / taxels as u64,
            volts,
        })
    }

    #[inline]
    fn measure(&mut self, source: &mut dyn ConductanceSource, time_s: f64) -> f64 {
        std::mem::swap(&mut self.levels, &mut self.previous_levels);
        let row = self.clock.row();
        self.clock.next_row(&mut self.levels);
        source.sample(time_s, &mut self.conductance_s);
        let sums = Sums::of(&self.levels, &self.conductance_s);
        let mut sample = Sample {
            row,
            levels: &self.levels,
            previous_levels: &self.previous_levels,
            conductance_s: &self.conductance_s,
            volts_per_siemens: self.volts_per_siemens,
            sum_v: sums.sum * self.volts_per_siemens,
            norm_v: sums.square.sqrt() * self.volts_per_siemens,
            output_v: sums.weighted * self.volts_per_siemens,
        };
        for effect in &mut self.effects {
            effect.apply(&mut sample);
        }
        sample.output_v
    }

    /// Records one block of `measurements` measurements for every source, with `gap_frames` unrecorded frames after each.
    ///
    /// # Errors
    /// As [`Readout::acquire`] and [`Recording::new`].
    pub fn record<S: ConductanceSource>(
        &mut self,
        presses: &mut [S],
        measurements: usize,
        gap_frames: u64,
    ) -> Result<Recording, AcquireError> {
        let mut blocks = Vec::with_capacity(presses.len());
        for press in presses {
            blocks.push(self.acquire(press, measurements)?);
            self.skip(gap_frames);
        }
        Ok(self.recording(blocks)?)
    }

    /// Recording of `blocks` that this readout acquired.
    ///
    /// # Errors
    /// [`RecordingError`] when they do not fit together.
    pub fn recording(&self, blocks: Vec<Block>) -> Result<Recording, RecordingError> {
        Recording::new(
            self.mode,
            self.levels.len(),
            self.levels.len(),
            self.sample_rate_hz,
            blocks,
        )
    }
}

/// Sums over the taxels, in four lanes: a fixed order of summation that the compiler can vectorise.
struct Sums {
    weighted: f64,
    sum: f64,
    square: f64,
}

impl Sums {
    #[inline]
    fn of(levels: &[f64], conductance_s: &[f64]) -> Self {
        let mut lanes = [[0.0_f64; 4]; 3];
        let (w4, w1) = levels.as_chunks::<4>();
        let (g4, g1) = conductance_s.as_chunks::<4>();
        for (w, g) in w4.iter().zip(g4) {
            for k in 0..4 {
                let term = w[k] * g[k];
                lanes[0][k] += term;
                lanes[1][k] += g[k];
                lanes[2][k] += term * term;
            }
        }
        for (w, g) in w1.iter().zip(g1) {
            let term = w * g;
            lanes[0][0] += term;
            lanes[1][0] += g;
            lanes[2][0] += term * term;
        }
        let [weighted, sum, square] = lanes.map(|l| (l[0] + l[1]) + (l[2] + l[3]));
        Self { weighted, sum, square }
    }
}
