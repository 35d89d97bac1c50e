//! What is put into a simulated recording is found in it.

use super::{FittedReadout, SessionEstimates, SessionPair, fitted_profile};
use crate::compare::{recorded_image, replay};
use approx::assert_abs_diff_eq;
use spts_circuit::{Interpolated, Mode, Profile, Readout, Recording, Seeding};
use spts_eval::protocol::PLATEAU;
use spts_models::{ConductanceMap, SkinLayout, Streams};

const READOUT: &str = "weights = \"binary\"
sample_rate_hz = 64300.0
drive_v = 4.3
feedback_ohm = 1000.0
[compressive.late_updates]
rate = 0.001
period_measurements = 52.4
period_sd_measurements = 0.1
[compressive.drive_offset]
constant_v = -0.2
asymmetry = 0.01
[compressive.memory]
h1 = -0.02
h2 = -0.03
[compressive.contact_noise]
fraction = 0.06
[compressive.idle_noise]
sd_v = 0.08
[compressive.adc]
bits = 10
reference_v = 3.3
divider = 19.543859649122806
offset_v = 32.0
";

/// Volts of a converter's step: 3.3/1023 · 11140/570.
const STEP_V: f64 = 3.3 / 1023.0 * 11140.0 / 570.0;

/// Four presses of 25 taxels with 0.3 to 0.8 V, idle for 0.3 s and in full contact after 0.5 s.
fn recording(profile: &Profile) -> Recording {
    presses(profile, &[1.0; 4])
}

/// Presses as above, one a factor, with so much of the conductance.
fn presses(profile: &Profile, factors: &[f64]) -> Recording {
    let press = |factor: &f64| {
        let pressed = (0_u32..100).map(|k| {
            let volts = if k % 4 == 0 { 0.3 + 0.005 * f64::from(k) } else { 0.0 };
            factor * volts / profile.volts_per_siemens()
        });
        let (idle, pressed) = (ConductanceMap::zeros(10, 10), ConductanceMap::from_values(10, 10, pressed.collect()));
        Interpolated::new(vec![0.0, 0.3, 0.5], vec![idle.clone(), idle, pressed]).unwrap()
    };
    let mut readout = Readout::new(profile, Mode::Compressive, &SkinLayout::default(), Streams::new(5), 0).unwrap();
    let mut presses: Vec<Interpolated> = factors.iter().map(press).collect();
    let recording = readout.record(&mut presses, 1000 * 100, 57).unwrap();
    recording.with_idle_frames(Some(150))
}

fn pair(profile: &Profile) -> SessionPair {
    SessionPair {
        session: "synthetic".to_owned(),
        object: "synthetic".to_owned(),
        compressive: recording(profile),
        hold: PLATEAU,
        raster: None,
        slips: Vec::new(),
    }
}

#[test]
fn the_profile_and_the_replay_have_the_weights_and_the_rate_of_the_recording() {
    let mut profile = Profile::from_toml(READOUT).unwrap();
    (profile.seeding, profile.sample_rate_hz) = (Some(Seeding::Mixed), 50_000.0);
    profile.compressive.remove("late_updates");
    let pair = pair(&profile);
    let found = SessionEstimates::of(&pair, &pair.compressive, &[0]).unwrap();
    let (fitted, text) = fitted_profile(&FittedReadout::of(std::slice::from_ref(&found)), 100).unwrap();
    let lines = "weights = \"binary\"  # of the recordings\nseeding = \"mixed\"  # of the recordings\n";
    assert!(text.contains(lines), "{text}");
    assert_eq!(&fitted.weights(Mode::Compressive, 100).unwrap(), pair.compressive.weights());
    assert!(text.contains("\nsample_rate_hz = 50000.0  # kept: no beat seen\n"), "{text}");
    // a base profile seeds with the addresses: the replay's weights are those of the recording all the same
    let mut addressed = fitted;
    addressed.seeding = Some(Seeding::Address);
    let images = |block| recorded_image(&pair.compressive, block, &found, &addressed);
    let twin = replay(&pair.compressive, &[1], &images, &addressed, Streams::new(1), 0).unwrap();
    let twin = SessionEstimates::of(&pair, &twin, &[1]).unwrap();
    // Φ of other weights would leave nearly the whole output, 3 V
    assert!(twin.value("residual") < 0.6, "{}", twin.value("residual"));
}

