//! Skins on several wires, and several objects at once.

use crate::command::{json, succeeds};
use spts::circuit::{Constant, Mode, Profile, Readout, WireConfig};
use spts::models::{ConductanceMap, SkinLayout, Streams};
use spts::{Scene, Session, Twin};
use spts_eval::{Press, Untouched};
use spts_recon::recover::{NnLasso, Penalty};
use spts_recon::{Problem, Recover as _, Workspace};
use std::path::Path;

/// An ideal recording of a blob on 8 × 8 taxels, twice as many samples as taxels, as a press.
fn blob(wires: &[WireConfig]) -> (Press, Vec<f64>) {
    let skin = SkinLayout::with_pitch(8, 8, 5e-3).unwrap();
    let profile = Profile { wires: wires.to_vec(), ..Profile::named("ideal").unwrap() }.seeded(&skin);
    let image: Vec<f64> = (0..64).map(|k| if (2..5).contains(&(k / 8)) && k % 8 > 4 { 1e-5 } else { 0.0 }).collect();
    let mut readout = Readout::new(&profile, Mode::Compressive, &skin, Streams::new(3), 0).unwrap();
    let map = ConductanceMap::from_values(8, 8, image.clone());
    let recording = readout.record(&mut [Constant::new(map).unwrap()], 128, 0).unwrap().with_idle_frames(Some(0));
    let untouched = Untouched { offsets_v: vec![0.0], image: None };
    let volts = profile.on(&skin).unwrap().volts_per_siemens();
    (untouched.press(&recording, 0, 0..128), image.iter().map(|g| g * volts).collect())
}

/// With an ideal readout and rows of full rank, what one wire shows is what any number of wires show together: the
/// image. A lasso without noise and with a penalty of a millionth is off by about as much.
#[test]
fn one_wire_is_many_wires_decoded_together() {
    let entry = |text: &str| toml::from_str::<WireConfig>(text).unwrap();
    let ways = [vec![], vec![entry("bands = 2")], vec![entry("blocks = [2, 2]")], vec![entry("round_robin = 4")]];
    for wires in ways {
        let (press, truth) = blob(&wires);
        let window = press.window(0, 128).unwrap();
        assert_eq!(window.signs.is_some(), wires.is_empty(), "rows of several wires have zeros");
        let problem = Problem::new(window.phi, window.y).unwrap();
        let solver = NnLasso::new(Penalty::Relative(1e-6)).unwrap();
        let found = solver.recover(&problem, &mut Workspace::default()).unwrap();
        let mut image = vec![0.0; 64];
        found.scatter(&mut image);
        let largest = truth.iter().copied().fold(0.0, f64::max);
        for (k, (found, true_v)) in image.iter().zip(&truth).enumerate() {
            assert!((found - true_v).abs() < 1e-4 * largest, "{wires:?}, taxel {k}: {found} V, true {true_v} V");
        }
    }
}

/// A session of several wires is written as schema 2 and read back as it was; one of one wire stays schema 1.
#[test]
fn sessions_of_several_wires_are_read_back() {
    let dir = tempfile::tempdir().unwrap();
    for (wires, schema) in [("", 1), ("[[wires]]\nrows = [0, 3]\n[[wires]]\nrows = [4, 9]\n", 2)] {
        let scene = format!("{wires}[contact]\nmodel = \"footprint\"\n[press]\nobject = \"T\"\npresses = 2\n");
        let twin = Twin::new(&Scene::from_toml(&scene, Path::new("")).unwrap()).unwrap();
        for mode in [Mode::Raster, Mode::Compressive] {
            let session = twin.record(mode).unwrap();
            let path = dir.path().join(format!("{schema}-{}", mode.name()));
            session.write(&path).unwrap();
            let text = std::fs::read_to_string(path.join("session.json")).unwrap();
            let found: serde_json::Value = serde_json::from_str(&text).unwrap();
            assert_eq!(found["schema"], schema);
            assert_eq!(Session::read(&path).unwrap(), session);
        }
        // two wires at the clock of one; a scan takes as long as the larger of them
        let [raster, compressive] = [Mode::Raster, Mode::Compressive]
            .map(|mode| twin.scene().chain().readout(mode, 0).unwrap().sample_rate_hz());
        let expected = if schema == 1 { [64_300.0; 2] } else { [64_300.0 / 0.6, 2.0 * 64_300.0] };
        assert!((raster / expected[0] - 1.0).abs() < 1e-12 && (compressive / expected[1] - 1.0).abs() < 1e-12);
    }
}

