//! Properties that every transducer must have.

use crate::layout::{ConductanceMap, PressureMap, SkinLayout};
use crate::snapshot::Snapshot;
use crate::transducer::Transducer;

/// Makes a fresh transducer for a skin.
type Build<'a> = &'a dyn Fn(&SkinLayout) -> Box<dyn Transducer>;
/// Pressure everywhere, Pa, and how long it acts, s.
type Hold = (f64, f64);

/// Steps of time, s: none, a nanosecond, …, an hour.
const STEPS_S: [f64; 7] = [0.0, 1e-9, 1e-6, 1e-3, 1.0, 60.0, 3600.0];
/// Pressures, Pa, from the smallest to a gigapascal.
const PRESSURES_PA: [f64; 9] = [1e-300, 1.0, 50.0, 150.0, 1e3, 1e4, 1e5, 1e6, 1e9];

/// Relative tolerance of a hold cut into a thousand steps: a thousand roundings of 1.1e-16, with a factor of ten to
/// spare.
const SPLIT_TOLERANCE: f64 = 1e-12;
/// Relative tolerance of an order: two relaxations from different states to different targets round differently, by
/// some units in the last place a branch and step.
const ORDER_TOLERANCE: f64 = 1e-12;

/// Checks the properties that every transducer must have. `build` makes a fresh transducer for a skin.
///
/// - The conductance is finite and not negative for pressures of 0…1 GPa and time steps of 0 and 1 ns…1 h, from rest
///   and after a load. It increases with the pressure.
/// - Of two pressure histories, one of which is never below the other, the larger gives the larger conductance.
/// - Dividing a hold into several steps does not change the result, within any waveform.
/// - Passive: over a closed path of pressure, after one cycle that also closes the state, ∮ P dG ≥ 0. The conductance
///   follows the pressure and never leads it.
/// - A taxel that is not pressed and has rested does not conduct. A step of zero time repeats the last value. Negative
///   pressure and NaN count as zero.
/// - What it remembers can be saved and loaded: a fresh one that loads the state goes on with the same bits.
/// - Equal builds give equal bits. A session does not depend on earlier sessions. A fresh transducer is in session 0.
///
/// ```
/// use spts_models::{Streams, build_transducer, check_transducer};
///
/// // a transducer of your own passes the same checks
/// check_transducer(&|skin| {
///     build_transducer("linear", toml::Table::new(), skin, Streams::new(1)).expect("defaults are valid")
/// });
/// ```
///
/// # Panics
/// If the transducer lacks a property; the message holds the numbers.
pub fn check_transducer(build: &dyn Fn(&SkinLayout) -> Box<dyn Transducer>) {
    let skin = SkinLayout::default();
    check_extremes(build, &skin);
    check_rest(build, &skin);
    check_repeats(build, &skin);
    check_sessions(build, &skin);
    check_touched(build, &skin);
    for (name, wave) in waveforms() {
        for pieces in [&[0.5, 0.5][..], &[1e-9, 0.3, 1e-6, 0.7], &[1e-3; 1000]] {
            check_cut(build, &skin, name, &wave, pieces);
        }
        let more: Vec<Hold> = wave.iter().map(|(p, dt_s)| (1.5 * p + 10.0, *dt_s)).collect();
        check_order(build, &skin, name, &wave, &more);
        check_state(build, &skin, name, &wave);
        let corners_pa: Vec<f64> = wave.iter().map(|(p, _)| *p).collect();
        check_passive(build, &skin, name, &corners_pa);
    }
}

/// Waveforms of one press each, above any threshold of touch throughout.
fn waveforms() -> Vec<(&'static str, Vec<Hold>)> {
    let sine = |n: u32, dt_s: f64| {
        let angle = move |k| std::f64::consts::PI * (f64::from(k) + 0.5) / f64::from(n);
        (0..n).map(move |k| (1e3 + 5e4 * f64::sin(angle(k)), dt_s))
    };
    let minor = [1e4, 6e4, 3e4, 5e4, 2e4, 9e4, 8e4, 8.5e4, 1e3];
    vec![
        ("hold", vec![(2e4, 0.5), (5e3, 1.0)]),
        ("nanosecond", vec![(2e4, 1e-9), (4e4, 1e-9), (1e3, 1e-9)]),
        ("hour", vec![(2e4, 3600.0), (1e3, 3600.0)]),
        ("square", [(5e4, 0.02), (1e3, 0.02)].repeat(5)),
        ("stairs", (1..=10).map(|k| (3e3 * f64::from(k), 0.1)).collect()),
        ("impact of 8 ms", sine(16, 0.5e-3).collect()),
        ("press", sine(20, 0.1).collect()),
        ("minor loops", minor.map(|p| (p, 3e-3)).to_vec()),
        ("gigapascal", vec![(1e9, 1e-3), (1e3, 1.0), (1e9, 10.0), (1e3, 1e-6)]),
    ]
}

