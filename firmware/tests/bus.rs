//! Emulated cells on their bus: whatever a master does, each cell ends where the behavioural cell says it should.

use spts_firmware::attiny412::{Device, ResetCause};
use spts_firmware::{
    Array, ArrayError, BusError, BusEvent, BusReply, Cell, CellMode, Clock, Image, NEUTRAL_CODE, REPLY_BYTES,
};

const CLOCK: Clock = Clock {
    edge_hz: 72e3,
    sample_delay_s: 11e-6,
};
const MODES: [CellMode; 3] = [CellMode::Raster, CellMode::Analog, CellMode::Binary];

/// Array and specification, both seeded with their addresses.
fn seeded(cells: usize, mode: CellMode) -> (Array, Vec<Cell>) {
    let mut array = Array::new(cells, &Image::shipped()).unwrap();
    array.start(mode).unwrap();
    let mut spec: Vec<Cell> = (8..).take(cells).map(|address| Cell::new(address).unwrap()).collect();
    for cell in &mut spec {
        cell.receive(&mode.pair(cell.address()));
    }
    (array, spec)
}

fn clocked(array: &mut Array, edges: usize) -> Vec<u8> {
    let mut codes = vec![0; edges * array.cells().len()];
    array.clock(CLOCK, &mut codes).unwrap();
    codes
}

fn expected(cells: &mut [Cell], edges: usize) -> Vec<u8> {
    (0..edges)
        .flat_map(|_| cells.iter_mut().map(Cell::edge).collect::<Vec<_>>())
        .collect()
}

fn state(array: &mut Array, address: u8) -> [u8; REPLY_BYTES] {
    let mut reply = [0; REPLY_BYTES];
    array.read(address, &mut reply).unwrap();
    reply
}

fn spec_state(cell: &Cell) -> [u8; REPLY_BYTES] {
    let mut reply = [0; REPLY_BYTES];
    cell.read(&mut reply);
    reply
}

/// Codes and read-back of every cell, and that no program has touched what is not there.
fn assert_agrees(array: &mut Array, cells: &mut [Cell]) {
    assert_eq!(clocked(array, 30), expected(cells, 30));
    for cell in &*cells {
        assert_eq!(
            state(array, cell.address()),
            spec_state(cell),
            "read-back of {}",
            cell.address()
        );
    }
    for cell in array.cells() {
        assert_eq!(cell.faults().first(), None);
    }
}

#[test]
fn all_addresses_and_modes_run_as_specified() {
    for mode in MODES {
        let (mut array, mut cells) = seeded(112, mode);
        assert_eq!(clocked(&mut array, 1000), expected(&mut cells, 1000), "{mode:?}");
        assert_agrees(&mut array, &mut cells);
    }
    let seeds: Vec<u32> = (0..112).map(|k| 0x9e37_79b9_u32.wrapping_mul(k + 1)).collect();
    let (mut array, mut cells) = seeded(112, CellMode::Raster);
    array.start_with_seeds(CellMode::Binary, &seeds).unwrap();
    for (cell, seed) in cells.iter_mut().zip(&seeds) {
        cell.receive(&CellMode::Binary.extended(*seed));
    }
    assert_agrees(&mut array, &mut cells);
}

#[test]
fn sizes_out_of_range_are_refused() {
    for cells in [0, 113] {
        let error = Array::new(cells, &Image::shipped()).unwrap_err();
        assert_eq!(error, ArrayError::Cells { cells });
    }
    let (mut array, _) = seeded(3, CellMode::Raster);
    let error = array.clock(CLOCK, &mut [0; 4]).unwrap_err();
    assert_eq!(error, ArrayError::Codes { codes: 4, cells: 3 });
    let error = array.start_with_seeds(CellMode::Binary, &[1, 2]).unwrap_err();
    assert_eq!(error, ArrayError::Seeds { seeds: 2, cells: 3 });
    let late = Clock {
        sample_delay_s: 14e-6,
        ..CLOCK
    };
    let error = array.clock(late, &mut [0; 3]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "`sample_delay_s` = 0.000014 is outside [0, 1/edge_hz)"
    );
}

