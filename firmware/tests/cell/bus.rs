//! Emulated cells on their bus and clock: whatever a master does, each cell ends where the behavioural cell says it
//! should; and cells that something is wrong with stay out of the way, and can be told.

use crate::build::{Substitution, changed, compiler};
use crate::conformance::FAST;
use spts_firmware::attiny412::Device;
use spts_firmware::{
    Array, BusEvent, BusReply, Cell, CellMode, Clock, FIRST_ADDRESS, Image, NEUTRAL_CODE, REPLY_BYTES,
};

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
    array.clock(FAST, &mut codes).unwrap();
    codes
}

fn expected(cells: &mut [Cell], edges: usize) -> Vec<u8> {
    (0..edges).flat_map(|_| cells.iter_mut().map(Cell::edge).collect::<Vec<_>>()).collect()
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
        assert_eq!(state(array, cell.address()), spec_state(cell), "read-back of {}", cell.address());
    }
    for cell in array.cells() {
        assert_eq!(cell.faults().first(), None);
    }
}

/// The message of what was refused.
fn said<T: std::fmt::Debug>(result: Result<T, spts_input::Refusal>) -> String {
    result.unwrap_err().to_string()
}

#[test]
fn sizes_out_of_range_are_refused() {
    for cells in [0, 113] {
        let needed = format!("{cells} cells do not fit on one bus; the range is [1, 112]");
        assert_eq!(said(Array::new(cells, &Image::shipped())), needed);
    }
    let (mut array, _) = seeded(3, CellMode::Raster);
    let needed = "`codes` has 4 entries, which is no multiple of the 3 cells";
    assert_eq!(said(array.clock(FAST, &mut [0; 4])), needed);
    assert_eq!(said(array.start_with_seeds(CellMode::Binary, &[1, 2])), "2 seeds for 3 cells");
    for time_s in [-1e-9, 86_401.0, f64::INFINITY, f64::NAN] {
        assert_eq!(said(array.idle(time_s)), format!("`time_s` = {time_s} is outside [0, 86400] s"));
    }
    let late = Clock { sample_delay_s: 14e-6, ..FAST };
    let needed = "`sample_delay_s` = 0.000014 is outside [0, 1/edge_hz) in whole ticks of 50 ns";
    assert_eq!(said(array.clock(late, &mut [0; 3])), needed);
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (mut array, _) = seeded(37, CellMode::Binary);
            let mut codes = clocked(&mut array, 100);
            array.run_clock(FAST).unwrap();
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
    array.run_clock(FAST).unwrap();
    array.transact(&[BusEvent::Start, BusEvent::Write(9 << 1), BusEvent::Write(2)]).unwrap();
    let mut snapshot = array.clone();
    let go_on = |array: &mut Array| {
        let rest = [BusEvent::Write(80), BusEvent::Stop];
        let replies = array.transact(&rest).unwrap();
        array.idle(3e-3).unwrap();
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
    let pieces: Vec<u8> = [1, 2, 0, 97, 900].into_iter().flat_map(|n| clocked(&mut blocks, n)).collect();
    assert_eq!(pieces, all);
    assert_eq!(whole.instructions(), blocks.instructions());
}

#[test]
fn a_foreign_address_is_heard_by_all_and_taken_by_none() {
    let (mut array, mut cells) = seeded(3, CellMode::Analog);
    for address in (0..128).filter(|a| !(8..11).contains(a)) {
        let silence = format!("no cell acknowledges address {address}");
        assert_eq!(said(array.write(address, &[2, 77])), silence);
        assert_eq!(said(array.read(address, &mut [0])), silence);
    }
    // a master that talks on although nobody answers
    let mut events = vec![BusEvent::Start];
    events.extend([50 << 1, 2, 8].map(BusEvent::Write));
    events.push(BusEvent::Stop);
    assert_eq!(array.transact(&events).unwrap(), [BusReply::Acknowledged(false); 3]);
    assert_eq!(said(array.write(136, &[2, 77])), "bus address 136 is outside [0, 127]");
    for bits in [0, 8, u8::MAX] {
        let events = [BusEvent::Start, BusEvent::Bits(bits), BusEvent::Stop];
        let odd = format!("`bits` = {bits} of an incomplete byte is outside [1, 7]");
        assert_eq!(said(array.transact(&events)), odd);
    }
    assert_agrees(&mut array, &mut cells);
}

/// START, three bytes of nine bits, STOP and the free time are 30 bits of 2.5 µs; cells hold the clock for less than 6
/// µs a byte while they answer.
#[test]
fn a_session_starts_at_the_speed_of_the_bus() {
    let mut array = Array::new(100, &Image::shipped()).unwrap();
    let start_s = array.time_s();
    array.start(CellMode::Binary).unwrap();
    let write_s = (array.time_s() - start_s) / 100.0;
    assert!((75e-6..75e-6 + 3.0 * 6e-6).contains(&write_s), "{write_s} s");
}

/// Intel hex of `words` from address 0.
fn image(words: &[u16]) -> Image {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let mut record = vec![u8::try_from(bytes.len()).unwrap(), 0, 0, 0];
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
    array.run_clock(FAST).unwrap();
    let stuck = "the cell at address 9 has held the bus clock low for 25 ms";
    assert_eq!(said(array.write(9, &[1, 2])), stuck);
    assert_eq!(said(array.write(50, &[])), stuck, "the bus stays blocked for all");
    assert_eq!(said(array.read(9, &mut [0])), stuck);
    array.cell_mut(9).unwrap().reset();
    assert_eq!(said(array.write(50, &[])), "no cell acknowledges address 50");
}

/// Two cells with the same address answer together: the bus carries the AND of what they send, and the overruled one
/// leaves.
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
    assert_eq!(mode, seeded[0], "the unseeded cell sends ones and is overruled at the first byte");
    assert_eq!(state(&mut array, 9), seeded);
    array.write(9, &CellMode::Analog.pair(9)).unwrap();
    let codes = clocked(&mut array, 40);
    assert!(codes.chunks(3).all(|row| row[1] == row[2]), "both took the seed");
    assert_eq!(said(array.read(10, &mut [0])), "no cell acknowledges address 10");
    cells[1].receive(&CellMode::Analog.pair(9));
    let own: Vec<u8> = codes.iter().skip(1).step_by(3).copied().collect();
    assert_eq!(own, expected(&mut cells[1..2], 40));
}

