//! The readout without effects, and its clock.

use crate::effects::least_squares;
use spts_circuit::{AcquireError, Block, Constant, Mode, PROFILES, Profile, Readout};
use spts_models::{ConductanceMap, SkinLayout, Streams};

/// A press on taxels 33…66, in volts at 4300 V/S.
pub(crate) fn press_v() -> Vec<f64> {
    (0..100)
        .map(|k| {
            if (33..67).contains(&k) {
                0.1 + 0.01 * f64::from(k - 33)
            } else {
                0.0
            }
        })
        .collect()
}

pub(crate) fn skin(x_v: &[f64]) -> Constant {
    Constant::new(ConductanceMap::from_values(
        10,
        10,
        x_v.iter().map(|x| x / 4300.0).collect(),
    ))
    .unwrap()
}

/// Skin of one row of `taxels` taxels.
pub(crate) fn strip(taxels: u32) -> SkinLayout {
    SkinLayout::new(1, taxels as usize, 15e-3, 10e-3).unwrap()
}

pub(crate) fn profile(effects: &str) -> Profile {
    let ideal = PROFILES.iter().find(|(name, _)| *name == "ideal").unwrap().1;
    Profile::from_toml(&format!("{ideal}\n{effects}")).unwrap()
}

fn readout(name: &str, mode: Mode) -> Readout {
    Readout::new(
        &Profile::named(name).unwrap(),
        mode,
        &SkinLayout::default(),
        Streams::new(5),
        0,
    )
    .unwrap()
}

#[test]
fn every_profile_is_valid_in_both_modes() {
    for (name, _) in PROFILES {
        Profile::named(name).unwrap().validate(100).unwrap();
        for mode in [Mode::Raster, Mode::Compressive] {
            let block = readout(name, mode).acquire(&mut skin(&press_v()), 1000).unwrap();
            assert!(block.volts.iter().all(|v| v.is_finite()), "{name}");
        }
    }
    assert!(
        Profile::named("as_bilt")
            .unwrap_err()
            .to_string()
            .contains("known: ideal, as_built, as_published")
    );
    assert!(Profile::from_toml("weights = \"ternary\"").is_err());
    let mut bad = Profile::named("ideal").unwrap();
    bad.sample_rate_hz = f64::NAN;
    assert!(bad.validate(100).unwrap_err().to_string().contains("sample_rate_hz"));
}

/// Removing every effect of a profile leaves the ideal readout, bit for bit.
#[test]
fn no_effects_is_ideal() {
    let mut bare = Profile::named("as_built").unwrap();
    bare.compressive.clear();
    bare.raster.clear();
    for mode in [Mode::Raster, Mode::Compressive] {
        let mut bare = Readout::new(&bare, mode, &SkinLayout::default(), Streams::new(1), 0).unwrap();
        let a = bare.acquire(&mut skin(&press_v()), 10_000).unwrap();
        let b = readout("ideal", mode).acquire(&mut skin(&press_v()), 10_000).unwrap();
        assert!(a == b, "{mode:?}");
    }
}

#[test]
fn an_ideal_raster_is_the_skin() {
    let x = press_v();
    let block = readout("ideal", Mode::Raster).acquire(&mut skin(&x), 300).unwrap();
    for (k, y) in block.volts.iter().enumerate() {
        let expected = x[k % 100];
        // one division and one product by 4300
        assert!(
            (y - expected).abs() <= 2.0 * f64::EPSILON * expected,
            "taxel {k}: {y} V, expected {expected} V"
        );
    }
}

/// 150 rows have rank 100; their condition squared times the rounding of a sum of 100 terms stays far below 1e-9.
#[test]
fn a_noiseless_recording_is_inverted() {
    let x = press_v();
    let mut readout = readout("ideal", Mode::Compressive);
    let block = readout.acquire(&mut skin(&x), 200).unwrap();
    let weights = Profile::named("ideal")
        .unwrap()
        .weights(Mode::Compressive, 100)
        .unwrap();
    let mut values = vec![0.0; 150 * 100];
    weights.fill_rows(0, &mut values);
    let rows: Vec<Vec<f64>> = values.chunks(100).map(<[f64]>::to_vec).collect();
    for (k, (found, x)) in least_squares(&rows, &block.volts[..150]).iter().zip(&x).enumerate() {
        assert!((found - x).abs() < 1e-9, "taxel {k}: {found} V, put in {x} V");
    }
}

fn blocks(readout: &mut Readout, n: usize) -> Vec<Block> {
    (0..n)
        .map(|_| {
            let block = readout.acquire(&mut skin(&press_v()), 5000).unwrap();
            readout.skip(57);
            block
        })
        .collect()
}

#[test]
fn blocks_depend_on_seed_and_number_alone() {
    for mode in [Mode::Raster, Mode::Compressive] {
        let in_order = blocks(&mut readout("as_built", mode), 3);
        assert_eq!(
            in_order.iter().map(|b| b.frame_position).collect::<Vec<_>>(),
            [50, 157, 264]
        );
        // each block on a thread of its own, from a readout of its own
        let on_threads: Vec<Block> = std::thread::scope(|scope| {
            let handles: Vec<_> = (0..3)
                .map(|k| {
                    scope.spawn(move || {
                        let mut readout = readout("as_built", mode);
                        readout.seek(k, k * 107);
                        readout.acquire(&mut skin(&press_v()), 5000).unwrap()
                    })
                })
                .collect();
            handles.into_iter().map(|h| h.join().unwrap()).collect()
        });
        assert!(in_order == on_threads, "{mode:?}");
        let profile = Profile::named("as_built").unwrap();
        let mut other = Readout::new(&profile, mode, &SkinLayout::default(), Streams::new(6), 0).unwrap();
        assert!(
            in_order != blocks(&mut other, 3),
            "{mode:?}: another seed gives the same noise"
        );
    }
}

/// Memory, beat and clock run on: without noise, two halves are the whole.
#[test]
fn consecutive_blocks_join_up() {
    let quiet = profile("[compressive.memory]\nh1 = -0.03\nh2 = -0.02\n[compressive.clock_pattern]\namplitude_v = 0.1");
    let acquire = |lengths: &[usize]| -> Vec<f64> {
        let mut readout = Readout::new(&quiet, Mode::Compressive, &SkinLayout::default(), Streams::new(0), 0).unwrap();
        lengths
            .iter()
            .flat_map(|n| readout.acquire(&mut skin(&press_v()), *n).unwrap().volts)
            .collect()
    };
    assert!(acquire(&[2000]) == acquire(&[900, 1100]));
}

#[test]
fn wrong_shapes_are_refused() {
    let mut readout = readout("ideal", Mode::Compressive);
    let mut small = Constant::new(ConductanceMap::zeros(3, 3)).unwrap();
    assert!(matches!(
        readout.acquire(&mut small, 100),
        Err(AcquireError::Taxels {
            source_taxels: 9,
            taxels: 100
        })
    ));
    for measurements in [0, 150] {
        let error = readout.acquire(&mut skin(&press_v()), measurements);
        assert!(matches!(error, Err(AcquireError::PartialFrame { .. })));
    }
}
