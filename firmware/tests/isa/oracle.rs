//! The core against programs written by others: random programs against yasimavr, and every opcode against avr-objdump.
//!
//! `oracle/reference.py` runs the programs of [`program`] on yasimavr's ATtiny402 and prints each final state.
//! `oracle/states.txt` holds the digests of those states.
//!
//! Every AVR with SRAM at 0x3F00 and four general-purpose I/O registers at 0x1C executes the random programs alike.
//! Data goes to 0x3F00…0x3FBF, the stack grows down from 0x3FFF; loads and stores stay within them, since parts differ
//! outside. All jumps go forward and all calls to subroutines in front, so that every program ends, at a jump to
//! itself.

use crate::asm::{self, bit, branch, displaced, flag, fractional, io, io_bit, movw, muls, one, relative, rk, rr, word};
use crate::machine::Machine;
use spts_firmware::avr::{Program, disassemble};
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Output};

/// Programs in `states.txt`.
const PROGRAMS: u64 = 600;

/// Instructions these programs execute at least, together.
const INSTRUCTIONS: u64 = 1_000_000;

/// 64-bit FNV-1a.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xCBF2_9CE4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01B3))
}

/// r0…r31, SREG, SP (low byte first), I/O 0x1C…0x1F and SRAM 0x3F00…0x3FFF at the end of `words`; the instructions
/// executed.
fn final_state(words: &[u16]) -> (Vec<u8>, u64) {
    let mut machine = Machine::new(words);
    assert_eq!(machine.program.words(), 2048, "LPM wraps at 4 KiB");
    while machine.program.word(machine.core.pc) != asm::HALT {
        machine.run(1);
        assert!(machine.core.instructions < 100_000, "the program does not end");
    }
    let core = &machine.core;
    let mut state = core.registers.to_vec();
    state.push(core.sreg);
    state.extend(core.sp.to_le_bytes());
    state.extend(machine.memory.bytes(0x1C..=0x1F));
    state.extend(machine.memory.bytes(0x3F00..=0x3FFF));
    (state, core.instructions)
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// Digests in `states.txt`, `#` begins a comment.
fn committed() -> Vec<u64> {
    include_str!("../oracle/states.txt")
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| u64::from_str_radix(line, 16).expect("a digest a line"))
        .collect()
}

#[test]
fn final_states_are_those_of_yasimavr() {
    let committed = committed();
    assert_eq!(committed.len() as u64, PROGRAMS);
    let mut executed = 0;
    for (index, digest) in (0..).zip(committed) {
        let (state, instructions) = final_state(&program(index));
        assert_eq!(fnv1a(&state), digest, "program {index} ends as {}", hex(&state));
        executed += instructions;
    }
    assert!(executed >= INSTRUCTIONS, "{executed} instructions");
}

/// What reference.py prints for the programs in `range`; none, and said so, without yasimavr.
fn reference(range: std::ops::Range<u64>, arguments: &[&str]) -> Option<Vec<String>> {
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    let lines: Vec<String> = range
        .map(|index| {
            let image: Vec<u8> = program(index).iter().flat_map(|w| w.to_le_bytes()).collect();
            hex(&image)
        })
        .collect();
    std::fs::write(file.path(), lines.join("\n")).expect("the file is ours");
    let python = std::env::var("YASIMAVR_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let installed = Command::new(&python).args(["-c", "import yasimavr"]).output();
    if !installed.is_ok_and(|output| output.status.success()) {
        eprintln!("{python} has no yasimavr (set YASIMAVR_PYTHON): not compared");
        return None;
    }
    let output = Command::new(python)
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/oracle/reference.py"))
        .args(arguments)
        .arg(file.path())
        .output()
        .expect("Python starts");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "reference.py: {errors}");
    let text = String::from_utf8(output.stdout).expect("hexadecimal");
    Some(text.lines().map(str::to_owned).collect())
}

/// Programs that are not in `states.txt`, whole states.
#[test]
#[ignore = "needs yasimavr 0.1.6 in the Python that YASIMAVR_PYTHON names"]
fn other_programs_end_as_on_yasimavr() {
    let range = PROGRAMS..2 * PROGRAMS;
    for (index, state) in range.clone().zip(reference(range, &[]).into_iter().flatten()) {
        assert_eq!(hex(&final_state(&program(index)).0), state, "program {index}");
    }
}

/// The file is what the script prints; SPTS_WRITE_ORACLE=1 writes it.
#[test]
#[ignore = "needs yasimavr 0.1.6 in the Python that YASIMAVR_PYTHON names"]
fn states_txt_is_made_by_the_script() {
    let Some(lines) = reference(0..PROGRAMS, &["--digest"]) else {
        return;
    };
    let text = lines.join("\n") + "\n";
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/oracle/states.txt");
    if std::env::var_os("SPTS_WRITE_ORACLE").is_some() {
        std::fs::write(path, &text).unwrap();
    }
    assert_eq!(text, std::fs::read_to_string(path).unwrap());
}

