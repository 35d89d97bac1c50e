//! The amplifier: what it does over time, its response, its noise, its limits, the amplifier within the readout, and
//! what it makes of skins of every size.

use crate::readout::{press_v, profile, samples, start};
use approx::assert_relative_eq;
use proptest::prelude::*;
use spts_circuit::amplifier::{
    Amplifier, AmplifierNoise, AmplifierResponse, BusLoad, Limit, Network, OpAmp, Remedied, Remedy, Setting, Skin,
    Transient, remedied,
};
use spts_circuit::{Adc, Constant, Mode, Profile};
use spts_models::ConductanceMap;
use std::f64::consts::{PI, TAU};

fn amplifier(network: Network) -> Amplifier {
    Amplifier::new(OpAmp::default(), network).unwrap()
}

/// An operational amplifier with this corner of the 1/f noise.
fn corner(noise_corner_hz: f64) -> OpAmp {
    let op_amp = OpAmp::default();
    OpAmp { noise_corner_hz, ..op_amp }
}

/// No 1/f noise.
fn white(network: Network) -> Amplifier {
    Amplifier::new(corner(0.0), network).unwrap()
}

/// No slewing, no rails.
fn small_signal(network: Network) -> Amplifier {
    let (slew_v_per_s, rail_v) = (1e15, 1e6);
    let op_amp = OpAmp { slew_v_per_s, rail_v, ..OpAmp::default() };
    Amplifier::new(op_amp, network).unwrap()
}

fn network(bus_f: f64, feedback_f: f64) -> Network {
    Network { bus_f, feedback_f, ..Network::default() }
}

fn load(conductance_s: f64, current_a: f64) -> BusLoad {
    BusLoad { conductance_s, current_a }
}

