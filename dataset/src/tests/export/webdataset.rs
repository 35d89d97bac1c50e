//! Tar files that WebDataset reads.

use super::{PRESSES, exported, made, numbers, single};
use crate::export::ExportOptions;
use crate::folder::Dataset;
use npyz::NpyFile;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// Files of a tar, in order, by the rules of POSIX.1-1988.
fn members(path: &Path) -> Vec<(String, Vec<u8>)> {
    let bytes = std::fs::read(path).unwrap();
    let (mut found, mut at) = (Vec::new(), 0);
    let octal = |field: &[u8]| {
        let digits = field.iter().take_while(|byte| byte.is_ascii_digit());
        digits.fold(0_usize, |sum, digit| 8 * sum + usize::from(digit - b'0'))
    };
    loop {
        let header = &bytes[at..at + 512];
        if header.iter().all(|byte| *byte == 0) {
            break;
        }
        let sum: usize = (header.iter().enumerate())
            .map(|(k, byte)| {
                if (148..156).contains(&k) {
                    32
                } else {
                    usize::from(*byte)
                }
            })
            .sum();
        assert_eq!(octal(&header[148..156]), sum, "checksum");
        assert_eq!(&header[257..265], b"ustar\x0000");
        let [mode, user, group, time] = [100, 108, 116, 136].map(|at| octal(&header[at..at + 8]));
        assert_eq!(
            [mode, user, group, time, usize::from(header[156] - b'0')],
            [0o644, 0, 0, 0, 0]
        );
        let name = header[..100].split(|byte| *byte == 0).next().unwrap();
        let length = octal(&header[124..136]);
        let content = bytes[at + 512..at + 512 + length].to_vec();
        found.push((String::from_utf8(name.to_vec()).unwrap(), content));
        at += 512 + length.next_multiple_of(512);
    }
    assert!(bytes.len() == at + 1024 && bytes[at..].iter().all(|byte| *byte == 0));
    found
}

/// Values and shape of a NumPy file.
fn array(bytes: &[u8]) -> (Vec<f64>, Vec<u64>) {
    let file = NpyFile::new(bytes).unwrap();
    let shape = file.shape().to_vec();
    let values = match file.dtype().descr().as_str() {
        "'<f4'" => file.into_vec::<f32>().unwrap().into_iter().map(f64::from).collect(),
        "'<i4'" => file.into_vec::<i32>().unwrap().into_iter().map(f64::from).collect(),
        "'|b1'" => (file.into_vec::<bool>().unwrap().into_iter())
            .map(|v| f64::from(u8::from(v)))
            .collect(),
        other => panic!("type {other}"),
    };
    (values, shape)
}

/// Checks all tars of `out` against the rows; returns the rows of every tar.
fn check(dataset: &Dataset, out: &Path, arrays: &[(&str, &str, &[u64])]) -> BTreeMap<String, usize> {
    let rows = dataset.head(dataset.spec().config().rows).unwrap();
    let mut names: Vec<_> = std::fs::read_dir(out)
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    names.retain(|name| Path::new(name).extension().is_some_and(|e| e == "tar"));
    let mut seen = vec![false; rows.len()];
    let mut counts = BTreeMap::new();
    for name in names {
        let name = name.into_string().unwrap();
        let members = members(&out.join(&name));
        let mut last = None;
        for row_files in members.chunks(1 + arrays.len()) {
            let json: Value = serde_json::from_slice(&row_files[0].1).unwrap();
            let index = usize::try_from(json["index"].as_u64().unwrap()).unwrap();
            assert!(last < Some(index), "rows of a split are in order");
            last = Some(index);
            assert!(!std::mem::replace(&mut seen[index], true));
            assert_eq!(row_files[0].0, format!("{index:09}.json"));
            assert_eq!(json["split"], name.split('-').next().unwrap());
            let scalars = rows[index]
                .as_object()
                .unwrap()
                .iter()
                .filter(|(_, value)| !value.is_array());
            let scalars: serde_json::Map<String, Value> = scalars.map(|(k, v)| (k.clone(), v.clone())).collect();
            assert_eq!(json, Value::Object(scalars));
            for ((file, bytes), (column, member, shape)) in row_files[1..].iter().zip(arrays) {
                assert_eq!(*file, format!("{index:09}.{member}.npy"));
                let (values, found) = array(bytes);
                assert_eq!(found, *shape, "{member}");
                let numbers = numbers(&rows[index], column);
                let expected = numbers
                    .iter()
                    .map(|v| if *column == "y_code" { *v } else { single(*v) });
                assert_eq!(values, expected.collect::<Vec<_>>(), "{member} of row {index}");
            }
        }
        counts.insert(name, members.len() / (1 + arrays.len()));
    }
    assert!(seen.iter().all(|seen| *seen));
    counts
}

#[test]
fn tars_hold_the_rows() {
    let dir = tempfile::tempdir().unwrap();
    let dataset = made(&dir.path().join("set"), PRESSES);
    let arrays: &[(&str, &str, &[u64])] = &[
        ("pressure_pa", "pressure", &[8, 12]),
        ("conductance_s", "conductance", &[8, 12]),
        ("support", "support", &[8, 12]),
        ("image_v", "image", &[8, 12]),
        ("y_v", "y", &[7]),
    ];
    let whole = exported(&dataset, "webdataset", &dir.path().join("whole"));
    let counts = check(&dataset, &dir.path().join("whole"), arrays);
    let splits: BTreeMap<String, usize> = (whole.splits.iter())
        .map(|(split, rows)| (format!("{split}-000000.tar"), usize::try_from(*rows).unwrap()))
        .collect();
    assert_eq!(counts, splits);
    // the tars, the spec
    assert_eq!((whole.files, whole.rows, whole.episodes), (4, 89, None));
    let options = ExportOptions { rows_per_tar: Some(7) };
    let out = dir.path().join("small");
    dataset.export("webdataset", &out, &options, &()).unwrap();
    let counts = check(&dataset, &out, arrays);
    for (split, rows) in &whole.splits {
        let of_split: Vec<usize> = counts
            .iter()
            .filter(|(name, _)| name.starts_with(split))
            .map(|(_, n)| *n)
            .collect();
        let (last, full) = of_split.split_last().unwrap();
        assert!(
            full.iter().all(|n| *n == 7) && (1..=7).contains(last),
            "{split}: {of_split:?}"
        );
        assert_eq!(of_split.iter().sum::<usize>() as u64, *rows);
    }
}

#[test]
fn codes_and_matrices_are_arrays() {
    let dir = tempfile::tempdir().unwrap();
    let text = format!("{PRESSES}raster = false\nphi = true\ncodes = true\n").replace("rows = 89", "rows = 42");
    let dataset = made(&dir.path().join("set"), &text);
    let out = dir.path().join("out");
    exported(&dataset, "webdataset", &out);
    let arrays: &[(&str, &str, &[u64])] = &[
        ("pressure_pa", "pressure", &[8, 12]),
        ("conductance_s", "conductance", &[8, 12]),
        ("support", "support", &[8, 12]),
        ("y_code", "y", &[7]),
        ("phi", "phi", &[7, 96]),
    ];
    check(&dataset, &out, arrays);
}
