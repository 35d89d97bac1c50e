//! The layout that LeRobot v3.0 reads.

use super::{PRESSES, exported, made, numbers, single};
use crate::read::{Wanted, batches, json, numbers as each_number};
use crate::spec::whole as whole_number;
use arrow_array::cast::AsArray as _;
use arrow_array::types::Float64Type;
use arrow_array::{Array as _, ArrayRef};
use arrow_schema::DataType;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde_json::{Value, json as document};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

fn read_json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Rows of a Parquet file: of every column its numbers, nested lists one after the other.
fn table(path: &Path) -> Vec<BTreeMap<String, Vec<f64>>> {
    let mut rows = Vec::new();
    let read = batches(path, Wanted::All, |batch| {
        for row in 0..batch.num_rows() {
            let schema = batch.schema();
            let columns = schema.fields().iter().zip(batch.columns());
            rows.push(
                columns
                    .map(|(field, array)| (field.name().clone(), flat(&array.slice(row, 1))))
                    .collect(),
            );
        }
        Ok(true)
    });
    read.unwrap();
    rows
}

fn flat(array: &ArrayRef) -> Vec<f64> {
    let rows = 0..array.len();
    match array.data_type() {
        DataType::List(_) => rows.flat_map(|k| flat(&array.as_list::<i32>().value(k))).collect(),
        DataType::FixedSizeList(..) => rows.flat_map(|k| flat(&array.as_fixed_size_list().value(k))).collect(),
        DataType::Float64 => array.as_primitive::<Float64Type>().values().to_vec(),
        _ => {
            let mut values = Vec::new();
            each_number(array, |value| values.push(value));
            values
        }
    }
}

/// Every frame is the row that it says it is, in episodes of whole presses, the splits one after the other.
#[test]
fn frames_are_the_rows() {
    let dir = tempfile::tempdir().unwrap();
    let dataset = made(&dir.path().join("set"), PRESSES);
    let out = dir.path().join("out");
    let report = exported(&dataset, "lerobot", &out);
    let rows = dataset.head(89).unwrap();
    let info = read_json(&out.join("meta/info.json"));
    let frames = table(&out.join("data/chunk-000/file-000.parquet"));
    let episodes = table(&out.join("meta/episodes/chunk-000/file-000.parquet"));
    assert_eq!((frames.len(), episodes.len()), (89, 30));
    assert_eq!((report.rows, report.episodes), (89, Some(30)));
    for (key, value) in [
        ("codebase_version", document!("v3.0")),
        ("total_episodes", document!(30)),
        ("total_frames", document!(89)),
        ("fps", document!(50)),
        ("chunks_size", document!(1000)),
        ("video_path", Value::Null),
    ] {
        assert_eq!(info[key], value, "{key}");
    }
    // ranges of episodes by the split of their rows
    let mut end = 0;
    let ranges = info["splits"].as_object().unwrap();
    let mut split_of_episode = vec![""; 30];
    for split in ["train", "validation", "test"] {
        let range: Vec<usize> = ranges[split]
            .as_str()
            .unwrap()
            .split(':')
            .map(|n| n.parse().unwrap())
            .collect();
        assert!(range[0] == end && range[1] > end, "{split}: {range:?}");
        split_of_episode[range[0]..range[1]].fill(split);
        end = range[1];
    }
    assert_eq!((end, ranges.len()), (30, 3));
    let tasks: Vec<String> = {
        let mut names = Vec::new();
        let tasks = out.join("meta/tasks.parquet");
        batches(&tasks, Wanted::All, |batch| {
            let column = batch.column_by_name("task").unwrap();
            names.extend((0..batch.num_rows()).map(|k| json(column, k).as_str().unwrap().to_owned()));
            Ok(true)
        })
        .unwrap();
        names
    };
    let cell_m2 = dataset.spec().skin().cell_area_m2();
    let mut seen = [false; 89];
    let mut at = 0;
    for (e, episode) in episodes.iter().enumerate() {
        let whole = |key: &str| whole_number(episode[key][0]);
        assert_eq!((whole("episode_index"), whole("dataset_from_index")), (e, at));
        let length = whole("length");
        assert_eq!(whole("dataset_to_index"), at + length);
        assert_eq!(
            whole("data/chunk_index") + whole("data/file_index") + whole("meta/episodes/file_index"),
            0
        );
        for k in 0..length {
            let frame = &frames[at + k];
            let source = whole_number(frame["source_index"][0]);
            assert!(!std::mem::replace(&mut seen[source], true), "row {source} twice");
            let row = &rows[source];
            assert_eq!(row["split"], split_of_episode[e]);
            // 29 presses of three windows and one of two
            assert_eq!(length, if row["press"] == 29 { 2 } else { 3 });
            assert_eq!(numbers(row, "window"), frame["frame_index"]);
            for (key, column) in [
                ("observation.tactile.pressure", "pressure_pa"),
                ("observation.tactile.conductance", "conductance_s"),
                ("observation.tactile.raster", "image_v"),
                ("observation.tactile.samples", "y_v"),
                ("label", "label"),
                ("first_row", "first_row"),
            ] {
                let expected: Vec<f64> = numbers(row, column).into_iter().map(single).collect();
                assert_eq!(frame[key], expected, "{key}");
            }
            let state: Vec<f64> = ["x_m", "y_m", "height_m", "rotation_deg", "tilt_x_deg", "tilt_y_deg"]
                .iter()
                .map(|name| single(numbers(row, name)[0]))
                .collect();
            assert_eq!(frame["observation.state"], state);
            let next = &frames[at + (k + 1).min(length - 1)];
            assert_eq!(frame["action"], next["observation.state"]);
            let force = frame["observation.tactile.pressure"].iter().sum::<f64>() * cell_m2;
            // a sum of doubles, stored in single precision: half a unit of its last place
            assert!((frame["observation.force"][0] / force - 1.0).abs() < 1e-7);
            assert_eq!(frame["timestamp"], [single(k as f64 / 50.0)]);
            assert_eq!(
                ["index", "episode_index"].map(|key| whole_number(frame[key][0])),
                [at + k, e]
            );
            let task = &tasks[whole_number(frame["task_index"][0])];
            assert_eq!(*task, format!("press {}", row["object"].as_str().unwrap()));
        }
        at += length;
    }
    assert!(seen.iter().all(|seen| *seen));
    assert_eq!(info["total_tasks"], tasks.len());
    check_statistics(&out, &frames, &episodes);
}

