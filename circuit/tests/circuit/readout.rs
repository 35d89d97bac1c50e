//! The readout without effects, its clock, and skins and conductances at the ends of what can be: finite and ordered
//! volts, or an error.

use crate::effects::{assert_close, least_squares};
use spts_circuit::{
    Block, ConductanceSource, Constant, Interpolated, Mode, PROFILES, Profile, Readout, Seeding, Segment, WeightMode,
    Weights,
};
use spts_input::Refusal;
use spts_models::{ConductanceMap, SkinLayout, Streams};

/// A press on taxels 33…66, in volts at 4300 V/S.
pub(crate) fn press_v() -> Vec<f64> {
    let pressed = |k| (33..67).contains(&k);
    (0..100).map(|k| if pressed(k) { 0.1 + 0.01 * f64::from(k - 33) } else { 0.0 }).collect()
}

pub(crate) fn skin(x_v: &[f64]) -> Constant {
    let values = x_v.iter().map(|x| x / 4300.0).collect();
    Constant::new(ConductanceMap::from_values(10, 10, values)).unwrap()
}

/// Skin of one row of `taxels` taxels.
pub(crate) fn strip(taxels: u32) -> SkinLayout {
    SkinLayout::new(1, taxels as usize, 15e-3, 10e-3).unwrap()
}

pub(crate) fn profile(effects: &str) -> Profile {
    let ideal = PROFILES.iter().find(|(name, _)| *name == "ideal").unwrap().1;
    Profile::from_toml(&format!("{ideal}\n{effects}")).unwrap()
}

/// Readout of the published skin, in session 0 of the device with this seed.
pub(crate) fn start(profile: &Profile, mode: Mode, seed: u64) -> Readout {
    Readout::new(profile, mode, &SkinLayout::default(), Streams::new(seed), 0).unwrap()
}

/// Samples of a skin with these volts.
pub(crate) fn samples(profile: &Profile, mode: Mode, seed: u64, x_v: &[f64], measurements: usize) -> Vec<f64> {
    start(profile, mode, seed).acquire(&mut skin(x_v), measurements).unwrap().volts
}

fn readout(name: &str, mode: Mode) -> Readout {
    start(&Profile::named(name).unwrap(), mode, 5)
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
    assert!(Profile::named("as_bilt").unwrap_err().to_string().contains("known: ideal, as_built, as_published"));
    assert!(Profile::from_toml("weights = \"ternary\"").is_err());
    let mut bad = Profile::named("ideal").unwrap();
    bad.sample_rate_hz = f64::NAN;
    assert!(bad.validate(100).unwrap_err().to_string().contains("sample_rate_hz"));
}

/// 150 rows have rank 100; their condition squared times the rounding of a sum of 100 terms stays far below 1e-9.
#[test]
fn a_noiseless_recording_is_inverted() {
    let x = press_v();
    let mut readout = readout("ideal", Mode::Compressive);
    let block = readout.acquire(&mut skin(&x), 200).unwrap();
    let weights = Profile::named("ideal").unwrap().weights(Mode::Compressive, 100).unwrap();
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
        assert_eq!(in_order.iter().map(|b| b.frame_position).collect::<Vec<_>>(), [50, 157, 264]);
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
        let mut other = start(&profile, mode, 6);
        assert!(in_order != blocks(&mut other, 3), "{mode:?}: another seed gives the same noise");
    }
}

/// Memory, beat and clock run on: without noise, two halves are the whole.
#[test]
fn consecutive_blocks_join_up() {
    let quiet = profile("[compressive.memory]\nh1 = -0.03\nh2 = -0.02\n[compressive.clock_pattern]\namplitude_v = 0.1");
    let acquire = |lengths: &[usize]| -> Vec<f64> {
        let mut readout = start(&quiet, Mode::Compressive, 0);
        lengths.iter().flat_map(|n| readout.acquire(&mut skin(&press_v()), *n).unwrap().volts).collect()
    };
    assert!(acquire(&[2000]) == acquire(&[900, 1100]));
}

#[test]
fn wrong_shapes_are_refused() {
    let mut readout = readout("ideal", Mode::Compressive);
    let mut small = Constant::new(ConductanceMap::zeros(3, 3)).unwrap();
    let said = readout.acquire(&mut small, 100).unwrap_err().to_string();
    assert_eq!(said, "the source has 9 taxels; the readout 100");
    for measurements in [0, 150] {
        let said = readout.acquire(&mut skin(&press_v()), measurements).unwrap_err().to_string();
        assert!(said.contains("not a positive whole number of frames of 100"), "{said}");
    }
}

const MODES: [Mode; 2] = [Mode::Raster, Mode::Compressive];

fn uniform(taxels: u32, conductance_s: f64) -> Result<Constant, Refusal> {
    let map = ConductanceMap::from_values(1, taxels as usize, vec![conductance_s; taxels as usize]);
    Constant::new(map)
}

fn volts(profile: &Profile, mode: Mode, taxels: u32, conductance_s: f64) -> Vec<f64> {
    let mut readout = Readout::new(profile, mode, &strip(taxels), Streams::new(0), 0).unwrap();
    let mut skin = uniform(taxels, conductance_s).unwrap();
    readout.acquire(&mut skin, 1000.max(taxels as usize)).unwrap().volts
}

