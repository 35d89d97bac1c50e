//! The master of the I²C bus that all cells share.

use super::Array;
use super::bus::{BusError, BusEvent, BusReply, Stage};

/// Bit time at 400 kHz (ticks of 50 ns).
const BIT_TICKS: u64 = 50;
/// Longest time for which a cell may hold the clock low (ticks): 25 ms, the limit of SMBus, section "Clock low
/// time-out".
const STRETCH_LIMIT_TICKS: u64 = 500_000;

impl Array {
    /// Writes `bytes` to the cell at `address`: START, address, bytes, STOP at 400 kHz. All cells receive the traffic.
    ///
    /// # Errors
    /// [`BusError`] if no cell answers or the cell refuses a byte (STOP follows in both cases), or a cell blocks the
    /// bus.
    pub fn write(&mut self, address: u8, bytes: &[u8]) -> Result<(), BusError> {
        self.open(address, 0)?;
        for (index, byte) in bytes.iter().enumerate() {
            if !self.send(*byte)? {
                self.stop()?;
                return Err(BusError::Refused { address, index });
            }
        }
        self.stop()
    }

    /// Reads `out.len()` bytes from the cell at `address`: START, address, bytes (the last one not acknowledged), STOP.
    /// An empty `out` sends nothing.
    ///
    /// # Errors
    /// [`BusError`] if no cell answers, or a cell blocks the bus.
    pub fn read(&mut self, address: u8, out: &mut [u8]) -> Result<(), BusError> {
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
    /// [`BusError::Bits`] for a number of bits out of range, [`BusError::Stuck`] if a cell blocks the bus.
    pub fn transact(&mut self, events: &[BusEvent]) -> Result<Vec<BusReply>, BusError> {
        let odd = events.iter().find_map(|event| match *event {
            BusEvent::Bits(bits) if !(1..=7).contains(&bits) => Some(bits),
            _ => None,
        });
        if let Some(bits) = odd {
            return Err(BusError::Bits { bits });
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
    fn open(&mut self, address: u8, direction: u8) -> Result<(), BusError> {
        if address > 0x7f {
            return Err(BusError::Address { address });
        }
        self.drop_paused_clock();
        self.begin()?;
        if self.send(address << 1 | direction)? {
            return Ok(());
        }
        self.stop()?;
        Err(BusError::NoAcknowledge { address })
    }

    fn begin(&mut self) -> Result<(), BusError> {
        self.wait_for_clock()?;
        self.pass(1);
        self.stage = Stage::Started;
        for cell in &mut self.cells {
            cell.hear_start();
        }
        Ok(())
    }

    /// A byte from the master; whether it was acknowledged.
    fn send(&mut self, byte: u8) -> Result<bool, BusError> {
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
        Ok(self
            .cells
            .iter_mut()
            .fold(false, |any, cell| cell.take_acknowledge() | any))
    }

    /// A byte to the master.
    fn receive(&mut self, acknowledge: bool) -> Result<u8, BusError> {
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

    fn break_off(&mut self, bits: u8) -> Result<(), BusError> {
        self.wait_for_clock()?;
        self.pass(u64::from(bits));
        self.stage = Stage::Broken;
        Ok(())
    }

    fn stop(&mut self) -> Result<(), BusError> {
        self.wait_for_clock()?;
        self.pass(1);
        for cell in &mut self.cells {
            cell.hear_stop(self.stage != Stage::Bytes);
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
    fn wait_for_clock(&mut self) -> Result<(), BusError> {
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
            Some(k) => Err(BusError::Stuck {
                address: Self::address(k),
            }),
        }
    }
}
