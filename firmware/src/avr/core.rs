//! State of the CPU, stack, interrupts, and execution: one match over the instructions.
//!
//! Cycle counts: *AVR Instruction Set Manual*, DS40002198, table "Instruction Set Summary", column AVRxt, with a 16-bit
//! program counter and data in internal SRAM. Flags: its "Status Register (SREG) and Boolean Formula". The formulas for
//! H and C are the same one, taken at bit 3 and bit 7, so they are evaluated on the whole byte.
//!
//! The manual does not define a load to, or a store from, the pointer that the instruction itself changes (`ld r26,
//! X+`). Here the loaded byte stays, and the old byte is stored.

use super::DataSpace;
use super::op::Op;
use super::program::Program;
use super::sreg::{C, H, I, N, S, T, V, Z};

/// Cycles from an interrupt's acceptance to its vector: one to finish the running instruction, two to store the program
/// counter. The jump at the vector (RJMP, 2) is an instruction of its own; together they are the datasheet's five.
pub const INTERRUPT_ENTRY_CYCLES: u32 = 3;

/// Data addresses that the core itself serves.
const SPL: u16 = 0x3D;
const SPH: u16 = 0x3E;
const SREG: u16 = 0x3F;

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

impl Step {
    #[inline]
    const fn of(cycles: u32, event: Event) -> Self {
        Self { cycles, event }
    }
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
    pub const fn new(sp: u16) -> Self {
        Self { registers: [0; 32], pc: 0, sp, sreg: 0, instructions: 0, hold_until: 0 }
    }

    /// Whether an interrupt may be executed before the next instruction: the I flag is set, one instruction has been
    /// executed after SEI or RETI, and the hold after a write to SPL has ended (four instructions, or the next write to
    /// I/O memory).
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
    const fn pair(&self, low: u8) -> u16 {
        u16::from_le_bytes([self.registers[(low & 31) as usize], self.registers[((low + 1) & 31) as usize]])
    }

    #[inline]
    const fn set_pair(&mut self, low: u8, value: u16) {
        let [l, h] = value.to_le_bytes();
        self.registers[(low & 31) as usize] = l;
        self.registers[((low + 1) & 31) as usize] = h;
    }

    /// Reads the data space.
    #[inline]
    fn load<D: DataSpace>(&self, data: &mut D, address: u16) -> u8 {
        match address {
            SPL => self.sp.to_le_bytes()[0],
            SPH => self.sp.to_le_bytes()[1],
            SREG => self.sreg,
            _ => data.read(address),
        }
    }

    /// Writes the data space; returns the wait states.
    #[inline]
    fn store<D: DataSpace>(&mut self, data: &mut D, address: u16, value: u8) -> u32 {
        if address > SREG {
            data.write(address, value);
            return 0;
        }
        self.store_io(data, address, value)
    }

    /// Writes I/O memory; returns the wait states: one if the I flag changes.
    #[inline]
    fn store_io<D: DataSpace>(&mut self, data: &mut D, address: u16, value: u8) -> u32 {
        let [low, high] = self.sp.to_le_bytes();
        self.hold_until = 0;
        match address {
            SPL => {
                self.sp = u16::from_le_bytes([value, high]);
                self.hold(STACK_POINTER_HOLD);
            }
            SPH => self.sp = u16::from_le_bytes([low, value]),
            SREG => {
                let changed = (self.sreg ^ value) & I;
                self.sreg = value;
                return u32::from(changed != 0);
            }
            _ => data.write(address, value),
        }
        0
    }

    /// SBI and CBI; the core's own registers are out of their reach (0x00…0x1F).
    #[inline]
    fn store_bit<D: DataSpace>(&mut self, data: &mut D, address: u8, mask: u8, set: bool) {
        self.hold_until = 0;
        data.write_bit(u16::from(address), mask, set);
    }

