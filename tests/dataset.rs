//! `spts dataset`, as a user runs it.

use crate::command::{SPTS, refused, succeeds};
use serde_json::Value;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

pub(crate) fn json(output: &Output) -> Value {
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

/// A spec of presses with ten windows, 50 a second.
const WINDOWS: &str = "rows = 2000\n[split]\nby = \"press\"\n[pose]\nrotation_deg = { uniform = [0, 90] }
[record]\nwindows = 10\ninterval_s = 0.02\n";

/// Both formats, what they print, and what they are refused for.
#[test]
fn a_data_set_is_exported() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    std::fs::write(here.join("windows.toml"), WINDOWS).unwrap();
    succeeds(here, &["dataset", "make", "windows.toml", "--out", "set"]);
    let lerobot = json(&succeeds(
        here,
        &["dataset", "export", "lerobot", "set", "--out", "robot", "--json"],
    ));
    assert_eq!((&lerobot["rows"], &lerobot["episodes"]), (&2000.into(), &200.into()));
    let info: Value =
        serde_json::from_str(&std::fs::read_to_string(here.join("robot/meta/info.json")).unwrap()).unwrap();
    assert_eq!((&info["fps"], &info["total_frames"]), (&50.into(), &2000.into()));
    let tars = [
        "dataset",
        "export",
        "webdataset",
        "set",
        "--rows-per-tar",
        "500",
        "--json",
        "--out",
    ];
    let one = json(&succeeds(here, &[&tars[..], &["tars"]].concat()));
    let two = json(&succeeds(here, &[&tars[..], &["more/tars"]].concat()));
    assert_eq!(one, two);
    let total: u64 = one["splits"]
        .as_object()
        .unwrap()
        .values()
        .filter_map(Value::as_u64)
        .sum();
    assert_eq!(total, 2000);
    assert!(here.join("tars/train-000001.tar").exists() && here.join("tars/test-000000.tar").exists());
    refused(here, &[&tars[..], &["tars"]].concat(), &["tars/", "is in the way"]);
    refused(
        here,
        &[
            "dataset",
            "export",
            "lerobot",
            "set",
            "--out",
            "o",
            "--rows-per-tar",
            "5",
        ],
        &["`rows_per_tar` = 5", "webdataset only"],
    );
    refused(
        here,
        &["dataset", "export", "zarr", "set", "--out", "o"],
        &["zarr", "lerobot", "webdataset"],
    );
    refused(
        here,
        &["dataset", "export", "lerobot", "nowhere", "--out", "o"],
        &["dataset.json"],
    );
    succeeds(here, &["dataset", "make", "skins", "--rows", "100", "--out", "plain"]);
    refused(
        here,
        &["dataset", "export", "lerobot", "plain", "--out", "o"],
        &["`record.interval_s` is not set"],
    );
    assert!(!here.join("o").exists());
}

/// An export that a signal ends leaves no folder, and the next one is that of a run that nobody stopped.
#[test]
fn stopped_exports_leave_nothing() {
    const STOPS: u64 = 6;
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let text = WINDOWS.replace("rows = 2000", "rows = 20000");
    std::fs::write(here.join("windows.toml"), text).unwrap();
    succeeds(here, &["dataset", "make", "windows.toml", "--out", "set"]);
    for format in ["lerobot", "webdataset"] {
        let run = ["dataset", "export", format, "set", "--json", "--out"];
        let whole = json(&succeeds(here, &[&run[..], &[format]].concat()));
        let (mut stopped, name) = (0, format!("{format}-stopped"));
        let out = here.join(&name);
        for stop in 1..=STOPS {
            let mut child = Command::new(SPTS);
            child.args(run).arg(&name).current_dir(here);
            let mut child = child.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
            std::thread::sleep(Duration::from_millis(60 * stop));
            // the last half is killed, which nothing can tidy up after
            let signal = if stop > STOPS / 2 { "-KILL" } else { "-INT" };
            let sent = Command::new("kill").args([signal, &child.id().to_string()]).status();
            let is_stopped = sent.unwrap().success() && !child.wait().unwrap().success();
            if is_stopped && signal == "-INT" {
                assert!(!out.exists(), "{format}: stop {stop} leaves a folder");
            }
            if is_stopped {
                stopped += 1;
                // nothing but what the next run removes
                let left = std::fs::read_dir(&out).into_iter().flatten();
                let mut left = left.map(|entry| entry.unwrap().file_name().into_string().unwrap());
                assert!(left.all(|name| name.starts_with(".spts")), "{format}: stop {stop}");
            } else {
                std::fs::remove_dir_all(&out).unwrap();
            }
        }
        assert!(stopped > 0, "{format}");
        let last = json(&succeeds(here, &[&run[..], &[&name]].concat()));
        assert_eq!(last, whole);
        let hidden = std::fs::read_dir(&out).unwrap();
        let mut hidden = hidden.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        assert!(hidden.all(|name| !name.starts_with('.')));
        eprintln!("{format}: {stopped} of {STOPS} exports stopped, 0 half folders");
    }
}
