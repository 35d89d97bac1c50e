//! Small files that ask for much: each is refused by the program in one line, with little memory and at once.
#![cfg(unix)]

use crate::command::SPTS;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use spts::session::{Event, Recorded, Session};
use spts::{Block, Recording, RecordingInfo, Seeding, SkinLayout, WeightMode, Weights};
use std::io::Write as _;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// Status of every refusal.
const REFUSED: i32 = 2;
/// Address space of the program, kB: what it needs for itself, and less than any bomb.
const MEMORY_KB: &str = "2000000";
/// Longest time that a refusal may take.
const LIMIT: Duration = Duration::from_secs(5);

/// Runs `spts` on a bomb, and expects one line with all of `facts` in it.
#[track_caller]
fn refused(dir: &Path, arguments: &[&str], facts: &[&str]) {
    let begin = Instant::now();
    let output = Command::new("timeout")
        .args([
            "-k",
            "1",
            "20",
            "sh",
            "-c",
            "ulimit -v $1; shift; exec \"$0\" \"$@\"",
            SPTS,
        ])
        .arg(MEMORY_KB)
        .args(arguments)
        .current_dir(dir)
        .output()
        .unwrap();
    let took = begin.elapsed();
    let said = String::from_utf8_lossy(&output.stderr);
    let start: String = said.chars().take(400).collect();
    assert_eq!(
        output.status.code(),
        Some(REFUSED),
        "{arguments:?}: {:?}: {start}",
        output.status
    );
    let errors = said.lines().filter(|line| !line.starts_with("note: "));
    assert_eq!(errors.count(), 1, "{arguments:?}: more than one line: {start}");
    assert!(said.len() < 1000, "{arguments:?}: {} bytes: {start}", said.len());
    for fact in facts {
        assert!(said.contains(fact), "{arguments:?}: `{fact}` is not in: {start}");
    }
    assert!(took < LIMIT, "{arguments:?} took {took:?}");
    eprintln!("{took:.1?} {}", start.trim_end());
}

fn write(dir: &Path, name: &str, content: impl AsRef<[u8]>) {
    std::fs::write(dir.join(name), content).unwrap();
}

fn pipe(dir: &Path, name: &str) {
    assert!(Command::new("mkfifo").arg(dir.join(name)).status().unwrap().success());
}

/// A GLB of this description and data.
fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
    let padded = |bytes: &[u8], with: u8| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), with);
        bytes
    };
    let word = |n: usize| u32::try_from(n).unwrap().to_le_bytes();
    let (json, bin) = (padded(json.as_bytes(), b' '), padded(bin, 0));
    let length = 12 + 8 + json.len() + 8 + bin.len();
    [
        &b"glTF\x02\0\0\0"[..],
        &word(length),
        &word(json.len()),
        b"JSON",
        &json,
        &word(bin.len()),
        b"BIN\0",
        &bin,
    ]
    .concat()
}

/// `nodes` and `primitives` of a scene whose only data are three thousand points.
fn shared(nodes: &str, primitives: usize) -> Vec<u8> {
    let primitive = r#"{"attributes":{"POSITION":0}}"#;
    let primitives = vec![primitive; primitives].join(",");
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{nodes}],"meshes":[{{"primitives":[{primitives}]}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":3000,"type":"VEC3"}}],"bufferViews":[{{"buffer":0,"byteLength":36000}}],"buffers":[{{"byteLength":36000}}]}}"#
    );
    glb(&json, &[0; 36_000])
}

