//! What a data set promises.

use crate::file::write_shard;
use crate::folder::{Dataset, Part};
use crate::make::Maker;
use crate::rows::spread_rows;
use crate::spec::{NAMED_SPECS, Spec};
use spts::output::{DiskOperation, watching_disk};
use spts_circuit::Profile;
use std::collections::BTreeSet;
use std::io;
use std::path::Path;
use std::rc::Rc;

/// A spec of `text`, which names no files.
fn spec(text: &str) -> Spec {
    Spec::from_toml(text, &toml::Table::new(), ".".as_ref()).unwrap()
}

/// A small data set of all kinds of draws, in five files.
const SMALL: &str = "rows = 90\nrows_per_shard = 20\nseed = 3
[object]
rows_per_shape = 10
count = { choice = [1, 2] }
[pose]
x_share = { uniform = [-0.3, 0.3] }
y_share = { grid = [-0.2, 0.0, 0.2] }
rotation_deg = { normal = [0.0, 40.0] }
[press]
force_n = { log_uniform = [5.0, 40.0] }
[skin]
rows_per_skin = 20
presses_before = { choice = [0, 2] }
[transducer]
temperature_c = { uniform = [10.0, 40.0] }
[faults]
count = { choice = [0, 3] }
[record]
windows = 2
measurements = 7
";

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
        let errors = [dataset.finish(&()).err(), dataset.make(Part::WHOLE, &()).err()];
        let errors = errors.map(|error| error.map_or_else(String::new, |e| e.to_string()));
        assert!(!errors[0].is_empty() && errors.iter().any(|e| e.contains(said)), "{errors:?}");
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
    assert!(said.contains("part-00002.parquet: is missing, as 1 of 5 files are"), "{said}");
    let other = spec(&SMALL.replace("seed = 3", "seed = 4"));
    let said = Dataset::begin(&folder, other).unwrap_err().to_string();
    assert!(said.contains("dataset.json: another data set was begun here"), "{said}");
    let occupied = dir.path().join("occupied");
    std::fs::create_dir(&occupied).unwrap();
    std::fs::write(occupied.join("thesis.tex"), "mine").unwrap();
    let said = Dataset::begin(&occupied, spec(SMALL)).unwrap_err().to_string();
    assert!(said.contains("thesis.tex: is not of a data set"), "{said}");
    assert_eq!(std::fs::read_to_string(occupied.join("thesis.tex")).unwrap(), "mine");
}

/// A run that is refused before there is a row leaves the folder to another spec, and the user's files in it.
#[test]
fn a_run_without_rows_leaves_no_data_set() {
    let dir = tempfile::tempdir().unwrap();
    let outside = || spec(&SMALL.replace("grid = [-0.2, 0.0, 0.2]", "uniform = [-1.0, -0.9]"));
    let refused = |folder: &Path| Dataset::begin(folder, outside()).unwrap().make(Part::WHOLE, &()).unwrap_err();
    let new = dir.path().join("new");
    assert!(refused(&new).to_string().contains("beside the skin"), "{}", refused(&new));
    assert!(!new.exists());
    let own = dir.path().join("own");
    std::fs::create_dir(&own).unwrap();
    std::fs::write(own.join("spec.toml"), outside().text()).unwrap();
    refused(&own);
    let left: Vec<_> = std::fs::read_dir(&own).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["spec.toml"]);
    made(&new, Part::WHOLE);
    // rows of a finished file stay, whatever becomes of the next
    let file = std::fs::read_dir(new.join("data")).unwrap().next().unwrap().unwrap().path();
    std::fs::write(&file, "torn").unwrap();
    Dataset::begin(&new, spec(SMALL)).unwrap().make(Part::WHOLE, &()).unwrap_err();
    assert!(file.exists() && new.join("dataset.json").exists());
}

/// A spec that was changed by hand is told with its file.
#[test]
fn a_broken_spec_is_told_with_its_file() {
    let dir = tempfile::tempdir().unwrap();
    made(dir.path(), Part::WHOLE);
    for (text, said) in [("rows = = 3", "spec.toml: line 1: "), ("rows = 0", "spec.toml: `rows` = 0 is outside")] {
        std::fs::write(dir.path().join("spec.toml"), text).unwrap();
        let found = Dataset::open(dir.path(), dir.path()).unwrap_err().to_string();
        assert!(found.contains(said), "{found}");
    }
}

/// What the user has written stays, whatever its name, and nothing else is written then.
#[test]
fn files_of_the_user_are_not_replaced() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("mine");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(folder.join("spec.toml"), format!("# my remarks\n{SMALL}")).unwrap();
    let said = Dataset::begin(&folder, spec(SMALL)).unwrap_err().to_string();
    assert!(said.contains("spec.toml: is not the spec of this data set and is not replaced"), "{said}");
    let left: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["spec.toml"]);
    assert!(std::fs::read_to_string(folder.join("spec.toml")).unwrap().starts_with("# my remarks"));
    let folder = dir.path().join("set");
    made(&folder, Part::WHOLE);
    let dataset = Dataset::open(&folder, &folder).unwrap();
    let card = folder.join("README.md");
    for before in [true, false] {
        // a card of the user before the last step, and one that the user has edited after it
        std::fs::write(&card, "mine").unwrap();
        let said = dataset.finish(&()).unwrap_err().to_string();
        assert!(said.contains("README.md: is not a result of an earlier run and is not replaced"), "{said}");
        assert_eq!(std::fs::read_to_string(&card).unwrap(), "mine");
        assert_eq!(folder.join("statistics.json").exists(), !before, "half of the last step was done");
        std::fs::remove_file(&card).unwrap();
        dataset.finish(&()).unwrap();
    }
    // and its own card, as often as wanted
    dataset.finish(&()).unwrap();
}

