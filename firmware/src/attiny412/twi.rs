//! TWI0 as an I²C client, byte by byte.

use super::system::Fault;

/// First and last address.
pub(super) const BASE: u16 = 0x0810;
pub(super) const END: u16 = 0x081e;
/// Interrupt vector.
pub(super) const VECTOR: u8 = 19;

const CTRLA: u16 = BASE;
const SCTRLA: u16 = BASE + 0x09;
const SCTRLB: u16 = BASE + 0x0a;
const SSTATUS: u16 = BASE + 0x0b;
const SADDR: u16 = BASE + 0x0c;
const SDATA: u16 = BASE + 0x0d;

// SCTRLA
const ENABLE: u8 = 0x01;
/// Smart mode and all addresses; neither is emulated, nor are a second address and the general call.
const SMEN: u8 = 0x02;
const PMEN: u8 = 0x04;
const PIEN: u8 = 0x20;
const APIEN: u8 = 0x40;
const DIEN: u8 = 0x80;
// SCTRLB
const SCMD: u8 = 0x03;
const COMPTRANS: u8 = 0x02;
const RESPONSE: u8 = 0x03;
const ACKACT: u8 = 0x04;
// SSTATUS
const AP: u8 = 0x01;
const DIR: u8 = 0x02;
const BUSERR: u8 = 0x04;
const COLL: u8 = 0x08;
const RXACK: u8 = 0x10;
const CLKHOLD: u8 = 0x20;
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

/// Client registers of TWI0.
///
/// Where the data sheet leaves a choice, the harder one for the program is taken: with PIEN every STOP on the bus sets
/// APIF, also one of a transaction with another client, and a pending STOP does not hold the clock, so that the next
/// address can overwrite it. Source: tinyAVR 1-series data sheet (DS40002287), chapter TWI.
#[derive(Debug, Clone, Default)]
pub(super) struct Twi {
    ctrla: u8,
    sctrla: u8,
    nack: bool,
    /// SSTATUS without CLKHOLD.
    status: u8,
    address: u8,
    data: u8,
    phase: Phase,
    acknowledged: bool,
}

impl Twi {
    /// Whether the interrupt is asked for.
    pub(super) fn requests(&self) -> bool {
        // the enable bits stand where the flags do
        self.status & self.sctrla & (DIEN | APIEN) != 0
    }

    /// Whether the client keeps SCL low.
    pub(super) fn holds(&self) -> bool {
        matches!(self.phase, Phase::AddressHeld | Phase::ByteHeld | Phase::LoadHeld)
    }

    /// Whether a byte of the client is on its way to the master.
    pub(super) fn sends(&self) -> bool {
        self.phase == Phase::Sending
    }

    /// The acknowledge bit of the last byte that the client answered to, once.
    pub(super) fn take_acknowledge(&mut self) -> bool {
        std::mem::take(&mut self.acknowledged)
    }

    /// START, which ends what was going on.
    pub(super) fn hear_start(&mut self) {
        self.phase = Phase::Idle;
        self.acknowledged = false;
    }

    /// The address byte behind a START; returns whether the client is addressed.
    pub(super) fn hear_address(&mut self, byte: u8) -> bool {
        self.hear_start();
        if self.sctrla & ENABLE == 0 {
            return false;
        }
        self.status &= !(COLL | DIF);
        if byte >> 1 != self.address >> 1 {
            return false;
        }
        self.data = byte;
        self.phase = Phase::AddressHeld;
        self.status = self.status & !DIR | AP | APIF | if byte & 1 == 0 { 0 } else { DIR };
        true
    }

    /// A byte of the master's write.
    pub(super) fn hear_byte(&mut self, byte: u8) {
        if self.phase == Phase::Receiving {
            self.data = byte;
            self.phase = Phase::ByteHeld;
            self.status |= DIF;
        }
    }

    /// Byte that the client puts on the bus; ones where it leaves the bus alone.
    pub(super) fn byte_sent(&self) -> u8 {
        if self.sends() { self.data } else { 0xff }
    }

