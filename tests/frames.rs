//! Frames of any skin: a file becomes a session, a wire records it, and every command reads what comes of it.

use crate::command::{files, json, refused, succeeds, words};
use serde_json::Value;
use spts::data::Frames;
use spts::{Session, session::read_npy};
use std::fmt::Write as _;
use std::path::Path;

/// Two presses of 12 × 12 taxels, 30 frames each, as a table with times: a block of 4 × 3 taxels, elsewhere each time.
fn table() -> String {
    let mut text = String::from("time_ms");
    for taxel in 0..144 {
        let _ = write!(text, ";t{taxel}");
    }
    for frame in 0..60 {
        let load = match frame % 30 {
            0..8 => 0.0,
            8..10 => 0.5,
            _ => 1.0,
        };
        let first = if frame < 30 { 2 } else { 6 };
        let _ = write!(text, "\n{}", 20 * (frame % 30) + if frame < 30 { 0 } else { 600 });
        for taxel in 0..144 {
            let on = (first..first + 4).contains(&(taxel / 12)) && (5..8).contains(&(taxel % 12));
            let _ = write!(text, ";{}", if on { 25_000.0 * load } else { 0.0 });
        }
    }
    text
}

const IMPORT: &str = "import mine.csv --rows 12 --cols 12 --unit pressure --pitch 8mm --press-frames 30";

#[test]
fn frames_become_a_session_and_a_wire_records_it() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("mine.csv"), table()).unwrap();
    let made = json(dir.path(), &words(&format!("{IMPORT} --out s --json")));
    assert_eq!((&made["presses"], &made["frames"], &made["idle_frames"]), (&2.into(), &30.into(), &8.into()));
    assert!((made["rate_hz"].as_f64().unwrap() - 50.0).abs() < 1e-9 && made["unit"] == "pressure", "{made}");
    let session = Session::read(&dir.path().join("s")).unwrap();
    let frames = Frames::of_session(&session).unwrap();
    let numbers = |line: &str| line.split(';').skip(1).map(|v| v.parse::<f64>().unwrap()).collect::<Vec<_>>();
    let given: Vec<f64> = table().lines().skip(1).flat_map(numbers).collect();
    assert_eq!(frames.values(), given);
    // the times of the file
    let times_s = read_npy(&dir.path().join("s/frame_time_s.npy")).unwrap().values;
    assert!(times_s.len() == 60 && (times_s[59] - 1.18).abs() < 1e-12, "{times_s:?}");

    // any number of threads, the same bytes
    let wire = |out: &str, threads: &str| -> Value {
        json(dir.path(), &words(&format!("wire s --measurements 30,60 --out {out} --threads {threads} --json")))
    };
    let found = wire("w", "1");
    assert_eq!(found, wire("w3", "3"));
    assert!(files(&dir.path().join("w")) == files(&dir.path().join("w3")), "threads show");
    for name in
        ["session.json", "wire.html", "figures/wire.png", "figures/wire.svg", "tables/wire.csv", "manifest.json"]
    {
        assert!(dir.path().join("w").join(name).exists(), "{name}");
    }
    let iou = |wires: u64, m: u64| {
        let rows = found["rows"].as_array().unwrap().iter();
        let own = rows.filter(|r| r["wires"] == wires && r["m_per_wire"] == m && r["rows"] == "random");
        own.map(|row| row["iou"].as_f64().unwrap()).next().unwrap()
    };
    assert!(iou(1, 60) > 0.75 && iou(2, 60) > 0.75 && iou(1, 60) >= iou(1, 30), "{found}");
    assert_eq!((&found["decoder"], &found["touches"]), (&"amortised".into(), &2.into()));

    // what comes of it is a session like any other
    let decoded = json(dir.path(), &words("decode w --measurements 60 --windows 2 --json --out d"));
    let ious: Vec<f64> = decoded["rows"].as_array().unwrap().iter().map(|row| row["iou"].as_f64().unwrap()).collect();
    assert!(ious.iter().sum::<f64>() / ious.len() as f64 > 0.75, "{ious:?}");
    succeeds(dir.path(), &words("score w --decoder tv --measurements 60 --no-times --no-ball --out c"));
    // every session of a folder
    succeeds(dir.path(), &words(&format!("{IMPORT} --name other --out all/other")));
    succeeds(dir.path(), &words(&format!("{IMPORT} --name mine --out all/mine")));
    succeeds(dir.path(), &words("wire all --presses 1 --measurements 30 --wires 1 --out both"));
    let names = |dir: &Path| Session::read(dir).unwrap().compressive.unwrap().recording.blocks().len();
    assert_eq!([names(&dir.path().join("both/mine")), names(&dir.path().join("both/other"))], [1, 1]);
}