/// A file that was damaged after the data set was whole is not taken into it again.
#[test]
fn damage_is_not_blessed() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("set");
    made(&folder, Part::WHOLE);
    let dataset = Dataset::open(&folder, &folder).unwrap();
    let digest = dataset.finish(&()).unwrap().digest;
    let manifest = std::fs::read(folder.join("manifest.json")).unwrap();
    let (file, second) = (dataset.shard_file(1), dataset.shard_file(2));
    let mut bytes = std::fs::read(&file).unwrap();
    let at = bytes.len() / 2;
    bytes[at] ^= 1;
    std::fs::write(&file, bytes).unwrap();
    let errors = [
        dataset.make(Part::WHOLE, &()).err(),
        dataset.make(Part { worker: 1, of: 5 }, &()).err(),
        dataset.finish(&()).err(),
        dataset.verify(1, 0, &()).err(),
    ];
    for error in errors {
        let said = error.expect("damage was taken").to_string();
        assert!(said.contains("part-00001.parquet: is not the file that") && said.contains("remove it"), "{said}");
    }
    assert!(std::fs::read(folder.join("manifest.json")).unwrap() == manifest);
    dataset.make(Part { worker: 2, of: 5 }, &()).unwrap();
    std::fs::remove_file(&file).unwrap();
    dataset.make(Part::WHOLE, &()).unwrap();
    assert_eq!(dataset.finish(&()).unwrap().digest, digest);
    // a pipe in the place of a file is not waited for
    std::fs::remove_file(&second).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(&second).status().unwrap().success());
    std::fs::remove_file(folder.join("manifest.json")).unwrap();
    for error in [
        dataset.make(Part::WHOLE, &()).err(),
        dataset.finish(&()).err(),
        dataset.verify(90, 0, &()).err(),
        dataset.head(90).err(),
        dataset.compare_with(&dataset, &()).err(),
    ] {
        let said = error.expect("a pipe was read").to_string();
        assert!(said.contains("part-00002.parquet") && said.contains("a pipe, not a regular file"), "{said}");
    }
}

/// Of two data sets that are begun at the same time in one folder, one has it, and can be made.
#[test]
fn one_of_two_specs_has_the_folder() {
    let dir = tempfile::tempdir().unwrap();
    for round in 0..100 {
        let folder = dir.path().join(round.to_string());
        let gate = std::sync::Barrier::new(2);
        let begin = &|seed: u32| {
            let spec = spec(&SMALL.replace("seed = 3", &format!("seed = {seed}")));
            gate.wait();
            std::thread::sleep(std::time::Duration::from_nanos(2500) * (round % 50) * (seed % 2));
            Dataset::begin(&folder, spec).map(|_| ()).map_err(|refusal| refusal.to_string())
        };
        let found: Vec<_> = std::thread::scope(|scope| {
            let runs = [3, 4].map(|seed| scope.spawn(move || begin(seed)));
            runs.into_iter().map(|run| run.join().unwrap()).collect()
        });
        assert_eq!(found.iter().filter(|found| found.is_ok()).count(), 1, "{found:?}");
        Dataset::open(&folder, &folder).unwrap();
    }
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
            if seen.get() == fail_at && operation != DiskOperation::Remove {
                return Err(io::ErrorKind::StorageFull.into());
            }
            Ok(())
        };
        watching_disk(watcher, || write_shard(&spec, 0, &path, &|| ()))
    };
    run(0).unwrap();
    let (steps, whole) = (count.get(), std::fs::read(&path).unwrap());
    assert!(steps >= 4, "{steps} steps");
    for step in 1..=steps {
        std::fs::remove_file(&path).unwrap();
        let error = run(step).unwrap_err().to_string();
        assert!(error.contains("part-00000.parquet"), "step {step}: {error}");
        let left = std::fs::read_dir(dir.path()).unwrap().count();
        assert_eq!(left, 0, "step {step} leaves a file");
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
    let (mut unseen, tries) = (0, 60);
    for k in 0..tries {
        let mut bytes = whole.clone();
        bytes[(2 * k + 1) * whole.len() / (2 * tries)] ^= 0x40;
        std::fs::write(&file, bytes).unwrap();
        let verified = dataset.verify(90, 0, &());
        unseen += usize::from(verified.is_ok_and(|verified| verified.differ.is_empty()));
    }
    assert!(unseen < tries / 2, "{unseen} of {tries} changed bytes are not found");
    std::fs::write(&file, whole).unwrap();
    assert!(dataset.verify(90, 0, &()).unwrap().differ.is_empty());
}

