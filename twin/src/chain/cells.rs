//! Emulated cells of a skin: what their firmware puts out, row by row.

use spts_circuit::{CellCodes, Patterns, WeightMode, Weights};
use spts_firmware::{
    Array, CellMode, Clock, FIRST_ADDRESS, Image, LAST_ADDRESS, LAST_BUS_ADDRESS, PATTERN_BITS, Pattern,
};
use spts_input::Refusal;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Cells on a bus.
const BUS_CELLS: usize = (LAST_BUS_ADDRESS - FIRST_ADDRESS) as usize + 1;
/// Edges after which the firmware's raster scan starts again.
pub const RASTER_PERIOD: usize = (LAST_ADDRESS - FIRST_ADDRESS) as usize + 1;
/// Rows that are clocked at a time on the way to a row.
const STRIDE: u64 = 1024;

/// Emulated cells that run the shipped firmware. One bus serves up to 112 cells; the cells are seeded over the bus and
/// clocked at the rate of the measurements. Every bus uses the same addresses; the seeds continue from bus to bus.
///
/// Every edge is emulated, including those between recorded blocks. To reach an earlier row, the emulation starts again
/// from the seeds.
///
/// ```
/// use spts::chain::FirmwareCells;
/// use spts::circuit::CellCodes as _;
/// use spts::{Seeding, WeightMode, Weights};
///
/// let weights = Weights::new(WeightMode::Binary, Seeding::Address, 10);
/// let mut emulated = FirmwareCells::new(&weights, 64_300.0)?;
/// let (mut codes, mut formula) = ([0; 200], [0; 200]);
/// emulated.codes(0, &mut codes)?;
/// weights.fill_codes(0, &mut formula);
/// assert_eq!(codes, formula, "20 rows of 10 cells");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct FirmwareCells {
    /// The cells as they are before row 0.
    seeded: Vec<Array>,
    buses: Vec<Array>,
    taxels: usize,
    clock: Clock,
    /// Row that the next clock edge selects.
    row: u64,
    /// Codes of one bus.
    of_bus: Vec<u8>,
    /// Weights that fault-free cells put out.
    weights: Weights,
    levels: Vec<f64>,
    /// Number of codes so far that differ from those of fault-free cells.
    unlike: Arc<AtomicU64>,
}