/// SplitMix64 (Steele, Lea, Flood 2014): programs must stay what they are for ever, whatever a crate does.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// 0 … `end` − 1.
    fn below(&mut self, end: u16) -> u16 {
        u16::try_from(self.next() % u64::from(end)).expect("below `end`")
    }

    fn pick(&mut self, from: &[u16]) -> u16 {
        from[usize::from(self.below(count(from)))]
    }
}

/// Words from which a program ends, within 4 KiB of flash.
const LENGTH: usize = 1950;
const SUBROUTINES: usize = 8;
const DATA: u16 = 0x3F00;
const DATA_BYTES: u16 = 0xC0;
const SREG: u16 = 0x3F;

/// (low register, plain or displaced, displaced, stepping) accesses.
const POINTERS: [(u16, [u16; 2], [u16; 4]); 3] = [
    (26, [asm::LD_X, asm::ST_X], [asm::LD_X_INC, asm::LD_X_DEC, asm::ST_X_INC, asm::ST_X_DEC]),
    (28, [asm::LDD_Y, asm::STD_Y], [asm::LD_Y_INC, asm::LD_Y_DEC, asm::ST_Y_INC, asm::ST_Y_DEC]),
    (30, [asm::LDD_Z, asm::STD_Z], [asm::LD_Z_INC, asm::LD_Z_DEC, asm::ST_Z_INC, asm::ST_Z_DEC]),
];

fn count(words: &[u16]) -> u16 {
    u16::try_from(words.len()).expect("a program has 2048 words at most")
}

/// Words from behind the instruction at `from` to `to`.
fn offset(from: u16, to: u16) -> i16 {
    to.wrapping_sub(from + 1).cast_signed()
}

struct Generator {
    random: Random,
    words: Vec<u16>,
    /// Word addresses of the subroutines so far.
    subroutines: Vec<u16>,
}

/// Program number `index`, 1951 words or a few more.
fn program(index: u64) -> Vec<u16> {
    let mut generator = Generator { random: Random(index), words: vec![asm::NOP], subroutines: Vec::new() };
    for _ in 0..SUBROUTINES {
        generator.subroutine();
    }
    generator.words[0] = relative(asm::RJMP, offset(0, generator.here()));
    generator.prologue();
    while generator.words.len() < LENGTH {
        generator.block();
    }
    generator.words.push(asm::HALT);
    generator.words
}

impl Generator {
    fn here(&self) -> u16 {
        count(&self.words)
    }

    fn push(&mut self, word: u16) {
        self.words.push(word);
    }

    fn load_pair(&mut self, low: u16, value: u16) {
        self.push(rk(asm::LDI, low, value & 0xFF));
        self.push(rk(asm::LDI, low + 1, value >> 8));
    }

    /// Stack and random registers.
    fn prologue(&mut self) {
        self.load_pair(16, 0x3FFF);
        self.push(io(asm::OUT, 16, 0x3D));
        self.push(io(asm::OUT, 17, 0x3E));
        for d in 0..32 {
            let k = self.random.below(256);
            self.push(rk(asm::LDI, 16 + d % 16, k));
            if d < 16 {
                self.push(rr(asm::MOV, d, 16 + d));
            }
        }
    }

    fn subroutine(&mut self) {
        let start = self.here();
        for _ in 0..self.random.below(8) {
            self.straight();
        }
        if !self.subroutines.is_empty() && self.random.below(3) == 0 {
            self.call();
        }
        self.push(asm::RET);
        self.subroutines.push(start);
    }

    /// Something of one or more instructions.
    fn block(&mut self) {
        match self.random.below(16) {
            0..=8 => self.straight(),
            9 => self.stack(),
            10..=11 => self.branch(),
            12..=13 => self.skip(),
            14 => self.jump(),
            _ => self.call(),
        }
    }

    /// No change of flow.
    fn straight(&mut self) {
        match self.random.below(8) {
            0 => self.memory(),
            1 => self.direct(),
            2 => self.program_memory(),
            _ => {
                let word = self.plain();
                self.push(word);
            }
        }
    }

