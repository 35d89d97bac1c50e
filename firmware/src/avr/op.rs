//! Decoded instructions, and how opcode words become them.
//!
//! Source: *AVR Instruction Set Manual*, DS40002198, "16-bit Opcode" of each instruction.

/// One decoded instruction, 4 bytes. `d` and `r` are register numbers, 0…31; `p` is the low register of a pointer (26
/// X, 28 Y, 30 Z); `a` an I/O address; `mask` one bit; `offset` is in words relative to the following instruction.
#[rustfmt::skip] // one line a variant
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[expect(
    missing_docs,
    reason = "variants carry the manual's mnemonics, fields are named above"
)]
pub enum Op {
    Nop,
    Movw { d: u8, r: u8 },
    Muls { d: u8, r: u8 },
    Mulsu { d: u8, r: u8 },
    Fmul { d: u8, r: u8 },
    Fmuls { d: u8, r: u8 },
    Fmulsu { d: u8, r: u8 },
    Mul { d: u8, r: u8 },
    Cpc { d: u8, r: u8 },
    Cp { d: u8, r: u8 },
    Sbc { d: u8, r: u8 },
    Sub { d: u8, r: u8 },
    Add { d: u8, r: u8 },
    Adc { d: u8, r: u8 },
    Cpse { d: u8, r: u8 },
    And { d: u8, r: u8 },
    Eor { d: u8, r: u8 },
    Or { d: u8, r: u8 },
    Mov { d: u8, r: u8 },
    Cpi { d: u8, k: u8 },
    Sbci { d: u8, k: u8 },
    Subi { d: u8, k: u8 },
    Ori { d: u8, k: u8 },
    Andi { d: u8, k: u8 },
    Ldi { d: u8, k: u8 },
    /// LD without displacement is `q` = 0.
    Ldd { d: u8, p: u8, q: u8 },
    LdIncrement { d: u8, p: u8 },
    LdDecrement { d: u8, p: u8 },
    Lds { d: u8, k: u16 },
    Pop { d: u8 },
    /// ST without displacement is `q` = 0.
    Std { r: u8, p: u8, q: u8 },
    StIncrement { r: u8, p: u8 },
    StDecrement { r: u8, p: u8 },
    Sts { r: u8, k: u16 },
    Push { r: u8 },
    /// LPM without operands is `d` = 0.
    Lpm { d: u8 },
    LpmIncrement { d: u8 },
    Com { d: u8 },
    Neg { d: u8 },
    Swap { d: u8 },
    Inc { d: u8 },
    Asr { d: u8 },
    Lsr { d: u8 },
    Ror { d: u8 },
    Dec { d: u8 },
    Bset { mask: u8 },
    Bclr { mask: u8 },
    Ijmp,
    Icall,
    Ret,
    Reti,
    Sleep,
    Break,
    Wdr,
    /// `k` in words.
    Jmp { k: u16 },
    /// `k` in words.
    Call { k: u16 },
    Adiw { d: u8, k: u8 },
    Sbiw { d: u8, k: u8 },
    Cbi { a: u8, mask: u8 },
    Sbi { a: u8, mask: u8 },
    Sbic { a: u8, mask: u8 },
    Sbis { a: u8, mask: u8 },
    In { d: u8, a: u8 },
    Out { a: u8, r: u8 },
    Rjmp { offset: i16 },
    Rcall { offset: i16 },
    /// Branch if the SREG bit is set.
    Brbs { mask: u8, offset: i8 },
    /// Branch if the SREG bit is clear.
    Brbc { mask: u8, offset: i8 },
    Bld { d: u8, mask: u8 },
    Bst { d: u8, mask: u8 },
    Sbrc { r: u8, mask: u8 },
    Sbrs { r: u8, mask: u8 },
    /// Not an instruction of this core.
    Illegal { word: u16 },
}

impl Op {
    /// Length in words, 1 or 2.
    #[inline]
    pub const fn words(self) -> u16 {
        match self {
            Self::Lds { .. } | Self::Sts { .. } | Self::Jmp { .. } | Self::Call { .. } => 2,
            _ => 1,
        }
    }
}

const X: u8 = 26;
const Y: u8 = 28;
const Z: u8 = 30;