    /// Accepts no interrupt before `instructions` more have been executed.
    #[inline]
    const fn hold(&mut self, instructions: u64) {
        self.hold_until = self.instructions + instructions;
    }

    #[inline]
    fn push<D: DataSpace>(&mut self, data: &mut D, value: u8) {
        self.store(data, self.sp, value);
        self.sp = self.sp.wrapping_sub(1);
    }

    #[inline]
    fn pop<D: DataSpace>(&mut self, data: &mut D) -> u8 {
        self.sp = self.sp.wrapping_add(1);
        self.load(data, self.sp)
    }

    /// Low byte first, so that the high byte lies at the lower address.
    #[inline]
    fn push_pc<D: DataSpace>(&mut self, data: &mut D) {
        let [low, high] = self.pc.to_le_bytes();
        self.push(data, low);
        self.push(data, high);
    }

    #[inline]
    fn pop_pc<D: DataSpace>(&mut self, data: &mut D, program: &Program) {
        let high = self.pop(data);
        let low = self.pop(data);
        self.pc = program.wrap(u16::from_le_bytes([low, high]));
    }
}

/// Low register of the pointer Z.
const POINTER_Z: u8 = 30;

impl Core {
    /// Executes the instruction at [`pc`](Self::pc).
    // A call would save and restore most registers of the host for one instruction: less than half the speed.
    #[inline(always)]
    pub fn step<D: DataSpace>(&mut self, program: &Program, data: &mut D) -> Step {
        let op = program.op(self.pc);
        self.pc = program.wrap(self.pc.wrapping_add(1));
        self.instructions += 1;
        let cycles = match op {
            Op::Nop => 1,
            Op::Mov { d, r } => self.set(d, self.get(r)),
            Op::Ldi { d, k } => self.set(d, k),
            Op::Movw { d, r } => self.set_word(d, self.pair(r), 1),

            Op::Add { d, r } => self.keep(d, add(self.get(d), self.get(r), 0, self.sreg)),
            Op::Adc { d, r } => self.keep(d, add(self.get(d), self.get(r), self.sreg & C, self.sreg)),
            Op::Sub { d, r } => self.keep(d, subtract(self.get(d), self.get(r), self.sreg)),
            Op::Subi { d, k } => self.keep(d, subtract(self.get(d), k, self.sreg)),
            Op::Sbc { d, r } => self.keep(d, subtract_with_carry(self.get(d), self.get(r), self.sreg)),
            Op::Sbci { d, k } => self.keep(d, subtract_with_carry(self.get(d), k, self.sreg)),
            Op::Cp { d, r } => self.compare(subtract(self.get(d), self.get(r), self.sreg)),
            Op::Cpi { d, k } => self.compare(subtract(self.get(d), k, self.sreg)),
            Op::Cpc { d, r } => self.compare(subtract_with_carry(self.get(d), self.get(r), self.sreg)),
            Op::Neg { d } => self.keep(d, negate(self.get(d), self.sreg)),
            Op::Inc { d } => self.keep(d, increment(self.get(d), self.sreg)),
            Op::Dec { d } => self.keep(d, decrement(self.get(d), self.sreg)),
            Op::Adiw { d, k } => self.keep_word(d, add_word(self.pair(d), k, self.sreg)),
            Op::Sbiw { d, k } => self.keep_word(d, subtract_word(self.pair(d), k, self.sreg)),

            Op::And { d, r } => self.logic(d, self.get(d) & self.get(r)),
            Op::Andi { d, k } => self.logic(d, self.get(d) & k),
            Op::Or { d, r } => self.logic(d, self.get(d) | self.get(r)),
            Op::Ori { d, k } => self.logic(d, self.get(d) | k),
            Op::Eor { d, r } => self.logic(d, self.get(d) ^ self.get(r)),
            Op::Com { d } => self.keep(d, complement(self.get(d), self.sreg)),
            Op::Lsr { d } => self.keep(d, shift_right(self.get(d), 0, self.sreg)),
            Op::Ror { d } => self.keep(d, shift_right(self.get(d), (self.sreg & C) << 7, self.sreg)),
            Op::Asr { d } => self.keep(d, shift_right(self.get(d), self.get(d) & 0x80, self.sreg)),
            Op::Swap { d } => self.set(d, self.get(d).rotate_left(4)),

            Op::Mul { d, r } => self.keep_word(0, product(self.product_unsigned(d, r), self.sreg)),
            Op::Muls { d, r } => self.keep_word(0, product(self.product_signed(d, r), self.sreg)),
            Op::Mulsu { d, r } => self.keep_word(0, product(self.product_mixed(d, r), self.sreg)),
            Op::Fmul { d, r } => self.keep_word(0, fractional(self.product_unsigned(d, r), self.sreg)),
            Op::Fmuls { d, r } => self.keep_word(0, fractional(self.product_signed(d, r), self.sreg)),
            Op::Fmulsu { d, r } => self.keep_word(0, fractional(self.product_mixed(d, r), self.sreg)),

            Op::Bset { mask } => self.set_flag(mask),
            Op::Bclr { mask } => {
                self.sreg &= !mask;
                1
            }
            Op::Bst { d, mask } => {
                self.sreg = if self.get(d) & mask == 0 { self.sreg & !T } else { self.sreg | T };
                1
            }
            Op::Bld { d, mask } => {
                let old = self.get(d);
                self.set(d, if self.sreg & T == 0 { old & !mask } else { old | mask })
            }

            Op::Ldd { d, p, q } => {
                let address = self.pair(p).wrapping_add(u16::from(q));
                self.read_to(data, d, address, 2)
            }
            Op::LdIncrement { d, p } => {
                let address = self.pair(p);
                self.set_pair(p, address.wrapping_add(1));
                self.read_to(data, d, address, 2)
            }
            Op::LdDecrement { d, p } => {
                let address = self.pair(p).wrapping_sub(1);
                self.set_pair(p, address);
                self.read_to(data, d, address, 2)
            }
            Op::Lds { d, k } => {
                self.pass_second_word(program);
                self.read_to(data, d, k, 3)
            }
            Op::In { d, a } => self.read_to(data, d, u16::from(a), 1),
            Op::Pop { d } => {
                let value = self.pop(data);
                self.set(d, value);
                2
            }
            Op::Lpm { d } => {
                self.set(d, program.byte(self.pair(POINTER_Z)));
                3
            }
            Op::LpmIncrement { d } => {
                let address = self.pair(POINTER_Z);
                self.set_pair(POINTER_Z, address.wrapping_add(1));
                self.set(d, program.byte(address));
                3
            }

            Op::Std { r, p, q } => {
                let address = self.pair(p).wrapping_add(u16::from(q));
                1 + self.store(data, address, self.get(r))
            }
            Op::StIncrement { r, p } => {
                let (address, value) = (self.pair(p), self.get(r));
                self.set_pair(p, address.wrapping_add(1));
                1 + self.store(data, address, value)
            }
            Op::StDecrement { r, p } => {
                let (address, value) = (self.pair(p).wrapping_sub(1), self.get(r));
                self.set_pair(p, address);
                1 + self.store(data, address, value)
            }
            Op::Sts { r, k } => {
                self.pass_second_word(program);
                2 + self.store(data, k, self.get(r))
            }
            Op::Out { a, r } => 1 + self.store_io(data, u16::from(a), self.get(r)),
            Op::Push { r } => {
                self.push(data, self.get(r));
                1
            }
            Op::Sbi { a, mask } => self.write_bit(data, a, mask, true),
            Op::Cbi { a, mask } => self.write_bit(data, a, mask, false),

            Op::Rjmp { offset } => self.jump(program, self.pc.wrapping_add_signed(offset), 2),
            Op::Ijmp => self.jump(program, self.pair(POINTER_Z), 2),
            Op::Jmp { k } => self.jump(program, k, 3),
            Op::Rcall { offset } => self.call(program, data, self.pc.wrapping_add_signed(offset), 2),
            Op::Icall => self.call(program, data, self.pair(POINTER_Z), 2),
            Op::Call { k } => {
                self.pass_second_word(program);
                self.call(program, data, k, 3)
            }
            Op::Ret => {
                self.pop_pc(data, program);
                4
            }
            Op::Brbs { mask, offset } => self.branch(program, self.sreg & mask != 0, offset),
            Op::Brbc { mask, offset } => self.branch(program, self.sreg & mask == 0, offset),
            Op::Cpse { d, r } => self.skip(program, self.get(d) == self.get(r)),
            Op::Sbrc { r, mask } => self.skip(program, self.get(r) & mask == 0),
            Op::Sbrs { r, mask } => self.skip(program, self.get(r) & mask != 0),
            Op::Sbic { a, mask } => {
                let value = self.load(data, u16::from(a));
                self.skip(program, value & mask == 0)
            }
            Op::Sbis { a, mask } => {
                let value = self.load(data, u16::from(a));
                self.skip(program, value & mask != 0)
            }

            Op::Reti => {
                self.pop_pc(data, program);
                self.hold(1);
                return Step::of(4, Event::Reti);
            }
            Op::Sleep => return Step::of(1, Event::Sleep),
            Op::Break => return Step::of(1, Event::Break),
            Op::Wdr => return Step::of(1, Event::WatchdogReset),
            Op::Illegal { .. } => return Step::of(1, Event::Illegal),
        };
        Step::of(cycles, Event::None)
    }
}

