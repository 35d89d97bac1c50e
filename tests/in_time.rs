//! Contacts followed in time, through the command.

use crate::command::{json, words};
use crate::score::score;
use serde_json::Value;
use std::path::Path;

fn of(row: &Value, score: &str) -> f64 {
    row[score].as_f64().unwrap_or_else(|| panic!("no {score} in {row}"))
}

fn rows<'a>(board: &'a Value, table: &str, contact: &str, hold: bool) -> Vec<&'a Value> {
    let rows = board[table].as_array().unwrap().iter();
    rows.filter(|r| r["contact"] == contact && r["since_touch_s"].is_null() == hold).collect()
}

/// Two simulated objects by windows of 5 and 20 samples.
fn twin(dir: &Path, threads: &str) -> Value {
    let arguments = words("score --in-time --quick --json --measurements 5,20 --twin press/T press/rec --threads");
    json(dir, &[&arguments[..], &[threads]].concat())
}

/// Held simulated presses gain; any number of threads gives the same numbers; tables and figure are there. 20 samples
/// of 100 taxels are at most half of what can be known of an image that holds still: .1 of IoU is the least to gain.
#[test]
fn simulated_presses_gain() {
    let dir = tempfile::tempdir().unwrap();
    let board = twin(dir.path(), "1");
    let held = rows(&board, "rows", "press", true);
    assert_eq!(held.len(), 2);
    for row in held {
        assert!(of(row, "iou_gain") > 0.1 && of(row, "iou_in_time") > 0.85, "{row}");
    }
    // nothing of the rise is lost to what was there before it
    for row in rows(&board, "objects", "press", false) {
        assert!(of(row, "iou_gain") > -0.05, "{row}");
    }
    let out = dir.path().join("out/in_time");
    for file in ["in_time.json", "in_time.csv", "objects.csv", "figures/in_time.png", "figures/in_time.svg"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    let saved = std::fs::read(out.join("in_time.json")).unwrap();
    assert_eq!(serde_json::from_slice::<Value>(&saved).unwrap(), board);
    assert_eq!(twin(dir.path(), "2"), board);
}

/// Two objects of the real skin, each left out, and its ball, by windows of 10 samples. A study of its own in numpy,
/// on presses that are not scored, found an IoU of .80 to .91 in time and .40 to .58 alone during the rise, by windows
/// of 20; and the place of the ball within .5 taxels from the third millisecond on. The bounds are the outer ends of
/// 95 % intervals over objects and drops. That study began where the output is twice that of the untouched skin; the
/// ten milliseconds before are fainter, and more than half of the support has to be right in them.
#[test]
#[ignore = "every window of five objects and of drops: a quarter of a minute"]
fn the_real_skin_gains_in_rise_and_hold_and_on_drops() {
    let dir = tempfile::tempdir().unwrap();
    let Some(board) = score(dir.path(), &words("--in-time --left-out --measurements 10 --object rec,trig")) else {
        return;
    };
    let low = |row: &Value, ci: &str, end: usize| row[ci][end].as_f64().unwrap_or_else(|| panic!("no {ci} in {row}"));
    let rise = rows(&board, "rows", "press", false);
    assert!(rise.len() >= 8, "{}", rise.len());
    for row in rise {
        let [gain, least] = if of(row, "since_touch_s") < 0.01 { [0.1, 0.5] } else { [0.2, 0.75] };
        assert!(low(row, "iou_gain_ci", 0) > gain && of(row, "iou_in_time") > least, "{row}");
    }
    let held = rows(&board, "objects", "press", true);
    assert!(!held.is_empty());
    for row in held {
        assert!(low(row, "iou_gain_ci", 0) > 0.0, "{row}");
    }
    let drops = rows(&board, "rows", "drop", false);
    let late = drops.iter().filter(|row| of(row, "since_touch_s") > 0.0025);
    assert!(late.clone().count() >= 2);
    for row in late {
        assert!(low(row, "error_gain_ci", 1) < 0.0 && of(row, "error_in_time_px") < 0.5, "{row}");
    }
}
