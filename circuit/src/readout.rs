//! The device: clock, cells, summing amplifier and converter, from a source of conductance to volts.

use crate::effect::{BlockStart, Effect, EffectSession};
use crate::engine::Engine;
use crate::profile::Profile;
use crate::recording::{Block, Recording, RecordingInfo};
use crate::source::ConductanceSource;
use crate::weights::{CellCodes, Mode, Weights};
use spts_input::Refusal;
use spts_models::{SkinLayout, Snapshot, Streams};

/// The readout of one skin in one mode for one session. The clock, and with it the row of the weight matrix, continues
/// from block to block, as in the device. Noise is a function of (device, session, mode, block number).
///
/// ```
/// use spts_circuit::{Constant, Mode, Profile, Readout};
/// use spts_models::{ConductanceMap, SkinLayout, Streams};
///
/// let profile = Profile::named("ideal")?;
/// let mut readout = Readout::new(&profile, Mode::Compressive, &SkinLayout::default(), Streams::new(1), 0)?;
/// let mut skin = Constant::new(ConductanceMap::from_values(10, 10, vec![1e-5; 100]))?;
/// let block = readout.acquire(&mut skin, 200)?;
/// assert_eq!((block.volts.len(), block.frame_position), (200, 2));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Readout {
    info: RecordingInfo,
    engine: Engine,
    effects: Vec<Box<dyn Effect>>,
    /// Row of the next measurement.
    row: u64,
    block: u64,
    continuous: bool,
}

impl Readout {
    /// A readout of a skin with this `layout`, with freshly loaded seeds. A frame has as many measurements as the skin
    /// has taxels. The parts of cells and amplifier depend only on the streams of the `device` and are the same in
    /// every session and mode; everything else differs by `session`. `profile` is for electrodes of 10 mm × 10 mm; its
    /// feedback is scaled for others ([`Profile::on`]).
    ///
    /// # Errors
    /// [`Refusal`] for an unknown effect, or a value outside its range.
    pub fn new(
        profile: &Profile,
        mode: Mode,
        layout: &SkinLayout,
        device: Streams,
        session: u64,
    ) -> Result<Self, Refusal> {
        let taxels = u32::try_from(layout.taxels()).unwrap_or(u32::MAX);
        let profile = &profile.on(layout)?;
        profile.validate(taxels)?;
        let label = match mode {
            Mode::Raster => "readout/raster",
            Mode::Compressive => "readout/compressive",
        };
        let weights = profile.weights(mode, taxels)?;
        let info = RecordingInfo {
            converter: profile.converter(mode)?,
            ..RecordingInfo::new(*layout, weights.clone(), profile.sample_rate_hz)
        };
        let session = EffectSession {
            device: device.child("readout/device", 0),
            streams: device.child("session", session).child(label, 0),
            weights: weights.clone(),
            feedback_ohm: profile.feedback_ohm,
            sample_rate_hz: profile.sample_rate_hz,
        };
        Ok(Self {
            info,
            engine: Engine::new(weights, profile.volts_per_siemens(), profile.sample_rate_hz),
            effects: profile.effects(mode, &session)?,
            row: 0,
            block: 0,
            continuous: true,
        })
    }

    /// The same readout with cells that put out `codes` in place of the generator's formula. If the codes equal the
    /// formula's, the recording is the same bit for bit. Effects and faults act on them as on the generator's levels.
    /// Where a fault determines the level of a cell, or an effect makes the cell miss an edge, the formula's level
    /// replaces the code.
    ///
    /// # Errors
    /// [`Refusal`] if the number of cells differs from that of taxels.
    pub fn with_codes(self, codes: Box<dyn CellCodes>) -> Result<Self, Refusal> {
        let (cells, taxels) = (codes.taxels(), self.measurements_per_frame());
        if cells != taxels {
            let readout = format!("the readout has {taxels} taxels");
            return Err(Refusal::new(format!("the codes are those of {cells} cells; {readout}")));
        }
        Ok(Self { engine: self.engine.with_codes(codes), ..self })
    }

    /// Weights that the cells are meant to put out.
    pub fn weights(&self) -> &Weights {
        self.engine.weights()
    }

    /// Metadata of its recordings.
    pub fn info(&self) -> &RecordingInfo {
        &self.info
    }

    /// Number of measurements in a frame.
    pub fn measurements_per_frame(&self) -> usize {
        self.engine.weights().taxels()
    }