/// What instructions have in common; each returns the cycles.
impl Core {
    #[inline]
    const fn get(&self, register: u8) -> u8 {
        self.registers[(register & 31) as usize]
    }

    #[inline]
    const fn set(&mut self, register: u8, value: u8) -> u32 {
        self.registers[(register & 31) as usize] = value;
        1
    }

    #[inline]
    const fn set_word(&mut self, low: u8, value: u16, cycles: u32) -> u32 {
        self.set_pair(low, value);
        cycles
    }

    #[inline]
    const fn keep(&mut self, d: u8, (result, sreg): (u8, u8)) -> u32 {
        self.sreg = sreg;
        self.set(d, result)
    }

    #[inline]
    const fn keep_word(&mut self, low: u8, (result, sreg): (u16, u8)) -> u32 {
        self.sreg = sreg;
        self.set_word(low, result, 2)
    }

    #[inline]
    const fn compare(&mut self, (_, sreg): (u8, u8)) -> u32 {
        self.sreg = sreg;
        1
    }

    #[inline]
    const fn logic(&mut self, d: u8, result: u8) -> u32 {
        self.keep(d, (result, logic(result, self.sreg)))
    }

    #[inline]
    fn product_unsigned(&self, d: u8, r: u8) -> u16 {
        u16::from(self.get(d)) * u16::from(self.get(r))
    }