/// A .mat file of version 5 with one array of doubles, whose first index is the fastest.
fn mat(name: &str, shape: [i32; 4], values: &[f64]) -> Vec<u8> {
    let part = |kind: u32, data: &[u8]| {
        let mut part = [&kind.to_le_bytes()[..], &u32::try_from(data.len()).unwrap().to_le_bytes(), data].concat();
        part.resize(part.len().next_multiple_of(8), 0);
        part
    };
    let shape: Vec<u8> = shape.iter().flat_map(|side| side.to_le_bytes()).collect();
    let values: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let flags = [6_u32.to_le_bytes(), [0; 4]].concat();
    let array = [part(6, &flags), part(5, &shape), part(1, name.as_bytes()), part(9, &values)].concat();
    let mut header = vec![b' '; 128];
    header[124..].copy_from_slice(&[0, 1, b'I', b'M']);
    [header, part(14, &array)].concat()
}

/// Four objects of six presses each in MATLAB's order, rows × cols × frames × presses: what the frames say of the skin,
/// what a wire shows of objects that it has not seen, and the gains of the taxels under known pressures.
#[test]
fn several_objects_are_recognised_and_their_pressures_give_gains() {
    let dir = tempfile::tempdir().unwrap();
    const SIDE: usize = 8;
    for (name, [height, width]) in [("bar", [2, 6]), ("pad", [4, 4]), ("dot", [2, 2]), ("post", [6, 2])] {
        let load = |row: usize, col: usize, frame: usize, press: usize| {
            let on = frame >= 8 && (1..=height).contains(&row) && (1..=width).contains(&col);
            if on { 2e4 * (1.0 + 0.1 * press as f64 + 0.01 * frame as f64) } else { 0.0 }
        };
        let all = (0..6).flat_map(|p| (0..30).flat_map(move |f| (0..SIDE * SIDE).map(move |k| (p, f, k))));
        let values: Vec<f64> = all.map(|(p, f, k)| load(k % SIDE, k / SIDE, f, p)).collect();
        std::fs::write(dir.path().join(format!("{name}.mat")), mat("pressure", [8, 8, 30, 6], &values)).unwrap();
        let import =
            format!("import {name}.mat --rows 8 --cols 8 --unit pressure --rate 50 --pitch 1cm --out all/{name}");
        succeeds(dir.path(), &words(&import));
    }
    let found = json(dir.path(), &words("wire all --wires 1 --measurements 32 --out w --json"));
    assert_eq!((&found["objects"], &found["touches"]), (&4.into(), &24.into()));
    let row = &found["rows"][0];
    assert!(row["classes"].as_f64().unwrap() > 0.8 && row["left_out_iou"].as_f64().unwrap() > 0.3, "{row}");
    assert!(found["scan_classes"].as_f64().unwrap() > 0.9 && found["again_iou"] == 1.0, "{found}");
    let frames = &found["frames"];
    let [bar, conditioning] = [&frames["objects"][0], &frames["laws"][1]];
    assert_eq!((&bar["object"], &bar["presses"], &bar["touched"]), (&"bar".into(), &6.into(), &12.into()));
    assert!(bar["repeatability"].as_f64().unwrap() > 0.999 && bar["drift"].as_f64().unwrap() > 0.05, "{bar}");
    assert_eq!((&conditioning["law"], &conditioning["objects"]), (&"conditioning".into(), &serde_json::json!([2, 2])));
    for name in ["tables/frames.csv", "tables/laws.csv", "tables/wire.csv", "bar/session.json"] {
        assert!(dir.path().join("w").join(name).exists(), "{name}");
    }
    succeeds(dir.path(), &words("decode w --measurements 32 --out d"));
    succeeds(dir.path(), &words("score w --decoder tv --measurements 32 --no-times --out c"));
    succeeds(dir.path(), &words("calibrate w --out readout.toml"));
    succeeds(dir.path(), &words("calibrate w --skin --out gains.toml"));
    // the gains that are found rise and fall with those of the simulated skin
    let session = Session::read(&dir.path().join("w/pad")).unwrap();
    let facts = &session.raster.as_ref().unwrap().presses[0];
    let gains: toml::Table = std::fs::read_to_string(dir.path().join("gains.toml")).unwrap().parse().unwrap();
    let logs: Vec<f64> = gains["log_mean"].as_array().unwrap().iter().map(|v| v.as_float().unwrap()).collect();
    let pressed: Vec<usize> =
        (0..SIDE * SIDE).filter(|k| facts.pressure.as_ref().unwrap().values()[*k] > 0.0).collect();
    let truth: Vec<f64> = pressed.iter().map(|k| facts.conductance.as_ref().unwrap().values()[*k].ln()).collect();
    let own: Vec<f64> = pressed.iter().map(|k| logs[*k]).collect();
    let r = spts::recon::metrics::pearson(&truth, &own).unwrap();
    assert!(r > 0.8, "{r}: {truth:?} {own:?}");
}

