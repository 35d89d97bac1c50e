//! Every opcode against avr-objdump.

use crate::oracle::fnv1a;
use spts_firmware::avr::{Program, disassemble};
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Output};

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
    let output = Command::new("avr-objdump")
        .args(["-D", "-z", "-b", "binary", "-m", "avr:103"])
        .arg(path)
        .output();
    if let Ok(output) = output {
        return Some(output);
    }
    assert!(
        std::env::var("CI").as_deref() != Ok("true"),
        "avr-objdump is not installed: run scripts/setup.sh"
    );
    eprintln!("NOT CHECKED: avr-objdump is not installed (scripts/setup.sh does)");
    None
}

#[test]
fn agrees_with_avr_objdump() {
    let image: Vec<u8> = (0..=u16::MAX)
        .flat_map(|w| [w.to_le_bytes(), [0, 0]].concat())
        .collect();
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
