//! Sessions that cannot be scored, or not in the way that was asked: one line with the session and what is missing.

use crate::command::{spts, succeeds, words};
use crate::recordings::recordings;
use std::path::Path;

/// Simulates `scene` into the folder `out`.
fn simulated(dir: &Path, scene: &str, out: &str) {
    let arguments = [&["simulate"][..], &words(scene), &["--out", out]].concat();
    succeeds(dir, &arguments);
}

#[track_caller]
fn refused(dir: &Path, command: &str, facts: &[&str]) {
    let output = spts(dir, &words(command));
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{command}: {said}");
    assert_eq!(said.lines().count(), 1, "{command}: {said}");
    for fact in facts {
        assert!(said.contains(fact), "{command}: `{fact}` is not in: {said}");
    }
    assert!(output.stdout.is_empty(), "{command}: an empty board is no answer");
}

#[test]
fn what_is_missing_is_named() {
    let dir = tempfile::tempdir().unwrap();
    simulated(dir.path(), "press/T", "one");
    refused(
        dir.path(),
        "score one --decoder evidence",
        &[
            "`--decoder` = evidence",
            "raster presses that are not scored",
            "--learn-from simulation",
        ],
    );
    simulated(dir.path(), "bounce --height 0.05", "ball");
    refused(dir.path(), "score ball", &["ball: ", "found: no session of presses"]);
    // two skins in one folder
    simulated(dir.path(), "press/T", "both/a");
    simulated(dir.path(), "press/X --set skin.rows=12", "both/b");
    refused(
        dir.path(),
        "score both",
        &["both: session \"", " recording: `taxels` = ", "as the first session"],
    );
}

/// A finger's touch is in no class, so that no share of it can be classified correctly.
#[test]
fn an_object_in_no_class_is_not_wrong() {
    let Some(recordings) = recordings() else { return };
    let dir = tempfile::tempdir().unwrap();
    let command = "--session robot_arm --decoder nn_omp --measurements 20 --windows 2";
    let arguments = [&["decode", recordings.to_str().unwrap()][..], &words(command)].concat();
    let output = succeeds(dir.path(), &arguments);
    let said = String::from_utf8_lossy(&output.stdout);
    let line = said.lines().find(|line| line.starts_with("robot_arm"));
    assert!(line.is_some_and(|line| line.trim_end().ends_with('–')), "{said}");
}
