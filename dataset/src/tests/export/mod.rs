//! Exports: what other programs read, and what is refused.

mod lerobot;
mod webdataset;

use super::spec;
use crate::export::{EXPORTS, ExportOptions, Exported};
use crate::folder::Dataset;
use crate::part::Part;
use serde_json::Value;
use spts::output::{DiskOperation, watching_disk};
use std::path::Path;
use std::rc::Rc;

/// Presses of three windows, the last one of two, on a sheet that is not square; all splits have some.
const PRESSES: &str = "rows = 89\nrows_per_shard = 21\nseed = 5
[split]
by = \"press\"
validation = 0.25
test = 0.25
[object]
rows_per_shape = 9
count = { choice = [1, 2] }
[pose]
x_share = { uniform = [-0.2, 0.2] }
rotation_deg = { uniform = [0.0, 90.0] }
[press]
force_n = { log_uniform = [5.0, 40.0] }
[skin]
rows = 8
cols = 12
rows_per_skin = 21
[record]
windows = 3
interval_s = 0.02
measurements = 7
";

/// The data set of `text`, made in `folder`.
fn made(folder: &Path, text: &str) -> Dataset {
    let dataset = Dataset::begin(folder, spec(text)).unwrap();
    dataset.make(Part::WHOLE, &()).unwrap();
    dataset
}

fn exported(dataset: &Dataset, format: &str, out: &Path) -> Exported {
    dataset.export(format, out, &ExportOptions::default(), &()).unwrap()
}

/// Numbers of a row's column, one or a list.
fn numbers(row: &Value, column: &str) -> Vec<f64> {
    let value = &row[column];
    let one = |value: &Value| value.as_f64().or(value.as_bool().map(|b| f64::from(u8::from(b))));
    match value.as_array() {
        Some(list) => list.iter().map(|value| one(value).unwrap()).collect(),
        None => vec![one(value).unwrap()],
    }
}

/// A number as files of single precision hold it.
#[expect(clippy::cast_possible_truncation, reason = "single precision")]
fn single(value: f64) -> f64 {
    f64::from(value as f32)
}

/// The same data set gives the same bytes, from another folder and on any number of threads.
#[test]
fn the_same_rows_are_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let sets = ["a", "b"].map(|name| made(&dir.path().join(name), PRESSES));
    sets[1].finish(&()).unwrap();
    for (format, ..) in EXPORTS {
        let runs = [0, 1, 0].map(|k: usize| {
            let out = tempfile::tempdir().unwrap();
            let threads = rayon::ThreadPoolBuilder::new().num_threads(k + 1).build().unwrap();
            threads.install(|| exported(&sets[k], format, &out.path().join("deep/out")))
        });
        assert_eq!(runs[0], runs[1], "{format}");
        assert_eq!(runs[0], runs[2], "{format}");
        assert_eq!(runs[0].rows, 89);
        assert_eq!(runs[0].splits.len(), 3, "{:?}", runs[0].splits);
    }
}

