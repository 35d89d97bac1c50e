//! Where a finger touches the skin around a robot's arm, which is under preload, through the commands.

use crate::command::json;
use crate::recordings::recordings_with_arm;
use crate::score::score;
use serde_json::Value;

/// An independent analysis finds the touched taxel with a mean error of about 1.5 taxels from 7 measurements, 0.5 from
/// 10 and 0.02 from 25; these are no worse.
const MOST_PX: [(u64, f64); 3] = [(7, 2.0), (10, 0.6), (25, 0.05)];

#[test]
fn touches_of_the_arm_are_located() {
    let Some(root) = recordings_with_arm() else { return };
    let dir = tempfile::tempdir().unwrap();
    let arguments = ["--no-times", "--decoder", "correlate", "--measurements", "7,10,25", "--object", "trig"];
    let Some(board) = score(dir.path(), &arguments) else {
        return;
    };
    let places = board["localisation"].as_array().unwrap();
    for (m, most) in MOST_PX {
        let found = |r: &&Value| r["contact"] == "robot_arm" && r["decoder"] == "taxel" && r["m"] == m;
        let mean_px = places.iter().find(found).unwrap()["mean_px"].as_f64().unwrap();
        assert!(mean_px < most, "{mean_px} taxels at M = {m}, expected less than {most}");
    }
    assert!(places.iter().any(|row| row["contact"] == "ball"));
    assert_eq!(board["slips"], Value::Array(vec![]));

    // the first block has no touch; taxels of the others, by least squares of their whole touches
    let path = root.to_str().unwrap();
    let arguments = "--session robot_arm --json --measurements 50 --windows 20";
    let arguments: Vec<&str> = ["decode", path].into_iter().chain(arguments.split(' ')).collect();
    let decoded: Value = json(dir.path(), &arguments);
    let rows = decoded["rows"].as_array().unwrap();
    let starts = |block: u64| rows.iter().find(|row| row["block"] == block).map(|row| row["start"].as_u64().unwrap());
    // half a second apart at least, where every block without a touch in time would begin in its middle
    for (block, start) in [(1, 43_400), (2, 42_300), (3, 52_000), (4, 61_500), (5, 64_300)] {
        let found = starts(block).unwrap();
        assert!(found.abs_diff(start) <= 1000, "block {block}: touched at {found}, expected {start}");
    }
}
