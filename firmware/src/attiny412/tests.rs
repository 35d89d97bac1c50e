//! The device as a whole, on programs of a few words.

use super::{Device, Fault, TraceStep};

/// Out of reset the prescaler divides by six.
const RESET_DIVISION: u64 = 6;
const NOP: u16 = 0x0000;
const SEI: u16 = 0x9478;
const SLEEP: u16 = 0x9588;
const RETI: u16 = 0x9518;
/// rjmp to itself.
const STAY: u16 = 0xcfff;

fn device(words: &[u16]) -> Device {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    Device::new(Device::program(&bytes).unwrap(), &[42, 7])
}

fn ldi(register: u16, value: u8) -> u16 {
    let value = u16::from(value);
    0xe000 | (value & 0xf0) << 4 | (register - 16) << 4 | value & 0x0f
}

/// ldi r16, value; sts address, r16
fn store(address: u16, value: u8) -> [u16; 3] {
    [ldi(16, value), 0x9300, address]
}

/// lds register, address
fn load(register: u16, address: u16) -> [u16; 2] {
    [0x9000 | register << 4, address]
}

/// Writes the key to CCP, then 0 to CLKCTRL.MCLKCTRLB: one tick a cycle.
fn full_speed() -> [u16; 5] {
    // ldi r16, 0xd8; out CCP, r16; ldi r17, 0; sts MCLKCTRLB, r17
    [ldi(16, 0xd8), 0xbf04, ldi(17, 0), 0x9310, 0x0061]
}

fn rjmp(from: u16, to: u16) -> u16 {
    0xc000 | to.wrapping_sub(from + 1) & 0x0fff
}

/// Vector table of 26 words that jumps to `main`, which follows it, and to handlers at word addresses.
fn with_vectors(handlers: &[(u16, u16)], main: &[u16]) -> Vec<u16> {
    let mut words = vec![NOP; 26];
    words[0] = rjmp(0, 26);
    for (vector, handler) in handlers {
        words[usize::from(*vector)] = rjmp(*vector, *handler);
    }
    words.extend(main);
    words
}

fn place(mut words: Vec<u16>, at: usize, code: &[u16]) -> Vec<u16> {
    words.resize(words.len().max(at), NOP);
    words.extend(code);
    words
}

#[test]
fn time_is_cycles_times_the_prescaler() {
    let mut slow = device(&[NOP, NOP, NOP, STAY]);
    slow.run_until(3 * RESET_DIVISION);
    assert_eq!((slow.instructions(), slow.now()), (3, 18));
    // 1 + 1 + 1 + 2 cycles at 6 ticks, then one tick a cycle
    let mut words = full_speed().to_vec();
    words.extend([NOP, NOP, STAY]);
    let mut fast = device(&words);
    fast.run_until(5 * RESET_DIVISION + 2);
    assert_eq!((fast.instructions(), fast.now()), (6, 32));
}

/// Edge on a sleeping device: handler entered 5 + 3 cycles behind it, its jump takes 2.
#[test]
fn a_pin_change_wakes_and_enters_its_handler() {
    let mut main = full_speed().to_vec();
    main.extend(store(0x0413, 1)); // PORTA.PIN3CTRL: both edges
    main.extend(store(0x0050, 1)); // SLPCTRL: enable
    main.extend([SEI, SLEEP, rjmp(0, 0xffff)]);
    let handler = [0x9a1b, 0x9543, RETI]; // sbi VPORTA.INTFLAGS, 3; inc r20; reti
    let words = place(with_vectors(&[(3, 60)], &main), 60, &handler);
    let mut device = device(&words);
    device.run_until(1000);
    assert!(device.is_asleep());
    let before = device.core.registers[20];
    device.set_clock(true);
    let mut steps = vec![];
    device.trace_until(1016, |record| steps.push(record.clone()));
    let ticks: Vec<u64> = steps.iter().map(|record| record.tick).collect();
    // wake, interrupt, rjmp, sbi, inc, reti
    assert_eq!(ticks, [1000, 1005, 1008, 1010, 1011, 1012]);
    assert_eq!(steps[1].step, TraceStep::Interrupt { vector: 3 });
    let count = format!("r20={:02x}", before.wrapping_add(1));
    let line = steps[4].to_string();
    assert!(line.contains("inc") && line.contains(&count), "{line}");
    assert_eq!(device.core.registers[20], before.wrapping_add(1));
    // both edges, and two within the response are one
    device.set_clock(false);
    device.run_until(2000);
    device.set_clock(true);
    device.set_clock(false);
    device.run_until(3000);
    assert_eq!(device.core.registers[20], before.wrapping_add(3));
}

#[test]
fn a_traced_run_is_the_same_run() {
    let image = crate::Image::shipped();
    let mut plain = Device::new(Device::program(image.flash()).unwrap(), &[8]);
    let mut traced = plain.clone();
    plain.run_until(20_000);
    let mut steps = 0;
    traced.trace_until(20_000, |_| steps += 1);
    assert_eq!(format!("{plain:?}"), format!("{traced:?}"));
    assert_eq!(steps, plain.instructions());
}

