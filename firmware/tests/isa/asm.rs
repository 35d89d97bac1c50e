//! Opcodes, encoded from the manual's tables (DS40002198, "16-bit Opcode"), independently of the decoder.

pub(crate) const CPC: u16 = 0x0400;
pub(crate) const SBC: u16 = 0x0800;
pub(crate) const ADD: u16 = 0x0C00;
pub(crate) const CPSE: u16 = 0x1000;
pub(crate) const CP: u16 = 0x1400;
pub(crate) const SUB: u16 = 0x1800;
pub(crate) const ADC: u16 = 0x1C00;
pub(crate) const AND: u16 = 0x2000;
pub(crate) const EOR: u16 = 0x2400;
pub(crate) const OR: u16 = 0x2800;
pub(crate) const MOV: u16 = 0x2C00;
pub(crate) const MUL: u16 = 0x9C00;
/// ADD … MUL `d`, `r`.
pub(crate) const fn rr(base: u16, d: u16, r: u16) -> u16 {
    base | (d << 4) | (r & 15) | ((r & 16) << 5)
}

pub(crate) const CPI: u16 = 0x3000;
pub(crate) const SBCI: u16 = 0x4000;
pub(crate) const SUBI: u16 = 0x5000;
pub(crate) const ORI: u16 = 0x6000;
pub(crate) const ANDI: u16 = 0x7000;
pub(crate) const LDI: u16 = 0xE000;
/// CPI … LDI r16…r31, `k`.
pub(crate) const fn rk(base: u16, d: u16, k: u16) -> u16 {
    base | ((d - 16) << 4) | (k & 15) | ((k & 0xF0) << 4)
}

pub(crate) const COM: u16 = 0x9400;
pub(crate) const NEG: u16 = 0x9401;
pub(crate) const SWAP: u16 = 0x9402;
pub(crate) const INC: u16 = 0x9403;
pub(crate) const ASR: u16 = 0x9405;
pub(crate) const LSR: u16 = 0x9406;
pub(crate) const ROR: u16 = 0x9407;
pub(crate) const DEC: u16 = 0x940A;
pub(crate) const LDS: u16 = 0x9000;
pub(crate) const LD_Z_INC: u16 = 0x9001;
pub(crate) const LD_Z_DEC: u16 = 0x9002;
pub(crate) const LPM_Z: u16 = 0x9004;
pub(crate) const LPM_Z_INC: u16 = 0x9005;
pub(crate) const LD_Y_INC: u16 = 0x9009;
pub(crate) const LD_Y_DEC: u16 = 0x900A;
pub(crate) const LD_X: u16 = 0x900C;
pub(crate) const LD_X_INC: u16 = 0x900D;
pub(crate) const LD_X_DEC: u16 = 0x900E;
pub(crate) const POP: u16 = 0x900F;
pub(crate) const STS: u16 = 0x9200;
pub(crate) const ST_Z_INC: u16 = 0x9201;
pub(crate) const ST_Z_DEC: u16 = 0x9202;
pub(crate) const ST_Y_INC: u16 = 0x9209;
pub(crate) const ST_Y_DEC: u16 = 0x920A;
pub(crate) const ST_X: u16 = 0x920C;
pub(crate) const ST_X_INC: u16 = 0x920D;
pub(crate) const ST_X_DEC: u16 = 0x920E;
pub(crate) const PUSH: u16 = 0x920F;
/// One register; LDS and STS are followed by the address.
pub(crate) const fn one(base: u16, d: u16) -> u16 {
    base | (d << 4)
}

pub(crate) const LDD_Z: u16 = 0x8000;
pub(crate) const LDD_Y: u16 = 0x8008;
pub(crate) const STD_Z: u16 = 0x8200;
pub(crate) const STD_Y: u16 = 0x8208;
/// LDD and STD with displacement `q`.
pub(crate) const fn displaced(base: u16, d: u16, q: u16) -> u16 {
    base | (d << 4) | (q & 7) | ((q & 0x18) << 7) | ((q & 0x20) << 8)
}

pub(crate) const ADIW: u16 = 0x9600;
pub(crate) const SBIW: u16 = 0x9700;
/// ADIW and SBIW of the pair that begins with r24, r26, r28 or r30.
pub(crate) const fn word(base: u16, low: u16, k: u16) -> u16 {
    base | (((low - 24) / 2) << 4) | (k & 15) | ((k & 0x30) << 2)
}

