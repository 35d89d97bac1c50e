//! Execution: one match over the instructions.
//!
//! Cycle counts: *AVR Instruction Set Manual*, DS40002198, table "Instruction Set Summary", column AVRxt, with a 16-bit
//! program counter and data in internal SRAM.
//!
//! The manual does not define a load to, or a store from, the pointer that the instruction itself changes (`ld r26,
//! X+`). Here the loaded byte stays, and the old byte is stored.

use super::core::{Core, Event, Step};
use super::op::Op;
use super::sreg::{C, I, T};
use super::{DataSpace, Program, alu};

const Z: u8 = 30;

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

            Op::Add { d, r } => self.keep(d, alu::add(self.get(d), self.get(r), 0, self.sreg)),
            Op::Adc { d, r } => self.keep(d, alu::add(self.get(d), self.get(r), self.sreg & C, self.sreg)),
            Op::Sub { d, r } => self.keep(d, alu::subtract(self.get(d), self.get(r), self.sreg)),
            Op::Subi { d, k } => self.keep(d, alu::subtract(self.get(d), k, self.sreg)),
            Op::Sbc { d, r } => self.keep(d, alu::subtract_with_carry(self.get(d), self.get(r), self.sreg)),
            Op::Sbci { d, k } => self.keep(d, alu::subtract_with_carry(self.get(d), k, self.sreg)),
            Op::Cp { d, r } => self.compare(alu::subtract(self.get(d), self.get(r), self.sreg)),
            Op::Cpi { d, k } => self.compare(alu::subtract(self.get(d), k, self.sreg)),
            Op::Cpc { d, r } => self.compare(alu::subtract_with_carry(self.get(d), self.get(r), self.sreg)),
            Op::Neg { d } => self.keep(d, alu::negate(self.get(d), self.sreg)),
            Op::Inc { d } => self.keep(d, alu::increment(self.get(d), self.sreg)),
            Op::Dec { d } => self.keep(d, alu::decrement(self.get(d), self.sreg)),
            Op::Adiw { d, k } => self.keep_word(d, alu::add_word(self.pair(d), k, self.sreg)),
            Op::Sbiw { d, k } => self.keep_word(d, alu::subtract_word(self.pair(d), k, self.sreg)),

            Op::And { d, r } => self.logic(d, self.get(d) & self.get(r)),
            Op::Andi { d, k } => self.logic(d, self.get(d) & k),
            Op::Or { d, r } => self.logic(d, self.get(d) | self.get(r)),
            Op::Ori { d, k } => self.logic(d, self.get(d) | k),
            Op::Eor { d, r } => self.logic(d, self.get(d) ^ self.get(r)),
            Op::Com { d } => self.keep(d, alu::complement(self.get(d), self.sreg)),
            Op::Lsr { d } => self.keep(d, alu::shift_right(self.get(d), 0, self.sreg)),
            Op::Ror { d } => self.keep(d, alu::shift_right(self.get(d), (self.sreg & C) << 7, self.sreg)),
            Op::Asr { d } => self.keep(d, alu::shift_right(self.get(d), self.get(d) & 0x80, self.sreg)),
            Op::Swap { d } => self.set(d, self.get(d).rotate_left(4)),

            Op::Mul { d, r } => self.keep_word(0, alu::product(self.product_unsigned(d, r), self.sreg)),
            Op::Muls { d, r } => self.keep_word(0, alu::product(self.product_signed(d, r), self.sreg)),
            Op::Mulsu { d, r } => self.keep_word(0, alu::product(self.product_mixed(d, r), self.sreg)),
            Op::Fmul { d, r } => self.keep_word(0, alu::fractional(self.product_unsigned(d, r), self.sreg)),
            Op::Fmuls { d, r } => self.keep_word(0, alu::fractional(self.product_signed(d, r), self.sreg)),
            Op::Fmulsu { d, r } => self.keep_word(0, alu::fractional(self.product_mixed(d, r), self.sreg)),

            Op::Bset { mask } => self.set_flag(mask),
            Op::Bclr { mask } => {
                self.sreg &= !mask;
                1
            }
            Op::Bst { d, mask } => {
                self.sreg = if self.get(d) & mask == 0 {
                    self.sreg & !T
                } else {
                    self.sreg | T
                };
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
                self.set(d, program.byte(self.pair(Z)));
                3
            }
            Op::LpmIncrement { d } => {
                let address = self.pair(Z);
                self.set_pair(Z, address.wrapping_add(1));
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
            Op::Ijmp => self.jump(program, self.pair(Z), 2),
            Op::Jmp { k } => self.jump(program, k, 3),
            Op::Rcall { offset } => self.call(program, data, self.pc.wrapping_add_signed(offset), 2),
            Op::Icall => self.call(program, data, self.pair(Z), 2),
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
                return Step {
                    cycles: 4,
                    event: Event::Reti,
                };
            }
            Op::Sleep => {
                return Step {
                    cycles: 1,
                    event: Event::Sleep,
                };
            }
            Op::Break => {
                return Step {
                    cycles: 1,
                    event: Event::Break,
                };
            }
            Op::Wdr => {
                return Step {
                    cycles: 1,
                    event: Event::WatchdogReset,
                };
            }
            Op::Illegal { .. } => {
                return Step {
                    cycles: 1,
                    event: Event::Illegal,
                };
            }
        };
        Step {
            cycles,
            event: Event::None,
        }
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
        self.keep(d, (result, alu::logic(result, self.sreg)))
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
