//! The cells' converters against their own formula.

use crate::effects::assert_close;
use crate::readout::{press_v, profile, skin};
use spts_circuit::{Mode, Profile, Readout};
use spts_models::SkinLayout;
use spts_models::Streams;

fn dac(mode: &str, parameters: &str) -> String {
    format!("[{mode}.dac]\nreference_v = 4.34\n{parameters}")
}

fn analog(effects: &str) -> Profile {
    let mut profile = profile(effects);
    profile.weights = spts_circuit::CompressiveWeights::Analog;
    profile
}

fn volts(profile: &Profile, mode: Mode, x_v: &[f64], rows: usize) -> Vec<f64> {
    let mut readout = Readout::new(profile, mode, &SkinLayout::default(), Streams::new(3), 0).unwrap();
    readout.acquire(&mut skin(x_v), rows).unwrap().volts
}

/// Without nonlinearity a code becomes max(floor, c + offset + gain·c/255) steps, in every mode.
#[test]
fn offset_gain_and_floor_are_exact() {
    let parameters = "floor_v = 0.2\noffset_v = -0.01\ngain_lsb = -1.0\ninl_lsb = 0.0\ndnl_lsb = 0.0";
    let lsb_v = 4.34 / 256.0;
    let actual = |level: f64, code: f64| {
        let steps = f64::max(0.2 / lsb_v, code - 0.01 / lsb_v - code / 255.0);
        level + (steps - code) / 127.5
    };
    let x = press_v();
    let binary = profile(&dac("compressive", parameters));
    let analog = analog(&dac("compressive", parameters));
    let raster = profile(&dac("raster", parameters));
    for (profile, mode) in [
        (binary, Mode::Compressive),
        (analog, Mode::Compressive),
        (raster, Mode::Raster),
    ] {
        let weights = profile.weights(mode, 100).unwrap();
        for (y, row) in volts(&profile, mode, &x, 1000).iter().zip(0_u64..) {
            let level = |k: u32| {
                let level = weights.level(k, row);
                match mode {
                    Mode::Raster => actual(level, if level > 0.5 { 255.0 } else { 126.0 }),
                    Mode::Compressive => actual(level, (127.5 * (1.0 + level)).round()),
                }
            };
            let expected: f64 = (0_u32..100).zip(&x).map(|(k, x)| level(k) * x).sum();
            // a hundred roundings of values up to 10
            assert_close(*y, expected, 1000.0 * f64::EPSILON);
        }
    }
}

/// The floor alone makes the drive asymmetric: y gains half the error of the low level times Σx, less what the weights
/// lose.
#[test]
fn a_floor_is_an_asymmetry() {
    let parameters = "floor_v = 0.2\noffset_v = 0.0\ngain_lsb = 0.0\ninl_lsb = 0.0\ndnl_lsb = 0.0";
    let x = press_v();
    let (y, u) = (
        volts(&profile(&dac("compressive", parameters)), Mode::Compressive, &x, 1000),
        volts(&profile(""), Mode::Compressive, &x, 1000),
    );
    let half = 0.5 * 0.2 / (4.34 / 256.0) / 127.5;
    let sum: f64 = x.iter().sum();
    for (y, u) in y.iter().zip(&u) {
        assert_close(*y, (1.0 - half) * u + half * sum, 1000.0 * f64::EPSILON);
    }
}