/// Counts, least, most and means of every feature, of the episodes and of all frames.
fn check_statistics(out: &Path, frames: &[BTreeMap<String, Vec<f64>>], episodes: &[BTreeMap<String, Vec<f64>>]) {
    let stats = read_json(&out.join("meta/stats.json"));
    let nested = |value: &Value| -> Vec<f64> {
        let list = value.as_array().unwrap().iter();
        list.flat_map(|v| v.as_array().map_or_else(|| vec![v.clone()], Clone::clone))
            .map(|v| v.as_f64().unwrap())
            .collect()
    };
    for (key, first) in &frames[0] {
        let check = |of: &[BTreeMap<String, Vec<f64>>], stat: &dyn Fn(&str) -> Vec<f64>| {
            assert_eq!(stat("count"), [of.len() as f64], "{key}");
            let found = ["min", "max", "mean", "std", "q01", "q10", "q50", "q90", "q99"].map(stat);
            for entry in 0..first.len() {
                let values: Vec<f64> = of.iter().map(|frame| frame[key][entry]).collect();
                let least = values.iter().copied().fold(f64::INFINITY, f64::min);
                let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
                assert_eq!(
                    [found[0][entry], found[1][entry]].map(f64::to_bits),
                    [least, most].map(f64::to_bits),
                    "{key}"
                );
                // sums of 89 doubles round to 89 units of the last place of the largest
                let tolerance = 89.0 * f64::EPSILON * least.abs().max(most.abs());
                assert!((found[2][entry] - mean).abs() <= tolerance, "{key}");
                // the root of a variance that is off by tolerance²
                assert!(
                    (found[3][entry].powi(2) - square).abs() <= tolerance * (most - least) + tolerance.powi(2),
                    "{key}"
                );
                let order: Vec<f64> = found[4..].iter().map(|quantile| quantile[entry]).collect();
                let slack = tolerance;
                assert!(
                    order.windows(2).all(|pair| pair[0] <= pair[1] + slack),
                    "{key}: {order:?}"
                );
                assert!(
                    order[0] >= least - slack && order[4] <= most + slack,
                    "{key}: {order:?}"
                );
            }
            assert_eq!(found[0].len(), first.len(), "{key}");
        };
        check(frames, &|stat| nested(&stats[key][stat]));
        for episode in episodes {
            let range = whole_number(episode["dataset_from_index"][0])..whole_number(episode["dataset_to_index"][0]);
            check(&frames[range], &|stat| episode[&format!("stats/{key}/{stat}")].clone());
        }
    }
}

