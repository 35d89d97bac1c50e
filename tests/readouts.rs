//! The benchmark of readouts through its command.

use crate::command::{files, json, succeeds, words};
use serde_json::Value;

const TINY: &str = "readouts --taxels 64 --repetitions 2 --shapes 2";

#[test]
fn a_benchmark_is_written_whole_and_does_not_depend_on_the_threads() {
    let dir = tempfile::tempdir().unwrap();
    let mut printed = Vec::new();
    for threads in ["1", "3"] {
        let command = format!("{TINY} --json --out {threads} --threads {threads}");
        printed.push(succeeds(dir.path(), &words(&command)).stdout);
    }
    assert!(printed[0] == printed[1], "the numbers depend on the number of threads");
    let (one, three) = (files(&dir.path().join("1")), files(&dir.path().join("3")));
    assert!(one == three, "the files depend on the number of threads");
    for name in ["readouts.csv", "readouts.md", "published.csv", "figures/readouts.png", "figures/readouts.svg"] {
        assert!(one.contains_key(name), "{name}");
    }

    let report: Value = serde_json::from_slice(&printed[0]).unwrap();
    let rows = report["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 6);
    let row = |name: &str| rows.iter().find(|row| row["readout"] == name).unwrap();
    // 64 taxels: a scan of as many measurements, and as many chips
    for name in ["raster", "code_division"] {
        let trial = &row(name)["trials"][0];
        assert_eq!(trial["measurements"], 64, "{name}");
        let [mean, low, high] = ["mean", "low", "high"].map(|key| trial["iou"][key].as_f64().unwrap());
        assert!(low <= mean && mean <= high && mean > 0.8, "{name}: {low} {mean} {high}");
    }
    // the same clock for all: an image takes M measurements of it
    let period_s = report["wires"][0]["period_s"].as_f64().unwrap();
    for trial in rows.iter().flat_map(|row| row["trials"].as_array().unwrap()) {
        let measured = trial["measurements"].as_f64().unwrap() * trial["frames_hz"].as_f64().unwrap() * period_s;
        assert!((measured - 1.0).abs() < 1e-9, "{trial}");
    }
    assert!(
        report["published"].as_array().unwrap().iter().all(|p| p["source"].as_str().is_some_and(|s| !s.is_empty()))
    );
    // a line a number of measurements, and the head
    let trials: usize = rows.iter().map(|row| row["trials"].as_array().unwrap().len()).sum();
    assert_eq!(String::from_utf8_lossy(&one["readouts.csv"]).lines().count(), 1 + trials);
}

#[test]
fn readouts_are_chosen_and_other_seeds_give_other_numbers() {
    let dir = tempfile::tempdir().unwrap();
    let run = |seed: u32| {
        let command = format!("{TINY} --readout raster,adaptive --json --out {seed} --seed {seed}");
        let report: Value = json(dir.path(), &words(&command));
        report
    };
    let (one, two) = (run(1), run(2));
    assert_eq!(one["rows"].as_array().unwrap().len(), 2);
    assert_ne!(one["rows"], two["rows"]);
}

#[test]
fn the_help_has_examples() {
    let dir = tempfile::tempdir().unwrap();
    let help = succeeds(dir.path(), &["readouts", "--help"]);
    let said = String::from_utf8_lossy(&help.stdout).into_owned();
    assert!(said.contains("spts readouts --quick") && said.contains("code_division"), "{said}");
}
