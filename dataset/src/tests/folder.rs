//! Folders of data sets: the same bytes however they are made, and one clear error for what is not of them.

use super::{SMALL, spec};
use crate::folder::Dataset;
use crate::part::Part;
use crate::shard::write_shard;
use spts::output::{DiskOperation, watching_disk};
use std::io;
use std::path::Path;
use std::rc::Rc;

fn digest(folder: &Path) -> String {
    Dataset::open(folder, folder).unwrap().finish(&()).unwrap().digest
}

fn made(folder: &Path, part: Part) {
    Dataset::begin(folder, spec(SMALL)).unwrap().make(part, &()).unwrap();
}

#[test]
fn threads_workers_and_their_order_do_not_show() {
    let dir = tempfile::tempdir().unwrap();
    let threads = |n: usize| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    let [one, two, four, again] = ["one", "two", "four", "again"].map(|name| dir.path().join(name));
    threads(1).install(|| made(&one, Part::WHOLE));
    threads(2).install(|| made(&two, Part::WHOLE));
    for worker in [2, 0, 3, 1] {
        made(&four, Part { worker, of: 4 });
    }
    // a file that is removed is made anew, and nothing else is
    made(&again, Part::WHOLE);
    let dataset = Dataset::open(&again, &again).unwrap();
    std::fs::remove_file(dataset.shard_file(3)).unwrap();
    let repeated = dataset.make(Part::WHOLE, &()).unwrap();
    assert_eq!((repeated.shards, repeated.skipped, repeated.rows), (1, 4, 20));
    let expected = digest(&one);
    for folder in [&two, &four, &again] {
        assert_eq!(digest(folder), expected, "{}", folder.display());
    }
    let verified = dataset.verify(1000, 0, &()).unwrap();
    assert_eq!((verified.rows, verified.shards, verified.differ), (90, 5, Vec::new()));
    assert_eq!(dataset.head(25).unwrap().len(), 25);
}

/// What is wrong ends in an error that names it, and every file is as it was.
#[test]
fn what_is_not_of_the_data_set_is_refused_and_kept() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("set");
    made(&folder, Part::WHOLE);
    let dataset = Dataset::open(&folder, &folder).unwrap();
    let refused = |said: &str| {
        let errors = [
            dataset.finish(&()).unwrap_err().to_string(),
            dataset
                .make(Part::WHOLE, &())
                .err()
                .map_or_else(String::new, |e| e.to_string()),
        ];
        assert!(errors.iter().any(|e| e.contains(said)), "{errors:?}");
    };
    let file = dataset.shard_file(2);
    let whole = std::fs::read(&file).unwrap();
    // cut short, of another place, of no data set at all
    std::fs::write(&file, &whole[..whole.len() / 2]).unwrap();
    refused("part-00002.parquet: is not a whole Parquet file");
    std::fs::copy(dataset.shard_file(1), &file).unwrap();
    refused("was made for another place in the data set");
    std::fs::write(&file, &whole).unwrap();
    let foreign = folder.join("data/notes.txt");
    std::fs::write(&foreign, "mine").unwrap();
    refused("notes.txt: is not of this data set");
    assert_eq!(std::fs::read_to_string(&foreign).unwrap(), "mine");
    std::fs::remove_file(&foreign).unwrap();
    std::fs::remove_file(&file).unwrap();
    let said = dataset.finish(&()).unwrap_err().to_string();
    assert!(
        said.contains("part-00002.parquet: is missing, as 1 of 5 files are"),
        "{said}"
    );
    // a changed value, with its checksum left as it was or not, is noticed by whoever looks
    let other = Dataset::begin(&folder, spec(&SMALL.replace("seed = 3", "seed = 4")))
        .unwrap_err()
        .to_string();
    assert!(
        other.contains("dataset.json: another data set was begun here"),
        "{other}"
    );
    let occupied = dir.path().join("occupied");
    std::fs::create_dir(&occupied).unwrap();
    std::fs::write(occupied.join("thesis.tex"), "mine").unwrap();
    let said = Dataset::begin(&occupied, spec(SMALL)).unwrap_err().to_string();
    assert!(said.contains("thesis.tex: is not of a data set"), "{said}");
    assert_eq!(std::fs::read_to_string(occupied.join("thesis.tex")).unwrap(), "mine");
}

