//! Every operand of every arithmetic and logic instruction. The expected flags come from integers wide enough not to
//! overflow (V: the signed result does not fit; S: its sign; C and H: the unsigned result of the byte and of the low
//! nibble does not fit), not from the manual's Boolean formulas that the core evaluates.

use crate::asm::{self, fractional, muls, one, rk, rr, word};
use crate::machine::Machine;
use spts_firmware::avr::sreg::{C, H, N, S, V, Z};

/// Result and flags: those in `affected` as in `flags`, the others as before.
struct Expected {
    result: u16,
    affected: u8,
    flags: u8,
}

fn flag(set: bool, mask: u8) -> u8 {
    if set { mask } else { 0 }
}

fn signed(byte: u8) -> i32 {
    i32::from(i8::from_ne_bytes([byte]))
}

/// Low bytes of an integer.
fn low(value: i32) -> u16 {
    u16::try_from(value.rem_euclid(0x1_0000)).expect("below 0x10000")
}

/// Sum or difference: `unsigned` and `signed` results without overflow, `nibble` that of the low four bits.
fn arithmetic(unsigned: i32, signed: i32, nibble: i32) -> Expected {
    let result = unsigned.rem_euclid(256);
    let flags = flag(!(0..256).contains(&unsigned), C)
        | flag(!(0..16).contains(&nibble), H)
        | flag(!(-128..128).contains(&signed), V)
        | flag(signed < 0, S)
        | flag(result > 127, N)
        | flag(result == 0, Z);
    Expected {
        result: low(result),
        affected: H | S | V | N | Z | C,
        flags,
    }
}

fn sum(d: u8, r: u8, carry: i32) -> Expected {
    let nibble = i32::from(d % 16) + i32::from(r % 16) + carry;
    arithmetic(
        i32::from(d) + i32::from(r) + carry,
        signed(d) + signed(r) + carry,
        nibble,
    )
}

fn difference(d: u8, r: u8, carry: i32) -> Expected {
    let nibble = i32::from(d % 16) - i32::from(r % 16) - carry;
    arithmetic(
        i32::from(d) - i32::from(r) - carry,
        signed(d) - signed(r) - carry,
        nibble,
    )
}

/// SBC, SBCI, CPC leave Z clear if it was.
fn chained(d: u8, r: u8, sreg: u8) -> Expected {
    let mut expected = difference(d, r, i32::from(sreg & C));
    if sreg & Z == 0 {
        expected.flags &= !Z;
    }
    expected
}

fn logic(result: u8) -> Expected {
    let flags = flag(signed(result) < 0, N | S) | flag(result == 0, Z);
    Expected {
        result: result.into(),
        affected: S | V | N | Z,
        flags,
    }
}

/// INC and DEC: `value` without overflow.
fn counted(value: i32) -> Expected {
    let result = value.rem_euclid(256);
    let flags =
        flag(!(-128..128).contains(&value), V) | flag(value < 0, S) | flag(result > 127, N) | flag(result == 0, Z);
    Expected {
        result: low(result),
        affected: S | V | N | Z,
        flags,
    }
}

/// Right shifts: S = N ⊕ V = N ⊕ N ⊕ C = C.
fn shifted(result: u16, out: u8) -> Expected {
    let (negative, carry) = (result > 127, out == 1);
    let flags = flag(carry, C | S) | flag(negative, N) | flag(negative != carry, V) | flag(result == 0, Z);
    Expected {
        result,
        affected: S | V | N | Z | C,
        flags,
    }
}

/// SREGs to start from: C and Z take all values, with the other flags all clear and all set.
const SREGS: [u8; 8] = [0, C, Z, C | Z, 0xFC, 0xFC | C, 0xFC | Z, 0xFF];

const D: usize = 16;
const R: usize = 17;