pub(crate) const fn movw(d: u16, r: u16) -> u16 {
    0x0100 | ((d / 2) << 4) | (r / 2)
}

pub(crate) const fn muls(d: u16, r: u16) -> u16 {
    0x0200 | ((d - 16) << 4) | (r - 16)
}

pub(crate) const MULSU: u16 = 0x0300;
pub(crate) const FMUL: u16 = 0x0308;
pub(crate) const FMULS: u16 = 0x0380;
pub(crate) const FMULSU: u16 = 0x0388;
/// MULSU, FMUL, FMULS, FMULSU of r16…r23.
pub(crate) const fn fractional(base: u16, d: u16, r: u16) -> u16 {
    base | ((d - 16) << 4) | (r - 16)
}

pub(crate) const BLD: u16 = 0xF800;
pub(crate) const BST: u16 = 0xFA00;
pub(crate) const SBRC: u16 = 0xFC00;
pub(crate) const SBRS: u16 = 0xFE00;
/// BLD, BST, SBRC, SBRS: bit of a register.
pub(crate) const fn bit(base: u16, d: u16, bit: u16) -> u16 {
    base | (d << 4) | bit
}

pub(crate) const CBI: u16 = 0x9800;
pub(crate) const SBIC: u16 = 0x9900;
pub(crate) const SBI: u16 = 0x9A00;
pub(crate) const SBIS: u16 = 0x9B00;
/// CBI, SBIC, SBI, SBIS: bit of an I/O register below 0x20.
pub(crate) const fn io_bit(base: u16, a: u16, bit: u16) -> u16 {
    base | (a << 3) | bit
}

pub(crate) const IN: u16 = 0xB000;
pub(crate) const OUT: u16 = 0xB800;
/// IN and OUT.
pub(crate) const fn io(base: u16, d: u16, a: u16) -> u16 {
    base | (d << 4) | (a & 15) | ((a & 0x30) << 5)
}

pub(crate) const BRBS: u16 = 0xF000;
pub(crate) const BRBC: u16 = 0xF400;
/// Branch on bit `s` of SREG, −64…63 words from the next instruction.
pub(crate) const fn branch(base: u16, s: u16, offset: i16) -> u16 {
    base | ((offset as u16 & 0x7F) << 3) | s
}

pub(crate) const RJMP: u16 = 0xC000;
pub(crate) const RCALL: u16 = 0xD000;
/// −2048…2047 words from the next instruction.
pub(crate) const fn relative(base: u16, offset: i16) -> u16 {
    base | (offset as u16 & 0x0FFF)
}

pub(crate) const BSET: u16 = 0x9408;
pub(crate) const BCLR: u16 = 0x9488;
/// Bit `s` of SREG.
pub(crate) const fn flag(base: u16, s: u16) -> u16 {
    base | (s << 4)
}

pub(crate) const NOP: u16 = 0x0000;
pub(crate) const IJMP: u16 = 0x9409;
pub(crate) const ICALL: u16 = 0x9509;
pub(crate) const RET: u16 = 0x9508;
pub(crate) const RETI: u16 = 0x9518;
pub(crate) const SLEEP: u16 = 0x9588;
pub(crate) const BREAK: u16 = 0x9598;
pub(crate) const WDR: u16 = 0x95A8;
pub(crate) const LPM: u16 = 0x95C8;
/// Followed by the target, in words.
pub(crate) const JMP: u16 = 0x940C;
pub(crate) const CALL: u16 = 0x940E;
pub(crate) const SEI: u16 = 0x9478;
pub(crate) const CLI: u16 = 0x94F8;
/// Jump to itself.
pub(crate) const HALT: u16 = relative(RJMP, -1);

/// Of [`rr`], without CPSE.
pub(crate) const TWO_REGISTERS: [u16; 11] = [ADD, ADC, SUB, SBC, AND, OR, EOR, CP, CPC, MOV, MUL];
/// Of [`rk`].
pub(crate) const IMMEDIATES: [u16; 6] = [CPI, SBCI, SUBI, ORI, ANDI, LDI];
/// Arithmetic of [`one`].
pub(crate) const ONE_REGISTER: [u16; 8] = [COM, NEG, SWAP, INC, ASR, LSR, ROR, DEC];
/// Of [`fractional`].
pub(crate) const FRACTIONAL: [u16; 4] = [MULSU, FMUL, FMULS, FMULSU];
