//! Cycles of every instruction: DS40002198, column AVRxt of the "Instruction Set Summary", 16-bit program counter.

use crate::asm::{self, bit, branch, displaced, flag, fractional, io, io_bit, movw, muls, one, relative, rk, rr, word};
use crate::machine::Machine;
use spts_firmware::avr::sreg::I;

/// Cycles of the first instruction of `words`, with Z = 0x0002 and all else zero.
fn cycles(words: &[u16]) -> u32 {
    let mut machine = Machine::new(words).with(&[(30, 2)]);
    machine.step().cycles
}

#[test]
fn arithmetic() {
    for base in asm::TWO_REGISTERS {
        let product = base == asm::MUL;
        assert_eq!(cycles(&[rr(base, 3, 4)]), 1 + u32::from(product), "{base:#06x}");
    }
    for base in asm::IMMEDIATES {
        assert_eq!(cycles(&[rk(base, 20, 4)]), 1, "{base:#06x}");
    }
    for base in asm::ONE_REGISTER {
        assert_eq!(cycles(&[one(base, 3)]), 1, "{base:#06x}");
    }
    for base in asm::FRACTIONAL {
        assert_eq!(cycles(&[fractional(base, 17, 18)]), 2, "{base:#06x}");
    }
    assert_eq!(cycles(&[movw(2, 4)]), 1);
    for opcode in [
        bit(asm::BST, 3, 4),
        bit(asm::BLD, 3, 4),
        flag(asm::BSET, 3),
        flag(asm::BCLR, 3),
    ] {
        assert_eq!(cycles(&[opcode]), 1, "{opcode:#06x}");
    }
    for opcode in [word(asm::ADIW, 24, 1), word(asm::SBIW, 24, 1), muls(17, 18)] {
        assert_eq!(cycles(&[opcode]), 2, "{opcode:#06x}");
    }
}

#[test]
fn memory() {
    for base in [
        asm::LD_X,
        asm::LD_X_INC,
        asm::LD_X_DEC,
        asm::LD_Y_INC,
        asm::LD_Y_DEC,
        asm::LD_Z_INC,
        asm::LD_Z_DEC,
        asm::POP,
    ] {
        assert_eq!(cycles(&[one(base, 3)]), 2, "{base:#06x}");
    }
    for base in [
        asm::ST_X,
        asm::ST_X_INC,
        asm::ST_X_DEC,
        asm::ST_Y_INC,
        asm::ST_Y_DEC,
        asm::ST_Z_INC,
        asm::ST_Z_DEC,
        asm::PUSH,
    ] {
        assert_eq!(cycles(&[one(base, 3)]), 1, "{base:#06x}");
    }
    for q in [0, 5] {
        assert_eq!(cycles(&[displaced(asm::LDD_Y, 3, q)]), 2);
        assert_eq!(cycles(&[displaced(asm::LDD_Z, 3, q)]), 2);
        assert_eq!(cycles(&[displaced(asm::STD_Y, 3, q)]), 1);
        assert_eq!(cycles(&[displaced(asm::STD_Z, 3, q)]), 1);
    }
    assert_eq!(cycles(&[one(asm::LDS, 3), 0x3F00]), 3);
    assert_eq!(cycles(&[one(asm::STS, 3), 0x3F00]), 2);
    for opcode in [asm::LPM, one(asm::LPM_Z, 3), one(asm::LPM_Z_INC, 3)] {
        assert_eq!(cycles(&[opcode]), 3, "{opcode:#06x}");
    }
    for opcode in [
        io(asm::IN, 3, 4),
        io(asm::OUT, 3, 4),
        io_bit(asm::SBI, 3, 4),
        io_bit(asm::CBI, 3, 4),
    ] {
        assert_eq!(cycles(&[opcode]), 1, "{opcode:#06x}");
    }
}

#[test]
fn control() {
    assert_eq!(cycles(&[relative(asm::RJMP, 1)]), 2);
    assert_eq!(cycles(&[asm::IJMP]), 2);
    assert_eq!(cycles(&[asm::JMP, 1]), 3);
    assert_eq!(cycles(&[relative(asm::RCALL, 1)]), 2);
    assert_eq!(cycles(&[asm::ICALL]), 2);
    assert_eq!(cycles(&[asm::CALL, 1]), 3);
    assert_eq!(cycles(&[asm::RET]), 4);
    assert_eq!(cycles(&[asm::RETI]), 4);
    assert_eq!(cycles(&[branch(asm::BRBS, 1, 4)]), 1, "not taken");
    assert_eq!(cycles(&[branch(asm::BRBC, 1, 4)]), 2, "taken");
    for opcode in [asm::NOP, asm::SLEEP, asm::BREAK, asm::WDR] {
        assert_eq!(cycles(&[opcode]), 1, "{opcode:#06x}");
    }
}

/// Changing the I flag through its I/O register costs one wait state (datasheet, CPU.SREG); SEI and CLI do not.
#[test]
fn the_interrupt_flag_has_a_wait_state() {
    for (before, value, cycles) in [(0, I, 2), (I, 0, 2), (I, I | 1, 1), (0, 1, 1)] {
        let mut out = Machine::new(&[io(asm::OUT, 5, 0x3F)])
            .with(&[(5, value)])
            .with_sreg(before);
        assert_eq!(out.run(1), cycles);
        let mut sts = Machine::new(&[one(asm::STS, 5), 0x3F])
            .with(&[(5, value)])
            .with_sreg(before);
        assert_eq!(sts.run(1), cycles + 1);
    }
    assert_eq!(cycles(&[asm::SEI]), 1);
    assert_eq!(cycles(&[asm::CLI]), 1);
}
