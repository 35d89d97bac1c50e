//! Opcode words to instructions.
//!
//! Source: *AVR Instruction Set Manual*, DS40002198, "16-bit Opcode" of each instruction.

use super::op::Op;

const X: u8 = 26;
const Y: u8 = 28;
const Z: u8 = 30;

impl Op {
    /// Decodes the instruction that starts with `word`. `second` is the following word, used by two-word instructions.
    #[must_use]
    pub fn decode(word: u16, second: u16) -> Self {
        match word >> 12 {
            0x0..=0x2 => two_registers(word),
            0x3 => Self::Cpi {
                d: high_d(word),
                k: immediate(word),
            },
            0x4 => Self::Sbci {
                d: high_d(word),
                k: immediate(word),
            },
            0x5 => Self::Subi {
                d: high_d(word),
                k: immediate(word),
            },
            0x6 => Self::Ori {
                d: high_d(word),
                k: immediate(word),
            },
            0x7 => Self::Andi {
                d: high_d(word),
                k: immediate(word),
            },
            0x8 | 0xA => displaced(word),
            0x9 => group_9(word, second),
            0xB => in_out(word),
            0xC => Self::Rjmp {
                offset: offset_12(word),
            },
            0xD => Self::Rcall {
                offset: offset_12(word),
            },
            0xE => Self::Ldi {
                d: high_d(word),
                k: immediate(word),
            },
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
    let (high_r, middle_d, middle_r) = (16 + bits(word, 0, 15), 16 + bits(word, 4, 7), 16 + bits(word, 0, 7));
    match (word >> 8, word & 0x88) {
        (0, _) if word == 0 => Op::Nop,
        (1, _) => Op::Movw {
            d: 2 * bits(word, 4, 15),
            r: 2 * bits(word, 0, 15),
        },
        (2, _) => Op::Muls {
            d: high_d(word),
            r: high_r,
        },
        (3, 0x00) => Op::Mulsu {
            d: middle_d,
            r: middle_r,
        },
        (3, 0x08) => Op::Fmul {
            d: middle_d,
            r: middle_r,
        },
        (3, 0x80) => Op::Fmuls {
            d: middle_d,
            r: middle_r,
        },
        (3, _) => Op::Fmulsu {
            d: middle_d,
            r: middle_r,
        },
        _ => Op::Illegal { word },
    }
}

/// LDD and STD, `10q0 qqsd dddd yqqq`.
fn displaced(word: u16) -> Op {
    let q = bits(word, 0, 7) | bits(word, 7, 0x18) | bits(word, 8, 0x20);
    let p = if word & 0x0008 == 0 { Z } else { Y };
    if word & 0x0200 == 0 {
        Op::Ldd { d: d5(word), p, q }
    } else {
        Op::Std { r: d5(word), p, q }
    }
}

fn group_9(word: u16, second: u16) -> Op {
    let word_immediate = bits(word, 0, 15) | bits(word, 2, 0x30);
    let pair = 24 + 2 * bits(word, 4, 3);
    let (a, mask) = (bits(word, 3, 31), bit(word));
    match bits(word, 8, 15) {
        0x0 | 0x1 => loads(word, second),
        0x2 | 0x3 => stores(word, second),
        0x4 | 0x5 => one_register(word, second),
        0x6 => Op::Adiw {
            d: pair,
            k: word_immediate,
        },
        0x7 => Op::Sbiw {
            d: pair,
            k: word_immediate,
        },
        0x8 => Op::Cbi { a, mask },
        0x9 => Op::Sbic { a, mask },
        0xA => Op::Sbi { a, mask },
        0xB => Op::Sbis { a, mask },
        _ => Op::Mul {
            d: d5(word),
            r: r5(word),
        },
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
    if word & 0x0800 == 0 {
        Op::In { d: d5(word), a }
    } else {
        Op::Out { a, r: d5(word) }
    }
}

fn branches(word: u16) -> Op {
    let (d, mask) = (d5(word), bit(word));
    match (word >> 9) & 7 {
        0 | 1 => Op::Brbs {
            mask,
            offset: offset_7(word),
        },
        2 | 3 => Op::Brbc {
            mask,
            offset: offset_7(word),
        },
        _ if word & 8 != 0 => Op::Illegal { word },
        4 => Op::Bld { d, mask },
        5 => Op::Bst { d, mask },
        6 => Op::Sbrc { r: d, mask },
        _ => Op::Sbrs { r: d, mask },
    }
}
