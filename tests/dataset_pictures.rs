//! Pictures of data sets and of shapes, as a user asks for them.

use crate::command::{json, refused, succeeds};
use serde_json::Value;

/// Width and height in the header of a PNG file.
fn png_size(path: &std::path::Path) -> [u32; 2] {
    let bytes = std::fs::read(path).unwrap();
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n", "{path:?}");
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()))
}

/// A picture of rows, of every kind of skin and record: as wide as its cards, the same for a spec and for the files of
/// it, unfinished ones too.
#[test]
fn rows_are_drawn() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let bare = "name = \"bare\"\nrows = 30\n[record]\nraster = false\ncodes = true\n[object]\ncount = 2";
    std::fs::write(here.join("bare.toml"), bare).unwrap();
    // pixels: two to the unit; borders of 16, cards 22 apart
    for (spec, name, width) in [
        ("random-shapes", "random-shapes", 2 * (32 + 4 * 208 + 3 * 22)),
        ("presses-17", "presses-17", 2 * (32 + 4 * 208 + 3 * 22)),
        ("large-skin", "large-skin", 2 * (32 + 3 * 280 + 2 * 22)),
        ("bare.toml", "bare", 2 * (32 + 5 * 160 + 4 * 22)),
    ] {
        let report = json(here, &["dataset", "preview", spec, "--rows", "6", "--json"]);
        let file = format!("{name}-preview.png");
        assert_eq!(report["file"], file.as_str());
        assert_eq!(report["rows"].as_array().unwrap().len(), 6);
        let [found, height] = png_size(&here.join(&file));
        assert_eq!(found, width, "{spec}");
        assert!((800..1600).contains(&height), "{spec}: {height}");
    }
    // one worker of two is done: rows of its files alone
    let make = ["dataset", "make", "bare.toml", "--rows", "300", "--out", "half"];
    succeeds(here, &[&make[..], &["--shard", "0/2"]].concat());
    let preview = ["dataset", "preview", "half", "--rows", "20", "--json", "--out"];
    let half = json(here, &[&preview[..], &["half.png"]].concat());
    let rows: Vec<u64> = half["rows"].as_array().unwrap().iter().filter_map(Value::as_u64).collect();
    assert_eq!(rows, (0..20).map(|k| k * 10 + if k < 10 { 0 } else { 100 }).collect::<Vec<_>>());
    let drawn = ["--seed", "4"];
    let random = json(here, &[&preview[..], &["random.png"], &drawn].concat());
    assert_ne!(random["rows"], half["rows"]);
    // all files are there: the same bytes as without any
    succeeds(here, &make);
    succeeds(here, &[&preview[..], &["files.png"], &drawn].concat());
    let text = std::fs::read_to_string(here.join("half/spec.toml")).unwrap();
    std::fs::write(here.join("same.toml"), text).unwrap();
    let same = ["dataset", "preview", "same.toml", "--rows", "20", "--seed", "4", "--out", "made.png"];
    succeeds(here, &same);
    let [files, made] = ["files.png", "made.png"].map(|file| std::fs::read(here.join(file)).unwrap());
    assert!(files == made);
    // nothing was added to the data set
    let mut held: Vec<_> = std::fs::read_dir(here.join("half")).unwrap().map(|e| e.unwrap().file_name()).collect();
    held.sort();
    let usual =
        ["README.md", "croissant.json", "data", "dataset.json", "manifest.json", "spec.toml", "statistics.json"];
    assert_eq!(held, usual);
}

/// A picture takes the place of an earlier picture of this program, and of nothing else.
#[test]
fn pictures_replace_pictures_of_their_own_alone() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let shapes = |out| vec!["dataset", "shapes", "--families", "gear", "--count", "1", "--out", out];
    succeeds(here, &shapes("own.png"));
    succeeds(here, &shapes("own.png"));
    let spec = succeeds(here, &["dataset", "specs", "--show", "random-shapes"]).stdout;
    std::fs::write(here.join("my.toml"), &spec).unwrap();
    // a picture of another program: ours without what it says of itself
    let own = std::fs::read(here.join("own.png")).unwrap();
    let mark = own.windows(4).position(|window| window == b"tEXt").unwrap();
    std::fs::write(here.join("photo.png"), [&own[..mark], b"tEXX", &own[mark + 4..]].concat()).unwrap();
    std::os::unix::fs::symlink("own.png", here.join("link.png")).unwrap();
    let before = crate::command::files(here);
    let preview = |out| vec!["dataset", "preview", "my.toml", "--rows", "1", "--out", out];
    for file in ["my.toml", "photo.png", "link.png"] {
        let said = format!("{file}: is not a result of an earlier run and is not replaced");
        refused(here, &shapes(file), &[&said]);
        refused(here, &preview(file), &[&said]);
    }
    assert!(crate::command::files(here) == before);
}

#[test]
fn shapes_are_drawn() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let shapes = ["dataset", "shapes", "--json", "--families", "gear,letter", "--count", "5"];
    let first = json(here, &shapes);
    assert_eq!(first["file"], "shapes.png");
    let drawn: Vec<(&str, u64)> = first["shapes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|shape| (shape["family"].as_str().unwrap(), shape["number"].as_u64().unwrap()))
        .collect();
    assert_eq!(drawn, [("letter", 0), ("letter", 1), ("letter", 2), ("gear", 0), ("gear", 1)]);
    succeeds(here, &[&shapes[..], &["--out", "again.png", "--threads", "1"]].concat());
    succeeds(here, &[&shapes[..], &["--out", "other.png", "--seed", "1"]].concat());
    let [a, b, other] = ["shapes.png", "again.png", "other.png"].map(|file| std::fs::read(here.join(file)).unwrap());
    assert!(a == b && a != other);
    // a line of more than a hundred shapes of all families is as wide
    succeeds(here, &["dataset", "shapes", "--count", "120", "--out", "all.png"]);
    let [few, all] = ["shapes.png", "all.png"].map(|file| png_size(&here.join(file)));
    assert!(few[0] == all[0] && few[1] < all[1], "{few:?} {all:?}");
}