#[test]
fn meshes_that_grow() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let mesh =
        |name: &str, facts: &[&str]| refused(here, &["simulate", "press", "--mesh", name], &[&[name], facts].concat());
    // 150 visits of 100 primitives of 3000 points
    let children = vec!["1"; 150].join(",");
    write(
        here,
        "shared.glb",
        shared(&format!(r#"{{"children":[{children}]}},{{"mesh":0}}"#), 100),
    );
    mesh("shared.glb", &["number of triangles", "[0, 1000000]"]);
    // each of thirty levels names the next one twice
    let levels: Vec<String> = (1..30).map(|k| format!(r#"{{"children":[{k},{k}]}}"#)).collect();
    write(here, "levels.glb", shared(&(levels.join(",") + r#",{"mesh":0}"#), 1));
    mesh("levels.glb", &["100000"]);
    // nodes with many children each: the list of what is to be visited grows, too
    let wide = vec!["1"; 20_000].join(",");
    let deeper = vec!["2"; 20_000].join(",");
    write(
        here,
        "wide.glb",
        shared(&format!(r#"{{"children":[{wide}]}},{{"children":[{deeper}]}},{{}}"#), 1),
    );
    mesh("wide.glb", &["100000"]);
    write(here, "nodes.glb", shared(&vec!["{}"; 1_500_000].join(","), 1));
    mesh("nodes.glb", &["JSON", "2097152"]);
    let mut counts = vec![0; 84];
    counts[80..].copy_from_slice(&u32::MAX.to_le_bytes());
    write(here, "counts.stl", &counts);
    mesh("counts.stl", &["4294967295 triangles"]);
    counts[80..].copy_from_slice(&2_000_000_u32.to_le_bytes());
    counts.resize(84 + 50 * 2_000_000, 0);
    write(here, "many.stl", &counts);
    mesh("many.stl", &["number of triangles = 2000000", "[0, 1000000]"]);
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf";
    write(here, "polygon.obj", triangle.to_owned() + &" 1 2 3".repeat(4_000_000));
    mesh("polygon.obj", &["number of triangles = 11999998"]);
    write(
        here,
        "faces.obj",
        triangle.to_owned() + " 1 2 3\n" + &"f 1 2 3\n".repeat(2_000_000),
    );
    mesh("faces.obj", &["number of triangles"]);
    write(
        here,
        "index.obj",
        triangle.to_owned() + " 1 2 99999999999999999999999\n",
    );
    mesh("index.obj", &["malformed"]);
    let sparse = std::fs::File::create(here.join("sparse.obj")).unwrap();
    sparse.set_len(1 << 40).unwrap();
    mesh("sparse.obj", &["1099511627776", "[0, 268435456]"]);
    std::os::unix::fs::symlink("/dev/zero", here.join("endless.obj")).unwrap();
    mesh("endless.obj", &["not a regular file"]);
    pipe(here, "pipe.stl");
    mesh("pipe.stl", &["a pipe, not a regular file"]);
}

/// A MATLAB file whose variable `C` is of class double and stored as `bytes` bytes, which are zero, compressed.
fn mat(bytes: usize) -> Vec<u8> {
    let word = |n: usize| u32::try_from(n).unwrap().to_le_bytes();
    let frames = bytes / 100;
    let head = [
        &word(6)[..],
        &word(8),
        &word(6),
        &word(0), // flags: class double
        &word(5),
        &word(12),
        &word(100),
        &word(frames),
        &word(1),
        &word(0), // sides, padded
        &word(1 | 1 << 16),
        b"C\0\0\0", // name
        &word(2),
        &word(bytes),
    ]
    .concat();
    let padded = bytes.next_multiple_of(8);
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
    packed
        .write_all(&[word(14), word(head.len() + padded)].concat())
        .unwrap();
    packed.write_all(&head).unwrap();
    let zeros = vec![0; 1 << 16];
    let mut left = padded;
    while left > 0 {
        let n = left.min(zeros.len());
        packed.write_all(&zeros[..n]).unwrap();
        left -= n;
    }
    let packed = packed.finish().unwrap();
    let mut file = vec![b' '; 124];
    file.extend([0, 1, b'I', b'M']);
    file.extend([word(15), word(packed.len())].concat());
    file.extend(packed);
    file
}

#[test]
fn recordings_that_grow() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("presses/T");
    std::fs::create_dir_all(&folder).unwrap();
    let validate = |facts: &[&str]| refused(dir.path(), &["validate", "."], &[&["T_raster.mat"], facts].concat());
    // more than is unfolded, and what would be eight times as much as doubles
    for (bytes, fact) in [
        (900_000_000, "unfolds to more"),
        (240_000_000, "holds 240000000 values"),
    ] {
        write(&folder, "T_raster.mat", mat(bytes));
        validate(&[fact]);
    }
    std::fs::remove_file(folder.join("T_raster.mat")).unwrap();
    pipe(&folder, "T_raster.mat");
    validate(&["not a regular file"]);
}

/// A session of two blocks of 1 × 8 taxels in volts.
fn session(dir: &Path) {
    let layout = SkinLayout::new(1, 8, 5e-3, 3e-3).unwrap();
    let info = RecordingInfo::new(layout, Weights::new(WeightMode::Binary, Seeding::Mixed, 8), 64_300.0);
    let block = |end| Block {
        frame_position: end,
        idle_frames: None,
        volts: vec![0.25; 80],
    };
    let recording = Recording::new(info, vec![block(10), block(20)]).unwrap();
    let mut session = Session::new("cup", Event::Press);
    session.compressive = Some(Recorded::new(recording));
    session.write(dir).unwrap();
}

#[test]
fn sessions_that_grow() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let folder = here.join("cup");
    session(&folder);
    let text = std::fs::read_to_string(folder.join("session.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let array = json["compressive"]["samples"]["file"].as_str().unwrap();
    let whole = std::fs::read(folder.join(array)).unwrap();
    // without it, a changed file is not compared with what was written
    std::fs::remove_file(folder.join("manifest.json")).unwrap_or_default();
    let decode = |facts: &[&str]| refused(here, &["decode", "cup"], facts);
    let changed = |from: &str, to: &str| {
        assert!(text.contains(from), "{from} is not in {text}");
        write(&folder, "session.json", text.replacen(from, to, 1));
    };
    changed("\"rows\": 1,", "\"rows\": 1000000000,");
    decode(&["session.json", "rows × cols"]);
    changed("\"rows\": 1,", "\"rows\": \"one\",");
    decode(&["session.json", "`compressive.info.layout", "line "]);
    changed("\"frames\": 10", "\"frames\": 18446744073709551615");
    decode(&[array, "shape"]);
    changed("\"name\": \"cup\"", &format!("\"name\": {}", "[".repeat(1_000_000)));
    decode(&["session.json", "line "]);
    changed(
        "\"provenance\": null",
        &format!("\"provenance\": [{}0]", "0,".repeat(10_000_000)),
    );
    decode(&["session.json"]);
    write(&folder, "session.json", &text);
    let header = |to: &str| {
        let end = 10 + usize::from(u16::from_le_bytes([whole[8], whole[9]]));
        let text = String::from_utf8_lossy(&whole[10..end]);
        assert!(text.contains("2, 10, 8"), "{text}");
        let text = text.replace("2, 10, 8", to);
        let length = u16::try_from(text.len()).unwrap().to_le_bytes();
        [&whole[..8], &length, text.as_bytes(), &whole[end..]].concat()
    };
    write(&folder, array, header("9999999999, 9999999999, 9999999999"));
    decode(&[array, "shape is too large"]);
    write(&folder, array, [&whole[..6], &[2, 0, 255, 255, 255, 255]].concat());
    decode(&[array, "header length = 4294967295"]);
    write(&folder, array, &whole);
    let file = std::fs::OpenOptions::new()
        .write(true)
        .open(folder.join(array))
        .unwrap();
    file.set_len(1 << 30).unwrap();
    decode(&[array, "bytes of values"]);
    for (name, fact) in [(array, "a pipe"), ("session.json", "a pipe")] {
        std::fs::remove_file(folder.join(name)).unwrap();
        pipe(&folder, name);
        decode(&[name, fact, "not a regular file"]);
    }
}

#[test]
fn texts_that_grow() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    let press = "[press]\nobject = \"T\"\n";
    let scene = |text: &str, facts: &[&str]| {
        write(here, "mine.toml", text);
        refused(here, &["simulate", "mine.toml"], &[&["mine.toml"], facts].concat());
    };
    scene(
        &format!("[skin]\nrows = 100000\ncols = 100000\n{press}"),
        &["rows × cols"],
    );
    scene(&format!("{press}presses = 4000000000\n"), &["presses", "[1, 100000]"]);
    scene(
        &format!("[contact]\ncells_per_taxel = 1000000000\n{press}"),
        &["cells_per_taxel"],
    );
    scene(&format!("name = {}\n", "[".repeat(1_000_000)), &["line 1"]);
    scene(&format!("{}\n", "a.".repeat(500_000) + "a = 1"), &["line 1"]);
    scene(&"x".repeat(5_000_000), &["5000000 bytes", "[0, 2097152]"]);
    scene(
        &format!("[rows]\nseeds = [{}0]\n{press}", "0,".repeat(1_000_000)),
        &["number of seeds"],
    );
    pipe(here, "seeds.txt");
    pipe(here, "pipe.toml");
    refused(here, &["simulate", "pipe.toml"], &["pipe.toml", "not a regular file"]);
    refused(
        here,
        &["simulate", "press/T", "--readout", "pipe.toml"],
        &["pipe.toml", "not a regular file"],
    );
    let seeded = format!("{press}[rows]\nseeds_file = \"seeds.txt\"\n");
    write(here, "seeded.toml", &seeded);
    refused(here, &["simulate", "seeded.toml"], &["seeds.txt", "not a regular file"]);
    std::fs::remove_file(here.join("seeds.txt")).unwrap();
    write(here, "seeds.txt", "x".repeat(1 << 23));
    refused(here, &["simulate", "seeded.toml"], &["seeds.txt", "seed = `xxx"]);
}
