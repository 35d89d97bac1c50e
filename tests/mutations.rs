//! Seeded mutations of a committed corpus, driven through every parser on a stable compiler.
#![cfg(unix)]

use rand::seq::IndexedRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_tests::parsers::PARSERS;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Cases in all.
const CASES: usize = 20_000;
/// Time that one case may take.
const LIMIT: Duration = Duration::from_secs(5);
/// Address space of the process that runs the cases, kB.
const MEMORY_KB: &str = "4000000";
/// Status of the process when a case takes too long.
const TIMED_OUT: i32 = 77;
/// Asks this test for the cases from a number on, and says where the report goes.
const ASKED: &str = "SPTS_MUTATIONS_FROM";
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

/// Words that parsers know, and numbers at the ends of their types.
const WORDS: &[&[u8]] = &[
    b"v ",
    b"f ",
    b"facet",
    b"vertex",
    b"endsolid",
    b"glTF",
    b"JSON",
    b"\x93NUMPY",
    b"'descr'",
    b"(",
    b"[",
    b"{",
    b"PK\x03\x04",
    b"-1",
    b"0",
    b"nan",
    b"inf",
    b"1e308",
    b"-1e308",
    b"3e38",
    b"4294967295",
    b"4294967296",
    b"18446744073709551615",
    b"9223372036854775808",
    b"1e-320",
    b"null",
    b"\xef\xbb\xbf",
    b"\xff\xfe",
    b"\0",
    b"\n",
    b"\"",
    b",",
    b":",
    b"=",
    b"\xff\xff\xff\xff",
    b"\xff\xff\xff\x7f",
    b"\0\0\0\0",
    b"\x0e\0\0\0",
    b"\x0f\0\0\0",
];

/// Case `index`: a file of the corpus with some changes, the same on any machine.
fn case(index: usize, files: &[Vec<u8>]) -> Vec<u8> {
    let mut rng = ChaCha8Rng::seed_from_u64(index as u64);
    let mut bytes = files.choose(&mut rng).cloned().unwrap_or_default();
    for _ in 0..rng.random_range(1..=CHANGES) {
        let at = rng.random_range(0..=bytes.len());
        match rng.random_range(0..7) {
            0 if at < bytes.len() => bytes[at] ^= 1 << rng.random_range(0..8),
            1 if at < bytes.len() => bytes[at] = rng.random(),
            2 => bytes.truncate(at),
            3 => {
                let word = WORDS.choose(&mut rng).copied().unwrap_or_default();
                bytes.splice(at..at, word.iter().copied());
            }
            4 => {
                let word = WORDS.choose(&mut rng).copied().unwrap_or_default();
                let end = (at + word.len()).min(bytes.len());
                bytes.splice(at..end, word.iter().copied());
            }
            5 => {
                let other = files.choose(&mut rng).map_or(&[][..], Vec::as_slice);
                let from = rng.random_range(0..=other.len());
                let to = rng.random_range(from..=other.len());
                bytes.splice(at..at, other[from..to].iter().copied());
            }
            _ => replace_number(&mut bytes, at, &mut rng),
        }
        bytes.truncate(LONGEST);
    }
    bytes
}

/// Puts an extreme number in the place of the first one behind `at`.
fn replace_number(bytes: &mut Vec<u8>, at: usize, rng: &mut ChaCha8Rng) {
    let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit).map(|k| at + k) else {
        return;
    };
    let length = bytes[start..].iter().take_while(|b| b.is_ascii_digit()).count();
    let numbers = [
        "0",
        "-1",
        "1e300",
        "nan",
        "4294967296",
        "18446744073709551615",
        "100000",
        "0.1",
        "1e-300",
    ];
    let number = numbers.choose(rng).copied().unwrap_or_default();
    bytes.splice(start..start + length, number.bytes());
}