#[test]
fn a_foreign_address_is_heard_by_all_and_taken_by_none() {
    let (mut array, mut cells) = seeded(3, CellMode::Analog);
    for address in (0..128).filter(|a| !(8..11).contains(a)) {
        let silence = Err(BusError::NoAcknowledge { address });
        assert_eq!(array.write(address, &[2, 77]), silence);
        assert_eq!(array.read(address, &mut [0]), silence);
    }
    // a master that talks on although nobody answers
    let mut events = vec![BusEvent::Start];
    events.extend([50 << 1, 2, 8].map(BusEvent::Write));
    events.push(BusEvent::Stop);
    assert_eq!(array.transact(&events).unwrap(), [BusReply::Acknowledged(false); 3]);
    assert_agrees(&mut array, &mut cells);
}

#[test]
fn a_repeated_start_ends_a_pair() {
    let (mut array, mut cells) = seeded(2, CellMode::Raster);
    let mut events = vec![];
    // a pair for 8, half a pair for 8, a pair for 9, a pair and a half for 8
    for bytes in [&[8 << 1, 1, 5][..], &[8 << 1, 2], &[9 << 1, 2, 6], &[8 << 1, 0, 8, 1]] {
        events.push(BusEvent::Start);
        events.extend(bytes.iter().map(|byte| BusEvent::Write(*byte)));
    }
    events.push(BusEvent::Stop);
    let replies = array.transact(&events).unwrap();
    assert_eq!(replies, [BusReply::Acknowledged(true); 12]);
    for (k, bytes) in [(0, &[1, 5][..]), (0, &[2]), (1, &[2, 6]), (0, &[0, 8, 1])] {
        cells[k].receive(bytes);
    }
    assert_agrees(&mut array, &mut cells);

    // write, repeated START and read in one transaction; two bytes more than there are
    let mut events = vec![BusEvent::Start];
    events.extend([9 << 1, 1, 200].map(BusEvent::Write));
    events.extend([BusEvent::Start, BusEvent::Write(9 << 1 | 1)]);
    events.extend((0..9).map(|k| BusEvent::Read { acknowledge: k < 8 }));
    events.push(BusEvent::Stop);
    let replies = array.transact(&events).unwrap();
    cells[1].receive(&[1, 200]);
    let mut reply = [0; 9];
    cells[1].read(&mut reply);
    assert_eq!(replies[4..], reply.map(BusReply::Byte));
    assert_agrees(&mut array, &mut cells);
}

#[test]
fn a_stop_anywhere_drops_what_is_not_whole() {
    let bytes = |bytes: &[u8], bits: u8| {
        let mut events: Vec<BusEvent> = bytes.iter().map(|byte| BusEvent::Write(*byte)).collect();
        events.extend((bits > 0).then_some(BusEvent::Bits(bits)));
        events
    };
    for broken in [
        bytes(&[], 0),
        bytes(&[2], 0),
        bytes(&[], 3),
        bytes(&[2], 5),
        bytes(&[0x82, 1, 2, 3], 0),
        bytes(&[9, 9, 2], 0),
    ] {
        let (mut array, mut cells) = seeded(2, CellMode::Analog);
        let mut events = vec![BusEvent::Start, BusEvent::Write(8 << 1)];
        events.extend(broken);
        events.push(BusEvent::Stop);
        array.transact(&events).unwrap();
        // a START with nothing behind it, an address broken off, a STOP out of the blue
        array.transact(&[BusEvent::Start, BusEvent::Stop]).unwrap();
        let odd = [BusEvent::Start, BusEvent::Bits(7), BusEvent::Stop, BusEvent::Stop];
        array.transact(&odd).unwrap();
        assert_agrees(&mut array, &mut cells);
        array.write(8, &[1, 44]).unwrap();
        cells[0].receive(&[1, 44]);
        assert_agrees(&mut array, &mut cells);
    }
}

