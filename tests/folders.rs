//! Folders of results that are chosen by `spts simulate`, what is said of earlier results, and the list of scenes.

use crate::command::{files, succeeds, words};
use serde_json::Value;
use std::path::Path;

/// A box `side` units wide and high, as text of an OBJ file.
fn block(side: f64) -> String {
    let corner = |k: usize| [k & 1, k >> 1 & 1, k >> 2 & 1].map(|bit| (bit as f64 - 0.5) * side);
    let corners = (0..8).map(corner).map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let faces = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"].map(|face| format!("f {face}\n"));
    corners.chain(faces).collect()
}

/// Presses without a recording and with the cheapest contact; the folder that the results went to, and what was said.
fn pressed(dir: &Path, arguments: &str) -> (String, String) {
    let quick = words("--no-record --contact footprint --set press.presses=1");
    let output = succeeds(dir, &[&words(arguments)[..], &quick].concat());
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    let last = printed.lines().last().unwrap_or_default();
    let folder = last.split(':').next().unwrap_or_default().to_owned();
    (folder, String::from_utf8_lossy(&output.stderr).into_owned())
}

/// Two meshes of one name, and a mesh with the name of an object, keep their results apart; the same mesh again
/// replaces its own, and says so.
#[test]
fn meshes_do_not_overwrite_each_other() {
    let dir = tempfile::tempdir().unwrap();
    for (folder, name, side) in [("a", "cup", 0.04), ("b", "cup", 0.05), ("a", "T", 0.03)] {
        let folder = dir.path().join(folder);
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join(format!("{name}.obj")), block(side)).unwrap();
    }
    let run = |arguments: &str| pressed(dir.path(), arguments);
    let said = |text: &str| text.contains("has the results of an earlier run");
    for (arguments, folder, replaces) in [
        ("simulate press --mesh a/cup.obj", "out/cup", false),
        ("simulate press --mesh b/cup.obj", "out/cup_2", false),
        ("simulate press --mesh a/cup.obj --force 12", "out/cup", true),
        ("simulate press/T", "out/T", false),
        ("simulate press --mesh a/T.obj", "out/T_2", false),
        ("simulate press/T", "out/T", true),
    ] {
        let (found, stderr) = run(arguments);
        assert_eq!(found, folder, "{arguments}");
        assert_eq!(said(&stderr), replaces, "{arguments}: {stderr}");
    }
    let mesh = |folder: &str| files(&dir.path().join("out").join(folder))["mesh.obj"].clone();
    assert_eq!(mesh("cup"), block(0.04).into_bytes());
    assert_eq!(mesh("cup_2"), block(0.05).into_bytes());
}

#[test]
fn scenes_and_objects_are_listed() {
    let dir = tempfile::tempdir().unwrap();
    let text = succeeds(dir.path(), &["simulate", "--list"]).stdout;
    let text = String::from_utf8_lossy(&text).into_owned();
    let json: Value = serde_json::from_slice(&succeeds(dir.path(), &["simulate", "--list", "--json"]).stdout).unwrap();
    assert_eq!(json["objects"].as_array().unwrap().len(), 18);
    for (list, key) in [("scenes", "scene"), ("objects", "name")] {
        for entry in json[list].as_array().unwrap() {
            let [name, about] = [key, "about"].map(|key| entry[key].as_str().unwrap());
            let line = text.lines().find(|line| line.trim_start().starts_with(name));
            assert!(line.is_some_and(|line| line.ends_with(about)), "{name}: {text}");
        }
    }
    assert!(files(dir.path()).is_empty());
}