/// (v, o) from the differential equations alone, by Runge and Kutta's method of fourth order in steps of `h`.
fn runge_kutta(amplifier: &Amplifier, loads: &[(BusLoad, f64)], h: f64) -> Vec<f64> {
    let (op_amp, n) = (amplifier.op_amp(), amplifier.network());
    let (unity, pole) = (TAU * op_amp.gain_bandwidth_hz, TAU * op_amp.gain_bandwidth_hz / op_amp.dc_gain);
    let capacitance_f = n.bus_f + n.feedback_f;
    let rates = |[v, o]: [f64; 2], load: BusLoad| {
        let demand = unity * (n.offset_v - v) - pole * o;
        let mut rate = demand.clamp(-op_amp.slew_v_per_s, op_amp.slew_v_per_s);
        if (o >= op_amp.rail_v && rate > 0.0) || (o <= -op_amp.rail_v && rate < 0.0) {
            rate = 0.0;
        }
        let bus_s = load.conductance_s + 1.0 / n.feedback_ohm;
        let current_a = n.feedback_f * rate - bus_s * v + o / n.feedback_ohm + load.current_a;
        [current_a / capacitance_f, rate]
    };
    let mut x = [0.0, 0.0];
    let mut outputs = Vec::new();
    for (load, dt_s) in loads {
        let steps = (dt_s / h).round();
        let mut step = 0.0;
        while step < steps {
            let h = dt_s / steps;
            let along = |x: [f64; 2], k: [f64; 2], h: f64| [x[0] + h * k[0], x[1] + h * k[1]];
            let k1 = rates(x, *load);
            let k2 = rates(along(x, k1, 0.5 * h), *load);
            let k3 = rates(along(x, k2, 0.5 * h), *load);
            let k4 = rates(along(x, k3, h), *load);
            for i in 0..2 {
                x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
            x[1] = x[1].clamp(-op_amp.rail_v, op_amp.rail_v);
            step += 1.0;
        }
        outputs.push(x[1]);
    }
    outputs
}

/// Slewing up and down, standing at both rails, leaving them and ringing, against steps of a hundredth of a nanosecond.
/// A step in which the phase changes has an error of first order: slew rate times step, 0.25 mV here, of which the
/// change of the rate inside the step leaves a part; 0.1 mV is a hundredth of the raster converter's step.
#[test]
fn slewing_and_rails_follow_the_differential_equations() {
    for (bus_f, feedback_f) in [(1e-9, 0.0), (10e-9, 0.0), (3e-9, 100e-12)] {
        let amplifier = amplifier(network(bus_f, feedback_f));
        let mut loads = Vec::new();
        for volts in [3.0, -9.0, 40.0, 5.0, -100.0, 0.0, 14.8, -14.8] {
            for _ in 0..8 {
                loads.push((load(4.5e-3, volts * 1e-3), 0.4e-6));
            }
        }
        let expected = runge_kutta(&amplifier, &loads, 1e-11);
        let mut transient = Transient::new(amplifier);
        for ((load, dt_s), expected) in loads.iter().zip(&expected) {
            transient.advance(*load, *dt_s);
            assert_relative_eq!(transient.output_v(), *expected, epsilon = 1e-4);
        }
        // both rails were reached
        assert!(expected.iter().any(|v| *v >= 14.9) && expected.iter().any(|v| *v <= -14.9));
    }
}

/// A hundred thousand taxels of 20 pF, and buses up to the largest allowed, which turn at 29 kHz … 41 Hz. With ωh ≤
/// 2e-3 the method of Runge and Kutta is off by (ωh)⁴/120 of a turn's angle, 1e-13 a radian; some 10⁵ steps round by
/// 1e-16 each.
#[test]
fn a_bus_of_farads_follows_the_differential_equations() {
    for (bus_f, h) in [(2e-6, 1e-8), (1e-3, 2e-7), (1.0, 5e-6)] {
        let amplifier = small_signal(network(bus_f, 0.0));
        let loads = [4.5e-3, -2e-3, 0.0].map(|current_a| (load(4.5e-3, current_a), 30_000.0 * h));
        let expected = runge_kutta(&amplifier, &loads, h);
        let mut transient = Transient::new(amplifier);
        for ((load, dt_s), expected) in loads.iter().zip(&expected) {
            transient.advance(*load, *dt_s);
            assert_relative_eq!(transient.output_v(), *expected, epsilon = 1e-10);
        }
    }
}

proptest! {
    /// The exact solution does not care how a step is cut. Rounding: a few units in the last place of the largest
    /// volts.
    #[test]
    fn a_step_may_be_cut_anywhere(
        bus_pf in 0.0..20e3_f64, feedback_pf in 0.0..500.0_f64, taxels_us in 0.0..1e5_f64,
        step_ns in 1.0..1e5_f64, cuts in prop::collection::vec(0.0..1.0_f64, 1..8), volts in -10.0..10.0_f64,
    ) {
        let amplifier = small_signal(network(bus_pf * 1e-12, feedback_pf * 1e-12));
        let drive = load(taxels_us * 1e-6, volts * 1e-3);
        let (mut whole, mut cut) = (Transient::new(amplifier), Transient::new(amplifier));
        whole.advance(drive, step_ns * 1e-9);
        let total: f64 = cuts.iter().sum::<f64>() + 1e-3;
        for share in cuts.iter().chain([&1e-3]) {
            cut.advance(drive, step_ns * 1e-9 * share / total);
        }
        prop_assert!((whole.output_v() - cut.output_v()).abs() <= 1e-12 * volts.abs().max(1.0), "{} {}", whole.output_v(), cut.output_v());
        prop_assert!((whole.sum_v() - cut.sum_v()).abs() <= 1e-12 * volts.abs().max(1.0));
    }

    /// The same with slewing and rails, where the instants between the phases are found to rounding.
    #[test]
    fn a_large_step_may_be_cut_anywhere(
        bus_pf in 0.0..20e3_f64, taxels_us in 0.0..1e5_f64, step_ns in 1.0..2e4_f64, at in 0.0..1.0_f64, volts in -200.0..200.0_f64,
    ) {
        let amplifier = amplifier(network(bus_pf * 1e-12, 0.0));
        let drive = load(taxels_us * 1e-6, volts * 1e-3);
        let (mut whole, mut cut) = (Transient::new(amplifier), Transient::new(amplifier));
        whole.advance(drive, step_ns * 1e-9);
        cut.advance(drive, step_ns * 1e-9 * at);
        cut.advance(drive, step_ns * 1e-9 * (1.0 - at));
        // the margins of the switches are 1e-9 of the slew rate and of the rails
        prop_assert!((whole.output_v() - cut.output_v()).abs() <= 1e-6, "{} {}", whole.output_v(), cut.output_v());
    }
}

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

/// |H|², |E|² and, from 1 Hz on, |E|²/f summed over frequency against the closed forms. Trapezia in ln f, 400 a decade
/// over 1 mHz … 1 THz: curvature leaves (Δ ln f)²/12 of the resonance, Q² times, 1e-4 at most; what lies outside is
/// below 1e-5.
#[test]
fn noise_is_the_integral_over_the_response() {
    for (bus_f, feedback_f, feedback_ohm) in
        [(0.0, 0.0, 1e3), (10e-9, 0.0, 1e3), (5e-9, 200e-12, 300.0), (1e-12, 0.0, 1e4)]
    {
        let amplifier = amplifier(Network { feedback_ohm, ..network(bus_f, feedback_f) });
        let (s, unity) = (4e-3 + 1.0 / feedback_ohm, TAU * 10.6e6);
        let c = (bus_f + feedback_f).max(1e-18);
        let (mut current, mut voltage, mut flicker, mut last) = (0.0, 0.0, 0.0, None::<[f64; 3]>);
        for k in 0..6000_u32 {
            let f = 10_f64.powf(-3.0 + f64::from(k) / 400.0);
            let w = TAU * f;
            let real = unity * 1e-6 * s + unity / feedback_ohm - c * w * w;
            let imaginary = w * (s + unity * 1e-6 * c + unity * feedback_f);
            let h2 = unity * unity / (real * real + imaginary * imaginary);
            let now = [f, h2, h2 * (s * s + (w * c).powi(2))];
            if let Some(before) = last {
                current += 0.5 * (now[1] + before[1]) * (f - before[0]);
                voltage += 0.5 * (now[2] + before[2]) * (f - before[0]);
                if k > 1200 {
                    flicker += 0.5 * (now[2] / f + before[2] / before[0]) * (f - before[0]);
                }
            }
            last = Some(now);
        }
        let noise = AmplifierNoise::rms(&amplifier, 4e-3);
        let kt4 = 4.0 * 1.380_649e-23 * 300.0;
        assert_relative_eq!(noise.taxels, (kt4 * 4e-3 * current).sqrt(), max_relative = 2e-4);
        assert_relative_eq!(noise.feedback, (kt4 / feedback_ohm * current).sqrt(), max_relative = 2e-4);
        assert_relative_eq!(noise.current, 1e-13 * current.sqrt(), max_relative = 2e-4);
        assert_relative_eq!(noise.voltage, 6e-9 * (voltage + 1e3 * flicker).sqrt(), max_relative = 2e-4);
        // a corner at which the 1/f noise is nearly all there is
        let op_amp = corner(1e9);
        let pink = AmplifierNoise::rms(&Amplifier::new(op_amp, *amplifier.network()).unwrap(), 4e-3);
        let expected = 6e-9 * (voltage + 1e9 * flicker).sqrt();
        assert_relative_eq!(pink.voltage, expected, max_relative = 2e-4);
    }
}

/// A single pole at fb, without capacitances: ∫ G²/(1 + (f/fb)²) df = π/2·fb·G², and with 1/f from 1 Hz on ½ ln(1 +
/// fb²)·G², G = NG to 1/A0. The bus's 1 aF is 3e-9 of the time constant; logarithms of 1e16 cost a digit or two.
#[test]
fn flicker_of_a_single_pole_is_a_logarithm() {
    for taxels in [1.0, 100.0, 1e4, 1e5, 1e7] {
        let conductance_s = taxels * 38.25e-6;
        let noise_gain = 1.0 + 1e3 * conductance_s;
        let gain = noise_gain / (1.0 + noise_gain * 1e-6);
        let pole_hz = 10.6e6 / gain;
        let of = |noise_corner_hz| {
            let amplifier = Amplifier::new(corner(noise_corner_hz), Network::default()).unwrap();
            AmplifierNoise::rms(&amplifier, conductance_s).voltage
        };
        let white_hz = 0.5 * PI * pole_hz;
        let flicker_hz = 0.5 * (pole_hz * pole_hz).ln_1p();
        assert_relative_eq!(of(0.0), 6e-9 * gain * white_hz.sqrt(), max_relative = 1e-7);
        for corner_hz in [1e3, 1e6] {
            let expected = 6e-9 * gain * (white_hz + corner_hz * flicker_hz).sqrt();
            assert_relative_eq!(of(corner_hz), expected, max_relative = 1e-7);
        }
    }
    // the density: twice the power at the corner, and nothing but white noise below 1 Hz
    let amplifier = amplifier(Network::default());
    let density = |hz| AmplifierNoise::density(&amplifier, 4e-3, hz).voltage;
    assert_relative_eq!(density(1e3) / density(0.5), 2_f64.sqrt(), max_relative = 1e-6);
    assert_relative_eq!(density(0.5), density(0.0), max_relative = 1e-9);
}

/// The corner between ringing and none changes the 1/f noise no more than anything else: one part in 1e12 of Cb, where
/// Δ passes through 0. √Δ is then 1e-6, of which the series of ln and arg leave the square.
#[test]
fn flicker_is_smooth_at_the_critical_case() {
    let pink = corner(1e9);
    // a₁² = 4 a₀ a₂ at S = 4 mS: (S + 1/Rf + ωp Cb)² = 4 (ωp (S + 1/Rf) + ωt/Rf) Cb, the smaller solution
    let (bus_s, pole, rate) = (5e-3, TAU * 10.6, TAU * 10.6 * 5e-3 + TAU * 10.6e6 * 1e-3);
    let half = 2.0 * rate / (pole * pole) - bus_s / pole;
    let critical_f = (bus_s / pole).powi(2) / (half + (half * half - (bus_s / pole).powi(2)).sqrt());
    let of = |bus_f| AmplifierNoise::rms(&Amplifier::new(pink, network(bus_f, 0.0)).unwrap(), 4e-3).voltage;
    let response = AmplifierResponse::new(&amplifier(network(critical_f, 0.0)), 4e-3);
    assert_relative_eq!(response.quality(), 0.5, max_relative = 1e-9);
    for part in [1e-12, -1e-12, 1e-9, -1e-9] {
        assert_relative_eq!(of(critical_f * (1.0 + part)), of(critical_f), max_relative = 1e-8);
    }
}

/// An amplifier of 290 GHz that slews at 1 V/s and rings: what it asks of its output while it slews is a parabola that
/// falls to −1e14 V/s in the 82 s of a step, and crosses zero within a millisecond.
#[test]
fn a_ringing_amplifier_keeps_to_its_slew_rate() {
    let ten = |x: f64| 10_f64.powf(x);
    let op_amp = OpAmp {
        gain_bandwidth_hz: ten(11.464_697_900_189_769),
        dc_gain: ten(7.754_928_239_576_978),
        slew_v_per_s: 1.0,
        rail_v: ten(4.988_861_405_672_652),
        ..OpAmp::default()
    };
    let network = Network {
        feedback_ohm: ten(1.550_700_069_474_499_7),
        bus_f: ten(-2.556_697_304_243_314),
        feedback_f: 0.0,
        offset_v: 4e-4,
        ..Network::default()
    };
    let mut transient = Transient::new(Amplifier::new(op_amp, network).unwrap());
    for (conductance_s, dt_s) in [(1.0, 1.0), (ten(-7.719_523_301_621_349), ten(1.913_522_955_640_195_7))] {
        let before_v = transient.output_v();
        transient.advance(load(conductance_s, -1.0 / network.feedback_ohm), dt_s);
        let change_v = (transient.output_v() - before_v).abs();
        assert!(change_v <= dt_s * (1.0 + 1e-6), "{change_v} V in {dt_s} s");
    }
}

/// Everything short, everything open, and far too much: the rails hold, and the way back is as fast as the way there.
/// 300 A on a farad: the rest is at 6e8 V, where the slew rate of 1 V/s is lost in rounding.
#[test]
fn a_rest_far_away_does_not_hide_the_slew_rate() {
    let op_amp =
        OpAmp { gain_bandwidth_hz: 5.8e10, dc_gain: 10.0, slew_v_per_s: 1.0, rail_v: 33e3, ..OpAmp::default() };
    let network = Network { feedback_ohm: 2.08e6, bus_f: 1.0, offset_v: 4e-4, ..Network::default() };
    let mut transient = Transient::new(Amplifier::new(op_amp, network).unwrap());
    let before_v = transient.output_v();
    transient.advance(load(4.3e-8, -300.0), 1.0);
    let change_v = (transient.output_v() - before_v).abs();
    assert!((0.9..=1.0 + 1e-6).contains(&change_v), "{change_v} V in 1 s");
}

proptest! {
    /// Anything within the ranges, for a nanosecond to an hour: finite, within the rails, and no faster than the slew
    /// rate.
    #[test]
    fn every_corner_is_finite(
        hz in 0.0..12.0_f64, gain in 1.0..9.0_f64, slew in 0.0..15.0_f64, rail in -3.0..6.0_f64, ohm in -9.0..9.0_f64,
        bus in prop::option::of(-18.0..0.0_f64), feedback in prop::option::of(-18.0..-6.0_f64),
        steps in prop::collection::vec((-12.0..9.0_f64, -12.0..9.0_f64, any::<bool>(), -9.0..3.556_f64), 1..20),
    ) {
        let ten = |x: f64| 10_f64.powf(x);
        let op_amp = OpAmp {
            gain_bandwidth_hz: ten(hz),
            dc_gain: ten(gain),
            slew_v_per_s: ten(slew),
            rail_v: ten(rail),
            ..OpAmp::default()
        };
        let network = Network {
            feedback_ohm: ten(ohm),
            bus_f: bus.map_or(0.0, ten),
            feedback_f: feedback.map_or(0.0, ten),
            offset_v: 4e-4,
            ..Network::default()
        };
        let amplifier = Amplifier::new(op_amp, network).unwrap();
        let mut transient = Transient::new(amplifier);
        let mut largest_v = 1.0_f64;
        for (conductance, volts, up, dt) in steps {
            let before_v = transient.output_v();
            let current_a = (if up { ten(volts) } else { -ten(volts) }) / network.feedback_ohm;
            transient.advance(load(ten(conductance), current_a), ten(dt));
            let noise_gain = 1.0 + network.feedback_ohm * ten(conductance);
            largest_v = largest_v.max(ten(volts)).max(4e-4 * noise_gain.min(op_amp.dc_gain));
            let (v, o) = (transient.sum_v(), transient.output_v());
            prop_assert!(v.is_finite() && o.is_finite(), "{v} {o}");
            prop_assert!(o.abs() <= op_amp.rail_v * (1.0 + 1e-8), "{o} V");
            let change = (o - before_v).abs();
            // where the linear system would come to rest without rails: volts are rounded to its scale
            let rounding_v = 1e-14 * largest_v + 1e-9 * op_amp.rail_v;
            prop_assert!(change <= op_amp.slew_v_per_s * ten(dt) * (1.0 + 1e-6) + rounding_v, "{change} V in {} s", ten(dt));
        }
        let response = AmplifierResponse::new(&amplifier, 1.0);
        for x in [response.bandwidth_hz(), response.quality(), response.settle_s(5e-4)] {
            prop_assert!(x.is_finite() && x > 0.0, "{response:?}");
        }
        prop_assert!(AmplifierNoise::rms(&amplifier, 1.0).total().is_finite());
    }
}

const MEASUREMENTS: usize = 20_000;

fn record(effects: &str) -> Vec<f64> {
    samples(&profile(effects), Mode::Compressive, 11, &press_v(), MEASUREMENTS)
}

fn amplifier_effect(rest: &str) -> String {
    format!("[compressive.amplifier]\nupdate_s = 8e-6\nsample_s = 13e-6\n{rest}")
}

/// Without a bus capacitance 5 µs are tens of time constants: what is left is the finite open-loop gain (NG/A0, some
/// 1e-5 of the volts) and the noise of theory.
#[test]
fn a_fast_amplifier_adds_its_noise_only() {
    let quiet = "op_amp = { noise_v_per_rthz = 0.0, noise_a_per_rthz = 0.0 }\ntemperature_k = 1.0";
    let (ideal, silent, noisy) = (record(""), record(&amplifier_effect(quiet)), record(&amplifier_effect("")));
    // Σx = Rf·Vd·ΣG is what the profile of these tests makes of the press
    let sum_v: f64 = press_v().iter().sum();
    let volts_per_siemens = profile("").volts_per_siemens();
    let conductance_s = sum_v / volts_per_siemens;
    let amplifier = amplifier(Network::default());
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
    let amplifier = amplifier(network(10e-9, 0.0));
    let response = AmplifierResponse::new(&amplifier, sum_v / profile("").volts_per_siemens());
    let (damping, turning) = (response.damping_per_s(), TAU * response.ringing_hz().unwrap());
    let error = |k: f64| {
        let t = 5e-6 + k / 64.3e3;
        (-damping * t).exp() * ((turning * t).cos() + damping / turning * (turning * t).sin())
    };
    let expected = [1.0 - error(0.0), error(0.0) - error(1.0), error(1.0) - error(2.0), error(2.0) - error(3.0)];
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
        let mut readout = start(&profile, mode, 1);
        let x = press_v();
        // the press of these tests in the profile's own volts
        let x: Vec<f64> = x.iter().map(|v| v * 0.5).collect();
        let conductance: Vec<f64> = x.iter().map(|v| v / profile.volts_per_siemens()).collect();
        let map = ConductanceMap::from_values(10, 10, conductance);
        let mut source = Constant::new(map).unwrap();
        let volts = readout.acquire(&mut source, 1000).unwrap().volts;
        let weights = profile.weights(mode, 100).unwrap();
        for (y, row) in volts.iter().zip(0_u64..) {
            let expected: f64 = (0_u32..100).zip(&x).map(|(k, x)| weights.level(k, row) * x).sum();
            // half a step, and of the offset and the noise some mV; the raster converter ends at ±4.3 V
            if expected.abs() < 4.2 {
                assert!((y - expected).abs() <= 0.5 * lsb_v + 4e-3, "{mode:?} row {row}: {y} for {expected}");
            }
        }
    }
}

