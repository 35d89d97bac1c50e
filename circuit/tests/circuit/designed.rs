//! The amplifier within the readout, and what it makes of skins of every size.

use crate::readout::{press_v, profile, skin};
use approx::assert_relative_eq;
use proptest::prelude::*;
use spts_circuit::amplifier::{
    Amplifier, AmplifierNoise, AmplifierResponse, Limit, Network, OpAmp, Remedied, Remedy, Setting, Skin, remedied,
};
use spts_circuit::{Adc, Mode, Profile, Readout};
use spts_models::SkinLayout;
use spts_models::Streams;
use std::f64::consts::TAU;

const MEASUREMENTS: usize = 20_000;

fn record(effects: &str) -> Vec<f64> {
    let mut readout = Readout::new(
        &profile(effects),
        Mode::Compressive,
        &SkinLayout::default(),
        Streams::new(11),
        0,
    )
    .unwrap();
    readout.acquire(&mut skin(&press_v()), MEASUREMENTS).unwrap().volts
}

fn amplifier_effect(rest: &str) -> String {
    format!("[compressive.amplifier]\nupdate_s = 8e-6\nsample_s = 13e-6\n{rest}")
}

/// Without a bus capacitance 5 µs are tens of time constants: what is left is the finite open-loop gain (NG/A0, some
/// 1e-5 of the volts) and the noise of theory.
#[test]
fn a_fast_amplifier_adds_its_noise_only() {
    let quiet = "op_amp = { noise_v_per_rthz = 0.0, noise_a_per_rthz = 0.0 }\ntemperature_k = 1.0";
    let (ideal, silent, noisy) = (
        record(""),
        record(&amplifier_effect(quiet)),
        record(&amplifier_effect("")),
    );
    // Σx = Rf·Vd·ΣG is what the profile of these tests makes of the press
    let sum_v: f64 = press_v().iter().sum();
    let volts_per_siemens = profile("").volts_per_siemens();
    let conductance_s = sum_v / volts_per_siemens;
    let amplifier = Amplifier::new(OpAmp::default(), Network::default()).unwrap();
    let rms_v = AmplifierNoise::rms(&amplifier, conductance_s).total();
    let mut square = 0.0;
    for ((u, s), y) in ideal.iter().zip(&silent).zip(&noisy) {
        assert!((u - s).abs() <= 2e-5 * u.abs() + 2e-5, "{u} {s}");
        square += (y - u / (1.0 + (1.0 + 1e3 * conductance_s) / 1e6)).powi(2);
    }
    // five standard errors of a standard deviation
    let tolerance = 5.0 / (2.0 * MEASUREMENTS as f64).sqrt();
    assert_relative_eq!((square / MEASUREMENTS as f64).sqrt(), rms_v, max_relative = tolerance);
}

/// With 10 nF on the bus the output still rings when it is sampled, and follows the measurements before:
/// yₙ = uₙ + Σ (uₙ₋ₖ₋₁ − uₙ₋ₖ) e(t₁ + kT) with the error e of the step response, t₁ after the drives have changed.
#[test]
fn bus_capacitance_leaves_a_memory() {
    let quiet =
        "bus_f = 10e-9\ntemperature_k = 1.0\nop_amp = { slew_v_per_s = 1e12, rail_v = 100.0, noise_v_per_rthz = 0.0 }";
    let (u, y) = (record(""), record(&amplifier_effect(quiet)));
    let rows: Vec<Vec<f64>> = (3..u.len()).map(|n| vec![u[n], u[n - 1], u[n - 2], u[n - 3]]).collect();
    let h = crate::effects::least_squares(&rows, &y[3..]);
    let sum_v: f64 = press_v().iter().sum();
    let network = Network {
        bus_f: 10e-9,
        ..Network::default()
    };
    let amplifier = Amplifier::new(OpAmp::default(), network).unwrap();
    let response = AmplifierResponse::new(&amplifier, sum_v / profile("").volts_per_siemens());
    let (damping, turning) = (response.damping_per_s(), TAU * response.ringing_hz().unwrap());
    let error = |k: f64| {
        let t = 5e-6 + k / 64.3e3;
        (-damping * t).exp() * ((turning * t).cos() + damping / turning * (turning * t).sin())
    };
    let expected = [
        1.0 - error(0.0),
        error(0.0) - error(1.0),
        error(1.0) - error(2.0),
        error(2.0) - error(3.0),
    ];
    assert!(expected[1] > 0.1, "no memory to look at: {expected:?}");
    for (found, expected) in h.iter().zip(expected) {
        // what comes before is below e^(−10); the finite gain takes 1e-5
        assert_relative_eq!(*found, expected, epsilon = 2e-4);
    }
}

