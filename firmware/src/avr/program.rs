//! Flash memory, decoded once, and its instructions as text in avr-objdump's syntax.

use super::op::Op;
use spts_input::Refusal;

/// Program memory: its bytes and, word by word, its instructions. Devices with the same image share it by `Arc`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Program {
    bytes: Box<[u8]>,
    ops: Box<[Op]>,
    /// Words − 1; the size is a power of two.
    mask: u16,
}

impl Program {
    /// A flash of `flash_bytes` that starts with `image`; the rest is erased, 0xFF.
    ///
    /// # Errors
    /// [`Refusal`] if the flash is not a power of two from 2 bytes to 128 KiB, or the image does not fit.
    pub fn new(image: &[u8], flash_bytes: usize) -> Result<Self, Refusal> {
        let words = flash_bytes / 2;
        let mask = match u16::try_from(words.wrapping_sub(1)) {
            Ok(mask) if flash_bytes.is_power_of_two() => mask,
            _ => {
                let needed = "it must be a power of two from 2 to 131072";
                return Err(Refusal::new(format!("flash has {flash_bytes} bytes, but {needed}")));
            }
        };
        if image.len() > flash_bytes {
            let program = image.len();
            return Err(Refusal::new(format!("program has {program} bytes, but flash has {flash_bytes}")));
        }
        let mut bytes = vec![0xFF; flash_bytes].into_boxed_slice();
        bytes[..image.len()].copy_from_slice(image);
        let word = |k: usize| u16::from_le_bytes([bytes[2 * k], bytes[2 * k + 1]]);
        let ops = (0..words).map(|k| Op::decode(word(k), word((k + 1) % words))).collect();
        Ok(Self { bytes, ops, mask })
    }

    /// The smallest flash that holds `words`. Words beyond 65536, which cannot be addressed, are dropped.
    pub fn from_words(words: &[u16]) -> Self {
        let words = &words[..words.len().min(0x1_0000)];
        let image: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
        let flash_bytes = image.len().next_power_of_two().max(2);
        match Self::new(&image, flash_bytes) {
            Ok(program) => program,
            Err(error) => unreachable!("flash made to measure: {error}"),
        }
    }

    /// Size, in words.
    pub fn words(&self) -> usize {
        self.ops.len()
    }

    /// The byte at `address`; addresses wrap at the end of flash, as LPM's do.
    #[inline]
    pub fn byte(&self, address: u16) -> u8 {
        self.bytes[usize::from(address) & (self.bytes.len() - 1)]
    }

    /// The word at word address `pc`, which wraps.
    pub fn word(&self, pc: u16) -> u16 {
        let k = 2 * usize::from(self.wrap(pc));
        u16::from_le_bytes([self.bytes[k], self.bytes[k + 1]])
    }

    /// The instruction at word address `pc`, which wraps.
    #[inline]
    pub fn op(&self, pc: u16) -> Op {
        self.ops[usize::from(self.wrap(pc))]
    }

    /// Wraps the word address `pc` at the end of flash.
    #[inline]
    pub const fn wrap(&self, pc: u16) -> u16 {
        pc & self.mask
    }
}

/// The instruction at word address `pc` of `program`, such as `ldi r24, 0xC8`. The target of a jump follows a
/// semicolon, as a byte address.
///
/// Mnemonics and operands are spelled as in avr-objdump (ROL r1 is `adc r1, r1`). Words that are not instructions of
/// the core are `.word`.
///
/// ```
/// use spts_firmware::avr::{Program, disassemble};
///
/// let program = Program::from_words(&[0xEC88, 0x9588]);
/// assert_eq!(disassemble(&program, 0), "ldi r24, 0xC8");
/// assert_eq!(disassemble(&program, 1), "sleep");
/// ```
pub fn disassemble(program: &Program, pc: u16) -> String {
    let op = program.op(pc);
    let text = if program.word(pc) == LPM_IMPLIED { "lpm".to_owned() } else { instruction(op) };
    match offset(op) {
        None => text,
        Some(offset) => {
            let target = program.wrap(pc.wrapping_add(1).wrapping_add_signed(offset));
            format!("{text} ; {:#x}", 2 * u32::from(target))
        }
    }
}

/// LPM without operands: r0 and Z.
const LPM_IMPLIED: u16 = 0x95C8;

fn offset(op: Op) -> Option<i16> {
    match op {
        Op::Rjmp { offset } | Op::Rcall { offset } => Some(offset),
        Op::Brbs { offset, .. } | Op::Brbc { offset, .. } => Some(offset.into()),
        _ => None,
    }
}