/// An array of one cell with `eeprom` in place of its address.
fn cell_with(image: &Image, eeprom: &[u8]) -> Array {
    let mut array = Array::new(1, image).unwrap();
    let program = Device::program(image.flash()).unwrap();
    *array.cell_mut(FIRST_ADDRESS).unwrap() = Device::new(program, eeprom);
    array.idle(1e-3).unwrap();
    array
}

/// Addresses of the bus that are acknowledged.
fn answered(array: &mut Array) -> Vec<u8> {
    let mut acknowledges = |address: u8| {
        let replies = array.transact(&[BusEvent::Start, BusEvent::Write(address << 1), BusEvent::Stop]);
        replies.unwrap() == [BusReply::Acknowledged(true)]
    };
    (0..128).filter(|address| acknowledges(*address)).collect()
}

#[test]
fn only_a_cell_with_an_address_of_its_own_answers() {
    for image in [Image::shipped(), Image::plain()] {
        for address in [8, 9, 107, 119] {
            assert_eq!(answered(&mut cell_with(&image, &[address])), [address]);
        }
        // 136 is 8 with the bit that a bus address does not have; an erased EEPROM is 255
        for eeprom in [&[0][..], &[7], &[120], &[136], &[]] {
            let mut array = cell_with(&image, eeprom);
            assert!(answered(&mut array).is_empty(), "{eeprom:?}");
            let mut codes = [0; 50];
            array.clock(FAST, &mut codes).unwrap();
            assert_eq!(codes, [NEUTRAL_CODE; 50]);
            assert_eq!(array.cells()[0].dac_output(), Some(NEUTRAL_CODE), "mid-scale is driven");
        }
    }
}

/// The timer's interrupt, which the shipped image has no handler for, comes 65536 cycles behind the start.
#[test]
fn an_interrupt_without_a_handler_leaves_the_cell_unseeded() {
    if compiler().is_none() {
        return;
    }
    let timer = Substitution::new(
        "main.c",
        "SLPCTRL_CTRLA = SLPCTRL_SEN;",
        "SLPCTRL_CTRLA = SLPCTRL_SEN; TCA0_INTCTRL = TCA_OVF; TCA0_CTRLA = TCA_ENABLE;",
    );
    let mut array = Array::new(1, &changed("cell", &timer)).unwrap();
    let mode = |array: &mut Array| {
        let mut reply = [0; REPLY_BYTES];
        array.read(FIRST_ADDRESS, &mut reply).unwrap();
        reply[0]
    };
    array.start(CellMode::Analog).unwrap();
    assert_eq!(mode(&mut array), CellMode::Analog.byte());
    array.idle(4e-3).unwrap();
    assert_eq!(mode(&mut array), 255);
    assert_eq!(array.cells()[0].dac_output(), Some(NEUTRAL_CODE));
}
