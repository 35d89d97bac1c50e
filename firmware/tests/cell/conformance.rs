//! Emulated cells beside behavioural ones: same bus traffic, whatever it is, same edges, same codes, acknowledgements
//! and replies.

use proptest::prelude::*;
use spts_firmware::{Array, BusEvent, BusReply, Cell, CellMode, Clock, FIRST_ADDRESS, Image, Pattern, REPLY_BYTES};

/// Real timing of the skin at its fastest: 72 kHz, sampled 11 µs behind the edge.
pub(crate) const FAST: Clock = Clock { edge_hz: 72e3, sample_delay_s: 11e-6 };

/// Slow enough for the plain image: 400 cycles, sampled behind its handlers of edge (147) and timer (about 110).
pub(crate) const SLOW: Clock = Clock { edge_hz: 50e3, sample_delay_s: 19e-6 };

const MODES: [CellMode; 3] = [CellMode::Raster, CellMode::Analog, CellMode::Binary];

/// Lengths of patterns: the longest and the one before, the shortest, one byte and its neighbours, some between; short
/// ones behind long ones.
const LENGTHS: [usize; 8] = [64, 1, 63, 20, 9, 33, 7, 8];

/// How a cell is started.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Start {
    /// From a seed of one byte.
    Seeded(CellMode),
    /// With a pattern of so many bits.
    Pattern(usize),
}

/// One of each kind.
pub(crate) const STARTS: [Start; 4] = [
    Start::Seeded(CellMode::Raster),
    Start::Seeded(CellMode::Analog),
    Start::Seeded(CellMode::Binary),
    Start::Pattern(20),
];

impl Start {
    /// What is written to a cell, different for every `salt`.
    pub(crate) fn message(self, salt: u8) -> Vec<u8> {
        match self {
            Self::Seeded(mode) => mode.pair(salt).to_vec(),
            Self::Pattern(bits) => pattern(bits, salt).message(),
        }
    }
}

/// Bits of two words that are far from alike.
fn pattern(bits: usize, salt: u8) -> Pattern {
    let word = u64::from(mixed(salt)) << 32 | u64::from(mixed(!salt));
    Pattern::new(bits, word ^ word >> 17).unwrap()
}

/// Where they differ.
pub(crate) type Difference = String;

/// Cells of both kinds.
pub(crate) struct Twins {
    pub(crate) array: Array,
    pub(crate) cells: Vec<Cell>,
    clock: Clock,
}

impl Twins {
    pub(crate) fn new(image: &Image, cells: u8, clock: Clock) -> Self {
        Self {
            array: Array::new(usize::from(cells), image).unwrap(),
            cells: (FIRST_ADDRESS..).take(usize::from(cells)).map(|a| Cell::new(a).unwrap()).collect(),
            clock,
        }
    }

    /// One write to every cell.
    pub(crate) fn write_all(&mut self, bytes: impl Fn(u8) -> Vec<u8>) -> Result<(), Difference> {
        for cell in &mut self.cells {
            let bytes = bytes(cell.address());
            self.array.write(cell.address(), &bytes).map_err(|e| e.to_string())?;
            cell.receive(&bytes);
        }
        Ok(())
    }

    /// Edges; every cell's code is compared at every edge.
    pub(crate) fn edges(&mut self, edges: usize) -> Result<(), Difference> {
        let mut codes = vec![0; edges * self.cells.len()];
        self.array.clock(self.clock, &mut codes).map_err(|e| e.to_string())?;
        for (edge, row) in codes.chunks(self.cells.len()).enumerate() {
            for (cell, code) in self.cells.iter_mut().zip(row) {
                let expected = cell.edge();
                if *code != expected {
                    return Err(format!("edge {edge}: code {code}, not {expected} of {cell:?}"));
                }
            }
        }
        Ok(())
    }

    /// Read-back of every cell, two bytes beyond its end.
    pub(crate) fn read_back(&mut self) -> Result<(), Difference> {
        for cell in &self.cells {
            let (mut read, mut expected) = ([0; REPLY_BYTES + 2], [0; REPLY_BYTES + 2]);
            self.array.read(cell.address(), &mut read).map_err(|e| e.to_string())?;
            cell.read(&mut expected);
            if read != expected {
                return Err(format!("reply of cell {}: {read:?}, not {expected:?}", cell.address()));
            }
        }
        Ok(())
    }
}

/// The whole protocol: no seed, every mode with either kind of seed, seeding anew in the middle, patterns of all kinds
/// of lengths, unknown modes, broken pairs, replies.
pub(crate) fn conforms(image: &Image, clock: Clock) -> Result<(), Difference> {
    let mut twins = Twins::new(image, 112, clock);
    twins.read_back()?;
    twins.edges(20)?;
    for mode in MODES {
        twins.write_all(|address| mode.pair(address).to_vec())?;
        twins.read_back()?;
        twins.edges(330)?;
        twins.read_back()?;
        // in the middle of the raster
        twins.write_all(|address| mode.pair(!address).to_vec())?;
        twins.edges(130)?;
    }
    for mode in MODES {
        twins.write_all(|address| mode.extended(mixed(address)).to_vec())?;
        twins.read_back()?;
        twins.edges(130)?;
        // one byte behind four
        twins.write_all(|address| mode.pair(address).to_vec())?;
        twins.read_back()?;
    }
    for bits in LENGTHS {
        twins.write_all(|address| pattern(bits, address).message())?;
        twins.read_back()?;
        twins.edges(2 * bits + 5)?;
        twins.read_back()?;
        // another one in the middle, and what is no pattern
        twins.write_all(|address| [&[3, 0, 3, 65][..], &pattern(bits, !address).message(), &[3, 9, 77]].concat())?;
        twins.edges(bits + 3)?;
        twins.read_back()?;
        twins.write_all(|address| CellMode::Raster.pair(address).to_vec())?;
        twins.edges(3)?;
        twins.read_back()?;
    }
    for bytes in
        [&[][..], &[1], &[3], &[3, 64, 1, 2, 3, 4, 5, 6, 7], &[0x82, 1, 2, 3], &[7, 1], &[0x83, 1, 2, 3, 1, 77, 0]]
    {
        twins.write_all(|_| bytes.to_vec())?;
        twins.edges(3)?;
        twins.read_back()?;
    }
    let faults = twins.array.cells().iter().find_map(|cell| cell.faults().first());
    faults.map_or(Ok(()), |fault| Err(format!("{fault:?}")))
}

