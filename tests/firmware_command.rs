//! The cell's firmware through its command.

use crate::command::{spts, succeeds, words};
use serde_json::Value;
use spts_circuit::{Seeding, WeightMode, Weights};
use std::path::Path;

fn json(dir: &Path, arguments: &[&str]) -> Value {
    crate::command::json(dir, &[&["firmware"], arguments, &["--json"]].concat())
}

#[test]
fn verify_says_what_scripts_read() {
    let dir = tempfile::tempdir().unwrap();
    let found = json(dir.path(), &["verify", "--cells", "100", "--edges", "1000"]);
    assert_eq!((found["cells"].as_u64(), found["edges"].as_u64()), (Some(100), Some(1000)));
    assert_eq!(found["mismatches"], 0);
    let modes = found["modes"].as_array().unwrap();
    let periods: Vec<Option<u64>> = modes.iter().map(|mode| mode["period"].as_u64()).collect();
    assert_eq!(periods, [None, None, None, Some(7), Some(20), Some(64)]);
    assert!(found["instructions_per_s"].as_f64().unwrap() > 0.0);
    // seeds of 32 bits, and more cells than the raster counts
    for seeding in ["address", "mixed"] {
        let more = json(dir.path(), &["verify", "--cells", "112", "--edges", "300", "--seeding", seeding]);
        assert_eq!(more["mismatches"], 0, "{seeding}");
    }
}

/// A clock beyond what the shipped image can follow: half of a binary sequence that is out of step is wrong by chance.
#[test]
fn verify_finds_lost_edges_and_says_no() {
    let dir = tempfile::tempdir().unwrap();
    let arguments = words("firmware verify --mode binary --edges 2000 --edge-hz 400000 --json");
    let output = spts(dir.path(), &arguments);
    assert_eq!(output.status.code(), Some(1));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let share = found["mismatches"].as_f64().unwrap() / (100.0 * 2000.0);
    assert!((0.4..0.6).contains(&share), "{share}");
    assert!(String::from_utf8_lossy(&output.stderr).starts_with("error: image shipped"));
}

#[test]
fn weights_are_the_circuit_s_in_a_file() {
    let dir = tempfile::tempdir().unwrap();
    let arguments = words("firmware weights --edges 500 --mode analog --seeding mixed --out w.npy");
    succeeds(dir.path(), &arguments);
    let file = std::fs::File::open(dir.path().join("w.npy")).unwrap();
    let array = npyz::NpyFile::new(file).unwrap();
    assert_eq!(array.shape(), [500, 100]);
    let found: Vec<f64> = array.into_vec().unwrap();
    let mut expected = vec![0.0; 500 * 100];
    Weights::new(WeightMode::Analog, Seeding::Mixed, 100).fill_rows(0, &mut expected);
    assert!(found == expected, "the file differs from the circuit's weights");
}

#[test]
fn a_trace_shows_the_edge() {
    let dir = tempfile::tempdir().unwrap();
    let output = succeeds(dir.path(), &["firmware", "trace", "--taxel", "56", "--mode", "raster"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("interrupt 3") && text.contains("reti") && text.contains("sleep"), "{text}");
}

/// The slow suite's check: a hundred million codes in every mode.
#[test]
#[ignore = "600 million edges of a cell: minutes"]
fn a_million_edges_of_a_hundred_cells() {
    let dir = tempfile::tempdir().unwrap();
    let found = json(dir.path(), &["verify", "--cells", "100", "--edges", "1000000"]);
    assert_eq!(found["mismatches"], 0, "{found}");
}