    #[inline]
    fn product_signed(&self, d: u8, r: u8) -> u16 {
        let (d, r) = (self.get(d).cast_signed(), self.get(r).cast_signed());
        (i16::from(d) * i16::from(r)).cast_unsigned()
    }

    /// Rd signed, Rr unsigned.
    #[inline]
    fn product_mixed(&self, d: u8, r: u8) -> u16 {
        let d = self.get(d).cast_signed();
        (i16::from(d) * i16::from(self.get(r))).cast_unsigned()
    }

    /// BSET; the instruction behind SEI is executed before any interrupt.
    #[inline]
    const fn set_flag(&mut self, mask: u8) -> u32 {
        if mask == I && self.sreg & I == 0 {
            self.hold(1);
        }
        self.sreg |= mask;
        1
    }

    /// Over the second word, behind which the program goes on.
    #[inline]
    const fn pass_second_word(&mut self, program: &Program) {
        self.pc = program.wrap(self.pc.wrapping_add(1));
    }

    #[inline]
    fn read_to<D: DataSpace>(&mut self, data: &mut D, d: u8, address: u16, cycles: u32) -> u32 {
        let value = self.load(data, address);
        self.set(d, value);
        cycles
    }

    #[inline]
    fn write_bit<D: DataSpace>(&mut self, data: &mut D, a: u8, mask: u8, set: bool) -> u32 {
        self.store_bit(data, a, mask, set);
        1
    }

