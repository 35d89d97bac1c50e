//! What the random programs of [`oracle`](crate::oracle) do not reach, worked out by hand from DS40002198: ends of the
//! memories, skips, interrupts, events, cycles.

use crate::asm::{self, bit, branch, displaced, flag, fractional, io, io_bit, movw, muls, one, relative, rk, rr, word};
use crate::machine::{Machine, RAM_END};
use spts_firmware::avr::sreg::I;
use spts_firmware::avr::{Event, INTERRUPT_ENTRY_CYCLES, Program};

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

/// LPM in its three forms; addresses wrap at the end of flash, which is a power of two.
#[test]
fn program_memory() {
    let words = [asm::LPM, one(asm::LPM_Z, 5), one(asm::LPM_Z_INC, 6), 0xBEEF];
    for (address, byte) in [(6, 0xEF), (7, 0xBE), (8 + 6, 0xEF), (8 + 2, 0x54)] {
        let machine = pointing(&words, POINTER_Z, address).after(3);
        let got = [0, 5, 6].map(|k| machine.register(k));
        assert_eq!((got, machine.pair(POINTER_Z)), ([byte; 3], address + 1));
    }
    assert_eq!(Program::new(&[1, 2, 3], 4096).unwrap().byte(3), 0xFF, "erased");
    for flash_bytes in [0, 1, 3, 1000, 262_144] {
        let error = Program::new(&[], flash_bytes).unwrap_err().to_string();
        assert!(error.contains(&format!("flash has {flash_bytes} bytes")), "{error}");
    }
    let error = Program::new(&[0; 9], 8).unwrap_err().to_string();
    assert_eq!(error, "program has 9 bytes, but flash has 8");
    assert_eq!(Program::new(&[], 131_072).unwrap().words(), 65_536);
}

/// `word` at word address 0x100 of a 4 KiB flash of NOPs.
fn in_flash(words: &[u16]) -> Machine {
    let mut flash = vec![asm::NOP; 2048];
    flash[0x100..0x100 + words.len()].copy_from_slice(words);
    let mut machine = Machine::new(&flash);
    machine.core.pc = 0x100;
    machine
}

/// Skips go over one instruction, be it one word or two.
#[test]
fn skips() {
    // (instruction, r16, r17 and I/O register 3, whether it skips)
    let cases = [
        (rr(asm::CPSE, 16, 17), 5, 5, true),
        (rr(asm::CPSE, 16, 17), 5, 6, false),
        (bit(asm::SBRC, 16, 3), 0xF7, 0, true),
        (bit(asm::SBRC, 16, 3), 0x08, 0, false),
        (bit(asm::SBRS, 16, 7), 0x80, 0, true),
        (bit(asm::SBRS, 16, 7), 0x7F, 0, false),
        (io_bit(asm::SBIC, 3, 0), 0, 0xFE, true),
        (io_bit(asm::SBIC, 3, 0), 0, 0x01, false),
        (io_bit(asm::SBIS, 3, 5), 0, 0x20, true),
        (io_bit(asm::SBIS, 3, 5), 0, 0xDF, false),
    ];
    let (lds, sts) = ([one(asm::LDS, 20), 0x3F00], [one(asm::STS, 20), 0x3F00]);
    let skipped: [&[u16]; 6] = [&[asm::NOP], &[asm::RET], &[asm::JMP, 0x300], &[asm::CALL, 0x300], &lds, &sts];
    for (opcode, a, b, skips) in cases {
        for next in skipped {
            let words = [&[opcode], next].concat();
            let mut machine = in_flash(&words).with(&[(16, a), (17, b)]).with_memory(3, &[b]).with_sreg(0x5A);
            let cycles = machine.run(1);
            let length = if skips { next.len() } else { 0 };
            assert_eq!(usize::from(machine.core.pc), 0x101 + length, "{opcode:#06x}");
            assert_eq!((cycles as usize, machine.core.sreg), (1 + length, 0x5A));
        }
    }
}

/// On AVRxt an interrupt stores the program counter and nothing else, and RETI leaves the I flag alone.
#[test]
fn interrupts_leave_the_flag_alone() {
    for sreg in [0x80, 0xFF, 0x00] {
        let mut machine = in_flash(&[asm::NOP]).with_sreg(sreg);
        let cycles = machine.core.interrupt(19, &mut machine.memory);
        assert_eq!(cycles, INTERRUPT_ENTRY_CYCLES);
        let core = &machine.core;
        assert_eq!((core.pc, core.sreg, core.sp), (19, sreg, RAM_END - 2));
        let mut handler = in_flash(&[asm::RETI]).with_sreg(sreg);
        handler.memory = machine.memory.clone();
        handler.core.sp = machine.core.sp;
        assert_eq!(handler.step().event, Event::Reti);
        let core = &handler.core;
        assert_eq!((core.pc, core.sreg, core.sp), (0x100, sreg, RAM_END));
        assert!(!core.interrupts_enabled(), "one instruction of the program first");
    }
}

