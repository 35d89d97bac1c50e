//! The device's weight matrix, and weights of every kind: as text, as rows, and as what a readout records with them.

use crate::readout::{profile, strip};
use nalgebra::DMatrix;
use proptest::prelude::*;
use spts_circuit::{
    Block, CompressiveWeights, Interpolated, Mode, Patterns, Profile, Readout, Recording, RecordingInfo, Seeding,
    WeightMode, Weights,
};
use spts_models::{ConductanceMap, Streams};

fn matrix(seeding: Seeding, rows: usize) -> Vec<Vec<f64>> {
    let mut values = vec![0.0; rows * 100];
    Weights::new(WeightMode::Binary, seeding, 100).fill_rows(0, &mut values);
    // {0, 1} as the published scripts decode
    values.chunks(100).map(|row| row.iter().map(|w| 0.5 * (w + 1.0)).collect()).collect()
}

/// Singular values of matrices with entries 0 and 1 and a norm below 150 that are zero come out below 150·100·ε =
/// 3e-12; the smallest other ones lie far above this.
const RANK_TOLERANCE: f64 = 1e-9;

#[test]
fn the_first_hundred_rows_have_rank_97() {
    let rank = |seeding, rows| {
        let matrix = matrix(seeding, rows);
        DMatrix::from_fn(rows, 100, |r, c| matrix[r][c]).rank(RANK_TOLERANCE)
    };
    assert_eq!(rank(Seeding::Address, 100), 97);
    assert_eq!(rank(Seeding::Address, 150), 100);
    assert_eq!(rank(Seeding::Mixed, 100), 100);
}

/// 0-based; counted from 1 these are 1, 46, 63, 483, 528, 819 and 928. There the state aⁿ·address + K(n), a sawtooth
/// over the addresses, stays within one half of 2³² for all of them.
#[test]
fn seven_of_the_first_thousand_rows_are_constant() {
    let constant: Vec<usize> = matrix(Seeding::Address, 1000)
        .iter()
        .enumerate()
        .filter(|(_, row)| row.iter().all(|w| w.to_bits() == row[0].to_bits()))
        .map(|(r, _)| r)
        .collect();
    assert_eq!(constant, [0, 45, 62, 482, 527, 818, 927]);
    assert!(matrix(Seeding::Mixed, 1000).iter().all(|row| row.iter().any(|w| w.to_bits() != row[0].to_bits())));
}

/// Rows of the patterns.
const PERIOD: usize = 7;

/// Seeds of the taxels by a rule, as a list.
fn seeds(seeding: Seeding, taxels: u32) -> Vec<u32> {
    (0..taxels).map(|taxel| seeding.seed(taxel)).collect()
}

/// Codes of the first [`PERIOD`] rows of `weights`, as a pattern.
fn pattern(weights: &Weights) -> Patterns {
    let mut codes = vec![0; PERIOD * weights.taxels()];
    weights.fill_codes(0, &mut codes);
    Patterns::new(PERIOD, codes).unwrap()
}

/// Weights of every kind.
fn kinds(taxels: u32, first_seed: u32) -> Vec<Weights> {
    let mut kinds = vec![Weights::new(WeightMode::Raster, Seeding::Address, taxels)];
    for mode in [WeightMode::Analog, WeightMode::Binary] {
        for seeding in [Seeding::Address, Seeding::Mixed] {
            kinds.push(Weights::new(mode, seeding, taxels));
        }
        let own: Vec<u32> = (0..taxels).map(|k| first_seed.wrapping_mul(2 * k + 1)).collect();
        kinds.push(Weights::with_seeds(mode, own).unwrap());
        let patterns = pattern(&Weights::new(mode, Seeding::Mixed, taxels));
        kinds.push(Weights::with_patterns(mode, patterns).unwrap());
    }
    kinds
}

/// A press whose conductance changes.
fn press(taxels: u32) -> Interpolated {
    let map = |scale: f64| {
        let values = (0..taxels).map(|k| scale * 1e-6 * f64::from(k % 11)).collect();
        ConductanceMap::from_values(1, taxels as usize, values)
    };
    Interpolated::new(vec![0.0, 0.004, 0.009], vec![map(0.0), map(3.0), map(1.0)]).unwrap()
}

fn record(profile: &Profile, taxels: u32, frames: usize) -> Recording {
    let mut readout = Readout::new(profile, Mode::Compressive, &strip(taxels), Streams::new(3), 0).unwrap();
    readout.record(&mut [press(taxels), press(taxels)], frames * taxels as usize, 5).unwrap()
}

