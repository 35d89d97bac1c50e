//! Wrong firmware is caught: each change of the source makes codes or replies differ.

use crate::build::{Substitution, changed, compiler};
use crate::conformance::{FAST, SLOW, conforms};
use crate::timing::{BUSY_LATENCY_CYCLES, exchanges_while_clocked};

/// Which images a change is made in.
#[derive(Clone, Copy, PartialEq)]
enum In {
    Shipped,
    Plain,
    Both,
}

/// What is wrong, where, and by which change of the source.
const MUTATIONS: &[(&str, In, Substitution)] = &[
    (
        "multiplier",
        In::Both,
        change("protocol.h", "MULTIPLIER 1664525", "MULTIPLIER 1664529"),
    ),
    (
        "increment",
        In::Both,
        change("protocol.h", "INCREMENT 1013904223", "INCREMENT 1013904225"),
    ),
    (
        "raster wraps late",
        In::Both,
        change("protocol.h", "COUNTER_LAST 107", "COUNTER_LAST 108"),
    ),
    (
        "counter starts at 8",
        In::Both,
        change("protocol.h", "COUNTER_START 7", "COUNTER_START 8"),
    ),
    (
        "neutral code",
        In::Both,
        change("protocol.h", "CODE_NEUTRAL 126", "CODE_NEUTRAL 127"),
    ),
    (
        "last addresses silent",
        In::Both,
        change("protocol.h", "ADDRESS_LAST 119", "ADDRESS_LAST 107"),
    ),
    (
        "threshold",
        In::Plain,
        change("protocol.h", "BINARY_THRESHOLD 128", "BINARY_THRESHOLD 129"),
    ),
    (
        "threshold by another bit",
        In::Shipped,
        change("generator.S", "lsl     \\to", "lsr     \\to"),
    ),
    (
        "modes mixed up",
        In::Shipped,
        change("generator.S", "sbrs    \\m, IS_BINARY", "sbrc    \\m, IS_BINARY"),
    ),
    (
        "carry lost",
        In::Shipped,
        change("generator.S", "sbci    \\t1, hi8", "subi    \\t1, hi8"),
    ),
    (
        "counter survives a seed",
        In::Shipped,
        change("generator.S", "mov     counter, r19", "nop"),
    ),
    (
        "counter survives a seed",
        In::Plain,
        change(
            "generator_plain.c",
            "mode = new_mode;\n    counter = COUNTER_START;",
            "mode = new_mode;",
        ),
    ),
    (
        "extended seed the wrong way round",
        In::Both,
        change(
            "bus.c",
            "seed.bytes[position - 1]",
            "seed.bytes[mode & MODE_EXTENDED ? 4 - position : 0]",
        ),
    ),
    ("seed bytes left over", In::Both, change("bus.c", "seed.value = 0;", "")),
    (
        "half a pair kept",
        In::Both,
        change("bus.c", "position = 0;\n        if (status", "if (status"),
    ),
    (
        "reply one byte short",
        In::Both,
        change("bus.c", "position >= REPLY_BYTES", "position >= REPLY_BYTES - 1"),
    ),
    (
        "state one byte short",
        In::Both,
        change("bus.c", "position < STATE_BYTES", "position < STATE_BYTES - 1"),
    ),
    (
        "a pattern of 64 bits refused",
        In::Both,
        change("bus.c", "byte > PATTERN_LAST", "byte >= PATTERN_LAST"),
    ),
    (
        "a pattern without bits taken",
        In::Both,
        change("bus.c", "byte == 0 || byte > PATTERN_LAST", "byte > PATTERN_LAST"),
    ),
    (
        "a byte too few of a pattern",
        In::Both,
        change(
            "bus.c",
            "next->length > 8 * (position - 1)",
            "next->length >= 8 * position",
        ),
    ),
    (
        "bits of an earlier pattern left over",
        In::Both,
        change("bus.c", "next->word[k] = 0;", ";"),
    ),
    (
        "pattern wraps late",
        In::Shipped,
        change(
            "generator.S",
            "cp      counter, length\n        brne",
            "cp      length, counter\n        brge",
        ),
    ),
    (
        "pattern wraps late",
        In::Plain,
        change("generator_plain.c", "counter == length", "counter > length"),
    ),
    (
        "nibbles not swapped",
        In::Shipped,
        change("generator.S", "swap    temp0", "nop"),
    ),
    (
        "a shift of two bits is one of one",
        In::Shipped,
        change(
            "generator.S",
            "sbrc    counter, 1\n        lsr     temp0\n        sbrc    counter, 1",
            "sbrc    counter, 1",
        ),
    ),
    (
        "the pattern of the byte before",
        In::Shipped,
        change(
            "generator.S",
            "mov     temp0, counter\n        lsr",
            "mov     temp0, saved_sreg\n        lsr",
        ),
    ),
    (
        "bits the wrong way round",
        In::Plain,
        change("generator_plain.c", "1 << (counter & 7)", "0x80 >> (counter & 7)"),
    ),
    (
        "counter survives a pattern",
        In::Shipped,
        change("generator.S", "clr     counter\n        sei", "sei"),
    ),
    (
        "counter survives a pattern",
        In::Plain,
        change("generator_plain.c", "counter = 0;\n    state = 0;", "state = 0;"),
    ),
    (
        "a pattern that reads a state",
        In::Shipped,
        change("generator.S", "cpi     r18, MODE_PATTERN", "cpi     r18, MODE_BINARY"),
    ),
    (
        "a pattern that reads a state",
        In::Plain,
        change("generator_plain.c", "counter = 0;\n    state = 0;", "counter = 0;"),
    ),
    (
        "missed clock prescaler",
        In::Both,
        change("main.c", "    clock_start();", "    (void)clock_start;"),
    ),
    (
        "store between key and clock prescaler",
        In::Both,
        change("main.c", "\\n\\tsts %2", "\\n\\tsts 0x3F80, __zero_reg__\\n\\tsts %2"),
    ),
    (
        "rising edges only",
        In::Both,
        change("main.c", "= PORT_ISC_BOTHEDGES", "= 2"),
    ),
    (
        "edge never cleared",
        In::Shipped,
        change("generator.S", "sbi     VPORTA_INTFLAGS, PIN_CLOCK", "nop"),
    ),
    (
        "DAC off",
        In::Both,
        change("main.c", "DAC_ENABLE | DAC_OUTEN", "DAC_ENABLE"),
    ),
];

