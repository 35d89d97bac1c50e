//! The cells' firmware on emulated controllers, compared with the weights that the twin assumes.

use rayon::prelude::*;
use serde::{Serialize, Serializer};
use spts::chain::{RASTER_PERIOD, bus, start_message};
use spts::progress::Progress;
use spts_circuit::{Patterns, Seeding, WeightMode, Weights};
use spts_firmware::attiny412::{Device, OSCILLATOR_HZ, TraceRecord};
use spts_firmware::{Array, Cell, Clock, FIRST_ADDRESS, Image, REPLY_BYTES};
use spts_input::Refusal;
use std::error::Error;
use std::path::Path;
use std::time::Instant;

/// Rate for which the skin is designed, edges a second.
pub const DESIGN_EDGE_HZ: f64 = 72_000.0;
/// Edges of a block of codes and levels: a few megabytes.
const BLOCK: usize = 4096;
/// Time between a write over the bus and the first edge, ticks.
const SETTLED_TICKS: u64 = 2000;

/// How cells are started. As text: its `mode`, and for a pattern also its `period`.
///
/// ```
/// use spts_circuit::WeightMode;
/// use spts_studies::firmware::CellTask;
///
/// let pattern = CellTask { mode: WeightMode::Binary, period: Some(20) };
/// assert_eq!((pattern.mode(), pattern.name().as_str()), ("pattern", "pattern 20"));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CellTask {
    /// Mode of the generator or the raster, whose levels the codes are.
    pub mode: WeightMode,
    /// Number of bits of a pattern, in [1, 64]: the first outputs of cells with mixed seeds. `None` for cells that are
    /// started with seeds.
    pub period: Option<usize>,
}

impl CellTask {
    /// Name of the mode.
    pub fn mode(self) -> &'static str {
        self.period.map_or(self.mode.name(), |_| "pattern")
    }

    /// Name of the mode, with the number of bits for a pattern.
    pub fn name(self) -> String {
        self.period.map_or_else(|| self.mode().to_owned(), |period| format!("pattern {period}"))
    }

    /// The twin's weights of `cells` cells that are started with this.
    fn weights(self, seeding: Seeding, cells: usize) -> Result<Weights, Refusal> {
        let taxels = u32::try_from(cells).unwrap_or(u32::MAX);
        let Some(period) = self.period else {
            return Ok(Weights::new(self.mode, seeding, taxels));
        };
        let mut codes = vec![0; period * cells];
        Weights::new(self.mode, Seeding::Mixed, taxels).fill_codes(0, &mut codes);
        Weights::with_patterns(self.mode, Patterns::new(period, codes)?)
    }
}

impl Serialize for CellTask {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Text {
            mode: &'static str,
            #[serde(skip_serializing_if = "Option::is_none")]
            period: Option<usize>,
        }
        Text { mode: self.mode(), period: self.period }.serialize(serializer)
    }
}

/// Emulated cells, their clock, and for how long they run.
#[derive(Debug, Clone)]
pub struct EmulatedCells {
    /// Name of the image.
    pub image_name: String,
    /// The image of the cells.
    pub image: Image,
    /// Cells on the bus; [1, 112].
    pub cells: usize,
    /// Number of edges in every mode.
    pub edges: u64,
    /// Tasks of the cells, one after another.
    pub tasks: Vec<CellTask>,
    /// Seeds of the cells: one byte as in the publication, or 32 bits by the extended command.
    pub seeding: Seeding,
    /// Clock.
    pub clock: Clock,
}

/// The image called `name`: `shipped`, `plain`, or a file in Intel's hex format.
///
/// # Errors
/// [`Refusal`] if there is none.
pub fn image(name: &str) -> Result<Image, Refusal> {
    match name {
        "shipped" => Ok(Image::shipped()),
        "plain" => Ok(Image::plain()),
        file => Image::read(Path::new(file))
            .map_err(|e| Refusal::new(format!("`--image`: {e}; valid: shipped, plain, or a hex file"))),
    }
}