/// The curve of one cell, code by code, from a skin of one taxel.
#[test]
fn nonlinearity_stays_within_its_bounds() {
    const INL: f64 = 0.3;
    const DNL: f64 = 0.25;
    let parameters = format!("floor_v = 0.0\noffset_v = 0.0\ngain_lsb = 0.0\ninl_lsb = {INL}\ndnl_lsb = {DNL}");
    let mut x = vec![0.0; 100];
    x[17] = 1.0;
    let profile = analog(&dac("compressive", &parameters));
    let weights = profile.weights(Mode::Compressive, 100).unwrap();
    let mut curve = [f64::NAN; 256];
    let y = volts(&profile, Mode::Compressive, &x, 20_000);
    for (code, error) in (0_u32..).zip(&mut curve) {
        let level = f64::from(code) / 127.5 - 1.0;
        for (y, row) in y.iter().zip(0_u64..) {
            if (weights.level(17, row) - level).abs() < 1e-9 {
                let found = 127.5 * (1.0 + y) - f64::from(code);
                // the same code gives the same output: 127.5 roundings of 1
                assert!(error.is_nan() || (*error - found).abs() < 1e-12);
                *error = found;
            }
        }
    }
    assert!(curve.iter().all(|e| e.is_finite()), "20 000 rows hold every code");
    assert!(curve[0].abs() < 1e-12 && curve[255].abs() < 1e-12);
    let worst = curve.iter().fold(0.0_f64, |w, e| w.max(e.abs()));
    let step = curve.windows(2).fold(0.0_f64, |w, e| w.max((e[1] - e[0]).abs()));
    assert!((INL - 0.5 * DNL..=INL + 0.5 * DNL).contains(&worst), "INL {worst}");
    assert!((0.5 * DNL..=DNL + 4.0 * INL / 255.0).contains(&step), "DNL {step}");
}

/// A faulty cell's own code goes through its converter: one that is stuck at level 1 drives as code 255 does.
#[test]
fn faulty_cells_have_converters_too() {
    let parameters = "floor_v = 0.2\noffset_v = [-0.04, 0.0]\ngain_lsb = [-10.0, 10.0]\ninl_lsb = 0.3\ndnl_lsb = 0.25";
    let mut x = vec![0.0; 100];
    x[40] = 1.0;
    let high = |profile: &Profile| {
        volts(profile, Mode::Compressive, &x, 300)
            .into_iter()
            .fold(f64::MIN, f64::max)
    };
    let sound = profile(&dac("compressive", parameters));
    let faulty = profile(&format!(
        "[[faults]]\nname = \"stuck\"\ntaxel = 40\n{}",
        dac("compressive", parameters)
    ));
    let expected = high(&sound);
    for y in volts(&faulty, Mode::Compressive, &x, 300) {
        assert_close(y, expected, 8.0 * f64::EPSILON);
    }
}

/// A cell's converter is a part: what codes 126 and 255 give in a raster scan of one session is what they give in
/// compressive rows of another, and another device's differ.
#[test]
fn sessions_and_modes_share_the_converters() {
    let parameters =
        "floor_v = 0.0\noffset_v = [-0.04, 0.0]\ngain_lsb = [-10.0, 10.0]\ninl_lsb = [-0.3, 0.3]\ndnl_lsb = 0.25";
    let profile = analog(&format!(
        "{}\n{}",
        dac("compressive", parameters),
        dac("raster", parameters)
    ));
    let weights = profile.weights(Mode::Compressive, 100).unwrap();
    let mut x = vec![0.0; 100];
    x[23] = 1.0;
    let level = |mode: Mode, device: u64, session: u64, row: usize| {
        let mut readout = Readout::new(&profile, mode, &SkinLayout::default(), Streams::new(device), session).unwrap();
        readout.acquire(&mut skin(&x), 20_000).unwrap().volts[row]
    };
    // codes 126 and 255 as errors of their levels; the raster counts 126 as level 0
    for (code, scan, nominal) in [(126.0, 0, 0.0), (255.0, 23, 1.0)] {
        let row_of_code = |row: &u64| (127.5 * (1.0 + weights.level(23, *row)) - code).abs() < 1e-6;
        let row = usize::try_from((0..20_000).find(row_of_code).unwrap()).unwrap();
        let raster = level(Mode::Raster, 3, 0, scan) - nominal;
        for session in [0, 1] {
            let compressive = level(Mode::Compressive, 3, session, row) - (code - 127.5) / 127.5;
            // roundings of values up to 1
            assert_close(compressive, raster, 16.0 * f64::EPSILON);
        }
        assert!((level(Mode::Raster, 4, 0, scan) - nominal - raster).abs() > 1e-6);
    }
}