/// Rows in any order, from makers that have made other rows before, have the same bits, at rest and in motion.
#[test]
fn a_row_depends_on_its_number_alone() {
    let bits = |maker: &mut Maker<'_>, index: u64| -> Vec<u64> {
        let row = maker.row(index).unwrap();
        let maps = [row.pressure().values(), row.conductance().values(), row.image()].concat();
        let numbers = maps.into_iter().chain(row.volts().iter().copied());
        let numbers = numbers.chain([row.time_s(), row.first_row() as f64]);
        numbers.map(f64::to_bits).collect()
    };
    let moving = format!("{COURSE}[skin]\npresses_before = 1\n");
    for (text, rows) in [(SMALL, (0..90).collect()), (&moving, vec![3, 49, 50, 130])] {
        let spec = spec(text);
        let mut forward = Maker::new(&spec);
        let there: Vec<_> = rows.iter().map(|row| bits(&mut forward, *row)).collect();
        let mut backward = Maker::new(&spec);
        for (row, expected) in rows.iter().zip(&there).rev() {
            assert!(bits(&mut backward, *row) == *expected, "row {row}");
        }
        let last = rows.len() - 1;
        assert!(bits(&mut Maker::new(&spec), rows[last]) == there[last], "row {last} alone");
    }
}

/// Σ p·A is the sum of the forces, which no part beside the sheet can carry: the balance is exact to 1e-12 of the
/// force, and sums of a hundred taxels round to 1e-13.
#[test]
fn pressure_carries_the_force() {
    let spec = spec(SMALL);
    let mut maker = Maker::new(&spec);
    for index in 0..90 {
        let row = maker.row(index).unwrap();
        let forces: f64 = (0..row.objects()).map(|k| row.object(k).unwrap().touch.force_n).sum();
        let carried = row.pressure().sum() * spec.skin().cell_area_m2();
        assert!((carried / forces - 1.0).abs() < 1e-11, "row {index}: {carried} N of {forces} N");
    }
}

/// The image Rf·Vd·G of a row, V.
fn image(row: &crate::Row<'_>, volts_per_siemens: f64) -> Vec<f64> {
    let conductance = row.conductance().values().iter();
    conductance.map(|g| g * volts_per_siemens).collect()
}

/// Without effects y is Φ x with x = Rf·Vd·G: closed form; sums of a hundred products round to 1e-13 of their size.
#[test]
fn samples_are_the_weighted_sums() {
    let spec =
        spec("rows = 30\nreadout = \"ideal\"\n[object]\nfrom = \"objects\"\n[record]\nwindows = 3\nmeasurements = 11");
    let volts_per_siemens = Profile::named("ideal").unwrap().volts_per_siemens();
    let mut maker = Maker::new(&spec);
    for index in 0..30 {
        let row = maker.row(index).unwrap();
        let phi = row.phi();
        assert!(phi.iter().all(|w| w.abs().to_bits() == 1.0_f64.to_bits()), "weights are ±1");
        let x = image(&row, volts_per_siemens);
        let size: f64 = x.iter().sum();
        for (y, weights) in row.volts().iter().zip(phi.chunks_exact(100)) {
            let sum: f64 = weights.iter().zip(&x).map(|(w, x)| w * x).sum();
            assert!((y - sum).abs() < 1e-13 * size * 10.0, "row {index}: {y} and {sum}");
        }
        // windows follow each other without a gap
        let first = maker.row(index - index % 3).unwrap().first_row();
        assert_eq!(maker.row(index).unwrap().first_row(), first + 11 * (index % 3));
    }
}

/// Every spec that ships makes its first rows, within the sheet's means.
#[test]
fn specs_that_ship_make_rows() {
    for (name, _) in NAMED_SPECS {
        let spec = Spec::load(name, &toml::Table::new()).unwrap();
        let mut maker = Maker::new(&spec);
        let (mut refused, mut touched, rows) = (0, 0, if *name == "large-skin" { 20 } else { 300 });
        for index in 0..rows {
            let row = maker.row(index).unwrap_or_else(|e| panic!("{name}: {e}"));
            let taxels = spec.skin().taxels();
            let scanned = if spec.config().record.raster { taxels } else { 0 };
            assert_eq!((row.pressure().values().len(), row.image().len()), (taxels, scanned));
            assert!(row.volts().iter().all(|v| v.is_finite()), "{name} {index}");
            assert!(row.pressure().max() > 0.0 || row.time_s() < 0.01 || spec.is_moving(), "{name} {index}");
            touched += u64::from(row.pressure().max() > 0.0);
            refused += row.object(0).unwrap().touch.refused;
        }
        assert!(3 * touched > rows, "{name}: {touched} of {rows} rows have a touch");
        assert!(refused < rows, "{name}: {refused} poses of {rows} rows were refused");
    }
}

/// Shares of the splits within five standard errors, and no shape in two of them.
#[test]
fn splits_divide_neither_shapes_nor_presses() {
    let text = "rows = 4000\n[object]\nrows_per_shape = 4\n[pose]\nrotation_deg = 10\n[split]\nvalidation = 0.2\ntest = 0.3\n[record]\nwindows = 2\nraster = false\nmeasurements = 1";
    let spec = spec(text);
    let mut maker = Maker::new(&spec);
    let splits: Vec<&str> = (0..4000).map(|k| maker.row(k).unwrap().split()).collect();
    assert!(splits.chunks(4).all(|shape| shape.iter().all(|split| *split == shape[0])));
    for (split, share) in [("train", 0.5_f64), ("validation", 0.2), ("test", 0.3)] {
        let found = splits.iter().step_by(4).filter(|s| **s == split).count() as f64 / 1000.0;
        assert!((found - share).abs() < 5.0 * (share * (1.0 - share) / 1000.0).sqrt(), "{split}: {found}");
    }
}