fn bits(recording: &Recording) -> Vec<u64> {
    let volts = recording.blocks().iter().flat_map(|block| &block.volts);
    volts.map(|v| v.to_bits()).collect()
}

proptest! {
    /// Rows of a recording, dense, in pieces and as signs, are the weights' own, taxel by taxel.
    #[test]
    fn rows_of_a_recording_are_its_weights(
        taxels in 1_u32..140, first_seed in any::<u32>(), lead in 0_u64..1_000_000_000, start in 0_usize..40, len in 0_usize..30,
    ) {
        for weights in kinds(taxels, first_seed) {
            let n = taxels as usize;
            let info = RecordingInfo {
                measurements_per_frame: 35,
                ..RecordingInfo::new(strip(taxels), weights.clone(), 1e3)
            };
            let block = Block { frame_position: lead + 2, idle_frames: None, volts: vec![0.0; 70] };
            let recording = Recording::new(info, vec![block]).unwrap();
            let rows = recording.rows(0, start..start + len);
            let first = 35 * lead + start as u64;
            let phi = rows.to_vec();
            for (i, level) in phi.iter().enumerate() {
                let expected = weights.level(u32::try_from(i % n).unwrap(), first + (i / n) as u64);
                prop_assert_eq!(level.to_bits(), expected.to_bits());
            }
            let pieces: Vec<f64> = rows.chunks(9).flat_map(|piece| piece.to_vec()).collect();
            prop_assert_eq!(&phi, &pieces);
            let signs = rows.sign_bits();
            prop_assert_eq!(signs.is_some(), weights.mode() == WeightMode::Binary);
            for (row, words) in phi.chunks(n).zip(signs.iter().flat_map(|s| s.chunks(n.div_ceil(64)))) {
                for k in 0..64 * words.len() {
                    let plus = row.get(k).is_some_and(|w| *w > 0.0);
                    prop_assert_eq!(words[k / 64] >> (k % 64) & 1 == 1, plus);
                }
            }
            let values: Vec<f64> = (0..n).map(|k| (0.7 * k as f64).sin() * 10.0).collect();
            let mut sums = vec![0.0; len];
            weights.weighted_sums(first, &values, &mut sums);
            for (row, sum) in phi.chunks(n).zip(&sums) {
                let expected: f64 = row.iter().zip(&values).map(|(w, v)| w * v).sum();
                // two orders of n additions of values below 10 differ by less than n roundings of 10·n
                prop_assert!((sum - expected).abs() <= (n * n) as f64 * 10.0 * f64::EPSILON, "{} V, {} V", sum, expected);
            }
        }
    }

    #[test]
    fn weights_come_back_from_text(taxels in 1_u32..40, first_seed in any::<u32>()) {
        for weights in kinds(taxels, first_seed) {
            let text = serde_json::to_string(&weights).unwrap();
            prop_assert_eq!(&serde_json::from_str::<Weights>(&text).unwrap(), &weights, "{}", text);
            let info = RecordingInfo::new(strip(taxels), weights, 64_300.0);
            let text = serde_json::to_string(&info).unwrap();
            prop_assert_eq!(serde_json::from_str::<RecordingInfo>(&text).unwrap(), info, "{}", text);
        }
    }
}

/// As long as a pattern of the generator's rows has not begun anew, it records what the generator does, through every
/// effect; after that, what it began with.
#[test]
fn listed_seeds_and_patterns_record_as_the_rule() {
    for taxels in [3, 100, 131] {
        let n = taxels as usize;
        for name in ["ideal", "as_built", "as_designed"] {
            for weights in [CompressiveWeights::Binary, CompressiveWeights::Analog] {
                let mut generated = Profile::named(name).unwrap();
                generated.weights = weights;
                let mut codes = vec![0; 4 * n * n];
                let own = generated.weights(Mode::Compressive, taxels).unwrap();
                own.fill_codes(0, &mut codes);
                let mut repeated = generated.clone();
                repeated.patterns = Some(Patterns::new(4 * n, codes).unwrap());
                let readout = |profile: &Profile| {
                    let mut readout =
                        Readout::new(profile, Mode::Compressive, &strip(taxels), Streams::new(3), 0).unwrap();
                    readout.record(&mut [press(taxels)], 4 * n, 0).unwrap()
                };
                let rule = bits(&readout(&generated));
                assert!(rule == bits(&readout(&repeated)), "{name}, {taxels} taxels, {weights:?}");
                let mut listed = generated.clone();
                listed.seeds = Some(seeds(generated.seeding.unwrap_or_default(), taxels));
                listed.seeding = None;
                assert!(rule == bits(&readout(&listed)), "{name}, {taxels} taxels, {weights:?}");
            }
        }
        let patterns = pattern(&Weights::new(WeightMode::Analog, Seeding::Mixed, taxels));
        let mut analog = profile("");
        (analog.weights, analog.patterns) = (CompressiveWeights::Analog, Some(patterns));
        let recording = record(&analog, taxels, PERIOD);
        let phi = recording.rows(0, 0..PERIOD * n).to_vec();
        assert_eq!(&phi[..PERIOD * n], &phi[(PERIOD * n - PERIOD) * n..]);
    }
}

