//! The folder of a run: whatever ends a run, and whenever, it holds the earlier results or the new ones, and nobody's
//! file is lost.

use crate::command::{SPTS, files, refused, succeeds, words};
use spts::output::{DiskOperation, OutputFolder, watching_disk, write_bytes};
use spts_input::Refusal;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::rc::Rc;
use std::time::{Duration, Instant};

/// A press that takes little time, without its seed.
const PRESS: &str =
    "simulate press/T --contact footprint --set skin.rows=4 --set skin.cols=4 --set press.position_share=[0,0]";

fn press<'a>(out: &'a str, seed: &'a str) -> Vec<&'a str> {
    [words(PRESS), vec!["--out", out, "--seed", seed]].concat()
}

/// Files by their names below a folder.
type Files = BTreeMap<String, Vec<u8>>;

/// Puts `results` into `out` as every command does.
fn put(results: &Files, out: &Path) -> Result<(), Refusal> {
    let folder = OutputFolder::open(out)?;
    for (name, bytes) in results {
        if let Some((parent, _)) = name.rsplit_once('/') {
            folder.folder(parent)?;
        }
        write_bytes(&folder.path(name), bytes)?;
    }
    folder.commit().map(drop)
}

/// `folder`, opened and left. A child that another test starts at this moment has a copy of the lock of a run that "was
/// killed", until it runs its own program.
fn open_and_leave(folder: &Path) {
    let begin = Instant::now();
    loop {
        match OutputFolder::open(folder) {
            Err(error) if error.to_string().contains("another run") && begin.elapsed() < Duration::from_secs(10) => {
                std::thread::sleep(Duration::from_millis(5));
            }
            opened => return drop(opened.unwrap()),
        }
    }
}

/// All files of `dir`, which may be missing.
fn there(dir: &Path) -> Files {
    let mut found = if dir.exists() { files(dir) } else { Files::new() };
    found.retain(|name, _| !name.ends_with('/'));
    found
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &to.join(entry.file_name()));
        } else {
            std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
        }
    }
}

/// When a step is made to fail.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    /// This step alone, as when a network folder is away for a moment.
    Once,
    /// This one and all that follow, as on a full disk.
    FromThen,
    /// None, but what the disk holds before this step is what a killed run leaves.
    Killed,
}