/// Rows that are made and rows that are read are the same JSON, whichever rows and columns are asked for.
#[test]
fn chosen_rows_are_the_rows_of_files() {
    let spec = spec(SMALL);
    let dir = tempfile::tempdir().unwrap();
    let dataset = Dataset::begin(dir.path(), spec.clone()).unwrap();
    dataset.make(Part::parse("0/2").unwrap(), &()).unwrap();
    assert_eq!(dataset.made_rows(), [0..20, 40..60, 80..90]);
    let wanted: BTreeSet<u64> = [0, 1, 19, 41, 42, 59, 80, 89].into();
    for columns in [&[][..], &["index", "support", "object_2", "y_v", "phi"]] {
        let (mut read, mut made) = (Vec::new(), Vec::new());
        dataset
            .rows(&wanted, columns, |row| {
                read.push(row);
                Ok(())
            })
            .unwrap();
        spec.rows(&wanted, columns, |row| {
            made.push(row);
            Ok(())
        })
        .unwrap();
        assert_eq!(read, made);
        let numbers: Vec<u64> = read.iter().map(|row| row["index"].as_u64().unwrap()).collect();
        assert!(numbers.iter().eq(&wanted), "{numbers:?}");
        // `phi` is not recorded
        let kept = if columns.is_empty() { crate::columns(&spec).len() } else { 4 };
        assert!(read.iter().all(|row| row.as_object().unwrap().len() == kept));
    }
    let head = dataset.head(20).unwrap();
    assert_eq!((head.len(), &head[19]["index"]), (20, &19.into()));
    let missing = dataset.rows(&[20].into(), &[], |_| Ok(())).unwrap_err().to_string();
    assert!(missing.contains("part-00001.parquet"), "{missing}");
    let beyond = dataset.rows(&[90].into(), &[], |_| Ok(())).unwrap_err().to_string();
    assert!(beyond.ends_with("has no row 90; valid: [0, 89]"), "{beyond}");
}

/// What is drawn at random lies in the rows that are there, is a function of label and seed, and is all of them when
/// there are no more.
#[test]
fn drawn_rows_are_rows_that_are_there() {
    let spec = spec(SMALL);
    let held = [0..20, 40..60, 80..90];
    let drawn = spec.drawn_rows("preview", &held, 12, 4);
    assert_eq!(drawn.len(), 12);
    assert!(drawn.iter().all(|row| held.iter().any(|range| range.contains(row))));
    assert_eq!(drawn, spec.drawn_rows("preview", &held, 12, 4));
    assert_ne!(drawn, spec.drawn_rows("preview", &held, 12, 5));
    assert_ne!(drawn, spec.drawn_rows("verify", &held, 12, 4));
    let all: BTreeSet<u64> = held.iter().cloned().flatten().collect();
    assert_eq!(spec.drawn_rows("preview", &held, 50, 4), all);
    assert_eq!(spread_rows(&held, 1000), all);
    assert!(spread_rows(&[], 5).is_empty());
}

/// `record.labels` leaves columns out and changes none of the others.
#[test]
fn labels_are_columns_that_can_be_left_out() {
    let maps = ["pressure_pa", "conductance_s", "support"];
    let all = spec(SMALL);
    let one = spec(&format!("{SMALL}\nlabels = [\"support\"]"));
    let rows = |spec: &Spec| {
        let mut rows = Vec::new();
        let each = |row| {
            rows.push(row);
            Ok(())
        };
        spec.rows(&(0..3).collect(), &[], each).unwrap();
        rows
    };
    for (mut full, short) in rows(&all).into_iter().zip(rows(&one)) {
        let full = full.as_object_mut().unwrap();
        assert!(maps.iter().all(|name| full[*name].is_array()));
        full.remove("pressure_pa");
        full.remove("conductance_s");
        assert_eq!(&*full, short.as_object().unwrap());
    }
}

const COURSE: &str = "rows = 300\nreadout = \"ideal\"\n[object]\nfrom = \"objects\"\nnames = [\"T\"]\nrows_per_shape = 50
[pose]\nabout = \"placement\"\n[press]\nforce_n = 20\n[record]\nwhat = \"course\"\nwindows = 50\ninterval_s = 0.02\nbefore_s = 0.1\n";

/// Force on the skin at every window of press 0: nothing before the touch, the force asked for on the plateau, nothing
/// after the lift. Allowed on the plateau: 1 %, which the arm's force loop is tested to in its own crate.
fn follows_its_course(text: &str) {
    let spec = spec(text);
    let mut maker = Maker::new(&spec);
    let course: Vec<[f64; 2]> = (0..50)
        .map(|k| {
            let row = maker.row(k).unwrap();
            [row.time_s(), row.contact_force_n()]
        })
        .collect();
    let at = |time_s: f64| course.iter().find(|[t, _]| *t >= time_s - 1e-9).unwrap()[1];
    assert!((course[0][0] + 0.1).abs() < 1e-9, "{:?}", course[0]);
    for time_s in [-0.1, -0.06, 0.86, 0.88] {
        assert!(at(time_s) <= 0.0, "{} N at {time_s} s", at(time_s));
    }
    for time_s in [0.44, 0.5, 0.56] {
        assert!((at(time_s) / 20.0 - 1.0).abs() < 0.01, "{} N at {time_s} s", at(time_s));
    }
    let rising: Vec<f64> = course.iter().map(|[_, force]| *force).skip(5).take(20).collect();
    assert!(rising.windows(2).all(|pair| pair[1] > pair[0] - 0.2), "{rising:?}");
}

