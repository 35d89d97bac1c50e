//! Wrong firmware is caught: each change of the source makes codes or replies differ.

use crate::build::{Substitution, changed, compiler};
use crate::conformance::{FAST, SLOW, conforms};
use crate::timing::{BUSY_LATENCY_CYCLES, exchanges_while_clocked};

/// What is wrong, in which images (race: of the shipped image, what only an edge during bus traffic can show), in which
/// file, and by which change of the source; ⏎ is a line end.
const MUTATIONS: &str = r#"
multiplier ¦ both ¦ protocol.h ¦ MULTIPLIER 1664525 ¦ MULTIPLIER 1664529
increment ¦ both ¦ protocol.h ¦ INCREMENT 1013904223 ¦ INCREMENT 1013904225
raster wraps late ¦ both ¦ protocol.h ¦ COUNTER_LAST 107 ¦ COUNTER_LAST 108
counter starts at 8 ¦ both ¦ protocol.h ¦ COUNTER_START 7 ¦ COUNTER_START 8
neutral code ¦ both ¦ protocol.h ¦ CODE_NEUTRAL 126 ¦ CODE_NEUTRAL 127
last addresses silent ¦ both ¦ protocol.h ¦ ADDRESS_LAST 119 ¦ ADDRESS_LAST 107
threshold ¦ plain ¦ protocol.h ¦ BINARY_THRESHOLD 128 ¦ BINARY_THRESHOLD 129
threshold by another bit ¦ shipped ¦ generator.S ¦ lsl     \to ¦ lsr     \to
modes mixed up ¦ shipped ¦ generator.S ¦ sbrs    \m, IS_BINARY ¦ sbrc    \m, IS_BINARY
carry lost ¦ shipped ¦ generator.S ¦ sbci    \t1, hi8 ¦ subi    \t1, hi8
counter survives a seed ¦ shipped ¦ generator.S ¦ mov     counter, r19 ¦ nop
counter survives a seed ¦ plain ¦ generator_plain.c ¦ mode = new_mode;⏎    counter = COUNTER_START; ¦ mode = new_mode;
extended seed the wrong way round ¦ both ¦ bus.c ¦ seed.bytes[position - 1] ¦ seed.bytes[mode & MODE_EXTENDED ? 4 - position : 0]
seed bytes left over ¦ both ¦ bus.c ¦ seed.value = 0; ¦
half a pair kept ¦ both ¦ bus.c ¦ position = 0;⏎        if (status ¦ if (status
reply one byte short ¦ both ¦ bus.c ¦ position >= REPLY_BYTES ¦ position >= REPLY_BYTES - 1
state one byte short ¦ both ¦ bus.c ¦ position < STATE_BYTES ¦ position < STATE_BYTES - 1
a pattern of 64 bits refused ¦ both ¦ bus.c ¦ byte > PATTERN_LAST ¦ byte >= PATTERN_LAST
a pattern without bits taken ¦ both ¦ bus.c ¦ byte == 0 || byte > PATTERN_LAST ¦ byte > PATTERN_LAST
a byte too few of a pattern ¦ both ¦ bus.c ¦ next->length > 8 * (position - 1) ¦ next->length >= 8 * position
bits of an earlier pattern left over ¦ both ¦ bus.c ¦ next->word[k] = 0; ¦ ;
pattern wraps late ¦ shipped ¦ generator.S ¦ cp      counter, length⏎        brne ¦ cp      length, counter⏎        brge
pattern wraps late ¦ plain ¦ generator_plain.c ¦ counter == length ¦ counter > length
nibbles not swapped ¦ shipped ¦ generator.S ¦ swap    temp0 ¦ nop
a shift of two bits is one of one ¦ shipped ¦ generator.S ¦ sbrc    counter, 1⏎        lsr     temp0⏎        sbrc    counter, 1 ¦ sbrc    counter, 1
the pattern of the byte before ¦ shipped ¦ generator.S ¦ mov     temp0, counter⏎        lsr ¦ mov     temp0, saved_sreg⏎        lsr
bits the wrong way round ¦ plain ¦ generator_plain.c ¦ 1 << (counter & 7) ¦ 0x80 >> (counter & 7)
counter survives a pattern ¦ shipped ¦ generator.S ¦ clr     counter⏎        sei ¦ sei
counter survives a pattern ¦ plain ¦ generator_plain.c ¦ counter = 0;⏎    state = 0; ¦ state = 0;
a pattern that reads a state ¦ shipped ¦ generator.S ¦ cpi     r18, MODE_PATTERN ¦ cpi     r18, MODE_BINARY
a pattern that reads a state ¦ plain ¦ generator_plain.c ¦ counter = 0;⏎    state = 0; ¦ counter = 0;
missed clock prescaler ¦ both ¦ main.c ¦     clock_start(); ¦     (void)clock_start;
store between key and clock prescaler ¦ both ¦ main.c ¦ \n\tsts %2 ¦ \n\tsts 0x3F80, __zero_reg__\n\tsts %2
rising edges only ¦ both ¦ main.c ¦ = PORT_ISC_BOTHEDGES ¦ = 2
edge never cleared ¦ shipped ¦ generator.S ¦ sbi     VPORTA_INTFLAGS, PIN_CLOCK ¦ nop
DAC off ¦ both ¦ main.c ¦ DAC_ENABLE | DAC_OUTEN ¦ DAC_ENABLE
edges wait for the bus ¦ race ¦ generator.S ¦ sts     CPUINT_LVL1VEC, temp0 ¦ nop
an edge tears the seed ¦ race ¦ generator.S ¦ cli⏎        movw    state0, r20 ¦ movw    state0, r20
an edge tears the pattern ¦ race ¦ generator.S ¦ cli⏎        movw    word, r22 ¦ movw    word, r22
an edge loses a pointer of the bus ¦ race ¦ generator.S ¦ movw    r30, saved_r0⏎        sbrc ¦ sbrc
an edge meets half a pattern ¦ race ¦ bus.c ¦ active ^= 1;⏎    generator_pattern ¦ generator_pattern
an edge tears the reply ¦ race ¦ generator.S ¦ cli⏎        mov     r18, mode ¦ mov     r18, mode
"#;

/// What is wrong and which images, with the change.
fn mutations() -> impl Iterator<Item = (&'static str, &'static str, Substitution)> {
    MUTATIONS.trim().lines().map(|line| {
        let fields = line.split(" ¦").map(|field| field.strip_prefix(' ').unwrap_or(field));
        let [what, images, file, from, to] = fields.collect::<Vec<_>>()[..] else { panic!("{line}") };
        (what, images, Substitution::new(file, from, to))
    })
}

#[test]
fn every_mutation_is_caught() {
    if compiler().is_none() {
        return;
    }
    std::thread::scope(|scope| {
        for (image, name, clock) in [("shipped", "cell", FAST), ("plain", "cell_plain", SLOW)] {
            scope.spawn(move || {
                let of_image = mutations().filter(|(_, place, _)| ["both", image].contains(place));
                for (what, _, substitution) in of_image {
                    let caught = conforms(&changed(name, &substitution), clock);
                    assert!(caught.is_err(), "{what}: not seen in the {image} image");
                }
            });
        }
    });
}

#[test]
fn every_race_is_caught() {
    if compiler().is_none() {
        return;
    }
    for (what, _, substitution) in mutations().filter(|(_, place, _)| *place == "race") {
        let caught = exchanges_while_clocked(&changed("cell", &substitution), BUSY_LATENCY_CYCLES);
        assert!(caught.is_err(), "{what}: not seen");
    }
}