/// All open.
#[test]
fn an_empty_skin_gives_nothing_but_the_floor() {
    for mode in MODES {
        let ideal = volts(&profile(""), mode, 100, 0.0);
        assert!(ideal.iter().all(|y| y.abs() < f64::MIN_POSITIVE), "{mode:?}");
        let built = Profile::named("as_built").unwrap();
        for y in volts(&built, mode, 100, 0.0) {
            // offset 0.22, pattern 0.008, memory 8 % of them, six times the idle noise of 0.125, half a step 0.03
            assert!(y.abs() < 1.1, "{mode:?}: {y} V");
        }
    }
}

/// All short: 1 S, 1 MS and the largest conductance that is taken end at the rails and at the converter's first or last
/// code.
#[test]
fn a_short_skin_saturates() {
    for conductance_s in [1.0, 1e6, 1e12] {
        for (mode, low, high) in [(Mode::Raster, 0.0, 4.4), (Mode::Compressive, -32.5, 32.0)] {
            let built = Profile::named("as_built").unwrap();
            let y = volts(&built, mode, 100, conductance_s);
            assert!(y.iter().all(|y| (low..=high).contains(y)), "{mode:?}: {conductance_s} S");
            assert!(y.iter().any(|y| *y > high - 1e-9), "{mode:?}: no sample at the end of the range");
            let ideal = volts(&profile(""), mode, 100, conductance_s);
            assert!(ideal.iter().all(|y| y.is_finite()), "{mode:?}: {conductance_s} S");
        }
    }
}

/// A million taxels, few of them pressed, against the sum over the pressed ones. The matrix would have 3e8 entries.
#[test]
fn a_skin_of_a_million_taxels() {
    const N: u32 = 1_000_000;
    let mut values = vec![0.0; N as usize];
    let pressed: Vec<u32> = (0..50).map(|k| k * 19_997 + 3).collect();
    for (k, value) in pressed.iter().zip(1_u32..) {
        values[*k as usize] = 1e-6 * f64::from(value);
    }
    let weights = Weights::new(WeightMode::Binary, Seeding::Address, N);
    let mut sums = [0.0; 300];
    weights.weighted_sums(1 << 33, &values, &mut sums);
    for (sum, row) in sums.iter().zip((1 << 33)..) {
        let expected: f64 = pressed.iter().map(|k| weights.level(*k, row) * values[*k as usize]).sum();
        // fifty roundings of values up to 1e-3
        assert_close(*sum, expected, 50.0 * f64::EPSILON * 1e-3);
    }
    // whole raster frames; without late updates, of which a million cells have thousands a measurement
    let skin = || Constant::new(ConductanceMap::from_values(1000, 1000, values.clone())).unwrap();
    let mut built = Profile::named("as_built").unwrap();
    built.raster.remove("late_updates");
    let mut raster = Readout::new(&built, Mode::Raster, &strip(N), Streams::new(0), 0).unwrap();
    let scan = raster.acquire(&mut skin(), N as usize).unwrap();
    assert!(scan.volts.iter().all(|y| y.is_finite()));
    let mut ideal = Readout::new(&profile(""), Mode::Raster, &strip(N), Streams::new(0), 0).unwrap();
    let scan = ideal.acquire(&mut skin(), N as usize).unwrap().volts;
    for (y, g) in scan.iter().zip(&values) {
        assert_close(*y, g * 4300.0, 2.0 * f64::EPSILON);
    }
}

/// The source names what it refuses.
#[test]
fn impossible_conductances_are_refused_and_tiny_ones_are_finite() {
    for bad in [1e300, 1.1e12, f64::INFINITY, f64::NAN, -1e-300] {
        let error = uniform(4, bad).unwrap_err();
        assert!(error.to_string().contains("outside [0, 1e12]"), "{error}");
    }
    for mode in MODES {
        for name in ["ideal", "as_built", "as_published"] {
            let y = volts(&Profile::named(name).unwrap(), mode, 100, 1e-300);
            assert!(y.iter().all(|y| y.is_finite()), "{name}, {mode:?}");
        }
    }
}

/// Knots so close that a slope between them would be infinite.
#[test]
fn a_step_in_no_time_is_finite() {
    let map = |g: f64| ConductanceMap::from_values(10, 10, vec![g; 100]);
    let times_s = vec![0.0, f64::MIN_POSITIVE, 1e-3];
    let mut step = Interpolated::new(times_s, vec![map(0.0), map(1e12), map(0.0)]).unwrap();
    for mode in MODES {
        let mut readout = start(&profile(""), mode, 0);
        let y = readout.acquire(&mut step, 200).unwrap().volts;
        assert!(y.iter().all(|y| y.is_finite()), "{mode:?}");
    }
}

/// A source that does not hand out what it is asked for.
struct Broken {
    end_s: f64,
    values: Vec<f64>,
}

impl ConductanceSource for Broken {
    fn taxels(&self) -> usize {
        100
    }

    fn segment(&mut self, _time_s: f64) -> Segment<'_> {
        Segment { start_s: 0.0, end_s: self.end_s, conductance_s: &self.values, end_conductance_s: None, fours: None }
    }
}

#[test]
fn broken_sources_are_refused() {
    for (end_s, taxels) in [(1e-3, 100), (f64::NAN, 100), (f64::INFINITY, 99)] {
        let mut source = Broken { end_s, values: vec![0.0; taxels] };
        let mut readout = start(&profile(""), Mode::Compressive, 0);
        let error = readout.acquire(&mut source, 1000).unwrap_err();
        assert!(error.to_string().starts_with("at 0"), "{error}");
    }
}
