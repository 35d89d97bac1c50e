//! What each effect does is found again in what the readout recorded; every effect keeps what effects promise and
//! refuses nonsense; and leaving an effect out of a profile switches it off, and nothing else.

use crate::readout::{press_v, profile, samples, skin, start};
use nalgebra::{DMatrix, DVector};
use spts_circuit::{
    Adc, EFFECTS, EffectSession, Mode, Profile, Readout, Recording, Seeding, Slip, WeightMode, Weights, build_chain,
    check_effect,
};
use spts_models::{SkinLayout, Streams};

const MEASUREMENTS: usize = 100_000;

/// A recording with `effects` next to the ideal one of the same press.
fn against_ideal(effects: &str, mode: Mode) -> (Vec<f64>, Vec<f64>) {
    let acquire = |profile: &Profile| samples(profile, mode, 11, &press_v(), MEASUREMENTS);
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
    assert!(e <= tolerance, "found {found}, expected {expected}, error {e:e} > {tolerance:e}");
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
    let contact = sd(&error("[compressive.contact_noise]\nfraction = 0.06", Mode::Compressive));
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
    let run = |effects: &str| samples(&profile(effects), Mode::Compressive, 2, &x_v, 10 * MEASUREMENTS);
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
        let mut readout = start(&missing, Mode::Raster, 2);
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
        let same = volts(&slipped).iter().zip(volts(&sound)).all(|(a, b)| (a - b).abs() < 1e-9);
        assert_eq!(same, block == 0, "block {block}");
    }
}

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
        sample_rate_hz: 67e3,
        ..EffectSession::of(0, Weights::new(WeightMode::Binary, Seeding::Address, 100))
    };
    let error = |text: &str| build_chain(&toml::from_str(text).unwrap(), &session).map(|_| ()).unwrap_err().to_string();
    assert!(error("[hum]").contains("known: missed_clocks, late_updates, "));
    assert!(error("adc = 10").contains("expected a table"));
    assert!(error("[rails]\nlimit = 3.0").contains("limit"));
    for line in NONSENSE.trim().lines() {
        let [effect, parameters, field] = line.split(" | ").collect::<Vec<_>>()[..] else { panic!("{line}") };
        let message = error(&format!("[{effect}]\n{}", parameters.replace("; ", "\n")));
        assert!(message.contains(field) && message.contains("is outside"), "{line}: {message}");
    }
}

