//! Emulated cells on one bus and one clock line.

mod bus;
mod clock;
mod error;
mod master;

use rayon::prelude::*;

use crate::attiny412::{Device, OSCILLATOR_HZ};
use crate::cell::{CellMode, FIRST_ADDRESS, LAST_BUS_ADDRESS};
use crate::image::Image;
use crate::pattern::Pattern;
use bus::Stage;
use clock::{Follower, Train, ticks};

pub use bus::{BusError, BusEvent, BusReply};
pub use clock::{Clock, SKIN_EDGE_HZ, SKIN_SAMPLE_DELAY_S};
pub use error::ArrayError;

/// Cells that fit on a bus.
const CELLS_MAX: usize = (LAST_BUS_ADDRESS - FIRST_ADDRESS) as usize + 1;
/// Ticks of clocked cells, all together, from which threads pay: some 0.2 ms of work. Without edges nearly all cells
/// sleep.
const PARALLEL_TICKS: u64 = 200_000;
/// From power-on to the first transaction (s): the cells' start-up is long over.
const POWER_UP_S: f64 = 1e-3;
/// Longest time to pass at once (s), a day: far below what the count of ticks holds.
const IDLE_MAX_S: f64 = 86_400.0;

/// Emulated cells at consecutive addresses from 8, on one I²C bus at 400 kHz and one clock line.
///
/// Every cell is an ATtiny412 that runs the same image, with its address in the first byte of its EEPROM. All share one
/// time. A clone is a snapshot that continues exactly as the original does. Results do not depend on the number of
/// threads, because cells interact only over the bus.
#[derive(Debug, Clone)]
pub struct Array {
    cells: Vec<Device>,
    followers: Vec<Follower>,
    /// Tick up to which every cell has run.
    now: u64,
    train: Option<Train>,
    stage: Stage,
}

impl Array {
    /// `cells` cells that run `image`, 1 ms after power-on.
    ///
    /// # Errors
    /// [`ArrayError::Cells`] for no cell or more than 112, [`ArrayError::Program`] for an image larger than the flash.
    pub fn new(cells: usize, image: &Image) -> Result<Self, ArrayError> {
        if cells == 0 || cells > CELLS_MAX {
            return Err(ArrayError::Cells { cells });
        }
        let program = Device::program(image.flash())?;
        let cell = |k| Device::new(program.clone(), &[Self::address(k)]);
        let mut array = Self {
            cells: (0..cells).map(cell).collect(),
            followers: vec![Follower::default(); cells],
            now: 0,
            train: None,
            stage: Stage::default(),
        };
        array.idle(POWER_UP_S)?;
        Ok(array)
    }

    /// The cells, in order of address.
    #[must_use]
    pub fn cells(&self) -> &[Device] {
        &self.cells
    }

    /// The cell with the given `address`, to reset it. If the cell is run ahead of the others, it gets its next edge
    /// late.
    pub fn cell_mut(&mut self, address: u8) -> Option<&mut Device> {
        let k = address.checked_sub(FIRST_ADDRESS)?;
        self.cells.get_mut(usize::from(k))
    }

