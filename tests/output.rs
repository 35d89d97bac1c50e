//! The folder of a run: whatever ends a run, and whenever, it holds the earlier results or the new ones, and nobody's
//! file is lost.

use crate::command::{SPTS, files, refused, succeeds, words};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A press that takes little time, without its seed.
const PRESS: &str =
    "simulate press/T --contact footprint --set skin.rows=4 --set skin.cols=4 --set press.position_share=[0,0]";

fn press<'a>(out: &'a str, seed: &'a str) -> Vec<&'a str> {
    [words(PRESS), vec!["--out", out, "--seed", seed]].concat()
}

/// What is in a results folder, without what differs from run to run.
fn shown(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = files(dir);
    found.retain(|name, _| !name.ends_with('/') && name != "timing.json");
    found
}

/// Names of what lies in `dir`, hidden files as well.
fn names(dir: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(dir).unwrap();
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// What a run says that it will write is near what it writes; of a drop, whose frames are closer in contact, it is
/// less.
#[test]
fn the_size_of_a_run_is_known_before() {
    let dir = tempfile::tempdir().unwrap();
    for (scene, presses, least) in [("press/T", 12, 0.8), ("bounce", 4, 0.1)] {
        let faster = if scene == "press/T" { "contact.model=footprint" } else { "drop.height_m=0.1" };
        let assignments = [format!("{}={presses}", if scene == "bounce" { "drop.drops" } else { "press.presses" })];
        let assignments = assignments.iter().map(|a| a.parse().unwrap()).chain([faster.parse().unwrap()]).collect();
        let prepared = spts::simulate::Request { scene: scene.to_owned(), assignments }.prepare().unwrap();
        let said = prepared.bytes(true) as f64;
        let arguments = format!("simulate {scene} --presses {presses} --set {faster} --out {presses}");
        succeeds(dir.path(), &words(&arguments));
        let results = files(&dir.path().join(presses.to_string()));
        let pictures = |name: &str| name.ends_with(".png") || name.ends_with(".svg");
        let written: usize = results.iter().filter(|(name, _)| !pictures(name)).map(|(_, bytes)| bytes.len()).sum();
        let share = said / written as f64;
        assert!((least..=1.05).contains(&share), "{scene}: {said} bytes said, {written} written");
    }
    let large = "simulate press/T --presses 100000 --set skin.rows=400 --set skin.cols=400 --contact footprint";
    refused(dir.path(), &words(large), &["a run of 100000 presses or drops needs", "MB are free"]);
}

/// The program itself, ended by the system: killed, or by a signal, after which it clears up.
#[test]
fn a_run_that_is_ended_leaves_one_set() {
    let dir = tempfile::tempdir().unwrap();
    let (here, out) = (dir.path(), dir.path().join("out"));
    let [old, new] = ["1", "2"].map(|seed| {
        let start = Instant::now();
        succeeds(here, &press("out", seed));
        (shown(&out), start.elapsed())
    });
    let signal = |name: &str, run: &mut Child| {
        let _ = Command::new("kill").args([name, &run.id().to_string()]).status();
        run.wait().unwrap().code()
    };
    let mut count = [0; 2];
    for k in 0..12 {
        succeeds(here, &press("out", "1"));
        let mut run = start(here, &press("out", "2"));
        // the last third of a run is where it writes
        std::thread::sleep(new.1.mul_f64(0.6 + 0.04 * f64::from(k)));
        let tidy = signal(["-KILL", "-INT"][k as usize % 2], &mut run) == Some(128 + 2);
        assert!(!tidy || names(here) == ["out"], "{:?}", names(here));
        let found = shown(&out);
        let set = [&old.0, &new.0].into_iter().position(|set| *set == found);
        count[set.unwrap_or_else(|| panic!("a mixture: {:?}", found.keys().collect::<Vec<_>>()))] += 1;
    }
    eprintln!("ended 12 times: {count:?} times the earlier and the new results");
    succeeds(here, &press("out", "1"));
    assert_eq!(names(here), ["out"], "something is left beside the results");
    // a folder that was made for a run goes with it
    let mut run = start(here, &words(&format!("{PRESS} --presses 200 --out new/deep")));
    await_lock(&here.join("new/.deep.spts-lock"));
    assert_eq!(signal("-INT", &mut run), Some(128 + 2));
    assert_eq!(names(here), ["out"]);
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
    refused(dir.path(), &press("out", "2"), &["out: another run is writing to this folder"]);
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
    let scene = "contact.model = \"footprint\"\n[press]\nobject = \"T\"\npresses = 200\n";
    std::fs::write(here.join("scene.toml"), scene).unwrap();
    std::fs::create_dir_all(here.join("results/frames.csv")).unwrap();
    std::fs::write(here.join("results/frames.csv/mine"), "precious").unwrap();
    std::fs::create_dir(here.join("empty")).unwrap();
    let before = files(here);
    for line in REFUSED.trim().lines() {
        let (command, fact) = line.split_once(" | ").unwrap();
        let start = Instant::now();
        refused(here, &words(command), &[fact]);
        assert!(start.elapsed() < Duration::from_secs(2), "{command}: found late");
        assert!(files(here) == before, "{command}: something was written all the same");
    }
}

/// Commands that are refused, and why.
const REFUSED: &str = "
simulate scene.toml --out out | out/notes.txt: is not a result of an earlier run and is not replaced; move it away or
simulate scene.toml --out results | results/frames.csv/mine: is not a result of an earlier run and is not replaced
simulate scene.toml --out scene.toml | scene.toml: is a file; the output has to be a folder
simulate scene.toml --out scene.toml/out | scene.toml: is a file; the output has to be a folder
simulate scene.toml --out /proc/none/out | /proc/none: the output folder cannot be made
simulate scene.toml --out / | /: is a mount point or the folder that the program works in
simulate scene.toml --out . | .: is a mount point or the folder that the program works in
score --twin press/T --out /proc/none/out | /proc/none
score --twin press/T --out new --save /proc/none/board.json | /proc/none
reproduce --out /proc/none/out | /proc/none
";

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
        let [few, many] = ["10", "50"].map(|presses| {
            let arguments = ["simulate", "press/T", "--contact", "footprint", "--presses", presses];
            memory_mb(dir.path(), &[&arguments, more].concat())
        });
        eprintln!("{more:?}: {few:.0} MB for 10 presses, {many:.0} MB for 50");
        // a press that is kept takes 5.9 MB: 236 for 40 of them. The allocator may keep some presses more
        assert!(many < few + 40.0, "{few} MB for 10 presses, {many} MB for 50");
    }
}

/// Ten thousand presses, of a small skin for the sake of the disk, in less than 400 MB.
#[test]
#[ignore = "a minute, and a gigabyte on the disk"]
fn ten_thousand_presses_fit() {
    let dir = tempfile::tempdir().unwrap();
    let memory = memory_mb(dir.path(), &[&press("out", "1"), &["--presses", "10000", "--no-record"][..]].concat());
    eprintln!("10000 presses: {memory:.0} MB");
    assert!(memory < 400.0, "{memory} MB");
}
