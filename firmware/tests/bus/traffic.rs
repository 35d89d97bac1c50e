//! What a master can say.

use spts_firmware::attiny412::{Device, ResetCause};
use spts_firmware::{Array, BusEvent, BusReply, Cell, CellMode, Image};

use crate::helpers::{CLOCK, assert_agrees, clocked, expected, said, seeded, spec_state, state};

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
        // bytes out of step, and a read without an address
        let mut odd = vec![BusEvent::Start, BusEvent::Write(8 << 1), BusEvent::Bits(1)];
        odd.extend([2, 9].map(BusEvent::Write));
        odd.extend([BusEvent::Start, BusEvent::Read { acknowledge: true }, BusEvent::Stop]);
        let replies = array.transact(&odd).unwrap();
        assert_eq!(replies[1..3], [BusReply::Acknowledged(false); 2]);
        assert_eq!(replies[3], BusReply::Byte(0xff));
        assert_agrees(&mut array, &mut cells);
        array.write(8, &[1, 44]).unwrap();
        cells[0].receive(&[1, 44]);
        assert_agrees(&mut array, &mut cells);
    }
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
    array.run_clock(CLOCK).unwrap();
    let stuck = "the cell at address 9 has held the bus clock low for 25 ms";
    assert_eq!(said(array.write(9, &[1, 2])), stuck);
    assert_eq!(said(array.write(50, &[])), stuck, "the bus stays blocked for all");
    assert_eq!(said(array.read(9, &mut [0])), stuck);
    array.cell_mut(9).unwrap().reset(ResetCause::External);
    assert_eq!(said(array.write(50, &[])), "no cell acknowledges address 50");
}

/// A program that gathers in SRAM every flag that TWI0.SSTATUS ever shows.
#[test]
fn an_illegal_stop_is_a_bus_error() {
    const BUSERR: u8 = 0x04;
    let watch = image(&[
        0xe001, //         ldi  r16, 0x01
        0x9300, 0x0819, // sts  TWI0.SCTRLA, r16
        0x2711, //         clr  r17
        0x9100, 0x081b, // lds  r16, TWI0.SSTATUS
        0x2b10, //         or   r17, r16
        0x9310, 0x3f00, // sts  0x3f00, r17
        0xcffa, //         rjmp .-12
    ]);
    for (events, is_error) in [
        (&[BusEvent::Start, BusEvent::Write(50 << 1), BusEvent::Stop][..], false),
        (&[BusEvent::Start, BusEvent::Stop], true),
        (
            &[
                BusEvent::Start,
                BusEvent::Write(50 << 1),
                BusEvent::Bits(3),
                BusEvent::Stop,
            ],
            true,
        ),
    ] {
        let mut array = Array::new(1, &watch).unwrap();
        array.transact(events).unwrap();
        array.idle(1e-3).unwrap();
        assert_eq!(array.cells()[0].sram()[0] & BUSERR != 0, is_error, "{events:?}");
    }
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
    assert_eq!(
        mode, seeded[0],
        "the unseeded cell sends ones and is overruled at the first byte"
    );
    assert_eq!(state(&mut array, 9), seeded);
    array.write(9, &CellMode::Analog.pair(9)).unwrap();
    let codes = clocked(&mut array, 40);
    assert!(codes.chunks(3).all(|row| row[1] == row[2]), "both took the seed");
    assert_eq!(said(array.read(10, &mut [0])), "no cell acknowledges address 10");
    cells[1].receive(&CellMode::Analog.pair(9));
    let own: Vec<u8> = codes.iter().skip(1).step_by(3).copied().collect();
    assert_eq!(own, expected(&mut cells[1..2], 40));
}
