//! Equal scenes give equal bytes: on any number of threads, and from the scene that was written down.

use crate::command::{files, succeeds, words};
use std::path::Path;

#[track_caller]
fn assert_same(left: &Path, right: &Path, expected: &[&str]) {
    let results = |dir| {
        let mut found = files(dir);
        found.remove("timing.json");
        found
    };
    let (left, right) = (results(left), results(right));
    for name in expected {
        assert!(left.contains_key(*name), "{name} is missing among {:?}", left.keys());
    }
    assert_eq!(left.keys().collect::<Vec<_>>(), right.keys().collect::<Vec<_>>(), "other files");
    for (name, bytes) in &left {
        let other = &right[name];
        let first = bytes.iter().zip(other).position(|(a, b)| a != b);
        assert!(
            bytes == other,
            "{name} differs: {} and {} bytes, first difference at {first:?}",
            bytes.len(),
            other.len()
        );
    }
}

/// Results of a press.
const OF_A_PRESS: &[&str] = &[
    "manifest.json",
    "scene.toml",
    "summary.json",
    "frames.csv",
    "time_s.npy",
    "pressure_pa.npy",
    "electrode_pressure_pa.npy",
    "conductance_s.npy",
    "session.json",
    "raster_codes.npy",
    "compressive_codes.npy",
    "pressure.png",
    "decoded.png",
];

#[test]
fn presses_do_not_depend_on_the_threads_nor_on_where_the_scene_comes_from() {
    let dir = tempfile::tempdir().unwrap();
    let base = ["simulate", "press/T", "--presses", "2", "--seed", "5"];
    for threads in ["1", "2"] {
        succeeds(dir.path(), &[&base[..], &["--threads", threads, "--out", threads]].concat());
    }
    assert_same(&dir.path().join("1"), &dir.path().join("2"), OF_A_PRESS);
    succeeds(dir.path(), &["simulate", "1/scene.toml", "--out", "again"]);
    assert_same(&dir.path().join("1"), &dir.path().join("again"), OF_A_PRESS);
    // another seed has to show
    succeeds(dir.path(), &["simulate", "1/scene.toml", "--seed", "6", "--out", "other"]);
    let (first, other) = (files(&dir.path().join("1")), files(&dir.path().join("other")));
    for name in words("pressure_pa.npy conductance_s.npy raster_codes.npy compressive_codes.npy") {
        assert_ne!(first[name], other[name], "{name} is the same for another seed");
    }
}

#[test]
fn drops_do_not_depend_on_the_threads_nor_on_where_the_scene_comes_from() {
    let dir = tempfile::tempdir().unwrap();
    for threads in ["1", "2"] {
        let arguments = ["simulate", "bounce", "--presses", "2", "--threads", threads, "--out", threads];
        succeeds(dir.path(), &arguments);
    }
    let expected = ["time_s_000.npy", "pressure_pa_001.npy", "compressive_codes.npy", "pressure.png", "decoded.png"];
    assert_same(&dir.path().join("1"), &dir.path().join("2"), &expected);
    succeeds(dir.path(), &["simulate", "1/scene.toml", "--out", "again"]);
    assert_same(&dir.path().join("1"), &dir.path().join("again"), &expected);
}

/// Faults of the command line stand in the scene that is left, and change the recordings only.
#[test]
fn faults_are_part_of_the_scene() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), &["simulate", "press/T", "--out", "sound"]);
    let faults = ["--fault", "dead:44", "--fault", "skipping_clocks:45"];
    succeeds(dir.path(), &[&["simulate", "press/T", "--out", "1"], &faults[..]].concat());
    succeeds(dir.path(), &["simulate", "1/scene.toml", "--out", "again"]);
    assert_same(&dir.path().join("1"), &dir.path().join("again"), OF_A_PRESS);
    let (sound, faulty) = (files(&dir.path().join("sound")), files(&dir.path().join("1")));
    assert_eq!(sound["conductance_s.npy"], faulty["conductance_s.npy"]);
    for name in ["raster_codes.npy", "compressive_codes.npy", "scene.toml"] {
        assert_ne!(sound[name], faulty[name], "{name} does not show the faults");
    }
}

/// A scene with a mesh and a profile of the user's own takes both along.
#[test]
fn a_scene_with_files_of_its_own_can_be_moved() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name);
    std::fs::create_dir(path("mine")).unwrap();
    let block = spts_contact::mesh::cuboid([30.0, 20.0, 15.0]).flipped();
    std::fs::write(path("mine/block.obj"), block.to_obj("block")).unwrap();
    let (_, ideal) = spts_circuit::PROFILES.iter().find(|(name, _)| *name == "ideal").unwrap();
    std::fs::write(path("mine/wire.toml"), ideal).unwrap();
    let output = succeeds(
        dir.path(),
        &words(
            "simulate press --mesh mine/block.obj --scale 1e-3 --readout mine/wire.toml --rotation-deg \
              -20 --tilt-deg -1,0.5 --force 8",
        ),
    );
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("inside out"), "a turned mesh is not mentioned: {said}");
    std::fs::remove_dir_all(path("mine")).unwrap();
    std::fs::rename(path("out/block"), path("moved")).unwrap();
    succeeds(dir.path(), &["simulate", "moved/scene.toml", "--out", "again"]);
    assert_same(&path("moved"), &path("again"), &["mesh.obj", "readout.toml", "compressive_volts.npy"]);
    // and into the folder it lies in
    succeeds(dir.path(), &["simulate", "moved/scene.toml", "--out", "moved"]);
    assert_same(&path("moved"), &path("again"), &["mesh.obj", "readout.toml"]);
}

/// A folder holds one run: what another run has left there goes.
#[test]
fn a_folder_used_again_holds_the_last_run_only() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), &["simulate", "bounce", "--presses", "2", "--out", "used", "--no-record"]);
    succeeds(dir.path(), &["simulate", "press/X", "--out", "used", "--no-record"]);
    succeeds(dir.path(), &["simulate", "press/X", "--out", "fresh", "--no-record"]);
    let (used, fresh) = (files(&dir.path().join("used")), files(&dir.path().join("fresh")));
    assert_eq!(used.keys().collect::<Vec<_>>(), fresh.keys().collect::<Vec<_>>());
}