/// The first code of an emulated cell that differs from the weight that the twin computes by formula.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mismatch {
    /// Task of the cells.
    #[serde(flatten)]
    pub task: CellTask,
    /// Edge since loading the seeds, from 0.
    pub edge: u64,
    /// Taxel, from 0.
    pub taxel: usize,
    /// DAC code of the emulated cell.
    pub code: u8,
    /// Level of that code.
    pub level: f64,
    /// The twin's weight.
    pub expected_level: f64,
}

/// How many codes and replies of emulated cells differ from the twin's in one mode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModeVerification {
    /// Task of the cells.
    #[serde(flatten)]
    pub task: CellTask,
    /// Number of codes, out of cells × edges, that differ from the twin's.
    pub mismatches: u64,
    /// Number of cells whose final reply (mode, state, counter, code) differs from that of the behavioural cell.
    pub read_back_mismatches: usize,
}

/// Results of `spts firmware verify`: whether emulated cells put out the weights that the twin computes by formula.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verification {
    /// Name of the image.
    pub image: String,
    /// Number of cells on the bus.
    pub cells: usize,
    /// Number of clock edges in every mode.
    pub edges: u64,
    /// Rate of the clock, Hz.
    pub edge_hz: f64,
    /// Number of codes and replies that differ from the twin's, over all modes.
    pub mismatches: u64,
    /// The first code that differs.
    pub first_mismatch: Option<Mismatch>,
    /// Results for each mode.
    pub modes: Vec<ModeVerification>,
    /// Number of instructions that the cells executed.
    pub instructions: u64,
    /// Wall time of the emulation and the comparison, s.
    pub seconds: f64,
    /// Emulated instructions a second, summed over all threads.
    pub instructions_per_s: f64,
}

impl EmulatedCells {
    /// The twin's weights of these cells. The firmware's raster counts to a hundred, however many cells there are.
    fn expected_weights(&self, task: CellTask) -> Result<Weights, Refusal> {
        let taxels = if task.mode == WeightMode::Raster { RASTER_PERIOD } else { self.cells };
        task.weights(self.seeding, taxels).map_err(|e| self.unusable(e))
    }

    /// Cells that have just been powered up and seeded.
    ///
    /// # Errors
    /// [`Refusal`] when there are too many, or one does not answer.
    fn started(&self, task: CellTask) -> Result<Array, Refusal> {
        bus(&self.expected_weights(task)?, 0, self.cells, &self.image).map_err(|e| self.unusable(e))
    }

    /// What is wrong with these cells, as an error.
    fn unusable(&self, failure: impl Error + Send + Sync + 'static) -> Refusal {
        Refusal::from_error(failure).at(format!("image {}", self.image_name))
    }

    /// A taxel that these cells do not have, as an error.
    fn no_such(&self, taxel: usize) -> Refusal {
        Refusal::new(format!("taxel {taxel} is outside [0, {}]", self.cells.saturating_sub(1)))
    }

    /// Runs the cells in every mode and compares.
    ///
    /// # Errors
    /// [`Refusal`] if the array cannot be built, or a cell does not answer.
    pub fn verify(&self, progress: &dyn Progress) -> Result<Verification, Refusal> {
        progress.stage("clocking the cells", Some(self.blocks().saturating_mul(self.tasks.len())));
        let started = Instant::now();
        let (mut modes, mut first_mismatch, mut instructions) = (Vec::new(), None, 0);
        for &task in &self.tasks {
            let mut array = self.started(task)?;
            let mismatches = self.compare(task, &mut array, &mut first_mismatch, progress)?;
            let read_back_mismatches = self.read_back(task, &mut array)?;
            instructions += array.instructions();
            modes.push(ModeVerification { task, mismatches, read_back_mismatches });
        }
        progress.end();
        let seconds = started.elapsed().as_secs_f64();
        let instructions_per_s = instructions as f64 / seconds;
        Ok(Verification {
            image: self.image_name.clone(),
            cells: self.cells,
            edges: self.edges,
            edge_hz: self.clock.edge_hz,
            mismatches: modes.iter().map(|m| m.mismatches + m.read_back_mismatches as u64).sum(),
            first_mismatch,
            modes,
            instructions,
            seconds,
            instructions_per_s,
        })
    }

