//! A skin that is wrapped round a cylinder and under preload, from the scene to the comparison with the published
//! recording.

use crate::command::{json, succeeds};
use crate::recordings::recordings_with_arm;
use serde_json::Value;
use spts::Twin;
use spts::record::press_frames;
use spts::scene::Scene;
use spts::simulate::{NAMED_SCENES, Request};
use spts_circuit::Mode;
use spts_eval::place::find_touches;

/// Velostat without memory and without spread: its static law alone.
const STATIC: &str = "[transducer_parameters]\nspread_log_sd = 0.0\nsession_log_sd = 0.0\nsession_tilt_log_sd = 0.0\n\
    hysteresis = { operators = 0 }\ncreep = { per_decade = 0.0 }\nconditioning = { first = 1.0, per_ln_press = 0.0 }\n";

/// Two numbers that are equal up to rounding, which a chain of ten operations keeps far below 1e-9.
#[track_caller]
fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-9 * expected.abs(), "{found}, expected {expected}");
}

fn scene(text: &str) -> Scene {
    Scene::from_toml(text, "".as_ref()).unwrap()
}

/// Without a touch a taxel conducts what foam and Velostat give at its strain, in closed form: with K = 15 MPa/m,
/// h = 6 mm, ε_max = 0.85, the foam takes δ_f = ε h − p/K_s with K_s = 50 K and p = K_f δ_f/(1 − δ_f/(ε_max h)),
/// K_f = K/(1 − 1/50); and G = G_ref √(S/10 kPa), S = p/(1 + p/300 kPa), with the defaults of the law. To rounding.
#[test]
fn a_taxel_at_rest_conducts_what_its_strain_says() {
    let text = format!(
        "seed = 5\ncontact.model = \"footprint\"\n{STATIC}[bend]\n[press]\nobject = \"finger\"\nforce_n = 9\npresses = 1\n\
         row = 3\ncol = 6"
    );
    let scene = scene(&text);
    let press = press_frames(&scene, 0).unwrap();
    let bend = scene.mechanics().config().bend.unwrap();
    let strain = bend.strain(scene.skin(), scene.seed(), 0);
    let rest_pa = press.frames[0].electrode_pressure.values();
    let maps = scene.chain().conductance_maps(&[&press.frames], 0);
    let (k, h_m, most) = (1.5e7, 6e-3, 0.85);
    let mut taut = 0;
    for ((strain, p), g) in strain.iter().zip(rest_pa).zip(maps[0][0].values()) {
        if *strain <= 0.0 {
            assert!(*p <= 0.0 && *g <= 0.0);
            continue;
        }
        taut += 1;
        let foam_m = strain * h_m - p / (50.0 * k);
        close(p * (1.0 - foam_m / (most * h_m)), k / (1.0 - 1.0 / 50.0) * foam_m);
        let felt = p / (1.0 + p / 3e5);
        close(*g, 1.35e-4 * (felt / 10e3).sqrt());
    }
    // 35 of 100 in the mean; five standard deviations are 24
    assert!((11..60).contains(&taut), "{taut}");
    // all frames carry the finger alone, and the electrode under it feels the cover too
    let held = press.frames.iter().find(|f| f.time_s > 0.9).unwrap();
    assert!(held.imbalance(scene.skin().cell_area_m2()) < 1e-9);
    let under = 3 * 10 + 6;
    let slack = press.frames[0].electrode_pressure.values()[under] <= 0.0;
    assert!(held.electrode_pressure.values()[under] > held.pressure.values()[under] || !slack);
}

