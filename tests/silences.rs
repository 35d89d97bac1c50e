//! Nothing that is asked for is dropped without a word: decoders, sessions, balls, numbers of measurements.

use crate::command::{SPTS, refused, succeeds, words};
use serde_json::Value;
use std::process::Command;

#[test]
fn what_is_asked_for_is_done_or_refused() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    for (seed, out) in [(0, "first"), (2, "second")] {
        let drop = "simulate bounce --set drop.drops=1 --set drop.duration_s=0.5 --set";
        succeeds(dir, &words(&format!("{drop} seed={seed} --out all/{out}")));
    }
    succeeds(dir, &words("simulate press/T --contact footprint --presses 2 --out all/T"));
    let score = words("score all --decoder tv --measurements 8,20 --no-times --out c --json");
    let output = Command::new(SPTS).args(score).current_dir(dir).output().unwrap();
    // every session of drops is located, under its own name
    let board: Value = serde_json::from_slice(&output.stdout).unwrap();
    let located = board["localisation"].as_array().unwrap().iter().map(|row| row["contact"].as_str().unwrap());
    assert_eq!(located.collect::<std::collections::BTreeSet<_>>().into_iter().collect::<Vec<_>>(), ["first", "second"]);
    // the numbers of measurements are those of the places too; without classes there is no share of right ones
    let numbers = |table: &str, key: &str| {
        let mut all: Vec<u64> = board[table].as_array().unwrap().iter().filter_map(|row| row[key].as_u64()).collect();
        all.dedup();
        all.sort_unstable();
        all.dedup();
        all
    };
    assert_eq!((numbers("rows", "m"), numbers("localisation", "m")), (vec![8, 20], vec![8, 20]));
    assert!(board["rows"].as_array().unwrap().iter().all(|row| row["class_single"].is_null()), "{board}");
    // a decoder that was named is scored or is an error, alone and beside others
    for decoders in ["evidence", "tv,evidence"] {
        let arguments = format!("score all/T --decoder {decoders} --measurements 20 --out c2");
        refused(dir, &words(&arguments), &["`--decoder` = evidence", "record more raster presses"]);
    }
    // two sessions: each would be predicted by one other
    succeeds(dir, &words("simulate press/comb --contact footprint --presses 2 --out all/comb"));
    let facts = ["comb compressive: sessions beside it: 1", "valid: two or more"];
    refused(dir, &words("compare all --profile others --out p"), &facts);
    assert!(!dir.join("p").exists() && !dir.join("c2").exists());
}