    /// The master's answer to a byte that was `on_bus`: a client that sent another one has lost the bus.
    pub(super) fn hear_answer(&mut self, on_bus: u8, acknowledged: bool) {
        if !self.sends() {
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

    /// STOP; `illegal` right behind a START or within a byte.
    pub(super) fn hear_stop(&mut self, illegal: bool) {
        self.phase = Phase::Idle;
        if self.sctrla & ENABLE == 0 {
            return;
        }
        if illegal {
            self.status |= BUSERR;
        }
        if self.sctrla & PIEN != 0 {
            self.status = self.status & !AP | APIF;
        }
    }

    /// Register as read; the master's registers are not emulated.
    pub(super) fn read(&mut self, address: u16) -> Option<u8> {
        match address {
            CTRLA => Some(self.ctrla),
            SCTRLA => Some(self.sctrla),
            SCTRLB => Some(if self.nack { ACKACT } else { 0 }),
            SSTATUS => Some(self.status | if self.holds() { CLKHOLD } else { 0 }),
            SADDR => Some(self.address),
            SDATA => {
                self.status &= !DIF;
                Some(self.data)
            }
            _ => None,
        }
    }

    pub(super) fn write(&mut self, address: u16, value: u8) -> Result<(), Fault> {
        match address {
            CTRLA => self.ctrla = value & 0x1e,
            SCTRLA if value & (SMEN | PMEN) != 0 => return Err(Fault::Unsupported { address, value }),
            SADDR if value & 1 != 0 => return Err(Fault::Unsupported { address, value }),
            SCTRLA => {
                self.sctrla = value & (ENABLE | PIEN | APIEN | DIEN);
                if value & ENABLE == 0 {
                    self.phase = Phase::Idle;
                }
            }
            SCTRLB => {
                self.nack = value & ACKACT != 0;
                self.command(value & SCMD);
            }
            SSTATUS => self.clear(value),
            SADDR => self.address = value,
            SDATA => {
                self.data = value;
                self.status &= !DIF;
            }
            _ => return Err(Fault::Write { address, value }),
        }
        Ok(())
    }

    fn command(&mut self, command: u8) {
        match command {
            COMPTRANS => {
                if self.phase != Phase::LoadHeld {
                    self.acknowledge();
                }
                self.phase = Phase::Idle;
                self.status &= !(APIF | DIF);
            }
            RESPONSE => {
                self.status &= !(APIF | DIF);
                self.respond();
            }
            _ => {}
        }
    }

    /// Ones written to SSTATUS; clearing the flag of a held phase answers it.
    fn clear(&mut self, value: u8) {
        let cleared = self.status & value;
        self.status &= !(value & (DIF | APIF | COLL | BUSERR));
        let answers = match self.phase {
            Phase::AddressHeld => cleared & APIF != 0,
            Phase::ByteHeld | Phase::LoadHeld => cleared & DIF != 0,
            _ => false,
        };
        if answers {
            self.respond();
        }
    }

    /// Sets the acknowledge bit of a byte that was received.
    fn acknowledge(&mut self) {
        if matches!(self.phase, Phase::AddressHeld | Phase::ByteHeld) {
            self.acknowledged = !self.nack;
        }
    }

    /// Lets the transaction go on.
    fn respond(&mut self) {
        self.acknowledge();
        self.phase = match self.phase {
            Phase::AddressHeld | Phase::ByteHeld if self.nack => Phase::Idle,
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

    fn client() -> Twi {
        let mut twi = Twi::default();
        twi.write(SADDR, 40 << 1).unwrap();
        twi.write(SCTRLA, ENABLE | PIEN | APIEN | DIEN).unwrap();
        twi
    }

    #[test]
    fn a_write_is_held_until_the_program_answers() {
        let mut twi = client();
        assert!(!twi.hear_address(41 << 1));
        assert!(twi.hear_address(40 << 1));
        assert_eq!(twi.read(SSTATUS), Some(APIF | CLKHOLD | AP));
        assert!(twi.requests() && twi.holds());
        twi.write(SCTRLB, RESPONSE).unwrap();
        assert!(twi.take_acknowledge() && !twi.holds() && !twi.requests());
        twi.hear_byte(0x5a);
        assert_eq!(twi.read(SSTATUS), Some(DIF | CLKHOLD | AP));
        assert_eq!(twi.read(SDATA), Some(0x5a));
        assert!(
            twi.holds(),
            "without smart mode a read of SDATA does not release the clock"
        );
        twi.write(SCTRLB, ACKACT | RESPONSE).unwrap();
        assert!(!twi.take_acknowledge() && !twi.holds());
        twi.hear_byte(1);
        assert_eq!(
            twi.read(SDATA),
            Some(0x5a),
            "a client that refused a byte is out until the next START"
        );
        twi.hear_stop(false);
        assert_eq!(twi.read(SSTATUS), Some(APIF));
        assert!(twi.requests() && !twi.holds());
        twi.write(SCTRLB, COMPTRANS).unwrap();
        assert_eq!(twi.read(SSTATUS), Some(0));
    }

    #[test]
    fn a_read_sends_what_the_program_loads() {
        let mut twi = client();
        twi.hear_address(40 << 1 | 1);
        twi.write(SCTRLB, RESPONSE).unwrap();
        assert_eq!(twi.read(SSTATUS), Some(DIF | CLKHOLD | DIR | AP));
        twi.write(SDATA, 0x12).unwrap();
        assert!(twi.holds() && twi.take_acknowledge());
        twi.write(SCTRLB, RESPONSE).unwrap();
        assert!(twi.sends());
        assert_eq!(twi.byte_sent(), 0x12);
        twi.hear_answer(0x12, false);
        assert_eq!(twi.read(SSTATUS), Some(DIF | CLKHOLD | RXACK | DIR | AP));
        twi.write(SCTRLB, COMPTRANS).unwrap();
        assert!(!twi.holds());
        assert_eq!(twi.byte_sent(), 0xff);
    }

    #[test]
    fn a_client_whose_byte_is_overruled_leaves_the_bus() {
        let mut twi = client();
        twi.hear_address(40 << 1 | 1);
        twi.write(SCTRLB, RESPONSE).unwrap();
        twi.write(SDATA, 0x81).unwrap();
        twi.write(SCTRLB, RESPONSE).unwrap();
        twi.hear_answer(0x01, true);
        assert_eq!(twi.read(SSTATUS), Some(DIF | COLL | DIR | AP));
        assert_eq!(twi.byte_sent(), 0xff);
    }

    #[test]
    fn only_its_own_address_is_answered_while_it_is_enabled() {
        let mut twi = client();
        let answered = |twi: &mut Twi| (0..128).filter(|a| twi.hear_address(a << 1)).collect::<Vec<_>>();
        assert_eq!(answered(&mut twi), [40]);
        for (address, value) in [(SCTRLA, ENABLE | SMEN), (SCTRLA, ENABLE | PMEN), (SADDR, 1)] {
            assert_eq!(twi.write(address, value), Err(Fault::Unsupported { address, value }));
        }
        twi.write(SCTRLA, 0).unwrap();
        assert!(answered(&mut twi).is_empty());
    }

    #[test]
    fn every_stop_is_heard_and_an_illegal_one_is_an_error() {
        let mut twi = client();
        twi.hear_address(41 << 1);
        twi.hear_stop(true);
        assert_eq!(twi.read(SSTATUS), Some(APIF | BUSERR));
        twi.hear_address(40 << 1);
        assert_eq!(
            twi.read(SSTATUS),
            Some(APIF | BUSERR | CLKHOLD | AP),
            "the address overwrites the STOP"
        );
        twi.write(SSTATUS, BUSERR | APIF).unwrap();
        twi.hear_stop(false);
        twi.write(SSTATUS, APIF).unwrap();
        assert_eq!(twi.read(SSTATUS), Some(0));
    }
}
