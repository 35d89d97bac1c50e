//! One cell as a behavioural model, and the bits that it can repeat.

use spts_input::Refusal;

/// Lowest address.
pub const FIRST_ADDRESS: u8 = 8;
/// Highest address of the raster scan, whose count restarts here.
pub const LAST_ADDRESS: u8 = 107;
/// Highest address on the bus. A cell above [`LAST_ADDRESS`] is never selected by the raster scan; other modes work
/// there as well.
pub const LAST_BUS_ADDRESS: u8 = 119;
/// DAC code at which a taxel does not contribute to the sum: mid-scale.
pub const NEUTRAL_CODE: u8 = 126;
/// Number of bytes in a reply, after which the bus stays idle: mode, state (4), counter, code, then the number of bits
/// of the pattern and its bytes (8).
pub const REPLY_BYTES: usize = 16;

/// Count from which the first edge reaches the first address.
const COUNTER_START: u8 = FIRST_ADDRESS - 1;
const MULTIPLIER: u32 = 1_664_525;
const INCREMENT: u32 = 1_013_904_223;
/// Bit of the mode byte that announces four seed bytes.
const EXTENDED: u8 = 0x80;
/// Mode byte that a read returns before the first seed.
const UNSEEDED: u8 = 0xff;
/// What a read finds behind the end of the reply: nobody pulls the line low.
const IDLE_BUS: u8 = 0xff;

/// Mode of a cell that was started with a seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellMode {
    /// Code 255 when the cell is scanned, mid-scale otherwise. Mode byte 0.
    Raster,
    /// Top byte of the generator. Mode byte 1.
    Analog,
    /// Code 0 or 255, by the top bit of the generator. Mode byte 2.
    Binary,
}

impl CellMode {
    /// The mode that `byte` selects; `None` if there is none.
    pub(crate) fn from_byte(byte: u8) -> Option<Self> {
        match byte {
            0 => Some(Self::Raster),
            1 => Some(Self::Analog),
            2 => Some(Self::Binary),
            _ => None,
        }
    }

    /// The byte that selects this mode.
    pub fn byte(self) -> u8 {
        match self {
            Self::Raster => 0,
            Self::Analog => 1,
            Self::Binary => 2,
        }
    }

    /// The message that starts a cell in this mode with a one-byte seed.
    pub fn pair(self, seed: u8) -> [u8; 2] {
        [self.byte(), seed]
    }

    /// The message that starts a cell in this mode with a four-byte seed.
    pub fn extended(self, seed: u32) -> [u8; 5] {
        let [s0, s1, s2, s3] = seed.to_le_bytes();
        [EXTENDED | self.byte(), s0, s1, s2, s3]
    }
}

/// Behaviour of one cell without time: the state that bus commands and clock edges change, and the code that it puts
/// out.
///
/// ```
/// use spts_firmware::{Cell, CellMode};
///
/// let mut cell = Cell::new(8)?;
/// cell.receive(&CellMode::Binary.pair(8)); // mode and seed, as the bus master writes them
/// let codes: Vec<u8> = (0..100).map(|_| cell.edge()).collect();
/// assert!(codes.iter().all(|code| [0, 255].contains(code)));
/// assert!(codes.contains(&0) && codes.contains(&255));
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cell {
    address: u8,
    running: Running,
    counter: u8,
    state: u32,
    code: u8,
    /// Pattern of the last start with one.
    pattern: Option<Pattern>,
}

/// What a cell was started with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Running {
    Nothing,
    Seeded(CellMode),
    Pattern(Pattern),
}

impl Cell {
    /// A cell after power-up, without a seed.
    ///
    /// # Errors
    /// [`Refusal`] outside 8…119.
    pub fn new(address: u8) -> Result<Self, Refusal> {
        if !(FIRST_ADDRESS..=LAST_BUS_ADDRESS).contains(&address) {
            return Err(Refusal::new(format!("address {address} is outside [8, 119]")));
        }
        Ok(Self {
            address,
            running: Running::Nothing,
            counter: COUNTER_START,
            state: 0,
            code: NEUTRAL_CODE,
            pattern: None,
        })
    }

