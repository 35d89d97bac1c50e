//! The theory of the amplifier through its command.

use crate::command::{files, succeeds, words};
use serde_json::Value;

fn json(arguments: &[&str]) -> Value {
    let dir = tempfile::tempdir().unwrap();
    crate::command::json(dir.path(), &[&["circuit", "--json"], arguments].concat())
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} in {value}"))
}

/// A hundred taxels as worked out by hand: NG = 1 + 1 kΩ · 3.825 mS, and from it bandwidth, 7.62 time constants, and
/// the noise of 30.3 nV/√Hz over π/2 of the bandwidth, 56.3 µV, to which 28.9 nV/√Hz · √(1 kHz · ln(2.2 MHz/1 Hz)), 3.5
/// µV of 1/f noise, add as squares; three digits.
#[test]
fn one_size_has_the_numbers_that_scripts_read() {
    let one = json(&["--taxels", "100"]);
    for (key, expected) in [
        ("noise_gain", 4.825),
        ("bandwidth_hz", 2.197e6),
        ("settle_s", 0.552e-6),
        ("noise_v_rms", 56.4e-6),
        ("snr_db", 78.9),
    ] {
        let found = number(&one, key);
        assert!((found / expected - 1.0).abs() < 2e-3, "{key} = {found}, expected {expected}");
    }
    assert_eq!(one["saturates"], Value::Bool(false));
    assert_eq!(one["remedies"].as_array().unwrap().len(), 3);
    let many = json(&["--taxels", "1000000"]);
    assert_eq!(many["saturates"], Value::Bool(true));
    assert_eq!(many["limit"], "settling");
    // a slower clock, a smaller feedback and less on the skin all help
    let slow = json(&words("--taxels 100000 --rate-hz 100 --feedback-ohm 1 --pressed 0.01"));
    // 3.3 V · 150 µS · 1 Ω = 0.5 mV of a taxel are far below the converter's step of 63 mV
    assert_eq!(slow["limit"], "converter_step");
}

#[test]
fn the_table_is_written_whole_and_does_not_depend_on_the_threads() {
    let dir = tempfile::tempdir().unwrap();
    for threads in ["1", "2"] {
        let output = succeeds(dir.path(), &["circuit", "--out", threads, "--threads", threads]);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        // five sizes, four ways, and the two lines of the head
        assert_eq!(text.lines().filter(|l| l.starts_with('|')).count(), 22, "{text}");
    }
    let (one, two) = (files(&dir.path().join("1")), files(&dir.path().join("2")));
    assert!(one == two, "the files depend on the number of threads");
    assert!(one.contains_key("figures/circuit.png") && one.contains_key("parameters.json"));
    let table = String::from_utf8(one["circuit.csv"].clone()).unwrap();
    assert_eq!(table.lines().count(), 1 + 13 * 4);
    assert!(table.starts_with("taxels,remedy,wires,"), "{table}");
}

/// The example of the help, and what a taxel's capacitance takes: wires enough, and one less not enough, at every size
/// that can be looked at wire by wire.
#[test]
fn taxels_with_a_capacitance_have_a_table_of_their_own() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), &["circuit", "--taxel-pf", "20", "--pressed", "0.1", "--out", "out/soft"]);
    let soft = String::from_utf8(files(dir.path())["out/soft/circuit.csv"].clone()).unwrap();
    let hard = tempfile::tempdir().unwrap();
    succeeds(hard.path(), &["circuit", "--pressed", "0.1", "--out", "out"]);
    let hard = String::from_utf8(files(hard.path())["out/circuit.csv"].clone()).unwrap();
    let wires = |table: &str| -> Vec<u32> {
        let of_wires = table.lines().filter(|line| line.split(',').nth(1) == Some("wires"));
        of_wires.map(|line| line.split(',').nth(2).unwrap().parse().unwrap()).collect()
    };
    let (soft, hard) = (wires(&soft), wires(&hard));
    assert_eq!(soft.len(), 13);
    // a capacitance never saves a wire, and costs some on the largest skin
    assert!(soft.iter().zip(&hard).all(|(soft, hard)| soft >= hard), "{soft:?} {hard:?}");
    assert!(soft[12] > hard[12], "{soft:?} {hard:?}");
}