#[test]
fn a_balanced_press_follows_its_course() {
    follows_its_course(COURSE);
}

#[test]
fn a_stepped_press_follows_its_course() {
    follows_its_course(&format!("{COURSE}[contact]\nmodel = \"winkler\""));
}

/// Without effects y is Φ x, x being the conductance of the moment: from the middle of a window to its ends, 0.16 ms,
/// the force rises by less than 0.1 % of its plateau, and a conductance by less than 1 % of all on the plateau.
#[test]
fn samples_of_a_course_are_the_weighted_sums_of_their_moment() {
    let spec = spec(&format!("{COURSE}[contact]\nmodel = \"winkler\""));
    let volts_per_siemens = Profile::named("ideal").unwrap().volts_per_siemens();
    let mut maker = Maker::new(&spec);
    let plateau: f64 = maker.row(30).unwrap().conductance().sum() * volts_per_siemens;
    for index in 0..50 {
        let row = maker.row(index).unwrap();
        let x = image(&row, volts_per_siemens);
        for (y, weights) in row.volts().iter().zip(row.phi().chunks_exact(100)) {
            let sum: f64 = weights.iter().zip(&x).map(|(w, x)| w * x).sum();
            assert!((y - sum).abs() <= 0.01 * plateau, "window {index}: {y} and {sum} of {plateau}");
        }
    }
}

/// A hold under a field that is stepped is the plateau of its course, and close to the balance of the same columns:
/// the arm, which gives way sideways, and the tilt that `footprint` neglects leave the forces of taxels 5 % apart at
/// most, in the mean.
#[test]
fn holds_of_two_fields_agree() {
    let text = |model: &str| {
        format!(
            "rows = 5\nseed = 4\n[object]\nfrom = \"objects\"\nnames = [\"T\"]\n[pose]\nabout = \"placement\"\n\
             [press]\nforce_n = {{ uniform = [5.0, 30.0] }}\n[contact]\nmodel = \"{model}\"\n[record]\nwindows = 1\n"
        )
    };
    let (balanced, stepped) = (spec(&text("footprint")), spec(&text("winkler")));
    let (mut a, mut b) = (Maker::new(&balanced), Maker::new(&stepped));
    for index in 0..5 {
        let (a, b) = (a.row(index).unwrap(), b.row(index).unwrap());
        assert!((a.time_s() - b.time_s()).abs() < 1e-12);
        let (forces, other) = (a.contact_force_n(), b.contact_force_n());
        assert!((other / forces - 1.0).abs() < 0.01, "{forces} N and {other} N");
        let pairs = a.pressure().values().iter().zip(b.pressure().values());
        let apart: f64 = pairs.map(|(p, q)| (p - q).abs()).sum::<f64>() / a.pressure().sum();
        assert!(apart < 0.05, "row {index}: {apart}");
    }
}

/// A ball meets the skin with √(2 g h), is felt, and is gone again; its speed to 1 %, since a step of 0.1 ms is 1 mm/s.
#[test]
fn drops_have_a_touch_and_an_end() {
    let spec = spec(
        "rows = 32\n[object]\nfrom = \"ball\"\n[pose]\nx_share = { uniform = [-0.3, 0.3] }\n[drop]\nheight_m = { grid = [0.1, 0.5] }\n\
         [record]\nwhat = \"drop\"\nwindows = 16\ninterval_s = 0.001\nbefore_s = 0.004",
    );
    let mut maker = Maker::new(&spec);
    for (drop, height_m) in [(0, 0.1_f64), (1, 0.5)] {
        let forces: Vec<[f64; 2]> = (0..16)
            .map(|k| {
                let row = maker.row(16 * drop + k).unwrap();
                [row.time_s(), row.contact_force_n()]
            })
            .collect();
        let row = maker.row(16 * drop).unwrap();
        let ball = row.object(0).unwrap().touch.ball.unwrap();
        let expected = (2.0 * 9.806_65 * height_m).sqrt();
        assert!((ball.speed_m_per_s / expected - 1.0).abs() < 0.01, "{}", ball.speed_m_per_s);
        assert!(forces.iter().all(|[t, f]| *t > -2e-4 || *f <= 0.0), "{forces:?}");
        assert!(forces[15][1] <= 0.0, "{forces:?}");
        let most = forces.iter().map(|[_, f]| *f).fold(0.0, f64::max);
        assert!(most > 20.0, "{most} N");
    }
}

/// A ball so heavy that it is still on the skin when its last window ends has been followed all the same.
#[test]
fn a_bounce_need_not_end() {
    let spec = spec(
        "rows = 16\n[object]\nfrom = \"ball\"\n[record]\nwhat = \"drop\"\n[drop]\nmass_kg = 50.0\nheight_m = 0.03",
    );
    let mut maker = Maker::new(&spec);
    let forces: Vec<f64> = (0..16).map(|row| maker.row(row).unwrap().contact_force_n()).collect();
    assert!(forces[0] == 0.0 && forces[15] > 50.0, "{forces:?}");
}

fn refused(text: &str) -> String {
    Spec::from_toml(text, &toml::Table::new(), ".".as_ref()).unwrap_err().to_string()
}

