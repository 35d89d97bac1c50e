//! `spts dataset`, as a user runs it.

use crate::command::{SPTS, json, refused, succeeds, words};
use serde_json::Value;
use std::process::{Command, Stdio};
use std::time::Duration;

/// From nothing to a whole data set: files, keys, columns, the same digest for one thread and four workers.
#[test]
fn a_data_set_from_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let make = ["dataset", "make", "random-shapes", "--rows", "1200", "--json"];
    let one = json(here, &[&make[..], &["--out", "one", "--threads", "1"]].concat());
    for key in ["rows", "cpu_s", "rows_per_cpu_s", "wall_s", "peak_mb"] {
        assert!(one[key].as_f64().unwrap() > 0.0, "{key}: {one}");
    }
    assert_eq!(one["rows"], 1200);
    let digest = &one["finished"]["digest"];
    for worker in ["3/4", "1/4", "0/4", "2/4"] {
        let part = json(here, &[&make[..], &["--out", "four", "--shard", worker]].concat());
        assert!(part["finished"].is_null());
    }
    let four = json(here, &["dataset", "finish", "four", "--json"]);
    assert_eq!(&four["digest"], digest);
    // and again: everything is there
    let again = json(here, &[&make[..], &["--out", "one"]].concat());
    assert_eq!((&again["rows"], &again["finished"]["digest"]), (&Value::from(0), digest));
    for file in ["manifest.json", "README.md", "croissant.json", "statistics.json", "spec.toml", "dataset.json"] {
        let [a, b] = ["one", "four"].map(|folder| std::fs::read(here.join(folder).join(file)).unwrap());
        assert!(a == b && !a.is_empty(), "{file}");
    }
    let columns = json(here, &["dataset", "schema", "random-shapes", "--json"]);
    let names: Vec<&str> = columns.as_array().unwrap().iter().filter_map(|c| c["name"].as_str()).collect();
    let head = succeeds(here, &["dataset", "head", "one", "--rows", "2"]);
    let rows = String::from_utf8(head.stdout).unwrap();
    let row: Value = serde_json::from_str(rows.lines().next().unwrap()).unwrap();
    assert_eq!(row.as_object().unwrap().len(), names.len());
    assert!(names.iter().all(|name| !row[name].is_null()), "{row}");
    assert_eq!((row["pressure_pa"].as_array().unwrap().len(), row["y_v"].as_array().unwrap().len()), (100, 20));
    let verified = json(here, &["dataset", "verify", "four", "--rows", "50", "--json"]);
    assert_eq!((&verified["rows"], verified["differ"].as_array().unwrap().len()), (&Value::from(50), 0));
    let info = json(here, &["dataset", "info", "one", "--json"]);
    assert_eq!((&info["made"], &info["digest"]), (&info["shards"], digest));
}

/// A run that a signal ends leaves whole files alone.
#[test]
fn a_run_that_is_stopped_leaves_no_half_file() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let mut child = Command::new(SPTS);
    child.args(["dataset", "make", "random-shapes", "--rows", "200000", "--out", "set"]).current_dir(here);
    let mut child = child.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let data = here.join("set/data");
    let names = || -> Vec<String> {
        let entries = std::fs::read_dir(&data).into_iter().flatten();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    };
    let begun = std::time::Instant::now();
    while !names().iter().any(|name| name.ends_with(".part")) {
        assert!(begun.elapsed() < Duration::from_secs(60), "no file was begun");
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let left = names();
    assert!(left.iter().all(|name| name.ends_with(".parquet")), "{left:?}");
}

/// A run that is killed with SIGKILL at any time goes on where it was: the digest of a run that nobody killed.
#[test]
fn killed_runs_go_on() {
    const KILLS: u64 = 12;
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let make = ["dataset", "make", "faults", "--rows", "3000", "--seed", "5", "--json"];
    let whole = json(here, &[&make[..], &["--out", "whole"]].concat());
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
    let last = json(here, &[&make[..], &["--out", "killed"]].concat());
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
        command.args(["dataset", "make", "skins", "--rows", "400", "--out", out, "--json"]).args(more);
        command.envs(variables.iter().copied()).current_dir(dir.path());
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice::<Value>(&output.stdout).unwrap()["shards"].as_u64().unwrap()
    };
    let slurm = |task| [("SLURM_ARRAY_TASK_ID", task), ("SLURM_ARRAY_TASK_MIN", "10"), ("SLURM_ARRAY_TASK_COUNT", "3")];
    let tasks: Vec<u64> = ["10", "11", "12"].map(|task| run("slurm", &slurm(task), &[])).into();
    let pods: Vec<u64> =
        ["0", "1", "2"].map(|index| run("pods", &[("JOB_COMPLETION_INDEX", index)], &["--shards", "3"])).into();
    assert_eq!((tasks.iter().sum::<u64>(), &tasks), (4, &pods));
    let [a, b] = ["slurm", "pods"].map(|folder| json(dir.path(), &["dataset", "finish", folder, "--json"]));
    assert_eq!(a["digest"], b["digest"]);
}

#[test]
fn what_cannot_be_made_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    std::fs::write(here.join("beside.toml"), "rows = 10\n[pose]\nx_share = 1.0").unwrap();
    refused(here, &words("dataset make beside.toml"), &["row 0", "none of 32 poses"]);
    // worker 1 of 2 of a data set of one file has nothing to do
    succeeds(here, &words("dataset make faults --rows 20 --out none --shard 1/2"));
    refused(here, &words("dataset preview none"), &["none", "no rows yet"]);
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
    refused(here, &["dataset", "verify", "set"], &["part-00000.parquet", "is not the file that", "remove it"]);
    std::fs::write(&file, &whole).unwrap();
    succeeds(here, &["dataset", "verify", "set"]);
}