/// All 256 × 256 operands in r16 and r17 and all [`SREGS`].
fn every_pair(opcode: u16, stores: bool, expected: impl Fn(u8, u8, u8) -> Expected) {
    let mut machine = Machine::new(&[opcode]);
    for d in 0..=255 {
        for r in 0..=255 {
            for sreg in SREGS {
                let want = expected(d, r, sreg);
                machine.core.registers[D] = d;
                machine.core.registers[R] = r;
                machine.core.sreg = sreg;
                machine.run(1);
                let result = if stores { want.result } else { d.into() };
                let flags = (sreg & !want.affected) | want.flags;
                let got = (machine.register(D).into(), machine.register(R), machine.core.sreg);
                assert_eq!(
                    got,
                    (result, r, flags),
                    "{opcode:#06x}: d {d:#x}, r {r:#x}, SREG {sreg:#x}"
                );
            }
        }
    }
}

/// All operands in r16 and all [`SREGS`].
fn every_byte(opcode: u16, expected: impl Fn(u8, u8) -> Expected) {
    let mut machine = Machine::new(&[opcode]);
    for d in 0..=255 {
        for sreg in SREGS {
            let want = expected(d, sreg);
            machine.core.registers[D] = d;
            machine.core.sreg = sreg;
            machine.run(1);
            let flags = (sreg & !want.affected) | want.flags;
            let got = (machine.register(D).into(), machine.core.sreg);
            assert_eq!(got, (want.result, flags), "{opcode:#06x}: d {d:#x}, SREG {sreg:#x}");
        }
    }
}

/// All 256 × 256 operands; the immediate is part of the opcode.
fn every_immediate(base: u16, stores: bool, expected: impl Fn(u8, u8, u8) -> Expected) {
    for k in 0..=255 {
        let mut machine = Machine::new(&[rk(base, 16, k.into())]);
        for d in 0..=255 {
            for sreg in SREGS {
                let want = expected(d, k, sreg);
                machine.core.registers[D] = d;
                machine.core.sreg = sreg;
                machine.run(1);
                let result = if stores { want.result } else { d.into() };
                let flags = (sreg & !want.affected) | want.flags;
                let got = (machine.register(D).into(), machine.core.sreg);
                assert_eq!(got, (result, flags), "{base:#06x}: d {d:#x}, k {k:#x}, SREG {sreg:#x}");
            }
        }
    }
}

#[test]
fn sums_and_differences() {
    every_pair(rr(asm::ADD, 16, 17), true, |d, r, _| sum(d, r, 0));
    every_pair(rr(asm::ADC, 16, 17), true, |d, r, sreg| sum(d, r, i32::from(sreg & C)));
    every_pair(rr(asm::SUB, 16, 17), true, |d, r, _| difference(d, r, 0));
    every_pair(rr(asm::SBC, 16, 17), true, chained);
    every_pair(rr(asm::CP, 16, 17), false, |d, r, _| difference(d, r, 0));
    every_pair(rr(asm::CPC, 16, 17), false, chained);
}

#[test]
fn immediates() {
    every_immediate(asm::SUBI, true, |d, k, _| difference(d, k, 0));
    every_immediate(asm::SBCI, true, chained);
    every_immediate(asm::CPI, false, |d, k, _| difference(d, k, 0));
    every_immediate(asm::ANDI, true, |d, k, _| logic(d & k));
    every_immediate(asm::ORI, true, |d, k, _| logic(d | k));
    every_immediate(asm::LDI, true, |_, k, _| Expected {
        result: k.into(),
        affected: 0,
        flags: 0,
    });
}

#[test]
fn logic_of_two_registers() {
    every_pair(rr(asm::AND, 16, 17), true, |d, r, _| logic(d & r));
    every_pair(rr(asm::OR, 16, 17), true, |d, r, _| logic(d | r));
    every_pair(rr(asm::EOR, 16, 17), true, |d, r, _| logic(d ^ r));
    every_pair(rr(asm::MOV, 16, 17), true, |_, r, _| Expected {
        result: r.into(),
        affected: 0,
        flags: 0,
    });
}

