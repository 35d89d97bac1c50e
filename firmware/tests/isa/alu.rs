//! Every operand of every arithmetic and logic instruction. The expected flags come from integers wide enough not to
//! overflow (V: the signed result does not fit; S: its sign; C and H: the unsigned result of the byte and of the low
//! nibble does not fit), not from the manual's Boolean formulas that the core evaluates.

use crate::asm::{self, fractional, muls, one, rk, rr, word};
use crate::machine::Machine;
use spts_firmware::avr::sreg::{C, H, N, S, V, Z};
use std::ops::RangeInclusive;

/// Result and flags: those in `affected` as in `flags`, the others as before.
struct Expected {
    result: u16,
    affected: u8,
    flags: u8,
}

impl Expected {
    fn new(result: u16, affected: u8, flags: u8) -> Self {
        Self {
            result,
            affected,
            flags,
        }
    }
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
    Expected::new(low(result), H | S | V | N | Z | C, flags)
}

/// d + `sign`·(r + carry).
fn sum(sign: i32, d: u8, r: u8, carry: u8) -> Expected {
    let of = |d: i32, r: i32| d + sign * (r + i32::from(carry));
    arithmetic(
        of(d.into(), r.into()),
        of(signed(d), signed(r)),
        of((d % 16).into(), (r % 16).into()),
    )
}

fn difference(d: u8, r: u8, _sreg: u8) -> Expected {
    sum(-1, d, r, 0)
}

/// SBC, SBCI, CPC leave Z clear if it was.
fn chained(d: u8, r: u8, sreg: u8) -> Expected {
    let mut expected = sum(-1, d, r, sreg & C);
    expected.flags &= if sreg & Z == 0 { !Z } else { u8::MAX };
    expected
}

fn logic(result: u8) -> Expected {
    let flags = flag(signed(result) < 0, N | S) | flag(result == 0, Z);
    Expected::new(result.into(), S | V | N | Z, flags)
}

/// INC and DEC: `value` without overflow.
fn counted(value: i32) -> Expected {
    let result = value.rem_euclid(256);
    let overflow = flag(!(-128..128).contains(&value), V);
    let flags = overflow | flag(value < 0, S) | flag(result > 127, N) | flag(result == 0, Z);
    Expected::new(low(result), S | V | N | Z, flags)
}

/// Right shifts: S = N ⊕ V = N ⊕ N ⊕ C = C.
fn shifted(result: u16, out: u8) -> Expected {
    let (negative, carry) = (result > 127, out == 1);
    let flags = flag(carry, C | S) | flag(negative, N) | flag(negative != carry, V) | flag(result == 0, Z);
    Expected::new(result, S | V | N | Z | C, flags)
}

/// No flag is touched.
fn moved(result: u16) -> Expected {
    Expected::new(result, 0, 0)
}

/// SREGs to start from: C and Z take all values, with the other flags all clear and all set.
const SREGS: [u8; 8] = [0, C, Z, C | Z, 0xFC, 0xFC | C, 0xFC | Z, 0xFF];

const D: usize = 16;
const R: usize = 17;

/// All bytes in r16, the bytes `operands` in r17, and all [`SREGS`].
fn every(opcode: u16, operands: RangeInclusive<u8>, stores: bool, expected: impl Fn(u8, u8, u8) -> Expected) {
    let mut machine = Machine::new(&[opcode]);
    for d in 0..=255 {
        for r in operands.clone() {
            for sreg in SREGS {
                let want = expected(d, r, sreg);
                (machine.core.registers[D], machine.core.registers[R]) = (d, r);
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

/// All 256 × 256 operands in r16 and r17.
fn every_pair(base: u16, stores: bool, expected: impl Fn(u8, u8, u8) -> Expected) {
    every(rr(base, 16, 17), 0..=255, stores, expected);
}

/// All operands in r16.
fn every_byte(base: u16, expected: impl Fn(u8, u8) -> Expected) {
    every(one(base, 16), 0..=0, true, |d, _, sreg| expected(d, sreg));
}

/// All 256 × 256 operands; the immediate is part of the opcode.
fn every_immediate(base: u16, stores: bool, expected: impl Fn(u8, u8, u8) -> Expected) {
    for k in 0..=255 {
        every(rk(base, 16, k.into()), k..=k, stores, &expected);
    }
}

#[test]
fn sums_and_differences() {
    every_pair(asm::ADD, true, |d, r, _| sum(1, d, r, 0));
    every_pair(asm::ADC, true, |d, r, sreg| sum(1, d, r, sreg & C));
    every_pair(asm::SUB, true, difference);
    every_pair(asm::SBC, true, chained);
    every_pair(asm::CP, false, difference);
    every_pair(asm::CPC, false, chained);
}

#[test]
fn immediates() {
    every_immediate(asm::SUBI, true, difference);
    every_immediate(asm::SBCI, true, chained);
    every_immediate(asm::CPI, false, difference);
    every_immediate(asm::ANDI, true, |d, k, _| logic(d & k));
    every_immediate(asm::ORI, true, |d, k, _| logic(d | k));
    every_immediate(asm::LDI, true, |_, k, _| moved(k.into()));
}

#[test]
fn logic_of_two_registers() {
    every_pair(asm::AND, true, |d, r, _| logic(d & r));
    every_pair(asm::OR, true, |d, r, _| logic(d | r));
    every_pair(asm::EOR, true, |d, r, _| logic(d ^ r));
    every_pair(asm::MOV, true, |_, r, _| moved(r.into()));
}

#[test]
fn one_register() {
    every_byte(asm::COM, |d, _| {
        let Expected {
            result,
            affected,
            flags,
        } = logic(255 - d);
        Expected::new(result, affected | C, flags | C)
    });
    every_byte(asm::NEG, |d, sreg| difference(0, d, sreg));
    every_byte(asm::INC, |d, _| counted(signed(d) + 1));
    every_byte(asm::DEC, |d, _| counted(signed(d) - 1));
    every_byte(asm::LSR, |d, _| shifted(u16::from(d) / 2, d % 2));
    every_byte(asm::ROR, |d, sreg| {
        shifted((u16::from(d) + 256 * u16::from(sreg & C)) / 2, d % 2)
    });
    every_byte(asm::ASR, |d, _| shifted(low(signed(d).div_euclid(2)) & 0xFF, d % 2));
    every_byte(asm::SWAP, |d, _| moved(u16::from(d % 16) * 16 + u16::from(d / 16)));
}

/// ADIW (`sign` 1) and SBIW (−1) of every word and immediate.
fn every_word(base: u16, sign: i32) {
    for k in 0..64_u16 {
        let mut machine = Machine::new(&[word(base, 24, k)]);
        for d in 0..=u16::MAX {
            let sreg = SREGS[usize::from(d % 8)];
            [machine.core.registers[24], machine.core.registers[25]] = d.to_le_bytes();
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
            (machine.core.registers[D], machine.core.registers[R]) = (d, r);
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