/// Press, record, decode and score on several wires with the readout as built, on a small skin and on a large one; and
/// the design of a skin, its scene with all of its wires, and what comes of it.
#[test]
fn several_wires_from_press_to_score() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    // the decoders that are shown, and on the large skin one
    let (shown, one): (&[&str], &[&str]) = (&["--no-ball"], &["--decoder", "patches"]);
    for (rows, wires, balls, measurements, least, decoders) in
        [(24, "round_robin = 4", 1, 80, 0.75, shown), (64, "bands = 4", 2, 400, 0.75, one)]
    {
        let places = [[0.0, 0.0], [0.25, 0.25]];
        let objects: String = places[..balls]
            .iter()
            .map(|place| format!("[[press.objects]]\nobject = \"tennis\"\nposition_share = {place:?}\n"))
            .collect();
        let scene = format!(
            "[[wires]]\n{wires}\n[skin]\nrows = {rows}\ncols = {rows}\npitch_m = 0.005\n[contact]\nmodel = \"footprint\"\n[press]\n\
             presses = 1\nforce_n = {}\n{objects}",
            10 * balls
        );
        std::fs::write(here.join("scene.toml"), scene).unwrap();
        succeeds(here, &["simulate", "scene.toml", "--out", "s"]);
        let m = measurements.to_string();
        let decoded = json(here, &["decode", "s", "--measurements", &m, "--out", "d", "--json"]);
        let iou = decoded["rows"][0]["iou"].as_f64().unwrap();
        assert!(iou > least, "{rows} × {rows}, {wires}: {iou}");
        let scored = ["score", "s", "--measurements", &m, "--no-times", "--out", "c", "--json"];
        let scored = json(here, &[&scored[..], decoders].concat());
        let best = scored["rows"].as_array().unwrap().iter().filter_map(|row| row["iou"].as_f64()).fold(0.0, f64::max);
        assert!(best > 0.6, "{rows} × {rows}: {best}");
    }
    let design = [
        "--area",
        "0.12x0.12",
        "--resolution",
        "5mm",
        "--latency",
        "5ms",
        "--iou",
        "0.6",
        "--wires",
        "3",
        "--contacts",
        "2",
    ];
    succeeds(here, &[&["design"][..], &design, &["--out", "design"]].concat());
    succeeds(here, &["simulate", "design/scene.toml", "--out", "designed"]);
    let session = Session::read(&here.join("designed")).unwrap();
    let recording = session.compressive().unwrap();
    assert_eq!((recording.taxels(), recording.weights().wire_count()), (576, 3));
    succeeds(here, &["decode", "designed", "--out", "decoded"]);
}

/// Several objects press together with the force of the press, each at its place.
#[test]
fn several_objects_share_the_force() {
    let scene = "[skin]\nrows = 40\ncols = 40\npitch_m = 0.005\n[contact]\nmodel = \"footprint\"\n[press]\npresses = 1\nforce_n = 30\n\
                 [[press.objects]]\nobject = \"tennis\"\nposition_m = [-0.05, 0.05]\n\
                 [[press.objects]]\nobject = \"tennis\"\nposition_m = [0.05, -0.05]\n";
    let scene = Scene::from_toml(scene, Path::new("")).unwrap();
    assert_eq!(scene.name(), "tennis-tennis");
    assert_eq!(
        Scene::from_toml(&scene.to_toml().unwrap(), Path::new("")).unwrap().hash().unwrap(),
        scene.hash().unwrap()
    );
    let session = Twin::new(&scene).unwrap().record(Mode::Compressive).unwrap();
    let facts = &session.compressive.as_ref().unwrap().presses[0];
    let pressure = facts.pressure.as_ref().unwrap();
    let on = |rows: std::ops::Range<usize>, cols: std::ops::Range<usize>| -> f64 {
        let all = rows.flat_map(|row| cols.clone().map(move |col| 40 * row + col));
        all.map(|k| pressure.values()[k] * 25e-6).sum()
    };
    // x and y of ±50 mm: row and column 9.5 and 29.5. The arm's repeatability of 0.02° is 0.05 mm between the balls,
    // which sink in by about 1 mm: up to three standard deviations, a tenth of the force
    let (first, second, all) = (on(0..20, 0..20), on(20..40, 20..40), on(0..40, 0..40));
    assert!(
        (first - 15.0).abs() < 1.5 && (second - 15.0).abs() < 1.5 && (all - 30.0).abs() < 1e-3,
        "{first} {second} {all}"
    );
}