/// Runs that begin one data set at the same time all find it theirs.
#[test]
fn many_begin_at_once() {
    let dir = tempfile::tempdir().unwrap();
    for round in 0..400 {
        let folder = dir.path().join(round.to_string());
        let gate = std::sync::Barrier::new(4);
        // one after the other by up to a millisecond, about as long as a begin takes
        let begin = &|k: u32| {
            let spec = spec(SMALL);
            gate.wait();
            std::thread::sleep(std::time::Duration::from_nanos(2500) * (round % 100) * k);
            Dataset::begin(&folder, spec).map(|_| ())
        };
        std::thread::scope(|scope| {
            let runs: Vec<_> = (0..4).map(|k| scope.spawn(move || begin(k))).collect();
            for run in runs {
                run.join().unwrap().unwrap();
            }
        });
    }
}

/// Every operation on the disk fails once, as on a full disk: an error, and nothing or the whole file is there.
#[test]
fn a_full_disk_leaves_no_half_file() {
    let dir = tempfile::tempdir().unwrap();
    let (spec, path) = (spec(SMALL), dir.path().join("part-00000.parquet"));
    let count = Rc::new(std::cell::Cell::new(0));
    let run = |fail_at: u32| {
        count.set(0);
        let seen = Rc::clone(&count);
        let watcher = move |operation: DiskOperation, _: &Path| {
            seen.set(seen.get() + 1);
            let fails = seen.get() == fail_at && operation != DiskOperation::Remove;
            if fails {
                Err(io::ErrorKind::StorageFull.into())
            } else {
                Ok(())
            }
        };
        watching_disk(Rc::new(watcher), || write_shard(&spec, 0, &path, &|| ()))
    };
    run(0).unwrap();
    let (steps, whole) = (count.get(), std::fs::read(&path).unwrap());
    assert!(steps >= 4, "{steps} steps");
    for step in 1..=steps {
        std::fs::remove_file(&path).unwrap();
        let error = run(step).unwrap_err().to_string();
        assert!(error.contains("part-00000.parquet"), "step {step}: {error}");
        assert_eq!(
            std::fs::read_dir(dir.path()).unwrap().count(),
            0,
            "step {step} leaves a file"
        );
        run(0).unwrap();
        assert!(std::fs::read(&path).unwrap() == whole);
    }
    eprintln!("{steps} steps of a file, each failed once: 0 half files");
}

/// Bytes that were changed in a file end in an error, or show when its rows are made again; nothing panics. What stays
/// unseen lies in what no row is read from: statistics and headers.
#[test]
fn changed_bytes_are_found() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("set");
    made(&folder, Part::WHOLE);
    let dataset = Dataset::open(&folder, &folder).unwrap();
    let file = dataset.shard_file(0);
    let whole = std::fs::read(&file).unwrap();
    let (mut found, tries) = (0, 60);
    for k in 0..tries {
        let mut bytes = whole.clone();
        bytes[(2 * k + 1) * whole.len() / (2 * tries)] ^= 0x40;
        std::fs::write(&file, bytes).unwrap();
        found += usize::from(
            dataset
                .verify(90, 0, &())
                .map_or(true, |verified| !verified.differ.is_empty()),
        );
    }
    eprintln!("{found} of {tries} changed bytes found");
    assert!(found > tries / 2, "{found} of {tries}");
    std::fs::write(&file, whole).unwrap();
    assert!(dataset.verify(90, 0, &()).unwrap().differ.is_empty());
}
