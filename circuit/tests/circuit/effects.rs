//! What each effect does is found again in what the readout recorded.

use crate::readout::{press_v, profile, skin};
use nalgebra::{DMatrix, DVector};
use spts_circuit::{Mode, Profile, Readout, Recording, Slip};
use spts_models::SkinLayout;
use spts_models::Streams;

const MEASUREMENTS: usize = 100_000;

/// A recording with `effects` next to the ideal one of the same press.
fn against_ideal(effects: &str, mode: Mode) -> (Vec<f64>, Vec<f64>) {
    let acquire = |profile: &Profile| {
        let mut readout = Readout::new(profile, mode, &SkinLayout::default(), Streams::new(11), 0).unwrap();
        readout.acquire(&mut skin(&press_v()), MEASUREMENTS).unwrap().volts
    };
    (acquire(&profile(effects)), acquire(&profile("")))
}

fn error(effects: &str, mode: Mode) -> Vec<f64> {
    let (y, ideal) = against_ideal(effects, mode);
    y.iter().zip(&ideal).map(|(y, u)| y - u).collect()
}

fn mean(v: &[f64]) -> f64 {
    v.iter().sum::<f64>() / v.len() as f64
}

fn sd(v: &[f64]) -> f64 {
    let m = mean(v);
    mean(&v.iter().map(|x| (x - m).powi(2)).collect::<Vec<_>>()).sqrt()
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Relative standard error of a standard deviation from `n` Gaussian samples is 1/√(2n); five of them.
fn sd_tolerance(n: usize) -> f64 {
    5.0 / (2.0 * n as f64).sqrt()
}

/// Least-squares solution of rows · x ≈ y, by the normal equations.
pub(crate) fn least_squares(rows: &[Vec<f64>], y: &[f64]) -> DVector<f64> {
    let a = DMatrix::from_fn(rows.len(), rows[0].len(), |row, col| rows[row][col]);
    let right = a.tr_mul(&DVector::from_column_slice(y));
    a.tr_mul(&a).cholesky().unwrap().solve(&right)
}

pub(crate) fn assert_close(found: f64, expected: f64, tolerance: f64) {
    let e = (found - expected).abs();
    assert!(
        e <= tolerance,
        "found {found}, expected {expected}, error {e:e} > {tolerance:e}"
    );
}

#[test]
fn memory_taps_are_recovered() {
    let effects = "[compressive.memory]\nh1 = -0.03\nh2 = 0.015\n[compressive.idle_noise]\nsd_v = 0.08";
    let (y, u) = against_ideal(effects, Mode::Compressive);
    let rows: Vec<Vec<f64>> = (2..y.len()).map(|n| vec![u[n], u[n - 1], u[n - 2]]).collect();
    let h = least_squares(&rows, &y[2..]);
    // five standard errors of a regression coefficient: noise / (signal · √n)
    let tolerance = 5.0 * 0.08 / (sd(&u) * (MEASUREMENTS as f64).sqrt());
    assert_close(h[0], 1.0, tolerance);
    assert_close(h[1], -0.03, tolerance);
    assert_close(h[2], 0.015, tolerance);
}

#[test]
fn noise_levels_are_recovered() {
    let tolerance = sd_tolerance(MEASUREMENTS);
    let idle = sd(&error("[compressive.idle_noise]\nsd_v = 0.1", Mode::Compressive));
    assert_close(idle, 0.1, 0.1 * tolerance);
    let contact = sd(&error(
        "[compressive.contact_noise]\nfraction = 0.06",
        Mode::Compressive,
    ));
    let expected = 0.06 * norm(&press_v());
    assert_close(contact, expected, expected * tolerance);
    // in raster mode only the scanned taxel is driven, and only it is noisy
    let raster = error("[raster.contact_noise]\nfraction = 0.06", Mode::Raster);
    for k in [0, 40, 66] {
        let taxel: Vec<f64> = raster.iter().copied().skip(k).step_by(100).collect();
        let expected = 0.06 * press_v()[k];
        assert_close(sd(&taxel), expected, expected * sd_tolerance(taxel.len()));
    }
}

#[test]
fn late_updates_have_their_rate_size_and_beat() {
    let effects = "[compressive.late_updates]\nrate = 0.002\nperiod_measurements = 52.44\nperiod_sd_measurements = 0.0";
    let x = 0.5;
    let mut x_v = vec![0.0; 100];
    x_v[40] = x;
    let run = |effects: &str| {
        let mut readout = Readout::new(
            &profile(effects),
            Mode::Compressive,
            &SkinLayout::default(),
            Streams::new(2),
            0,
        )
        .unwrap();
        readout.acquire(&mut skin(&x_v), 10 * MEASUREMENTS).unwrap().volts
    };
    let (y, ideal) = (run(effects), run(""));
    let flips = ideal.windows(2).filter(|w| w[0] * w[1] < 0.0).count();
    let mut late = Vec::new();
    for (n, (y, u)) in y.iter().zip(&ideal).enumerate() {
        if (y - u).abs() > 1e-12 {
            assert_close(*y, ideal[n - 1], 4.0 * f64::EPSILON * x);
            late.push(n as f64);
        }
    }
    let expected = 0.002 * flips as f64;
    // counts of rare events: five Poisson standard deviations
    assert_close(late.len() as f64, expected, 5.0 * expected.sqrt());
    // every event is at the first measurement after a collision: φ + k·52.44 rounded up
    let phases: Vec<f64> = late.iter().map(|n| (n / 52.44).fract() * 52.44).collect();
    let (s, c) = phases.iter().fold((0.0, 0.0), |(s, c), p| {
        let a = std::f64::consts::TAU * p / 52.44;
        (s + a.sin(), c + a.cos())
    });
    let concentration = f64::hypot(s, c) / late.len() as f64;
    assert!(concentration > 0.99, "events are spread over the beat: {concentration}");
}

#[test]
fn offset_asymmetry_and_pattern_are_exact() {
    let sum: f64 = press_v().iter().sum();
    let effects = "[compressive.drive_offset]\nconstant_v = -0.2\nasymmetry = 0.02\n[compressive.clock_pattern]\namplitude_v = 0.1";
    for (n, e) in error(effects, Mode::Compressive).iter().enumerate() {
        let pattern = if n % 2 == 0 { 0.1 } else { -0.1 };
        // a handful of roundings of volts of order 10
        assert_close(*e, -0.2 + 0.02 * sum + pattern, 100.0 * f64::EPSILON);
    }
}

#[test]
fn the_next_scanned_taxel_undershoots() {
    let e = error("[raster.memory]\nh1 = -0.06\nh2 = 0.015", Mode::Raster);
    let x = press_v();
    // taxels 67 and 68 follow the last pressed one
    assert_close(e[67], -0.06 * x[66] + 0.015 * x[65], 8.0 * f64::EPSILON);
    assert_close(e[68], 0.015 * x[66], 8.0 * f64::EPSILON);
}

#[test]
fn volts_lie_on_the_converter_s_grid() {
    for (mode, offset, lsb) in [
        (Mode::Compressive, 32.0, 3.3 / 1023.0 * 11140.0 / 570.0),
        (Mode::Raster, 4.4, 3.3 / 1023.0 * 508.0 / 165.0),
    ] {
        let mut readout = Readout::new(
            &Profile::named("as_built").unwrap(),
            mode,
            &SkinLayout::default(),
            Streams::new(0),
            0,
        )
        .unwrap();
        for y in readout.acquire(&mut skin(&press_v()), 10_000).unwrap().volts {
            let code = (offset - y) / lsb;
            // cut-off raster values are 0 exactly; the others are 0.1 V up because a constant is subtracted
            assert!(
                y.abs() < 1e-300 || (code - code.round()).abs() < 1e-9,
                "{mode:?}: {y} V is between codes"
            );
        }
    }
}

#[test]
fn rails_hold() {
    let (y, u) = against_ideal("[compressive.rails]\nlimit_v = 2.0", Mode::Compressive);
    assert!(u.iter().any(|u| u.abs() > 2.0));
    for (y, u) in y.iter().zip(&u) {
        assert_close(*y, u.clamp(-2.0, 2.0), 0.0);
    }
}

/// In a raster scan a cell that has missed n edges answers n measurements late. After R edges it has missed R·p of
/// them, p between 0 and 2e-4: over a hundred cells as many as the sum of their p says, to which their spread adds
/// R·2e-4/√12 a cell.
#[test]
fn missed_clocks_add_up_to_their_rate() {
    const SKIPPED: u64 = 1000;
    let missing = profile("[raster.missed_clocks]\nprobability = [0.0, 2e-4]");
    let (mut missed, mut late) = (0.0, 0);
    for taxel in 0..100 {
        let mut x = vec![0.0; 100];
        x[taxel] = 1.0;
        let mut readout = Readout::new(&missing, Mode::Raster, &SkinLayout::default(), Streams::new(2), 0).unwrap();
        readout.skip(SKIPPED);
        let y = readout.acquire(&mut skin(&x), 300).unwrap().volts;
        let answer = y.iter().rposition(|y| *y > 0.5).unwrap();
        // at most 20 ± 5 edges are missed: less than a frame
        let lag = (answer + 100 - taxel) % 100;
        missed += lag as f64;
        late += usize::from(lag > 0);
    }
    let edges = 100.0 * SKIPPED as f64;
    let per_cell = edges * 1e-4;
    // five standard deviations of a hundred cells: counting, and the spread of the cells' probabilities
    let sd = (100.0 * (per_cell + (edges * 2e-4).powi(2) / 12.0)).sqrt();
    assert_close(missed, 100.0 * per_cell, 5.0 * sd);
    assert!(late > 80, "{late} cells lag");
}

/// Where all cells miss edges, the sums are those of earlier rows, and a recording that is put back on its rows is the
/// one without the fault, but for the samples that are lost. Sums in another order differ by a few roundings.
#[test]
fn edges_that_all_cells_miss_shift_the_rows() {
    let missing = "[compressive.missed_clocks]\nprobability = 0.0\nall_at = [{block = 1, edges = 34}, \
                   {block = 2, measurement = 3001, edges = -35}]";
    let record = |text: &str| {
        let mut presses = vec![skin(&press_v()), skin(&press_v()), skin(&press_v())];
        let streams = Streams::new(2);
        let mut readout = Readout::new(&profile(text), Mode::Compressive, &SkinLayout::default(), streams, 0).unwrap();
        readout.record(&mut presses, 6000, 7).unwrap()
    };
    let (sound, slipped) = (record(""), record(missing));
    let slip = |block, from, rows| Slip { block, from, rows };
    let aligned = slipped.realigned(&[slip(1, 0, 34), slip(2, 0, 34), slip(2, 3001, -1)]);
    for (block, lost) in [(0, 0), (1, 34), (2, 35)] {
        let volts = |recording: &Recording| recording.blocks()[block].volts.clone();
        let found = volts(&aligned);
        assert_eq!(found.iter().filter(|v| v.is_nan()).count(), lost, "block {block}");
        for (found, expected) in found.iter().zip(volts(&sound)).filter(|(found, _)| !found.is_nan()) {
            assert_close(*found, expected, 1e-9);
        }
        let same = volts(&slipped)
            .iter()
            .zip(volts(&sound))
            .all(|(a, b)| (a - b).abs() < 1e-9);
        assert_eq!(same, block == 0, "block {block}");
    }
}