    #[inline]
    const fn jump(&mut self, program: &Program, target: u16, cycles: u32) -> u32 {
        self.pc = program.wrap(target);
        cycles
    }

    #[inline]
    fn call<D: DataSpace>(&mut self, program: &Program, data: &mut D, target: u16, cycles: u32) -> u32 {
        self.push_pc(data);
        self.jump(program, target, cycles)
    }

    /// 1 cycle, 2 if taken.
    #[inline]
    fn branch(&mut self, program: &Program, taken: bool, offset: i8) -> u32 {
        if !taken {
            return 1;
        }
        self.jump(program, self.pc.wrapping_add_signed(i16::from(offset)), 2)
    }

    /// 1 cycle, and one more for each word skipped.
    #[inline]
    fn skip(&mut self, program: &Program, skipped: bool) -> u32 {
        if !skipped {
            return 1;
        }
        let words = program.op(self.pc).words();
        self.jump(program, self.pc.wrapping_add(words), 1 + u32::from(words))
    }
}

// Arithmetic: every function returns the result and the new SREG; flags an instruction does not affect keep their
// value.

/// Bit 7 of a byte as 0 or 1.
const fn msb(byte: u8) -> u8 {
    byte >> 7
}

/// N, V, S = N ⊕ V of a result and its overflow (0 or 1).
const fn signs(n: u8, v: u8) -> u8 {
    (n * N) | (v * V) | ((n ^ v) * S)
}

/// Z of a result.
const fn zero(result: u8) -> u8 {
    (result == 0) as u8 * Z
}

/// Z of a 16-bit result.
const fn zero_word(result: u16) -> u8 {
    (result == 0) as u8 * Z
}

/// H and C of the carries (or borrows) out of every bit.
const fn carries(carry: u8) -> u8 {
    (((carry >> 3) & 1) * H) | (msb(carry) * C)
}

/// ADD (`carry` 0) and ADC.
///
/// carry = Rd·Rr + Rr·¬R + ¬R·Rd, V = Rd7·Rr7·¬R7 + ¬Rd7·¬Rr7·R7.
#[inline]
const fn add(d: u8, r: u8, carry: u8, sreg: u8) -> (u8, u8) {
    let result = d.wrapping_add(r).wrapping_add(carry);
    let carry = d & r | r & !result | !result & d;
    let overflow = d & r & !result | !d & !r & result;
    let flags = carries(carry) | signs(msb(result), msb(overflow)) | zero(result);
    (result, sreg & !(H | S | V | N | Z | C) | flags)
}

/// SUB, SUBI, CP, CPI.
///
/// borrow = ¬Rd·Rr + Rr·R + R·¬Rd, V = Rd7·¬Rr7·¬R7 + ¬Rd7·Rr7·R7.
#[inline]
const fn subtract(d: u8, r: u8, sreg: u8) -> (u8, u8) {
    let result = d.wrapping_sub(r);
    (result, difference_flags(d, r, result, sreg) | zero(result))
}

/// SBC, SBCI, CPC: as SUB, but Z = ¬R7·…·¬R0·Z, so that it tells whether a number of several bytes is zero.
#[inline]
const fn subtract_with_carry(d: u8, r: u8, sreg: u8) -> (u8, u8) {
    let result = d.wrapping_sub(r).wrapping_sub(sreg & C);
    let flags = difference_flags(d, r, result, sreg) | (zero(result) & sreg);
    (result, flags)
}