/// Specs that cannot be, and what is said of them.
#[rustfmt::skip]
const REFUSED: &[(&str, &[&str])] = &[
    ("rows = 0", &["`rows` = 0", "[1, 10^12]"]),
    ("row = 1", &["unknown field `row`"]),
    ("name = \"a b\"", &["`name` = \"a b\"", "letters"]),
    ("name = \"\\u001b[31m\"", &["`name` = ", "\\u{1b}"]),
    ("rows_per_shard = 0", &["`rows_per_shard` = 0", "[1, 10^6]"]),
    ("rows_per_shard = 30\n[record]\nwindows = 20", &["`rows_per_shard` = 30", "`record.windows` = 20"]),
    ("[record]\nwindows = 0", &["`record.windows` = 0", "[1, 10000]"]),
    ("[record]\nmeasurements = 1000000\nphi = true", &["record.measurements × taxels", "[1, 2^22]"]),
    ("[record]\nlabels = [\"image\"]", &["`record.labels`", "`pressure`"]),
    ("[transducer]\nexponent = { uniform = [0.4, 9.0] }", &["`transducer.exponent` = 9", "[0.05, 2]"]),
    ("[object]\ncount = 11", &["`object.count` = 11", "[1, 10]"]),
    ("[object]\nfrom = \"clouds\"", &["clouds"]),
    ("[object]\nnames = [\"cloud\"]", &["`object.names` = \"cloud\"", "known: plate"]),
    ("[object]\nnames = []", &["`object.names` = []"]),
    ("[object]\nfrom = \"objects\"\nsize_m = [0.1, 0.2]", &["`object.size_m` is not for this"]),
    ("[object]\nsize_m = [0.2, 0.1]", &["`object.size_m[0]` = 0.2"]),
    ("[object]\nfrom = \"meshes\"", &["`object.folder` is needed"]),
    ("[object]\nfrom = \"meshes\"\nfolder = \"nowhere\"", &["`object.folder`: ", "nowhere"]),
    ("[pose]\nabout = \"placement\"", &["`pose.about` = \"placement\""]),
    ("[pose]\nx_share = 2", &["`pose.x_share` = 2", "[-1, 1]"]),
    ("[pose]\nx_share = { normal = [0, 1] }", &["`pose.x_share` = -4"]),
    ("[press]\nforce_n = 0", &["`press.force_n` = 0", "[0.01, 1000] N"]),
    ("[press]\nforce_n = \"much\"", &["`press.force_n`", "a number or a table"]),
    ("[contact]\nmodel = \"glue\"", &["`contact.model` = \"glue\""]),
    ("[record]\nwhat = \"drop\"", &["`record.what` = \"drop\"", "`object.from` = \"ball\""]),
    ("[drop]\nheight_m = 1", &["`[drop]` is for"]),
    ("[object]\nfrom = \"ball\"\n[record]\nwhat = \"drop\"\n[drop]\nheight_m = 9",
        &["`drop.height_m` = 9", "[0.001, 5] m"]),
    ("[object]\nfrom = \"ball\"\n[record]\nwhat = \"drop\"\n[contact]\nmodel = \"footprint\"",
        &["\"footprint\"", "\"winkler\""]),
    ("[object]\nfrom = \"ball\"\n[record]\nwhat = \"drop\"\n[press]\nforce_n = 3", &["`[press]` is not for drops"]),
    ("[object]\nfrom = \"ball\"\n[record]\nwhat = \"drop\"\n[pose]\ntilt_x_deg = 3",
        &["`pose.tilt_x_deg` is not for drops"]),
    ("[object]\ncount = 2\n[record]\nwhat = \"course\"", &["`object.count` = 2", "valid: 1"]),
    ("[press]\nhold_s = 0.3\n[record]\nwhat = \"course\"", &["`press.hold_s` = 0.3", "above 0.451 s"]),
    ("[press]\nforce_n = 200\n[contact]\nmodel = \"layer\"", &["`press.force_n` = 200", "[0.5, 100] N"]),
    ("[record]\nbefore_s = 0.1", &["`record.before_s` is not for"]),
    ("[press]\nhold_s = 100\n[contact]\nmodel = \"winkler\"", &["length of what is followed in time", "[0, 59.5] s"]),
    ("[skin]\nrows = 1000\ncols = 1000\n[contact]\nmodel = \"winkler\"\ncells_per_taxel = 1",
        &["frames × taxels", "[1, 2^27]"]),
    ("[record]\ninterval_s = 1e-4", &["`record.interval_s` = 0.0001", "sample rate"]),
    ("[record]\ninterval_s = 0.0333", &["`record.interval_s` = 0.0333", "0.03333333333333333 for 30", "whole_rate"]),
    ("[record]\ninterval_s = 3", &["such as 1 for 1"]),
    ("[record]\ninterval_s = nan", &["`record.interval_s` = NaN"]),
    ("[skin]\nrows = 64\ncols = 64\n[record]\nwindows = 10000\ninterval_s = 0.01",
        &["record.windows × taxels", "[1, 2^24]"]),
    ("[object]\nfrom = \"objects\"\ncount = 2\n[split]\nby = \"object\"",
        &["`split.by` = \"object\"", "`object.count` = 1"]),
    ("[skin]\nrows = 0", &["`skin.rows` = 0"]),
    ("[skin]\npitch_m = 1e308", &["`skin.pitch_m` = 1e308"]),
    ("[skin]\nseed = -1", &["`skin.seed` = -1", "[0, 2^53]"]),
    ("[transducer]\nmodel = \"rubber\"", &["\"rubber\"", "velostat"]),
    ("[transducer]\ntemperature_c = { uniform = [9, 3] }", &["`transducer.temperature_c", "9 is above 3"]),
    ("readout = \"perfect\"", &["\"perfect\"", "as_built"]),
    ("readout = \"nowhere.toml\"", &["nowhere.toml"]),
    ("[weights]\nseeds = [1, 2]", &["`weights.seeds`", "valid: 100"]),
    ("[faults]\ncount = 101", &["`faults.count` = 101"]),
    ("[faults]\nnames = [\"gremlin\"]", &["\"gremlin\"", "known: dead"]),
    ("[split]\ntest = 0.7\nvalidation = 0.7", &["split.validation + split.test", "1.4"]),
    ("rows = ", &["rows"]),
];

