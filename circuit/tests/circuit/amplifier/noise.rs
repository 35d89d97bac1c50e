//! The noise against integrals over frequency and closed forms.

use super::{amplifier, network};
use approx::assert_relative_eq;
use spts_circuit::amplifier::{Amplifier, AmplifierNoise, AmplifierResponse, Network, OpAmp};
use std::f64::consts::{PI, TAU};

/// |H|², |E|² and, from 1 Hz on, |E|²/f summed over frequency against the closed forms. Trapezia in ln f, 400 a decade
/// over 1 mHz … 1 THz: curvature leaves (Δ ln f)²/12 of the resonance, Q² times, 1e-4 at most; what lies outside is
/// below 1e-5.
#[test]
fn noise_is_the_integral_over_the_response() {
    for (bus_f, feedback_f, feedback_ohm) in [
        (0.0, 0.0, 1e3),
        (10e-9, 0.0, 1e3),
        (5e-9, 200e-12, 300.0),
        (1e-12, 0.0, 1e4),
    ] {
        let amplifier = amplifier(Network {
            feedback_ohm,
            ..network(bus_f, feedback_f)
        });
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
        assert_relative_eq!(
            noise.feedback,
            (kt4 / feedback_ohm * current).sqrt(),
            max_relative = 2e-4
        );
        assert_relative_eq!(noise.current, 1e-13 * current.sqrt(), max_relative = 2e-4);
        assert_relative_eq!(
            noise.voltage,
            6e-9 * (voltage + 1e3 * flicker).sqrt(),
            max_relative = 2e-4
        );
        // a corner at which the 1/f noise is nearly all there is
        let op_amp = OpAmp {
            noise_corner_hz: 1e9,
            ..OpAmp::default()
        };
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
            let op_amp = OpAmp {
                noise_corner_hz,
                ..OpAmp::default()
            };
            let amplifier = Amplifier::new(op_amp, Network::default()).unwrap();
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
    let pink = OpAmp {
        noise_corner_hz: 1e9,
        ..OpAmp::default()
    };
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
