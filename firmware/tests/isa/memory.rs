//! Loads, stores, stack, I/O and program memory.

use crate::asm::{self, displaced, io, io_bit, one};
use crate::machine::{Machine, RAM_END};
use spts_firmware::avr::Program;
use spts_firmware::avr::sreg::{I, Z};

const X: usize = 26;
const Y: usize = 28;
const POINTER_Z: usize = 30;

/// Machine with `address` in the pointer.
fn pointing(words: &[u16], pointer: usize, address: u16) -> Machine {
    let [low, high] = address.to_le_bytes();
    Machine::new(words).with(&[(pointer, low), (pointer + 1, high)])
}

/// (load, store, pointer, change before the access, change after it).
const INDIRECT: [(u16, u16, usize, i16, i16); 9] = [
    (asm::LD_X, asm::ST_X, X, 0, 0),
    (asm::LD_X_INC, asm::ST_X_INC, X, 0, 1),
    (asm::LD_X_DEC, asm::ST_X_DEC, X, -1, 0),
    (asm::LDD_Y, asm::STD_Y, Y, 0, 0),
    (asm::LD_Y_INC, asm::ST_Y_INC, Y, 0, 1),
    (asm::LD_Y_DEC, asm::ST_Y_DEC, Y, -1, 0),
    (asm::LDD_Z, asm::STD_Z, POINTER_Z, 0, 0),
    (asm::LD_Z_INC, asm::ST_Z_INC, POINTER_Z, 0, 1),
    (asm::LD_Z_DEC, asm::ST_Z_DEC, POINTER_Z, -1, 0),
];

/// Also where the low byte of the pointer carries, and where it wraps at 64 KiB.
#[test]
fn indirect_accesses_step_the_pointer() {
    for start in [0x3F10, 0x3F00, 0x3EFF, 0x0000, 0xFFFF] {
        for (load, store, pointer, before, after) in INDIRECT {
            let address = u16::wrapping_add_signed(start, before);
            let end = address.wrapping_add_signed(after);
            let loaded = pointing(&[one(load, 5)], pointer, start)
                .with_memory(address, &[0xA7])
                .after(1);
            assert_eq!((loaded.register(5), loaded.pair(pointer)), (0xA7, end), "{load:#06x}");
            let stored = pointing(&[one(store, 5)], pointer, start).with(&[(5, 0x7A)]).after(1);
            assert_eq!(
                (stored.memory.byte(address), stored.pair(pointer)),
                (0x7A, end),
                "{store:#06x}"
            );
        }
    }
}

#[test]
fn every_displacement() {
    for q in 0..64 {
        for (load, store, pointer) in [(asm::LDD_Y, asm::STD_Y, Y), (asm::LDD_Z, asm::STD_Z, POINTER_Z)] {
            for start in [0x3F31, 0xFFF0] {
                let address = u16::wrapping_add(start, q);
                let loaded = pointing(&[displaced(load, 31 - 8, q)], pointer, start)
                    .with_memory(address, &[0x5C])
                    .after(1);
                assert_eq!((loaded.register(23), loaded.pair(pointer)), (0x5C, start));
                let stored = pointing(&[displaced(store, 4, q)], pointer, start)
                    .with(&[(4, 0xC5)])
                    .after(1);
                assert_eq!((stored.memory.byte(address), stored.pair(pointer)), (0xC5, start));
            }
        }
    }
}

/// The register file is not in the data space of AVRxt: address 0 is the first I/O register.
#[test]
fn registers_have_no_address() {
    let machine = Machine::new(&[one(asm::STS, 7), 0x0005]).with(&[(7, 0x99)]).after(1);
    assert_eq!((machine.register(5), machine.memory.byte(5)), (0, 0x99));
}

#[test]
fn direct_accesses() {
    for address in [0x0000, 0x0810, 0x3F80, 0xFFFF] {
        let loaded = Machine::new(&[one(asm::LDS, 9), address])
            .with_memory(address, &[0x42])
            .after(1);
        assert_eq!(
            (loaded.register(9), loaded.core.pc),
            (0x42, 0),
            "wraps behind two words"
        );
    }
}

