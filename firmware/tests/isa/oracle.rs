//! Random programs against yasimavr, a simulator by others.
//!
//! `oracle/reference.py` runs the programs of [`generate`](crate::generate) on yasimavr's ATtiny402 and prints each
//! final state. `oracle/states.txt` holds the digests of those states.

use crate::asm::HALT;
use crate::generate::program;
use crate::machine::Machine;
use std::fmt::Write as _;
use std::process::Command;

/// Programs in `states.txt`.
const PROGRAMS: u64 = 600;

/// Instructions these programs execute at least, together.
const INSTRUCTIONS: u64 = 1_000_000;

/// 64-bit FNV-1a.
pub(crate) fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}

/// r0…r31, SREG, SP (low byte first), I/O 0x1C…0x1F and SRAM 0x3F00…0x3FFF at the end of `words`; the instructions
/// executed.
fn final_state(words: &[u16]) -> (Vec<u8>, u64) {
    let mut machine = Machine::new(words);
    assert_eq!(machine.program.words(), 2048, "LPM wraps at 4 KiB");
    while machine.program.word(machine.core.pc) != HALT {
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