#[test]
fn as_designed_is_close_to_its_weights() {
    let mut profile = Profile::named("as_designed").unwrap();
    // the errors of the cells' converters are some percent of a weight
    assert!(profile.compressive.remove("dac").is_some() && profile.raster.remove("dac").is_some());
    for (mode, lsb_v) in [(Mode::Compressive, 63.1e-3), (Mode::Raster, 9.94e-3)] {
        let mut readout = Readout::new(&profile, mode, &SkinLayout::default(), Streams::new(1), 0).unwrap();
        let x = press_v();
        // the press of these tests in the profile's own volts
        let x: Vec<f64> = x.iter().map(|v| v * 0.5).collect();
        let conductance: Vec<f64> = x.iter().map(|v| v / profile.volts_per_siemens()).collect();
        let map = spts_models::ConductanceMap::from_values(10, 10, conductance);
        let mut source = spts_circuit::Constant::new(map).unwrap();
        let volts = readout.acquire(&mut source, 1000).unwrap().volts;
        let weights = profile.weights(mode, 100).unwrap();
        for (y, row) in volts.iter().zip(0_u64..) {
            let expected: f64 = (0_u32..100).zip(&x).map(|(k, x)| weights.level(k, row) * x).sum();
            // half a step, and of the offset and the noise some mV; the raster converter ends at ±4.3 V
            if expected.abs() < 4.2 {
                assert!(
                    (y - expected).abs() <= 0.5 * lsb_v + 4e-3,
                    "{mode:?} row {row}: {y} for {expected}"
                );
            }
        }
    }
}

fn setting() -> Setting {
    let profile = Profile::named("as_designed").unwrap();
    let adc: Adc = profile.compressive["adc"].clone().try_into().unwrap();
    Setting {
        skin: Skin::default(),
        adc,
        available_s: 5e-6,
    }
}

/// With white noise alone, as the table of sizes has it.
fn white() -> Amplifier {
    let op_amp = OpAmp {
        noise_corner_hz: 0.0,
        ..OpAmp::default()
    };
    Amplifier::new(op_amp, Network::default()).unwrap()
}

fn of(taxels: u32, remedy: Remedy) -> Remedied {
    remedied(&white(), taxels, 100, remedy, &setting()).unwrap()
}

/// The table of sizes, worked out apart from this program, to its two or three digits: signal and ratio to the noise,
/// with the feedback as built and scaled.
#[test]
fn signals_are_the_table_s() {
    for (taxels, as_built_db, scaled_v, scaled_db) in [
        (100, 79.0, 0.495, 79.0),
        (1000, 70.0, 49.5e-3, 59.0),
        (10_000, 60.0, 4.95e-3, 39.0),
        (100_000, 50.0, 0.495e-3, 19.0),
    ] {
        let plain = of(taxels, Remedy::AsBuilt).budget;
        assert_relative_eq!(plain.signal_v, 0.495, max_relative = 1e-12);
        // rounded to whole dB
        assert_relative_eq!(plain.snr_db, as_built_db, epsilon = 0.6);
        let scaled = of(taxels, Remedy::FeedbackScaled).budget;
        assert_relative_eq!(scaled.signal_v, scaled_v, max_relative = 1e-12);
        assert_relative_eq!(scaled.snr_db, scaled_db, epsilon = 0.6);
        assert_relative_eq!(scaled.noise_v_rms, 0.054e-3, max_relative = 0.05);
        assert_relative_eq!(scaled.noise_gain, 4.825, max_relative = 1e-12);
    }
    assert_relative_eq!(of(10_000, Remedy::AsBuilt).budget.sum_rms_v, 24.75, max_relative = 1e-3);
    assert_eq!(of(100, Remedy::AsBuilt).budget.limit, None);
    assert_eq!(of(10_000, Remedy::AsBuilt).budget.limit, Some(Limit::Settling));
    assert!(of(10_000, Remedy::AsBuilt).budget.saturates);
}