impl Op {
    /// Decodes the instruction that starts with `word`. `second` is the following word, used by two-word instructions.
    pub fn decode(word: u16, second: u16) -> Self {
        let (high, k, offset) = (high_d(word), immediate(word), offset_12(word));
        match word >> 12 {
            0x0..=0x2 => two_registers(word),
            0x3 => Self::Cpi { d: high, k },
            0x4 => Self::Sbci { d: high, k },
            0x5 => Self::Subi { d: high, k },
            0x6 => Self::Ori { d: high, k },
            0x7 => Self::Andi { d: high, k },
            0x8 | 0xA => displaced(word),
            0x9 => group_9(word, second),
            0xB => in_out(word),
            0xC => Self::Rjmp { offset },
            0xD => Self::Rcall { offset },
            0xE => Self::Ldi { d: high, k },
            _ => branches(word),
        }
    }
}

/// Bits `shift`… of `word` under `mask`, at most 8 of them.
const fn bits(word: u16, shift: u32, mask: u8) -> u8 {
    (word >> shift).to_le_bytes()[0] & mask
}

/// `ddddd` of bits 8…4.
const fn d5(word: u16) -> u8 {
    bits(word, 4, 31)
}

/// `r····rrrr`.
const fn r5(word: u16) -> u8 {
    bits(word, 0, 15) | bits(word, 5, 16)
}

/// `dddd` of bits 7…4, for r16…r31.
const fn high_d(word: u16) -> u8 {
    16 + bits(word, 4, 15)
}

/// `KKKK····KKKK`.
const fn immediate(word: u16) -> u8 {
    bits(word, 0, 0x0F) | bits(word, 4, 0xF0)
}

/// One-bit mask of the bit number in bits 2…0.
const fn bit(word: u16) -> u8 {
    1 << bits(word, 0, 7)
}

/// Signed 12 bits.
const fn offset_12(word: u16) -> i16 {
    (word << 4).cast_signed() >> 4
}

/// Signed 7 bits of bits 9…3.
const fn offset_7(word: u16) -> i8 {
    bits(word, 2, 0xFE).cast_signed() >> 1
}

fn two_registers(word: u16) -> Op {
    let (d, r) = (d5(word), r5(word));
    match word >> 10 {
        0x0 => pairs_and_products(word),
        0x1 => Op::Cpc { d, r },
        0x2 => Op::Sbc { d, r },
        0x3 => Op::Add { d, r },
        0x4 => Op::Cpse { d, r },
        0x5 => Op::Cp { d, r },
        0x6 => Op::Sub { d, r },
        0x7 => Op::Adc { d, r },
        0x8 => Op::And { d, r },
        0x9 => Op::Eor { d, r },
        0xA => Op::Or { d, r },
        _ => Op::Mov { d, r },
    }
}

fn pairs_and_products(word: u16) -> Op {
    let (d, r) = (16 + bits(word, 4, 7), 16 + bits(word, 0, 7));
    match (word >> 8, word & 0x88) {
        (0, _) if word == 0 => Op::Nop,
        (1, _) => Op::Movw { d: 2 * bits(word, 4, 15), r: 2 * bits(word, 0, 15) },
        (2, _) => Op::Muls { d: high_d(word), r: 16 + bits(word, 0, 15) },
        (3, 0x00) => Op::Mulsu { d, r },
        (3, 0x08) => Op::Fmul { d, r },
        (3, 0x80) => Op::Fmuls { d, r },
        (3, _) => Op::Fmulsu { d, r },
        _ => Op::Illegal { word },
    }
}

/// LDD and STD, `10q0 qqsd dddd yqqq`.
fn displaced(word: u16) -> Op {
    let q = bits(word, 0, 7) | bits(word, 7, 0x18) | bits(word, 8, 0x20);
    let p = if word & 0x0008 == 0 { Z } else { Y };
    if word & 0x0200 == 0 { Op::Ldd { d: d5(word), p, q } } else { Op::Std { r: d5(word), p, q } }
}

