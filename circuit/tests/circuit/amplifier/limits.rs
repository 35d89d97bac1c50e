//! The amplifier at the ends of its ranges and beyond its rails.

use super::{amplifier, load};
use approx::assert_relative_eq;
use proptest::prelude::*;
use spts_circuit::amplifier::{Amplifier, AmplifierNoise, AmplifierResponse, Network, OpAmp, Transient};

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
#[test]
fn saturation_at_every_sample() {
    let amplifier = amplifier(Network::default());
    let mut transient = Transient::new(amplifier);
    for k in 0..1000 {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        transient.advance(load(1e6, sign * 3.3e6), 15e-6);
        assert!(transient.output_v().is_finite() && transient.output_v().abs() <= 14.9);
    }
    // nothing on the bus: the amplifier comes off the rail
    transient.advance(load(0.0, 0.0), 15e-6);
    assert_relative_eq!(transient.output_v(), 0.0, epsilon = 1e-6);
}

#[test]
fn parts_outside_their_ranges_are_refused() {
    let with = |network: Network| Amplifier::new(OpAmp::default(), network).unwrap_err().to_string();
    let negative = with(Network {
        bus_f: -1e-12,
        ..Network::default()
    });
    assert!(negative.contains("bus_f") && negative.contains("[0, 1]"), "{negative}");
    let none = with(Network {
        feedback_ohm: f64::NAN,
        ..Network::default()
    });
    assert!(none.contains("feedback_ohm"), "{none}");
    let slow = OpAmp {
        slew_v_per_s: 0.0,
        ..OpAmp::default()
    };
    assert!(Amplifier::new(slow, Network::default()).is_err());
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
        for x in [response.bandwidth_hz(), response.quality(), response.natural_hz(), response.settle_s(5e-4)] {
            prop_assert!(x.is_finite() && x > 0.0, "{response:?}");
        }
        prop_assert!(AmplifierNoise::rms(&amplifier, 1.0).total().is_finite());
    }
}