impl FirmwareCells {
    /// Freshly seeded cells that are to put out `weights` at `sample_rate_hz` measurements a second. The output is
    /// sampled 11 µs after the edge, as on the real skin; with a faster clock, after the same share of a period.
    ///
    /// # Errors
    /// [`Refusal`] for a raster scan of other than 100 taxels, or an array or clock that the emulation does not
    /// support.
    pub fn new(weights: &Weights, sample_rate_hz: f64) -> Result<Self, Refusal> {
        Self::check(weights, sample_rate_hz)?;
        let taxels = weights.taxels();
        let image = Image::shipped();
        let firsts = (0..taxels).step_by(BUS_CELLS);
        let buses = firsts
            .map(|first| bus(weights, first, BUS_CELLS.min(taxels - first), &image))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            seeded: buses.clone(),
            buses,
            taxels,
            clock: Clock::at(sample_rate_hz),
            row: 0,
            of_bus: Vec::new(),
            weights: weights.clone(),
            levels: Vec::new(),
            unlike: Arc::default(),
        })
    }

    /// The same cells, counting in `unlike` every code that differs from `weights`. Cells differ when the clock is too
    /// fast for them.
    pub fn counting(self, unlike: Arc<AtomicU64>) -> Self {
        Self { unlike, ..self }
    }

    /// Counts the codes of rows from `first_row` on that are not those of sound cells.
    fn count_unlike(&mut self, first_row: u64, codes: &[u8]) {
        self.levels.resize(codes.len(), 0.0);
        self.weights.fill_rows(first_row, &mut self.levels);
        let mode = self.weights.mode();
        let pairs = codes.iter().zip(&self.levels);
        let unlike = pairs.filter(|(code, level)| mode.code_level(**code).to_bits() != level.to_bits());
        self.unlike.fetch_add(unlike.count() as u64, Ordering::Relaxed);
    }

    /// Whether cells can put out `weights` at `sample_rate_hz`.
    ///
    /// # Errors
    /// [`Refusal`] for a raster of other than 100 taxels, patterns that are longer than 64 rows or not ±1, and a rate
    /// outside [1, 1e6] Hz.
    pub fn check(weights: &Weights, sample_rate_hz: f64) -> Result<(), Refusal> {
        if !(1.0..=1e6).contains(&sample_rate_hz) {
            return Err(Refusal::new(format!(
                "the profile's `sample_rate_hz` = {sample_rate_hz} is outside [1, 1e6] Hz of the emulated clock"
            )));
        }
        let taxels = weights.taxels();
        if weights.mode() == WeightMode::Raster && taxels != RASTER_PERIOD {
            return Err(Refusal::new(format!(
                "a raster scan of {taxels} taxels: the firmware's raster has {RASTER_PERIOD}; other skins have `weights` = \"model\""
            )));
        }
        match weights.patterns() {
            Some(patterns) => fits(weights.mode(), patterns),
            None => Ok(()),
        }
    }

    /// Clocks as many rows as `out` holds.
    fn clock(&mut self, out: &mut [u8]) -> Result<(), Refusal> {
        let rows = out.len() / self.taxels;
        if let [only] = &mut self.buses[..] {
            only.clock(self.clock, out)?;
        } else {
            for (index, bus) in self.buses.iter_mut().enumerate() {
                let cells = bus.cells().len();
                self.of_bus.resize(rows * cells, 0);
                bus.clock(self.clock, &mut self.of_bus)?;
                let first = index * BUS_CELLS;
                for (row, codes) in out.chunks_exact_mut(self.taxels).zip(self.of_bus.chunks_exact(cells)) {
                    row[first..first + cells].copy_from_slice(codes);
                }
            }
        }
        self.row += rows as u64;
        Ok(())
    }

    /// Goes to where the next edge brings `row`.
    fn go_to(&mut self, row: u64) -> Result<(), Refusal> {
        if row < self.row {
            self.buses.clone_from(&self.seeded);
            self.row = 0;
        }
        let mut unused = Vec::new();
        while self.row < row {
            let rows = usize::try_from((row - self.row).min(STRIDE)).unwrap_or(usize::MAX);
            unused.resize(rows * self.taxels, 0);
            self.clock(&mut unused)?;
        }
        Ok(())
    }
}

/// The firmware's mode that the circuit calls `mode`.
pub fn cell_mode(mode: WeightMode) -> CellMode {
    match mode {
        WeightMode::Raster => CellMode::Raster,
        WeightMode::Analog => CellMode::Analog,
        WeightMode::Binary => CellMode::Binary,
    }
}

/// Whether cells hold `patterns` of levels of `mode`.
fn fits(mode: WeightMode, patterns: &Patterns) -> Result<(), Refusal> {
    let period = patterns.period();
    if mode == WeightMode::Binary && period <= PATTERN_BITS {
        return Ok(());
    }
    Err(unfit(mode, period))
}

/// The error of a pattern that cells cannot store.
fn unfit(mode: WeightMode, period: usize) -> Refusal {
    let levels = mode.name();
    Refusal::new(format!(
        "a pattern of {levels} levels and {period} rows: the firmware's cells hold ±1 and at most {PATTERN_BITS} rows; others have `weights` = \"model\""
    ))
}

/// The message that the bus master writes to the cell of `taxel` at `address` so that the cell puts out `weights`.
///
/// # Errors
/// [`Refusal`] for a pattern that cells cannot store.
pub fn start_message(weights: &Weights, taxel: usize, address: u8) -> Result<Vec<u8>, Refusal> {
    let mode = cell_mode(weights.mode());
    if let Some(patterns) = weights.patterns() {
        fits(weights.mode(), patterns)?;
        let bits = (0..patterns.period() as u64).map(|row| patterns.row(row)[taxel] > 127);
        let pattern = Pattern::of_bits(bits).map_err(|_| unfit(weights.mode(), patterns.period()))?;
        return Ok(pattern.message());
    }
    // the device's own way: one byte, the address
    let own = weights.mode() == WeightMode::Raster || weights.seed(taxel) == Some(u32::from(address));
    Ok(match weights.seed(taxel) {
        Some(seed) if !own => mode.extended(seed).to_vec(),
        _ => mode.pair(address).to_vec(),
    })
}

