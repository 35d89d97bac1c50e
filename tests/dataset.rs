//! `spts dataset`, as a user runs it.

use crate::command::{SPTS, refused, succeeds};
use serde_json::Value;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

/// From nothing to a whole data set: files, keys, columns, the same digest for one thread and four workers.
#[test]
fn a_data_set_from_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let make = ["dataset", "make", "random-shapes", "--rows", "1200", "--json"];
    let one = json(&succeeds(
        here,
        &[&make[..], &["--out", "one", "--threads", "1"]].concat(),
    ));
    for key in ["rows", "cpu_s", "rows_per_cpu_s", "wall_s", "peak_mb"] {
        assert!(one[key].as_f64().unwrap() > 0.0, "{key}: {one}");
    }
    assert_eq!(one["rows"], 1200);
    let digest = &one["finished"]["digest"];
    for worker in ["3/4", "1/4", "0/4", "2/4"] {
        let part = json(&succeeds(
            here,
            &[&make[..], &["--out", "four", "--shard", worker]].concat(),
        ));
        assert!(part["finished"].is_null());
    }
    let four = json(&succeeds(here, &["dataset", "finish", "four", "--json"]));
    assert_eq!(&four["digest"], digest);
    // and again: everything is there
    let again = json(&succeeds(here, &[&make[..], &["--out", "one"]].concat()));
    assert_eq!(
        (&again["rows"], &again["finished"]["digest"]),
        (&Value::from(0), digest)
    );
    for file in [
        "manifest.json",
        "README.md",
        "croissant.json",
        "statistics.json",
        "spec.toml",
        "dataset.json",
    ] {
        let [a, b] = ["one", "four"].map(|folder| std::fs::read(here.join(folder).join(file)).unwrap());
        assert!(a == b && !a.is_empty(), "{file}");
    }
    let columns = json(&succeeds(here, &["dataset", "schema", "random-shapes", "--json"]));
    let names: Vec<&str> = columns
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|c| c["name"].as_str())
        .collect();
    let head = succeeds(here, &["dataset", "head", "one", "--rows", "2"]);
    let rows = String::from_utf8(head.stdout).unwrap();
    let row: Value = serde_json::from_str(rows.lines().next().unwrap()).unwrap();
    assert_eq!(row.as_object().unwrap().len(), names.len());
    assert!(names.iter().all(|name| !row[name].is_null()), "{row}");
    assert_eq!(
        (
            row["pressure_pa"].as_array().unwrap().len(),
            row["y_v"].as_array().unwrap().len()
        ),
        (100, 20)
    );
    let verified = json(&succeeds(
        here,
        &["dataset", "verify", "four", "--rows", "50", "--json"],
    ));
    assert_eq!(
        (&verified["rows"], verified["differ"].as_array().unwrap().len()),
        (&Value::from(50), 0)
    );
    let info = json(&succeeds(here, &["dataset", "info", "one", "--json"]));
    assert_eq!((&info["made"], &info["digest"]), (&info["shards"], digest));
}

/// A run that is killed with SIGKILL at any time goes on where it was: the digest of a run that nobody killed.
#[test]
fn killed_runs_go_on() {
    const KILLS: u64 = 12;
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let make = ["dataset", "make", "faults", "--rows", "3000", "--seed", "5", "--json"];
    let whole = json(&succeeds(here, &[&make[..], &["--out", "whole"]].concat()));
    let mut killed = 0;
    for kill in 1..=KILLS {
        let mut child = Command::new(SPTS);
        child.args(make).args(["--out", "killed"]).current_dir(here);
        let mut child = child.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        // a whole run takes half a second
        std::thread::sleep(Duration::from_millis(20 * kill));
        if child.try_wait().unwrap().is_none() {
            child.kill().unwrap();
            killed += 1;
        } else {
            // the next one has something to do
            std::fs::remove_file(here.join("killed/data/part-00003.parquet")).unwrap();
        }
        child.wait().unwrap();
    }
    assert!(killed > 0);
    let last = json(&succeeds(here, &[&make[..], &["--out", "killed"]].concat()));
    assert_eq!(last["finished"]["digest"], whole["finished"]["digest"]);
    let left = std::fs::read_dir(here.join("killed/data")).unwrap();
    assert_eq!(left.count() as u64, whole["shards"].as_u64().unwrap());
    eprintln!("{killed} runs killed, the same digest");
}

