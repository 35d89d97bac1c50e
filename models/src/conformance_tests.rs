use super::*;
use crate::streams::Streams;
use crate::transducer::loaded_pa;
use crate::transducers::{TRANSDUCERS, build_transducer};
use proptest::prelude::*;

/// What can be switched on in `velostat`, all at once with either creep.
const VARIANTS: [&str; 3] = [
    "creep.kind = 'prony'\ncreep.fast_s = 3e-3\ncreep.fast_fall_s = 15e-3\ncreep.instant = 0.0",
    "session_log_sd = 0.15\ntemperature_c = -10.0\nunloaded_s = 1e-6\ncreep.fast_fall_s = 0.0",
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

/// Relaxation, as of a negative share: a hold loses what the rise before it had too much.
#[test]
#[should_panic(expected = "the conductance leads")]
fn a_relaxation_is_seen() {
    let relaxing = |p: f64, before: f64, g: f64, dt_s: f64| {
        let (target, at_once) = (1e-8 * p, g + 1.5e-8 * (p - before));
        target + (at_once - target) * (-dt_s / 0.1).exp()
    };
    let holds = [(1e3, 0.3), (1e5, 0.3)];
    let mut sheet = broken(relaxing);
    // e⁻¹² is left of the beginning
    for _ in 0..2 {
        steps(sheet.as_mut(), &pair(), &holds);
    }
    check_cycle(sheet.as_mut(), &pair(), "relaxation", &holds);
}

/// A derivative on top: the higher pressure gives less once it stands still.
#[test]
#[should_panic(expected = "under less pressure")]
fn a_lost_order_is_seen() {
    let rate = |p: f64, before: f64, _, _| 1e-8 * (2.0 * p - before);
    let less = [(1e3, 0.1), (3e3, 0.1)];
    let more = [(3e3, 0.1), (3e3, 0.1)];
    check_order(&|_| broken(rate), &pair(), "rate", &less, &more);
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
