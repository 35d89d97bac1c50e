//! Whole scenes at the ends of what can be written: finite and in balance, or refused with a reason.

use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestCaseError, TestRunner};
use spts_contact::Frame;
use spts_input::Refusal;
use spts_models::Grid;
use spts_sim::World;
use spts_sim::mechanics::{DropConfig, Mechanics, MechanicsConfig, PressConfig, Timestep};
use std::cell::Cell;
use std::path::Path;

fn read(text: &str) -> Result<Mechanics, Refusal> {
    Mechanics::from_toml(text, Path::new(""))
}

/// Whether the numbers of `frame` are finite, no pressure is below zero, and Σ p A is the force.
fn is_sane(frame: &Frame, area_m2: f64) -> bool {
    let pressures = [&frame.pressure, &frame.electrode_pressure].map(Grid::values);
    let numbers = [frame.wrench.force_n, frame.wrench.torque_nm, frame.pose.position_m];
    pressures.into_iter().flatten().all(|p| p.is_finite() && *p >= 0.0)
        && numbers.iter().flatten().all(|x| x.is_finite())
        // sums of positive numbers in two orders: 1e7 cells at most, 1e-16 each, growing with the root of their number
        && frame.imbalance(area_m2) <= 1e-9
}

/// Scenes that run to their end, and the range of their largest force, N: their lines with ` ; ` between them.
const SCENES: &str = r#"
skin = { rows = 1, cols = 1 } ; [press] ; object = "T" ; row = 0.0 ; col = 0.0 ; presses = 1 | 19.9 | 20.5
skin = { rows = 1, cols = 1 } ; [drop] | 1 | inf
frame_interval_s = 0.02 ; skin = { rows = 1, cols = 1000 } ; [press] ; object = "line" ; row = 0.0 ; col = 499.5 ; rotation_deg = 0.0 ; presses = 1 | 19 | inf
skin = { rows = 1, cols = 1000 } ; [drop] ; height_m = 0.05 ; duration_s = 0.3 ; position_sd_m = 0.0 | 1 | inf
frame_interval_s = 0.1 ; skin = { rows = 500, cols = 500 } ; contact.cells_per_taxel = 2 ; [press] ; object = "tape" ; row = 249.5 ; col = 249.5 ; presses = 1 | 19 | inf
frame_interval_s = 0.02 ; skin = { rows = 100, cols = 100, pitch_m = 1e-4, electrode_m = 5e-5 } ; contact.cells_per_taxel = 1 ; [press] ; object = "rec" ; row = 49.5 ; col = 49.5 ; presses = 1 | 19 | 21
skin = { rows = 10, cols = 10, pitch_m = 1e-4, electrode_m = 5e-5 } ; contact.cells_per_taxel = 1 ; [press] ; object = "rec" ; force_n = 0.5 ; presses = 1 | 0 | inf
skin = { pitch_m = 0.1, electrode_m = 0.06 } ; [press] ; object = "brain" ; row = 4.5 ; col = 4.5 ; presses = 1 | 0 | inf
skin = { pitch_m = 0.1, electrode_m = 0.06 } ; [drop] | 0 | inf
[press] ; object = "line" ; force_n = 100.0 ; presses = 1 | 99 | 105
[press] ; object = "brain" ; force_n = 100.0 ; presses = 1 | 99 | 105
[press] ; object = "rec" ; force_n = 100.0 ; presses = 1 | 99 | 105
timestep_s = "auto" ; contact.thickness_m = 1e-3 ; [press] ; object = "line" ; force_n = 100.0 ; presses = 1 | 99 | inf
"#;

/// One taxel, which is stiffer than foam under a T that covers it; a row of a thousand and a square of 250,000; a skin
/// of 10 mm that a plate floods (K A = 1500 N/m) and one of a metre in cells of 17 mm, of which a dome meets few; the
/// hardest presses, deeper than 1 mm of foam is thick, and the softest.
#[test]
fn extreme_scenes_run() {
    for line in SCENES.lines().filter(|line| !line.is_empty()) {
        let mut parts = line.split(" | ");
        let text = parts.next().unwrap().replace(" ; ", "\n");
        let [low_n, high_n] = [(); 2].map(|()| parts.next().unwrap().parse::<f64>().unwrap());
        let scene = read(&text).unwrap_or_else(|error| panic!("{text}\n{error}"));
        let area_m2 = scene.skin().cell_area_m2();
        let mut world = World::new(&scene).unwrap_or_else(|error| panic!("{text}\n{error}"));
        let mut peak_n = 0.0_f64;
        for frame in world.frames() {
            let frame = frame.unwrap_or_else(|error| panic!("{text}\n{error}"));
            assert!(is_sane(&frame, area_m2), "{text}\n{frame:?}");
            peak_n = peak_n.max(frame.wrench.force_n[2]);
        }
        assert!((low_n..=high_n).contains(&peak_n), "{text}\n{peak_n}");
    }
}

/// A landing point on the corner and a scatter of 5 cm: the ball hits, rolls off, or misses and falls on.
#[test]
fn a_ball_beside_the_skin_falls_on() {
    let text = "[drop]\nrow = -0.5\ncol = -0.5\nposition_sd_m = 0.05\ndrops = 6\nduration_s = 1.0";
    let scene = read(text).unwrap();
    let mut missed = 0;
    for index in 0..scene.repeats() {
        let mut world = World::repeat(&scene, index).unwrap();
        let last = world.frames().map(Result::unwrap).last().unwrap();
        assert!((last.time_s - 1.0).abs() < 3e-3, "ends at {}", last.time_s);
        assert!(last.pose.position_m.iter().all(|x| x.is_finite() && x.abs() < 10.0));
        missed += usize::from(world.bounces().is_empty());
    }
    assert!(missed > 0, "the scatter is too small for the test");
}

