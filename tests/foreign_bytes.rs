//! Files as other programs leave them: marks before the text, other encodings, other types, numbers that cannot be.

use crate::command::{refused, succeeds};
use std::path::{Path, PathBuf};

fn corpus(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus").join(file)
}

/// Some editors put a byte-order mark first: it is no part of the first line.
#[test]
fn a_byte_order_mark_changes_no_pressure() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["tetrahedron", "mark"] {
        let mesh = corpus(&format!("obj/{name}.obj"));
        let mesh = mesh.to_str().unwrap();
        let arguments = [
            "simulate",
            "press",
            "--mesh",
            mesh,
            "--scale",
            "0.001",
            "--force",
            "2",
            "--no-record",
            "--out",
            name,
        ];
        succeeds(dir.path(), &arguments);
    }
    let read = |name: &str| std::fs::read(dir.path().join(name).join("pressure_pa.npy")).unwrap();
    assert!(read("tetrahedron") == read("mark"), "the pressures differ");
    let marked = "\u{feff}[press]\nobject = \"T\"\npresses = 1\n[rows]\nseeds_file = \"seeds.txt\"\n";
    std::fs::write(dir.path().join("marked.toml"), marked).unwrap();
    std::fs::write(dir.path().join("seeds.txt"), "\u{feff}8 9\n").unwrap();
    // two seeds of a hundred: the mark has spoiled neither of them
    refused(
        dir.path(),
        &["simulate", "marked.toml"],
        &["seeds.txt", "number of seeds = 2"],
    );
}

#[test]
fn text_of_sixteen_bits_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let wide: Vec<u8> = "\u{feff}v 0 0 0\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    for name in ["wide.obj", "wide.toml"] {
        std::fs::write(dir.path().join(name), &wide).unwrap();
    }
    refused(
        dir.path(),
        &["simulate", "press", "--mesh", "wide.obj"],
        &["wide.obj", "UTF-16"],
    );
    refused(dir.path(), &["simulate", "wide.toml"], &["wide.toml", "UTF-16"]);
}

#[test]
fn a_far_vertex_is_named_with_its_range() {
    let mesh = corpus("obj/far.obj");
    let dir = tempfile::tempdir().unwrap();
    let arguments = ["simulate", "press", "--mesh", mesh.to_str().unwrap()];
    refused(
        dir.path(),
        &arguments,
        &["far.obj", "vertex", "x = 3", "[-1000000, 1000000] m"],
    );
}

#[test]
fn a_variable_that_is_no_array_is_named_with_its_class() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("presses/T");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::copy(corpus("mat/struct.mat"), folder.join("T_raster.mat")).unwrap();
    refused(dir.path(), &["validate", "."], &["T_raster.mat", "`C` is a struct"]);
    // the same variable under the name that is looked for
    let bytes = std::fs::read(corpus("mat/struct.mat")).unwrap();
    let at = bytes.windows(9).rposition(|w| w == b"\x01\0\0\0\x01\0\0\0C").unwrap();
    let mut renamed = bytes;
    renamed[at + 8] = b'D';
    std::fs::write(folder.join("T_raster.mat"), renamed).unwrap();
    refused(dir.path(), &["validate", "."], &["T_raster.mat", "`D` is a struct"]);
}

/// The true maps of a simulated session are checked like its samples.
#[test]
fn a_truth_that_cannot_be_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), &["simulate", "press/T", "--out", "run"]);
    let run = dir.path().join("run");
    // what is changed is to be judged by itself
    std::fs::remove_file(run.join("manifest.json")).unwrap_or_default();
    let file = run.join("compressive_conductance_s.npy");
    let whole = std::fs::read(&file).unwrap();
    for value in [f64::INFINITY, -1e-3, f64::NAN] {
        let mut damaged = whole.clone();
        // the last of a hundred taxels
        let at = damaged.len() - 8;
        damaged[at..].copy_from_slice(&value.to_le_bytes());
        std::fs::write(&file, damaged).unwrap();
        let facts = [
            "compressive_conductance_s.npy",
            "entry 99",
            &value.to_string(),
            "[0, ∞)",
        ];
        refused(dir.path(), &["decode", "run"], &facts);
    }
}

/// What `spts score` refuses, `spts decode` does not decode.
#[test]
fn decode_refuses_the_sessions_that_score_refuses() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), &["simulate", "press/T", "--out", "run"]);
    let run = dir.path().join("run");
    // what is changed is to be judged by itself
    std::fs::remove_file(run.join("manifest.json")).unwrap_or_default();
    let file = run.join("session.json");
    let mut json: serde_json::Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    json["hold_s"] = serde_json::json!([1.0, 1000.0]);
    std::fs::write(&file, json.to_string()).unwrap();
    let facts = ["T", "frames", "at least"];
    refused(dir.path(), &["score", "run"], &facts);
    refused(dir.path(), &["decode", "run"], &facts);
}