fn group_9(word: u16, second: u16) -> Op {
    let (d, k) = (24 + 2 * bits(word, 4, 3), bits(word, 0, 15) | bits(word, 2, 0x30));
    let (a, mask) = (bits(word, 3, 31), bit(word));
    match bits(word, 8, 15) {
        0x0 | 0x1 => loads(word, second),
        0x2 | 0x3 => stores(word, second),
        0x4 | 0x5 => one_register(word, second),
        0x6 => Op::Adiw { d, k },
        0x7 => Op::Sbiw { d, k },
        0x8 => Op::Cbi { a, mask },
        0x9 => Op::Sbic { a, mask },
        0xA => Op::Sbi { a, mask },
        0xB => Op::Sbis { a, mask },
        _ => Op::Mul { d: d5(word), r: r5(word) },
    }
}

fn loads(word: u16, second: u16) -> Op {
    let d = d5(word);
    match word & 15 {
        0x0 => Op::Lds { d, k: second },
        0x1 => Op::LdIncrement { d, p: Z },
        0x2 => Op::LdDecrement { d, p: Z },
        0x4 => Op::Lpm { d },
        0x5 => Op::LpmIncrement { d },
        0x9 => Op::LdIncrement { d, p: Y },
        0xA => Op::LdDecrement { d, p: Y },
        0xC => Op::Ldd { d, p: X, q: 0 },
        0xD => Op::LdIncrement { d, p: X },
        0xE => Op::LdDecrement { d, p: X },
        0xF => Op::Pop { d },
        _ => Op::Illegal { word },
    }
}

fn stores(word: u16, second: u16) -> Op {
    let r = d5(word);
    match word & 15 {
        0x0 => Op::Sts { r, k: second },
        0x1 => Op::StIncrement { r, p: Z },
        0x2 => Op::StDecrement { r, p: Z },
        0x9 => Op::StIncrement { r, p: Y },
        0xA => Op::StDecrement { r, p: Y },
        0xC => Op::Std { r, p: X, q: 0 },
        0xD => Op::StIncrement { r, p: X },
        0xE => Op::StDecrement { r, p: X },
        0xF => Op::Push { r },
        _ => Op::Illegal { word },
    }
}

fn one_register(word: u16, second: u16) -> Op {
    let d = d5(word);
    match word & 15 {
        0x0 => Op::Com { d },
        0x1 => Op::Neg { d },
        0x2 => Op::Swap { d },
        0x3 => Op::Inc { d },
        0x5 => Op::Asr { d },
        0x6 => Op::Lsr { d },
        0x7 => Op::Ror { d },
        0x8 => without_register(word),
        0x9 => match word {
            0x9409 => Op::Ijmp,
            0x9509 => Op::Icall,
            _ => Op::Illegal { word },
        },
        0xA => Op::Dec { d },
        // The target has 22 bits; a 16-bit program counter takes the lower 16.
        0xC | 0xD => Op::Jmp { k: second },
        0xE | 0xF => Op::Call { k: second },
        _ => Op::Illegal { word },
    }
}

fn without_register(word: u16) -> Op {
    let mask = 1 << bits(word, 4, 7);
    match word {
        0x9408..=0x9478 => Op::Bset { mask },
        0x9488..=0x94F8 => Op::Bclr { mask },
        0x9508 => Op::Ret,
        0x9518 => Op::Reti,
        0x9588 => Op::Sleep,
        0x9598 => Op::Break,
        0x95A8 => Op::Wdr,
        0x95C8 => Op::Lpm { d: 0 },
        _ => Op::Illegal { word },
    }
}

/// `1011 saad dddd aaaa`.
fn in_out(word: u16) -> Op {
    let a = bits(word, 0, 15) | bits(word, 5, 0x30);
    if word & 0x0800 == 0 { Op::In { d: d5(word), a } } else { Op::Out { a, r: d5(word) } }
}

fn branches(word: u16) -> Op {
    let (d, mask, offset) = (d5(word), bit(word), offset_7(word));
    match (word >> 9) & 7 {
        0 | 1 => Op::Brbs { mask, offset },
        2 | 3 => Op::Brbc { mask, offset },
        _ if word & 8 != 0 => Op::Illegal { word },
        4 => Op::Bld { d, mask },
        5 => Op::Bst { d, mask },
        6 => Op::Sbrc { r: d, mask },
        _ => Op::Sbrs { r: d, mask },
    }
}