/// Conductance of all taxels after each of `holds`, S.
fn run(build: Build<'_>, skin: &SkinLayout, holds: &[Hold]) -> Vec<ConductanceMap> {
    let mut transducer = build(skin);
    steps(transducer.as_mut(), skin, holds)
}

fn steps(transducer: &mut dyn Transducer, skin: &SkinLayout, holds: &[Hold]) -> Vec<ConductanceMap> {
    let (rows, cols) = (skin.rows(), skin.cols());
    let step = |(p, dt_s): &Hold| {
        let pressure = PressureMap::from_values(rows, cols, vec![*p; skin.taxels()]);
        let mut out = ConductanceMap::zeros(rows, cols);
        transducer.step(&pressure, *dt_s, &mut out);
        out
    };
    holds.iter().map(step).collect()
}

/// Conductance of all taxels after the last of `holds`, S.
fn end(build: Build<'_>, skin: &SkinLayout, holds: &[Hold]) -> Vec<f64> {
    run(build, skin, holds).pop().map_or_else(Vec::new, |map| map.values().to_vec())
}

/// Steps of the touched taxels alone are those of the skin; a taxel that was left alone may differ by the roundings of
/// its steps and by what it takes for nothing.
fn check_touched(build: Build<'_>, skin: &SkinLayout) {
    let (mut whole, mut touched) = (build(skin), build(skin));
    let (mut map, mut some) = (ConductanceMap::zeros(skin.rows(), skin.cols()), Vec::new());
    for n in 0_u32..400 {
        // two contacts that come and go, one of them every other step
        let pressed: Vec<(u32, f64)> = (0_u32..100)
            .filter(|k| k / 10 == n / 40 || *k == 55 && n % 2 == 0 || *k == 77 && !(50..300).contains(&n))
            .map(|k| (k, 1e3 * f64::from(1 + (k * 7 + n * 3) % 40)))
            .collect();
        let mut pressure = PressureMap::zeros(skin.rows(), skin.cols());
        pressed.iter().for_each(|(k, pa)| pressure.values_mut()[*k as usize] = *pa);
        let dt_s = [1e-3, 0.02, 1e-4][n as usize % 3];
        whole.step(&pressure, dt_s, &mut map);
        if !touched.step_touched(&pressed, dt_s, &mut some) {
            return;
        }
        let mut found = vec![0.0; skin.taxels()];
        some.iter().for_each(|(k, g)| found[*k as usize] = *g);
        for (k, (g, expected)) in found.iter().zip(map.values()).enumerate() {
            let off = (g - expected).abs();
            assert!(off <= 1e-12 * expected + 1e-24, "step {n}: taxel {k} conducts {g} S, {expected} in a whole step");
        }
    }
}

fn check_state(build: Build<'_>, skin: &SkinLayout, name: &str, wave: &[Hold]) {
    let (before, after) = wave.split_at(wave.len() / 2);
    let (mut original, mut copy) = (build(skin), build(skin));
    steps(original.as_mut(), skin, before);
    let mut saving = Snapshot::saving();
    original.exchange(&mut saving);
    let mut loading = Snapshot::loading(saving.finish().expect("nothing to compare"));
    copy.exchange(&mut loading);
    loading.finish().expect("as much is loaded as was saved");
    let same = steps(original.as_mut(), skin, after) == steps(copy.as_mut(), skin, after);
    assert!(same, "{name}: a copy by its saved state differs");
}

fn check_extremes(build: Build<'_>, skin: &SkinLayout) {
    for dt_s in STEPS_S {
        for before in [&[][..], &[(1e9, 3600.0)], &[(2e4, 1e-9), (0.0, 1.0)]] {
            let after = |p: f64| end(build, skin, &[before, &[(p, dt_s)]].concat());
            let mut below = after(0.0);
            for p in PRESSURES_PA {
                let out = after(p);
                for (g, g_below) in out.iter().zip(&below) {
                    let text = format!("{g} S at {p} Pa for {dt_s} s after {before:?}");
                    assert!(g.is_finite() && *g >= 0.0, "{text}");
                    assert!(*g >= g_below * (1.0 - ORDER_TOLERANCE), "{text}, but {g_below} S at less");
                }
                below = out;
            }
        }
    }
}