    /// Number of codes that are not the twin's.
    fn compare(
        &self,
        task: CellTask,
        array: &mut Array,
        first: &mut Option<Mismatch>,
        progress: &dyn Progress,
    ) -> Result<u64, Refusal> {
        let (weights, mode) = (self.expected_weights(task)?, task.mode);
        let taxels = weights.taxels();
        let (mut levels, mut mismatches) = (Vec::new(), 0);
        self.clock(array, progress, |done, codes| {
            levels.resize(codes.len() / self.cells * taxels, 0.0);
            weights.fill_rows(done, &mut levels);
            let edges = codes.chunks_exact(self.cells).zip(levels.chunks_exact(taxels));
            for (edge, (codes, levels)) in (done..).zip(edges) {
                // a cell beyond the raster's hundred is never selected
                let expected = levels.iter().copied().chain(std::iter::repeat(0.0));
                for ((taxel, &code), expected) in codes.iter().enumerate().zip(expected) {
                    let level = mode.code_level(code);
                    if level.to_bits() != expected.to_bits() {
                        mismatches += 1;
                        first.get_or_insert(Mismatch { task, edge, taxel, code, level, expected_level: expected });
                    }
                }
            }
            Ok(())
        })?;
        Ok(mismatches)
    }

    /// Number of blocks of edges.
    fn blocks(&self) -> usize {
        usize::try_from(self.edges).unwrap_or(usize::MAX).div_ceil(BLOCK)
    }

    /// Clocks `array` through all edges, block by block, so that any number of them fits into memory: `block` gets the
    /// number of edges before, and the codes of every edge and cell.
    fn clock(
        &self,
        array: &mut Array,
        progress: &dyn Progress,
        mut block: impl FnMut(u64, &[u8]) -> Result<(), Refusal>,
    ) -> Result<(), Refusal> {
        let (mut codes, mut done) = (Vec::new(), 0);
        while done < self.edges {
            let edges = usize::try_from(self.edges - done).map_or(BLOCK, |left| left.min(BLOCK));
            codes.resize(edges * self.cells, 0);
            array.clock(self.clock, &mut codes).map_err(|e| self.unusable(e))?;
            block(done, &codes)?;
            done += edges as u64;
            progress.step();
        }
        Ok(())
    }

    /// Number of cells that, asked over the bus, do not give the reply of the behavioural cell: mode, state, counter
    /// and code.
    fn read_back(&self, task: CellTask, array: &mut Array) -> Result<usize, Refusal> {
        let weights = self.expected_weights(task)?;
        let expected: Vec<_> = (0..self.cells).into_par_iter().map(|taxel| self.reply(&weights, taxel)).collect();
        let mut wrong = 0;
        for (address, expected) in (FIRST_ADDRESS..).zip(expected) {
            let mut reply = [0; REPLY_BYTES];
            array.read(address, &mut reply).map_err(|e| self.unusable(e))?;
            wrong += usize::from(expected.map_err(|e| self.unusable(e))? != reply);
        }
        Ok(wrong)
    }

    /// What the cell of `taxel` replies after all edges.
    fn reply(&self, weights: &Weights, taxel: usize) -> Result<[u8; REPLY_BYTES], Refusal> {
        let mut cell = Cell::new(FIRST_ADDRESS.saturating_add(u8::try_from(taxel).unwrap_or(u8::MAX)))?;
        cell.receive(&start_message(weights, taxel, cell.address())?);
        for _ in 0..self.edges {
            cell.edge();
        }
        let mut reply = [0; REPLY_BYTES];
        cell.read(&mut reply);
        Ok(reply)
    }