/// The mnemonic is the name of the variant, but where the manual has several for one.
fn instruction(op: Op) -> String {
    let name = format!("{op:?}").to_lowercase();
    let name = name.split(' ').next().unwrap_or_default();
    match op {
        Op::Nop | Op::Ijmp | Op::Icall | Op::Ret | Op::Reti | Op::Sleep | Op::Break | Op::Wdr => name.to_owned(),
        Op::Bset { mask } => ["sec", "sez", "sen", "sev", "ses", "seh", "set", "sei"][number(mask)].to_owned(),
        Op::Bclr { mask } => ["clc", "clz", "cln", "clv", "cls", "clh", "clt", "cli"][number(mask)].to_owned(),

        Op::Movw { d, r } | Op::Muls { d, r } | Op::Mulsu { d, r } | Op::Mul { d, r } => registers(name, d, r),
        Op::Fmul { d, r } | Op::Fmuls { d, r } | Op::Fmulsu { d, r } | Op::Mov { d, r } => registers(name, d, r),
        Op::Cpc { d, r } | Op::Cp { d, r } | Op::Cpse { d, r } | Op::Sbc { d, r } => registers(name, d, r),
        Op::Sub { d, r } | Op::Add { d, r } | Op::Adc { d, r } | Op::And { d, r } => registers(name, d, r),
        Op::Eor { d, r } | Op::Or { d, r } => registers(name, d, r),

        Op::Cpi { d, k } | Op::Sbci { d, k } | Op::Subi { d, k } => format!("{name} r{d}, 0x{k:02X}"),
        Op::Ori { d, k } | Op::Andi { d, k } | Op::Ldi { d, k } => format!("{name} r{d}, 0x{k:02X}"),
        // avr-objdump writes 6-bit operands in lower case
        Op::Adiw { d, k } | Op::Sbiw { d, k } | Op::In { d, a: k } => format!("{name} r{d}, {k:#04x}"),

        Op::Com { d } | Op::Neg { d } | Op::Swap { d } | Op::Inc { d } | Op::Dec { d } => format!("{name} r{d}"),
        Op::Asr { d } | Op::Lsr { d } | Op::Ror { d } | Op::Pop { d } | Op::Push { r: d } => format!("{name} r{d}"),

        Op::Bld { d, mask } | Op::Bst { d, mask } => format!("{name} r{d}, {}", number(mask)),
        Op::Sbrc { r, mask } | Op::Sbrs { r, mask } => format!("{name} r{r}, {}", number(mask)),
        Op::Cbi { a, mask } | Op::Sbi { a, mask } => format!("{name} {a:#04x}, {}", number(mask)),
        Op::Sbic { a, mask } | Op::Sbis { a, mask } => format!("{name} {a:#04x}, {}", number(mask)),
        Op::Out { a, r } => format!("out {a:#04x}, r{r}"),

        Op::Ldd { d, p, q: 0 } => format!("ld r{d}, {}", pointer(p)),
        Op::Ldd { d, p, q } => format!("ldd r{d}, {}+{q}", pointer(p)),
        Op::LdIncrement { d, p } => format!("ld r{d}, {}+", pointer(p)),
        Op::LdDecrement { d, p } => format!("ld r{d}, -{}", pointer(p)),
        Op::Std { r, p, q: 0 } => format!("st {}, r{r}", pointer(p)),
        Op::Std { r, p, q } => format!("std {}+{q}, r{r}", pointer(p)),
        Op::StIncrement { r, p } => format!("st {}+, r{r}", pointer(p)),
        Op::StDecrement { r, p } => format!("st -{}, r{r}", pointer(p)),
        Op::Lds { d, k } => format!("lds r{d}, 0x{k:04X}"),
        Op::Sts { r, k } => format!("sts 0x{k:04X}, r{r}"),
        Op::Lpm { d } => format!("lpm r{d}, Z"),
        Op::LpmIncrement { d } => format!("lpm r{d}, Z+"),

        // byte address; zero has no prefix, as in C's `%#x`
        Op::Jmp { k: 0 } | Op::Call { k: 0 } => format!("{name} 0"),
        Op::Jmp { k } | Op::Call { k } => format!("{name} {:#x}", 2 * u32::from(k)),
        Op::Rjmp { offset } | Op::Rcall { offset } => relative(name, offset),
        Op::Brbs { mask, offset } => relative(BRANCHES_IF_SET[number(mask)], offset.into()),
        Op::Brbc { mask, offset } => relative(BRANCHES_IF_CLEAR[number(mask)], offset.into()),
        Op::Illegal { word } => format!(".word {word:#06x}"),
    }
}

const BRANCHES_IF_SET: [&str; 8] = ["brcs", "breq", "brmi", "brvs", "brlt", "brhs", "brts", "brie"];
const BRANCHES_IF_CLEAR: [&str; 8] = ["brcc", "brne", "brpl", "brvc", "brge", "brhc", "brtc", "brid"];

/// Number of the bit in a one-bit mask.
const fn number(mask: u8) -> usize {
    mask.trailing_zeros() as usize & 7
}

const fn pointer(p: u8) -> char {
    match p {
        26 => 'X',
        28 => 'Y',
        _ => 'Z',
    }
}

fn registers(mnemonic: &str, d: u8, r: u8) -> String {
    format!("{mnemonic} r{d}, r{r}")
}

/// Bytes from the following instruction.
fn relative(mnemonic: &str, offset: i16) -> String {
    format!("{mnemonic} .{:+}", 2 * i32::from(offset))
}
