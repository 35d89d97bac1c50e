//! Bandwidth, ringing and settling against closed forms and against the transient.

use super::{amplifier, load, network, small_signal, white};
use approx::assert_relative_eq;
use proptest::prelude::*;
use spts_circuit::amplifier::{AmplifierNoise, AmplifierResponse, Network, Transient};
use std::f64::consts::{PI, TAU};

/// The step response without capacitances is 1 − e^(−t/τ), τ = NG/ωt to 1/A0.
#[test]
fn one_pole_is_an_exponential() {
    let amplifier = small_signal(Network::default());
    let conductance_s = 3.825e-3;
    let tau_s = 1.0 / (TAU * 10.6e6 / 4.825 + TAU * 10.6);
    let last_v = -1.0 / (1.0 + 4.825e-6);
    for t in [1e-9, 1e-8, 1e-7, 1e-6, 1e-5] {
        let mut transient = Transient::new(amplifier);
        transient.advance(load(conductance_s, 1e-3), t);
        // the bus's 1 aF delays all of it by 1e-18 F/4.8e-3 S = 0.2 fs, 3e-9 of τ
        let expected = last_v * -(-t / tau_s).exp_m1();
        assert_relative_eq!(transient.output_v(), expected, epsilon = 5e-9);
    }
    let response = AmplifierResponse::new(&amplifier, conductance_s);
    assert_relative_eq!(response.bandwidth_hz(), 1.0 / (TAU * tau_s), max_relative = 1e-8);
    assert_relative_eq!(response.settle_s((-7.62_f64).exp()), 7.62 * tau_s, max_relative = 1e-8);
}

/// Rows of the table of N = 100 … 100 000 taxels (25 % at 150 µS, the others at 1 µS, Rf = 1 kΩ), worked out apart from
/// this program and for white noise; its figures have two or three digits.
#[test]
fn the_table_of_sizes_is_met() {
    for (taxels, noise_gain, bandwidth_hz, settle_s, densities_nv, rms_v) in [
        (100.0, 4.8, 2.2e6, 0.55e-6, [8.0, 4.1, 28.9], 0.056e-3),
        (1e3, 39.0, 270e3, 4.5e-6, [25.0, 4.1, 236.0], 0.154e-3),
        (1e4, 384.0, 27.6e3, 44e-6, [80.0, 4.1, 2301.0], 0.48e-3),
        (1e5, 3826.0, 2.8e3, 438e-6, [252.0, 4.1, 22956.0], 1.5e-3),
    ] {
        let (amplifier, conductance_s) = (white(Network::default()), taxels * 38.25e-6);
        let response = AmplifierResponse::new(&amplifier, conductance_s);
        let density = AmplifierNoise::density(&amplifier, conductance_s, 0.0);
        // two digits: half a unit of the second is 5 % at most; the finite open-loop gain is 0.4 % of the last row
        let near = |found: f64, expected: f64| assert_relative_eq!(found, expected, max_relative = 0.03);
        near(response.noise_gain(), noise_gain);
        near(response.bandwidth_hz(), bandwidth_hz);
        near(response.settle_s(0.5 / 1024.0), settle_s);
        near(density.taxels * 1e9, densities_nv[0]);
        near(density.feedback * 1e9, densities_nv[1]);
        near(density.voltage * 1e9, densities_nv[2]);
        near(AmplifierNoise::rms(&amplifier, conductance_s).total(), rms_v);
    }
}