/// The types that LeRobot asks for, a group of rows for an episode, and the index of pandas.
#[test]
fn files_have_the_published_layout() {
    let dir = tempfile::tempdir().unwrap();
    let text = format!("{PRESSES}raster = false\nphi = true\ncodes = true\n");
    let dataset = made(&dir.path().join("set"), &text);
    let out = dir.path().join("out");
    exported(&dataset, "lerobot", &out);
    let open = |name: &str| ParquetRecordBatchReaderBuilder::try_new(File::open(out.join(name)).unwrap()).unwrap();
    let data = open("data/chunk-000/file-000.parquet");
    let lengths = data.metadata().row_groups().iter().map(|group| group.num_rows());
    let mut counts = BTreeMap::new();
    lengths.for_each(|length| *counts.entry(length).or_insert(0) += 1);
    assert_eq!(counts, BTreeMap::from([(2, 1), (3, 29)]));
    let info = read_json(&out.join("meta/info.json"));
    let features = info["features"].as_object().unwrap();
    assert_eq!(features.len(), data.schema().fields().len());
    let f32s = |shape: Value, names: Value| document!({"dtype": "float32", "shape": shape, "names": names});
    let one = document!({"dtype": "int64", "shape": [1], "names": null});
    let pose = document!(["x_m", "y_m", "height_m", "rotation_deg", "tilt_x_deg", "tilt_y_deg"]);
    for (key, feature) in [
        ("observation.state", f32s(document!([6]), pose.clone())),
        ("action", f32s(document!([6]), pose)),
        (
            "observation.tactile.pressure",
            f32s(document!([8, 12]), document!(["row", "col"])),
        ),
        (
            "observation.tactile.conductance",
            f32s(document!([8, 12]), document!(["row", "col"])),
        ),
        (
            "observation.tactile.phi",
            f32s(document!([7, 96]), document!(["measurement", "taxel"])),
        ),
        (
            "observation.tactile.samples",
            document!({"dtype": "int64", "shape": [7], "names": null}),
        ),
        ("observation.force", f32s(document!([1]), Value::Null)),
        ("timestamp", f32s(document!([1]), Value::Null)),
        ("label", one.clone()),
        ("source_index", one.clone()),
        ("first_row", one.clone()),
        ("frame_index", one.clone()),
        ("episode_index", one.clone()),
        ("index", one.clone()),
        ("task_index", one),
    ] {
        assert_eq!(features[key], feature, "{key}");
        let field = data.schema().field_with_name(key).unwrap().clone();
        let scalar = match feature["dtype"].as_str() {
            Some("float32") => DataType::Float32,
            _ => DataType::Int64,
        };
        let shape: Vec<i32> = serde_json::from_value(feature["shape"].clone()).unwrap();
        match (field.data_type(), &shape[..]) {
            (DataType::FixedSizeList(item, length), [n]) if *n > 1 => {
                assert_eq!((item.data_type(), length), (&scalar, n), "{key}");
            }
            (DataType::List(rows), [_, _]) => match rows.data_type() {
                DataType::List(cols) => assert_eq!(cols.data_type(), &scalar, "{key}"),
                other => panic!("{key}: rows are {other}"),
            },
            (found, [1]) => assert_eq!(found, &scalar, "{key}"),
            (found, shape) => panic!("{key}: {found} for {shape:?}"),
        }
        // LeRobot takes every key with this word for a picture with three colours
        assert!(!key.contains("image"));
    }
    let tasks = open("meta/tasks.parquet");
    let pandas: Value = serde_json::from_str(&tasks.schema().metadata()["pandas"]).unwrap();
    assert_eq!(pandas["index_columns"], document!(["task"]));
    assert_eq!(
        std::fs::read_to_string(out.join("spec.toml")).unwrap(),
        dataset.spec().text()
    );
    let card = std::fs::read_to_string(out.join("README.md")).unwrap();
    assert!(features.keys().all(|key| card.contains(&format!("`{key}`"))), "{card}");
}