/// Values a user could write, and some that nobody should.
fn value(usual: std::ops::Range<f64>) -> impl Strategy<Value = f64> {
    prop_oneof![
        60 => usual,
        1 => prop::sample::select(vec![0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, 1e-300, -1e-12]),
        1 => -1e3..1e3,
    ]
}

prop_compose! {
    fn config()(
        press in any::<bool>(),
        model in prop::sample::select(MODELS.to_vec()),
        object in prop::sample::select(vec!["T", "brain", "tape", "eraser", "gel", "tennis", "comb"]),
        auto in any::<bool>(),
        numbers in (
            value(0.5..100.0), value(-1.0..6.0), value(-1.0..6.0), value(-20.0..20.0),
            value(1e-3..50.0), value(1e-3..2e-3), value(5e-3..0.2), value(1e5..1e9),
        ),
        layer in (value(1e5..1e9), value(0.0..2e-3), value(1e-3..1e-2), value(0.0..1.0)),
        skin in (1..20_usize, 1..20_usize, prop::sample::select(vec![1e-3, 15e-3, 0.1])),
        step in value(1e-5..1e-3),
    ) -> MechanicsConfig {
        let (force_n, row, col, tilt, mass_kg, height_m, radius_m, ball) = numbers;
        let (stiffness, damping, thickness, friction) = layer;
        let mut contact = spts_toml(&[
            ("stiffness_pa_per_m", stiffness), ("damping_s", damping), ("thickness_m", thickness), ("friction", friction),
        ]);
        contact.insert("cells_per_taxel".to_owned(), 2.into());
        contact.insert("model".to_owned(), model.into());
        let skin = spts_models::SkinLayout::new(skin.0, skin.1, skin.2, 0.4 * skin.2).unwrap();
        let mut config = MechanicsConfig {
            timestep_s: Some(if auto { Timestep::Auto } else { Timestep::Seconds(step) }),
            skin,
            contact,
            ..MechanicsConfig::default()
        };
        if press {
            config.press = Some(PressConfig {
                object: Some(object.to_owned()),
                force_n, row: Some(row), col: Some(col), tilt_deg: Some([tilt, 0.0]), presses: 1,
                // the shortest press that has a plateau, from 0.52 s on
                duration_s: 0.6, onset_s: 0.25, onset_spread_s: 0.0, rise_s: 0.1, lift_s: 0.57, lift_spread_s: 0.0,
                ..PressConfig::default()
            });
            config.frame_interval_s = Some(0.02);
        } else {
            config.drop = Some(DropConfig {
                mass_kg, height_m, radius_m, row: Some(row), col: Some(col), stiffness_pa_per_m: ball,
                drops: 1, release_s: 0.0, release_spread_s: 0.0, duration_s: 0.05,
                ..DropConfig::default()
            });
        }
        config
    }
}

fn spts_toml(values: &[(&str, f64)]) -> toml::Table {
    values.iter().map(|(key, value)| ((*key).to_owned(), (*value).into())).collect()
}

const MODELS: [&str; 4] = ["winkler", "footprint", "layer", "half_space"];

/// Scenes of one kind that ran, and those of them with a force.
#[derive(Default)]
struct Tally {
    ran: Cell<usize>,
    touched: Cell<usize>,
}

/// Any scene is refused or runs, its plateau or its bounce included: finite and in balance. Nothing panics. Not few
/// run, and nearly all of those touch, on every model: a ball falls 1 to 2 mm within 20 of its 50 ms, an object comes
/// down in 0.25 s.
#[test]
fn any_scene_is_refused_or_runs() {
    let tallies = MODELS.map(|_| [true, false].map(|_| Tally::default()));
    let add = |cell: &Cell<usize>| cell.set(cell.get() + 1);
    let mut runner = TestRunner::new(ProptestConfig {
        cases: 160,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(7),
        ..ProptestConfig::default()
    });
    let outcome = runner.run(&config(), |config| {
        let model = config.contact["model"].as_str().unwrap();
        let model = MODELS.iter().position(|name| *name == model).unwrap();
        let tally = &tallies[model][usize::from(config.drop.is_some())];
        let Ok(scene) = Mechanics::new(config, Path::new("")) else {
            return Ok(());
        };
        let Ok(mut world) = World::new(&scene) else {
            return Ok(());
        };
        add(&tally.ran);
        let area_m2 = scene.skin().cell_area_m2();
        let mut peak_n = 0.0_f64;
        for frame in world.frames() {
            let frame = frame.map_err(|error| TestCaseError::fail(error.to_string()))?;
            prop_assert!(is_sane(&frame, area_m2), "{frame:?}");
            peak_n = peak_n.max(frame.wrench.force_n[2]);
        }
        if peak_n > 0.0 {
            add(&tally.touched);
        }
        Ok(())
    });
    outcome.unwrap_or_else(|error| panic!("{error}"));
    for (model, [press, drop]) in MODELS.iter().zip(&tallies) {
        let counts = [&press.ran, &press.touched, &drop.ran, &drop.touched].map(Cell::get);
        let [pressed, pressed_hard, dropped, dropped_hard] = counts;
        let told = format!("{model}: {counts:?} presses and drops run, and with a force");
        // of 20 each on average; `footprint` stops no ball
        assert!(pressed >= 6 && dropped >= if *model == "footprint" { 0 } else { 5 }, "{told}");
        assert!(10 * pressed_hard >= 9 * pressed && 10 * dropped_hard >= 9 * dropped, "{told}");
    }
}