/// Ringing with a noise gain of 5.508 as an independent circuit simulator gave it, to its two or three digits.
#[test]
fn bus_capacitance_rings() {
    let at = |bus_f, feedback_f| AmplifierResponse::new(&amplifier(network(bus_f, feedback_f)), 4.508e-3);
    assert_relative_eq!(at(10e-9, 0.0).natural_hz(), 411e3, max_relative = 2e-3);
    assert_relative_eq!(at(10e-9, 0.0).quality(), 4.7, max_relative = 1e-2);
    let rms_v = |bus_f| AmplifierNoise::rms(&white(network(bus_f, 0.0)), 4.508e-3).total();
    assert_relative_eq!(rms_v(1e-9), 0.104e-3, max_relative = 1e-2);
    assert_relative_eq!(rms_v(10e-9), 0.274e-3, max_relative = 1e-2);
    // envelope 5 µs after an edge: 26 % without and 5 % with 100 pF across the feedback
    let left = |feedback_f| (-at(10e-9, feedback_f).damping_per_s() * 5e-6).exp();
    assert_relative_eq!(left(0.0), 0.26, max_relative = 0.3);
    assert_relative_eq!(left(100e-12), 0.05, max_relative = 0.3);
}

/// The peak of |H| of a ringing bus lies where the damped circuit has it, and the ringing turns at √(1 − 1/4Q²) of it.
#[test]
fn ringing_is_seen_in_the_step_response() {
    let amplifier = small_signal(network(10e-9, 0.0));
    let response = AmplifierResponse::new(&amplifier, 4.508e-3);
    let (hz, damping) = (response.ringing_hz().unwrap(), response.damping_per_s());
    let drive = load(4.508e-3, 1e-3);
    let at = |t: f64| {
        let mut transient = Transient::new(amplifier);
        transient.advance(drive, t);
        transient.output_v()
    };
    let last_v = at(1e-3);
    // extrema at k/2f have the sizes e^(−damping k/2f); a handful of roundings
    for k in 1..6 {
        let t = f64::from(k) / (2.0 * hz);
        let expected = last_v * (1.0 - (-damping * t).exp() * (PI * f64::from(k)).cos());
        assert_relative_eq!(at(t), expected, max_relative = 1e-12);
    }
}

/// Closed-loop bandwidth falls and noise density rises with every taxel, for one to a million of them, open to short.
#[test]
fn more_conductance_is_slower_and_noisier() {
    for bus_f in [0.0, 1e-9] {
        let amplifier = amplifier(network(bus_f, 0.0));
        let mut last: Option<(f64, f64)> = None;
        for k in 0..150 {
            let conductance_s = 10_f64.powf(-9.0 + 0.1 * f64::from(k));
            let bandwidth_hz = AmplifierResponse::new(&amplifier, conductance_s).bandwidth_hz();
            let density = AmplifierNoise::density(&amplifier, conductance_s, 0.0).total();
            assert!(bandwidth_hz > 0.0 && density.is_finite());
            if let Some((hz, v)) = last {
                assert!(bandwidth_hz < hz * (1.0 + 1e-12));
                // with an open-loop gain of 1e6 the density saturates at A0·en
                assert!(density >= v * (1.0 - 1e-9) || conductance_s > 1.0);
            }
            last = Some((bandwidth_hz, density));
        }
    }
}

proptest! {
    /// The time to settle is the last time outside the band, whether it rings or not.
    #[test]
    fn settling_is_the_last_time_outside(bus_pf in 0.0..20e3_f64, feedback_pf in 0.0..500.0_f64, taxels_us in 0.0..1e5_f64) {
        let amplifier = small_signal(network(bus_pf * 1e-12, feedback_pf * 1e-12));
        let (fraction, conductance_s) = (0.5 / 1023.0, taxels_us * 1e-6);
        let settle_s = AmplifierResponse::new(&amplifier, conductance_s).settle_s(fraction);
        let drive = load(conductance_s, 1e-3);
        let last_v = {
            let mut transient = Transient::new(amplifier);
            transient.settle(drive);
            transient.output_v()
        };
        let error = |t: f64| {
            let mut transient = Transient::new(amplifier);
            transient.advance(drive, t);
            (transient.output_v() / last_v - 1.0).abs()
        };
        // on the edge to the rounding of a root; inside at every later time looked at
        prop_assert!((error(settle_s) - fraction).abs() <= 1e-9, "{} {settle_s}", error(settle_s));
        for k in 1..200_u32 {
            prop_assert!(error(settle_s * (1.0 + 0.02 * f64::from(k))) <= fraction);
        }
    }
}