fn check_rest(build: Build<'_>, skin: &SkinLayout) {
    let idle = end(build, skin, &[(0.0, 1.0)]);
    let rested = end(build, skin, &[(1e5, 3600.0), (0.0, 3600.0)]);
    let pressed = end(build, skin, &[(1e5, 1.0)]);
    for ((idle, rested), pressed) in idle.iter().zip(&rested).zip(&pressed) {
        let left = (rested - idle).abs() / pressed;
        assert!(left < 1e-9, "{left:e} of a load is left after an hour of rest");
    }
    for nothing in [-1e3, f64::NAN, f64::NEG_INFINITY] {
        let out = end(build, skin, &[(nothing, 1.0)]);
        assert_eq!(out, idle, "{nothing} Pa is not the same as 0");
    }
}

fn check_repeats(build: Build<'_>, skin: &SkinLayout) {
    let holds = [(2e4, 0.5), (1e4, 0.0), (1e4, 0.0)];
    let (once, twice) = (end(build, skin, &holds[..2]), end(build, skin, &holds));
    assert_eq!(once, twice, "a step of no time changes the state");
    assert_eq!(twice, end(build, skin, &holds), "equal builds differ");
}

fn check_sessions(build: Build<'_>, skin: &SkinLayout) {
    let holds = [(2e4, 0.5), (0.0, 1.0), (1e4, 1.0)];
    for session in [0, 1, u64::MAX] {
        let mut fresh = build(skin);
        fresh.start_session(session);
        let expected = steps(fresh.as_mut(), skin, &holds);
        fresh.rest(1.0);
        fresh.start_session(7);
        steps(fresh.as_mut(), skin, &holds[..1]);
        fresh.start_session(session);
        let found = steps(fresh.as_mut(), skin, &holds);
        assert_eq!(found, expected, "session {session} depends on what was before it");
        if session == 0 {
            let built = run(build, skin, &holds);
            assert_eq!(built, expected, "a fresh transducer is not in session 0");
        }
    }
}

/// Cuts every hold in proportion to `pieces` and compares the ends of the holds.
fn check_cut(build: Build<'_>, skin: &SkinLayout, name: &str, holds: &[Hold], pieces: &[f64]) {
    let total: f64 = pieces.iter().sum();
    let cut: Vec<Hold> =
        holds.iter().flat_map(|(p, dt_s)| pieces.iter().map(move |piece| (*p, dt_s * piece / total))).collect();
    let ends = run(build, skin, &cut).into_iter().skip(pieces.len() - 1).step_by(pieces.len());
    for (k, (whole, cut)) in run(build, skin, holds).iter().zip(ends).enumerate() {
        for (whole, cut) in whole.values().iter().zip(cut.values()) {
            let error = (cut - whole).abs() / whole.max(f64::MIN_POSITIVE);
            assert!(
                error < SPLIT_TOLERANCE,
                "{name}, hold {k} in {} pieces: {cut} S, in one {whole} S, error {error:e}",
                pieces.len()
            );
        }
    }
}

/// Compares `more` with `less`, which it is never below: one press both.
fn check_order(build: Build<'_>, skin: &SkinLayout, name: &str, less: &[Hold], more: &[Hold]) {
    let (low, high) = (run(build, skin, less), run(build, skin, more));
    for (k, (low, high)) in low.iter().zip(&high).enumerate() {
        for (low, high) in low.values().iter().zip(high.values()) {
            assert!(
                *high >= low * (1.0 - ORDER_TOLERANCE),
                "{name}, hold {k}: {high} S, but {low} S under less pressure"
            );
        }
    }
}

/// Steps of one side of a closed path.
const PATH_STEPS: u32 = 200;

/// Takes the pressure round the polygon of `corners_pa` in no time, first to close the state, then to measure: ∮ P dG ≥
/// 0.
fn check_passive(build: Build<'_>, skin: &SkinLayout, name: &str, corners_pa: &[f64]) {
    let corners: Vec<Hold> = corners_pa.iter().map(|p| (*p, 0.0)).collect();
    let mut transducer = build(skin);
    steps(transducer.as_mut(), skin, &corners);
    check_cycle(transducer.as_mut(), skin, name, &corners);
}