#[test]
fn what_is_no_frames_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    std::fs::write(at("mine.csv"), table()).unwrap();
    std::fs::write(at("comma.csv"), "1,5;2,5\n3,5;4,5\n").unwrap();
    std::fs::write(at("text.csv"), "1;2\n3;four\n").unwrap();
    std::fs::write(at("empty.npy"), "").unwrap();
    std::fs::write(at("v73.mat"), [&[b' '; 512][..], b"\x89HDF\r\n\x1a\n"].concat()).unwrap();
    std::fs::write(at("a.parquet"), "PAR1").unwrap();
    std::fs::write(at("a.npz"), "PK").unwrap();
    for (arguments, facts) in [
        ("import nothing.npy --rows 2 --cols 2", &["nothing.npy"][..]),
        ("import mine.csv --rows 5 --cols 5", &["mine.csv: shape [60, 144]", "5 × 5 taxels"]),
        ("import mine.csv --rows 12 --cols 12 --press-frames 7", &["`--press-frames` = 7", "divisors of 60"]),
        ("import mine.csv --rows 0 --cols 12", &["`--rows` = 0", "[1, 1024]"]),
        ("import mine.csv --rows 12 --cols 12 --idle 3", &["`--idle` = 3", "first:N"]),
        ("import mine.csv --rows 12 --cols 12 --idle first:99", &["`--idle` = first:99", "[0, 60]"]),
        ("import mine.csv --rows 12 --cols 12 --hold 2:1", &["`--hold` = 2:1", "START:END"]),
        ("import mine.csv --rows 12 --cols 12 --hold 0:99", &["`--hold` = 0:99", "within"]),
        ("import mine.csv --rows 12 --cols 12 --rate 0", &["`--rate` = 0", "[0.001, 1000000]"]),
        ("import mine.csv --rows 12 --cols 12 --pitch 2m", &["`--pitch` = 2m", "0.1mm"]),
        ("import mine.csv --rows 12 --cols 12 --name a/b", &["`name`", "a/b"]),
        ("import comma.csv --rows 1 --cols 2 --rate 9", &["comma.csv: line 1: `1,5` has a decimal comma"]),
        ("import text.csv --rows 1 --cols 2 --rate 9", &["text.csv: line 2: `four` is not a number"]),
        ("import empty.npy --rows 2 --cols 2", &["empty.npy: not a readable NumPy array"]),
        ("import v73.mat --rows 2 --cols 2", &["v73.mat", "v7.3", "-v7"]),
        ("import a.parquet --rows 2 --cols 2", &["a.parquet"]),
        ("import a.npz --rows 2 --cols 2", &["a.npz: not a readable NumPy archive"]),
        ("wire nowhere --out w", &["nowhere"]),
    ] {
        refused(dir.path(), &words(arguments), facts);
    }
    assert!(!at("out").exists());
    succeeds(dir.path(), &words(&format!("{IMPORT} --out s")));
    for (arguments, facts) in [
        ("wire s --out w --wires 13", &["`--wires` = 13 is outside [1, 12]"][..]),
        ("wire s --out w --peak 1", &["`--peak` = 1", "[100, 1000000]"]),
        ("wire s --out w --readout as_bult", &["as_bult", "as_built"]),
        ("wire s --out w --rows nothing.txt", &["nothing.txt"]),
        ("decode s --out d", &["no session has a compressive recording", "spts wire"]),
        ("score s --out c", &["raster alone", "spts wire"]),
    ] {
        refused(dir.path(), &words(arguments), facts);
    }
    assert!(!at("w").exists(), "a refused run leaves a folder");
    // a scan without a touch
    std::fs::write(at("zero.csv"), "0;0\n0;0\n0;0\n").unwrap();
    succeeds(dir.path(), &words("import zero.csv --rows 1 --cols 2 --rate 9 --out z"));
    refused(dir.path(), &words("wire z --out w"), &["zero", "nothing touches the skin"]);
}
