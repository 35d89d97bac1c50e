//! State of the CPU, stack and interrupts.

use super::sreg::I;
use super::{DataSpace, Program, sreg};

/// Cycles from an interrupt's acceptance to its vector: one to finish the running instruction, two to store the program
/// counter. The jump at the vector (RJMP, 2) is an instruction of its own; together they are the datasheet's five.
pub const INTERRUPT_ENTRY_CYCLES: u32 = 3;

/// Data addresses that the core itself serves.
pub(super) const SPL: u16 = 0x3D;
pub(super) const SPH: u16 = 0x3E;
pub(super) const SREG: u16 = 0x3F;

/// Instructions for which a write to SPL holds back interrupts.
const STACK_POINTER_HOLD: u64 = 4;

/// Request of an instruction to the device around the core.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// No request.
    None,
    /// SLEEP: sleep if the sleep controller allows it.
    Sleep,
    /// RETI: the interrupt in service ends.
    Reti,
    /// BREAK.
    Break,
    /// WDR: the watchdog timer restarts.
    WatchdogReset,
    /// The word is not an instruction of this core; it was executed as NOP.
    Illegal,
}

/// What executing one instruction took, and what it asks of the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// CPU cycles, with internal SRAM or I/O. Reading flash or EEPROM through the data space costs at least one more
    /// (DS40002198, notes to the cycles). The owner of those memories must add it.
    pub cycles: u32,
    /// Request to the device.
    pub event: Event,
}

/// The CPU of an AVR microcontroller: its registers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Core {
    /// r0…r31.
    pub registers: [u8; 32],
    /// Program counter, in words.
    pub pc: u16,
    /// Stack pointer: the next free byte.
    pub sp: u16,
    /// Status register, bits of [`sreg`](super::sreg).
    pub sreg: u8,
    /// Instructions executed so far.
    pub instructions: u64,
    /// Value of `instructions` from which interrupts are accepted.
    hold_until: u64,
}

impl Core {
    /// State after reset, with the stack at `sp` (the last byte of SRAM on AVRxt).
    #[must_use]
    pub const fn new(sp: u16) -> Self {
        Self {
            registers: [0; 32],
            pc: 0,
            sp,
            sreg: 0,
            instructions: 0,
            hold_until: 0,
        }
    }

    /// Whether an interrupt may be executed before the next instruction: the I flag is set, one instruction has been
    /// executed after SEI or RETI, and the hold after a write to SPL has ended (four instructions, or the next write to
    /// I/O memory).
    #[must_use]
    #[inline]
    pub const fn interrupts_enabled(&self) -> bool {
        self.sreg & I != 0 && self.instructions >= self.hold_until
    }

    /// Executes an interrupt: stores the program counter and jumps to `vector` (a number; vectors are one word each).
    /// Returns [`INTERRUPT_ENTRY_CYCLES`].
    ///
    /// The I flag does not change: on AVRxt the interrupt controller blocks interrupts of the same or a lower level.
    pub fn interrupt<D: DataSpace>(&mut self, vector: u8, data: &mut D) -> u32 {
        self.push_pc(data);
        self.pc = u16::from(vector);
        INTERRUPT_ENTRY_CYCLES
    }

    /// Pair of registers `low`, `low + 1`.
    #[inline]
    pub(super) const fn pair(&self, low: u8) -> u16 {
        u16::from_le_bytes([
            self.registers[(low & 31) as usize],
            self.registers[((low + 1) & 31) as usize],
        ])
    }

    #[inline]
    pub(super) const fn set_pair(&mut self, low: u8, value: u16) {
        let [l, h] = value.to_le_bytes();
        self.registers[(low & 31) as usize] = l;
        self.registers[((low + 1) & 31) as usize] = h;
    }

    /// Reads the data space.
    #[inline]
    pub(super) fn load<D: DataSpace>(&self, data: &mut D, address: u16) -> u8 {
        match address {
            SPL => self.sp.to_le_bytes()[0],
            SPH => self.sp.to_le_bytes()[1],
            SREG => self.sreg,
            _ => data.read(address),
        }
    }

    /// Writes the data space; returns the wait states.
    #[inline]
    pub(super) fn store<D: DataSpace>(&mut self, data: &mut D, address: u16, value: u8) -> u32 {
        if address > SREG {
            data.write(address, value);
            return 0;
        }
        self.store_io(data, address, value)
    }

    /// Writes I/O memory; returns the wait states: one if the I flag changes.
    #[inline]
    pub(super) fn store_io<D: DataSpace>(&mut self, data: &mut D, address: u16, value: u8) -> u32 {
        let [low, high] = self.sp.to_le_bytes();
        self.hold_until = 0;
        match address {
            SPL => {
                self.sp = u16::from_le_bytes([value, high]);
                self.hold(STACK_POINTER_HOLD);
            }
            SPH => self.sp = u16::from_le_bytes([low, value]),
            SREG => {
                let changed = (self.sreg ^ value) & sreg::I;
                self.sreg = value;
                return u32::from(changed != 0);
            }
            _ => data.write(address, value),
        }
        0
    }

    /// SBI and CBI; the core's own registers are out of their reach (0x00…0x1F).
    #[inline]
    pub(super) fn store_bit<D: DataSpace>(&mut self, data: &mut D, address: u8, mask: u8, set: bool) {
        self.hold_until = 0;
        data.write_bit(u16::from(address), mask, set);
    }

    /// Accepts no interrupt before `instructions` more have been executed.
    #[inline]
    pub(super) const fn hold(&mut self, instructions: u64) {
        self.hold_until = self.instructions + instructions;
    }

    #[inline]
    pub(super) fn push<D: DataSpace>(&mut self, data: &mut D, value: u8) {
        self.store(data, self.sp, value);
        self.sp = self.sp.wrapping_sub(1);
    }

    #[inline]
    pub(super) fn pop<D: DataSpace>(&mut self, data: &mut D) -> u8 {
        self.sp = self.sp.wrapping_add(1);
        self.load(data, self.sp)
    }

    /// Low byte first, so that the high byte lies at the lower address.
    #[inline]
    pub(super) fn push_pc<D: DataSpace>(&mut self, data: &mut D) {
        let [low, high] = self.pc.to_le_bytes();
        self.push(data, low);
        self.push(data, high);
    }

    #[inline]
    pub(super) fn pop_pc<D: DataSpace>(&mut self, data: &mut D, program: &Program) {
        let high = self.pop(data);
        let low = self.pop(data);
        self.pc = program.wrap(u16::from_le_bytes([low, high]));
    }
}