/// Every operation on the disk of a run that puts its results in place, each made to fail once and for good, and each
/// the last one. `old` is empty for a new folder.
fn check_every_step(old: &Files, new: &Files, exchanges: bool) {
    const INVALID: i32 = 22;
    // where the disk does not slow the steps down, if there is such a place
    let dir = tempfile::tempdir_in("/dev/shm").unwrap_or_else(|_| tempfile::tempdir().unwrap());
    let [base, whole] = ["base", "whole"].map(|name| dir.path().join(name));
    std::fs::create_dir(&base).unwrap();
    if !old.is_empty() {
        put(old, &base.join("out")).unwrap();
    }
    let before = there(&base.join("out"));
    copy(&base, &whole);
    // a file system that cannot exchange says so, whatever else fails
    let watched = |out: &Path, fault: Box<dyn Fn(usize) -> io::Result<()>>| {
        let step = Rc::new(Cell::new(0));
        let at = Rc::clone(&step);
        let watcher = move |operation: DiskOperation, _: &Path| {
            fault(at.replace(at.get() + 1))?;
            match operation {
                DiskOperation::Exchange if !exchanges => Err(io::Error::from_raw_os_error(INVALID)),
                _ => Ok(()),
            }
        };
        (watching_disk(Rc::new(watcher), || put(new, out)), step.get())
    };
    let (result, steps) = watched(&whole.join("out"), Box::new(|_| Ok(())));
    result.unwrap();
    let after = there(&whole.join("out"));
    assert!(before != after && steps > 30, "{steps} steps");
    let (mut earlier, mut later, mut aside) = (0, 0, 0);
    for (step, fault) in (0..steps).flat_map(|step| [Fault::Once, Fault::FromThen, Fault::Killed].map(|f| (step, f))) {
        let work = tempfile::tempdir_in(dir.path()).unwrap();
        let [run, killed] = ["run", "killed"].map(|name| work.path().join(name));
        copy(&base, &run);
        let (from, to) = (run.clone(), killed.clone());
        let fails = move |now: usize| match fault {
            Fault::Once if now == step => Err(io::ErrorKind::StorageFull.into()),
            Fault::FromThen if now >= step => Err(io::ErrorKind::StorageFull.into()),
            Fault::Killed if now == step => {
                copy(&from, &to);
                Ok(())
            }
            _ => Ok(()),
        };
        let (result, _) = watched(&run.join("out"), Box::new(fails));
        let what = format!("step {step}, {fault:?}, {result:?}");
        let left = if fault == Fault::Killed { &killed } else { &run };
        let out = left.join("out");
        let found = there(&out);
        match (found == before, found == after) {
            (true, _) => earlier += 1,
            (_, true) => later += 1,
            // between two renames there is no folder, never half of one
            _ => {
                assert!(!exchanges && !out.exists(), "{what}: a mixture: {:?}", found.keys());
                assert_eq!(there(&left.join(".out.spts-old")), before, "{what}");
                aside += 1;
            }
        }
        match (fault, result.is_ok()) {
            (Fault::Once, false) => assert_eq!(found, before, "{what}"),
            (Fault::Once | Fault::FromThen, true) => assert_eq!(found, after, "{what}"),
            _ => {}
        }
        // a run that writes nothing puts back what was away
        open_and_leave(&out);
        let again = there(&out);
        assert!(again == before || again == after, "{what}: not put back");
        // and the next run leaves nothing of this one
        put(new, &out).unwrap();
        assert_eq!(there(&out), after, "{what}: the run after");
        let names: Vec<String> = files(left).into_keys().filter(|name| name.contains(".spts")).collect();
        assert!(names.is_empty(), "{what}: left behind: {names:?}");
    }
    eprintln!(
        "{steps} steps, each failed once, failed for good, and was the last: {earlier} times the earlier results, {later} times the new \
         ones, {aside} times put aside and put back; 0 mixtures"
    );
}

#[test]
fn a_run_fails_or_is_killed_at_every_step() {
    let dir = tempfile::tempdir().unwrap();
    let [old, new] = ["1", "2"].map(|seed| {
        succeeds(dir.path(), &press(seed, seed));
        let mut found = there(&dir.path().join(seed));
        found.remove("manifest.json");
        let in_folders = |(name, bytes): (String, Vec<u8>)| match seed {
            // results of which some lie in folders, and not in the same ones
            "1" if name.ends_with(".npy") => (format!("arrays/{name}"), bytes),
            _ if name.ends_with(".csv") => (format!("tables/csv/{name}"), bytes),
            _ => (name, bytes),
        };
        found.into_iter().map(in_folders).collect::<Files>()
    });
    for exchanges in [true, false] {
        check_every_step(&old, &new, exchanges);
    }
    check_every_step(&Files::new(), &new, true);
}

/// What is in a results folder, without what differs from run to run.
fn shown(dir: &Path) -> Files {
    let mut found = there(dir);
    found.remove("timing.json");
    found
}

