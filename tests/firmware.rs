//! The whole twin on the codes of emulated cells: recordings equal those with the model's weights byte for byte.

use crate::command::{files, succeeds};
use nalgebra::{DMatrix, DVector};
use spts::chain::{Acquisition, Chain, ChainConfig};
use spts_circuit::{CompressiveWeights, Mode, PROFILES, Patterns, Profile, Seeding, WeightMode, Weights};
use spts_contact::{Frame, Pose, Wrench};
use spts_models::{PressureMap, SkinLayout};
use std::path::Path;

/// A chain with weights from `weights`.
fn chain(weights: &str) -> Chain {
    let config = ChainConfig { weights: Some(weights.to_owned()), ..ChainConfig::default() };
    Chain::new(&config, &SkinLayout::default(), 4, Path::new("")).unwrap()
}

/// Pressure that grows and moves.
fn ramp() -> [Frame; 4] {
    [0_u32, 1, 2, 3].map(|k| {
        let pressure = |t: u32| f64::from(k * ((t * 7 + 31 * k) % 23)) * 1e3;
        let map = PressureMap::from_values(10, 10, (0..100).map(pressure).collect());
        Frame {
            time_s: 0.004 * f64::from(k),
            pressure: map.clone(),
            electrode_pressure: map,
            wrench: Wrench { force_n: [0.0; 3], torque_nm: [0.0; 3] },
            pose: Pose { position_m: [0.0; 3], quaternion: [1.0, 0.0, 0.0, 0.0] },
        }
    })
}

/// Twenty rows for a hundred taxels.
fn patterns() -> Patterns {
    let codes = (0..2000_usize).map(|k| if (k * k + k / 3) % 11 < 5 { 255 } else { 0 });
    Patterns::new(20, codes.collect()).unwrap()
}

/// Every profile as it is, with analog weights, with a pattern, and with mixed seeds, missed clocks and a list of
/// faults.
fn profiles() -> Vec<(String, Profile)> {
    let mut all = Vec::new();
    for (name, text) in PROFILES {
        let plain = Profile::named(name).unwrap();
        let analog = Profile { weights: CompressiveWeights::Analog, ..plain.clone() };
        let weights = Weights::with_patterns(WeightMode::Binary, patterns()).unwrap();
        let patterned = plain.with_weights(&weights).unwrap();
        let faults = ["mis_seeded", "overdriven", "skipping_clocks", "dead", "drifting"];
        let list: String = (40..)
            .zip(faults)
            .map(|(taxel, fault)| format!("[[faults]]\nname = \"{fault}\"\ntaxel = {taxel}\n"))
            .collect();
        let mut faulty = Profile::from_toml(&format!("{text}\n{list}")).unwrap();
        faulty.seeding = Some(Seeding::Mixed);
        for effects in [&mut faulty.compressive, &mut faulty.raster] {
            let missed = toml::from_str("probability = [0.0, 0.01]").unwrap();
            effects.insert("missed_clocks".to_owned(), toml::Value::Table(missed));
        }
        all.extend(
            [("plain", plain), ("analog", analog), ("pattern", patterned), ("faulty", faulty)]
                .map(|(v, p)| (format!("{name}, {v}"), p)),
        );
    }
    all
}

#[test]
fn recordings_do_not_tell_the_firmware_from_the_model() {
    let (model, firmware) = (chain("model"), chain("firmware"));
    let frames = ramp();
    for (name, profile) in profiles() {
        for mode in [Mode::Raster, Mode::Compressive] {
            let acquisition = Acquisition { lead_frames: 2, gap_frames: 3, ..Acquisition::presses(mode, 1) };
            let volts = |chain: &Chain| {
                let chain = chain.with_profile(profile.clone()).unwrap();
                let recording = chain.record(&[&frames, &frames], 0.008, &acquisition).unwrap();
                let blocks = recording.blocks().iter();
                let bits = blocks.map(|b| b.volts.iter().map(|v| v.to_bits()).collect::<Vec<_>>());
                bits.collect::<Vec<_>>()
            };
            assert!(volts(&firmware) == volts(&model), "{name}, {mode:?}");
        }
    }
}

/// A press from the command line, as it is recorded on the device: 243 frames before it and 1000 in it, in both modes;
/// at pseudorandom rows, and at twenty rows that repeat.
#[test]
fn a_press_does_not_tell_the_firmware_from_the_model() {
    for rows in [None, Some(patterns())] {
        press_tells_nothing(rows.as_ref());
    }
}