/// What is wrong ends in an error that names it; nothing is made and nothing is changed.
#[test]
fn what_cannot_be_exported_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let none = ExportOptions::default();
    let refused = |dataset: &Dataset, format: &str, options: &ExportOptions, said: &[&str]| {
        let error = dataset.export(format, &out, options, &()).unwrap_err().to_string();
        assert!(said.iter().all(|part| error.contains(part)), "{error}");
        assert!(!out.exists(), "{error}");
    };
    let dataset = made(&dir.path().join("set"), PRESSES);
    refused(&dataset, "rlds", &none, &["`format` = rlds", "lerobot, webdataset"]);
    for (interval, said) in [
        ("", "`record.interval_s` is not set"),
        ("interval_s = 0.03", "`record.interval_s` = 0.03"),
        ("interval_s = 2.0", "valid: 1/n s"),
        ("interval_s = 0.0", "valid: 1/n s"),
        ("interval_s = -0.02", "valid: 1/n s"),
        ("interval_s = nan", "valid: 1/n s"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        // a spec may refuse some of them itself
        let text = PRESSES.replace("interval_s = 0.02", interval);
        let Ok(spec) = crate::spec::Spec::from_toml(&text, &toml::Table::new(), ".".as_ref()) else {
            continue;
        };
        let dataset = Dataset::begin(folder.path(), spec).unwrap();
        refused(&dataset, "lerobot", &none, &[said]);
    }
    let tars = |rows| ExportOptions {
        rows_per_tar: Some(rows),
    };
    refused(&dataset, "lerobot", &tars(10), &["`rows_per_tar` = 10", "webdataset"]);
    for rows in [0, 1_000_001] {
        refused(&dataset, "webdataset", &tars(rows), &["rows_per_tar", "[1, 10^6]"]);
    }
    for (format, ..) in EXPORTS {
        std::fs::create_dir(&out).unwrap();
        std::fs::write(out.join("thesis.tex"), "mine").unwrap();
        let error = dataset.export(format, &out, &none, &()).unwrap_err().to_string();
        assert!(
            error.contains("thesis.tex: is in the way") && error.contains("empty"),
            "{error}"
        );
        assert_eq!(std::fs::read_to_string(out.join("thesis.tex")).unwrap(), "mine");
        assert_eq!(std::fs::read_dir(&out).unwrap().count(), 1);
        std::fs::remove_dir_all(&out).unwrap();
        // an export is not replaced either
        exported(&dataset, format, &out);
        let error = dataset.export(format, &out, &none, &()).unwrap_err().to_string();
        assert!(error.contains("is in the way"), "{error}");
        std::fs::remove_dir_all(&out).unwrap();

        let file = dataset.shard_file(2);
        let whole = std::fs::read(&file).unwrap();
        std::fs::write(&file, &whole[..whole.len() / 2]).unwrap();
        refused(&dataset, format, &none, &["part-00002.parquet: is not a whole Parquet"]);
        std::fs::remove_file(&file).unwrap();
        refused(
            &dataset,
            format,
            &none,
            &["part-00002.parquet: is missing, as 1 of 5 files are"],
        );
        // a value that was changed shows against the manifest
        std::fs::write(&file, &whole).unwrap();
        dataset.finish(&()).unwrap();
        let mut changed = whole.clone();
        // among the rows: the footer is checked first
        changed[whole.len() / 10] ^= 1;
        std::fs::write(&file, changed).unwrap();
        refused(
            &dataset,
            format,
            &none,
            &["part-00002.parquet: is not the file that manifest.json lists"],
        );
        std::fs::write(&file, whole).unwrap();
        std::fs::remove_file(dataset.folder().join("manifest.json")).unwrap();
    }
}

/// Every operation on the disk fails once, as on a full disk: an error and no folder, or the whole export.
#[test]
fn an_export_is_whole_or_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let small = PRESSES.replace("rows = 89", "rows = 21");
    let dataset = made(&dir.path().join("set"), &small);
    let out = dir.path().join("below/out");
    for (format, ..) in EXPORTS {
        let count = Rc::new(std::cell::Cell::new(0));
        let run = |fail_at: u32| {
            count.set(0);
            let seen = Rc::clone(&count);
            let watcher = move |operation: DiskOperation, _: &Path| {
                seen.set(seen.get() + 1);
                if seen.get() == fail_at && operation != DiskOperation::Remove {
                    return Err(std::io::ErrorKind::StorageFull.into());
                }
                Ok(())
            };
            let export = || dataset.export(format, &out, &ExportOptions::default(), &());
            watching_disk(Rc::new(watcher), export)
        };
        let whole = run(0).unwrap();
        let steps = count.get();
        let mut failed = 0;
        for step in 1..=steps {
            if out.exists() {
                std::fs::remove_dir_all(&out).unwrap();
            }
            match run(step) {
                Ok(exported) => assert_eq!(exported, whole, "{format}: step {step}"),
                Err(error) => {
                    failed += 1;
                    let error = error.to_string();
                    assert!(error.contains("out") && !error.contains("/.spts"), "{error}");
                    assert!(!out.exists(), "{format}: step {step} leaves a folder: {error}");
                }
            }
        }
        eprintln!("{format}: {steps} steps, {failed} ended the export, 0 half folders");
        assert!(failed * 2 > steps, "{failed} of {steps}");
        std::fs::remove_dir_all(&out).unwrap();
    }
}