/// A hundred taxels need no remedy, and every remedy is then the plain amplifier.
#[test]
fn remedies_of_nothing_change_nothing() {
    let plain = of(100, Remedy::AsBuilt);
    for remedy in Remedy::ALL {
        let other = of(100, remedy);
        assert_eq!((other.wires, other.amplifiers, other.levels), (1, 1, 1));
        assert_relative_eq!(other.budget.noise_v_rms, plain.budget.noise_v_rms, max_relative = 1e-12);
        assert_relative_eq!(other.budget.settle_s, plain.budget.settle_s, max_relative = 1e-12);
    }
}

/// Two levels by hand: 10 sub-arrays of 100, their sum of 3.16 × 9.9 V brought to 14.9 V.
#[test]
fn a_tree_of_two_levels_adds_up() {
    let (tree, one) = (of(1000, Remedy::SubArrays), of(100, Remedy::AsBuilt).budget);
    assert_eq!((tree.amplifiers, tree.levels), (11, 2));
    let gain = 14.9 / (one.excursion_v * 10_f64.sqrt());
    assert_relative_eq!(tree.gain, gain, max_relative = 1e-12);
    assert_relative_eq!(tree.budget.signal_v, 0.495 * gain, max_relative = 1e-12);
    let second_v = AmplifierNoise::rms(&white(), 10.0 * gain / 1e3).total();
    let noise_v = (10_f64.sqrt() * gain * one.noise_v_rms).hypot(second_v);
    assert_relative_eq!(tree.budget.noise_v_rms, noise_v, max_relative = 1e-12);
}

/// One taxel in a hundred pressed: four standard deviations of a sub-array are more than it can ever put out, those of
/// the whole skin are not. By hand: 4 · 1 kΩ · 3.3 V · √(100 · (150 µS)² + 9900 · (1 µS)²) = 19.8 V have to fit into
/// 14.9 V.
#[test]
fn a_tree_over_a_sparse_skin_makes_room_for_four_deviations() {
    let sparse = Setting {
        skin: Skin {
            pressed_share: 0.01,
            ..Skin::default()
        },
        ..setting()
    };
    let tree = |taxels| remedied(&white(), taxels, 100, Remedy::SubArrays, &sparse).unwrap();
    let one = tree(100).budget;
    assert_relative_eq!(one.excursion_v, one.sum_worst_v, max_relative = 1e-12);
    let all_v = 4.0 * 1e3 * 3.3 * (100.0 * 150e-6_f64.powi(2) + 9900.0 * 1e-6_f64.powi(2)).sqrt();
    assert_relative_eq!(all_v, 19.8, max_relative = 5e-3);
    let all = tree(10_000);
    assert_relative_eq!(all.gain, 14.9 / all_v, max_relative = 1e-12);
    assert_relative_eq!(all.budget.excursion_v, 14.9, max_relative = 1e-12);
}

/// What fails by the largest factor is named: a hundred thousand taxels on 1 Ω lose a taxel's 0.5 mV in a step of 63
/// mV, a factor of 127; the current of 63 mA, 5 % too much, does not matter beside that.
#[test]
fn the_worst_limit_is_named() {
    let network = Network {
        feedback_ohm: 1.0,
        ..Network::default()
    };
    let amplifier = Amplifier::new(OpAmp::default(), network).unwrap();
    let skin = Skin {
        pressed_share: 0.01,
        ..Skin::default()
    };
    let slow = Setting {
        skin,
        available_s: 1e-3,
        ..setting()
    };
    let budget = remedied(&amplifier, 100_000, 100, Remedy::AsBuilt, &slow)
        .unwrap()
        .budget;
    assert!(budget.excursion_v > 60e-3);
    assert_eq!(budget.limit, Some(Limit::ConverterStep));
}