/// Drops on several wires are scored with their places, also on a skin whose rows are kept as bits.
#[test]
fn drops_on_several_wires_have_places() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    for (side, pitch_m) in [(10, 0.015), (50, 0.003)] {
        let scene = format!(
            "[[wires]]\nbands = 2\n[skin]\nrows = {side}\ncols = {side}\npitch_m = {pitch_m}\n[drop]\ndrops = 1\n\
             duration_s = 0.5\n"
        );
        std::fs::write(here.join("drop.toml"), scene).unwrap();
        succeeds(here, &["simulate", "drop.toml", "--out", "all/drop"]);
        let press = format!(
            "[[wires]]\nbands = 2\n[skin]\nrows = {side}\ncols = {side}\npitch_m = {pitch_m}\n[contact]\n\
             model = \"footprint\"\n[press]\nobject = \"tennis\"\npresses = 2\n"
        );
        std::fs::write(here.join("press.toml"), press).unwrap();
        succeeds(here, &["simulate", "press.toml", "--out", "all/press"]);
        succeeds(here, &["score", "all", "--decoder", "patches", "--measurements", "60", "--no-times", "--out", "c"]);
        std::fs::remove_dir_all(here.join("all")).unwrap();
    }
}

/// Another object takes the place of several: nothing of theirs stays.
#[test]
fn an_object_takes_the_place_of_several() {
    let saved = "[press]\npresses = 1\n[[press.objects]]\nobject = \"tennis\"\n";
    let saved = Scene::from_toml(saved, Path::new("")).unwrap().to_toml().unwrap();
    let assignment: spts::scene::Assignment = "press.object=T".parse().unwrap();
    let mut table = toml::from_str(&saved).unwrap();
    assignment.apply(&mut table).unwrap();
    let changed = Scene::from_toml(&toml::to_string(&table).unwrap(), Path::new("")).unwrap();
    let fresh = Scene::from_toml("[press]\nobject = \"T\"\npresses = 1\n", Path::new("")).unwrap();
    assert_eq!(changed.to_toml().unwrap(), fresh.to_toml().unwrap());
}

/// What cannot be is named.
#[test]
fn wirings_that_cannot_be_are_refused() {
    for (text, said) in [
        ("[[wires]]\nbands = 0\n[press]\nobject = \"T\"", "`wires`[0]: `bands` = 0 is outside [1, 100]"),
        ("[[wires]]\nrows = [0, 4]\n[press]\nobject = \"T\"", "taxel 50 (row 5, column 0) is on none"),
        ("[[wires]]\nband = 2\n[press]\nobject = \"T\"", "band"),
        ("[press]\nobject = \"T\"\n[[press.objects]]\nobject = \"X\"", "leave out `press.object`"),
        ("[press]\n[[press.objects]]\nobject = \"Q\"", "`press.objects[0].object` = \"Q\" is not one of"),
        (
            "[press]\n[[press.objects]]\nobject = \"T\"\n[[press.objects]]\nobject = \"tennis\"",
            "give `press.stiffness_pa_per_m`",
        ),
    ] {
        let error = Scene::from_toml(text, Path::new("")).unwrap_err().to_string();
        assert!(error.contains(said), "{text}: {error}");
    }
}