    /// One word that touches neither memory nor flow.
    fn plain(&mut self) -> u16 {
        let random = &mut self.random;
        let (d, r, k) = (random.below(32), random.below(32), random.below(256));
        let (b, high) = (random.below(8), 16 + random.below(16));
        match random.below(20) {
            0..=6 => rr(random.pick(&asm::TWO_REGISTERS), d, r),
            7..=9 => rk(random.pick(&asm::IMMEDIATES), high, k),
            10..=11 => one(random.pick(&asm::ONE_REGISTER), d),
            12 => word(random.pick(&[asm::ADIW, asm::SBIW]), 24 + 2 * random.below(4), k % 64),
            13 => movw(2 * (d / 2), 2 * (r / 2)),
            14 => muls(16 + d % 16, 16 + r % 16),
            15 => fractional(random.pick(&asm::FRACTIONAL), 16 + d % 8, 16 + r % 8),
            16 => bit(random.pick(&[asm::BLD, asm::BST]), d, b),
            17 => flag(random.pick(&[asm::BSET, asm::BCLR]), b),
            18 => self.io(),
            _ => asm::NOP,
        }
    }

    /// General-purpose I/O registers, SREG and reading of the stack pointer.
    fn io(&mut self) -> u16 {
        let random = &mut self.random;
        let (d, a, b) = (random.below(32), 0x1C + random.below(4), random.below(8));
        match random.below(6) {
            0 => io(asm::IN, d, a),
            1 => io(asm::OUT, d, a),
            2 => io_bit(random.pick(&[asm::SBI, asm::CBI]), a, b),
            3 => io(asm::OUT, d, SREG),
            _ => io(asm::IN, d, random.pick(&[0x3D, 0x3E, SREG])),
        }
    }

    /// Pointer into the data, then up to six accesses through it.
    fn memory(&mut self) {
        let (low, plain, steps) = POINTERS[usize::from(self.random.below(3))];
        // room for six steps down and for six up or the largest displacement
        let address = DATA + 6 + self.random.below(DATA_BYTES - 6 - 64);
        self.load_pair(low, address);
        for _ in 0..=self.random.below(6) {
            // the pointer stays what it is
            let d = [self.random.below(26), low ^ 2][usize::from(self.random.below(8) == 0)];
            let access = match self.random.below(2) {
                0 => one(self.random.pick(&steps), d),
                _ if low == 26 => one(self.random.pick(&plain), d),
                _ => displaced(self.random.pick(&plain), d, self.random.below(58)),
            };
            self.push(access);
        }
    }

    /// LDS or STS.
    fn direct(&mut self) {
        let access = one(self.random.pick(&[asm::LDS, asm::STS]), self.random.below(32));
        let address = DATA + self.random.below(DATA_BYTES);
        self.words.extend([access, address]);
    }

    fn program_memory(&mut self) {
        let address = self.random.below(3890);
        self.load_pair(30, address);
        for _ in 0..=self.random.below(3) {
            let d = self.random.below(30);
            let load = [asm::LPM, one(asm::LPM_Z, d), one(asm::LPM_Z_INC, d)];
            let load = self.random.pick(&load);
            self.push(load);
        }
    }

    /// PUSH and POP around straight code.
    fn stack(&mut self) {
        let depth = 1 + self.random.below(4);
        for _ in 0..depth {
            let push = one(asm::PUSH, self.random.below(32));
            self.push(push);
            self.straight();
        }
        for _ in 0..depth {
            let pop = one(asm::POP, self.random.below(32));
            self.push(pop);
        }
    }

    /// Conditional branch over straight code.
    fn branch(&mut self) {
        let (base, s) = (self.random.pick(&[asm::BRBS, asm::BRBC]), self.random.below(8));
        let at = self.here();
        self.push(asm::NOP);
        for _ in 0..self.random.below(5) {
            self.straight();
        }
        self.words[usize::from(at)] = branch(base, s, offset(at, self.here()));
    }

    /// Skip over one instruction of one or two words.
    fn skip(&mut self) {
        let random = &mut self.random;
        let (d, r) = (random.below(32), random.below(32));
        let (b, a) = (random.below(8), 0x1C + random.below(4));
        let skip = match random.below(5) {
            0 => rr(asm::CPSE, d, r),
            1 => bit(asm::SBRC, d, b),
            2 => bit(asm::SBRS, d, b),
            3 => io_bit(asm::SBIC, a, b),
            _ => io_bit(asm::SBIS, a, b),
        };
        self.push(skip);
        match self.random.below(6) {
            0 => self.direct(),
            1 => {
                let target = self.random.pick(&self.subroutines);
                self.words.extend([asm::CALL, target]);
            }
            2 => {
                let over = self.here() + 3;
                let plain = self.plain();
                self.words.extend([asm::JMP, over, plain]);
            }
            _ => {
                let plain = self.plain();
                self.push(plain);
            }
        }
    }

