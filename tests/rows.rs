//! Designed rows: chosen from those that a press was recorded with.

use crate::command::{json, sessions, words};
use crate::score::score;
use serde_json::Value;

fn score_of(board: &Value, decoder: &str, m: u64, left_out: bool, sensing: &str, score: &str) -> f64 {
    let rows = board["rows"].as_array().unwrap();
    let found = rows
        .iter()
        .find(|r| (r["decoder"] == decoder && r["m"] == m) && (r["left_out"] == left_out && r["sensing"] == sensing));
    found.unwrap_or_else(|| panic!("no row of {decoder} at M = {m}, {sensing}"))[score].as_f64().unwrap()
}

/// Floors of means over five objects: what an analysis of its own in numpy reached with greedily chosen rows (.61, .70
/// and .73 IoU of objects that were left out, at M = 13, 20 and 25; random .52, .61, .64), less .01; and classes.
#[test]
#[ignore = "half a minute on fifty presses"]
fn chosen_rows_see_more_of_the_real_skin() {
    let dir = tempfile::tempdir().unwrap();
    let arguments =
        "--decoder nn_lmmse,evidence --sensing random,chosen --left-out --measurements 5,7,13,20,25 --no-times";
    let Some(board) = score(dir.path(), &words(arguments)) else {
        return;
    };
    for (m, least) in [(13, 0.60), (20, 0.69), (25, 0.72)] {
        let iou = |sensing| score_of(&board, "nn_lmmse", m, true, sensing, "iou");
        let (random, chosen) = (iou("random"), iou("chosen"));
        assert!(chosen >= least, "M = {m}: IoU {chosen:.3}, at least {least}");
        assert!(chosen >= random + 0.05, "M = {m}: IoU {chosen:.3}, random {random:.3}");
    }
    let class = |sensing| score_of(&board, "evidence", 5, false, sensing, "class_single");
    let (random, chosen) = (class("random"), class("chosen"));
    assert!(chosen >= 0.93 && chosen > random, "classes: {chosen:.3}, random {random:.3}");
    for sensing in ["random", "chosen"] {
        let objects = board["objects"].as_array().unwrap().iter();
        let here = objects.filter(|o| o["decoder"] == "nn_lmmse" && o["m"] == 20 && o["sensing"] == sensing);
        assert_eq!(here.count(), 10, "five objects, learned from or not");
    }
    let places = board["localisation"].as_array().unwrap();
    let mean = |sensing: &str| {
        let found = places
            .iter()
            .find(|r| r["decoder"] == "blob" && r["m"] == 7 && r["relabelled"] == true && r["sensing"] == sensing);
        found.unwrap()["mean_px"].as_f64().unwrap()
    };
    assert!(mean("chosen") < mean("random"), "{} {}", mean("chosen"), mean("random"));
}

/// Any number of threads gives the same choice, and a board that was saved without the kind of its rows is one of
/// consecutive rows.
#[test]
fn chosen_boards_are_reproducible_and_compared() {
    let dir = tempfile::tempdir().unwrap();
    sessions(dir.path(), 3);
    let arguments = words(
        "score all --decoder nn_lmmse --sensing chosen,random --measurements 9 --no-times --json --save board.json",
    );
    let on = |more: &str| json(dir.path(), &[&arguments[..], &words(more)].concat());
    let first = on("--threads 1");
    assert_eq!(first["rows"].as_array().unwrap().len(), 2);
    let path = dir.path().join("board.json");
    let mut older: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let rows = older["rows"].as_array_mut().unwrap();
    rows.retain(|r| r["sensing"] == "random");
    rows.iter_mut().for_each(|r| drop(r.as_object_mut().unwrap().remove("sensing")));
    std::fs::write(dir.path().join("older.json"), older.to_string()).unwrap();
    let second = on("--threads 2 --against older.json --tolerance 0");
    assert_eq!(first["rows"], second["rows"]);
    assert_eq!(second["regressions"], Value::Array(vec![]));
}
