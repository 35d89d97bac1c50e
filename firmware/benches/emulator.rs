//! Speed of the AVRxt core: instructions a second of one core on one thread.
//!
//! Two busy loops of the kinds a cell runs: the 32-bit congruential generator (products, sums, moves), and copying of
//! SRAM with calls, stack and branches.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use spts_firmware::avr::{Core, DataSpace, Program};
use std::hint::black_box;

const INSTRUCTIONS: u64 = 1_000_000;

/// state = 1664525·state + 1013904223 mod 2³², with the state in r2…r5, the product collected in r16…r19, zero in r6.
const GENERATOR: &[u16] = &[
    0x2466, // eor r6, r6
    0xE0AD, // ldi r26, 0x0D; multiplier 0x0019660D
    0xE6B6, // ldi r27, 0x66
    0xE1C9, // ldi r28, 0x19
    // product, low byte of the multiplier
    0x9E2A, // mul r2, r26
    0x0180, // movw r16, r0
    0x9E4A, // mul r4, r26
    0x0190, // movw r18, r0
    0x9E3A, // mul r3, r26
    0x0D10, // add r17, r0
    0x1D21, // adc r18, r1
    0x1D36, // adc r19, r6
    0x9E5A, // mul r5, r26
    0x0D30, // add r19, r0
    // middle byte
    0x9E2B, // mul r2, r27
    0x0D10, // add r17, r0
    0x1D21, // adc r18, r1
    0x1D36, // adc r19, r6
    0x9E3B, // mul r3, r27
    0x0D20, // add r18, r0
    0x1D31, // adc r19, r1
    0x9E4B, // mul r4, r27
    0x0D30, // add r19, r0
    // high byte
    0x9E2C, // mul r2, r28
    0x0D20, // add r18, r0
    0x1D31, // adc r19, r1
    0x9E3C, // mul r3, r28
    0x0D30, // add r19, r0
    // increment 0x3C6EF35F, as its negative
    0x5A01, // subi r16, 0xA1
    0x401C, // sbci r17, 0x0C
    0x4921, // sbci r18, 0x91
    0x4C33, // sbci r19, 0xC3
    0x0118, // movw r2, r16
    0x0129, // movw r4, r18
    0xCFE1, // rjmp .-62, to the first product
];

/// Copies 16 bytes from 0x3F00 to 0x3F10 through a subroutine, for ever.
const COPY: &[u16] = &[
    0xE0A0, // ldi r26, 0x00
    0xE3BF, // ldi r27, 0x3F
    0xE1E0, // ldi r30, 0x10
    0xE3FF, // ldi r31, 0x3F
    0xE100, // ldi r16, 16
    0xD003, // rcall .+6
    0x950A, // dec r16
    0xF7E9, // brne .-6
    0xCFF7, // rjmp .-18
    0x930F, // push r16
    0x910D, // ld r16, X+
    0x9301, // st Z+, r16
    0x910F, // pop r16
    0x9508, // ret
];

/// 256 bytes at every page.
struct Sram([u8; 256]);

impl DataSpace for Sram {
    #[inline]
    fn read(&mut self, address: u16) -> u8 {
        self.0[usize::from(address & 0xFF)]
    }

    #[inline]
    fn write(&mut self, address: u16, value: u8) {
        self.0[usize::from(address & 0xFF)] = value;
    }
}

/// Runs `core` for [`INSTRUCTIONS`]; returns the cycles.
fn run(core: &mut Core, program: &Program, data: &mut Sram) -> u64 {
    (0..INSTRUCTIONS)
        .map(|_| u64::from(core.step(program, data).cycles))
        .sum()
}

/// The loop is a generator: its first states are those of the formula.
fn check_generator(program: &Program) {
    let (mut core, mut data) = (Core::new(0x3FFF), Sram([0; 256]));
    for _ in 0..4 {
        core.step(program, &mut data);
    }
    let mut state = 0_u32;
    for _ in 0..3 {
        for _ in 4..GENERATOR.len() {
            core.step(program, &mut data);
        }
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        assert_eq!(core.registers[2..6], state.to_le_bytes());
    }
}

fn instructions(c: &mut Criterion) {
    let mut group = c.benchmark_group("instructions");
    group.throughput(Throughput::Elements(INSTRUCTIONS));
    check_generator(&Program::from_words(GENERATOR));
    for (name, words) in [("generator", GENERATOR), ("copy", COPY)] {
        let program = Program::from_words(words);
        let (mut core, mut data) = (Core::new(0x3FFF), Sram([0; 256]));
        group.bench_function(name, |b| {
            b.iter(|| run(black_box(&mut core), &program, &mut data));
        });
    }
    group.finish();
}

criterion_group!(benches, instructions);
criterion_main!(benches);