fn names(dir: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(dir).unwrap();
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// The program itself, ended by the system: killed, or by a signal, after which it clears up.
#[test]
fn a_run_that_is_ended_leaves_one_set() {
    let dir = tempfile::tempdir().unwrap();
    let sets = ["1", "2"].map(|seed| {
        let start = Instant::now();
        succeeds(dir.path(), &press("out", seed));
        (shown(&dir.path().join("out")), start.elapsed())
    });
    let length = sets[1].1;
    let (mut old, mut new) = (0, 0);
    for k in 0..24 {
        succeeds(dir.path(), &press("out", "1"));
        let mut run = start(dir.path(), &press("out", "2"));
        // the last third of a run is where it writes
        std::thread::sleep(length.mul_f64(0.6 + 0.02 * f64::from(k)));
        let signal = if k % 2 == 0 { "-KILL" } else { "-INT" };
        let _ = Command::new("kill").args([signal, &run.id().to_string()]).status();
        let tidy = run.wait().unwrap().code() == Some(128 + 2);
        assert!(!tidy || names(dir.path()) == ["out"], "{:?}", names(dir.path()));
        let found = shown(&dir.path().join("out"));
        match [&sets[0].0, &sets[1].0].map(|set| *set == found) {
            [true, false] => old += 1,
            [false, true] => new += 1,
            _ => panic!("a mixture: {:?}", found.keys().collect::<Vec<_>>()),
        }
    }
    eprintln!("ended 24 times: {old} times the earlier results, {new} times the new ones");
    succeeds(dir.path(), &press("out", "1"));
    assert_eq!(names(dir.path()), ["out"], "something is left beside the results");
    // a folder that was made for a run goes with it
    let mut run = start(
        dir.path(),
        &[words(PRESS), words("--presses 200 --out new/deep")].concat(),
    );
    await_lock(&dir.path().join("new/.deep.spts-lock"));
    assert!(
        Command::new("kill")
            .args(["-INT", &run.id().to_string()])
            .status()
            .unwrap()
            .success()
    );
    assert_eq!(run.wait().unwrap().code(), Some(128 + 2));
    assert_eq!(names(dir.path()), ["out"]);
}

fn start(dir: &Path, arguments: &[&str]) -> Child {
    let mut command = Command::new(SPTS);
    command.args(arguments).current_dir(dir);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

fn await_lock(lock: &Path) {
    let begin = Instant::now();
    while !lock.exists() {
        assert!(begin.elapsed() < Duration::from_secs(60), "the run does not start");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// The second of two runs with one folder is refused, and the first does not notice.
#[test]
fn a_second_run_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let mut first = start(dir.path(), &press("out", "1"));
    await_lock(&dir.path().join(".out.spts-lock"));
    refused(
        dir.path(),
        &press("out", "2"),
        &["out: another run is writing to this folder"],
    );
    assert!(first.wait().unwrap().success());
    succeeds(dir.path(), &press("alone", "1"));
    assert_eq!(shown(&dir.path().join("out")), shown(&dir.path().join("alone")));
}

/// A folder with anything that no run has written is refused before anything is computed, and so is one that cannot be
/// replaced; all of it stays.
#[test]
fn folders_that_are_not_a_run_s_are_refused_first() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    succeeds(here, &press("out", "1"));
    // without a recording, an earlier run's recordings go
    succeeds(here, &[&press("out", "1")[..], &["--no-record"]].concat());
    assert!(!here.join("out/session.json").exists());
    std::fs::write(here.join("out/notes.txt"), "precious").unwrap();
    let scene = "# a comment of mine\ncontact.model = \"footprint\"\n[press]\nobject = \"T\"\npresses = 200\n";
    std::fs::write(here.join("scene.toml"), scene).unwrap();
    std::fs::create_dir_all(here.join("results/frames.csv")).unwrap();
    std::fs::write(here.join("results/frames.csv/mine"), "precious").unwrap();
    std::fs::create_dir(here.join("empty")).unwrap();
    let before = files(here);
    let not_ours = "is not a result of an earlier run and is not replaced; move it away or choose another folder";
    for (command, facts) in [
        ("simulate scene.toml --out out", ["out/notes.txt", not_ours]),
        ("simulate scene.toml --out .", ["./out/", not_ours]),
        (
            "simulate scene.toml --out results",
            ["results/frames.csv/mine", not_ours],
        ),
        (
            "simulate scene.toml --out scene.toml",
            ["scene.toml: is a file; the output has to be a folder", ""],
        ),
        (
            "simulate scene.toml --out scene.toml/out",
            ["scene.toml: is a file", ""],
        ),
        (
            "simulate scene.toml --out /proc/none/out",
            ["/proc/none", "the output folder cannot be made"],
        ),
        (
            "simulate scene.toml --out /",
            ["/: is a mount point", "choose a folder in it"],
        ),
        ("score --twin press/T --out /proc/none/out", ["/proc/none", ""]),
        (
            "score --twin press/T --out new --save /proc/none/board.json",
            ["/proc/none", ""],
        ),
        ("reproduce --out /proc/none/out", ["/proc/none", ""]),
    ] {
        let start = Instant::now();
        refused(here, &words(command), &facts);
        assert!(start.elapsed() < Duration::from_secs(2), "{command}: found late");
        assert!(files(here) == before, "{command}: something was written all the same");
    }
    let in_it = ["simulate", "../scene.toml", "--out", "."];
    refused(
        &here.join("empty"),
        &in_it,
        &[".: is a mount point or the folder that the program works in"],
    );
}

/// A single result takes the place of one like it and of no other file.
#[test]
fn single_files_of_others_are_not_replaced() {
    let dir = tempfile::tempdir().unwrap();
    let mine = "# by hand\n[[effects]]\n";
    for (name, arguments) in [
        ("notes.json", "score --twin press/T --save notes.json"),
        ("mine.toml", "calibrate . --out mine.toml"),
        ("mine.npy", "firmware weights --cells 2 --edges 10 --out mine.npy"),
    ] {
        std::fs::write(dir.path().join(name), mine).unwrap();
        refused(dir.path(), &words(arguments), &[&format!("{name}: is not a result")]);
        assert_eq!(std::fs::read_to_string(dir.path().join(name)).unwrap(), mine);
    }
    let weights = words("firmware weights --cells 2 --edges 10 --out again.npy");
    succeeds(dir.path(), &weights);
    succeeds(dir.path(), &weights);
}

/// Results of two runs beside each other are not decoded as if they were of one.
#[test]
fn a_mixture_is_not_decoded() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), &press("one", "1"));
    succeeds(dir.path(), &press("two", "2"));
    let codes = "compressive_codes.npy";
    std::fs::copy(dir.path().join("two").join(codes), dir.path().join("one").join(codes)).unwrap();
    refused(dir.path(), &["decode", "one"], &[codes, "manifest.json"]);
    // by hand on purpose
    std::fs::remove_file(dir.path().join("one/manifest.json")).unwrap();
    succeeds(dir.path(), &["decode", "one"]);
}