/// A bus with the cells of the taxels `first..first + cells`, seeded and started.
///
/// # Errors
/// [`Refusal`] for an array that the emulation does not support, or a pattern that cells cannot store.
pub fn bus(weights: &Weights, first: usize, cells: usize, image: &Image) -> Result<Array, Refusal> {
    let mut array = Array::new(cells, image)?;
    for (address, taxel) in (FIRST_ADDRESS..).zip(first..first + cells) {
        let message = start_message(weights, taxel, address)?;
        array.write(address, &message)?;
    }
    Ok(array)
}

impl CellCodes for FirmwareCells {
    fn taxels(&self) -> usize {
        self.taxels
    }

    fn codes(&mut self, first_row: u64, out: &mut [u8]) -> Result<(), Refusal> {
        let clocked = self.go_to(first_row).and_then(|()| self.clock(out));
        clocked.map_err(|error| error.at(format!("no codes from row {first_row} on")))?;
        self.count_unlike(first_row, out);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::{Seeding, check_codes};

    fn cells(weights: Weights) -> FirmwareCells {
        FirmwareCells::new(&weights, 64.3e3).unwrap()
    }

    #[test]
    fn the_cells_conform() {
        check_codes(&|| Box::new(cells(Weights::new(WeightMode::Analog, Seeding::Mixed, 3))));
    }

    /// The twin's rows of `weights` from row 5 on.
    fn assert_puts_out(weights: &Weights) {
        let (mut cells, mode, n) = (cells(weights.clone()), weights.mode(), weights.taxels());
        let (mut codes, mut levels) = (vec![0; 110 * n], vec![0.0; 110 * n]);
        cells.codes(5, &mut codes).unwrap();
        weights.fill_rows(5, &mut levels);
        for (i, (code, level)) in codes.iter().zip(&levels).enumerate() {
            let found = mode.code_level(*code);
            let (row, taxel) = (5 + i / n, i % n);
            assert_eq!(found.to_bits(), level.to_bits(), "{weights:?}, row {row}, taxel {taxel}: {found} ≠ {level}");
        }
    }

    /// On one bus and on two, of every length that cells hold.
    #[test]
    fn cells_repeat_their_patterns() {
        for (period, taxels) in [(1, 3), (7, 120), (20, 100), (64, 5)] {
            let codes = (0..period * taxels).map(|k| if (k * k + k / 5) % 11 < 5 { 255 } else { 0 });
            let patterns = Patterns::new(period, codes.collect()).unwrap();
            assert_puts_out(&Weights::with_patterns(WeightMode::Binary, patterns).unwrap());
        }
        for (mode, period) in [(WeightMode::Analog, 2), (WeightMode::Binary, 65)] {
            let patterns = Patterns::new(period, vec![255; 4 * period]).unwrap();
            let weights = Weights::with_patterns(mode, patterns).unwrap();
            let error = FirmwareCells::new(&weights, 64.3e3).unwrap_err().to_string();
            assert!(error.contains("at most 64 rows"), "{error}");
        }
    }

    /// On one bus and on three, with seeds of one byte, of more, and mixed.
    #[test]
    fn sound_cells_put_out_their_weights() {
        for (mode, seeding, taxels) in [
            (WeightMode::Raster, Seeding::Address, 100),
            (WeightMode::Raster, Seeding::Mixed, 100),
            (WeightMode::Analog, Seeding::Address, 260),
            (WeightMode::Binary, Seeding::Address, 113),
            (WeightMode::Binary, Seeding::Mixed, 120),
        ] {
            assert_puts_out(&Weights::new(mode, seeding, taxels));
        }
    }

    #[test]
    fn what_cannot_be_emulated_is_refused() {
        for taxels in [1, 99, 101, 144] {
            let weights = Weights::new(WeightMode::Raster, Seeding::Address, taxels);
            let error = FirmwareCells::new(&weights, 64.3e3).unwrap_err();
            let needed = format!("a raster scan of {taxels} taxels: the firmware's raster has 100");
            assert!(error.to_string().contains(&needed), "{error}");
        }
        let binary = Weights::new(WeightMode::Binary, Seeding::Address, 2);
        for rate_hz in [0.0, 2e6, f64::NAN, f64::INFINITY] {
            let error = FirmwareCells::new(&binary, rate_hz).unwrap_err().to_string();
            assert!(error.contains("sample_rate_hz") && error.contains("[1, 1e6]"), "{error}");
        }
    }
}
