//! The exact transient against the differential equations, step by step and cut anywhere.

use super::{amplifier, load, network, small_signal};
use approx::assert_relative_eq;
use proptest::prelude::*;
use spts_circuit::amplifier::{Amplifier, BusLoad, Transient};
use std::f64::consts::TAU;

/// (v, o) from the differential equations alone, by Runge and Kutta's method of fourth order in steps of `h`.
fn runge_kutta(amplifier: &Amplifier, loads: &[(BusLoad, f64)], h: f64) -> Vec<f64> {
    let (op_amp, n) = (amplifier.op_amp(), amplifier.network());
    let (unity, pole) = (
        TAU * op_amp.gain_bandwidth_hz,
        TAU * op_amp.gain_bandwidth_hz / op_amp.dc_gain,
    );
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