/// An effect, its parameters, and words of the error.
const NONSENSE: &str = "
rails | limit_v = nan | limit_v
rails | limit_v = -1.0 | limit_v
dac | reference_v = 4.34; floor_v = 3.0; offset_v = 0.0; gain_lsb = 0.0; inl_lsb = 0.0; dnl_lsb = 0.0 | .floor_v` = 3 is outside [0, 0.5·reference_v]
dac | reference_v = 4.34; floor_v = 0.2; offset_v = 0.0; gain_lsb = 0.0; inl_lsb = 0.0; dnl_lsb = 1.5 | .dnl_lsb` = 1.5 is outside [0, 1]
memory | h1 = 0.1; h2 = inf | h2
missed_clocks | probability = [0.0, 1.5] | .probability` = 1.5 is outside [0, 1]
missed_clocks | all_probability = -0.1 | .all_probability` = -0.1 is outside [0, 1]
missed_clocks | all_at = [{block = 1, edges = 1_000_001}] | .all_at[0].edges` = 1000001 is outside
memory | h1 = [0.2, 0.1]; h2 = 0.0 | h1
idle_noise | sd_v = -0.1 | sd_v
contact_noise | fraction = nan | fraction
drive_offset | constant_v = [0.0, nan]; asymmetry = 0.0 | constant_v
late_updates | rate = 0.5; period_measurements = 52.0; period_sd_measurements = 0.2 | rate
amplifier | update_s = 8e-6; sample_s = 16e-6 | sample_s
amplifier | update_s = 8e-6; sample_s = 7e-6 | update_s
amplifier | update_s = 0.0; sample_s = 1e-6; bus_f = -1e-9 | .bus_f` = -1e-9 is outside [0, 1]
amplifier | update_s = 0.0; sample_s = 1e-6; op_amp = { slew_v_per_s = 0.0 } | slew_v_per_s
amplifier | update_s = 0.0; sample_s = 1e-6; offset_v = [1e-3, -1e-3] | offset_v
adc | bits = 0; reference_v = 3.3; divider = 1.0; offset_v = 0.0 | bits
adc | bits = 10; reference_v = 2e3; divider = 1.0; offset_v = 0.0 | .reference_v` = 2000 is outside [1e-3, 1e3]
adc | bits = 10; reference_v = 3.3; divider = 2e3; offset_v = 0.0 | .divider` = 2000 is outside [1e-3, 1e3]
adc | bits = 10; reference_v = 3.3; divider = 1e-4; offset_v = 0.0 | .divider` = 0.0001 is outside [1e-3, 1e3]
adc | bits = 10; reference_v = 3.3; divider = 1.0; offset_v = -2e6 | .offset_v` = -2000000 is outside [−1e6, 1e6]
adc | bits = 10; reference_v = 1e300; divider = 1e300; offset_v = 0.0 | reference_v
rails | limit_v = 2e6 | .limit_v` = 2000000 is outside (0, 1e6]
clamp | subtract_v = -2e6 | .subtract_v` = -2000000 is outside [−1e6, 1e6]
late_updates | rate = 0.0; period_measurements = 1.5; period_sd_measurements = 0.0 | .period_measurements` = 1.5 is outside [2, 1e9)
late_updates | rate = 0.0; period_measurements = 50.0; period_sd_measurements = 6.0 | .period_sd_measurements` = 6 is outside [0, period_measurements/10]
";

/// Parameters with which each effect of `as_built` does nothing.
const NEUTRAL: &[(&str, &str)] = &[
    ("late_updates", "rate = 0.0\nperiod_measurements = 52.44\nperiod_sd_measurements = 0.2"),
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

fn pressed(profile: &Profile, mode: Mode) -> Vec<f64> {
    samples(profile, mode, 2, &press_v(), 10_000)
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
            assert!(pressed(&without, mode) == pressed(&neutral, mode), "{mode:?}: {name}");
            if name != "rails" {
                assert!(pressed(&without, mode) != pressed(&full, mode), "{mode:?}: {name} does nothing");
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
        for (y, u) in pressed(&full, mode).iter().zip(pressed(&analog, mode)) {
            let quantised = adc.volts(adc.code(u));
            let expected = subtract_v.map_or(quantised, |v| (quantised - v).max(0.0));
            assert_eq!(y.to_bits(), expected.to_bits(), "{mode:?}: {y} V, expected {expected} V");
        }
    }
}

// The cells' converters against their own formula.

fn dac(mode: &str, parameters: &str) -> String {
    format!("[{mode}.dac]\nreference_v = 4.34\n{parameters}")
}

fn analog(effects: &str) -> Profile {
    let mut profile = profile(effects);
    profile.weights = spts_circuit::CompressiveWeights::Analog;
    profile
}

fn volts(profile: &Profile, mode: Mode, x_v: &[f64], rows: usize) -> Vec<f64> {
    samples(profile, mode, 3, x_v, rows)
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
    for (profile, mode) in [(binary, Mode::Compressive), (analog, Mode::Compressive), (raster, Mode::Raster)] {
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
    let high = |profile: &Profile| volts(profile, Mode::Compressive, &x, 300).into_iter().fold(f64::MIN, f64::max);
    let sound = profile(&dac("compressive", parameters));
    let faulty = profile(&format!("[[faults]]\nname = \"stuck\"\ntaxel = 40\n{}", dac("compressive", parameters)));
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
    let profile = analog(&format!("{}\n{}", dac("compressive", parameters), dac("raster", parameters)));
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
