//! TWI0 as an I²C client, byte by byte.

use super::system::Fault;

/// Interrupt vector.
pub(super) const VECTOR: u8 = 19;

const SCTRLA: u16 = 0x0819;
const SCTRLB: u16 = 0x081a;
const SSTATUS: u16 = 0x081b;
const SADDR: u16 = 0x081c;
const SDATA: u16 = 0x081d;
/// First and last address.
pub(super) const BASE: u16 = SCTRLA;
pub(super) const END: u16 = SDATA;

// SCTRLA
const ENABLE: u8 = 0x01;
const APIEN: u8 = 0x40;
const DIEN: u8 = 0x80;
// SCTRLB
const COMPTRANS: u8 = 0x02;
const RESPONSE: u8 = 0x03;
// SSTATUS
const AP: u8 = 0x01;
const DIR: u8 = 0x02;
const COLL: u8 = 0x08;
const RXACK: u8 = 0x10;
const APIF: u8 = 0x40;
const DIF: u8 = 0x80;

/// Where the client is in a transaction. In the `Held` phases it keeps SCL low until the program answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Phase {
    /// Waits for a START.
    #[default]
    Idle,
    /// Addressed; the program must send the acknowledge bit.
    AddressHeld,
    /// Ready for a byte from the master.
    Receiving,
    /// A byte has arrived; the program must send the acknowledge bit.
    ByteHeld,
    /// The master reads; the program must provide a byte.
    LoadHeld,
    /// The byte in SDATA is sent.
    Sending,
}

/// Client registers of TWI0. The program acknowledges whatever it answers, and is not told of a STOP.
///
/// DIF is set together with the hold that it explains. Reading or writing SDATA clears DIF; without smart mode only a
/// command releases SCL.
#[derive(Debug, Clone, Default)]
pub(super) struct Twi {
    sctrla: u8,
    status: u8,
    address: u8,
    data: u8,
    phase: Phase,
    /// Acknowledge bit for the master, once the program has decided.
    acknowledged: bool,
}

impl Twi {
    pub(super) fn requests(&self) -> bool {
        // the enable bits stand where the flags do
        self.status & self.sctrla & (DIEN | APIEN) != 0
    }

    /// Whether the client holds SCL low.
    pub(super) fn holds(&self) -> bool {
        matches!(self.phase, Phase::AddressHeld | Phase::ByteHeld | Phase::LoadHeld)
    }

    /// Whether the client acknowledges the byte before; asking clears it.
    pub(super) fn take_acknowledge(&mut self) -> bool {
        std::mem::take(&mut self.acknowledged)
    }

    pub(super) fn hear_start(&mut self) {
        self.phase = Phase::Idle;
        self.acknowledged = false;
    }

    /// The byte behind a START.
    pub(super) fn hear_address(&mut self, byte: u8) {
        self.hear_start();
        if self.sctrla & ENABLE == 0 {
            return;
        }
        self.status &= !(COLL | DIF);
        if byte >> 1 == self.address >> 1 {
            self.data = byte;
            self.phase = Phase::AddressHeld;
            self.status = self.status & !DIR | AP | APIF | if byte & 1 == 0 { 0 } else { DIR };
        }
    }

    /// A byte from the master.
    pub(super) fn hear_byte(&mut self, byte: u8) {
        if self.phase == Phase::Receiving {
            self.data = byte;
            self.phase = Phase::ByteHeld;
            self.status |= DIF;
        }
    }

    /// What the client puts on the bus; 0xFF while it is not sending.
    pub(super) fn byte_sent(&self) -> u8 {
        if self.phase == Phase::Sending { self.data } else { 0xff }
    }

