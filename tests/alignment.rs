//! Sessions whose cells have missed clock edges, through the commands: found, put back on their rows, and reported.

use crate::command::{succeeds, words};
use crate::recordings::recordings;
use serde_json::Value;
use spts::data::SessionSet;
use spts::session::{Event, PressFacts, Recorded, Session};
use spts::{Mode, Profile, SkinLayout};
use spts_circuit::{Interpolated, Readout, Recording, Slip};
use spts_eval::place::find_bounces;
use spts_eval::{Alignment, contact_slips, find_slips, follow_slips};
use spts_models::{ConductanceMap, Streams};
use std::path::Path;

const FRAMES: usize = 600;
/// Touch, hold, lift and end of a press, s.
const PRESS_S: [f64; 4] = [0.2, 0.4, 0.7, 0.8];
/// Scores of slipped and sound recordings may differ by this much: a few windows are lost where the rows change.
const TOLERANCE: f64 = 0.02;

/// Edges that all cells miss: session, block, measurement, edges. The middle of a press is measurement 35 000.
const MISSED: [(usize, u64, usize, i64); 20] = [
    (0, 0, 0, 34),
    (0, 1, 0, -500),
    (0, 2, 30_000, 1),
    (0, 3, 33_000, 2),
    (0, 4, 41_234, 500),
    (0, 5, 35_000, -65),
    (0, 6, 0, 65),
    (0, 8, 28_001, -1),
    (0, 9, 39_999, 300),
    (0, 11, 36_000, -250),
    (1, 0, 32_000, -34),
    (1, 1, 0, 2),
    (1, 2, 44_000, -1),
    (1, 3, 29_000, 128),
    (1, 4, 0, -77),
    (1, 5, 31_000, 500),
    (1, 7, 37_500, -500),
    (1, 8, 0, 1),
    (1, 9, 40_000, 19),
    (1, 10, 34_567, 65),
];

/// Image of the object of session `session`, S.
fn image(session: usize, scale: f64) -> ConductanceMap {
    let taxel = |k: usize| {
        let (row, col) = ((k / 10) as f64, (k % 10) as f64);
        let inside = match session {
            0 => (row - 4.0).hypot(col - 5.0) < 2.6,
            _ => (2.0..=3.0).contains(&row) && (1.0..=8.0).contains(&col),
        };
        if inside { 1e-3 * scale * (1.0 + 0.3 * (1.7 * k as f64).sin()) } else { 0.0 }
    };
    ConductanceMap::from_values(10, 10, (0..100).map(taxel).collect())
}

fn record(session: usize, mode: Mode, blocks: usize, missed: &[(usize, u64, usize, i64)]) -> Recording {
    let of_session = missed.iter().filter(|missed| missed.0 == session);
    let places = of_session.map(|(_, block, measurement, edges)| {
        format!("{{block = {block}, measurement = {measurement}, edges = {edges}}}")
    });
    let places: Vec<String> = places.collect();
    let table = format!("probability = 0.0\nall_at = [{}]", places.join(", "));
    let mut profile = Profile::named("as_built").unwrap();
    let table = toml::Value::Table(toml::from_str(&table).unwrap());
    profile.compressive.insert("missed_clocks".to_owned(), table);
    let [touch, held, lift, away] = PRESS_S;
    let press = |_| {
        let maps = [0.0, 0.0, 1.0, 1.04, 0.0, 0.0].map(|scale| image(session, scale));
        Interpolated::new(vec![0.0, touch, held, lift, away, 10.0], maps.to_vec()).unwrap()
    };
    let mut presses: Vec<Interpolated> = (0..blocks).map(press).collect();
    let streams = Streams::new(7 + session as u64);
    let mut readout = Readout::new(&profile, mode, &SkinLayout::default(), streams, 0).unwrap();
    readout.record(&mut presses, FRAMES * 100, 57).unwrap().with_idle_frames(Some(100))
}

/// Two sessions, in a folder each.
fn write(dir: &Path, missed: &[(usize, u64, usize, i64)]) {
    for (session, name) in ["disc", "bar"].iter().enumerate() {
        let [_, held, lift, _] = PRESS_S;
        let compressive = record(session, Mode::Compressive, 12, missed);
        let facts = PressFacts { conductance: Some(image(session, 1.0)), ..PressFacts::default() };
        let whole = Session {
            hold_s: Some([held, lift]),
            raster: Some(Recorded { conditioning: 3, ..Recorded::new(record(session, Mode::Raster, 6, &[])) }),
            compressive: Some(Recorded {
                presses: vec![facts; compressive.blocks().len()],
                ..Recorded::new(compressive)
            }),
            ..Session::new(name, Event::Press)
        };
        whole.write(&dir.join(name)).unwrap();
    }
}

