//! Decoded instructions.

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
    #[must_use]
    #[inline]
    pub const fn words(self) -> u16 {
        match self {
            Self::Lds { .. } | Self::Sts { .. } | Self::Jmp { .. } | Self::Call { .. } => 2,
            _ => 1,
        }
    }
}
