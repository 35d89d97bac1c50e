//! Jumps, calls, branches, skips, interrupts and events.

use crate::asm::{self, bit, branch, flag, io, io_bit, one, relative, rr};
use crate::machine::{Machine, RAM_END};
use spts_firmware::avr::sreg::I;
use spts_firmware::avr::{Event, INTERRUPT_ENTRY_CYCLES};

/// `word` at word address 0x100 of a 4 KiB flash of NOPs.
fn in_flash(words: &[u16]) -> Machine {
    let mut flash = vec![asm::NOP; 2048];
    flash[0x100..0x100 + words.len()].copy_from_slice(words);
    let mut machine = Machine::new(&flash);
    machine.core.pc = 0x100;
    machine
}

#[test]
fn every_branch_goes_only_if_its_flag_is_so() {
    for s in 0..8 {
        for (base, taken_if_set) in [(asm::BRBS, true), (asm::BRBC, false)] {
            for offset in [-64, -1, 0, 1, 63] {
                for set in [true, false] {
                    let sreg = if set { 1 << s } else { !(1 << s) };
                    let machine = in_flash(&[branch(base, s, offset)]).with_sreg(sreg).after(1);
                    let expected = if set == taken_if_set { 0x101 + offset } else { 0x101 };
                    assert_eq!(i32::from(machine.core.pc), i32::from(expected), "{s}, {offset}");
                    assert_eq!(machine.core.sreg, sreg);
                }
            }
        }
    }
}

/// In 4 KiB, relative jumps reach everywhere by wrapping.
#[test]
fn jumps() {
    let go = |words: &[u16]| in_flash(words).with(&[(30, 0x21), (31, 0x03)]).after(1).core.pc;
    assert_eq!(go(&[relative(asm::RJMP, -1)]), 0x100);
    assert_eq!(go(&[relative(asm::RJMP, 2047)]), 0x100);
    assert_eq!(go(&[relative(asm::RJMP, -0x102)]), 0x7FF);
    assert_eq!(go(&[relative(asm::RJMP, -2048)]), 0x101);
    assert_eq!(go(&[asm::IJMP]), 0x321);
    assert_eq!(go(&[asm::JMP, 0x456]), 0x456);
    assert_eq!(go(&[asm::JMP, 0x1456]), 0x456, "the program counter has 11 bits");
}

/// The address behind the call is stored, low byte at the higher address; RET goes there.
#[test]
fn calls_return_behind_themselves() {
    let calls: [(&[u16], u16); 3] = [
        (&[relative(asm::RCALL, 0x10)], 0x101),
        (&[asm::ICALL], 0x101),
        (&[asm::CALL, 0x111], 0x102),
    ];
    for (words, back) in calls {
        let mut flash = in_flash(words).with(&[(30, 0x11), (31, 0x01)]);
        flash.run(1);
        assert_eq!((flash.core.pc, flash.core.sp), (0x111, RAM_END - 2));
        let [low, high] = back.to_le_bytes();
        assert_eq!(flash.memory.bytes(RAM_END - 1..=RAM_END), [high, low]);

        let mut returning = in_flash(&[asm::RET]);
        returning.memory = flash.memory.clone();
        returning.core.sp = flash.core.sp;
        returning.run(1);
        assert_eq!((returning.core.pc, returning.core.sp), (back, RAM_END));
    }
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
    let skipped: [&[u16]; 6] = [
        &[asm::NOP],
        &[asm::RET],
        &[asm::JMP, 0x300],
        &[asm::CALL, 0x300],
        &[one(asm::LDS, 20), 0x3F00],
        &[one(asm::STS, 20), 0x3F00],
    ];
    for (opcode, a, b, skips) in cases {
        for next in skipped {
            let mut words = vec![opcode];
            words.extend(next);
            let mut machine = in_flash(&words)
                .with(&[(16, a), (17, b)])
                .with_memory(3, &[b])
                .with_sreg(0x5A);
            let cycles = machine.run(1);
            let length = if skips { next.len() } else { 0 };
            assert_eq!(usize::from(machine.core.pc), 0x101 + length, "{opcode:#06x}");
            assert_eq!(cycles as usize, 1 + length);
            assert_eq!(machine.core.sreg, 0x5A);
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
        assert_eq!(
            (handler.core.pc, handler.core.sreg, handler.core.sp),
            (0x100, sreg, RAM_END)
        );
        assert!(
            !handler.core.interrupts_enabled(),
            "one instruction of the program first"
        );
    }
}

/// SEI takes effect behind the following instruction, so that `sei; sleep` loses no interrupt.
#[test]
fn interrupts_are_held_back_behind_sei() {
    let mut machine = in_flash(&[asm::SEI, asm::SLEEP, asm::SEI, asm::CLI]);
    let mut enabled = || {
        machine.step();
        machine.core.interrupts_enabled()
    };
    assert_eq!([enabled(), enabled(), enabled(), enabled()], [false, true, true, false]);
}

/// A write to SPL holds back interrupts for four instructions or until I/O memory is written.
#[test]
fn interrupts_are_held_back_behind_spl() {
    let held = |words: &[u16]| {
        let mut machine = in_flash(words).with(&[(1, 0x3F)]).with_sreg(I);
        (0..words.len())
            .map(|_| {
                machine.step();
                machine.core.interrupts_enabled()
            })
            .collect::<Vec<_>>()
    };
    let spl = io(asm::OUT, 1, 0x3D);
    let sph = io(asm::OUT, 1, 0x3E);
    let waiting = held(&[spl, asm::NOP, asm::NOP, asm::NOP, asm::NOP]);
    assert_eq!(waiting, [false, false, false, false, true]);
    assert_eq!(held(&[spl, asm::NOP, sph]), [false, false, true]);
    assert_eq!(held(&[spl, io_bit(asm::SBI, 4, 0)]), [false, true]);
}

#[test]
fn events() {
    let cases = [
        (asm::NOP, Event::None),
        (asm::SLEEP, Event::Sleep),
        (asm::BREAK, Event::Break),
        (asm::WDR, Event::WatchdogReset),
        // SPM, ELPM, EIJMP, XCH, an unassigned word, erased flash
        (0x95E8, Event::Illegal),
        (0x95D8, Event::Illegal),
        (0x9419, Event::Illegal),
        (0x9204, Event::Illegal),
        (0x0001, Event::Illegal),
        (0xFFFF, Event::Illegal),
    ];
    for (word, event) in cases {
        let mut machine = in_flash(&[word]);
        let before = machine.core.clone();
        let step = machine.step();
        assert_eq!((step.cycles, step.event), (1, event), "{word:#06x}");
        let core = &machine.core;
        assert_eq!((core.pc, core.instructions), (0x101, before.instructions + 1));
        assert_eq!(
            (core.registers, core.sreg, core.sp),
            (before.registers, before.sreg, before.sp)
        );
    }
}

/// The program counter wraps at the end of flash.
#[test]
fn flash_wraps() {
    let mut machine = in_flash(&[]);
    machine.core.pc = 0x7FF;
    machine.run(1);
    assert_eq!(machine.core.pc, 0);
    let set = in_flash(&[flag(asm::BSET, 6)]).after(1);
    assert_eq!(set.core.sreg, 0x40);
}
