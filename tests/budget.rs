//! The error budget through its command.

use crate::command::{files, json, words};
use serde_json::Value;
use spts_circuit::PROFILES;
use std::path::Path;

/// Runs a quick budget of two objects with `readout` in `dir`; its rows and end points.
fn budget(dir: &Path, readout: &str, threads: &str) -> Value {
    let arguments = words("budget --quick --objects brain,rec --measurements 20 --decode matched");
    let more = ["--readout", readout, "--threads", threads, "--out", threads, "--json"];
    json(dir, &[&arguments[..], &more].concat())
}

/// `as_built` with another idle noise in its compressive mode, as a file; its name.
fn with_idle_noise(dir: &Path, sd_v: f64) -> &'static str {
    let (_, text) = PROFILES.iter().find(|(name, _)| *name == "as_built").unwrap();
    let mut profile: toml::Table = text.parse().unwrap();
    let noise = &mut profile["compressive"]["idle_noise"];
    noise.as_table_mut().unwrap().insert("sd_v".to_owned(), sd_v.into());
    std::fs::write(dir.join("noise.toml"), toml::to_string(&profile).unwrap()).unwrap();
    "noise.toml"
}

fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("{key} in {row}"))
}

/// Parts of the transducer that can be taken away.
const PARTS: [&str; 5] = ["spread", "session", "hysteresis", "creep", "conditioning"];

const CHANGES: [&str; 5] = ["support", "iou", "class_single", "class_vote20", "iou_contact"];

/// The same bytes for one thread and two.
#[test]
#[ignore = "two budgets: half a minute"]
fn a_budget_does_not_depend_on_the_threads() {
    let dir = tempfile::tempdir().unwrap();
    let of = |threads: &str| {
        budget(dir.path(), "as_built", threads);
        files(&dir.path().join(threads))
    };
    assert!(of("1") == of("2"));
}

/// Every key, every effect in both directions; and nothing for what does nothing: rails that are never reached, and
/// noise of no amplitude, change no bit of a recording.
#[test]
fn a_quick_budget_is_complete_and_charges_nothing_for_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let readout = with_idle_noise(dir.path(), 0.0);
    let report = budget(dir.path(), readout, "2");
    let rows = report["rows"].as_array().unwrap();
    // five parts of the transducer, the effects of the profile and five stages, in both directions, and the contact
    let (_, text) = PROFILES.iter().find(|(name, _)| *name == "as_built").unwrap();
    let profile: toml::Table = text.parse().unwrap();
    let effects = profile["compressive"].as_table().unwrap().len();
    assert_eq!(rows.len(), 2 * (PARTS.len() + effects + 5) + 1);
    for part in PARTS {
        assert!(rows.iter().any(|row| row["stage"] == "transducer" && row["effect"] == part), "{part}");
    }
    for row in rows {
        assert!(row["sessions"] == 3);
        assert!(row["stage"].is_string() && row["decode"] == "matched" && row["m"] == 20 && row["taxels"] == 100);
        assert!(["ablation", "addition"].contains(&row["mode"].as_str().unwrap()));
        for change in CHANGES {
            let (delta, se) = (number(row, &format!("{change}_delta")), number(row, &format!("{change}_se")));
            assert!((-1.0..=1.0).contains(&delta) && (0.0..=1.0).contains(&se), "{row}");
            if row["effect"] == "rails" || row["effect"] == "idle_noise" {
                assert!(delta.abs() <= 0.0 && se <= 0.0, "{row}");
            }
        }
    }
    for point in report["end_points"].as_array().unwrap() {
        assert!((0.0..=1.0).contains(&number(point, "iou")), "{point}");
    }
    for name in words("budget.csv end_points.csv summary.md figures/budget_matched.png provenance.json") {
        assert!(dir.path().join("2").join(name).is_file(), "{name}");
    }
}

/// 2 V of noise, against images of a few volts, hides everything else: it is the largest cost in both directions, and
/// stands out of its error.
#[test]
fn a_huge_noise_is_the_largest_cost() {
    let dir = tempfile::tempdir().unwrap();
    let readout = with_idle_noise(dir.path(), 2.0);
    let report = budget(dir.path(), readout, "2");
    let rows = report["rows"].as_array().unwrap();
    for (mode, sign) in [("ablation", 1.0), ("addition", -1.0)] {
        let of_mode = rows.iter().filter(|r| r["mode"] == mode && r["effect"] != "whole_stage");
        let cost = |row: &&Value| sign * number(row, "iou_delta");
        let largest = of_mode.max_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap();
        assert_eq!(largest["effect"], "idle_noise", "{mode}: {largest}");
        assert!(cost(&largest) > 2.0 * number(largest, "iou_se"), "{largest}");
    }
}