    /// Number of measurements a second, Hz.
    pub fn sample_rate_hz(&self) -> f64 {
        self.engine.sample_rate_hz()
    }

    /// Runs the clock for `frames` frames without recording, as the device does between presses (about 57 frames).
    pub fn skip(&mut self, frames: u64) {
        if frames > 0 {
            self.seek(self.block, self.row / self.measurements_per_frame() as u64 + frames);
        }
    }

    /// Goes to the start of block number `block`, `frame` frames after loading the seeds. What is acquired there does
    /// not depend on earlier acquisitions, so the blocks of a session may be simulated in any order and on any thread.
    pub fn seek(&mut self, block: u64, frame: u64) {
        self.seek_row(block, frame * self.measurements_per_frame() as u64);
    }

    /// As [`Readout::seek`], with the position as `row`: measurements since loading the seeds.
    pub fn seek_row(&mut self, block: u64, row: u64) {
        self.row = row;
        self.block = block;
        self.continuous = false;
    }

    /// Records `measurements` measurements of `source`, the first at the source's time 0. The conductance is evaluated
    /// for every measurement.
    ///
    /// # Errors
    /// [`Refusal`] if the source has another number of taxels or returns an invalid segment, `measurements` is not
    /// a whole number of frames, or the cells have no codes.
    pub fn acquire(&mut self, source: &mut dyn ConductanceSource, measurements: usize) -> Result<Block, Refusal> {
        let taxels = self.measurements_per_frame();
        if measurements == 0 || !measurements.is_multiple_of(taxels) {
            let whole = format!("a positive whole number of frames of {taxels}");
            return Err(Refusal::new(format!("{measurements} measurements are not {whole}")));
        }
        let volts = self.measure(source, measurements)?;
        Ok(Block { frame_position: self.row / taxels as u64, idle_frames: None, volts })
    }

    /// As [`Readout::acquire`], for any number of measurements. A large skin is read with far fewer measurements than
    /// taxels.
    ///
    /// # Errors
    /// As [`Readout::acquire`], except for incomplete frames.
    pub fn measure(&mut self, source: &mut dyn ConductanceSource, measurements: usize) -> Result<Vec<f64>, Refusal> {
        let mut volts = vec![0.0; measurements];
        self.begin();
        self.go_on(source, &mut volts)?;
        Ok(volts)
    }

    /// Starts the next block; the following calls of [`Readout::go_on`] measure in it.
    pub fn begin(&mut self) {
        let start = BlockStart { block: self.block, first_row: self.row, continuous: self.continuous };
        for effect in &mut self.effects {
            effect.begin_block(&start);
        }
        self.block += 1;
        self.continuous = true;
    }

    /// Row of the next measurement, counted from loading the seeds.
    pub fn row(&self) -> u64 {
        self.row
    }

    /// Measures `source` in the block that was begun; the source's time 0 is the first measurement. The result does not
    /// depend on how the measurements of a block are divided among calls.
    ///
    /// # Errors
    /// As [`Readout::measure`].
    pub fn go_on(&mut self, source: &mut dyn ConductanceSource, volts: &mut [f64]) -> Result<(), Refusal> {
        let taxels = self.measurements_per_frame();
        if source.taxels() != taxels {
            let found = source.taxels();
            return Err(Refusal::new(format!("the source has {found} taxels; the readout {taxels}")));
        }
        self.engine.run(&mut self.effects, self.row, source, volts)?;
        self.row += volts.len() as u64;
        Ok(())
    }

    /// Saves or loads where it is in its session and what its effects remember, for a readout of the same profile,
    /// mode, layout, device and session. A readout [`with_codes`](Readout::with_codes) has its cells apart.
    pub fn exchange(&mut self, state: &mut Snapshot) {
        state.u64(&mut self.row);
        state.u64(&mut self.block);
        state.flag(&mut self.continuous);
        self.effects.iter_mut().for_each(|effect| effect.exchange(state));
    }

    /// Records one block of `measurements` measurements for each of `sources`, with `gap_frames` unrecorded frames
    /// after each.
    ///
    /// # Errors
    /// As [`Readout::acquire`] and [`Recording::new`].
    pub fn record<S: ConductanceSource>(
        &mut self,
        presses: &mut [S],
        measurements: usize,
        gap_frames: u64,
    ) -> Result<Recording, Refusal> {
        let mut blocks = Vec::with_capacity(presses.len());
        for press in presses {
            blocks.push(self.acquire(press, measurements)?);
            self.skip(gap_frames);
        }
        self.recording(blocks)
    }