/// SREG of a difference with Z clear.
const fn difference_flags(d: u8, r: u8, result: u8, sreg: u8) -> u8 {
    let borrow = !d & r | r & result | result & !d;
    let overflow = d & !r & !result | !d & r & result;
    let flags = carries(borrow) | signs(msb(result), msb(overflow));
    sreg & !(H | S | V | N | Z | C) | flags
}

/// SREG of AND, OR, EOR: V = 0.
#[inline]
const fn logic(result: u8, sreg: u8) -> u8 {
    sreg & !(S | V | N | Z) | signs(msb(result), 0) | zero(result)
}

/// COM: V = 0, C = 1.
#[inline]
const fn complement(d: u8, sreg: u8) -> (u8, u8) {
    (!d, logic(!d, sreg) | C)
}

/// NEG: H = R3 + Rd3, V = R7·¬R6·…·¬R0, C = R7 + … + R0, which are those of 0 − Rd.
#[inline]
const fn negate(d: u8, sreg: u8) -> (u8, u8) {
    subtract(0, d, sreg)
}

/// INC: V if the result is 0x80.
#[inline]
const fn increment(d: u8, sreg: u8) -> (u8, u8) {
    let result = d.wrapping_add(1);
    let flags = signs(msb(result), (result == 0x80) as u8) | zero(result);
    (result, sreg & !(S | V | N | Z) | flags)
}

/// DEC: V if the result is 0x7F.
#[inline]
const fn decrement(d: u8, sreg: u8) -> (u8, u8) {
    let result = d.wrapping_sub(1);
    let flags = signs(msb(result), (result == 0x7F) as u8) | zero(result);
    (result, sreg & !(S | V | N | Z) | flags)
}

/// LSR, ROR and ASR: `d` moves right behind the bit `top` (0 or 0x80); C = Rd0, V = N ⊕ C.
#[inline]
const fn shift_right(d: u8, top: u8, sreg: u8) -> (u8, u8) {
    let (result, carry) = (d >> 1 | top, d & 1);
    let n = msb(result);
    let flags = signs(n, n ^ carry) | zero(result) | (carry * C);
    (result, sreg & !(S | V | N | Z | C) | flags)
}

/// ADIW: V = ¬Rdh7·R15, C = ¬R15·Rdh7.
#[inline]
const fn add_word(d: u16, k: u8, sreg: u8) -> (u16, u8) {
    let result = d.wrapping_add(k as u16);
    let (old, new) = (d.to_be_bytes()[0], result.to_be_bytes()[0]);
    let flags = signs(msb(new), msb(!old & new)) | zero_word(result) | (msb(old & !new) * C);
    (result, sreg & !(S | V | N | Z | C) | flags)
}

/// SBIW: V = Rdh7·¬R15, C = R15·¬Rdh7.
#[inline]
const fn subtract_word(d: u16, k: u8, sreg: u8) -> (u16, u8) {
    let result = d.wrapping_sub(k as u16);
    let (old, new) = (d.to_be_bytes()[0], result.to_be_bytes()[0]);
    let flags = signs(msb(new), msb(old & !new)) | zero_word(result) | (msb(!old & new) * C);
    (result, sreg & !(S | V | N | Z | C) | flags)
}

/// SREG of MUL, MULS, MULSU: C = R15 of the product.
#[inline]
const fn product(product: u16, sreg: u8) -> (u16, u8) {
    let flags = (msb(product.to_be_bytes()[0]) * C) | zero_word(product);
    (product, sreg & !(Z | C) | flags)
}

/// FMUL, FMULS, FMULSU: the product shifted left by one; C is the bit shifted out.
#[inline]
const fn fractional(product: u16, sreg: u8) -> (u16, u8) {
    let result = product << 1;
    let flags = (msb(product.to_be_bytes()[0]) * C) | zero_word(result);
    (result, sreg & !(Z | C) | flags)
}