    /// Time since power-on (s).
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.now as f64 / OSCILLATOR_HZ
    }

    /// Instructions executed by all cells.
    #[must_use]
    pub fn instructions(&self) -> u64 {
        self.cells.iter().map(Device::instructions).sum()
    }

    /// Starts a session as the bus master does: writes `mode` and its address to every cell.
    ///
    /// # Errors
    /// [`BusError`] if a cell does not answer.
    pub fn start(&mut self, mode: CellMode) -> Result<(), BusError> {
        for k in 0..self.cells.len() {
            let address = Self::address(k);
            self.write(address, &mode.pair(address))?;
        }
        Ok(())
    }

    /// Like [`start`](Self::start), with 32-bit seeds, one for each cell.
    ///
    /// # Errors
    /// [`ArrayError::Seeds`] if the number of seeds differs from that of the cells, [`ArrayError::Bus`] if a cell does
    /// not answer.
    pub fn start_with_seeds(&mut self, mode: CellMode, seeds: &[u32]) -> Result<(), ArrayError> {
        let cells = self.cells.len();
        if seeds.len() != cells {
            return Err(ArrayError::Seeds {
                seeds: seeds.len(),
                cells,
            });
        }
        for (k, seed) in seeds.iter().enumerate() {
            self.write(Self::address(k), &mode.extended(*seed))?;
        }
        Ok(())
    }

    /// Starts every cell with its pattern.
    ///
    /// # Errors
    /// [`ArrayError::Patterns`] if the number of patterns differs from that of the cells, [`ArrayError::Bus`] if a cell
    /// does not answer.
    pub fn start_with_patterns(&mut self, patterns: &[Pattern]) -> Result<(), ArrayError> {
        let cells = self.cells.len();
        if patterns.len() != cells {
            return Err(ArrayError::Patterns {
                patterns: patterns.len(),
                cells,
            });
        }
        for (k, pattern) in patterns.iter().enumerate() {
            self.write(Self::address(k), &pattern.message())?;
        }
        Ok(())
    }

    /// Clocks the cells and fills `codes`, row-major (edge, cell), with the DAC code on each cell's pin when the edge
    /// is sampled. A pin that is not driven counts as [`NEUTRAL_CODE`](crate::NEUTRAL_CODE).
    ///
    /// The first edge comes one period after the last event, which may be the start or bus traffic. A further call with
    /// the same clock continues without a gap and first returns the codes that a [free-running clock](Self::run_clock)
    /// has produced. A call with another clock starts again and drops unfetched codes.
    ///
    /// # Errors
    /// [`ArrayError::Clock`] for a clock out of range, [`ArrayError::Codes`] if the length of `codes` is not a whole
    /// number of rows.
    pub fn clock(&mut self, clock: Clock, codes: &mut [u8]) -> Result<(), ArrayError> {
        let cells = self.cells.len();
        if !codes.len().is_multiple_of(cells) {
            return Err(ArrayError::Codes {
                codes: codes.len(),
                cells,
            });
        }
        let train = match self.train {
            Some(train) if train.clock == clock => train,
            _ => self.start_train(clock, false)?,
        };
        let rows = codes.len() / cells;
        // all cells are at the same tick, so that all have been sampled as often
        if let Some(missing) = rows.checked_sub(self.followers[0].codes.len()).filter(|n| *n > 0) {
            self.advance(train.sample_tick(self.followers[0].sampled + missing as u64));
        }
        self.fetch(rows, codes);
        Ok(())
    }

    /// Lets the clock run freely, also during bus traffic and [`idle`](Self::idle), so that a cell can be seeded while
    /// it is clocked. [`codes`](Self::codes) or [`clock`](Self::clock) fetch the sampled codes. Unfetched codes of an
    /// earlier clock are dropped.
    ///
    /// # Errors
    /// [`ArrayError::Clock`] for a clock out of range.
    pub fn run_clock(&mut self, clock: Clock) -> Result<(), ArrayError> {
        self.start_train(clock, true).map(|_| ())
    }

    /// Stops the clock line after the sample of its last edge.
    pub fn stop_clock(&mut self) {
        if let Some(train) = self.train
            && let Some(edge) = self.followers[0].unsampled()
        {
            self.advance(train.sample_tick(edge));
        }
        self.train = None;
    }

    /// Fetches all sampled codes, row-major (edge, cell).
    #[must_use]
    pub fn codes(&mut self) -> Vec<u8> {
        let rows = self.followers[0].codes.len();
        let mut codes = vec![0; rows * self.cells.len()];
        self.fetch(rows, &mut codes);
        codes
    }

    /// Lets `time_s` seconds pass without bus traffic, at most a day.
    ///
    /// # Errors
    /// [`ArrayError::Idle`] for a time out of range.
    pub fn idle(&mut self, time_s: f64) -> Result<(), ArrayError> {
        if !(0.0..=IDLE_MAX_S).contains(&time_s) {
            return Err(ArrayError::Idle { time_s });
        }
        self.drop_paused_clock();
        self.advance(self.now + ticks(time_s));
        Ok(())
    }

    /// Bus address of cell `k`; there are fewer than 112.
    fn address(k: usize) -> u8 {
        let [low, ..] = k.to_le_bytes();
        FIRST_ADDRESS + low
    }

    fn start_train(&mut self, clock: Clock, free: bool) -> Result<Train, ArrayError> {
        clock.check()?;
        self.stop_clock();
        let train = Train::new(clock, self.now, free);
        self.train = Some(train);
        for follower in &mut self.followers {
            follower.restart();
        }
        Ok(train)
    }

    /// Bus traffic ends a clock that [`clock`](Self::clock) would go on with.
    fn drop_paused_clock(&mut self) {
        self.train = self.train.filter(|train| train.free);
    }

    /// Runs every cell to `tick`.
    fn advance(&mut self, tick: u64) {
        let train = self.train.as_ref();
        let follow = |(cell, follower): (&mut Device, &mut Follower)| {
            follower.follow(cell, train, tick, false);
        };
        let work = tick.saturating_sub(self.now) * self.cells.len() as u64;
        if train.is_some() && work > PARALLEL_TICKS {
            self.cells.par_iter_mut().zip(&mut self.followers).for_each(follow);
        } else {
            self.cells.iter_mut().zip(&mut self.followers).for_each(follow);
        }
        self.now = tick.max(self.now);
    }

    /// Moves the oldest `rows` rows into `codes`.
    fn fetch(&mut self, rows: usize, codes: &mut [u8]) {
        let cells = self.cells.len();
        for (k, follower) in self.followers.iter_mut().enumerate() {
            let column = codes.iter_mut().skip(k).step_by(cells);
            for (code, sampled) in column.zip(follower.codes.drain(..rows)) {
                *code = sampled;
            }
        }
    }
}
