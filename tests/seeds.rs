//! Seeds and phase transitions through their commands.

use crate::command::{files, spts, succeeds};
use serde_json::Value;

const SMALL: [&str; 9] = [
    "--quick",
    "--rows",
    "5,10",
    "--images",
    "8",
    "--budget",
    "20",
    "--windows",
    "4",
];

#[test]
fn a_study_of_seeds_is_written_whole_and_does_not_depend_on_the_threads() {
    let dir = tempfile::tempdir().unwrap();
    for threads in ["1", "3"] {
        let own = ["seeds", "--out", threads, "--threads", threads];
        succeeds(dir.path(), &[&own[..], &SMALL].concat());
    }
    let (one, three) = (files(&dir.path().join("1")), files(&dir.path().join("3")));
    assert!(one == three, "the files depend on the number of threads");
    // two noises, two decoders, two M, four sets
    let worth = String::from_utf8(one["worth.csv"].clone()).unwrap();
    assert_eq!(worth.lines().count(), 1 + 2 * 2 * 2 * 4, "{worth}");
    for name in ["facts.csv", "windows.csv", "figures/seeds.png", "figures/matrices.svg"] {
        assert!(one.contains_key(name), "{name}");
    }
    // what is proposed can be judged again and written to a bus
    let list = ["seeds", "--seeds", "1/mixed_seeds.txt", "--json"];
    let output = succeeds(dir.path(), &[&list[..], &SMALL].concat());
    let again: Value = serde_json::from_slice(&output.stdout).unwrap();
    // a set that is one of the command's own is shown once, under its own name
    assert_eq!(again["given"], "mixed");
    let names = again["sets"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|s| s["name"] == "mixed");
    assert_eq!(names.count(), 1);
    assert_eq!(again["facts"][0]["first_rank"], 100);
    let writes = String::from_utf8(one["bytes_bus.csv"].clone()).unwrap();
    assert_eq!(writes.lines().count(), 101);
    assert!(writes.starts_with("taxel,address,seed,bytes\n0,8,"), "{writes}");
}

#[test]
fn phase_transitions_do_not_depend_on_the_threads() {
    let dir = tempfile::tempdir().unwrap();
    for threads in ["1", "3"] {
        let own = [
            "phase",
            "--quick",
            "--n",
            "20",
            "--trials",
            "4",
            "--method",
            "omp,nn_lasso",
        ];
        let output = succeeds(
            dir.path(),
            &[&own[..], &["--out", threads, "--threads", threads]].concat(),
        );
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(text.lines().filter(|l| l.starts_with('|')).count(), 4, "{text}");
    }
    let (one, three) = (files(&dir.path().join("1")), files(&dir.path().join("3")));
    assert!(one == three, "the files depend on the number of threads");
    assert!(one.contains_key("figures/phase_rates.png") && one.contains_key("crossings.csv"));
}

#[test]
fn wrong_seeds_and_phases_are_refused_in_one_line() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("bad.txt"), "1 2 3\n4 five").unwrap();
    std::fs::write(dir.path().join("few.txt"), "1 2 3").unwrap();
    for (arguments, words) in [
        (
            &["seeds", "--seeds", "bad.txt"][..],
            &["bad.txt, line 2", "`five`", "[0, 4294967295]"][..],
        ),
        (&["seeds", "--seeds", "few.txt"], &["few.txt", "= 3", "[16, 1024]"]),
        (&["seeds", "--seeds", "none.txt"], &["--seeds", "none.txt"]),
        (&["seeds", "--seeds", "8,-9"], &["--seeds", "-9", "[0, 4294967295]"]),
        (&["seeds", "--taxels", "99"], &["--taxels", "99", "[16, 1024]"]),
        (&["seeds", "--rows", "0"], &["--rows", "[1, 1000]"]),
        (&["seeds", "--noise", "nan"], &["--noise", "nan", "[0, 10]"]),
        (&["seeds", "--mode", "raster"], &["--mode", "raster"]),
        (&["seeds", "--recordings", "nowhere"], &["nowhere"]),
        (&["phase", "--n", "19"], &["--n", "19", "[20, 2000]"]),
        (&["phase", "--trials", "0"], &["--trials", "0"]),
        (&["phase", "--method", "magic"], &["--method", "magic", "nn_lasso"]),
        (
            &["phase", "--signs", "either", "--method", "nn_lasso"],
            &["--method", "nn_lasso", "omp"],
        ),
    ] {
        let output = spts(dir.path(), arguments);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
        for word in words {
            assert!(error.contains(word), "{arguments:?}: {error}");
        }
    }
    assert_eq!(files(dir.path()).len(), 2, "a refused command left a file");
}