/// SEI takes effect behind the following instruction, so that `sei; sleep` loses no interrupt. A write to SPL holds
/// back interrupts for four instructions or until I/O memory is written.
#[test]
fn interrupts_are_held_back_behind_sei_and_spl() {
    let enabled = |sreg: u8, words: &[u16]| {
        let mut machine = in_flash(words).with(&[(1, 0x3F)]).with_sreg(sreg);
        let mut step = |_| {
            machine.step();
            machine.core.interrupts_enabled()
        };
        (0..words.len()).map(&mut step).collect::<Vec<_>>()
    };
    assert_eq!(enabled(0, &[asm::SEI, asm::SLEEP, asm::SEI, asm::CLI]), [false, true, true, false]);
    let (spl, sph) = (io(asm::OUT, 1, 0x3D), io(asm::OUT, 1, 0x3E));
    let waiting = enabled(I, &[spl, asm::NOP, asm::NOP, asm::NOP, asm::NOP]);
    assert_eq!(waiting, [false, false, false, false, true]);
    assert_eq!(enabled(I, &[spl, asm::NOP, sph]), [false, false, true]);
    assert_eq!(enabled(I, &[spl, io_bit(asm::SBI, 4, 0)]), [false, true]);
}

/// Also of what is not executed: SPM, ELPM, EIJMP, XCH, an unassigned word, erased flash.
#[test]
fn events() {
    let illegal = [0x95E8, 0x95D8, 0x9419, 0x9204, 0x0001, 0xFFFF].map(|word| (word, Event::Illegal));
    let own = [(asm::NOP, Event::None), (asm::SLEEP, Event::Sleep), (asm::BREAK, Event::Break)];
    let own = own.into_iter().chain([(asm::WDR, Event::WatchdogReset)]);
    for (word, event) in own.chain(illegal) {
        let mut machine = in_flash(&[word]);
        let before = machine.core.clone();
        let step = machine.step();
        assert_eq!((step.cycles, step.event), (1, event), "{word:#06x}");
        let core = &machine.core;
        assert_eq!((core.pc, core.instructions), (0x101, before.instructions + 1));
        assert_eq!((core.registers, core.sreg, core.sp), (before.registers, before.sreg, before.sp));
    }
}

/// Cycles of every instruction: DS40002198, column AVRxt of the "Instruction Set Summary", 16-bit program counter; with
/// Z = 0x0002 and all else zero.
#[test]
fn cycles() {
    let all = |cycles: u32, opcodes: &[u16]| {
        for opcode in opcodes {
            // the second word of those that have two
            let mut machine = Machine::new(&[*opcode, 0x3F00]).with(&[(30, 2)]);
            assert_eq!(machine.step().cycles, cycles, "{opcode:#06x}");
        }
    };
    all(1, &asm::TWO_REGISTERS.map(|base| if base == asm::MUL { asm::NOP } else { rr(base, 3, 4) }));
    all(1, &asm::IMMEDIATES.map(|base| rk(base, 20, 4)));
    all(1, &asm::ONE_REGISTER.map(|base| one(base, 3)));
    all(2, &asm::FRACTIONAL.map(|base| fractional(base, 17, 18)));
    all(2, &[rr(asm::MUL, 3, 4), word(asm::ADIW, 24, 1), word(asm::SBIW, 24, 1), muls(17, 18)]);
    all(1, &[movw(2, 4), bit(asm::BST, 3, 4), bit(asm::BLD, 3, 4), flag(asm::BSET, 3), flag(asm::BCLR, 3)]);
    all(2, &INDIRECT.map(|(load, ..)| one(load, 3)));
    all(1, &INDIRECT.map(|(_, store, ..)| one(store, 3)));
    all(2, &[one(asm::POP, 3), displaced(asm::LDD_Y, 3, 5), displaced(asm::LDD_Z, 3, 5)]);
    all(1, &[one(asm::PUSH, 3), displaced(asm::STD_Y, 3, 5), displaced(asm::STD_Z, 3, 5)]);
    all(3, &[one(asm::LDS, 3), asm::LPM, one(asm::LPM_Z, 3), one(asm::LPM_Z_INC, 3)]);
    all(2, &[one(asm::STS, 3)]);
    all(1, &[io(asm::IN, 3, 4), io(asm::OUT, 3, 4), io_bit(asm::SBI, 3, 4), io_bit(asm::CBI, 3, 4)]);
    all(2, &[relative(asm::RJMP, 1), asm::IJMP, relative(asm::RCALL, 1), asm::ICALL]);
    all(3, &[asm::JMP, asm::CALL]);
    all(4, &[asm::RET, asm::RETI]);
    // a branch that is not taken, and one that is
    all(1, &[branch(asm::BRBS, 1, 4)]);
    all(2, &[branch(asm::BRBC, 1, 4)]);
    all(1, &[asm::NOP, asm::SLEEP, asm::BREAK, asm::WDR, asm::SEI, asm::CLI]);
}

/// Changing the I flag through its I/O register costs one wait state (datasheet, CPU.SREG).
#[test]
fn the_interrupt_flag_has_a_wait_state() {
    for (before, value, cycles) in [(0, I, 2), (I, 0, 2), (I, I | 1, 1), (0, 1, 1)] {
        for (words, more) in [([io(asm::OUT, 5, 0x3F), 0], 0), ([one(asm::STS, 5), 0x3F], 1)] {
            let mut machine = Machine::new(&words).with(&[(5, value)]).with_sreg(before);
            assert_eq!(machine.run(1), cycles + more);
        }
    }
}
