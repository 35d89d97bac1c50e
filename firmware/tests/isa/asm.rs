//! Opcodes, encoded from the manual's tables (DS40002198, "16-bit Opcode"), independently of the decoder.

macro_rules! opcodes {
    ($($name:ident = $word:expr;)*) => {
        $(pub(crate) const $name: u16 = $word;)*
    };
}

opcodes! {
    CPC = 0x0400; SBC = 0x0800; ADD = 0x0C00; CPSE = 0x1000; CP = 0x1400; SUB = 0x1800; ADC = 0x1C00; AND = 0x2000;
    EOR = 0x2400; OR = 0x2800; MOV = 0x2C00; MUL = 0x9C00;
}

/// ADD … MUL `d`, `r`.
pub(crate) const fn rr(base: u16, d: u16, r: u16) -> u16 {
    base | (d << 4) | (r & 15) | ((r & 16) << 5)
}

opcodes! {
    CPI = 0x3000; SBCI = 0x4000; SUBI = 0x5000; ORI = 0x6000; ANDI = 0x7000; LDI = 0xE000;
}

/// CPI … LDI r16…r31, `k`.
pub(crate) const fn rk(base: u16, d: u16, k: u16) -> u16 {
    base | ((d - 16) << 4) | (k & 15) | ((k & 0xF0) << 4)
}

opcodes! {
    COM = 0x9400; NEG = 0x9401; SWAP = 0x9402; INC = 0x9403; ASR = 0x9405; LSR = 0x9406; ROR = 0x9407; DEC = 0x940A;
    LDS = 0x9000; LD_Z_INC = 0x9001; LD_Z_DEC = 0x9002; LPM_Z = 0x9004; LPM_Z_INC = 0x9005; LD_Y_INC = 0x9009;
    LD_Y_DEC = 0x900A; LD_X = 0x900C; LD_X_INC = 0x900D; LD_X_DEC = 0x900E; POP = 0x900F; STS = 0x9200;
    ST_Z_INC = 0x9201; ST_Z_DEC = 0x9202; ST_Y_INC = 0x9209; ST_Y_DEC = 0x920A; ST_X = 0x920C; ST_X_INC = 0x920D;
    ST_X_DEC = 0x920E; PUSH = 0x920F;
}

/// One register; LDS and STS are followed by the address.
pub(crate) const fn one(base: u16, d: u16) -> u16 {
    base | (d << 4)
}

opcodes! {
    LDD_Z = 0x8000; LDD_Y = 0x8008; STD_Z = 0x8200; STD_Y = 0x8208;
}

/// LDD and STD with displacement `q`.
pub(crate) const fn displaced(base: u16, d: u16, q: u16) -> u16 {
    base | (d << 4) | (q & 7) | ((q & 0x18) << 7) | ((q & 0x20) << 8)
}

opcodes! {
    ADIW = 0x9600; SBIW = 0x9700;
}

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

opcodes! {
    MULSU = 0x0300; FMUL = 0x0308; FMULS = 0x0380; FMULSU = 0x0388;
}

/// MULSU, FMUL, FMULS, FMULSU of r16…r23.
pub(crate) const fn fractional(base: u16, d: u16, r: u16) -> u16 {
    base | ((d - 16) << 4) | (r - 16)
}

opcodes! {
    BLD = 0xF800; BST = 0xFA00; SBRC = 0xFC00; SBRS = 0xFE00;
}

/// BLD, BST, SBRC, SBRS: bit of a register.
pub(crate) const fn bit(base: u16, d: u16, bit: u16) -> u16 {
    base | (d << 4) | bit
}

opcodes! {
    CBI = 0x9800; SBIC = 0x9900; SBI = 0x9A00; SBIS = 0x9B00;
}

/// CBI, SBIC, SBI, SBIS: bit of an I/O register below 0x20.
pub(crate) const fn io_bit(base: u16, a: u16, bit: u16) -> u16 {
    base | (a << 3) | bit
}

opcodes! {
    IN = 0xB000; OUT = 0xB800;
}

/// IN and OUT.
pub(crate) const fn io(base: u16, d: u16, a: u16) -> u16 {
    base | (d << 4) | (a & 15) | ((a & 0x30) << 5)
}

opcodes! {
    BRBS = 0xF000; BRBC = 0xF400;
}

/// Branch on bit `s` of SREG, −64…63 words from the next instruction.
pub(crate) const fn branch(base: u16, s: u16, offset: i16) -> u16 {
    base | ((offset as u16 & 0x7F) << 3) | s
}

opcodes! {
    RJMP = 0xC000; RCALL = 0xD000;
}

/// −2048…2047 words from the next instruction.
pub(crate) const fn relative(base: u16, offset: i16) -> u16 {
    base | (offset as u16 & 0x0FFF)
}

opcodes! {
    BSET = 0x9408; BCLR = 0x9488;
}

/// Bit `s` of SREG.
pub(crate) const fn flag(base: u16, s: u16) -> u16 {
    base | (s << 4)
}

opcodes! {
    NOP = 0x0000; IJMP = 0x9409; ICALL = 0x9509; RET = 0x9508; RETI = 0x9518; SLEEP = 0x9588; BREAK = 0x9598;
    WDR = 0x95A8; LPM = 0x95C8;
}

// followed by the target, in words
opcodes! {
    JMP = 0x940C; CALL = 0x940E; SEI = 0x9478; CLI = 0x94F8;
}

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