    /// I²C address.
    pub fn address(&self) -> u8 {
        self.address
    }

    /// Mode; `None` unless the last start was with a seed.
    pub fn mode(&self) -> Option<CellMode> {
        match self.running {
            Running::Seeded(mode) => Some(mode),
            _ => None,
        }
    }

    /// Pattern; `None` unless the last start was with one.
    pub fn pattern(&self) -> Option<Pattern> {
        match self.running {
            Running::Pattern(pattern) => Some(pattern),
            _ => None,
        }
    }

    /// Present DAC code.
    pub fn code(&self) -> u8 {
        self.code
    }

    /// Receives one I²C write, from START to STOP or repeated START: mode bytes, each with its seed or its pattern.
    pub fn receive(&mut self, bytes: &[u8]) {
        let mut rest = bytes;
        while let [mode, after @ ..] = rest {
            if let (&PATTERN_MODE, [bits, after @ ..]) = (mode, after)
                && let Ok(empty) = Pattern::new(usize::from(*bits), 0)
            {
                let Some((word, next)) = after.split_at_checked(empty.bits().div_ceil(8)) else {
                    return;
                };
                let word = word.iter().rev().fold(0, |word, byte| word << 8 | u64::from(*byte));
                self.run(Pattern::new(empty.bits(), word).unwrap_or(empty));
                rest = next;
                continue;
            }
            let extended = mode & EXTENDED != 0;
            let known = CellMode::from_byte(mode & !EXTENDED);
            let (seed, next) = match (known, after) {
                (Some(_), [s0, s1, s2, s3, next @ ..]) if extended => (u32::from_le_bytes([*s0, *s1, *s2, *s3]), next),
                (Some(_), _) if extended => return,
                (_, [seed, next @ ..]) => (u32::from(*seed), next),
                (_, []) => return,
            };
            if let Some(mode) = known {
                self.seed(mode, seed);
            }
            rest = next;
        }
    }

    fn seed(&mut self, mode: CellMode, seed: u32) {
        self.running = Running::Seeded(mode);
        self.state = seed;
        self.counter = COUNTER_START;
    }

    fn run(&mut self, pattern: Pattern) {
        self.running = Running::Pattern(pattern);
        self.pattern = Some(pattern);
        self.state = 0;
        self.counter = 0;
    }

    /// Answers one I²C read: fills `bytes` with the reply, and the rest with 255.
    ///
    /// The reply is: the mode byte (255 before the first start); the state from which the next code is computed, least
    /// significant byte first (the seed in raster mode, 0 for a pattern); the counter at the next edge (for a pattern,
    /// the index of the bit); the present DAC code; then the pattern that was written last, as its number of bits (0
    /// before the first) and its eight bytes.
    pub fn read(&self, bytes: &mut [u8]) {
        let (mode, state) = match self.running {
            Running::Nothing => (UNSEEDED, self.state),
            Running::Seeded(mode @ CellMode::Raster) => (mode.byte(), self.state),
            Running::Seeded(mode) => (mode.byte(), next(self.state)),
            Running::Pattern(_) => (PATTERN_MODE, self.state),
        };
        let [s0, s1, s2, s3] = state.to_le_bytes();
        let start = [mode, s0, s1, s2, s3, self.counter, self.code];
        let pattern = self.pattern.map_or([0; 9], Pattern::reply);
        bytes.fill(IDLE_BUS);
        for (byte, value) in bytes.iter_mut().zip(start.into_iter().chain(pattern)) {
            *byte = value;
        }
    }

    /// Advances by one clock edge. Returns the new DAC code.
    pub fn edge(&mut self) -> u8 {
        self.code = match self.running {
            Running::Nothing => NEUTRAL_CODE,
            Running::Pattern(pattern) => {
                let bit = pattern.bit(u64::from(self.counter));
                self.counter += 1;
                if usize::from(self.counter) == pattern.bits() {
                    self.counter = 0;
                }
                if bit { u8::MAX } else { 0 }
            }
            Running::Seeded(CellMode::Raster) => {
                self.counter += 1;
                let mine = self.counter == self.address;
                if self.counter == LAST_ADDRESS {
                    self.counter = COUNTER_START;
                }
                if mine { u8::MAX } else { NEUTRAL_CODE }
            }
            Running::Seeded(CellMode::Analog) => self.step(),
            Running::Seeded(CellMode::Binary) => {
                if self.step() < 128 {
                    0
                } else {
                    u8::MAX
                }
            }
        };
        self.code
    }