/// Weights as text, and words of the error.
const CONTRADICTIONS: &str = r#"
{"mode": "binary", "seeding": "mixed"} | `taxels` is missing
{"mode": "binary", "taxels": 3} | exactly one of `seeding`, `seeds` and `patterns`; found: none
{"mode": "binary", "seeding": "mixed", "seeds": [1]} | found: `seeding`, `seeds`
{"mode": "binary", "seeds": []} | `seeds` has 0 entries; valid: [1, 16777216]
{"mode": "binary", "seeds": [1, 2], "taxels": 3} | `seeds` is for 2 taxels; expected 3
{"mode": "raster", "seeds": [1]} | `seeds` does not go with `mode` = "raster"
{"mode": "binary", "patterns": {"period": 2, "codes": [0, 255, 17, 255]}} | `patterns.codes`[2] = 17 is no binary level; valid: 0 (level −1) and 255 (level +1)
{"mode": "analog", "patterns": {"period": 2, "codes": [0, 255, 17]}} | 3 entries
{"mode": "analog", "patterns": {"period": 0, "codes": [0]}} | `patterns.period` = 0
{"mode": "analog", "generator": "lcg", "patterns": {"period": 1, "codes": [0]}} | `generator`, `patterns`
{"mode": "analog", "generator": "mt", "seeds": [1]} | unknown variant `mt`
"#;

#[test]
fn weights_that_contradict_themselves_are_named() {
    for line in CONTRADICTIONS.trim().lines() {
        let (text, facts) = line.split_once(" | ").unwrap();
        let said = serde_json::from_str::<Weights>(text).unwrap_err().to_string();
        assert!(said.contains(facts), "{text}: {said}");
    }
    let mut listed = profile("seeds = [1, 2, 3]\n");
    let said = listed.weights(Mode::Compressive, 4).unwrap_err().to_string();
    assert_eq!(said, "`seeds` is for 3 taxels; expected 4");
    let raster = Weights::new(WeightMode::Raster, Seeding::Address, 4);
    assert_eq!(listed.weights(Mode::Raster, 4), Ok(raster));
    assert!(listed.validate(3).is_ok());
    listed.seeding = Some(Seeding::Mixed);
    let said = listed.validate(3).unwrap_err().to_string();
    assert!(said.contains("found: `seeding` = \"mixed\", `seeds`"), "{said}");
}

/// The scale of a recording is that of its converter: every sample is the volt of a code.
#[test]
fn every_sample_has_a_code() {
    for name in ["as_built", "as_designed", "as_published"] {
        for mode in [Mode::Raster, Mode::Compressive] {
            let profile = Profile::named(name).unwrap();
            let mut readout = Readout::new(&profile, mode, &strip(100), Streams::new(3), 0).unwrap();
            let recording = readout.record(&mut [press(100)], 2000, 0).unwrap();
            let converter = recording.converter().unwrap();
            assert!(converter.made(&recording.blocks()[0].volts), "{name}, {mode:?}");
            // samples that no converter made
            let halved = recording
                .blocks()
                .iter()
                .map(|block| Block { volts: block.volts.iter().map(|v| v * 0.37).collect(), ..block.clone() });
            assert!(recording.with_blocks(halved.collect()).unwrap().converter().is_none());
            let again = recording.with_blocks(recording.blocks().to_vec()).unwrap();
            assert_eq!(again, recording);
        }
    }
    assert_eq!(record(&profile(""), 100, 2).converter(), None);
}