/// ∮ P dG ≥ 0 over the closed cycle of holds, between which the pressure moves straight and in no time. The transducer
/// has been through it until its state repeats.
///
/// In one step of a side pressure and conductance each go one way, so that the trapezoid is off by at most half of
/// |ΔP·ΔG|; over a hold P·ΔG is exact.
fn check_cycle(transducer: &mut dyn Transducer, skin: &SkinLayout, name: &str, holds: &[Hold]) {
    let Some(last) = holds.last() else { return };
    let froms = std::iter::once(last).chain(holds);
    let sides = froms.zip(holds).flat_map(|((from, _), (to, dt_s))| {
        let share = |k: u32| f64::from(k) / f64::from(PATH_STEPS);
        let side = (1..=PATH_STEPS).map(move |k| (from + (to - from) * share(k), 0.0));
        side.chain(std::iter::once((*to, *dt_s)))
    });
    let path: Vec<Hold> = std::iter::once((last.0, 0.0)).chain(sides).collect();
    let maps = steps(transducer, skin, &path);
    for taxel in 0..skin.taxels() {
        let (mut work, mut error) = (0.0, 0.0);
        for (p, map) in path.windows(2).zip(maps.windows(2)) {
            let gained_s = map[1].values()[taxel] - map[0].values()[taxel];
            work += 0.5 * (p[0].0 + p[1].0) * gained_s;
            error += 0.5 * ((p[1].0 - p[0].0) * gained_s).abs();
        }
        assert!(work >= -error, "{name}: ∮ P dG = {work} Pa S is below −{error}: the conductance leads");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::streams::Streams;
    use crate::transducer::loaded_pa;
    use crate::transducers::{TRANSDUCERS, build_transducer};
    use proptest::prelude::*;

    /// What can be switched on in `velostat`, all at once with either creep.
    const VARIANTS: [&str; 3] = [
        "creep.kind = 'prony'\ncreep.fast_s = 3e-3\ncreep.fast_fall_s = 15e-3\ncreep.instant = 0.0",
        "session_log_sd = 0.15\nsession_tilt_log_sd = 0.3\ntemperature_c = -10.0\nunloaded_s = 1e-6\ncreep.fast_fall_s = 0.0",
        "hysteresis.operators = 0\nexponent = 2.0\ncreep.per_decade = 0.0\ncreep.fast_s = 0.0",
    ];

    fn velostat(text: &str, skin: &SkinLayout) -> Box<dyn Transducer> {
        build_transducer("velostat", toml::from_str(text).unwrap(), skin, Streams::new(7)).unwrap()
    }

    /// Two taxels of different gain.
    fn pair() -> SkinLayout {
        SkinLayout::new(1, 2, 15e-3, 10e-3).unwrap()
    }

    #[test]
    fn every_transducer_conforms() {
        for (name, build) in TRANSDUCERS {
            eprintln!("{name}");
            check_transducer(&|skin| build(toml::Table::new(), skin, Streams::new(7)).unwrap());
        }
    }

    #[test]
    fn every_variant_conforms() {
        for text in VARIANTS {
            eprintln!("{text}");
            check_transducer(&|skin| velostat(text, skin));
        }
    }

    /// Conductance after one step from (pressure, pressure before, conductance before, step).
    #[derive(Clone)]
    struct Broken {
        law: fn(f64, f64, f64, f64) -> f64,
        last: (f64, f64),
    }

    impl Transducer for Broken {
        fn step(&mut self, pressure: &PressureMap, dt_s: f64, out: &mut ConductanceMap) {
            let p = loaded_pa(pressure.values()[0]);
            let g = (self.law)(p, self.last.0, self.last.1, dt_s);
            self.last = (p, g);
            out.values_mut().fill(g);
        }

        fn rest(&mut self, _dt_s: f64) {}

        fn start_session(&mut self, _session: u64) {
            self.last = (0.0, 0.0);
        }

        fn boxed(&self) -> Box<dyn Transducer> {
            Box::new(self.clone())
        }
    }

    fn broken(law: fn(f64, f64, f64, f64) -> f64) -> Box<dyn Transducer> {
        Box::new(Broken { law, last: (0.0, 0.0) })
    }

    /// The suite must see what it is for: an explicit Euler step of a lag of 1 s.
    #[test]
    #[should_panic(expected = "hold, hold 0 in 2 pieces")]
    fn an_inexact_step_is_seen() {
        let euler = |p: f64, _, g: f64, dt_s: f64| g + (1e-8 * p - g) * (dt_s / (1.0 + dt_s));
        let wave = [(2e4, 0.5), (5e3, 1.0)];
        check_cut(&|_| broken(euler), &pair(), "hold", &wave, &[0.5, 0.5]);
    }

    /// More while the pressure rises than while it falls: the loop runs the wrong way.
    #[test]
    #[should_panic(expected = "the conductance leads")]
    fn a_lead_is_seen() {
        let lead = |p: f64, before: f64, _, _| 1e-8 * p * if p > before { 1.1 } else { 1.0 };
        check_passive(&|_| broken(lead), &pair(), "lead", &[1e3, 1e5]);
    }

    /// A pressure above any threshold of touch, up to full scale or to a gigapascal.
    fn pressed_pa() -> impl Strategy<Value = f64> {
        prop_oneof![4 => 1e3..1e5_f64, 1 => (3.0..9.0_f64).prop_map(|e| 10_f64.powf(e))]
    }

    /// From a nanosecond to an hour, evenly in the logarithm.
    fn dt_s() -> impl Strategy<Value = f64> {
        (-9.0..3.556_f64).prop_map(|e| 10_f64.powf(e))
    }

    proptest! {
        /// Presses and releases of any length, cut unevenly.
        #[test]
        fn any_waveform_may_be_cut(
            holds in prop::collection::vec((prop_oneof![1 => Just(0.0), 4 => pressed_pa()], dt_s()), 1..12),
            pieces in prop::collection::vec(dt_s(), 2..50),
        ) {
            let skin = pair();
            for text in VARIANTS.iter().chain(&[""]) {
                check_cut(&|skin| velostat(text, skin), &skin, text, &holds, &pieces);
            }
        }

        #[test]
        fn more_pressure_gives_more(
            path in prop::collection::vec((pressed_pa(), 0.0..1e5_f64, prop_oneof![1 => Just(0.0), 4 => dt_s()]), 1..40),
        ) {
            let less: Vec<_> = path.iter().map(|(p, _, dt_s)| (*p, *dt_s)).collect();
            let more: Vec<_> = path.iter().map(|(p, by, dt_s)| (p + by, *dt_s)).collect();
            let skin = pair();
            for text in VARIANTS.iter().chain(&[""]) {
                check_order(&|skin| velostat(text, skin), &skin, text, &less, &more);
            }
        }

        #[test]
        fn any_closed_path_dissipates(corners_pa in prop::collection::vec(pressed_pa(), 2..12)) {
            let skin = pair();
            for text in VARIANTS.iter().chain(&[""]) {
                check_passive(&|skin| velostat(text, skin), &skin, text, &corners_pa);
            }
        }

        /// With creep and delay: the cycle takes time, and is repeated until e⁻⁴⁰ is left of the slowest branch (2 s).
        #[test]
        fn any_slow_cycle_dissipates(
            cycle in prop::collection::vec((1e3..1e5_f64, -3.0..0.0_f64), 2..8),
        ) {
            let holds: Vec<_> = cycle.iter().map(|(p, e)| (*p, 10_f64.powf(*e))).collect();
            let cycle_s: f64 = holds.iter().map(|(_, dt_s)| dt_s).sum();
            let skin = pair();
            for text in [VARIANTS[0], "creep.end_s = 2.0"] {
                let mut sheet = velostat(text, &skin);
                let mut spent_s = 0.0;
                while spent_s < 80.0 {
                    steps(sheet.as_mut(), &skin, &holds);
                    spent_s += cycle_s;
                }
                check_cycle(sheet.as_mut(), &skin, text, &holds);
            }
        }

        #[test]
        fn any_history_repeats_bit_for_bit(
            holds in prop::collection::vec((0.0..1e5_f64, dt_s()), 1..40),
            session in any::<u64>(),
        ) {
            let skin = pair();
            for text in VARIANTS.iter().chain(&[""]) {
                let once = || {
                    let mut sheet = velostat(text, &skin);
                    sheet.start_session(session);
                    steps(sheet.as_mut(), &skin, &holds)
                };
                prop_assert_eq!(once(), once());
            }
        }
    }
}