/// Twenty slips are all found, their rows exactly and their places to a few measurements; the scores are those of the
/// sound sessions; both commands report the slips, and of sound sessions none.
#[test]
fn slips_are_followed_and_reported() {
    let dir = tempfile::tempdir().unwrap();
    write(&dir.path().join("sound"), &[]);
    write(&dir.path().join("slipped"), &MISSED);
    let arguments = words("--json --no-times --decoder matched,nn_lmmse --measurements 10,20 --learn-from raster");
    let run = |name: &str| {
        let output = succeeds(dir.path(), &[&["score", name], &arguments[..]].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (serde_json::from_slice::<Value>(&output.stdout).unwrap(), said)
    };
    let ((sound, quiet), (slipped, said)) = (run("sound"), run("slipped"));
    assert_eq!(sound["slips"], Value::Array(vec![]));
    assert!(!quiet.contains("clock edges"), "{quiet}");
    assert_eq!(said.matches("clock edges were missed").count(), 1, "{said}");

    let slips = slipped["slips"].as_array().unwrap();
    for (session, name) in ["disc", "bar"].iter().enumerate() {
        let mut expected: Vec<(u64, u64, i64)> = Vec::new();
        let mut lag = 0;
        for block in 0..12 {
            let mut missed = MISSED.iter().filter(|m| m.0 == session && m.1 == block).peekable();
            if lag != 0 && missed.peek().is_none_or(|m| m.2 > 0) {
                expected.push((block, 0, lag));
            }
            for &(_, _, from, edges) in missed {
                lag += edges;
                expected.push((block, from as u64, lag));
            }
        }
        let found: Vec<&Value> = slips.iter().filter(|slip| slip["session"] == *name).collect();
        assert_eq!(found.len(), expected.len(), "{name}: {found:?}, expected {expected:?}");
        for (slip, (block, from, rows)) in found.iter().zip(expected) {
            assert_eq!(slip["block"], block, "{slip}");
            assert_eq!(slip["rows"], rows, "{slip}");
            let place = slip["from"].as_u64().unwrap();
            assert!(place.abs_diff(from) <= 50, "{slip}: expected from {from}");
        }
    }
    let rows = |board: &Value| board["rows"].as_array().unwrap().clone();
    for (sound, slipped) in rows(&sound).iter().zip(&rows(&slipped)) {
        for score in ["support", "iou", "class_single"] {
            let [before, after] = [sound, slipped].map(|row| row[score].as_f64().unwrap());
            assert!((before - after).abs() <= TOLERANCE, "{score}: {after}, without slips {before}");
        }
    }

    let output = succeeds(dir.path(), &["decode", "slipped", "--json", "--session", "bar"]);
    let decoded: Value = serde_json::from_slice(&output.stdout).unwrap();
    let of_bar: Vec<&Value> = slips.iter().filter(|slip| slip["session"] == "bar").collect();
    assert_eq!(decoded["slips"].as_array().unwrap().iter().collect::<Vec<_>>(), of_bar);
    assert!(String::from_utf8_lossy(&output.stderr).contains("clock edges were missed"));
}

/// The recordings of the real skin are where they say. With their rows counted wrong from somewhere in a press on, they
/// are found to slip there.
#[test]
fn recordings_of_the_real_skin_are_aligned() {
    let Some(root) = recordings() else { return };
    let mut set = SessionSet::open(&root).unwrap();
    assert_eq!(follow_slips(&mut set), Alignment::default());
    let presses = set.presses().filter_map(|session| Some((&session.name, session.compressive()?)));
    for (name, recording) in presses {
        for (block, from, rows) in [(6, 55_000, 34), (9, 60_123, -1), (12, 58_000, 500), (13, 52_000, -500)] {
            // samples that lag are those that were recorded `rows` measurements earlier
            let mut blocks = recording.blocks().to_vec();
            let volts = blocks[block].volts.clone();
            for (i, v) in blocks[block].volts.iter_mut().enumerate().skip(from) {
                let earlier = i64::try_from(i).unwrap() - rows;
                *v = usize::try_from(earlier).ok().and_then(|i| volts.get(i)).copied().unwrap_or(f64::NAN);
            }
            let slipped = recording.with_blocks(blocks).unwrap();
            let found = find_slips(&slipped);
            let first = found.first().copied().unwrap_or(Slip { block: 0, from: 0, rows: 0 });
            assert_eq!((first.block, first.rows), (block, rows), "{name}: {found:?}");
            assert!(first.from.abs_diff(from) <= 50, "{name}: {found:?}, expected from {from}");
        }
    }
}

/// Drops of the real skin, one contact a block, with three slips in one recording: all are found, with their rows, and
/// nothing slips in what is put back. A contact whose samples are out of order fits no rows; the others are as before.
#[test]
fn slips_between_contacts_of_drops_are_found() {
    let Some(root) = recordings() else { return };
    let set = SessionSet::open(&root).unwrap();
    let drops = set.drops().expect("drops").clone();
    assert_eq!(contact_slips(&drops), (vec![], vec![]));
    let contacts = find_bounces(&drops);
    // samples of a block that lag are those that were recorded so much earlier
    let lags = [0, 34, 34, -77, -77, 500];
    let mut blocks = drops.blocks().to_vec();
    for (block, rows) in blocks.iter_mut().zip(lags) {
        let volts = block.volts.clone();
        for (i, v) in block.volts.iter_mut().enumerate() {
            let earlier = usize::try_from(i64::try_from(i).unwrap() - rows).ok();
            *v = earlier.and_then(|i| volts.get(i)).copied().unwrap_or(f64::NAN);
        }
    }
    let slipped = drops.with_blocks(blocks).unwrap();
    let (slips, unaligned) = contact_slips(&slipped);
    let expected = lags.iter().enumerate().filter(|(_, rows)| **rows != 0);
    let expected: Vec<Slip> = expected.map(|(block, &rows)| Slip { block, from: 0, rows }).collect();
    assert_eq!((&slips, unaligned), (&expected, vec![]));
    assert_eq!(contact_slips(&slipped.realigned(&slips)), (vec![], vec![]));

    let mut blocks = drops.blocks().to_vec();
    let (start, end) = (contacts[1].start, contacts[1].end);
    blocks[contacts[1].block].volts[start..end].reverse();
    let (slips, unaligned) = contact_slips(&drops.with_blocks(blocks).unwrap());
    assert_eq!((slips, unaligned.len()), (vec![], 1));
    assert!(unaligned[0].1.start.abs_diff(start) < 50 && unaligned[0].1.end.abs_diff(end) < 50, "{unaligned:?}");
    let without = drops.without(&unaligned);
    assert_eq!(find_bounces(&without).len(), contacts.len() - 1);
}