/// Push stores, then decrements; pop increments, then loads.
#[test]
fn stack() {
    let mut machine = Machine::new(&[one(asm::PUSH, 1), one(asm::PUSH, 2), one(asm::POP, 3), one(asm::POP, 4)])
        .with(&[(1, 0x11), (2, 0x22)]);
    machine.run(2);
    assert_eq!(machine.core.sp, RAM_END - 2);
    assert_eq!(machine.memory.bytes(RAM_END - 1..=RAM_END), [0x22, 0x11]);
    machine.run(2);
    assert_eq!(
        (machine.core.sp, machine.register(3), machine.register(4)),
        (RAM_END, 0x22, 0x11)
    );
}

/// SPL, SPH and SREG through IN, OUT, LDS, STS and a pointer.
#[test]
fn own_registers_are_mapped() {
    let mut machine = Machine::new(&[
        io(asm::OUT, 1, 0x3D),
        one(asm::STS, 2),
        0x003E,
        io(asm::IN, 3, 0x3D),
        one(asm::LDS, 4),
        0x003E,
        one(asm::ST_X, 5),
        io(asm::IN, 6, 0x3F),
    ])
    .with(&[(1, 0x12), (2, 0x34), (5, 0x7E), (X, 0x3F)]);
    machine.run(4);
    assert_eq!(machine.core.sp, 0x3412);
    assert_eq!((machine.register(3), machine.register(4)), (0x12, 0x34));
    machine.run(2);
    assert_eq!((machine.core.sreg, machine.register(6)), (0x7E, 0x7E));
}

#[test]
fn every_io_address() {
    for a in (0..0x40).filter(|a| !(0x3D..0x40).contains(a)) {
        let read = Machine::new(&[io(asm::IN, 30, a)]).with_memory(a, &[0x6B]).after(1);
        assert_eq!(read.register(30), 0x6B);
        let written = Machine::new(&[io(asm::OUT, 17, a)]).with(&[(17, 0xB6)]).after(1);
        assert_eq!(written.memory.byte(a), 0xB6);
    }
    for a in 0..0x20 {
        for bit in 0..8 {
            let set = Machine::new(&[io_bit(asm::SBI, a, bit)]).after(1);
            assert_eq!(set.memory.byte(a), 1 << bit);
            let clear = Machine::new(&[io_bit(asm::CBI, a, bit)])
                .with_memory(a, &[0xFF])
                .after(1);
            assert_eq!(clear.memory.byte(a), !(1 << bit));
        }
    }
}

/// LPM in its three forms; addresses wrap at the end of flash.
#[test]
fn program_memory() {
    let words = [asm::LPM, one(asm::LPM_Z, 5), one(asm::LPM_Z_INC, 6), 0xBEEF];
    for (address, byte) in [(6, 0xEF), (7, 0xBE), (8 + 6, 0xEF), (8 + 2, 0x54)] {
        let machine = pointing(&words, POINTER_Z, address).after(3);
        let got = [0, 5, 6].map(|k| machine.register(k));
        assert_eq!((got, machine.pair(POINTER_Z)), ([byte; 3], address + 1));
    }
}

/// The second word of an instruction at the end of flash is the first of flash.
#[test]
fn instructions_wrap() {
    let mut machine = Machine::new(&[0x3F80, one(asm::LDS, 9)]).with_memory(0x3F80, &[0x77]);
    machine.core.pc = 1;
    machine.run(1);
    assert_eq!((machine.register(9), machine.core.pc), (0x77, 1));
}

#[test]
fn flash_is_a_power_of_two() {
    assert_eq!(Program::new(&[1, 2, 3], 4096).unwrap().byte(3), 0xFF, "erased");
    for flash_bytes in [0, 1, 3, 1000, 262_144] {
        let error = Program::new(&[], flash_bytes).unwrap_err().to_string();
        assert!(error.contains(&format!("flash has {flash_bytes} bytes")), "{error}");
    }
    let error = Program::new(&[0; 9], 8).unwrap_err().to_string();
    assert_eq!(error, "program has 9 bytes, but flash has 8");
    assert_eq!(Program::new(&[], 131_072).unwrap().words(), 65_536);
}

/// Memory accesses leave the flags alone.
#[test]
fn flags_survive() {
    for opcode in [one(asm::LD_X, 5), one(asm::ST_X, 5), one(asm::POP, 5), asm::LPM] {
        for sreg in [0, !(I | Z), 0xFF] {
            assert_eq!(Machine::new(&[opcode]).with_sreg(sreg).after(1).core.sreg, sreg);
        }
    }
}