/// The line is high across the reset: its fall is an edge, and the handler goes on from the register that was kept.
#[test]
fn a_reset_keeps_registers_and_the_levels_outside() {
    let mut main = store(0x0413, 1).to_vec(); // PORTA.PIN3CTRL: both edges
    main.extend([SEI, STAY]);
    let handler = [0x9a1b, 0x9543, RETI]; // sbi VPORTA.INTFLAGS, 3; inc r20; reti
    let mut device = device(&place(with_vectors(&[(3, 60)], &main), 60, &handler));
    device.run_until(1000);
    let before = device.core.registers[20];
    device.set_clock(true);
    device.run_until(2000);
    device.reset();
    device.run_until(3000);
    device.set_clock(false);
    device.run_until(4000);
    assert_eq!(device.core.registers[20], before.wrapping_add(2));
}

/// A pin change waits for the I flag; behind a key it waits for four instructions more, not only for the one behind
/// SEI.
#[test]
fn no_interrupt_comes_between_a_key_and_its_write() {
    let taken_after = |key: u8| {
        let mut main = store(0x0413, 1).to_vec();
        main.extend([NOP; 20]);
        main.extend([ldi(16, key), 0xbf04, SEI]); // out CCP, r16
        main.extend([NOP; 8]);
        let mut device = device(&place(with_vectors(&[(3, 80)], &main), 80, &[STAY]));
        device.run_until(10 * RESET_DIVISION);
        device.set_clock(true);
        let mut behind_sei = None;
        device.trace_until(60 * RESET_DIVISION, |record| match &record.step {
            TraceStep::Instruction { text, .. } if text.contains("sei") => behind_sei = Some((0, false)),
            TraceStep::Instruction { .. } => {
                behind_sei = behind_sei.map(|(count, taken)| (count + u32::from(!taken), taken));
            }
            TraceStep::Interrupt { .. } => behind_sei = behind_sei.map(|(count, _)| (count, true)),
            _ => {}
        });
        behind_sei
    };
    assert_eq!(taken_after(0), Some((1, true)));
    assert_eq!(taken_after(0xd8), Some((3, true)));
}

/// The key opens a protected register for four instructions, and for no longer than up to the next store.
#[test]
fn a_protected_register_needs_its_key() {
    let behind = |between: &[u16]| {
        let mut words = vec![ldi(16, 0xd8), ldi(17, 0), 0xbf04]; // out CCP, r16
        words.extend(between);
        words.extend([0x9310, 0x0061, STAY]); // sts MCLKCTRLB, r17
        let mut device = device(&words);
        device.run_until(300);
        device.faults().first()
    };
    let protected = Some(Fault::Protected { address: 0x0061 });
    assert_eq!(behind(&[]), None);
    assert_eq!(behind(&[NOP, NOP, NOP]), None);
    assert_eq!(behind(&[NOP, NOP, NOP, NOP]), protected);
    assert_eq!(behind(&load(2, 0x3f80)), None, "a load of SRAM");
    assert_eq!(behind(&[0x9310, 0x3f80]), protected, "sts 0x3f80, r17");
    assert_eq!(behind(&[0x9a1b]), protected, "sbi VPORTA.INTFLAGS, 3");
}

/// Bytes of the EEPROM, which wait a cycle, and faults for what is not emulated: a read, a write, an instruction.
#[test]
fn what_is_not_there_reads_zero_and_is_recorded() {
    let mut words = [load(0, 0x1400), load(1, 0x1401), load(2, 0x1402), load(3, 0x0600)].concat();
    words.extend(store(0x0140, 0x11));
    words.extend([0x95e8, STAY]); // spm
    let mut device = device(&words);
    device.run_until(1);
    assert_eq!(device.now(), 4 * RESET_DIVISION);
    device.run_until(200);
    assert_eq!(device.core.registers[..4], [42, 7, 0xff, 0]);
    assert_eq!(device.faults().first(), Some(Fault::Read { address: 0x0600 }));
    assert_eq!(device.faults().count(), 3);
}

#[test]
fn a_software_reset_keeps_sram() {
    // a byte of SRAM to r19, then 0x77 into that byte
    let mut words = load(19, 0x3f10).to_vec();
    words.extend(store(0x3f10, 0x77));
    // the second time 0x77 is there: cpi r19, 0x77; breq to STAY
    words.extend([0x3737, 0xf019]);
    // the first time: the key to CCP, over STAY, and RSTCTRL.SWRR = 1
    words.extend([ldi(16, 0xd8), 0xbf04, rjmp(0, 2), STAY]);
    words.extend(store(0x0041, 1));
    let mut device = device(&words);
    device.run_until(2000);
    assert_eq!(device.core.registers[19], 0x77);
    assert_eq!(device.faults().first(), None);
}
