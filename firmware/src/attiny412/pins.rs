//! Pins: PORTA with its mirror VPORTA, DAC0, whose output is pin PA6, and the voltage references.

/// First and last address of PORT.
pub(super) const PORT: u16 = 0x0400;
pub(super) const PORT_END: u16 = 0x0417;
/// Addresses of the mirror, from 0.
pub(super) const VPORT_LEN: u16 = 4;

/// Interrupt vector.
pub(super) const PORT_VECTOR: u8 = 3;
/// Pins that the package brings out: PA0…PA3, PA6, PA7.
const PINS: u8 = 0xcf;

const PINCTRL: u16 = PORT + 0x10;
const PINCTRL_MASK: u8 = 0x8f;
const INVEN: u8 = 0x80;

/// Input sense of a pin, field ISC.
mod isc {
    pub(super) const BOTH_EDGES: u8 = 1;
    pub(super) const RISING: u8 = 2;
    pub(super) const FALLING: u8 = 3;
    pub(super) const INPUT_DISABLE: u8 = 4;
    pub(super) const LEVEL: u8 = 5;
}

/// Registers of PORTA and the levels around it.
///
/// A flag that is set stays set however often its pin changes: two edges before the program clears it are one
/// interrupt. The delay of the input synchroniser is left out. Source: tinyAVR 1-series data sheet (DS40002287),
/// chapter PORT.
#[derive(Debug, Clone)]
pub(super) struct Port {
    dir: u8,
    out: u8,
    input: u8,
    flags: u8,
    pinctrl: [u8; 8],
    pins: Senses,
    /// Levels applied from outside.
    external: u8,
}

impl Default for Port {
    fn default() -> Self {
        Self {
            dir: 0,
            out: 0,
            input: 0,
            flags: 0,
            pinctrl: [0; 8],
            pins: Senses::new([0; 8]),
            external: 0,
        }
    }
}

impl Port {
    /// Registers after a reset; the levels outside stay.
    pub(super) fn after_reset(&self) -> Self {
        Self {
            input: self.external,
            external: self.external,
            ..Self::default()
        }
    }

    /// Interrupt flags.
    pub(super) fn flags(&self) -> u8 {
        self.flags
    }

    /// Applies a level to pin `pin` from outside; ignores pins that the package does not bring out.
    pub(super) fn set_pin(&mut self, pin: u8, high: bool) {
        let bit = 1_u8.checked_shl(u32::from(pin)).unwrap_or(0) & PINS;
        if high {
            self.external |= bit;
        } else {
            self.external &= !bit;
        }
        self.sense();
    }

    /// VPORTA: DIR, OUT, IN, INTFLAGS.
    #[inline]
    pub(super) fn read_mirror(&self, offset: u16) -> u8 {
        match offset {
            0 => self.dir,
            1 => self.out,
            2 => self.input,
            _ => self.flags,
        }
    }

    /// VPORTA: DIR, OUT, IN, INTFLAGS.
    #[inline]
    pub(super) fn write_mirror(&mut self, offset: u16, value: u8) {
        match offset {
            0 => self.dir = value & PINS,
            1 => self.out = value & PINS,
            2 => self.out ^= value & PINS,
            _ => self.flags &= !value,
        }
        self.sense();
    }

    pub(super) fn read(&self, address: u16) -> Option<u8> {
        match address - PORT {
            0..=3 => Some(self.dir),
            4..=7 => Some(self.out),
            8 => Some(self.input),
            9 => Some(self.flags),
            0x10.. => self.pinctrl.get(usize::from(address - PINCTRL)).copied(),
            _ => None,
        }
    }