/// Workers of clusters are told by their environment.
#[test]
fn clusters_are_understood() {
    let dir = tempfile::tempdir().unwrap();
    let run = |out: &str, variables: &[(&str, &str)], more: &[&str]| {
        let mut command = Command::new(SPTS);
        command
            .args(["dataset", "make", "skins", "--rows", "400", "--out", out, "--json"])
            .args(more);
        command.envs(variables.iter().copied()).current_dir(dir.path());
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        json(&output)["shards"].as_u64().unwrap()
    };
    let slurm = |task| {
        [
            ("SLURM_ARRAY_TASK_ID", task),
            ("SLURM_ARRAY_TASK_MIN", "10"),
            ("SLURM_ARRAY_TASK_COUNT", "3"),
        ]
    };
    let tasks: Vec<u64> = ["10", "11", "12"].map(|task| run("slurm", &slurm(task), &[])).into();
    let pods: Vec<u64> = ["0", "1", "2"]
        .map(|index| run("pods", &[("JOB_COMPLETION_INDEX", index)], &["--shards", "3"]))
        .into();
    assert_eq!((tasks.iter().sum::<u64>(), &tasks), (4, &pods));
    let [a, b] = ["slurm", "pods"].map(|folder| json(&succeeds(dir.path(), &["dataset", "finish", folder, "--json"])));
    assert_eq!(a["digest"], b["digest"]);
}

#[test]
fn what_cannot_be_made_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    std::fs::write(
        here.join("bad.toml"),
        "rows = 10\n[press]\nforce_n = { uniform = [0, 1] }",
    )
    .unwrap();
    std::fs::write(here.join("beside.toml"), "rows = 10\n[pose]\nx_share = 1.0").unwrap();
    std::fs::create_dir(here.join("occupied")).unwrap();
    std::fs::write(here.join("occupied/mine.txt"), "mine").unwrap();
    refused(here, &["dataset", "make", "shapes"], &["shapes", "random-shapes"]);
    refused(here, &["dataset", "make", "missing.toml"], &["missing.toml"]);
    refused(
        here,
        &["dataset", "make", "bad.toml"],
        &["bad.toml", "`press.force_n` = 0", "[0.01, 1000] N"],
    );
    refused(
        here,
        &["dataset", "make", "beside.toml"],
        &["row 0", "none of 32 poses"],
    );
    refused(
        here,
        &["dataset", "make", "faults", "--rows", "0"],
        &["--rows", "0", "[1, 1000000000000]"],
    );
    refused(
        here,
        &["dataset", "make", "faults", "--shard", "4/4"],
        &["`--shard` = 4/4", "0 ≤ i < n"],
    );
    refused(
        here,
        &["dataset", "make", "faults", "--out", "occupied"],
        &["mine.txt", "is not of a data set"],
    );
    refused(here, &["dataset", "finish", "occupied"], &["dataset.json"]);
    refused(here, &["dataset", "head", "nowhere"], &["dataset.json"]);
    refused(
        here,
        &["dataset", "specs", "--show", "presses"],
        &["`--show` = presses", "presses-17"],
    );
    succeeds(here, &["dataset", "make", "skins", "--rows", "100", "--out", "set"]);
    refused(
        here,
        &["dataset", "make", "skins", "--rows", "200", "--out", "set"],
        &["set/dataset.json", "another data set"],
    );
    // a row that is not what the spec makes: status 1
    let file = here.join("set/data/part-00000.parquet");
    let whole = std::fs::read(&file).unwrap();
    std::fs::write(&file, &whole[..whole.len() - 9]).unwrap();
    refused(
        here,
        &["dataset", "verify", "set"],
        &["part-00000.parquet", "not a whole Parquet file"],
    );
    std::fs::write(&file, &whole).unwrap();
    succeeds(here, &["dataset", "verify", "set"]);
    assert_eq!(std::fs::read_to_string(here.join("occupied/mine.txt")).unwrap(), "mine");
}

/// Width and height in the header of a PNG file.
fn png_size(path: &std::path::Path) -> [u32; 2] {
    let bytes = std::fs::read(path).unwrap();
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n", "{path:?}");
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()))
}