/// Of the shipped image, what only an edge during bus traffic can show.
const RACES: &[(&str, Substitution)] = &[
    (
        "edges wait for the bus",
        change("generator.S", "sts     CPUINT_LVL1VEC, temp0", "nop"),
    ),
    (
        "an edge tears the seed",
        change("generator.S", "cli\n        movw    state0, r20", "movw    state0, r20"),
    ),
    (
        "an edge tears the pattern",
        change("generator.S", "cli\n        movw    word, r22", "movw    word, r22"),
    ),
    (
        "an edge loses a pointer of the bus",
        change("generator.S", "movw    r30, saved_r0\n        sbrc", "sbrc"),
    ),
    (
        "an edge meets half a pattern",
        change("bus.c", "active ^= 1;\n    generator_pattern", "generator_pattern"),
    ),
    (
        "an edge tears the reply",
        change("generator.S", "cli\n        mov     r18, mode", "mov     r18, mode"),
    ),
];

const fn change(file: &'static str, from: &'static str, to: &'static str) -> Substitution {
    Substitution { file, from, to }
}

#[test]
fn every_mutation_is_caught() {
    if compiler().is_none() {
        return;
    }
    for (what, place, substitution) in MUTATIONS {
        for (image, name, clock, not) in [
            ("shipped", "cell", FAST, In::Plain),
            ("plain", "cell_plain", SLOW, In::Shipped),
        ] {
            if *place != not {
                let caught = conforms(&changed(name, substitution), clock);
                assert!(caught.is_err(), "{what}: not seen in the {image} image");
            }
        }
    }
}

#[test]
fn every_race_is_caught() {
    if compiler().is_none() {
        return;
    }
    for (what, substitution) in RACES {
        let caught = exchanges_while_clocked(&changed("cell", substitution), BUSY_LATENCY_CYCLES);
        assert!(caught.is_err(), "{what}: not seen");
    }
}