#[test]
fn calibration_finds_what_was_put_in() {
    let pair = pair(&Profile::from_toml(READOUT).unwrap());
    let found = SessionEstimates::of(&pair, &pair.compressive, &[0, 1, 2, 3]).unwrap();
    let close = |name: &str, expected: f64, most: f64| {
        eprintln!("{name}: {} for {expected}", found.value(name));
        assert_abs_diff_eq!(found.value(name), expected, epsilon = most);
    };
    // a tap has a standard error of 0.25 V/(3 V·√60 000) = 0.0003; late updates add their rate to the first
    close("h1", -0.02, 0.0025);
    close("h2", -0.03, 0.0015);
    // noise and the converter's rounding; 60 000 samples have it to 0.3 %
    close("idle_noise", (0.08_f64.powi(2) + STEP_V.powi(2) / 12.0).sqrt(), 0.001);
    // 1.25 % of the samples carry a late flip, which lifts the median absolute value by 1.5 % and so the fraction by
    // 1.8 %; another 1 % from scatter and rounding
    close("contact_fraction", 0.06, 0.028 * 0.06);
    // Σx = 13.5 V. The mean of 15 000 samples of 0.25 V is known to 0.002 V a press, 0.001 V in four, so the asymmetry
    // to 0.00008: four times that. The memory passes 1 + h1 + h2 = 0.95 of what stands still; were that left out,
    // either would be 5 % small
    close("asymmetry", 0.01, 0.0003);
    // 0.08 V a sample: 0.0004 V; the errors of the taps above make less than 0.001 V of it
    close("constant", -0.2, 0.002);
    // counting some 3000 late flips a press, of which the smallest cannot be seen
    close("late_per_flip", 0.001, 0.0002);
    let step_v = found.steps.unwrap().step_v;
    assert_abs_diff_eq!(step_v, STEP_V, epsilon = 1e-9);
    assert!(found.faults.is_empty() && found.overdriven.is_empty(), "{:?}", found.faults);
}

/// The third of five presses hardly touches, the first has two thirds of the others: the one is left out and named, the
/// other is used. Without the one that missed, the session is what its other presses are.
#[test]
fn a_press_that_missed_is_left_out() {
    let profile = Profile::from_toml(READOUT).unwrap();
    let of = |factors: &[f64]| SessionPair { compressive: presses(&profile, factors), ..pair(&profile) };
    let with_miss = of(&[0.65, 1.0, 0.05, 1.0, 1.0]);
    let found = SessionEstimates::of(&with_miss, &with_miss.compressive, &[0, 1, 2, 3, 4]).unwrap();
    assert_eq!(found.presses, [1, 2, 4, 5]);
    assert_eq!(found.missed.iter().map(|m| m.press).collect::<Vec<_>>(), [3]);
    let said = found.missed[0].to_string();
    assert!(said.starts_with("press 3 missed and is left out: Σx 0.6"), "{said}");
    let others = SessionEstimates::of(&with_miss, &with_miss.compressive, &[0, 1, 3, 4]).unwrap();
    assert!(others.missed.is_empty());
    assert_eq!((found.numbers["h1"], &found.image_v), (others.numbers["h1"], &others.image_v));

    // a skin that is never touched has no press that missed
    let untouched = of(&[0.0; 3]);
    let found = SessionEstimates::of(&untouched, &untouched.compressive, &[0, 1, 2]).unwrap();
    assert!(found.missed.is_empty(), "{:?}", found.missed);
}