    /// A recording of `blocks`, which this readout acquired.
    ///
    /// # Errors
    /// [`Refusal`] if the blocks do not fit together.
    pub fn recording(&self, blocks: Vec<Block>) -> Result<Recording, Refusal> {
        Recording::new(self.info.clone(), blocks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::Interpolated;
    use crate::weights::{Jump, code_of};
    use spts_models::ConductanceMap;

    /// Pieces shorter and longer than a batch, and one measurement long.
    fn press() -> Interpolated {
        let times_s = [0.0, 0.000_1, 0.000_115, 0.000_13, 0.01, 0.02, 0.021].to_vec();
        let map = |k: u32| {
            let taxels = (0_u32..100).map(|t| 1e-6 * f64::from((t * 7 + k * 13) % 50));
            ConductanceMap::from_values(10, 10, taxels.collect())
        };
        let maps = (0..7).map(map).collect();
        Interpolated::new(times_s, maps).unwrap()
    }

    /// Cells of which every third puts out whatever comes.
    struct OutOfOrder(Weights);

    impl CellCodes for OutOfOrder {
        fn taxels(&self) -> usize {
            self.0.taxels()
        }

        fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), Refusal> {
            for (row, out) in (first_row..).zip(out.chunks_exact_mut(self.0.taxels())) {
                for (taxel, code) in (0_u32..).zip(out) {
                    let any = Jump::new(row).apply(taxel).to_le_bytes()[2];
                    *code = if taxel % 3 == 0 { any } else { code_of(self.0.level(taxel, row)) };
                }
            }
            Ok(())
        }
    }

    /// All effects and faults together, with the generator's levels and with others.
    #[test]
    fn the_cut_into_batches_does_not_show() {
        let mut profile = Profile::named("as_built").unwrap();
        let faults = "[[faults]]\nname = \"mis_seeded\"\ntaxel = 3\n[[faults]]\nname = \"drifting\"\ntaxel = 4\n\
                      [[faults]]\nname = \"skipping_clocks\"\ntaxel = 5\nprobability = 0.01\n";
        let (_, ideal) = crate::PROFILES.iter().find(|(name, _)| *name == "ideal").unwrap();
        profile.faults = Profile::from_toml(&format!("{ideal}{faults}")).unwrap().faults;
        let designed = Profile::named("as_designed").unwrap();
        for (effects, parts) in
            [(&mut profile.compressive, &designed.compressive), (&mut profile.raster, &designed.raster)]
        {
            for name in ["dac", "amplifier"] {
                effects.insert(name.to_owned(), parts[name].clone());
            }
            let missed = toml::from_str("probability = [0.0, 0.01]").unwrap();
            effects.insert("missed_clocks".to_owned(), toml::Value::Table(missed));
            assert_eq!(effects.len() - usize::from(effects.contains_key("clamp")), crate::EFFECTS.len() - 1);
        }
        // and without the converter, whose steps would hide a difference
        let mut analog = profile.clone();
        for name in ["adc", "clamp"] {
            analog.compressive.remove(name);
            analog.raster.remove(name);
        }
        let mut eight_bits = analog.clone();
        eight_bits.weights = crate::CompressiveWeights::Analog;
        let profiles = [&profile, &analog, &eight_bits].into_iter();
        let cases = profiles.flat_map(|p| [(p, Mode::Raster), (p, Mode::Compressive)]);
        for (profile, mode, in_order) in cases.flat_map(|(p, mode)| [(p, mode, true), (p, mode, false)]) {
            let volts = |batch: usize| {
                let mut readout = Readout::new(profile, mode, &SkinLayout::default(), Streams::new(8), 0).unwrap();
                let engine =
                    Engine::new(readout.engine.weights().clone(), profile.volts_per_siemens(), profile.sample_rate_hz);
                readout.engine = engine.with_batch(batch);
                if !in_order {
                    let cells = OutOfOrder(readout.engine.weights().clone());
                    readout = readout.with_codes(Box::new(cells)).unwrap();
                }
                let recording = readout.record(&mut [press(), press()], 2000, 57).unwrap();
                let bits = |block: &Block| block.volts.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
                recording.blocks().iter().map(bits).collect::<Vec<_>>()
            };
            let whole = volts(128);
            for batch in [1, 7, 64] {
                assert!(volts(batch) == whole, "{mode:?}, in order {in_order}: batches of {batch} differ");
            }
        }
    }
}
