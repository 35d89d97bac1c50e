//! The device: clock, cells, summing amplifiers and converters, from a source of conductance to volts.

use crate::effect::{BlockStart, Effect, EffectSession, FaultConfig};
use crate::engine::Engine;
use crate::profile::Profile;
use crate::recording::{Block, Recording, RecordingInfo};
use crate::source::{ConductanceSource, Segment};
use crate::weights::{CellCodes, Mode, WeightMode, Weights};
use crate::wires::Wires;
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
///
/// With several wires ([`Profile::wires`]) each has its own amplifier and converter, with parts and noise of their own.
/// Samples are in the order of [`Weights::wired`]; those of a raster scan are in the order of taxels, although the
/// wires are scanned at once.
pub struct Readout {
    info: RecordingInfo,
    lines: Vec<Line>,
    /// Row of the next measurement.
    row: u64,
    block: u64,
    continuous: bool,
}

/// One wire with its cells, amplifier and converter.
struct Line {
    engine: Engine,
    effects: Vec<Box<dyn Effect>>,
    volts: Vec<f64>,
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
        Self::with_cells(profile, mode, layout, device, session, false)
    }

    /// [`Readout::new`]; with `apart`, what a cell does is drawn from streams of its own. Its noise is another one
    /// then, and cells whose taxels do not conduct ([`Segment::fours`](crate::Segment::fours)) cost nothing.
    ///
    /// # Errors
    /// As [`Readout::new`].
    pub fn with_cells(
        profile: &Profile,
        mode: Mode,
        layout: &SkinLayout,
        device: Streams,
        session: u64,
        apart: bool,
    ) -> Result<Self, Refusal> {
        let taxels = u32::try_from(layout.taxels()).unwrap_or(u32::MAX);
        let profile = &profile.on(layout)?;
        profile.validate(taxels)?;
        let weights = profile.weights(mode, taxels)?.wired(Wires::new(&profile.wires, layout)?)?;
        let lines = (0..weights.wire_count()).map(|wire| Line::new(profile, &weights, wire, device, session, apart));
        let lines: Vec<Line> = lines.collect::<Result<_, _>>()?;
        let rates_hz = lines.iter().map(|line| line.engine.sample_rate_hz());
        let info = RecordingInfo {
            converter: profile.converter(mode)?,
            ..RecordingInfo::new(*layout, weights, rates_hz.sum())
        };
        Ok(Self { info, lines, row: 0, block: 0, continuous: true })
    }

    /// The same readout with cells that put out given codes in place of the generator's formula: `cells` makes those
    /// of a wire from its weights. If the codes equal the formula's, the recording is the same bit for bit. Effects and
    /// faults act on them as on the generator's levels. Where a fault determines the level of a cell, or an effect
    /// makes the cell miss an edge, the formula's level replaces the code.
    ///
    /// # Errors
    /// Those of `cells`, and [`Refusal`] if the number of cells differs from that of taxels.
    pub fn with_codes(
        self,
        mut cells: impl FnMut(&Weights) -> Result<Box<dyn CellCodes>, Refusal>,
    ) -> Result<Self, Refusal> {
        let lines = self.lines.into_iter().map(|line| {
            let codes = cells(line.engine.weights())?;
            let (cells, taxels) = (codes.taxels(), line.engine.weights().taxels());
            if cells != taxels {
                let readout = format!("the readout has {taxels} taxels");
                return Err(Refusal::new(format!("the codes are those of {cells} cells; {readout}")));
            }
            Ok(Line { engine: line.engine.with_codes(codes), ..line })
        });
        Ok(Self { lines: lines.collect::<Result<_, _>>()?, ..self })
    }

    /// Weights that the cells are meant to put out.
    pub fn weights(&self) -> &Weights {
        &self.info.weights
    }

    /// Metadata of its recordings.
    pub fn info(&self) -> &RecordingInfo {
        &self.info
    }

    /// Number of measurements in a frame.
    pub fn measurements_per_frame(&self) -> usize {
        self.info.measurements_per_frame
    }

    /// Number of measurements a second, of all wires together, Hz.
    pub fn sample_rate_hz(&self) -> f64 {
        self.info.sample_rate_hz
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
        for (wire, line) in self.lines.iter_mut().enumerate() {
            let first_row = self.info.weights.before(wire, self.row);
            let start = BlockStart { block: self.block, first_row, continuous: self.continuous };
            line.effects.iter_mut().for_each(|effect| effect.begin_block(&start));
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
        let taxels = self.info.layout.taxels();
        if source.taxels() != taxels {
            let found = source.taxels();
            return Err(Refusal::new(format!("the source has {found} taxels; the readout {taxels}")));
        }
        let (weights, end) = (&self.info.weights, self.row + volts.len() as u64);
        let Some(wires) = weights.wires() else {
            let Line { engine, effects, .. } = &mut self.lines[0];
            engine.run(effects, self.row, source, volts)?;
            self.row = end;
            return Ok(());
        };
        for (wire, line) in self.lines.iter_mut().enumerate() {
            let (first, last) = (weights.before(wire, self.row), weights.before(wire, end));
            #[expect(clippy::cast_possible_truncation, reason = "no more than in `volts`")]
            line.volts.resize((last - first) as usize, 0.0);
            let mut own = OnWire { source, taxels: wires.taxels(wire), from_s: Vec::new(), to_s: Vec::new() };
            line.engine.run(&mut line.effects, first, &mut own, &mut line.volts)?;
        }
        let mut own: Vec<_> = self.lines.iter().map(|line| line.volts.iter()).collect();
        for (row, out) in (self.row..).zip(volts) {
            #[expect(clippy::cast_possible_truncation, reason = "less than the taxels or the wires")]
            let wire = match weights.mode() {
                WeightMode::Raster => wires.of((row % taxels as u64) as usize),
                _ => (row % wires.count() as u64) as usize,
            };
            *out = own[wire].next().copied().unwrap_or(f64::NAN);
        }
        self.row = end;
        Ok(())
    }

    /// Saves or loads where it is in its session and what its effects remember, for a readout of the same profile,
    /// mode, layout, device and session. A readout [`with_codes`](Readout::with_codes) has its cells apart.
    pub fn exchange(&mut self, state: &mut Snapshot) {
        state.u64(&mut self.row);
        state.u64(&mut self.block);
        state.flag(&mut self.continuous);
        self.lines.iter_mut().flat_map(|line| &mut line.effects).for_each(|effect| effect.exchange(state));
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

impl Line {
    /// Wire number `wire` of a skin with these `weights` and this `profile`, which is scaled for it. A wire with fewer
    /// taxels than another takes as long for a raster scan.
    fn new(
        profile: &Profile,
        weights: &Weights,
        wire: usize,
        device: Streams,
        session: u64,
        cells_apart: bool,
    ) -> Result<Self, Refusal> {
        let (mode, own) = (weights.mode().readout(), weights.of_wire(wire));
        let label = match mode {
            Mode::Raster => "readout/raster",
            Mode::Compressive => "readout/compressive",
        };
        let mut profile = profile.clone();
        let (mut device, mut sample_rate_hz) = (device, profile.sample_rate_hz);
        if let Some(wires) = weights.wires() {
            device = device.child("wire", wire as u64);
            let place = |taxel: u32| wires.taxels(wire).binary_search(&taxel).ok();
            let faults = profile.faults.into_iter().filter_map(|fault| {
                let taxel = u32::try_from(place(fault.taxel)?).ok()?;
                Some(FaultConfig { taxel, ..fault })
            });
            profile.faults = faults.collect();
            if mode == Mode::Raster {
                sample_rate_hz *= own.taxels() as f64 / wires.most_taxels() as f64;
            }
        }
        let session = EffectSession {
            device: device.child("readout/device", 0),
            streams: device.child("session", session).child(label, 0),
            weights: own.clone(),
            feedback_ohm: profile.feedback_ohm,
            sample_rate_hz,
            cells_apart,
        };
        let effects = profile.effects(mode, &session)?;
        let engine = Engine::new(own, profile.volts_per_siemens(), sample_rate_hz);
        Ok(Self { engine, effects, volts: Vec::new() })
    }
}

/// What one wire sees of a source.
struct OnWire<'a> {
    source: &'a mut dyn ConductanceSource,
    taxels: &'a [u32],
    from_s: Vec<f64>,
    to_s: Vec<f64>,
}

impl ConductanceSource for OnWire<'_> {
    fn taxels(&self) -> usize {
        self.taxels.len()
    }

    fn segment(&mut self, time_s: f64) -> Segment<'_> {
        let segment = self.source.segment(time_s);
        let own = |all: &[f64], own: &mut Vec<f64>| {
            own.clear();
            own.extend(self.taxels.iter().map_while(|taxel| all.get(*taxel as usize)));
        };
        own(segment.conductance_s, &mut self.from_s);
        let end_conductance_s = segment.end_conductance_s.map(|all| {
            own(all, &mut self.to_s);
            &self.to_s[..]
        });
        Segment { conductance_s: &self.from_s, end_conductance_s, fours: None, ..segment }
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

    /// Profiles with all effects and faults: as built, without a converter, and that with eight bits.
    fn with_everything() -> [Profile; 3] {
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
        let eight_bits = Profile { weights: crate::CompressiveWeights::Analog, ..analog.clone() };
        [profile, analog, eight_bits]
    }

    /// What is said of the taxels that conduct saves time and changes no bit.
    #[test]
    fn taxels_that_conduct_nothing_add_nothing() {
        for profile in &with_everything() {
            for mode in [Mode::Raster, Mode::Compressive] {
                let mut readouts =
                    [0; 2].map(|_| Readout::new(profile, mode, &SkinLayout::default(), Streams::new(8), 0).unwrap());
                let mut some = crate::Constant::new(ConductanceMap::zeros(10, 10)).unwrap();
                for k in 0..3_u32 {
                    // some that conducted before do no more
                    let conducting = [[3_u32, 4, 5], [41, 97, 4], [5, 98, 0]][k as usize];
                    let before = (0..100).map(|taxel| (taxel, 0.0));
                    let now = conducting.map(|taxel| (taxel as usize, 1e-5 * f64::from((k + 1) * (taxel % 7 + 1))));
                    some.change(before.chain(now), conducting).unwrap();
                    let mut all = crate::Constant::new(some.map().clone()).unwrap();
                    let sources: [&mut dyn ConductanceSource; 2] = [&mut some, &mut all];
                    let mut found = readouts.iter_mut().zip(sources).map(|(readout, source)| {
                        readout.measure(source, 600).unwrap().into_iter().map(f64::to_bits).collect::<Vec<_>>()
                    });
                    assert!(found.next() == found.next(), "{mode:?}, step {k}");
                }
            }
        }
    }

    /// All effects and faults together, with the generator's levels and with others.
    #[test]
    fn the_cut_into_batches_does_not_show() {
        let profiles = with_everything();
        let cases = profiles.iter().flat_map(|p| [(p, Mode::Raster), (p, Mode::Compressive)]);
        for (profile, mode, in_order) in cases.flat_map(|(p, mode)| [(p, mode, true), (p, mode, false)]) {
            let volts = |batch: usize| {
                let mut readout = Readout::new(profile, mode, &SkinLayout::default(), Streams::new(8), 0).unwrap();
                let engine =
                    Engine::new(readout.weights().clone(), profile.volts_per_siemens(), profile.sample_rate_hz);
                readout.lines[0].engine = engine.with_batch(batch);
                if !in_order {
                    readout = readout.with_codes(|weights| Ok(Box::new(OutOfOrder(weights.clone())))).unwrap();
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

    fn volts(profile: &Profile, mode: Mode, pieces: &[usize]) -> Vec<f64> {
        let mut readout = Readout::new(profile, mode, &SkinLayout::default(), Streams::new(8), 0).unwrap();
        let (mut press, mut volts) = (press(), Vec::new());
        readout.begin();
        for piece in pieces {
            let start_s = volts.len() as f64 / readout.sample_rate_hz();
            let mut more = vec![0.0; *piece];
            readout.go_on(&mut press.starting_at(start_s), &mut more).unwrap();
            volts.extend(more);
        }
        volts
    }

    /// On ideal wires every sample is Φx, whatever the wires; and one that is said to be one wire is as if nothing was.
    #[test]
    fn several_wires_add_up_their_own_taxels() {
        let ideal = Profile::named("ideal").unwrap();
        let held = ConductanceMap::from_values(10, 10, (0..100).map(|k| 1e-6 * f64::from(k % 13)).collect());
        for wires in ["bands = 3", "round_robin = 8", "blocks = [2, 5]", "bands = 100"] {
            let entry = toml::from_str(wires).unwrap();
            let profile = Profile { wires: vec![entry], ..ideal.clone() };
            for mode in [Mode::Raster, Mode::Compressive] {
                let mut readout = Readout::new(&profile, mode, &SkinLayout::default(), Streams::new(8), 0).unwrap();
                readout.seek_row(0, 1234);
                let mut source = crate::Constant::new(held.clone()).unwrap();
                let volts = readout.measure(&mut source, 217).unwrap();
                let mut sums = vec![0.0; 217];
                readout.weights().weighted_sums(1234, held.values(), &mut sums);
                for (v, sum) in volts.iter().zip(&sums) {
                    let expected = sum * profile.volts_per_siemens();
                    // sums of at most 100 terms of 0.06 V, rounded
                    assert!((v - expected).abs() < 1e-13, "{wires}, {mode:?}: {v} {expected}");
                }
            }
        }
        let one = Profile { wires: vec![crate::WireConfig::bands(1)], ..ideal.clone() };
        for mode in [Mode::Raster, Mode::Compressive] {
            assert_eq!(volts(&one, mode, &[1000]), volts(&ideal, mode, &[1000]));
        }
    }

    /// Each wire of a skin as built has the time of the clock's edges, and the cut into calls does not show.
    #[test]
    fn wires_are_clocked_together() {
        let text = "seeding = \"mixed\"\nweights = \"binary\"\nsample_rate_hz = 64300\ndrive_v = 4.3\nfeedback_ohm = 1000\n\
                    [[wires]]\nround_robin = 4\n[[faults]]\nname = \"dead\"\ntaxel = 41\n[compressive.idle_noise]\nsd_v = 0.02\n\
                    [raster.idle_noise]\nsd_v = 0.02\n";
        let profile = Profile::from_toml(text).unwrap();
        for mode in [Mode::Raster, Mode::Compressive] {
            let readout = Readout::new(&profile, mode, &SkinLayout::default(), Streams::new(8), 0).unwrap();
            assert!((readout.sample_rate_hz() - 4.0 * 64_300.0).abs() < 1e-6, "25 taxels on each of four wires");
            let whole = volts(&profile, mode, &[1200]);
            let pieces = volts(&profile, mode, &[400, 400, 400]);
            // time 0 of a piece is that of its first sample: an interpolated conductance is rounded
            assert!(whole.iter().zip(&pieces).all(|(a, b)| (a - b).abs() < 1e-9), "{mode:?}");
            // neighbouring wires have noise of their own
            let [a, b] = [0, 1].map(|k| whole[k..].iter().step_by(4).take(5).map(|v| v.to_bits()).collect::<Vec<_>>());
            assert_ne!(a, b);
        }
    }
}