fn setting() -> Setting {
    let profile = Profile::named("as_designed").unwrap();
    let adc: Adc = profile.compressive["adc"].clone().try_into().unwrap();
    Setting { skin: Skin::default(), adc, available_s: 5e-6 }
}

fn of(taxels: u32, remedy: Remedy) -> Remedied {
    remedied(&white(Network::default()), taxels, 100, remedy, &setting()).unwrap()
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

/// Two levels by hand: 10 sub-arrays of 100, their sum of 3.16 × 9.9 V brought to 14.9 V.
#[test]
fn a_tree_of_two_levels_adds_up() {
    let (tree, one) = (of(1000, Remedy::SubArrays), of(100, Remedy::AsBuilt).budget);
    assert_eq!((tree.amplifiers, tree.levels), (11, 2));
    let gain = 14.9 / (one.excursion_v * 10_f64.sqrt());
    assert_relative_eq!(tree.gain, gain, max_relative = 1e-12);
    assert_relative_eq!(tree.budget.signal_v, 0.495 * gain, max_relative = 1e-12);
    let second_v = AmplifierNoise::rms(&white(Network::default()), 10.0 * gain / 1e3).total();
    let noise_v = (10_f64.sqrt() * gain * one.noise_v_rms).hypot(second_v);
    assert_relative_eq!(tree.budget.noise_v_rms, noise_v, max_relative = 1e-12);
}

/// With 2 nF on the bus a wire of 200 taxels settles, since their conductance damps it, and wires of 100, 2 or 1 taxels
/// do not.
#[test]
fn the_fewest_wires_are_found_where_more_taxels_help() {
    let amplifier = amplifier(network(2e-9, 0.0));
    let alone = |taxels: u32| remedied(&amplifier, taxels, 100, Remedy::AsBuilt, &setting()).unwrap();
    assert_eq!(alone(200).budget.limit, None);
    for taxels in [100, 2, 1] {
        assert_eq!(alone(taxels).budget.limit, Some(Limit::Settling));
    }
    let fewest = |taxels: u32| remedied(&amplifier, taxels, 100, Remedy::Wires, &setting()).unwrap().wires;
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
    let amplifier = amplifier(Network::default());
    for (taxels, sub_array, field) in [(0, 100, "taxels"), (100, 1, "sub_array")] {
        let error = remedied(&amplifier, taxels, sub_array, Remedy::SubArrays, &setting()).unwrap_err();
        assert!(error.to_string().contains(field), "{error}");
    }
    let skin = Skin { pressed_share: 1.5, ..Skin::default() };
    let setting = Setting { skin, ..setting() };
    let error = remedied(&amplifier, 100, 100, Remedy::AsBuilt, &setting).unwrap_err();
    assert!(error.to_string().contains("pressed_share"), "{error}");
}
