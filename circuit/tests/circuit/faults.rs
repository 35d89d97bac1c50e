//! What a faulty cell does, against sums with its own levels.

use crate::effects::assert_close;
use crate::readout::{press_v, profile, skin, start};
use spts_circuit::{Mode, Profile, WeightMode, Weights};

const ROWS: usize = 2000;

fn volts(profile: &Profile, mode: Mode, skip: u64) -> Vec<f64> {
    let mut readout = start(profile, mode, 11);
    readout.skip(skip);
    readout.acquire(&mut skin(&press_v()), ROWS).unwrap().volts
}

/// Recording equals Σ level·gain·x in both modes, at the start and far into a session.
fn assert_forward(fault: &str, factor: impl Fn(&Weights, u32, u64) -> f64) {
    let x = press_v();
    let faulty = profile(&format!("[[faults]]\n{fault}"));
    for mode in [Mode::Compressive, Mode::Raster] {
        let weights = faulty.weights(mode, 100).unwrap();
        for skip in [0, 1_000_000] {
            for (y, row) in volts(&faulty, mode, skip).iter().zip(100 * skip..) {
                let factors: Vec<f64> = (0..100).map(|k| factor(&weights, k, row)).collect();
                let expected: f64 = factors.iter().zip(&x).map(|(factor, x)| factor * x).sum();
                // a hundred roundings of values up to 10, times a gain that may be large after 1555 s
                let most = factors.iter().fold(1.0, |most, factor| factor.abs().max(most));
                assert_close(*y, expected, 1000.0 * f64::EPSILON * most);
            }
        }
    }
}

#[test]
fn a_cell_that_never_leaves_a_level_drives_it() {
    for (fault, taxel, level) in [
        ("name = \"dead\"\ntaxel = 40", 40, 0.0),
        ("name = \"stuck\"\ntaxel = 40", 40, 1.0),
        ("name = \"stuck\"\ntaxel = 66\nlevel = -0.25", 66, -0.25),
        ("name = \"detached\"\ntaxel = 40", 40, 0.0),
        ("name = \"skipping_clocks\"\ntaxel = 50\nprobability = 1.0", 50, 0.0),
    ] {
        assert_forward(fault, |w, k, row| if k == taxel { level } else { w.level(k, row) });
    }
}

#[test]
fn a_mis_seeded_cell_runs_on_its_own_sequence() {
    assert_forward("name = \"mis_seeded\"\ntaxel = 56", |w, k, row| {
        if k == 56 && w.mode() != WeightMode::Raster { w.mode().level_from_seed(2, row) } else { w.level(k, row) }
    });
}

/// In a raster scan a cell that has missed n edges answers n measurements late.
#[test]
fn a_skipping_cell_answers_late_in_the_raster() {
    let faulty = profile("[[faults]]\nname = \"skipping_clocks\"\ntaxel = 50\nprobability = 0.001");
    let y = volts(&faulty, Mode::Raster, 1000);
    let (x, sound) = (press_v(), volts(&profile(""), Mode::Raster, 1000));
    let late: Vec<usize> = (0..ROWS).filter(|n| (y[*n] - sound[*n] - x[50]).abs() < 1e-12).collect();
    // about 100 misses after 100 000 edges: modulo 100 any place, but one answer a frame
    assert!((18..=21).contains(&late.len()), "{} answers in 20 frames", late.len());
}

#[test]
fn a_drifting_taxel_changes_at_its_rate() {
    for rate in [-0.01, 0.3] {
        let fault = format!("name = \"drifting\"\ntaxel = 40\nrate_per_s = {rate:?}");
        assert_forward(&fault, |w, k, row| {
            let gain = (1.0 + rate * row as f64 / 64_300.0).max(0.0);
            w.level(k, row) * if k == 40 { gain } else { 1.0 }
        });
    }
}

#[test]
fn a_detached_taxel_is_not_there() {
    // neither in Σx nor in the noise: the skin without it gives the same recording
    let effects =
        "[compressive.drive_offset]\nconstant_v = 0.1\nasymmetry = 0.3\n[compressive.contact_noise]\nfraction = 0.1";
    let with = profile(&format!("[[faults]]\nname = \"detached\"\ntaxel = 40\n{effects}"));
    let mut x = press_v();
    x[40] = 0.0;
    let mut without = start(&profile(effects), Mode::Compressive, 11);
    let expected = without.acquire(&mut skin(&x), ROWS).unwrap().volts;
    for (y, expected) in volts(&with, Mode::Compressive, 0).iter().zip(&expected) {
        // roundings of sums of a hundred values up to 10, and of the norm's difference of squares
        assert_close(*y, *expected, 1000.0 * f64::EPSILON);
    }
}

/// A late update of a cell that never changes is none.
#[test]
fn effects_see_the_faulty_levels() {
    let late = "[compressive.late_updates]\nrate = 0.009\nperiod_measurements = 52.44\nperiod_sd_measurements = 0.2";
    let mut x = vec![0.0; 100];
    x[7] = 1.0;
    let faulty = profile(&format!("[[faults]]\nname = \"stuck\"\ntaxel = 7\n{late}"));
    let mut readout = start(&faulty, Mode::Compressive, 1);
    let y = readout.acquire(&mut skin(&x), 20_000).unwrap().volts;
    // the very first measurement may be late: before it the cell was at mid-scale
    assert!(y[1..].iter().all(|y| (y - 1.0).abs() < 4.0 * f64::EPSILON));
}

/// Missed clocks leave a cell alone whose level a fault decides, and a taxel that only its gain is wrong of keeps that
/// gain.
#[test]
fn missed_clocks_respect_faults() {
    let missed = "[compressive.missed_clocks]\nprobability = 0.3";
    let mut x = vec![0.0; 100];
    x[7] = 1.0;
    let run = |fault: &str, effects: &str| {
        let profile = profile(&format!("{fault}\n{effects}"));
        let mut readout = start(&profile, Mode::Compressive, 1);
        readout.acquire(&mut skin(&x), 1000).unwrap().volts
    };
    let on_taxel = |name: &str| format!("[[faults]]\nname = \"{name}\"\ntaxel = 7");
    for name in ["stuck", "mis_seeded"] {
        assert!(run(&on_taxel(name), missed) == run(&on_taxel(name), ""), "{name}");
    }
    let drifting = format!("{}\nrate_per_s = -10.0", on_taxel("drifting"));
    let (gone, lagging) = (run(&drifting, missed), run("", missed));
    assert!(lagging != run("", ""));
    for ((y, u), row) in gone.iter().zip(&lagging).zip(0_u64..) {
        let gain = 1.0 - 10.0 * row as f64 / 64_300.0;
        assert_close(*y, gain * u, 8.0 * f64::EPSILON);
    }
}