/// Edges run on while one cell after another is seeded anew. The others never miss one, and the new sequence of each starts
/// at one of the edges that come during its write.
#[test]
fn cells_can_be_seeded_while_clocked() {
    const CELLS: usize = 20;
    let (mut array, mut cells) = seeded(CELLS, CellMode::Analog);
    array.run_clock(CLOCK).unwrap();
    for k in 0..CELLS {
        // other phases of edge and bus for each cell
        array.idle(1e-3 + 0.7e-6 * k as f64);
        let codes = array.codes();
        assert_eq!(codes, expected(&mut cells, codes.len() / CELLS));
        let pair = CellMode::Analog.pair(200 + k as u8);
        array.write(cells[k].address(), &pair).unwrap();
        let codes = array.codes();
        let rows = codes.len() / CELLS;
        // three bytes, 27 bits and more at 2.5 µs a bit, an edge every 13.9 µs
        assert!(rows >= 4, "only {rows} edges came during a write");
        let seeded_at = |taken: usize| {
            let mut trial = cells.clone();
            let mut all = expected(&mut trial, taken);
            trial[k].receive(&pair);
            all.extend(expected(&mut trial, rows - taken));
            (all == codes).then_some(trial)
        };
        cells = (0..=rows)
            .rev()
            .find_map(seeded_at)
            .expect("a place of the seed that explains the codes");
    }
    array.stop_clock();
    let codes = array.codes();
    assert_eq!(codes, expected(&mut cells, codes.len() / CELLS));
    assert_agrees(&mut array, &mut cells);
}

/// The read-back tells a cell that lost its seed, and the cell does not drive until it has a new one.
#[test]
fn a_brown_out_while_clocked_silences_one_cell() {
    let (mut array, mut cells) = seeded(10, CellMode::Binary);
    assert_eq!(clocked(&mut array, 5), expected(&mut cells, 5));
    array.cell_mut(12).unwrap().reset(ResetCause::BrownOut);
    cells[4] = Cell::new(12).unwrap();
    let codes = clocked(&mut array, 500);
    assert_eq!(codes, expected(&mut cells, 500));
    assert!(codes.iter().skip(4).step_by(10).all(|code| *code == NEUTRAL_CODE));
    assert_eq!(state(&mut array, 12)[0], 0xff);
    assert_agrees(&mut array, &mut cells);
    array.write(12, &CellMode::Binary.pair(12)).unwrap();
    cells[4].receive(&CellMode::Binary.pair(12));
    assert_agrees(&mut array, &mut cells);
}

/// A sleeping cell: wake-up 5, response 3, jump at the vector 2, store 2. No mode is slower than another.
#[test]
fn the_dac_is_written_twelve_ticks_behind_each_edge() {
    for mode in MODES {
        let (array, _) = seeded(1, mode);
        let mut cell = array.cells()[0].clone();
        for k in 0..300 {
            cell.run_until(cell.now() + 278);
            let edge = cell.now();
            assert!(cell.is_asleep());
            cell.set_clock(k % 2 == 0);
            cell.run_until(edge + 100);
            assert_eq!(cell.dac_written_at(), edge + 12, "{mode:?}, edge {k}");
        }
    }
}

/// At a million edges a second two and more come before a cell clears its flag: it takes fewer steps than there were edges,
/// stays behind, and a new seed brings it back.
#[test]
fn edges_too_close_collapse_and_a_seed_repairs() {
    const EDGES: usize = 200;
    let (mut array, mut cells) = seeded(3, CellMode::Analog);
    let rush = Clock {
        edge_hz: 1e6,
        sample_delay_s: 0.0,
    };
    array.clock(rush, &mut vec![0; 3 * EDGES]).unwrap();
    let reached = state(&mut array, 9);
    let steps = (0..EDGES).position(|_| {
        cells[1].edge();
        spec_state(&cells[1])[..5] == reached[..5]
    });
    // some 65 cycles an edge against 20 a period: more than a quarter and less than half of the edges are seen
    let steps = steps.expect("the cell is on its own sequence") + 1;
    assert!((EDGES / 4..EDGES / 2).contains(&steps), "{steps} of {EDGES}");
    array.start(CellMode::Analog).unwrap();
    for cell in &mut cells {
        cell.receive(&CellMode::Analog.pair(cell.address()));
    }
    assert_agrees(&mut array, &mut cells);
}

/// Intel hex of `words` from address 0.
fn image(words: &[u16]) -> Image {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let mut record = vec![bytes.len() as u8, 0, 0, 0];
    record.extend(bytes);
    let sum = record.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    record.push(sum.wrapping_neg());
    let text: String = record.iter().map(|byte| format!("{byte:02X}")).collect();
    Image::from_hex(&format!(":{text}\n:00000001FF\n")).unwrap()
}