    /// Gives `block` the weights in [−1, 1] that the cells, started with `task`, put out: of all edges in order, some
    /// at once, edges × cells, row-major.
    ///
    /// # Errors
    /// [`Refusal`] if a cell does not answer, and those of `block`.
    pub fn weights(
        &self,
        task: CellTask,
        progress: &dyn Progress,
        block: &mut dyn FnMut(&[f64]) -> Result<(), Refusal>,
    ) -> Result<(), Refusal> {
        progress.stage("clocking the cells", Some(self.blocks()));
        self.clock(&mut self.started(task)?, progress, |_, codes| {
            block(&codes.iter().map(|code| task.mode.code_level(*code)).collect::<Vec<_>>())
        })?;
        progress.end();
        Ok(())
    }

    /// Calls `line` for every step of the cell of `taxel`, started with `task`, during [`EmulatedCells::edges`] edges.
    ///
    /// # Errors
    /// [`Refusal`] if there is no such taxel, or a cell does not answer.
    #[expect(clippy::cast_possible_truncation, reason = "ticks of seconds stay far below 2^52")]
    pub fn trace(&self, task: CellTask, taxel: usize, line: &mut dyn FnMut(&TraceRecord)) -> Result<(), Refusal> {
        let cell = self.started(task)?.cells().get(taxel).cloned();
        let mut device = cell.ok_or_else(|| self.no_such(taxel))?;
        let (start, period_ticks) = (device.now() + SETTLED_TICKS, OSCILLATOR_HZ / self.clock.edge_hz);
        let tick = |edge: u64| start + (edge as f64 * period_ticks).round() as u64;
        for edge in 0..self.edges {
            device.trace_until(tick(edge), &mut *line);
            device.set_clock(edge % 2 == 0);
            device.trace_until(tick(edge + 1), &mut *line);
        }
        Ok(())
    }

    /// Calls `line` for the first `ticks` ticks of the cell of `taxel` after power-on.
    ///
    /// # Errors
    /// [`Refusal`] if there is no such taxel.
    pub fn trace_from_reset(
        &self,
        taxel: usize,
        ticks: u64,
        line: &mut dyn FnMut(&TraceRecord),
    ) -> Result<(), Refusal> {
        let address = u8::try_from(taxel).ok().and_then(|taxel| FIRST_ADDRESS.checked_add(taxel));
        let address = address.filter(|_| taxel < self.cells).ok_or_else(|| self.no_such(taxel))?;
        let program = Device::program(self.image.flash()).map_err(|e| self.unusable(e))?;
        Device::new(program, &[address]).trace_until(ticks, line);
        Ok(())
    }
}

/// What `spts firmware verify` prints: codes that differ, one line for each mode.
pub fn verification_text(v: &Verification) -> String {
    let mut out =
        format!("image {}: {} cells, {} edges a mode at {:.1} kHz\n", v.image, v.cells, v.edges, v.edge_hz / 1e3);
    for m in &v.modes {
        out.push_str(&format!(
            "{:<10} {} mismatches, {} of {} cells read back wrong\n",
            m.task.name(),
            m.mismatches,
            m.read_back_mismatches,
            v.cells
        ));
    }
    if let Some(m) = v.first_mismatch {
        out.push_str(&format!(
            "first mismatch: {}, edge {}, taxel {} (address {}): code {}, level {:.3} for {:.3}\n",
            m.task.name(),
            m.edge,
            m.taxel,
            m.taxel + usize::from(FIRST_ADDRESS),
            m.code,
            m.level,
            m.expected_level,
        ));
        if v.modes.iter().all(|mode| mode.read_back_mismatches == 0) {
            out.push_str("all cells are in step: these codes came after the sample\n");
        }
    }
    let millions = v.instructions as f64 / 1e6;
    out.push_str(&format!("{millions:.0} million instructions, {:.0} million a second", v.instructions_per_s / 1e6));
    out
}