/// What is pressed on a taut taxel adds to its preload on the stiffer part of the law: under the same depth a preloaded
/// taxel carries more, so that under the same force the finger sinks in less.
#[test]
fn a_finger_sinks_in_less_on_a_taut_taxel() {
    let depth_m = |strain: f64| {
        let text = format!(
            "contact.model = \"footprint\"\n[bend]\ntaut_share = 1.0\nstrain_log_sd = 0.0\npress_log_sd = 0.0\n\
             strain = {strain:?}\n[press]\nobject = \"finger\"\nforce_n = 9\npresses = 1\nposition_sd_m = 0.0"
        );
        let press = press_frames(&scene(&text), 0).unwrap();
        -press.frames.iter().map(|f| f.pose.position_m[2]).fold(f64::INFINITY, f64::min)
    };
    let depths = [0.0, 0.02, 0.08, 0.2].map(depth_m);
    assert!(depths.windows(2).all(|pair| pair[1] < pair[0]), "{depths:?}");
}

/// The scene that ships: an idle part under preload, six touches at their places, a session of touches.
#[test]
fn the_arm_is_read_like_the_published_one() {
    let request = Request { scene: NAMED_SCENES[0].0.to_owned(), assignments: vec!["seed=3".parse().unwrap()] };
    let scene = request.scene().unwrap();
    let session = Twin::new(&scene).unwrap().record(Mode::Compressive).unwrap();
    let recording = session.compressive().unwrap();
    let touches = find_touches(recording);
    let places = scene.config().press.as_ref().unwrap().places.clone().unwrap();
    assert_eq!(touches.len(), places.len());
    for (touch, [row, col]) in touches.iter().zip(&places) {
        assert!(touch.untouched.image.is_some(), "block {} has no preload", touch.block);
        let taxel = touch.taxel(recording).unwrap();
        // places of this scene are middles of taxels
        let off = ((taxel / 10) as f64 - row).abs() + ((taxel % 10) as f64 - col).abs();
        assert!(off < 0.5, "block {}: taxel {taxel}, touched at {row}, {col}", touch.block);
    }
}

/// Through the commands: the session alone is located by `spts score`, and a saved scene is the same scene.
#[test]
fn touches_alone_are_located() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), &["simulate", "arm", "--seed", "2"]);
    let again = ["simulate", "out/arm/scene.toml", "--out", "again", "--set", "name=arm"];
    succeeds(dir.path(), &again);
    let bytes = |folder: &str| std::fs::read(dir.path().join(folder).join("compressive_codes.npy")).unwrap();
    assert_eq!(bytes("out/arm"), bytes("again"));
    let board: Value = json(dir.path(), &["score", "out/arm", "--json"]);
    let rows = board["localisation"].as_array().unwrap();
    let at_25 = |r: &&Value| r["contact"] == "arm" && r["decoder"] == "taxel" && r["m"] == 25;
    // of windows of 25 measurements all but a few find the taxel
    assert!(rows.iter().find(at_25).unwrap()["mean_px"].as_f64().unwrap() < 0.1);
}

/// Every statistic of the published recording lies where nine in ten simulated skins do.
#[test]
fn the_published_arm_is_one_of_the_twins() {
    let Some(root) = recordings_with_arm() else { return };
    let dir = tempfile::tempdir().unwrap();
    let arguments = ["compare", root.to_str().unwrap(), "--arm", "--json"];
    let report: Value = json(dir.path(), &arguments);
    let statistics = report["statistics"].as_array().unwrap();
    assert_eq!((statistics.len(), &report["skins"]), (10, &8.into()));
    for of in statistics {
        assert!(of["inside"] == true, "{of}");
    }
}

/// A table and its JSON are the same for any number of threads.
#[test]
#[ignore = "twice two simulated arms: a quarter of a minute"]
fn a_comparison_of_arms_does_not_depend_on_the_threads() {
    let Some(root) = recordings_with_arm() else { return };
    let dir = tempfile::tempdir().unwrap();
    let run = |threads: &str| {
        let two = ["compare", root.to_str().unwrap(), "--arm", "--json", "--skins", "2", "--threads", threads];
        let printed = succeeds(dir.path(), &two).stdout;
        (printed, std::fs::read(dir.path().join("out/compare/arm.csv")).unwrap())
    };
    assert_eq!(run("1"), run("2"));
}