    /// Steps the generator and returns its top byte.
    fn step(&mut self) -> u8 {
        self.state = next(self.state);
        let [.., top] = self.state.to_le_bytes();
        top
    }
}

/// State after `state`: the linear congruential generator of *Numerical Recipes* ("quick and dirty").
fn next(state: u32) -> u32 {
    MULTIPLIER.wrapping_mul(state).wrapping_add(INCREMENT)
}

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

/// Number of bits that a cell can store.
pub const PATTERN_BITS: usize = 64;
/// Mode byte that announces a pattern.
pub(crate) const PATTERN_MODE: u8 = 3;

impl Pattern {
    /// The lowest `bits` bits of `word`, starting with the lowest.
    ///
    /// # Errors
    /// [`Refusal`] outside 1…64.
    pub fn new(bits: usize, word: u64) -> Result<Self, Refusal> {
        match u8::try_from(bits) {
            Ok(length) if (1..=PATTERN_BITS).contains(&bits) => Ok(Self { length, word }),
            _ => Err(Refusal::new(format!("number of bits of a pattern = {bits} is outside [1, 64]"))),
        }
    }

    /// The given bits; the first one is put out at the first edge.
    ///
    /// # Errors
    /// [`Refusal`] for no bit, or more than 64.
    pub fn of_bits(bits: impl IntoIterator<Item = bool>) -> Result<Self, Refusal> {
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
    pub fn bits(self) -> usize {
        usize::from(self.length)
    }

    /// Bit at edge `edge`, counted from the start of the pattern.
    pub fn bit(self, edge: u64) -> bool {
        self.word >> (edge % u64::from(self.length)) & 1 == 1
    }

    /// The message that starts a cell with this pattern: the mode byte, the number of bits, and the bits in bytes,
    /// starting with the lowest bit.
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

    fn codes(cell: &mut Cell, edges: usize) -> Vec<u8> {
        (0..edges).map(|_| cell.edge()).collect()
    }

    fn reply(cell: &Cell) -> [u8; REPLY_BYTES] {
        let mut bytes = [0; REPLY_BYTES];
        cell.read(&mut bytes);
        bytes
    }

    #[test]
    fn the_raster_selects_each_cell_once_in_a_hundred_edges() {
        for (address, turn) in [(8, 0), (64, 56), (107, 99), (108, 100), (119, 100)] {
            let mut cell = Cell::new(address).unwrap();
            cell.receive(&[0, address]);
            let expected: Vec<u8> = (0..300).map(|e| if e % 100 == turn { 255 } else { 126 }).collect();
            assert_eq!(codes(&mut cell, 300), expected, "address {address}");
        }
    }

    /// By hand: 8·1664525 + 1013904223 = 1027220423 = 0x3D3A_23C7; 0xDEAD_BEEF gives 0x6AAB_DF82.
    #[test]
    fn the_generator_starts_from_the_seed() {
        let mut cell = Cell::new(20).unwrap();
        cell.receive(&CellMode::Analog.pair(8));
        assert_eq!(reply(&cell)[..7], [1, 0xc7, 0x23, 0x3a, 0x3d, 7, 126]);
        assert_eq!(cell.edge(), 0x3d);
        cell.receive(&CellMode::Binary.pair(8));
        assert_eq!(cell.edge(), 0);
        cell.receive(&CellMode::Analog.extended(0xdead_beef));
        assert_eq!(cell.edge(), 0x6a);
        cell.receive(&CellMode::Binary.extended(8));
        assert_eq!(reply(&cell)[..7], [2, 0xc7, 0x23, 0x3a, 0x3d, 7, 0x6a]);
    }

    #[test]
    fn a_cell_without_a_seed_is_neutral_and_says_so() {
        let mut cell = Cell::new(8).unwrap();
        assert_eq!(codes(&mut cell, 200), [NEUTRAL_CODE; 200]);
        assert_eq!(cell.mode(), None);
        assert_eq!(reply(&cell), [255, 0, 0, 0, 0, 7, 126, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        let mut bytes = [0; REPLY_BYTES + 2];
        cell.read(&mut bytes);
        assert_eq!(bytes[REPLY_BYTES..], [255, 255]);
    }

    #[test]
    fn what_is_not_a_whole_known_pair_changes_nothing() {
        for address in [7, 120] {
            assert!(Cell::new(address).is_err());
        }
        let fresh = Cell::new(50).unwrap();
        for ignored in [
            &[][..],
            &[1],
            &[3],
            &[3, 0],
            &[3, 65, 3, 255],
            &[3, 9, 1],
            &[4, 9],
            &[255, 255, 2],
            &[0x81, 1, 2, 3],
            &[0x83, 9, 2],
        ] {
            let mut cell = fresh.clone();
            cell.receive(ignored);
            assert_eq!(cell, fresh, "{ignored:?}");
        }
    }

    #[test]
    fn of_several_pairs_the_last_one_counts() {
        let mut last_pair_only = Cell::new(50).unwrap();
        last_pair_only.receive(&[2, 9]);
        for bytes in [
            &[0, 50, 2, 9][..],
            &[0x80, 1, 2, 3, 4, 2, 9],
            &[7, 0, 0x82, 9, 0, 0, 0],
            &[2, 9, 0x81, 5],
            &[2, 9, 3, 17, 1, 1],
        ] {
            let mut cell = Cell::new(50).unwrap();
            cell.receive(bytes);
            assert_eq!(cell, last_pair_only, "{bytes:?}");
        }
    }

    #[test]
    fn a_pair_restarts_the_raster_and_leaves_the_output_alone() {
        let mut cell = Cell::new(9).unwrap();
        cell.receive(&[0, 9]);
        assert_eq!(codes(&mut cell, 2), [126, 255]);
        assert_eq!(reply(&cell)[..7], [0, 9, 0, 0, 0, 9, 255]);
        cell.receive(&[0, 9]);
        assert_eq!(cell.code(), 255);
        assert_eq!(codes(&mut cell, 2), [126, 255]);
        codes(&mut cell, 98);
        assert_eq!(reply(&cell)[5], 7);
    }
    /// By hand: bits 1, 0, 1 of 0b101, then again; a pattern that follows acts from its first bit on.
    #[test]
    fn a_pattern_repeats() {
        let mut cell = Cell::new(30).unwrap();
        cell.receive(&[0, 30, 3, 3, 0b1111_0101]);
        assert_eq!((cell.mode(), cell.pattern().map(Pattern::bits)), (None, Some(3)));
        assert_eq!(reply(&cell), [3, 0, 0, 0, 0, 0, 126, 3, 0xf5, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(codes(&mut cell, 7), [255, 0, 255, 255, 0, 255, 255]);
        assert_eq!(reply(&cell)[5..7], [1, 255]);
        cell.receive(&[3, 64, 1, 2, 3, 4, 5, 6, 7, 0x80, 3, 1, 0, 3, 2, 2]);
        assert_eq!(codes(&mut cell, 4), [0, 255, 0, 255]);
        // a seed leaves the pattern readable
        cell.receive(&CellMode::Raster.pair(30));
        assert_eq!((cell.pattern(), reply(&cell)[7..9] == [2, 2]), (None, true));
        assert_eq!(codes(&mut cell, 1), [NEUTRAL_CODE]);
    }

    #[test]
    fn only_what_a_cell_holds_is_a_pattern() {
        for bits in [0, 65, 256, 257, usize::MAX] {
            let said = Pattern::new(bits, 1).unwrap_err().to_string();
            assert_eq!(said, format!("number of bits of a pattern = {bits} is outside [1, 64]"));
        }
        assert!(Pattern::of_bits(std::iter::repeat_n(true, 65)).is_err() && Pattern::of_bits([]).is_err());
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