/// With 2 nF on the bus a wire of 200 taxels settles, since their conductance damps it, and wires of 100, 2 or 1 taxels
/// do not.
#[test]
fn the_fewest_wires_are_found_where_more_taxels_help() {
    let network = Network {
        bus_f: 2e-9,
        ..Network::default()
    };
    let amplifier = Amplifier::new(OpAmp::default(), network).unwrap();
    let alone = |taxels: u32| remedied(&amplifier, taxels, 100, Remedy::AsBuilt, &setting()).unwrap();
    assert_eq!(alone(200).budget.limit, None);
    for taxels in [100, 2, 1] {
        assert_eq!(alone(taxels).budget.limit, Some(Limit::Settling));
    }
    let fewest = |taxels: u32| {
        remedied(&amplifier, taxels, 100, Remedy::Wires, &setting())
            .unwrap()
            .wires
    };
    assert_eq!(fewest(200), 1);
    // every number of wires, one after the other
    let works = |taxels: u32, wires: u32| {
        let fits = |on_wire: u32| alone(on_wire).budget.limit.is_none();
        fits(taxels / wires) && fits(taxels.div_ceil(wires))
    };
    for taxels in (1..120).chain([199, 400, 997, 1024, 3600]) {
        let expected = (1..taxels).find(|wires| works(taxels, *wires)).unwrap_or(taxels);
        assert_eq!(fewest(taxels), expected, "{taxels} taxels");
    }
}

/// Enough wires are enough, and one less is not.
#[test]
fn wires_are_as_many_as_needed() {
    let wires = of(1_000_000, Remedy::Wires).wires;
    assert!(wires > 1);
    let one = |taxels: u32| of(taxels, Remedy::AsBuilt).budget.limit;
    assert_eq!(one(1_000_000 / wires), None);
    assert!(one(1_000_000_u32.div_ceil(wires - 1) + 1).is_some());
}

proptest! {
    /// Any skin, any size, every remedy: finite, and ordered as physics has it.
    #[test]
    fn every_skin_has_a_budget(
        taxels in 1_u32..=10_000_000, sub_array in 2_u32..5000, share in 0.0..=1.0_f64, pressed in -9.0..0.0_f64, idle in -12.0..0.0_f64,
        bus in prop::option::of(-15.0..-6.0_f64), available in -9.0..1.0_f64,
    ) {
        let ten = |x: f64| 10_f64.powf(x);
        let network = Network { bus_f: bus.map_or(0.0, ten), ..Network::default() };
        let amplifier = Amplifier::new(OpAmp::default(), network).unwrap();
        let skin = Skin { pressed_share: share, pressed_s: ten(pressed), idle_s: ten(idle), drive_v: 3.3 };
        let setting = Setting { skin, available_s: ten(available), ..setting() };
        for remedy in Remedy::ALL {
            let r = remedied(&amplifier, taxels, sub_array, remedy, &setting).unwrap();
            let b = r.budget;
            for x in [b.noise_gain, b.bandwidth_hz, b.quality, b.settle_s, b.noise_v_rms, b.excursion_v, r.gain] {
                prop_assert!(x.is_finite() && x > 0.0, "{remedy:?} {b:?}");
            }
            prop_assert!(b.snr_db.is_finite() && b.snr_adc_db <= b.snr_db);
            prop_assert!(b.excursion_v <= b.sum_worst_v * (1.0 + 1e-9));
            prop_assert!(r.wires >= 1 && r.wires <= taxels && r.amplifiers >= r.wires && r.gain <= 1.0);
            prop_assert!(b.limit.is_some() || !b.saturates);
        }
        let more = remedied(&amplifier, taxels + 1, sub_array, Remedy::AsBuilt, &setting).unwrap().budget;
        let plain = remedied(&amplifier, taxels, sub_array, Remedy::AsBuilt, &setting).unwrap().budget;
        prop_assert!(more.noise_gain >= plain.noise_gain && more.bandwidth_hz <= plain.bandwidth_hz * (1.0 + 1e-12));
    }
}

#[test]
fn nothing_cannot_be_read() {
    let amplifier = Amplifier::new(OpAmp::default(), Network::default()).unwrap();
    for (taxels, sub_array, field) in [(0, 100, "taxels"), (100, 1, "sub_array")] {
        let error = remedied(&amplifier, taxels, sub_array, Remedy::SubArrays, &setting()).unwrap_err();
        assert!(error.to_string().contains(field), "{error}");
    }
    let skin = Skin {
        pressed_share: 1.5,
        ..Skin::default()
    };
    let setting = Setting { skin, ..setting() };
    let error = remedied(&amplifier, 100, 100, Remedy::AsBuilt, &setting).unwrap_err();
    assert!(error.to_string().contains("pressed_share"), "{error}");
}
