//! Any bus traffic: the images and the behavioural cell agree on acknowledgements, replies and codes.

use proptest::prelude::*;
use spts_firmware::attiny412::ResetCause;
use spts_firmware::{BusEvent, BusReply, Cell, Clock, FIRST_ADDRESS, Image};

use crate::conformance::{Difference, FAST, SLOW, Twins};

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
    twins.array.cell_mut(address).unwrap().reset(ResetCause::BrownOut);
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
    if replies == expected {
        Ok(())
    } else {
        Err(format!("{events:?}: {replies:?}, not {expected:?}"))
    }
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