/// Seeds far apart, all bytes in use: odd multiples of 2³²/φ.
fn mixed(address: u8) -> u32 {
    (2 * u32::from(address) + 1).wrapping_mul(0x9e37_79b9)
}

#[test]
fn both_images_conform() {
    conforms(&Image::shipped(), FAST).unwrap();
    conforms(&Image::plain(), SLOW).unwrap();
}

const CELLS: u8 = 4;

#[derive(Debug, Clone)]
enum Action {
    Edges(usize),
    /// START, parts with repeated START between them, bits of a byte that is broken off, STOP.
    Transaction(Vec<Part>, u8),
    /// The supply of one cell fails for a moment.
    BrownOut(u8),
}

#[derive(Debug, Clone)]
enum Part {
    Write { address: u8, bytes: Vec<u8> },
    Read { address: u8, len: usize },
}

/// Mostly those of the cells, sometimes any of the bus, the general call among them.
fn address() -> impl Strategy<Value = u8> {
    prop_oneof![8 => FIRST_ADDRESS..FIRST_ADDRESS + CELLS, 1 => 0..128_u8]
}

/// Mostly mode bytes: in a random write every byte may become one.
fn byte() -> impl Strategy<Value = u8> {
    let mode = prop::sample::select(vec![0, 1, 2, 3, 3, 0x7f, 0x80, 0x81, 0x82, 0x83, 0xff]);
    // what may be a number of bits of a pattern
    prop_oneof![4 => mode, 1 => 1..70_u8, 1 => any::<u8>()]
}

fn part() -> impl Strategy<Value = Part> {
    prop_oneof![
        3 => (address(), prop::collection::vec(byte(), 0..12)).prop_map(|(address, bytes)| Part::Write { address, bytes }),
        2 => (address(), 1..20_usize).prop_map(|(address, len)| Part::Read { address, len }),
    ]
}

fn action() -> impl Strategy<Value = Action> {
    let transaction = (prop::collection::vec(part(), 1..4), 0..8_u8);
    prop_oneof![
        4 => (1..120_usize).prop_map(Action::Edges),
        8 => transaction.prop_map(|(parts, bits)| Action::Transaction(parts, bits)),
        1 => (FIRST_ADDRESS..FIRST_ADDRESS + CELLS).prop_map(Action::BrownOut),
    ]
}

fn run(image: &Image, clock: Clock, actions: &[Action]) -> Result<(), Difference> {
    let mut twins = Twins::new(image, CELLS, clock);
    for action in actions {
        match action {
            Action::Edges(edges) => twins.edges(*edges)?,
            Action::Transaction(parts, bits) => transact(&mut twins, parts, *bits)?,
            Action::BrownOut(address) => brown_out(&mut twins, *address),
        }
    }
    twins.read_back()?;
    twins.edges(30)
}

fn brown_out(twins: &mut Twins, address: u8) {
    twins.array.cell_mut(address).unwrap().reset();
    twins.array.idle(1e-3).unwrap();
    twins.cells[usize::from(address - FIRST_ADDRESS)] = Cell::new(address).unwrap();
}

fn transact(twins: &mut Twins, parts: &[Part], bits: u8) -> Result<(), Difference> {
    let (mut events, mut expected) = (vec![], vec![]);
    for part in parts {
        events.push(BusEvent::Start);
        match part {
            Part::Write { address, bytes } => {
                events.push(BusEvent::Write(address << 1));
                events.extend(bytes.iter().map(|byte| BusEvent::Write(*byte)));
                let cell = twins.cells.iter_mut().find(|cell| cell.address() == *address);
                let acknowledged = BusReply::Acknowledged(cell.is_some());
                expected.extend(std::iter::repeat_n(acknowledged, bytes.len() + 1));
                if let Some(cell) = cell {
                    cell.receive(bytes);
                }
            }
            Part::Read { address, len } => {
                events.push(BusEvent::Write(address << 1 | 1));
                events.extend((1..=*len).map(|k| BusEvent::Read { acknowledge: k < *len }));
                let cell = twins.cells.iter().find(|cell| cell.address() == *address);
                let mut reply = vec![0xff; *len];
                if let Some(cell) = cell {
                    cell.read(&mut reply);
                }
                expected.push(BusReply::Acknowledged(cell.is_some()));
                expected.extend(reply.into_iter().map(BusReply::Byte));
            }
        }
    }
    events.extend((bits > 0).then_some(BusEvent::Bits(bits)));
    events.push(BusEvent::Stop);
    let replies = twins.array.transact(&events).map_err(|e| e.to_string())?;
    if replies == expected { Ok(()) } else { Err(format!("{events:?}: {replies:?}, not {expected:?}")) }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn images_and_cell_agree_on_any_traffic(actions in prop::collection::vec(action(), 1..30)) {
        for (name, image, clock) in [("shipped", Image::shipped(), FAST), ("plain", Image::plain(), SLOW)] {
            if let Err(difference) = run(&image, clock, &actions) {
                prop_assert!(false, "{name}: {difference}");
            }
        }
    }
}