#[test]
fn nonsense_is_refused_with_its_name() {
    for (text, said) in REFUSED {
        let error = refused(text);
        for fact in *said {
            assert!(error.contains(fact), "{text:?}: `{fact}` is not in: {error}");
        }
        assert!(!error.contains('\n') && !error.contains('\u{1b}'), "{error:?}");
    }
}

/// What is written comes back, and two specs that differ have two identities.
#[test]
fn a_spec_is_its_text() {
    let overrides: toml::Table = toml::from_str("rows = 77").unwrap();
    let spec = Spec::load("random-shapes", &overrides).unwrap();
    let again = Spec::from_toml(spec.text(), &toml::Table::new(), ".".as_ref()).unwrap();
    assert_eq!((spec.identity(), again.config().rows), (again.identity(), 77));
    let other = Spec::load("random-shapes", &toml::Table::new()).unwrap();
    assert_ne!(spec.identity(), other.identity());
    assert!(Spec::load("random_shapes", &toml::Table::new()).unwrap_err().to_string().contains("random-shapes"));
}

/// A folder of meshes is read, and its files are a part of what the data set is.
#[test]
fn mesh_files_are_part_of_a_spec() {
    let dir = tempfile::tempdir().unwrap();
    let meshes = dir.path().join("meshes");
    std::fs::create_dir(&meshes).unwrap();
    let write = |name: &str, side_m: f64| {
        let block = spts_contact::mesh::cuboid([side_m, 0.03, 0.02]);
        std::fs::write(meshes.join(name), block.to_obj("block")).unwrap();
    };
    write("a.obj", 0.04);
    write("b.OBJ", 0.05);
    std::fs::write(meshes.join("notes.txt"), "no mesh").unwrap();
    let text = "rows = 30\n[object]\nfrom = \"meshes\"\nfolder = \"meshes\"\nrows_per_shape = 10";
    let read = || Spec::from_toml(text, &toml::Table::new(), dir.path());
    let spec = read().unwrap();
    let mut maker = Maker::new(&spec);
    let names: Vec<String> =
        [0, 10, 20].map(|k| maker.row(k).unwrap().object(0).unwrap().choice.name.to_string()).into();
    assert_eq!(names, ["a", "b", "a"]);
    write("a.obj", 0.06);
    assert_ne!(read().unwrap().identity(), spec.identity());
    // a box without its underside
    let mut open = spts_contact::mesh::cuboid([0.04, 0.03, 0.02]);
    open.triangles.retain(|t| t.iter().any(|i| open.vertices[*i as usize][2] > 0.0));
    std::fs::write(meshes.join("a.obj"), open.to_obj("open")).unwrap();
    let said = read().unwrap_err().to_string();
    assert!(said.contains("a.obj") && said.contains("not closed"), "{said}");
    let as_is = Spec::from_toml(text, &toml::toml! { object = { repair = "near_side" } }, dir.path()).unwrap();
    assert!(as_is.notes()[0].contains("a.obj: ") && as_is.notes()[0].contains("not closed"), "{:?}", as_is.notes());
    let shapes = toml::toml! { object = { from = "shapes", centre = true } };
    assert!(Spec::from_toml("", &shapes, dir.path()).unwrap_err().to_string().contains("`object.centre` is not for"));
    std::fs::write(meshes.join("a.obj"), "v 1 2 3").unwrap();
    assert!(read().unwrap_err().to_string().contains("a.obj"));
}

/// Two objects as frames of 3 × 4 taxels, 100 a second, pressed three and two times. Press k of the first loads taxel 5
/// with 10 k kPa, those of the second taxels 6 and 7.
fn frames(dir: &Path, unit: spts::FrameUnit) {
    use spts::data::{FrameArray, FrameOptions, Frames};
    for (name, presses, loaded) in [("one", 3, 5..6), ("two", 2, 6..8)] {
        let value = |press: usize, frame: usize, taxel: usize| {
            let on = (10..50).contains(&frame) && loaded.contains(&taxel);
            if on { 1e4 * (press + 1) as f64 } else { 0.0 }
        };
        let values = (0..presses).flat_map(|p| (0..60).flat_map(move |f| (0..12).map(move |t| (p, f, t))));
        let values = values.map(|(p, f, t)| value(p, f, t)).collect();
        let array = FrameArray { shape: vec![presses, 60, 3, 4], values, ..FrameArray::default() };
        let layout = spts::SkinLayout::with_pitch(3, 4, 0.01).unwrap();
        let options = FrameOptions { rate_hz: Some(100.0), idle: Some(10), ..FrameOptions::new(name, layout, unit) };
        let (session, _) = Frames::new(array, [3, 4], None).unwrap().session(&options).unwrap();
        session.write(&dir.join("frames").join(name)).unwrap();
    }
}