    /// Whether the address is a register.
    pub(super) fn write(&mut self, address: u16, value: u8) -> bool {
        let pins = value & PINS;
        match address - PORT {
            0 => self.dir = pins,
            1 => self.dir |= pins,
            2 => self.dir &= !pins,
            3 => self.dir ^= pins,
            4 => self.out = pins,
            5 => self.out |= pins,
            6 => self.out &= !pins,
            7 | 8 => self.out ^= pins,
            9 => self.flags &= !value,
            0x10.. => match self.pinctrl.get_mut(usize::from(address - PINCTRL)) {
                Some(control) => {
                    *control = value & PINCTRL_MASK;
                    self.pins = Senses::new(self.pinctrl);
                }
                None => return false,
            },
            _ => return false,
        }
        self.sense();
        true
    }

    /// Input levels anew, and the flags that their changes set.
    fn sense(&mut self) {
        let pins = &self.pins;
        let level = (self.external & !self.dir | self.out & self.dir) ^ pins.inverted;
        let high = level & pins.enabled;
        let (rises, falls) = (high & !self.input, !high & self.input);
        self.input = high;
        self.flags |= rises & pins.rising | falls & pins.falling | !high & pins.low;
    }
}

/// What the PINnCTRL registers say, one bit a pin.
#[derive(Debug, Clone)]
struct Senses {
    inverted: u8,
    enabled: u8,
    rising: u8,
    falling: u8,
    low: u8,
}

impl Senses {
    fn new(pinctrl: [u8; 8]) -> Self {
        let select = |holds: fn(u8) -> bool| {
            let bits = pinctrl.iter().enumerate().filter(|(_, control)| holds(**control));
            bits.fold(0, |all, (pin, _)| all | 1_u8 << pin) & PINS
        };
        Self {
            inverted: select(|control| control & INVEN != 0),
            enabled: select(|control| control & 7 != isc::INPUT_DISABLE),
            rising: select(|control| matches!(control & 7, isc::BOTH_EDGES | isc::RISING)),
            falling: select(|control| matches!(control & 7, isc::BOTH_EDGES | isc::FALLING)),
            low: select(|control| control & 7 == isc::LEVEL),
        }
    }
}

/// First and last address of DAC.
pub(super) const DAC: u16 = 0x0680;
pub(super) const DAC_END: u16 = 0x0681;

const DAC_CTRLA: u16 = DAC;
const ENABLE: u8 = 0x01;
const OUTEN: u8 = 0x40;
const RUNSTDBY: u8 = 0x80;

/// Code on the pin: `None` while the DAC does not drive it.
type Output = Option<u8>;

/// Registers of DAC0 and when its output last changed.
#[derive(Debug, Clone, Default)]
pub(super) struct Dac {
    ctrla: u8,
    data: u8,
    before: Output,
    written_at: u64,
    /// Whether the present instruction has written to the DAC.
    fresh: bool,
}

impl Dac {
    pub(super) fn read(&self, address: u16) -> u8 {
        if address == DAC_CTRLA { self.ctrla } else { self.data }
    }

    pub(super) fn write(&mut self, address: u16, value: u8) {
        self.before = self.output();
        self.fresh = true;
        if address == DAC_CTRLA {
            self.ctrla = value & (ENABLE | OUTEN | RUNSTDBY);
        } else {
            self.data = value;
        }
    }

    /// The instruction that wrote ends at `tick`.
    pub(super) fn settle(&mut self, tick: u64) {
        if self.fresh {
            self.fresh = false;
            self.written_at = tick;
        }
    }

    /// Registers after a reset; what was on the pin before it is remembered.
    pub(super) fn after_reset(&self) -> Self {
        Self {
            before: self.output(),
            fresh: true,
            written_at: self.written_at,
            ..Self::default()
        }
    }

    /// Tick at the end of the last instruction that wrote to the DAC.
    pub(super) fn written_at(&self) -> u64 {
        self.written_at
    }

    /// Code on the pin now.
    pub(super) fn output(&self) -> Output {
        (self.ctrla & (ENABLE | OUTEN) == ENABLE | OUTEN).then_some(self.data)
    }

    /// Code on the pin at `tick`, no earlier than the last write but one.
    pub(super) fn output_at(&self, tick: u64) -> Output {
        if self.written_at > tick {
            self.before
        } else {
            self.output()
        }
    }
}

