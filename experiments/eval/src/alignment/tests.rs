use super::*;
use rand::seq::SliceRandom as _;
use spts_circuit::{Interpolated, Profile, Readout};
use spts_models::{ConductanceMap, SkinLayout, Streams};

/// Frames of a block, and its contact: as long a press as in the published recordings, in a shorter block.
const FRAMES: usize = 600;
const PRESSED: [f64; 4] = [0.2, 0.4, 0.7, 0.8];

/// Presses of a blob at places of their own, through the readout as it was built, with `slips` of all cells.
fn presses(blocks: usize, slips: &str) -> Recording {
    record(blocks, &format!("probability = 0.0\nall_at = [{slips}]"))
}

/// The same with any missed clocks.
fn record(blocks: usize, faults: &str) -> Recording {
    let mut profile = Profile::named("as_built").unwrap();
    let faults: toml::Table = toml::from_str(faults).unwrap();
    profile
        .compressive
        .insert("missed_clocks".to_owned(), toml::Value::Table(faults));
    let mut readout = Readout::new(&profile, Mode::Compressive, &SkinLayout::default(), Streams::new(3), 0).unwrap();
    let mut sources: Vec<Interpolated> = (0..blocks).map(press).collect();
    readout.record(&mut sources, FRAMES * 100, 57).unwrap()
}

/// A press that rises, creeps while it is held, and is lifted.
fn press(block: usize) -> Interpolated {
    let (row, col) = (2.0 + (block % 5) as f64, 7.0 - (block % 4) as f64);
    let map = |scale: f64| {
        let taxel = |k: usize| {
            let (r, c) = ((k / 10) as f64 - row, (k % 10) as f64 - col);
            1e-3 * scale * (-(r * r + c * c) / 3.0).exp() * (1.0 + 0.3 * (k as f64 * 1.7).sin())
        };
        ConductanceMap::from_values(10, 10, (0..100).map(taxel).collect())
    };
    let [touch, held, lift, away] = PRESSED;
    let times = vec![0.0, touch, held, lift, away, 10.0];
    Interpolated::new(times, [0.0, 0.0, 1.0, 1.04, 0.0, 0.0].map(map).to_vec()).unwrap()
}

/// Measurement in the middle of the hold.
fn held(share: f64) -> usize {
    let [_, held, lift, _] = PRESSED;
    #[expect(clippy::cast_possible_truncation, reason = "a measurement of the block")]
    let measurement = ((held + share * (lift - held)) * 64_300.0) as usize;
    measurement
}

#[test]
fn a_recording_that_is_aligned_is_left_alone() {
    assert_eq!(find_slips(&presses(4, "")), []);
}

/// Twenty slips of up to 500 rows of both signs, of whole blocks and in the middle of presses.
#[test]
fn slips_are_found_where_they_are() {
    let mut edges = [
        1, -1, 2, -2, 34, -34, 65, -65, 31, -31, 100, -100, 500, -500, 250, -250, 499, -499, 7, -8,
    ];
    edges.shuffle(&mut Streams::new(5).rng("slips", 0));
    let (mut text, mut expected, mut lag) = (Vec::new(), Vec::new(), 0);
    for (k, edges) in edges.into_iter().enumerate() {
        let block = k + k / 4;
        // two of three in the middle of a press, the others before it
        let from = if k % 3 == 0 { 0 } else { held(0.1 + 0.04 * k as f64) };
        text.push(format!("{{block = {block}, measurement = {from}, edges = {edges}}}"));
        expected.push((block, from, lag, lag + edges));
        lag += edges;
    }
    let recording = presses(25, &text.join(", "));
    let slips = find_slips(&recording);
    for &(block, from, before, after) in &expected {
        let found: Vec<&Slip> = slips.iter().filter(|slip| slip.block == block).collect();
        let lags: Vec<i64> = found.iter().map(|slip| slip.rows).collect();
        let wanted: Vec<i64> = if from == 0 { vec![after] } else { vec![before, after] };
        let wanted: Vec<i64> = wanted
            .into_iter()
            .enumerate()
            .filter(|(k, lag)| *k > 0 || *lag != 0 || from == 0)
            .map(|(_, lag)| lag)
            .collect();
        assert_eq!(lags, wanted, "block {block}: {found:?}");
        let place = found.last().map_or(0, |slip| slip.from);
        assert!(
            place.abs_diff(from) <= 5,
            "block {block}: from {place}, expected {from}"
        );
    }
    let aligned = recording.realigned(&slips);
    assert_eq!(find_slips(&aligned), []);
}

/// Edges that are missed by chance, as often as in the published sessions that slip: one in 10 000 edges, one or two a
/// press. The lag never falls, and it ends at as many as were missed; each press of the realigned recording is where it
/// says.
#[test]
fn edges_missed_by_chance_are_followed() {
    const BLOCKS: usize = 8;
    let recording = record(BLOCKS, "probability = 0.0\nall_probability = 1e-4");
    let slips = find_slips(&recording);
    assert!(slips.is_sorted_by_key(|slip| slip.rows), "{slips:?}");
    let last = slips.last().map_or(0, |slip| slip.rows) as f64;
    let expected = 1e-4 * recording.first_row(BLOCKS - 1, FRAMES) as f64;
    assert!(
        (last - expected).abs() < 5.0 * expected.sqrt(),
        "{last}, expected {expected}"
    );
    assert_eq!(find_slips(&recording.realigned(&slips)), []);
}
