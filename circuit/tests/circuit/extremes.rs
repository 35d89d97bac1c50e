//! Skins and conductances at the ends of what can be: finite and ordered volts, or an error.

use crate::effects::assert_close;
use crate::readout::{profile, strip};
use spts_circuit::{
    AcquireError, ConductanceSource, Constant, Interpolated, Mode, Profile, Readout, Seeding, Segment, SourceError,
    WeightMode, Weights,
};
use spts_models::{ConductanceMap, SkinLayout, Streams};

const MODES: [Mode; 2] = [Mode::Raster, Mode::Compressive];

fn uniform(taxels: u32, conductance_s: f64) -> Result<Constant, SourceError> {
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
            assert!(
                y.iter().all(|y| (low..=high).contains(y)),
                "{mode:?}: {conductance_s} S"
            );
            assert!(
                y.iter().any(|y| *y > high - 1e-9),
                "{mode:?}: no sample at the end of the range"
            );
            let ideal = volts(&profile(""), mode, 100, conductance_s);
            assert!(ideal.iter().all(|y| y.is_finite()), "{mode:?}: {conductance_s} S");
        }
    }
}

/// A skin of one shorted taxel lies on a rail at every sample.
#[test]
fn saturation_on_every_sample() {
    let rails = profile("[compressive.rails]\nlimit_v = 5.0\n[raster.rails]\nlimit_v = 5.0");
    for mode in MODES {
        let (y, ideal) = (volts(&rails, mode, 1, 1.0), volts(&profile(""), mode, 1, 1.0));
        for (y, u) in y.iter().zip(&ideal) {
            assert!(u.abs() > 5.0);
            assert_close(*y, 5.0_f64.copysign(*u), 0.0);
        }
    }
}

#[test]
fn a_skin_of_one_taxel() {
    let g = 1e-4;
    let weights = Weights::new(WeightMode::Binary, Seeding::Address, 1);
    for (y, row) in volts(&profile(""), Mode::Compressive, 1, g).iter().zip(0_u64..) {
        assert_close(*y, weights.level(0, row) * g * 4300.0, 2.0 * f64::EPSILON);
    }
    for y in volts(&profile(""), Mode::Raster, 1, g) {
        assert_close(y, g * 4300.0, 2.0 * f64::EPSILON);
    }
    for mode in MODES {
        let y = volts(&Profile::named("as_built").unwrap(), mode, 1, g);
        assert!(y.iter().all(|y| y.is_finite()), "{mode:?}");
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
        let expected: f64 = pressed
            .iter()
            .map(|k| weights.level(*k, row) * values[*k as usize])
            .sum();
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

/// More conductance never lowers a raster's volts, up to the clip; the noise is the same for both.
#[test]
fn raster_volts_rise_with_conductance() {
    let adc = "[raster.adc]\nbits = 10\nreference_v = 3.3\ndivider = 3.0787878787878786\noffset_v = 4.3";
    let quiet = profile(&format!(
        "[raster.idle_noise]\nsd_v = 0.05\n[raster.rails]\nlimit_v = 4.0\n{adc}"
    ));
    let mut below = f64::NEG_INFINITY;
    for k in 0..400 {
        let y = volts(&quiet, Mode::Raster, 100, 1e-9 * 1.1_f64.powi(k / 2))[57];
        assert!(y >= below, "{y} V after {below} V");
        below = y;
    }
    assert!(below > 3.9, "{below} V: the clip was not reached");
}

/// Knots so close that a slope between them would be infinite.
#[test]
fn a_step_in_no_time_is_finite() {
    let map = |g: f64| ConductanceMap::from_values(10, 10, vec![g; 100]);
    let times_s = vec![0.0, f64::MIN_POSITIVE, 1e-3];
    let mut step = Interpolated::new(times_s, vec![map(0.0), map(1e12), map(0.0)]).unwrap();
    for mode in MODES {
        let mut readout = Readout::new(&profile(""), mode, &SkinLayout::default(), Streams::new(0), 0).unwrap();
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
        Segment {
            start_s: 0.0,
            end_s: self.end_s,
            conductance_s: &self.values,
            end_conductance_s: None,
        }
    }
}

#[test]
fn broken_sources_are_refused() {
    for (end_s, taxels) in [(1e-3, 100), (f64::NAN, 100), (f64::INFINITY, 99)] {
        let mut source = Broken {
            end_s,
            values: vec![0.0; taxels],
        };
        let mut readout = Readout::new(
            &profile(""),
            Mode::Compressive,
            &SkinLayout::default(),
            Streams::new(0),
            0,
        )
        .unwrap();
        let error = readout.acquire(&mut source, 1000).unwrap_err();
        assert!(matches!(error, AcquireError::Segment { .. }), "{error}");
    }
}
