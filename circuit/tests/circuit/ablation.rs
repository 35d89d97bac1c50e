//! Leaving an effect out of a profile switches it off, and nothing else.

use crate::readout::{press_v, skin};
use spts_circuit::{Adc, Mode, Profile, Readout};
use spts_models::SkinLayout;
use spts_models::Streams;

/// Parameters with which each effect of `as_built` does nothing.
const NEUTRAL: &[(&str, &str)] = &[
    (
        "late_updates",
        "rate = 0.0\nperiod_measurements = 52.44\nperiod_sd_measurements = 0.2",
    ),
    ("drive_offset", "constant_v = 0.0\nasymmetry = 0.0"),
    ("memory", "h1 = 0.0\nh2 = 0.0"),
    ("clock_pattern", "amplitude_v = 0.0"),
    ("contact_noise", "fraction = 0.0"),
    ("idle_noise", "sd_v = 0.0"),
    ("rails", "limit_v = 1e6"),
];
/// What follows on the rails has no neutral parameters.
const LAST: [&str; 2] = ["adc", "clamp"];

fn chain(profile: &mut Profile, mode: Mode) -> &mut toml::Table {
    match mode {
        Mode::Raster => &mut profile.raster,
        Mode::Compressive => &mut profile.compressive,
    }
}

fn volts(profile: &Profile, mode: Mode) -> Vec<f64> {
    let mut readout = Readout::new(profile, mode, &SkinLayout::default(), Streams::new(2), 0).unwrap();
    readout.acquire(&mut skin(&press_v()), 10_000).unwrap().volts
}

/// Noise and draws of the other effects stay what they were, bit for bit.
#[test]
fn leaving_out_is_switching_off() {
    for mode in [Mode::Compressive, Mode::Raster] {
        let full = Profile::named("as_built").unwrap();
        for name in chain(&mut full.clone(), mode).keys() {
            let Some((_, parameters)) = NEUTRAL.iter().find(|(known, _)| known == name) else {
                assert!(LAST.contains(&name.as_str()), "{name} has no neutral parameters");
                continue;
            };
            let (mut without, mut neutral) = (full.clone(), full.clone());
            chain(&mut without, mode).remove(name);
            let parameters: toml::Table = toml::from_str(parameters).unwrap();
            chain(&mut neutral, mode).insert(name.clone(), parameters.into());
            assert!(volts(&without, mode) == volts(&neutral, mode), "{mode:?}: {name}");
            if name != "rails" {
                assert!(
                    volts(&without, mode) != volts(&full, mode),
                    "{mode:?}: {name} does nothing"
                );
            }
        }
    }
}

/// Converter and clamp act on the finished output and on nothing else.
#[test]
fn converter_and_clamp_are_functions_of_the_output() {
    for mode in [Mode::Compressive, Mode::Raster] {
        let full = Profile::named("as_built").unwrap();
        let mut analog = full.clone();
        let adc: Adc = chain(&mut analog, mode).remove("adc").unwrap().try_into().unwrap();
        let clamp = chain(&mut analog, mode).remove("clamp");
        let subtract_v = clamp.map(|c| c["subtract_v"].as_float().unwrap());
        for (y, u) in volts(&full, mode).iter().zip(volts(&analog, mode)) {
            let quantised = adc.volts(adc.code(u));
            let expected = subtract_v.map_or(quantised, |v| (quantised - v).max(0.0));
            assert_eq!(
                y.to_bits(),
                expected.to_bits(),
                "{mode:?}: {y} V, expected {expected} V"
            );
        }
    }
}
