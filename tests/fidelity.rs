//! The study of fidelity levels through its command.

use crate::command::{files, json, refused, succeeds, words};
use serde_json::Value;
use std::path::Path;

/// A quick study of a press and a drop, in a folder of the name of its number of `threads`.
fn study(dir: &Path, threads: &str) -> Value {
    let arguments = "fidelity --quick --scene T --scene drop --json --threads";
    json(dir, &[&words(arguments)[..], &[threads, "--out", threads]].concat())
}

#[test]
#[ignore = "two studies: half a minute"]
fn errors_do_not_depend_on_the_threads() {
    let dir = tempfile::tempdir().unwrap();
    let [one, two] = ["1", "2"].map(|threads| {
        study(dir.path(), threads);
        files(&dir.path().join(threads))
    });
    for name in ["errors.csv", "refused.csv"] {
        assert_eq!(one[name], two[name], "{name} depends on the number of threads");
    }
}

/// One line a scene, level and resolution, with the keys that scripts read.
#[test]
fn a_quick_study_is_complete() {
    let dir = tempfile::tempdir().unwrap();
    let report = study(dir.path(), "2");
    let rows = report["rows"].as_array().unwrap();
    // T: five levels, the ball four, at two resolutions each
    assert_eq!(rows.len(), 2 * 5 + 2 * 4);
    for row in rows {
        for key in words(
            "timestep_s cost_us_per_step pressure_rms_rel taxel_rms_rel support_delta iou_delta \
              class_delta chain_s",
        ) {
            assert!(row[key].is_f64(), "{key} in {row}");
        }
        assert!(["20x20", "60x60"].contains(&row["cells"].as_str().unwrap()));
        assert!(row["scene"].is_string() && row["rung"].is_string());
        assert!(row["cost_us_per_step"].as_f64().unwrap() > 0.0);
    }
    for name in words("fidelity.csv errors.csv refused.csv summary.md figures/pareto.png figures/pressure.svg") {
        assert!(dir.path().join("2").join(name).is_file(), "{name}");
    }
}

/// A saved scene, every default written out, runs on another level, at another step, and by a tolerance.
#[test]
fn a_saved_scene_changes_its_fidelity_level() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        succeeds(dir.path(), &[&["simulate"], arguments, &["--no-record"]].concat());
    };
    run(&["press/T", "--contact", "layer", "--cells", "2", "--out", "press"]);
    for contact in ["winkler", "footprint", "half_space"] {
        run(&["press/scene.toml", "--contact", contact, "--out", contact]);
    }
    run(&["press/scene.toml", "--tolerance", "0.4", "--out", "loose"]);
    run(&["bounce", "--out", "bounce"]);
    run(&["bounce/scene.toml", "--timestep", "2e-4", "--out", "coarse"]);
    run(&["bounce/scene.toml", "--tolerance", "0.1", "--out", "ball"]);
    let scene = std::fs::read_to_string(dir.path().join("loose/scene.toml")).unwrap();
    assert!(
        scene.contains("chosen_for_tolerance = 0.4\n")
            && !scene.contains("\ntolerance")
            && scene.contains("cells_per_taxel"),
        "{scene}"
    );
}

/// The full chain beside the chosen one: scores of both, the difference of what was asked for and whether it is within;
/// and errors that are asked for on scenes that no table was measured on. Without a tolerance there is nothing to
/// check.
#[test]
fn tolerances_are_checked() {
    let dir = tempfile::tempdir().unwrap();
    let arguments = ["simulate", "press/tennis", "--no-record", "--tolerance", "0.1", "--check", "--json"];
    let report = json(dir.path(), &arguments);
    let check = &report["check"];
    assert_eq!((&check["met"], &check["tolerance"]), (&true.into(), &0.1.into()), "{check}");
    assert!(check["difference"].as_f64().unwrap() <= 0.1 && check["saves"].as_f64().unwrap() > 2.0, "{check}");
    for chain in ["chosen", "full"] {
        for key in words("cells_per_taxel timestep_s support iou class contact_s readout_s") {
            assert!(check[chain][key].is_number(), "{chain} {key}: {check}");
        }
    }
    assert_eq!(check["full"]["cells_per_taxel"], 24);
    refused(dir.path(), &["simulate", "press/T", "--check"], &["--tolerance"]);
    let report = json(dir.path(), &["fidelity", "--tolerances", "0.1,0.3", "--scenes", "1", "--seed", "3", "--json"]);
    let rows = report["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 2, "{report}");
    for row in rows {
        assert!(row["error"].as_f64().unwrap() <= row["tolerance"].as_f64().unwrap(), "{row}");
    }
    assert!(dir.path().join("out/fidelity/tolerances.csv").exists());
}