/// A picture of rows, of every kind of skin and record: as wide as its cards, the same for a spec and for the files of
/// it, unfinished ones too.
#[test]
fn rows_are_drawn() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let bare = "name = \"bare\"\nrows = 30\n[record]\nraster = false\ncodes = true\n[object]\ncount = 2";
    std::fs::write(here.join("bare.toml"), bare).unwrap();
    // pixels: two to the unit; borders of 16, cards 22 apart
    for (spec, name, width) in [
        ("random-shapes", "random-shapes", 2 * (32 + 4 * 208 + 3 * 22)),
        ("presses-17", "presses-17", 2 * (32 + 4 * 208 + 3 * 22)),
        ("large-skin", "large-skin", 2 * (32 + 3 * 280 + 2 * 22)),
        ("bare.toml", "bare", 2 * (32 + 5 * 160 + 4 * 22)),
    ] {
        let report = json(&succeeds(here, &["dataset", "preview", spec, "--rows", "6", "--json"]));
        let file = format!("{name}-preview.png");
        assert_eq!(report["file"], file.as_str());
        assert_eq!(report["rows"].as_array().unwrap().len(), 6);
        let [found, height] = png_size(&here.join(&file));
        assert_eq!(found, width, "{spec}");
        assert!((800..1600).contains(&height), "{spec}: {height}");
    }
    // one worker of two is done: rows of its files alone
    let make = ["dataset", "make", "bare.toml", "--rows", "300", "--out", "half"];
    succeeds(here, &[&make[..], &["--shard", "0/2"]].concat());
    let preview = ["dataset", "preview", "half", "--rows", "20", "--json", "--out"];
    let half = json(&succeeds(here, &[&preview[..], &["half.png"]].concat()));
    let rows: Vec<u64> = half["rows"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(Value::as_u64)
        .collect();
    assert_eq!(
        rows,
        (0..20)
            .map(|k| k * 10 + if k < 10 { 0 } else { 100 })
            .collect::<Vec<_>>()
    );
    let drawn = ["--seed", "4"];
    let random = json(&succeeds(here, &[&preview[..], &["random.png"], &drawn].concat()));
    assert_ne!(random["rows"], half["rows"]);
    // all files are there: the same bytes as without any
    succeeds(here, &make);
    succeeds(here, &[&preview[..], &["files.png"], &drawn].concat());
    let text = std::fs::read_to_string(here.join("half/spec.toml")).unwrap();
    std::fs::write(here.join("same.toml"), text).unwrap();
    let same = [
        "dataset",
        "preview",
        "same.toml",
        "--rows",
        "20",
        "--seed",
        "4",
        "--out",
        "made.png",
    ];
    succeeds(here, &same);
    let [files, made] = ["files.png", "made.png"].map(|file| std::fs::read(here.join(file)).unwrap());
    assert!(files == made);
    // nothing was added to the data set
    let mut held: Vec<_> = std::fs::read_dir(here.join("half"))
        .unwrap()
        .map(|e| e.unwrap().file_name())
        .collect();
    held.sort();
    let usual = [
        "README.md",
        "croissant.json",
        "data",
        "dataset.json",
        "manifest.json",
        "spec.toml",
        "statistics.json",
    ];
    assert_eq!(held, usual);
}

#[test]
fn shapes_are_drawn() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let shapes = [
        "dataset",
        "shapes",
        "--json",
        "--families",
        "gear,letter",
        "--count",
        "5",
    ];
    let first = json(&succeeds(here, &shapes));
    assert_eq!(first["file"], "shapes.png");
    let drawn: Vec<(&str, u64)> = first["shapes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|shape| (shape["family"].as_str().unwrap(), shape["number"].as_u64().unwrap()))
        .collect();
    assert_eq!(
        drawn,
        [("letter", 0), ("letter", 1), ("letter", 2), ("gear", 0), ("gear", 1)]
    );
    succeeds(here, &[&shapes[..], &["--out", "again.png", "--threads", "1"]].concat());
    succeeds(here, &[&shapes[..], &["--out", "other.png", "--seed", "1"]].concat());
    let [a, b, other] = ["shapes.png", "again.png", "other.png"].map(|file| std::fs::read(here.join(file)).unwrap());
    assert!(a == b && a != other);
    // a line of more than a hundred shapes of all families is as wide
    succeeds(here, &["dataset", "shapes", "--count", "120", "--out", "all.png"]);
    let [few, all] = ["shapes.png", "all.png"].map(|file| png_size(&here.join(file)));
    assert!(few[0] == all[0] && few[1] < all[1], "{few:?} {all:?}");
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    std::fs::create_dir(here.join("empty")).unwrap();
    refused(here, &["dataset", "preview", "empty"], &["empty/dataset.json"]);
    refused(here, &["dataset", "preview", "nowhere"], &["nowhere", "random-shapes"]);
    let rows = |rows| ["dataset", "preview", "faults", "--rows", rows];
    refused(here, &rows("0"), &["--rows", "[1, 200]"]);
    refused(here, &rows("201"), &["--rows", "[1, 200]"]);
    // worker 1 of 2 of a data set of one file has nothing to do
    let make = [
        "dataset", "make", "faults", "--rows", "20", "--out", "none", "--shard", "1/2",
    ];
    succeeds(here, &make);
    refused(here, &["dataset", "preview", "none"], &["none", "no rows yet"]);
    let beside = ["dataset", "preview", "faults", "--out", "missing/folder/x.png"];
    refused(here, &beside, &["missing/folder"]);
    refused(here, &["dataset", "shapes", "--families", "gear,cog"], &["cog", "gear"]);
    refused(here, &["dataset", "shapes", "--count", "0"], &["--count", "[1, 400]"]);
    let left: Vec<_> = std::fs::read_dir(here)
        .unwrap()
        .map(|e| e.unwrap().file_name())
        .collect();
    assert!(
        !left.iter().any(|name| name.to_string_lossy().contains("png")),
        "{left:?}"
    );
}
