//! Flash memory, decoded once.

use super::op::Op;

/// Why a flash cannot be built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ProgramError {
    /// The size is out of range.
    #[error("flash has {bytes} bytes, but it must be a power of two from 2 to 131072")]
    Size {
        /// Size, bytes.
        bytes: usize,
    },
    /// The program is larger than the flash.
    #[error("program has {program} bytes, but flash has {flash}")]
    TooLong {
        /// Size of the program, bytes.
        program: usize,
        /// Size of the flash, bytes.
        flash: usize,
    },
}

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
    /// [`ProgramError`] if the flash is not a power of two from 2 bytes to 128 KiB, or the image does not fit.
    pub fn new(image: &[u8], flash_bytes: usize) -> Result<Self, ProgramError> {
        let words = flash_bytes / 2;
        let mask = match u16::try_from(words.wrapping_sub(1)) {
            Ok(mask) if flash_bytes.is_power_of_two() => mask,
            _ => return Err(ProgramError::Size { bytes: flash_bytes }),
        };
        if image.len() > flash_bytes {
            return Err(ProgramError::TooLong {
                program: image.len(),
                flash: flash_bytes,
            });
        }
        let mut bytes = vec![0xFF; flash_bytes].into_boxed_slice();
        bytes[..image.len()].copy_from_slice(image);
        let word = |k: usize| u16::from_le_bytes([bytes[2 * k], bytes[2 * k + 1]]);
        let ops = (0..words).map(|k| Op::decode(word(k), word((k + 1) % words))).collect();
        Ok(Self { bytes, ops, mask })
    }

    /// The smallest flash that holds `words`. Words beyond 65536, which cannot be addressed, are dropped.
    #[must_use]
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
    #[must_use]
    pub fn words(&self) -> usize {
        self.ops.len()
    }

    /// The byte at `address`; addresses wrap at the end of flash, as LPM's do.
    #[must_use]
    #[inline]
    pub fn byte(&self, address: u16) -> u8 {
        self.bytes[usize::from(address) & (self.bytes.len() - 1)]
    }

    /// The word at word address `pc`, which wraps.
    #[must_use]
    pub fn word(&self, pc: u16) -> u16 {
        let k = 2 * usize::from(self.wrap(pc));
        u16::from_le_bytes([self.bytes[k], self.bytes[k + 1]])
    }

    /// The instruction at word address `pc`, which wraps.
    #[must_use]
    #[inline]
    pub fn op(&self, pc: u16) -> Op {
        self.ops[usize::from(self.wrap(pc))]
    }

    /// Wraps the word address `pc` at the end of flash.
    #[must_use]
    #[inline]
    pub const fn wrap(&self, pc: u16) -> u16 {
        pc & self.mask
    }
}
