//! Every effect of the table keeps what effects promise, and refuses nonsense.

use spts_circuit::{EFFECTS, EffectSession, Profile, Seeding, WeightMode, Weights, build_chain, check_effect};
use spts_models::Streams;

/// The parameters of `as_built`, or of `as_designed` for what only that has, for the DAC the limits of its data sheet,
/// and for missed clocks so many that no cell stays in step.
fn parameters(name: &str) -> toml::Table {
    if name == "dac" {
        return toml::from_str(DATA_SHEET).unwrap();
    }
    if name == "missed_clocks" {
        return toml::from_str("probability = [0.0, 0.3]").unwrap();
    }
    let [built, designed] = ["as_built", "as_designed"].map(|name| Profile::named(name).unwrap());
    let tables = [&built.compressive, &built.raster, &designed.compressive];
    let table = tables.iter().find_map(|effects| effects.get(name)).unwrap();
    table.as_table().unwrap().clone()
}

const DATA_SHEET: &str = "reference_v = 4.34\nfloor_v = 0.2\noffset_v = [-0.04, 0.0]\ngain_lsb = [-10.0, 10.0]\n\
                          inl_lsb = [-1.2, 1.2]\ndnl_lsb = 1.0";

#[test]
fn every_effect_conforms() {
    for (name, build) in EFFECTS {
        eprintln!("{name}");
        check_effect(&|session| build(parameters(name), session).unwrap());
    }
    // all cells together, by chance and at places of both signs, beside edges that cells miss on their own
    let all = "probability = [0.0, 0.3]\nall_probability = 0.01\nall_at = [{block = 0, edges = 34}, \
               {block = 5, measurement = 501, edges = -2}, {block = 5, measurement = 700, edges = 500}]";
    let (_, build) = EFFECTS.iter().find(|(name, _)| *name == "missed_clocks").unwrap();
    check_effect(&|session| build(toml::from_str(all).unwrap(), session).unwrap());
}

#[test]
fn nonsense_is_refused_with_its_name() {
    let session = EffectSession {
        device: Streams::new(0),
        streams: Streams::new(0),
        weights: Weights::new(WeightMode::Binary, Seeding::Address, 100),
        feedback_ohm: 1e3,
        sample_rate_hz: 67e3,
    };
    let error = |text: &str| {
        build_chain(&toml::from_str(text).unwrap(), &session)
            .map(|_| ())
            .unwrap_err()
            .to_string()
    };
    assert!(error("[hum]").contains("known: missed_clocks, late_updates, "));
    assert!(error("adc = 10").contains("expected a table"));
    assert!(error("[rails]\nlimit = 3.0").contains("limit"));
    for (text, field) in [
        ("[rails]\nlimit_v = nan", "limit_v"),
        ("[rails]\nlimit_v = -1.0", "limit_v"),
        (
            "[dac]\nreference_v = 4.34\nfloor_v = 3.0\noffset_v = 0.0\ngain_lsb = 0.0\ninl_lsb = 0.0\ndnl_lsb = 0.0",
            ".floor_v` = 3 is outside [0, 0.5·reference_v]",
        ),
        (
            "[dac]\nreference_v = 4.34\nfloor_v = 0.2\noffset_v = 0.0\ngain_lsb = 0.0\ninl_lsb = 0.0\ndnl_lsb = 1.5",
            ".dnl_lsb` = 1.5 is outside [0, 1]",
        ),
        ("[memory]\nh1 = 0.1\nh2 = inf", "h2"),
        (
            "[missed_clocks]\nprobability = [0.0, 1.5]",
            ".probability` = 1.5 is outside [0, 1]",
        ),
        (
            "[missed_clocks]\nall_probability = -0.1",
            ".all_probability` = -0.1 is outside [0, 1]",
        ),
        (
            "[missed_clocks]\nall_at = [{block = 1, edges = 1_000_001}]",
            ".all_at[0].edges` = 1000001 is outside",
        ),
        ("[memory]\nh1 = [0.2, 0.1]\nh2 = 0.0", "h1"),
        ("[idle_noise]\nsd_v = -0.1", "sd_v"),
        ("[contact_noise]\nfraction = nan", "fraction"),
        ("[drive_offset]\nconstant_v = [0.0, nan]\nasymmetry = 0.0", "constant_v"),
        (
            "[late_updates]\nrate = 0.5\nperiod_measurements = 52.0\nperiod_sd_measurements = 0.2",
            "rate",
        ),
        ("[amplifier]\nupdate_s = 8e-6\nsample_s = 16e-6", "sample_s"),
        ("[amplifier]\nupdate_s = 8e-6\nsample_s = 7e-6", "update_s"),
        (
            "[amplifier]\nupdate_s = 0.0\nsample_s = 1e-6\nbus_f = -1e-9",
            ".bus_f` = -1e-9 is outside [0, 1]",
        ),
        (
            "[amplifier]\nupdate_s = 0.0\nsample_s = 1e-6\nop_amp = { slew_v_per_s = 0.0 }",
            "slew_v_per_s",
        ),
        (
            "[amplifier]\nupdate_s = 0.0\nsample_s = 1e-6\noffset_v = [1e-3, -1e-3]",
            "offset_v",
        ),
        (
            "[adc]\nbits = 0\nreference_v = 3.3\ndivider = 1.0\noffset_v = 0.0",
            "bits",
        ),
        (
            "[adc]\nbits = 10\nreference_v = 2e3\ndivider = 1.0\noffset_v = 0.0",
            ".reference_v` = 2000 is outside [1e-3, 1e3]",
        ),
        (
            "[adc]\nbits = 10\nreference_v = 3.3\ndivider = 2e3\noffset_v = 0.0",
            ".divider` = 2000 is outside [1e-3, 1e3]",
        ),
        (
            "[adc]\nbits = 10\nreference_v = 3.3\ndivider = 1e-4\noffset_v = 0.0",
            ".divider` = 0.0001 is outside [1e-3, 1e3]",
        ),
        (
            "[adc]\nbits = 10\nreference_v = 3.3\ndivider = 1.0\noffset_v = -2e6",
            ".offset_v` = -2000000 is outside [−1e6, 1e6]",
        ),
        (
            "[adc]\nbits = 10\nreference_v = 1e300\ndivider = 1e300\noffset_v = 0.0",
            "reference_v",
        ),
        ("[rails]\nlimit_v = 2e6", ".limit_v` = 2000000 is outside (0, 1e6]"),
        (
            "[clamp]\nsubtract_v = -2e6",
            ".subtract_v` = -2000000 is outside [−1e6, 1e6]",
        ),
        (
            "[late_updates]\nrate = 0.0\nperiod_measurements = 1.5\nperiod_sd_measurements = 0.0",
            ".period_measurements` = 1.5 is outside [2, 1e9)",
        ),
        (
            "[late_updates]\nrate = 0.0\nperiod_measurements = 50.0\nperiod_sd_measurements = 6.0",
            ".period_sd_measurements` = 6 is outside [0, period_measurements/10]",
        ),
    ] {
        let message = error(text);
        assert!(
            message.contains(field) && message.contains("is outside"),
            "{text}: {message}"
        );
    }
}
