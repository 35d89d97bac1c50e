//! Cells that something is wrong with stay out of the way, and can be told.

use spts_firmware::attiny412::Device;
use spts_firmware::{Array, BusEvent, BusReply, CellMode, FIRST_ADDRESS, Image, NEUTRAL_CODE, REPLY_BYTES};

use crate::build::{Substitution, changed, compiler};
use crate::conformance::FAST;

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
    let timer = Substitution {
        file: "main.c",
        from: "SLPCTRL_CTRLA = SLPCTRL_SEN;",
        to: "SLPCTRL_CTRLA = SLPCTRL_SEN; TCA0_INTCTRL = TCA_OVF; TCA0_CTRLA = TCA_ENABLE;",
    };
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
