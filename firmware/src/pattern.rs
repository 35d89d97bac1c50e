//! Bits that a cell repeats.

/// Up to 64 bits. A cell in pattern mode puts out bit 0 at the first edge (code 255 if it is set, 0 if not) and starts
/// again after the last bit.
///
/// ```
/// use spts_firmware::{Cell, Pattern};
///
/// let pattern = Pattern::of_bits([true, true, false])?;
/// let mut cell = Cell::new(8)?;
/// cell.receive(&pattern.message());
/// assert_eq!([(); 5].map(|()| cell.edge()), [255, 255, 0, 255, 255]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pattern {
    length: u8,
    word: u64,
}

/// A number of bits that a cell cannot store.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("number of bits of a pattern = {bits} is outside [1, 64]")]
pub struct PatternError {
    /// The number of bits.
    pub bits: usize,
}

/// Number of bits that a cell can store.
pub const PATTERN_BITS: usize = 64;
/// Mode byte that announces a pattern.
pub(crate) const PATTERN_MODE: u8 = 3;

impl Pattern {
    /// The lowest `bits` bits of `word`, starting with the lowest.
    ///
    /// # Errors
    /// [`PatternError`] outside 1…64.
    pub fn new(bits: usize, word: u64) -> Result<Self, PatternError> {
        match u8::try_from(bits) {
            Ok(length) if (1..=PATTERN_BITS).contains(&bits) => Ok(Self { length, word }),
            _ => Err(PatternError { bits }),
        }
    }

    /// The given bits; the first one is put out at the first edge.
    ///
    /// # Errors
    /// [`PatternError`] for no bit, or more than 64.
    pub fn of_bits(bits: impl IntoIterator<Item = bool>) -> Result<Self, PatternError> {
        let (mut count, mut word) = (0, 0);
        for bit in bits {
            if count < PATTERN_BITS {
                word |= u64::from(bit) << count;
            }
            count += 1;
        }
        Self::new(count, word)
    }

    /// Number of bits.
    #[must_use]
    pub fn bits(self) -> usize {
        usize::from(self.length)
    }

    /// Bit at edge `edge`, counted from the start of the pattern.
    #[must_use]
    pub fn bit(self, edge: u64) -> bool {
        self.word >> (edge % u64::from(self.length)) & 1 == 1
    }

    /// The message that starts a cell with this pattern: the mode byte, the number of bits, and the bits in bytes,
    /// starting with the lowest bit.
    #[must_use]
    pub fn message(self) -> Vec<u8> {
        let bytes = self.word.to_le_bytes();
        let bits = &bytes[..self.bits().div_ceil(8)];
        [&[PATTERN_MODE, self.length], bits].concat()
    }

    /// What a read returns of it: the number of bits, and eight bytes.
    pub(crate) fn reply(self) -> [u8; 9] {
        let [b0, b1, b2, b3, b4, b5, b6, b7] = self.word.to_le_bytes();
        [self.length, b0, b1, b2, b3, b4, b5, b6, b7]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_a_cell_holds_is_a_pattern() {
        for bits in [0, 65, 256, 257, usize::MAX] {
            assert_eq!(Pattern::new(bits, 1), Err(PatternError { bits }));
        }
        assert_eq!(
            Pattern::of_bits(std::iter::repeat_n(true, 65)),
            Err(PatternError { bits: 65 })
        );
        assert_eq!(Pattern::of_bits([]), Err(PatternError { bits: 0 }));
    }

    /// By hand: bits 1, 0, 0, 0, 0, 0, 0, 0, 1 are the bytes 0x01 and 0x01.
    #[test]
    fn the_first_bit_is_the_lowest_of_the_first_byte() {
        let bits = [true, false, false, false, false, false, false, false, true];
        let pattern = Pattern::of_bits(bits).unwrap();
        assert_eq!(pattern.message(), [3, 9, 0x01, 0x01]);
        let out: Vec<bool> = (0..18).map(|edge| pattern.bit(edge)).collect();
        assert_eq!(out, [bits, bits].concat());
    }
}
