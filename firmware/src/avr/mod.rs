//! The AVRxt core: predecoded program, one instruction a step, exact values and cycle counts.
//!
//! AVRxt is the CPU of the tinyAVR 0/1/2, megaAVR 0 and AVR Dx families. It has the instructions of the classic core
//! (AVRe+), with these differences: the register file is not part of the data space, only the program changes the I
//! flag, and PUSH, ST, SBI, CBI and calls are faster. Source of every value and cycle count: *AVR Instruction Set
//! Manual*, Microchip DS40002198.
//!
//! [`Program`] is the flash, decoded once. [`Core`] is the state of the CPU. A [`DataSpace`] is everything else that
//! has an address. The core knows neither clock nor interrupt sources: its user counts the cycles of each [`Step`] and
//! calls [`Core::interrupt`] if a source requests it and [`Core::interrupts_enabled`].
//!
//! Not executed: SPM, ELPM, EICALL, EIJMP (parts with more flash or a boot loader) and XCH, LAS, LAC, LAT, DES (XMEGA
//! only). They report [`Event::Illegal`], as unassigned opcodes do.
//!
//! ```
//! use spts_firmware::avr::{Core, DataSpace, Event, Program};
//!
//! struct Sram([u8; 256]);
//! impl DataSpace for Sram {
//!     fn read(&mut self, address: u16) -> u8 {
//!         self.0[usize::from(address & 0xFF)]
//!     }
//!     fn write(&mut self, address: u16, value: u8) {
//!         self.0[usize::from(address & 0xFF)] = value;
//!     }
//! }
//!
//! // ldi r24, 200; subi r24, 56; sleep
//! let program = Program::from_words(&[0xEC88, 0x5388, 0x9588]);
//! let mut core = Core::new(0x3FFF);
//! let mut data = Sram([0; 256]);
//! while core.step(&program, &mut data).event != Event::Sleep {}
//! assert_eq!(core.registers[24], 144);
//! ```

mod core;
mod op;
mod program;

pub use self::core::{Core, Event, INTERRUPT_ENTRY_CYCLES, Step};
pub use self::op::Op;
pub use self::program::{Program, disassemble};

/// Bits of the status register.
pub mod sreg {
    /// Carry.
    pub const C: u8 = 1 << 0;
    /// Zero.
    pub const Z: u8 = 1 << 1;
    /// Negative.
    pub const N: u8 = 1 << 2;
    /// Two's complement overflow.
    pub const V: u8 = 1 << 3;
    /// Sign, N ⊕ V.
    pub const S: u8 = 1 << 4;
    /// Half carry.
    pub const H: u8 = 1 << 5;
    /// Bit copy storage.
    pub const T: u8 = 1 << 6;
    /// Global interrupt enable.
    pub const I: u8 = 1 << 7;
}

/// Everything in the data space except the core's own SPL, SPH and SREG (0x3D…0x3F): I/O, SRAM, EEPROM and mapped
/// flash.
///
/// Addresses are those of the AVRxt data space: 0x0000 is the first I/O register, r0…r31 have no address.
pub trait DataSpace {
    /// Reads the byte at `address`. Reading may have side effects.
    fn read(&mut self, address: u16) -> u8;

    /// Writes `value` to `address`.
    fn write(&mut self, address: u16, value: u8);

    /// SBI and CBI: sets bit `mask` (one bit) at `address` to `set`.
    ///
    /// These instructions change only that bit. Override this read-modify-write if writing a register back has side
    /// effects (flags cleared by writing ones).
    #[inline]
    fn write_bit(&mut self, address: u16, mask: u8, set: bool) {
        let old = self.read(address);
        self.write(address, if set { old | mask } else { old & !mask });
    }
}