#[test]
fn one_register() {
    every_byte(one(asm::COM, 16), |d, _| {
        let logic = logic(255 - d);
        Expected {
            affected: logic.affected | C,
            flags: logic.flags | C,
            ..logic
        }
    });
    every_byte(one(asm::NEG, 16), |d, _| difference(0, d, 0));
    every_byte(one(asm::INC, 16), |d, _| counted(signed(d) + 1));
    every_byte(one(asm::DEC, 16), |d, _| counted(signed(d) - 1));
    every_byte(one(asm::LSR, 16), |d, _| shifted(u16::from(d) / 2, d % 2));
    every_byte(one(asm::ROR, 16), |d, sreg| {
        shifted((u16::from(d) + 256 * u16::from(sreg & C)) / 2, d % 2)
    });
    every_byte(one(asm::ASR, 16), |d, _| {
        shifted(low(signed(d).div_euclid(2)) & 0xFF, d % 2)
    });
    every_byte(one(asm::SWAP, 16), |d, _| Expected {
        result: u16::from(d % 16) * 16 + u16::from(d / 16),
        affected: 0,
        flags: 0,
    });
}

/// ADIW (`sign` 1) and SBIW (−1) of every word and immediate.
fn every_word(base: u16, sign: i32) {
    for k in 0..64_u16 {
        let mut machine = Machine::new(&[word(base, 24, k)]);
        for d in 0..=u16::MAX {
            let sreg = SREGS[usize::from(d % 8)];
            let [l, h] = d.to_le_bytes();
            machine.core.registers[24] = l;
            machine.core.registers[25] = h;
            machine.core.sreg = sreg;
            machine.run(1);
            let unsigned = i32::from(d) + sign * i32::from(k);
            let signed = i32::from(i16::from_ne_bytes(d.to_ne_bytes())) + sign * i32::from(k);
            let result = low(unsigned);
            let flags = flag(!(0..0x1_0000).contains(&unsigned), C)
                | flag(!(-0x8000..0x8000).contains(&signed), V)
                | flag(signed < 0, S)
                | flag(result > 0x7FFF, N)
                | flag(result == 0, Z);
            let want = (result, (sreg & !(S | V | N | Z | C)) | flags);
            assert_eq!(
                (machine.pair(24), machine.core.sreg),
                want,
                "{base:#06x}: {d:#x}, k {k}"
            );
        }
    }
}

#[test]
fn words() {
    every_word(asm::ADIW, 1);
    every_word(asm::SBIW, -1);
}

/// All products; `value` is the exact one, `shift` 1 for the fractional instructions.
fn every_product(opcode: u16, shift: i32, value: impl Fn(u8, u8) -> i32) {
    let mut machine = Machine::new(&[opcode]);
    for d in 0..=255 {
        for r in 0..=255 {
            let sreg = SREGS[usize::from(d ^ r) % 8];
            machine.core.registers[D] = d;
            machine.core.registers[R] = r;
            machine.core.sreg = sreg;
            machine.run(1);
            let (product, result) = (low(value(d, r)), low(value(d, r) << shift));
            let flags = flag(product > 0x7FFF, C) | flag(result == 0, Z);
            let want = (result, (sreg & !(Z | C)) | flags);
            assert_eq!(
                (machine.pair(0), machine.core.sreg),
                want,
                "{opcode:#06x}: {d:#x}, {r:#x}"
            );
        }
    }
}

#[test]
fn products() {
    let unsigned = |d, r| i32::from(d) * i32::from(r);
    let both = |d, r| signed(d) * signed(r);
    let mixed = |d, r| signed(d) * i32::from(r);
    every_product(rr(asm::MUL, 16, 17), 0, unsigned);
    every_product(muls(16, 17), 0, both);
    every_product(fractional(asm::MULSU, 16, 17), 0, mixed);
    every_product(fractional(asm::FMUL, 16, 17), 1, unsigned);
    every_product(fractional(asm::FMULS, 16, 17), 1, both);
    every_product(fractional(asm::FMULSU, 16, 17), 1, mixed);
}