fn press_tells_nothing(rows: Option<&Patterns>) {
    let dir = tempfile::tempdir().unwrap();
    let mut pattern = Vec::new();
    if let Some(rows) = rows {
        std::fs::write(dir.path().join("rows.txt"), rows.to_text()).unwrap();
        pattern.extend(["--set", "rows.kind=pattern", "--set", "rows.patterns_file=rows.txt"]);
    }
    for weights in ["model", "firmware"] {
        let arguments =
            ["simulate", "press/T", "--presses", "1", "--seed", "3", "--weights", weights, "--out", weights];
        succeeds(dir.path(), &[&arguments[..], &pattern].concat());
    }
    let (model, firmware) = (files(&dir.path().join("model")), files(&dir.path().join("firmware")));
    assert_eq!(model.keys().collect::<Vec<_>>(), firmware.keys().collect::<Vec<_>>());
    // these say which it was, or how long it took
    const TOLD: [&str; 5] = ["manifest.json", "scene.toml", "session.json", "summary.json", "timing.json"];
    for (name, bytes) in &model {
        if !TOLD.contains(&name.as_str()) {
            assert!(*bytes == firmware[name], "{name} differs");
        }
    }
    // of the session, the hash of its scene alone
    let [model_session, firmware_session] = [&model, &firmware].map(|files| {
        let mut session: serde_json::Value = serde_json::from_slice(&files["session.json"]).unwrap();
        let hash = session["provenance"]["scene_hash"].take();
        assert!(hash.is_string(), "{session}");
        session
    });
    assert_eq!(model_session, firmware_session);
    if let Some(rows) = rows {
        // the recording carries its rows, and the scene beside it finds them
        let weights = &model_session["compressive"]["info"]["weights"];
        assert_eq!(weights["patterns"]["period"], 20, "{weights}");
        assert_eq!(model["patterns.txt"], rows.to_text().into_bytes());
        let scene = String::from_utf8(model["scene.toml"].clone()).unwrap();
        assert!(scene.contains("patterns_file = \"patterns.txt\""), "{scene}");
        succeeds(dir.path(), &["simulate", "model/scene.toml", "--out", "again"]);
        let name = "compressive_codes.npy";
        assert!(files(&dir.path().join("again"))[name] == model[name]);
    }
    for (name, files) in [("model", &model), ("firmware", &firmware)] {
        let scene = String::from_utf8(files["scene.toml"].clone()).unwrap();
        assert!(scene.contains(&format!("weights = \"{name}\"")), "{scene}");
        let summary: serde_json::Value = serde_json::from_slice(&files["summary.json"]).unwrap();
        assert_eq!(summary["weights"], name);
    }
}

/// The shipped cells follow 72 kHz, and nothing tells; at 400 kHz they lose every third edge, and what they record is
/// no longer the weights' measurement of anything: least squares explain as little of it as of noise. With binary
/// weights of 100 taxels and 400 measurements that is a quarter of the variance; at 72 kHz all of it.
#[test]
fn a_clock_that_is_too_fast_ruins_the_recording() {
    let unexplained = |edge_hz: f64| {
        let mut profile = Profile::named("ideal").unwrap();
        profile.sample_rate_hz = edge_hz;
        let config = ChainConfig {
            transducer: Some("linear".to_owned()),
            weights: Some("firmware".to_owned()),
            ..ChainConfig::default()
        };
        let chain = Chain::new(&config, &SkinLayout::default(), 0, Path::new("")).unwrap();
        let chain = chain.with_profile(profile).unwrap();
        // one pressure, held
        let still = [0.0, 1.0].map(|time_s| Frame { time_s, ..ramp()[3].clone() });
        let acquisition = Acquisition::presses(Mode::Compressive, 1);
        let recording = chain.record(&[&still[..]], 400.0 / edge_hz, &acquisition).unwrap();
        let phi = DMatrix::from_row_slice(400, 100, &recording.rows(0, 0..400).to_vec());
        let y = DVector::from_column_slice(&recording.blocks()[0].volts);
        let x = phi.clone().svd(true, true).solve(&y, 1e-9).unwrap();
        (&y - phi * x).norm_squared() / y.norm_squared()
    };
    let (sound, fast) = (unexplained(72e3), unexplained(400e3));
    assert!(sound < 1e-20, "{sound} unexplained at 72 kHz");
    assert!((0.5..1.0).contains(&fast), "{fast} unexplained at 400 kHz");
}

#[test]
fn lost_edges_are_noted() {
    let dir = tempfile::tempdir().unwrap();
    let mut profile: toml::Table = toml::from_str(PROFILES[0].1).unwrap();
    profile.insert("sample_rate_hz".to_owned(), toml::Value::Float(3.2e5));
    std::fs::write(dir.path().join("fast.toml"), profile.to_string()).unwrap();
    let scene = "weights = \"firmware\"\nreadout = \"fast.toml\"\n[skin]\nrows = 4\ncols = 4\n[press]\n\
                 object = \"T\"\npresses = 1";
    std::fs::write(dir.path().join("scene.toml"), scene).unwrap();
    let output = succeeds(dir.path(), &["simulate", "scene.toml", "--json", "--out", "out"]);
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(summary["notes"].to_string().contains("lost edges at 320000 Hz"), "{}", summary["notes"]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("lost edges"));
}
