//! The published decoder on the real skin: `reference` chooses the atoms that an independent program chooses.

use crate::recordings::recordings;
use sha2::{Digest as _, Sha256};
use spts::data::SessionSet;
use spts_circuit::Recording;
use spts_recon::recover::ReferenceOmp;
use spts_recon::{Matrix, Problem, Recover as _, Workspace};
use std::fmt::Write as _;

const OBJECTS: [&str; 5] = ["brain", "center", "eraser", "rec", "trig"];

/// Measurements, most atoms, and the SHA-256 that `scripts/oracles/published_supports.py` prints for the supports of
/// its 1,000 windows.
const DIGESTS: [(usize, usize, &str); 5] = [
    (20, 20, "fbde90e2556f1fa35b78a08eb4063f98cbf88878bcebc362de9e9fc1887e19ee"),
    (25, 20, "5f5e18a44cdfff519024b3668ceb086d3e36996ae7c54b7f83c06f18c0845741"),
    (50, 20, "dfe10be0ff8c1019177c3e277dd57a9a25bf35427593a2d7cc835debd92aa63b"),
    (25, 10, "5cec506592a8042d8870b464eaf909343ee12337e9873d6ee356f3874e7edf48"),
    (50, 10, "c9a9df5943d7c328e979716d278e5a69fc0d87a696724aaa8819db0c10b2816e"),
];

/// Φ·D with weights 0 and 1, and the measurements, of the first `m` samples of a frame.
fn window(recording: &Recording, dictionary: &Matrix, press: usize, frame: usize, m: usize) -> (Matrix, Vec<f64>) {
    let start = frame * recording.measurements_per_frame();
    let mut rows = recording.rows(press, start..start + m).to_vec();
    rows.iter_mut().for_each(|w| *w = 0.5 * (*w + 1.0));
    let mut a = Matrix::zeros(m, dictionary.ncols());
    for (r, row) in rows.chunks(recording.taxels()).enumerate() {
        dictionary.accumulate_row(row, a.row_mut(r));
    }
    (a, recording.volts(press, frame)[..m].to_vec())
}

/// One line a window: atoms in the order they were chosen. All 1,000 supports are equal exactly when the digests are.
fn supports(recordings: &[&Recording], dictionary: &Matrix, m: usize, most: usize) -> String {
    let (mut text, mut work) = (String::new(), Workspace::default());
    for recording in recordings {
        for (press, frame) in (5..13).flat_map(|press| (500..700).step_by(8).map(move |frame| (press, frame))) {
            let (a, y) = window(recording, dictionary, press, frame, m);
            let problem = Problem::new(a.view(), &y).unwrap();
            let solution = ReferenceOmp::new(most).recover(&problem, &mut work).unwrap();
            let atoms: Vec<String> = solution.support.iter().map(usize::to_string).collect();
            writeln!(text, "{}", atoms.join(" ")).unwrap();
        }
    }
    text
}

/// The least lead of a choice over the second best is 4e-7 in the independent program's windows, rounding 1e-12: no tie
/// is open.
#[test]
#[ignore = "reads all recordings of five objects"]
fn the_reference_chooses_what_the_published_decoder_chooses() {
    let Some(root) = recordings() else { return };
    let set = SessionSet::open(&root).unwrap();
    let dictionary = &set.published.as_ref().expect("the published dictionary").dictionary;
    let sessions = OBJECTS.map(|name| set.named(name).unwrap().compressive().expect("a compressive session"));
    for (m, most, expected) in DIGESTS {
        let text = supports(&sessions, dictionary, m, most);
        assert_eq!(text.lines().count(), 1000);
        let digest = Sha256::digest(&text);
        let found = digest.iter().fold(String::new(), |hex, byte| hex + &format!("{byte:02x}"));
        assert_eq!(found, expected, "M = {m}, S = {most}: at least one of 1,000 supports differs");
    }
}

/// Every published volt is the volt of a code, bit for bit, and presses are known to begin idle.
#[test]
fn published_volts_are_codes() {
    let Some(dir) = recordings() else { return };
    let set = SessionSet::open(&dir).unwrap();
    let mut scans = 0;
    for object in OBJECTS {
        let session = set.named(object).unwrap();
        scans += usize::from(session.raster().is_some());
        for recording in [session.raster(), session.compressive()].into_iter().flatten() {
            let converter = recording.converter().unwrap();
            assert_eq!(converter.max_code(), 1023);
            for block in recording.blocks() {
                assert!(converter.made(&block.volts), "{object}");
                assert_eq!(block.idle_frames, Some(150));
            }
        }
    }
    assert!(scans > 0);
    let bounces = set.drops().unwrap();
    assert!(bounces.converter().is_some());
    assert!(bounces.blocks().iter().all(|block| block.idle_frames.is_none()));
}