/// Largest resident memory of the run with these arguments, MB, as the kernel says while it lasts.
fn memory_mb(dir: &Path, arguments: &[&str]) -> f64 {
    let mut run = start(dir, arguments);
    let status = format!("/proc/{}/status", run.id());
    let mut most_kb = 0.0_f64;
    loop {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kb = line.and_then(|line| line.trim().strip_suffix(" kB")?.parse().ok());
        most_kb = most_kb.max(kb.unwrap_or(0.0));
        if let Some(ended) = run.try_wait().unwrap() {
            assert!(ended.success(), "{arguments:?}");
            return 1e-3 * most_kb;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// The memory of a run does not grow with its presses, recorded or not.
#[test]
fn memory_is_flat_in_the_number_of_presses() {
    let dir = tempfile::tempdir().unwrap();
    for more in [&["--no-record"][..], &[]] {
        let [few, many] = ["20", "200"].map(|presses| {
            let arguments = ["simulate", "press/T", "--contact", "footprint", "--presses", presses];
            memory_mb(dir.path(), &[&arguments, more].concat())
        });
        eprintln!("{more:?}: {few:.0} MB for 20 presses, {many:.0} MB for 200");
        // a press that is kept takes 5.9 MB: 1060 for 180 of them. The allocator may keep some presses more
        assert!(many < few + 60.0, "{few} MB for 20 presses, {many} MB for 200");
    }
}

/// Ten thousand presses, of a small skin for the sake of the disk, in less than 400 MB.
#[test]
#[ignore = "a minute, and a gigabyte on the disk"]
fn ten_thousand_presses_fit() {
    let dir = tempfile::tempdir().unwrap();
    let memory = memory_mb(
        dir.path(),
        &[&press("out", "1"), &["--presses", "10000", "--no-record"][..]].concat(),
    );
    eprintln!("10000 presses: {memory:.0} MB");
    assert!(memory < 400.0, "{memory} MB");
}
