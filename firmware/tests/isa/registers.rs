//! Which registers an instruction uses, and flags by hand.

use crate::asm::{self, bit, flag, fractional, movw, muls, one, rk, rr, word};
use crate::machine::Machine;
use spts_firmware::avr::sreg::{C, H, N, S, T, V, Z};

/// Registers with distinct values, 3k + 1.
fn numbered(words: &[u16]) -> Machine {
    let mut machine = Machine::new(words);
    for (k, register) in (0..).zip(&mut machine.core.registers) {
        *register = 3 * k + 1;
    }
    machine
}

/// Every pair of registers, also twice the same one.
#[test]
fn two_register_instructions_reach_all_32() {
    for d in 0..32 {
        for r in 0..32 {
            let before = numbered(&[]).core.registers;
            let (a, b) = (before[usize::from(d)], before[usize::from(r)]);
            let cases = [(asm::ADD, a.wrapping_add(b)), (asm::EOR, a ^ b), (asm::MOV, b)];
            for (base, result) in cases {
                let mut after = before;
                after[usize::from(d)] = result;
                assert_eq!(numbered(&[rr(base, d, r)]).after(1).core.registers, after, "{d}, {r}");
            }
            let machine = numbered(&[rr(asm::MUL, d, r)]).after(1);
            assert_eq!(machine.pair(0), u16::from(a) * u16::from(b), "{d}, {r}");
        }
    }
}

#[test]
fn restricted_registers() {
    for d in 16..32 {
        let k = usize::from(d);
        assert_eq!(numbered(&[rk(asm::LDI, d, 0xA5)]).after(1).register(k), 0xA5);
        for r in 16..32 {
            let machine = numbered(&[muls(d, r)]).after(1);
            assert_eq!(machine.pair(0), (3 * d + 1) * (3 * r + 1), "all below 128");
        }
    }
    for d in 16..24 {
        for r in 16..24 {
            let machine = numbered(&[fractional(asm::MULSU, d, r)]).after(1);
            assert_eq!(machine.pair(0), (3 * d + 1) * (3 * r + 1));
        }
    }
    for low in [24, 26, 28, 30] {
        let before = numbered(&[]).pair(usize::from(low));
        let machine = numbered(&[word(asm::ADIW, low, 63)]).after(1);
        assert_eq!(machine.pair(usize::from(low)), before + 63);
    }
    for d in (0..32).step_by(2) {
        for r in (0..32).step_by(2) {
            let before = numbered(&[]).pair(usize::from(r));
            let machine = numbered(&[movw(d, r)]).after(1);
            assert_eq!(machine.pair(usize::from(d)), before);
        }
    }
}

/// (opcode, Rd, Rr, SREG before, result, SREG after), r16 and r17, worked out with the manual's formulas.
#[test]
fn vectors_by_hand() {
    let two = |base| rr(base, 16, 17);
    let single = |base| one(base, 16);
    let cases = [
        // 0x7F + 1: carry out of bit 3 but not of bit 7, positive overflow
        (two(asm::ADD), 0x7F, 0x01, 0, 0x80, H | N | V),
        // 0x80 + 0x80: two negatives give zero
        (two(asm::ADD), 0x80, 0x80, 0, 0x00, S | V | Z | C),
        (two(asm::ADC), 0xFF, 0x00, C, 0x00, H | Z | C),
        (two(asm::ADC), 0x7F, 0x7F, C, 0xFF, H | N | V),
        (two(asm::SUB), 0x80, 0x01, 0, 0x7F, H | S | V),
        (two(asm::SUB), 0x00, 0x80, 0, 0x80, N | V | C),
        // Z stays from the lower byte only if this one is zero too
        (two(asm::SBC), 0x05, 0x05, Z, 0x00, Z),
        (two(asm::SBC), 0x05, 0x05, 0, 0x00, 0),
        (two(asm::SBC), 0x05, 0x05, Z | C, 0xFF, H | S | N | C),
        (two(asm::CPC), 0x10, 0x0F, Z | C, 0x10, Z | H),
        (two(asm::CP), 0x00, 0x01, Z, 0x00, H | S | N | C),
        (single(asm::NEG), 0x80, 0, 0, 0x80, N | V | C),
        (single(asm::NEG), 0x00, 0, C | H, 0x00, Z),
        // H = R3 + Rd3: 0xF0 and 0x10 have bit 3 clear
        (single(asm::NEG), 0x10, 0, H, 0xF0, S | N | C),
        (single(asm::NEG), 0x01, 0, 0, 0xFF, H | S | N | C),
        (single(asm::COM), 0xFF, 0, 0, 0x00, Z | C),
        (single(asm::COM), 0x7F, 0, V, 0x80, S | N | C),
        // C is left alone, so that loops can count with it
        (single(asm::INC), 0x7F, 0, C, 0x80, N | V | C),
        (single(asm::INC), 0xFF, 0, 0, 0x00, Z),
        (single(asm::DEC), 0x80, 0, C, 0x7F, S | V | C),
        (single(asm::DEC), 0x00, 0, 0, 0xFF, S | N),
        (single(asm::ASR), 0x81, 0, 0, 0xC0, S | N | C),
        (single(asm::ASR), 0x80, 0, 0, 0xC0, N | V),
        (single(asm::LSR), 0x01, 0, N, 0x00, S | V | Z | C),
        (single(asm::ROR), 0x01, 0, C, 0x80, S | N | C),
        (single(asm::ROR), 0x00, 0, C, 0x80, N | V),
        (two(asm::AND), 0xF0, 0x8F, V | C, 0x80, S | N | C),
        (two(asm::EOR), 0x55, 0x55, H | T, 0x00, Z | H | T),
    ];
    for (opcode, d, r, before, result, after) in cases {
        let machine = Machine::new(&[opcode])
            .with(&[(16, d), (17, r)])
            .with_sreg(before)
            .after(1);
        let got = (machine.register(16), machine.core.sreg);
        assert_eq!(got, (result, after), "{opcode:#06x} of {d:#x}, {r:#x}");
    }
}

