//! `spts design`: a small design from the question to the check of its promise, and what `circuit` says of one
//! wire beside it.

use crate::command::{files, refused, spts, succeeds, words};
use serde_json::Value;
use std::path::Path;

const SMALL: &str = "design --area 0.15x0.15 --resolution 15mm --latency 2ms --iou 0.7 --objects large";

fn json(dir: &Path, arguments: &str) -> Value {
    crate::command::json(dir, &words(arguments))
}

/// The design reaches what was asked for, its scene and its profile simulate, its check agrees, and a check of another
/// promise does not.
#[test]
fn a_design_is_simulated_and_checked() {
    let dir = tempfile::tempdir().unwrap();
    let design = json(dir.path(), &format!("{SMALL} --out d --json"));
    assert_eq!(design["taxels"], 100);
    assert_eq!(design["reached"], true);
    assert!(design["latency"]["acquisition_s"].as_f64().unwrap() <= 2e-3 * (1.0 + 1e-9));
    let iou = &design["expected"]["iou"];
    let [mean, low, high] = ["mean", "low", "high"].map(|k| iou[k].as_f64().unwrap());
    // a band that says something
    assert!(mean >= 0.7 && low < mean && mean < high && high - low < 0.25, "{iou}");
    assert!(design["expected"]["class"].is_null() && design["expected"]["no_class"].is_string());
    assert!(!design["alternatives"].as_array().unwrap().is_empty());
    let rows = design["row_source"] != "generator";
    let found = files(&dir.path().join("d"));
    for name in ["design.json", "profile.toml", "scene.toml", "curves.csv", "figures/design.png", "figures/design.svg"]
    {
        assert!(found.contains_key(name), "{name} is missing");
    }
    assert_eq!(found.contains_key("rows.txt"), rows);

    succeeds(dir.path(), &words("simulate d/scene.toml --out s"));
    succeeds(dir.path(), &words("simulate press/T --readout d/profile.toml --contact footprint --presses 1 --out t"));
    // its rows are those of the profile
    let session = std::fs::read_to_string(dir.path().join("t/session.json")).unwrap();
    let session: Value = serde_json::from_str(&session).unwrap();
    let period = session["compressive"]["info"]["weights"]["patterns"]["period"].as_u64();
    assert_eq!(period, design["m_per_wire"].as_u64().filter(|_| rows), "{period:?}");

    for seed in [2, 3] {
        let check = json(dir.path(), &format!("design check d --seed {seed} --json"));
        assert_eq!(check["agrees"], true, "{check}");
        assert_eq!(check["quantities"].as_array().unwrap().len(), 2);
    }
    // any number of threads, the same bytes
    let check =
        |threads: &str| succeeds(dir.path(), &words(&format!("design check d --json --threads {threads}"))).stdout;
    assert_eq!(check("1"), check("3"));

    // a promise that is too good
    let path = dir.path().join("d/design.json");
    let mut better = design.clone();
    better["expected"]["iou"] = serde_json::json!({"mean": 0.999, "low": 0.998, "high": 1.0});
    std::fs::write(&path, better.to_string()).unwrap();
    let output = spts(dir.path(), &words("design check d --json"));
    assert_eq!(output.status.code(), Some(1));
    let said: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(said["agrees"], false);
    assert!(String::from_utf8_lossy(&output.stderr).contains("outside of what was promised: IoU"));

    // a file that is none
    std::fs::write(&path, "{}").unwrap();
    refused(dir.path(), &words("design check d"), &["design.json", "missing field"]);
    refused(dir.path(), &words("design check nowhere"), &["nowhere/design.json", "spts design"]);
}

/// Equal questions have equal answers, for any number of threads.
#[test]
fn designs_do_not_depend_on_threads() {
    let dir = tempfile::tempdir().unwrap();
    for threads in [1, 3] {
        let out = format!("d{threads}");
        succeeds(dir.path(), &words(&format!("{SMALL} --seed 5 --threads {threads} --out {out}")));
    }
    let [one, three] = ["d1", "d3"].map(|d| files(&dir.path().join(d)));
    for (name, bytes) in &one {
        assert!(three.get(name) == Some(bytes), "{name} differs");
    }
}

/// What cannot be reached is said, with the best that is there; the status is 0, because the question is answered.
#[test]
fn what_is_out_of_reach_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let asked = "design --area 0.15x0.15 --resolution 15mm --latency 150us --iou 0.95 --wires 1 --json";
    let design = json(dir.path(), asked);
    assert_eq!(design["reached"], false);
    assert_eq!(design["binding"], "latency");
    assert!(design["expected"]["iou"]["mean"].as_f64().unwrap() < 0.95);
    let output = succeeds(dir.path(), &words(&asked.replace(" --json", "")));
    assert!(String::from_utf8_lossy(&output.stdout).contains("NOT REACHABLE"));
}

/// One wire reads as many taxels whatever is asked, and both commands say the same.
#[test]
fn one_wire_is_the_same_everywhere() {
    let dir = tempfile::tempdir().unwrap();
    let of = |arguments: &str| {
        let said = json(dir.path(), arguments);
        said["one_wire_taxels"].as_u64().unwrap_or_else(|| panic!("{arguments}: {said}"))
    };
    let circuit = of("circuit --json");
    assert_eq!(of("circuit --taxels 1000 --json"), circuit);
    assert_eq!(of(&format!("{SMALL} --json")), circuit);
    // a skin that is pressed less is larger
    assert!(of("circuit --pressed 0.05 --taxels 100 --json") > circuit);
    let said = succeeds(dir.path(), &words("circuit --taxels 100")).stdout;
    let said = String::from_utf8_lossy(&said).into_owned();
    assert!(said.contains(&format!("one wire works up to {circuit} taxels, 25 % of them pressed")), "{said}");
}