    /// Jump over words that are never executed.
    fn jump(&mut self) {
        let dead = self.random.below(4);
        let (words, over) = match self.random.below(3) {
            0 => (vec![relative(asm::RJMP, offset(0, dead + 1))], 0),
            1 => (vec![asm::JMP, self.here() + 2 + dead], 0),
            _ => (vec![asm::IJMP], self.here() + 3 + dead),
        };
        if over > 0 {
            self.load_pair(30, over);
        }
        self.words.extend(words);
        for _ in 0..dead {
            let word = self.random.below(u16::MAX);
            self.push(word);
        }
    }

    fn call(&mut self) {
        let target = self.random.pick(&self.subroutines);
        match self.random.below(3) {
            0 => self.push(relative(asm::RCALL, offset(self.here(), target))),
            1 => self.words.extend([asm::CALL, target]),
            _ => {
                self.load_pair(30, target);
                self.push(asm::ICALL);
            }
        }
    }
}

/// FNV-1a of avr-objdump's [`listing`], binutils 2.40; `agrees_with_avr_objdump` makes it again.
const LISTING_FNV1A: u64 = 0x5C48_D68D_6B92_0595;

/// Instructions of other AVRs, which avr-objdump names and the core does not execute.
const OTHERS: [&str; 9] = ["des", "eicall", "eijmp", "elpm", "lac", "las", "lat", "spm", "xch"];

/// One line for each opcode, a zero word behind it; `text` gives the instruction.
fn listing(text: impl Fn(u16) -> String) -> String {
    (0..=u16::MAX).fold(String::new(), |mut all, word| {
        let _ = writeln!(all, "{word:04x} {}", text(word));
        all
    })
}

fn ours(word: u16) -> String {
    let text = disassemble(&Program::from_words(&[word, 0]), 0);
    match text.split_once(" ;") {
        Some((instruction, _target)) => instruction.to_owned(),
        None => text,
    }
}

#[test]
fn agrees_with_the_listing_of_avr_objdump() {
    assert_eq!(fnv1a(listing(ours).as_bytes()), LISTING_FNV1A);
}

/// What avr-objdump says of `word`, in our terms.
fn theirs(word: u16, mnemonic: &str, operands: &str) -> String {
    let operands = operands.trim();
    match mnemonic {
        other if OTHERS.contains(&other) => format!(".word {word:#06x}"),
        // 22 bits there, a 16-bit program counter here
        "jmp" | "call" => format!("{mnemonic} 0"),
        plain if operands.is_empty() => plain.to_owned(),
        _ => format!("{mnemonic} {operands}"),
    }
}

/// What avr-objdump says of the image in `path`; `None`, said aloud, where it is not installed. A machine that checks
/// changes (`CI` is `true`) has to have it.
fn avr_objdump(path: &Path) -> Option<Output> {
    let output = Command::new("avr-objdump").args(["-D", "-z", "-b", "binary", "-m", "avr:103"]).arg(path).output();
    if let Ok(output) = output {
        return Some(output);
    }
    assert!(std::env::var("CI").as_deref() != Ok("true"), "avr-objdump is not installed: run scripts/setup.sh");
    eprintln!("NOT CHECKED: avr-objdump is not installed (scripts/setup.sh does)");
    None
}

#[test]
fn agrees_with_avr_objdump() {
    let image: Vec<u8> = (0..=u16::MAX).flat_map(|w| [w.to_le_bytes(), [0, 0]].concat()).collect();
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), image).unwrap();
    let Some(output) = avr_objdump(file.path()) else {
        return;
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut texts = vec![String::new(); 0x1_0000];
    for line in String::from_utf8(output.stdout).unwrap().lines() {
        // address:, bytes, mnemonic, operands, comment
        let fields: Vec<&str> = line.split('\t').collect();
        let [address, _bytes, mnemonic, rest @ ..] = fields.as_slice() else {
            continue;
        };
        let address = u32::from_str_radix(address.trim().trim_end_matches(':'), 16).unwrap();
        if address % 4 == 0 {
            let word = u16::try_from(address / 4).unwrap();
            texts[usize::from(word)] = theirs(word, mnemonic.trim(), rest.first().unwrap_or(&""));
        }
    }
    for word in 0..=u16::MAX {
        assert_eq!(ours(word), texts[usize::from(word)], "{word:#06x}");
    }
    let digest = fnv1a(listing(|word| texts[usize::from(word)].clone()).as_bytes());
    assert_eq!(digest, LISTING_FNV1A, "{digest:#018x}");
}

#[test]
fn targets_are_byte_addresses() {
    let program = Program::from_words(&[0xC001, 0xF3F1, 0x940C, 0x0123]);
    assert_eq!(disassemble(&program, 0), "rjmp .+2 ; 0x4");
    assert_eq!(disassemble(&program, 1), "breq .-4 ; 0x0");
    assert_eq!(disassemble(&program, 2), "jmp 0x246");
}
