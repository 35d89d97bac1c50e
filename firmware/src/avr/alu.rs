//! Results and flags of the arithmetic instructions.
//!
//! Every function returns the result and the new SREG; flags an instruction does not affect keep their value. Source:
//! *AVR Instruction Set Manual*, DS40002198, "Status Register (SREG) and Boolean Formula". Its formulas for H and C are
//! the same one, taken at bit 3 and bit 7, so they are evaluated on the whole byte.

use super::sreg::{C, H, N, S, V, Z};

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
pub(super) const fn add(d: u8, r: u8, carry: u8, sreg: u8) -> (u8, u8) {
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
pub(super) const fn subtract(d: u8, r: u8, sreg: u8) -> (u8, u8) {
    let result = d.wrapping_sub(r);
    (result, difference_flags(d, r, result, sreg) | zero(result))
}

/// SBC, SBCI, CPC: as SUB, but Z = ¬R7·…·¬R0·Z, so that it tells whether a number of several bytes is zero.
#[inline]
pub(super) const fn subtract_with_carry(d: u8, r: u8, sreg: u8) -> (u8, u8) {
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
pub(super) const fn logic(result: u8, sreg: u8) -> u8 {
    sreg & !(S | V | N | Z) | signs(msb(result), 0) | zero(result)
}

/// COM: V = 0, C = 1.
#[inline]
pub(super) const fn complement(d: u8, sreg: u8) -> (u8, u8) {
    (!d, logic(!d, sreg) | C)
}

/// NEG: H = R3 + Rd3, V = R7·¬R6·…·¬R0, C = R7 + … + R0, which are those of 0 − Rd.
#[inline]
pub(super) const fn negate(d: u8, sreg: u8) -> (u8, u8) {
    subtract(0, d, sreg)
}

/// INC: V if the result is 0x80.
#[inline]
pub(super) const fn increment(d: u8, sreg: u8) -> (u8, u8) {
    let result = d.wrapping_add(1);
    let flags = signs(msb(result), (result == 0x80) as u8) | zero(result);
    (result, sreg & !(S | V | N | Z) | flags)
}

/// DEC: V if the result is 0x7F.
#[inline]
pub(super) const fn decrement(d: u8, sreg: u8) -> (u8, u8) {
    let result = d.wrapping_sub(1);
    let flags = signs(msb(result), (result == 0x7F) as u8) | zero(result);
    (result, sreg & !(S | V | N | Z) | flags)
}

/// LSR, ROR and ASR: `d` moves right behind the bit `top` (0 or 0x80); C = Rd0, V = N ⊕ C.
#[inline]
pub(super) const fn shift_right(d: u8, top: u8, sreg: u8) -> (u8, u8) {
    let (result, carry) = (d >> 1 | top, d & 1);
    let n = msb(result);
    let flags = signs(n, n ^ carry) | zero(result) | (carry * C);
    (result, sreg & !(S | V | N | Z | C) | flags)
}

/// ADIW: V = ¬Rdh7·R15, C = ¬R15·Rdh7.
#[inline]
pub(super) const fn add_word(d: u16, k: u8, sreg: u8) -> (u16, u8) {
    let result = d.wrapping_add(k as u16);
    let (old, new) = (d.to_be_bytes()[0], result.to_be_bytes()[0]);
    let flags = signs(msb(new), msb(!old & new)) | zero_word(result) | (msb(old & !new) * C);
    (result, sreg & !(S | V | N | Z | C) | flags)
}

/// SBIW: V = Rdh7·¬R15, C = R15·¬Rdh7.
#[inline]
pub(super) const fn subtract_word(d: u16, k: u8, sreg: u8) -> (u16, u8) {
    let result = d.wrapping_sub(k as u16);
    let (old, new) = (d.to_be_bytes()[0], result.to_be_bytes()[0]);
    let flags = signs(msb(new), msb(old & !new)) | zero_word(result) | (msb(!old & new) * C);
    (result, sreg & !(S | V | N | Z | C) | flags)
}

/// SREG of MUL, MULS, MULSU: C = R15 of the product.
#[inline]
pub(super) const fn product(product: u16, sreg: u8) -> (u16, u8) {
    let flags = (msb(product.to_be_bytes()[0]) * C) | zero_word(product);
    (product, sreg & !(Z | C) | flags)
}

/// FMUL, FMULS, FMULSU: the product shifted left by one; C is the bit shifted out.
#[inline]
pub(super) const fn fractional(product: u16, sreg: u8) -> (u16, u8) {
    let result = product << 1;
    let flags = (msb(product.to_be_bytes()[0]) * C) | zero_word(result);
    (result, sreg & !(Z | C) | flags)
}