/// A program that takes its address and then never answers. Nothing hangs, and a reset frees the bus.
#[test]
fn a_cell_that_holds_the_clock_is_reported() {
    let mute = image(&[
        0x9100, 0x1400, // lds  r16, 0x1400
        0x0f00, //         lsl  r16
        0x9300, 0x081c, // sts  TWI0.SADDR, r16
        0xe001, //         ldi  r16, 0x01
        0x9300, 0x0819, // sts  TWI0.SCTRLA, r16
        0xcfff, //         rjmp .-2
    ]);
    let mut array = Array::new(2, &mute).unwrap();
    array.run_clock(CLOCK).unwrap();
    let stuck = Err(BusError::Stuck { address: 9 });
    assert_eq!(array.write(9, &[1, 2]), stuck);
    assert_eq!(array.write(50, &[]), stuck, "the bus stays blocked for all");
    assert_eq!(array.read(9, &mut [0]), stuck);
    array.cell_mut(9).unwrap().reset(ResetCause::External);
    assert_eq!(array.write(50, &[]), Err(BusError::NoAcknowledge { address: 50 }));
}

/// Two cells with the same address answer together: the bus carries the AND of what they send, and the overruled one leaves.
#[test]
fn two_cells_with_one_address_collide_without_hanging() {
    let (mut array, mut cells) = seeded(3, CellMode::Analog);
    let program = Device::program(Image::shipped().flash()).unwrap();
    let twin = array.cell_mut(10).unwrap();
    let now = twin.now();
    *twin = Device::new(program, &[9]);
    twin.run_until(now);
    let (seeded, unseeded) = (spec_state(&cells[1]), spec_state(&Cell::new(9).unwrap()));
    let mode = seeded[0] & unseeded[0];
    assert_eq!(
        mode, seeded[0],
        "the unseeded cell sends ones and is overruled at the first byte"
    );
    assert_eq!(state(&mut array, 9), seeded);
    array.write(9, &CellMode::Analog.pair(9)).unwrap();
    let codes = clocked(&mut array, 40);
    assert!(codes.chunks(3).all(|row| row[1] == row[2]), "both took the seed");
    assert_eq!(array.read(10, &mut [0]), Err(BusError::NoAcknowledge { address: 10 }));
    cells[1].receive(&CellMode::Analog.pair(9));
    let own: Vec<u8> = codes.iter().skip(1).step_by(3).copied().collect();
    assert_eq!(own, expected(&mut cells[1..2], 40));
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (mut array, _) = seeded(37, CellMode::Binary);
            let mut codes = clocked(&mut array, 100);
            array.run_clock(CLOCK).unwrap();
            array.write(20, &CellMode::Analog.pair(3)).unwrap();
            codes.extend(array.codes());
            (codes, array.instructions(), state(&mut array, 20))
        })
    };
    let one = run(1);
    for threads in [2, 3, 8] {
        assert!(run(threads) == one, "{threads} threads");
    }
}

/// A clone taken anywhere, also while clocked, goes on like the original.
#[test]
fn snapshots_go_on_identically() {
    let (mut array, _) = seeded(9, CellMode::Analog);
    array.run_clock(CLOCK).unwrap();
    array
        .transact(&[BusEvent::Start, BusEvent::Write(9 << 1), BusEvent::Write(2)])
        .unwrap();
    let mut snapshot = array.clone();
    let go_on = |array: &mut Array| {
        let rest = [BusEvent::Write(80), BusEvent::Stop];
        let replies = array.transact(&rest).unwrap();
        array.idle(3e-3);
        (replies, array.codes(), array.instructions(), state(array, 9))
    };
    assert_eq!(go_on(&mut array), go_on(&mut snapshot));
}

/// Blocks of any size are one clock: codes do not depend on how often they are fetched.
#[test]
fn blocks_continue_without_a_gap() {
    let (mut whole, mut cells) = seeded(5, CellMode::Binary);
    let mut blocks = whole.clone();
    let all = clocked(&mut whole, 1000);
    assert_eq!(all, expected(&mut cells, 1000));
    let pieces: Vec<u8> = [1, 2, 0, 97, 900]
        .into_iter()
        .flat_map(|n| clocked(&mut blocks, n))
        .collect();
    assert_eq!(pieces, all);
    assert_eq!(whole.instructions(), blocks.instructions());
}