/// A 16-bit comparison with SUBI, SBCI and CPC as compilers emit it: Z only if both bytes are equal.
#[test]
fn zero_is_chained_through_the_bytes() {
    let program = [rr(asm::CP, 24, 22), rr(asm::CPC, 25, 23)];
    for (a, b) in [(0x1234_u16, 0x1234_u16), (0x1234, 0x1334), (0x1234, 0x1235), (0, 0x100)] {
        let ([al, ah], [bl, bh]) = (a.to_le_bytes(), b.to_le_bytes());
        let machine = Machine::new(&program)
            .with(&[(24, al), (25, ah), (22, bl), (23, bh)])
            .after(2);
        assert_eq!(machine.core.sreg & Z != 0, a == b, "{a:#x}, {b:#x}");
        assert_eq!(machine.core.sreg & C != 0, a < b, "{a:#x}, {b:#x}");
    }
}

/// Q7 fractions: 0.5 · 0.5 = 0.25; −1 · −1 does not fit and gives −1 with C clear; −0.5 · 0.5 is −0.25 with C set.
#[test]
fn fractional_products_by_hand() {
    let product = |base, d, r| {
        let machine = Machine::new(&[fractional(base, 16, 17)])
            .with(&[(16, d), (17, r)])
            .after(1);
        (machine.pair(0), machine.core.sreg)
    };
    assert_eq!(product(asm::FMULS, 0x40, 0x40), (0x2000, 0));
    assert_eq!(product(asm::FMULS, 0x80, 0x80), (0x8000, 0));
    assert_eq!(product(asm::FMULS, 0xC0, 0x40), (0xE000, C));
    assert_eq!(product(asm::FMUL, 0x80, 0x80), (0x8000, 0));
    assert_eq!(product(asm::FMUL, 0xFF, 0xFF), (0xFC02, C));
    assert_eq!(product(asm::FMULSU, 0xFF, 0x80), (0xFF00, C));
    assert_eq!(product(asm::FMULSU, 0x00, 0x80), (0x0000, Z));
}

#[test]
fn bits_of_sreg_and_of_registers() {
    for s in 0..8 {
        let mask = 1 << s;
        assert_eq!(Machine::new(&[flag(asm::BSET, s)]).after(1).core.sreg, mask);
        let cleared = Machine::new(&[flag(asm::BCLR, s)]).with_sreg(0xFF).after(1);
        assert_eq!(cleared.core.sreg, !mask);
        for d in 0..32 {
            let k = usize::from(d);
            let set = Machine::new(&[bit(asm::BST, d, s)]).with(&[(k, mask)]).after(1);
            assert_eq!(set.core.sreg, T);
            let clear = Machine::new(&[bit(asm::BST, d, s)])
                .with(&[(k, !mask)])
                .with_sreg(0xFF)
                .after(1);
            assert_eq!(clear.core.sreg, !T);
            let loaded = Machine::new(&[bit(asm::BLD, d, s)]).with_sreg(T).after(1);
            assert_eq!((loaded.register(k), loaded.core.sreg), (mask, T));
            let erased = Machine::new(&[bit(asm::BLD, d, s)]).with(&[(k, 0xFF)]).after(1);
            assert_eq!(erased.register(k), !mask);
        }
    }
}