/// Runs the cases from the number that is asked for on, and notes in a file which one runs and what has come of them.
fn run_cases(from: usize, report: &Path) {
    std::panic::set_hook(Box::new(|_| {}));
    let corpora: Vec<_> = PARSERS.iter().map(|(name, _)| files_of(name)).collect();
    let current = Arc::new(AtomicUsize::new(from));
    let file = Arc::new(Mutex::new(std::fs::File::options().append(true).open(report).unwrap()));
    let say = |line: String| writeln!(file.lock().unwrap(), "{line}").unwrap();
    let watched = Arc::clone(&current);
    let told = Arc::clone(&file);
    std::thread::spawn(move || {
        let mut last = (usize::MAX, 0);
        loop {
            std::thread::sleep(Duration::from_millis(500));
            let now = watched.load(Ordering::Relaxed);
            last = if now == last.0 { (now, last.1 + 1) } else { (now, 0) };
            if Duration::from_millis(500 * last.1) > LIMIT {
                writeln!(told.lock().unwrap(), "time-out {now}").unwrap();
                std::process::exit(TIMED_OUT);
            }
        }
    });
    for index in from..CASES {
        current.store(index, Ordering::Relaxed);
        let parser = index % PARSERS.len();
        let bytes = case(index, &corpora[parser]);
        say(format!("case {index}"));
        if std::panic::catch_unwind(|| PARSERS[parser].1(&bytes)).is_err() {
            say(format!("panic {index}"));
        }
    }
    say("end".to_owned());
}

/// The cases run in a process of their own with limited memory, which is started again behind a case that ends it.
#[test]
#[ignore = "20,000 cases, minutes"]
fn mutations_of_the_corpus_are_refused_or_read() {
    if let Ok(asked) = std::env::var(ASKED) {
        let (from, report) = asked.split_once(':').unwrap();
        run_cases(from.parse().unwrap(), Path::new(report));
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let report = dir.path().join("report");
    std::fs::write(&report, "").unwrap();
    let (mut from, mut aborts) = (0, Vec::new());
    let read = || std::fs::read_to_string(&report).unwrap();
    let numbers = |word: &str| -> Vec<usize> {
        let text = read();
        let lines = text
            .lines()
            .filter_map(|line| line.strip_prefix(word)?.strip_prefix(' ')?.parse().ok());
        lines.collect()
    };
    while !read().lines().any(|line| line == "end") {
        let output = Command::new("sh")
            .args(["-c", "ulimit -v $1; shift; exec \"$0\" \"$@\""])
            .arg(std::env::current_exe().unwrap())
            .args([
                MEMORY_KB,
                "--exact",
                "mutations::mutations_of_the_corpus_are_refused_or_read",
                "--ignored",
            ])
            .args(["--nocapture", "--test-threads=1"])
            .env(ASKED, format!("{from}:{}", report.display()))
            .output()
            .unwrap();
        if read().lines().any(|line| line == "end") {
            break;
        }
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let last = *numbers("case")
            .last()
            .unwrap_or_else(|| panic!("no case was run: {said}"));
        assert!(last >= from, "no case was run: {said}");
        if output.status.code() != Some(TIMED_OUT) {
            aborts.push(last);
        }
        from = last + 1;
        if from == CASES {
            break;
        }
    }
    let (panics, time_outs, ran) = (numbers("panic"), numbers("time-out"), numbers("case").len());
    eprintln!(
        "{ran} cases, {} panics, {} aborts, {} time-outs",
        panics.len(),
        aborts.len(),
        time_outs.len()
    );
    let failed: Vec<usize> = [&panics[..], &aborts, &time_outs].concat();
    for index in &failed {
        let (name, _) = PARSERS[index % PARSERS.len()];
        let path = std::env::temp_dir().join(format!("spts-mutation-{name}-{index}"));
        std::fs::write(&path, case(*index, &files_of(name))).unwrap();
        eprintln!("case {index} of {name}: {}", path.display());
    }
    assert!(
        failed.is_empty(),
        "{panics:?} panicked, {aborts:?} aborted, {time_outs:?} took too long"
    );
    assert_eq!(ran, CASES);
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
