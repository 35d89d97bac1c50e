//! Seeded mutations of a committed corpus, driven through every parser on a stable compiler.
#![cfg(unix)]

use rand::seq::IndexedRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_tests::parsers::PARSERS;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// Cases in all.
const CASES: usize = 20_000;
/// Time that one case may take.
const LIMIT: Duration = Duration::from_secs(5);
/// Address space of the process that runs the cases, kB.
const MEMORY_KB: &str = "4000000";
/// Time after which the process is ended, s.
const LONGEST_RUN_S: &str = "1800";
/// Asks this test for the cases themselves, and says in which folder to note them.
const ASKED: &str = "SPTS_MUTATIONS_IN";
/// Most files that one case is made of, and changes to it.
const CHANGES: usize = 8;
/// Longest case, bytes: splices do not grow without end.
const LONGEST: usize = 1 << 16;

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus")
}

/// Files of the corpus of the parser `name`, sorted by name.
fn files_of(name: &str) -> Vec<Vec<u8>> {
    let folder = corpus().join(name);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// Words that parsers know.
const WORDS: &str = "v |f |\\\n|#|facet|vertex|endsolid|glTF|JSON|'descr'|(|[|{|PK\x03\x04|null|\u{feff}|\0|\n|\"|,|:|=|\x0e\0\0\0|\x0f\0\0\0|\
                     \0\0\0\0";
/// Numbers at the ends of their types.
const NUMBERS: &str =
    "0|-1|nan|inf|1e308|-1e308|3e38|0.1|100000|4294967295|4294967296|9223372036854775808|18446744073709551615|1e-320";
/// Words that are no text.
const BYTES: [&[u8]; 4] = [b"\x93NUMPY", b"\xff\xfe", b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f"];

/// Case `index`: a file of the corpus with some changes, the same on any machine.
fn case(index: usize, files: &[Vec<u8>]) -> Vec<u8> {
    let mut rng = ChaCha8Rng::seed_from_u64(index as u64);
    let numbers: Vec<&[u8]> = NUMBERS.split('|').map(str::as_bytes).collect();
    let words = WORDS.split('|').map(str::as_bytes).chain(BYTES);
    let words: Vec<&[u8]> = words.chain(numbers.iter().copied()).collect();
    let mut bytes = files.choose(&mut rng).cloned().unwrap_or_default();
    for _ in 0..rng.random_range(1..=CHANGES) {
        let at = rng.random_range(0..=bytes.len());
        let word = words.choose(&mut rng).copied().unwrap_or_default();
        match rng.random_range(0..7) {
            0 if at < bytes.len() => bytes[at] ^= 1 << rng.random_range(0..8),
            1 if at < bytes.len() => bytes[at] = rng.random(),
            2 => bytes.truncate(at),
            3 => drop(bytes.splice(at..at, word.iter().copied())),
            4 => {
                let end = (at + word.len()).min(bytes.len());
                bytes.splice(at..end, word.iter().copied());
            }
            5 => {
                let other = files.choose(&mut rng).map_or(&[][..], Vec::as_slice);
                let from = rng.random_range(0..=other.len());
                let to = rng.random_range(from..=other.len());
                bytes.splice(at..at, other[from..to].iter().copied());
            }
            // another number in the place of the next one
            _ => {
                let length = |bytes: &[u8]| bytes.iter().take_while(|b| b.is_ascii_digit()).count();
                if let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit).map(|k| at + k) {
                    let number = numbers.choose(&mut rng).copied().unwrap_or_default();
                    bytes.splice(start..start + length(&bytes[start..]), number.iter().copied());
                }
            }
        }
        bytes.truncate(LONGEST);
    }
    bytes
}

/// Runs all cases. What runs is on the disk before it runs, so that it is there whatever becomes of the process.
fn run_cases(folder: &Path) {
    let corpora: Vec<_> = PARSERS.iter().map(|(name, _)| files_of(name)).collect();
    for index in 0..CASES {
        let (name, parse) = PARSERS[index % PARSERS.len()];
        let bytes = case(index, &corpora[index % PARSERS.len()]);
        std::fs::write(folder.join("case"), &bytes).unwrap();
        std::fs::write(folder.join("name"), format!("case {index} of {name}")).unwrap();
        let begin = Instant::now();
        parse(&bytes);
        assert!(begin.elapsed() < LIMIT, "it took {:?}", begin.elapsed());
    }
}

/// The cases run in a process of their own with limited memory and time. The first that ends it is kept.
#[test]
#[ignore = "20,000 cases, minutes"]
fn mutations_of_the_corpus_are_refused_or_read() {
    if let Some(folder) = std::env::var_os(ASKED) {
        return run_cases(folder.as_ref());
    }
    let dir = tempfile::tempdir().unwrap();
    let this = "mutations::mutations_of_the_corpus_are_refused_or_read";
    let output = Command::new("timeout")
        .args([LONGEST_RUN_S, "sh", "-c", "ulimit -v $1; shift; exec \"$0\" \"$@\""])
        .arg(std::env::current_exe().unwrap())
        .args([MEMORY_KB, "--exact", this, "--ignored", "--nocapture", "--test-threads=1"])
        .env(ASKED, dir.path())
        .output()
        .unwrap();
    let last = std::fs::read_to_string(dir.path().join("name")).unwrap_or_default();
    let said = String::from_utf8_lossy(&output.stderr);
    let end: String = said.lines().rev().take(4).collect::<Vec<_>>().join("\n");
    assert!(output.status.success(), "{last}, in {}: {end}", dir.keep().display());
}

/// The corpus holds what was found once; every file of it is read or refused as it stands.
#[test]
fn the_corpus_is_refused_or_read() {
    for (name, parse) in PARSERS {
        let files = files_of(name);
        assert!(files.len() >= 2, "{name}: {} files", files.len());
        for bytes in files {
            parse(&bytes);
        }
    }
}