    /// The end of a byte that the master has read: what was on the bus, which is wired-AND, and whether the master
    /// wants more.
    pub(super) fn hear_answer(&mut self, on_bus: u8, acknowledged: bool) {
        if self.phase != Phase::Sending {
            return;
        }
        self.status |= DIF;
        if on_bus == self.data {
            self.phase = Phase::LoadHeld;
            self.status = self.status & !RXACK | if acknowledged { 0 } else { RXACK };
        } else {
            self.phase = Phase::Idle;
            self.status |= COLL;
        }
    }

    pub(super) fn hear_stop(&mut self) {
        self.phase = Phase::Idle;
    }

    pub(super) fn read(&mut self, address: u16) -> Option<u8> {
        match address {
            SSTATUS => Some(self.status),
            SDATA => {
                self.status &= !DIF;
                Some(self.data)
            }
            _ => None,
        }
    }

    pub(super) fn write(&mut self, address: u16, value: u8) -> Result<(), Fault> {
        match address {
            SCTRLA if value & !(ENABLE | APIEN | DIEN) == 0 => {
                self.sctrla = value;
                if value & ENABLE == 0 {
                    self.phase = Phase::Idle;
                }
            }
            SCTRLB if matches!(value, COMPTRANS | RESPONSE) => self.command(value),
            SADDR if value & 1 == 0 => self.address = value,
            SDATA => {
                self.data = value;
                self.status &= !DIF;
            }
            _ => return Err(Fault::Write { address, value }),
        }
        Ok(())
    }

    fn command(&mut self, command: u8) {
        self.status &= !(APIF | DIF);
        self.acknowledged |= matches!(self.phase, Phase::AddressHeld | Phase::ByteHeld);
        self.phase = match self.phase {
            _ if command == COMPTRANS => Phase::Idle,
            Phase::AddressHeld if self.status & DIR != 0 => {
                self.status |= DIF;
                Phase::LoadHeld
            }
            Phase::AddressHeld | Phase::ByteHeld => Phase::Receiving,
            Phase::LoadHeld => Phase::Sending,
            other => other,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An enabled client with address 40.
    fn client() -> Twi {
        let mut twi = Twi::default();
        twi.write(SADDR, 40 << 1).unwrap();
        twi.write(SCTRLA, ENABLE | APIEN | DIEN).unwrap();
        twi
    }

    #[test]
    fn a_write_is_held_until_the_program_answers() {
        let mut twi = client();
        twi.hear_address(41 << 1);
        assert!(!twi.holds());
        twi.hear_address(40 << 1);
        assert_eq!(twi.read(SSTATUS), Some(APIF | AP));
        assert!(twi.requests() && twi.holds());
        twi.write(SCTRLB, RESPONSE).unwrap();
        assert!(twi.take_acknowledge() && !twi.holds() && !twi.requests());
        twi.hear_byte(0x5a);
        assert_eq!(twi.read(SSTATUS), Some(DIF | AP));
        assert_eq!(twi.read(SDATA), Some(0x5a));
        assert!(twi.holds(), "a read of SDATA does not release the clock");
        twi.hear_stop();
        assert!(!twi.holds());
    }

    #[test]
    fn a_read_sends_what_the_program_loads() {
        for (on_bus, status) in [(0x12, DIF | RXACK | DIR | AP), (0x02, DIF | COLL | DIR | AP)] {
            let mut twi = client();
            twi.hear_address(40 << 1 | 1);
            twi.write(SCTRLB, RESPONSE).unwrap();
            assert_eq!(twi.read(SSTATUS), Some(DIF | DIR | AP));
            twi.write(SDATA, 0x12).unwrap();
            assert!(twi.holds() && twi.take_acknowledge());
            twi.write(SCTRLB, RESPONSE).unwrap();
            assert_eq!(twi.byte_sent(), 0x12);
            twi.hear_answer(on_bus, false);
            assert_eq!(twi.read(SSTATUS), Some(status));
            twi.write(SCTRLB, COMPTRANS).unwrap();
            assert!(!twi.holds() && twi.byte_sent() == 0xff);
        }
    }
}
