//! Emulated cells on one bus and one clock line, and the master of the bus.

use crate::attiny412::{Device, OSCILLATOR_HZ};
use crate::cell::{CellMode, FIRST_ADDRESS, LAST_BUS_ADDRESS, NEUTRAL_CODE};
use crate::image::Image;
use rayon::prelude::*;
use spts_input::Refusal;

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
    /// [`Refusal`] for no cell or more than 112, or an image larger than the flash.
    pub fn new(cells: usize, image: &Image) -> Result<Self, Refusal> {
        if cells == 0 || cells > CELLS_MAX {
            return Err(Refusal::new(format!("{cells} cells do not fit on one bus; the range is [1, 112]")));
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
    pub fn time_s(&self) -> f64 {
        self.now as f64 / OSCILLATOR_HZ
    }

    /// Instructions executed by all cells.
    pub fn instructions(&self) -> u64 {
        self.cells.iter().map(Device::instructions).sum()
    }

    /// Starts a session as the bus master does: writes `mode` and its address to every cell.
    ///
    /// # Errors
    /// [`Refusal`] if a cell does not answer.
    pub fn start(&mut self, mode: CellMode) -> Result<(), Refusal> {
        for k in 0..self.cells.len() {
            let address = Self::address(k);
            self.write(address, &mode.pair(address))?;
        }
        Ok(())
    }

    /// Like [`start`](Self::start), with 32-bit seeds, one for each cell.
    ///
    /// # Errors
    /// [`Refusal`] if the number of seeds differs from that of the cells, or a cell does not answer.
    pub fn start_with_seeds(&mut self, mode: CellMode, seeds: &[u32]) -> Result<(), Refusal> {
        let (given, cells) = (seeds.len(), self.cells.len());
        if given != cells {
            return Err(Refusal::new(format!("{given} seeds for {cells} cells")));
        }
        for (k, seed) in seeds.iter().enumerate() {
            self.write(Self::address(k), &mode.extended(*seed))?;
        }
        Ok(())
    }

    /// Clocks the cells and fills `codes`, row-major (edge, cell), with the DAC code on each cell's pin when the edge
    /// is sampled. A pin that is not driven counts as [`NEUTRAL_CODE`].
    ///
    /// The first edge comes one period after the last event, which may be the start or bus traffic. A further call with
    /// the same clock continues without a gap and first returns the codes that a [free-running clock](Self::run_clock)
    /// has produced. A call with another clock starts again and drops unfetched codes.
    ///
    /// # Errors
    /// [`Refusal`] for a clock out of range, or if the length of `codes` is not a whole number of rows.
    pub fn clock(&mut self, clock: Clock, codes: &mut [u8]) -> Result<(), Refusal> {
        let cells = self.cells.len();
        if !codes.len().is_multiple_of(cells) {
            let given = format!("`codes` has {} entries", codes.len());
            return Err(Refusal::new(format!("{given}, which is no multiple of the {cells} cells")));
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
    /// [`Refusal`] for a clock out of range.
    pub fn run_clock(&mut self, clock: Clock) -> Result<(), Refusal> {
        self.start_train(clock, true).map(|_| ())
    }

    /// Stops the clock line after the sample of its last edge.
    pub(crate) fn stop_clock(&mut self) {
        if let Some(train) = self.train
            && let Some(edge) = self.followers[0].unsampled()
        {
            self.advance(train.sample_tick(edge));
        }
        self.train = None;
    }

    /// Fetches all sampled codes, row-major (edge, cell).
    pub fn codes(&mut self) -> Vec<u8> {
        let rows = self.followers[0].codes.len();
        let mut codes = vec![0; rows * self.cells.len()];
        self.fetch(rows, &mut codes);
        codes
    }

    /// Lets `time_s` seconds pass without bus traffic, at most a day.
    ///
    /// # Errors
    /// [`Refusal`] for a time out of range.
    pub fn idle(&mut self, time_s: f64) -> Result<(), Refusal> {
        if !(0.0..=IDLE_MAX_S).contains(&time_s) {
            return Err(Refusal::new(format!("`time_s` = {time_s} is outside [0, 86400] s")));
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

    fn start_train(&mut self, clock: Clock, free: bool) -> Result<Train, Refusal> {
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

/// Rate of the clock line's edges, and the delay from an edge to the sampling of the codes.
///
/// ```
/// use spts_firmware::Clock;
///
/// assert!(Clock::at(64.3e3).check().is_ok());
/// let late = Clock { edge_hz: 64.3e3, sample_delay_s: 20e-6 }; // longer than the period of 15.6 µs
/// assert!(late.check().unwrap_err().to_string().starts_with("`sample_delay_s` = 0.00002"));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    /// Edges per second, rising and falling counted equally. Range [1, 1e6].
    pub edge_hz: f64,
    /// Time from an edge to the sampling of the codes, s, rounded to oscillator ticks of 50 ns. Range [0, 1/`edge_hz`),
    /// and at least one tick less than the shortest distance between two edges.
    pub sample_delay_s: f64,
}

/// Rate of the recordings of the skin, edges per second.
pub const SKIN_EDGE_HZ: f64 = 64.3e3;
/// Time from an edge to the converter's sample in the published acquisition code, s.
pub const SKIN_SAMPLE_DELAY_S: f64 = 11e-6;

impl Default for Clock {
    /// The skin's: 64.3 thousand measurements a second, sampled 11 µs behind the edge.
    fn default() -> Self {
        Self { edge_hz: SKIN_EDGE_HZ, sample_delay_s: SKIN_SAMPLE_DELAY_S }
    }
}

impl Clock {
    /// The skin's clock at another rate. Codes are sampled 11 µs after the edge or, if the period is too short for
    /// that, after the same share of the period.
    pub fn at(edge_hz: f64) -> Self {
        Self { edge_hz, sample_delay_s: SKIN_SAMPLE_DELAY_S * (SKIN_EDGE_HZ / edge_hz).min(1.0) }
    }

    /// Checks that the clock line can run at this rate and delay.
    ///
    /// # Errors
    /// [`Refusal`], with the field out of range.
    pub fn check(&self) -> Result<(), Refusal> {
        let error = |field, value: f64, range| Err(Refusal::range(field, value, range));
        if !(1.0..=1e6).contains(&self.edge_hz) {
            return error("edge_hz", self.edge_hz, "[1, 1e6]");
        }
        // edges are the whole part of the period apart, or one tick more, and an edge must not come before the sample;
        // a period that is whole but for rounding counts as whole
        let in_range = (0.0..1.0 / self.edge_hz).contains(&self.sample_delay_s);
        let shortest = (OSCILLATOR_HZ / self.edge_hz * (1.0 + 1e-14)).floor();
        if !in_range || ticks(self.sample_delay_s) as f64 >= shortest {
            return error("sample_delay_s", self.sample_delay_s, "[0, 1/edge_hz) in whole ticks of 50 ns");
        }
        Ok(())
    }
}

/// A clock that started at tick `origin`. Edge k = 1, 2, … comes at the tick nearest to `origin` + k/f: errors do not
/// add up.
#[derive(Debug, Clone, Copy)]
struct Train {
    clock: Clock,
    origin: u64,
    sample_delay: u64,
    /// Whether the clock runs freely, also during bus traffic.
    free: bool,
}

impl Train {
    fn new(clock: Clock, origin: u64, free: bool) -> Self {
        Self { clock, origin, sample_delay: ticks(clock.sample_delay_s), free }
    }

    fn edge_tick(&self, edge: u64) -> u64 {
        self.origin + ticks(edge as f64 / self.clock.edge_hz)
    }

    fn sample_tick(&self, edge: u64) -> u64 {
        self.edge_tick(edge) + self.sample_delay
    }
}

/// Oscillator ticks nearest to a time.
#[expect(clippy::cast_possible_truncation, reason = "times are non-negative and end centuries before 2^53 ticks")]
fn ticks(time_s: f64) -> u64 {
    (time_s * OSCILLATOR_HZ).round() as u64
}

/// How far a cell has followed the clock line, and the codes sampled from it.
#[derive(Debug, Clone, Default)]
struct Follower {
    /// Number of edges so far.
    edges: u64,
    /// Tick of the last edge.
    edge_tick: u64,
    /// Tick of the next edge, once computed.
    next_tick: Option<u64>,
    /// Number of edges whose codes have been sampled.
    sampled: u64,
    high: bool,
    /// Sampled codes that have not been fetched.
    codes: Vec<u8>,
}

/// What the clock brings next.
enum Next {
    Edge,
    Sample,
}

impl Follower {
    /// Starts counting edges anew; the line keeps its level.
    fn restart(&mut self) {
        self.edges = 0;
        self.next_tick = None;
        self.sampled = 0;
        self.codes.clear();
    }

    /// The last edge, if its code has not been sampled yet.
    fn unsampled(&self) -> Option<u64> {
        (self.sampled < self.edges).then_some(self.edges)
    }

    /// Runs `device` to `tick` through the edges and samples on the way. With `released`, only until its I²C client
    /// does not hold the bus; returns whether it does not.
    fn follow(&mut self, device: &mut Device, train: Option<&Train>, tick: u64, released: bool) -> bool {
        while let Some((next, at)) = train.map(|t| self.next(t)).filter(|(_, at)| *at <= tick) {
            if released && device.run_until_released(at) {
                return true;
            }
            device.run_until(at);
            match next {
                Next::Edge => {
                    self.high = !self.high;
                    device.set_clock(self.high);
                    self.edges += 1;
                    self.edge_tick = at;
                    self.next_tick = None;
                }
                Next::Sample => {
                    self.codes.push(device.dac_output_at(at).unwrap_or(NEUTRAL_CODE));
                    self.sampled = self.edges;
                }
            }
        }
        if released {
            device.run_until_released(tick)
        } else {
            device.run_until(tick);
            true
        }
    }

    fn next(&mut self, train: &Train) -> (Next, u64) {
        let edge = self.edges + 1;
        let edge = *self.next_tick.get_or_insert_with(|| train.edge_tick(edge));
        let sample = self.edge_tick + train.sample_delay;
        // the delay is shorter than the period
        if self.sampled < self.edges { (Next::Sample, sample) } else { (Next::Edge, edge) }
    }
}

/// An event that a bus master can cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusEvent {
    /// START, or repeated START within a transaction.
    Start,
    /// A byte from the master. The first byte after a START holds an address (upper seven bits) and a direction (1 =
    /// read).
    Write(u8),
    /// A byte to the master, which acknowledges it or not.
    Read {
        /// Whether the master asks for another byte.
        acknowledge: bool,
    },
    /// The first bits, 1 to 7, of an incomplete byte. Until the next START or STOP no byte reaches a cell.
    Bits(u8),
    /// STOP.
    Stop,
}

/// What the master received.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusReply {
    /// Whether a byte from the master was acknowledged.
    Acknowledged(bool),
    /// A byte to the master; 255 if no cell sends.
    Byte(u8),
}

/// Where a transaction stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Stage {
    /// Whole bytes.
    #[default]
    Bytes,
    /// A START whose address has not come yet.
    Started,
    /// Within an incomplete byte.
    Broken,
}

/// Bit time at 400 kHz (ticks of 50 ns).
const BIT_TICKS: u64 = 50;
/// Longest time for which a cell may hold the clock low (ticks): 25 ms, the limit of SMBus, section "Clock low
/// time-out".
const STRETCH_LIMIT_TICKS: u64 = 500_000;

impl Array {
    /// Writes `bytes` to the cell at `address`: START, address, bytes, STOP at 400 kHz. All cells receive the traffic.
    ///
    /// ```
    /// use spts_firmware::{Array, Image};
    ///
    /// let mut array = Array::new(2, &Image::shipped())?; // addresses 8 and 9
    /// let error = array.write(10, &[2, 8]).unwrap_err();
    /// assert_eq!(error.to_string(), "no cell acknowledges address 10");
    /// # Ok::<(), spts_input::Refusal>(())
    /// ```
    ///
    /// # Errors
    /// [`Refusal`] if no cell answers or the cell refuses a byte (STOP follows in both cases), or a cell blocks the
    /// bus.
    pub fn write(&mut self, address: u8, bytes: &[u8]) -> Result<(), Refusal> {
        self.open(address, 0)?;
        for (index, byte) in bytes.iter().enumerate() {
            if !self.send(*byte)? {
                self.stop()?;
                let refused = format!("refuses byte {index} of the write");
                return Err(Refusal::new(format!("the cell at address {address} {refused}")));
            }
        }
        self.stop()
    }

    /// Reads `out.len()` bytes from the cell at `address`: START, address, bytes (the last one not acknowledged), STOP.
    /// An empty `out` sends nothing.
    ///
    /// # Errors
    /// [`Refusal`] if no cell answers, or a cell blocks the bus.
    pub fn read(&mut self, address: u8, out: &mut [u8]) -> Result<(), Refusal> {
        let Some(last) = out.len().checked_sub(1) else {
            return Ok(());
        };
        self.open(address, 1)?;
        for (k, byte) in out.iter_mut().enumerate() {
            *byte = self.receive(k < last)?;
        }
        self.stop()
    }

    /// Sends any sequence of bus events. Returns a reply for every byte. A missing acknowledgement does not end the
    /// sequence.
    ///
    /// # Errors
    /// [`Refusal`] for a number of bits out of range, or if a cell blocks the bus.
    pub fn transact(&mut self, events: &[BusEvent]) -> Result<Vec<BusReply>, Refusal> {
        let odd = events.iter().find_map(|event| match *event {
            BusEvent::Bits(bits) if !(1..=7).contains(&bits) => Some(bits),
            _ => None,
        });
        if let Some(bits) = odd {
            return Err(Refusal::new(format!("`bits` = {bits} of an incomplete byte is outside [1, 7]")));
        }
        self.drop_paused_clock();
        let mut replies = vec![];
        for event in events {
            match *event {
                BusEvent::Start => self.begin()?,
                BusEvent::Write(byte) => replies.push(BusReply::Acknowledged(self.send(byte)?)),
                BusEvent::Read { acknowledge } => replies.push(BusReply::Byte(self.receive(acknowledge)?)),
                BusEvent::Bits(bits) => self.break_off(bits)?,
                BusEvent::Stop => self.stop()?,
            }
        }
        Ok(replies)
    }

    /// START and an address that has to be acknowledged.
    fn open(&mut self, address: u8, direction: u8) -> Result<(), Refusal> {
        if address > 0x7f {
            return Err(Refusal::new(format!("bus address {address} is outside [0, 127]")));
        }
        self.drop_paused_clock();
        self.begin()?;
        if self.send(address << 1 | direction)? {
            return Ok(());
        }
        self.stop()?;
        Err(Refusal::new(format!("no cell acknowledges address {address}")))
    }

    fn begin(&mut self) -> Result<(), Refusal> {
        self.wait_for_clock()?;
        self.pass(1);
        self.stage = Stage::Started;
        for cell in &mut self.cells {
            cell.hear_start();
        }
        Ok(())
    }

    /// A byte from the master; whether it was acknowledged.
    fn send(&mut self, byte: u8) -> Result<bool, Refusal> {
        self.wait_for_clock()?;
        self.pass(8);
        for cell in &mut self.cells {
            match self.stage {
                Stage::Started => cell.hear_address(byte),
                Stage::Bytes => cell.hear_byte(byte),
                Stage::Broken => {}
            }
        }
        if self.stage == Stage::Started {
            self.stage = Stage::Bytes;
        }
        self.wait_for_clock()?;
        self.pass(1);
        // wired: one cell that pulls the line low is enough
        Ok(self.cells.iter_mut().fold(false, |any, cell| cell.take_acknowledge() | any))
    }

    /// A byte to the master.
    fn receive(&mut self, acknowledge: bool) -> Result<u8, Refusal> {
        self.wait_for_clock()?;
        self.pass(8);
        if self.stage == Stage::Broken {
            self.pass(1);
            return Ok(u8::MAX);
        }
        let byte = self.cells.iter().fold(u8::MAX, |bus, cell| bus & cell.byte_sent());
        self.pass(1);
        for cell in &mut self.cells {
            cell.hear_answer(byte, acknowledge);
        }
        Ok(byte)
    }

    fn break_off(&mut self, bits: u8) -> Result<(), Refusal> {
        self.wait_for_clock()?;
        self.pass(u64::from(bits));
        self.stage = Stage::Broken;
        Ok(())
    }

    fn stop(&mut self) -> Result<(), Refusal> {
        self.wait_for_clock()?;
        self.pass(1);
        for cell in &mut self.cells {
            cell.hear_stop();
        }
        self.stage = Stage::Bytes;
        // bus free time
        self.pass(1);
        Ok(())
    }

    fn pass(&mut self, bits: u64) {
        self.advance(self.now + bits * BIT_TICKS);
    }

    /// Waits until no cell holds the clock low.
    fn wait_for_clock(&mut self) -> Result<(), Refusal> {
        let (now, limit) = (self.now, self.now + STRETCH_LIMIT_TICKS);
        let mut released_at = now;
        let mut stuck = None;
        for (k, (cell, follower)) in self.cells.iter_mut().zip(&mut self.followers).enumerate() {
            if !cell.holds_clock() {
                continue;
            }
            if follower.follow(cell, self.train.as_ref(), limit, true) {
                released_at = released_at.max(cell.now());
            } else {
                stuck.get_or_insert(k);
                released_at = limit;
            }
        }
        self.advance(released_at);
        match stuck {
            None => Ok(()),
            Some(k) => Err(Refusal::new(format!(
                "the cell at address {} has held the bus clock low for 25 ms",
                Self::address(k)
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 20 MHz / 72 kHz = 277.7…; a rounded period of 278 would be 22 222 ticks late after 100 000 edges.
    #[test]
    fn edges_do_not_drift() {
        let clock = Clock { edge_hz: 72e3, sample_delay_s: 10e-6 };
        let train = Train::new(clock, 1000, false);
        assert_eq!(train.edge_tick(1), 1278);
        assert_eq!(train.edge_tick(2), 1556);
        assert_eq!(train.edge_tick(100_000), 1000 + 27_777_778);
        assert_eq!(train.sample_tick(1), 1478);
    }

    #[test]
    fn impossible_clocks_are_refused() {
        let clock = |edge_hz, sample_delay_s| Clock { edge_hz, sample_delay_s };
        for bad in [
            clock(0.0, 0.0),
            clock(f64::NAN, 0.0),
            clock(2e6, 0.0),
            clock(1e5, 1e-5),
            // the tick of the next edge
            clock(1e5, 9.99e-6),
            clock(72e3, 277.0 * 50e-9),
            clock(1e5, -1e-9),
        ] {
            assert!(bad.check().is_err(), "{bad:?}");
        }
        for good in [clock(1e5, 9.95e-6), clock(72e3, 276.0 * 50e-9), Clock::default()] {
            good.check().unwrap();
        }
    }
}