const OF_FRAMES: &str = "[object]\nfrom = \"frames\"\nfolder = \"frames\"\n[record]\nmeasurements = 5\n";

#[test]
fn frames_are_presses() {
    let dir = tempfile::tempdir().unwrap();
    frames(dir.path(), spts::FrameUnit::Pressure);
    let read = |text: &str, set: toml::Table| Spec::from_toml(text, &set, dir.path());
    let spec = read(OF_FRAMES, toml::Table::new()).unwrap();
    // a row for every press: the first of every object, then the second
    assert_eq!((spec.config().rows, spec.skin().taxels(), spec.skin().pitch_m()), (5, 12, 0.01));
    let mut maker = Maker::new(&spec);
    let mut seen = Vec::new();
    for k in 0..5 {
        let row = maker.row(k).unwrap();
        let pressure = row.pressure().values();
        let loaded: Vec<usize> = (0..12).filter(|taxel| pressure[*taxel] > 0.0).collect();
        assert!(loaded.iter().all(|taxel| row.conductance().values()[*taxel] > 1e-5), "{k}");
        let force_n: f64 = pressure.iter().map(|p| p * 1e-4).sum();
        assert!((row.contact_force_n() - force_n).abs() < 1e-12, "{k}");
        seen.push((row.name().to_string(), pressure[loaded[0]], loaded));
    }
    let press = |name: &str, pa: f64, loaded: &[usize]| (name.to_owned(), pa, loaded.to_vec());
    let expected =
        [press("one", 1e4, &[5]), press("two", 1e4, &[6, 7]), press("one", 2e4, &[5]), press("two", 2e4, &[6, 7])];
    assert_eq!(seen[..4], expected);
    assert_eq!(seen[4], press("one", 3e4, &[5]));
    let names = |spec: &Spec| crate::columns(spec).into_iter().map(|column| column.name).collect::<Vec<_>>();
    let pressures = names(&spec);
    assert!(pressures.contains(&"pressure_pa".to_owned()) && !pressures.contains(&"force_n".to_owned()));
    // more rows: the presses come again, each in one split
    let many = read(OF_FRAMES, toml::toml! { rows = 50 }).unwrap();
    let mut maker = Maker::new(&many);
    let splits: Vec<&str> = (0..50).map(|k| maker.row(k).unwrap().split()).collect();
    assert!((5..50).all(|k| splits[k] == splits[k - 5]), "{splits:?}");
    // the course of a press: nothing before the touch
    let course = toml::toml! { record = { what = "course", before_s = 0.05, interval_s = 0.01 } };
    let course = read(OF_FRAMES, course).unwrap();
    assert_eq!(course.windows(), 55);
    let mut maker = Maker::new(&course);
    let load = |row: crate::Row<'_>| row.pressure().values()[5];
    let loads = [0, 3, 10, 54].map(|k| load(maker.row(k).unwrap()));
    assert_eq!(loads.map(f64::to_bits), [0.0, 0.0, 1e4, 0.0].map(f64::to_bits));

    let other = dir.path().join("codes");
    std::fs::create_dir(&other).unwrap();
    frames(&other, spts::FrameUnit::Codes);
    let read = |text: &str, set: toml::Table| Spec::from_toml(text, &set, &other);
    let codes = read(OF_FRAMES, toml::Table::new()).unwrap();
    let there = names(&codes);
    for gone in ["pressure_pa", "contact_force_n", "x_m", "over_edge"] {
        assert!(!there.contains(&gone.to_owned()), "{gone}");
    }
    assert!(codes.notes().iter().any(|note| note.contains("object.peak_pa says otherwise")), "{:?}", codes.notes());
    // one scale for all presses
    let mut maker = Maker::new(&codes);
    let peaks = [0, 4].map(|k| maker.row(k).unwrap().conductance().max());
    assert!((peaks[1] / peaks[0] - 3.0).abs() < 1e-12, "{peaks:?}");
    for (set, said) in [
        (toml::toml! { press = { force_n = 5 } }, "`[press]` is not for `object.from` = \"frames\""),
        (toml::toml! { pose = { x_m = 0.01 } }, "`[pose]` is not for"),
        (toml::toml! { contact = { model = "layer" } }, "`[contact]` is not for"),
        (toml::toml! { object = { names = ["three"] } }, "`object.names` = \"three\"; known: one, two"),
        (toml::toml! { object = { peak_pa = 1.0 } }, "`object.peak_pa` = 1 is outside [100, 1e6] Pa"),
        (toml::toml! { object = { size_m = [0.1, 0.2] } }, "`object.size_m` is not for"),
        (toml::toml! { skin = { rows = 4 } }, "`skin` = 4 × 4 taxels; the frames have 3 × 4"),
        (toml::toml! { record = { labels = ["pressure"] } }, "\"pressure\", which is not known of these frames"),
        (toml::toml! { record = { windows = 9000 } }, "and the hold of the frames lasts 0.4"),
    ] {
        let found = read(OF_FRAMES, set).unwrap_err().to_string();
        assert!(found.contains(said), "{said}: {found}");
    }
    let missing = read("[object]\nfrom = \"frames\"", toml::Table::new()).unwrap_err().to_string();
    assert!(missing.contains("`object.folder` is needed"), "{missing}");
}