/// First and last address of VREF.
pub(super) const VREF: u16 = 0x00a0;
pub(super) const VREF_END: u16 = 0x00a1;

/// Registers of VREF.
#[derive(Debug, Clone, Default)]
pub(super) struct Vref {
    registers: [u8; 2],
}

impl Vref {
    pub(super) fn read(&self, address: u16) -> Option<u8> {
        self.registers.get(usize::from(address - VREF)).copied()
    }

    pub(super) fn write(&mut self, address: u16, value: u8) {
        let mask = [0x77, 0x03];
        let k = usize::from(address - VREF);
        if let (Some(register), Some(mask)) = (self.registers.get_mut(k), mask.get(k)) {
            *register = value & mask;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensing(sense: u8) -> Port {
        let mut port = Port::default();
        port.write(PINCTRL + 3, sense);
        port
    }

    fn fired(port: &mut Port, high: bool) -> bool {
        port.set_pin(3, high);
        let fired = port.flags() & 8 != 0;
        port.write_mirror(3, 8);
        fired
    }

    #[test]
    fn each_sense_fires_on_its_edges() {
        for (sense, expected) in [
            (0, [false, false, false, false]),
            (isc::BOTH_EDGES, [true, false, true, true]),
            (isc::RISING, [true, false, false, true]),
            (isc::FALLING, [false, false, true, false]),
            (isc::INPUT_DISABLE, [false, false, false, false]),
        ] {
            let mut port = sensing(sense);
            let levels = [true, true, false, true];
            assert_eq!(levels.map(|level| fired(&mut port, level)), expected, "ISC {sense}");
        }
        let mut port = sensing(isc::LEVEL);
        port.write_mirror(3, 8);
        assert_eq!(port.flags(), 8, "a low level sets its flag again");
    }

    #[test]
    fn pins_that_are_not_there_are_ignored() {
        let mut port = sensing(isc::BOTH_EDGES);
        for pin in [4, 5, 8, 11, u8::MAX] {
            port.set_pin(pin, true);
        }
        assert_eq!((port.read_mirror(2), port.flags()), (0, 0));
    }

    #[test]
    fn edges_before_the_flag_is_cleared_are_one() {
        let mut port = sensing(isc::BOTH_EDGES);
        port.set_pin(3, true);
        port.set_pin(3, false);
        assert_eq!(port.flags(), 8);
        port.write(PINCTRL + 2, isc::RISING);
        port.set_pin(2, true);
        port.write_mirror(3, 8);
        assert_eq!(port.flags(), 4, "flags of other pins stay");
        port.write(PORT + 9, 4);
        assert_eq!(port.flags(), 0);
    }

    #[test]
    fn the_mirror_shows_the_port_and_toggles_by_its_input() {
        let mut port = Port::default();
        port.write(PORT + 1, 0x40);
        port.write(PORT + 5, 0x40);
        assert_eq!((0..3).map(|k| port.read_mirror(k)).collect::<Vec<_>>(), [0x40; 3]);
        port.write_mirror(2, 0x40);
        assert_eq!(port.read(PORT + 8), Some(0));
        port.write(PINCTRL + 6, INVEN);
        assert_eq!(port.read(PORT + 8), Some(0x40));
        assert_eq!(port.read(PORT + 0x0a), None);
        assert!(!port.write(PORT + 0x0f, 1));
    }

    #[test]
    fn a_code_is_out_from_the_end_of_the_write() {
        let mut dac = Dac::default();
        dac.write(DAC_CTRLA, ENABLE);
        dac.write(DAC + 1, 9);
        dac.settle(90);
        assert_eq!(dac.output(), None);
        dac.write(DAC_CTRLA, ENABLE | OUTEN);
        dac.settle(100);
        dac.write(DAC + 1, 200);
        dac.settle(150);
        dac.settle(160);
        assert_eq!(
            (dac.output_at(149), dac.output_at(150), dac.written_at()),
            (Some(9), Some(200), 150)
        );
    }
}
