//! `spts calibrate` and `spts compare` on the recordings of the real skin, and what they say to recordings that will
//! not do.

use crate::command::{json, succeeds};
use crate::recordings::{recordings, recordings_without};
use serde_json::Value;
use spts_circuit::Profile;
use std::path::Path;

/// Sessions with a compressive recording.
const SESSIONS: [&str; 5] = ["brain", "center", "eraser", "rec", "trig"];

/// Numbers of an independent analysis in numpy (`reference.json` beside the recordings, table `forward`): its name,
/// ours, and the largest difference, relative and absolute. The two differ in frames, windows and what is an outlier.
/// What of the residual is creep depends on the windows (3 %), on the frames another 2 %; a fit's 4 to 10 % of the taps
/// are put back here and not there; idle frames 0–149 against the analysis' own.
const REFERENCE: [(&str, &str, f64, f64); 12] = [
    ("resid", "residual", 0.05, 0.0),
    ("resid_isi", "clean_residual", 0.05, 0.0),
    ("resid_robust", "core_residual", 0.03, 0.0),
    ("offset", "offset", 0.0, 0.008),
    // ours are medians over the presses, theirs means, which a first press of 0.64 of the others and the growth after
    // it lower by 2 %; ours has the mis-seeded cell of the trig session, 0.33 of 7.2 V
    ("sumx_pm", "sum", 0.07, 0.0),
    ("normx", "norm", 0.04, 0.0),
    ("idle_mean", "idle_mean", 0.0, 0.003),
    ("idle_std_y", "idle_sd", 0.02, 0.0),
    ("idle_resid", "idle_noise", 0.02, 0.0),
    ("idle_evenodd", "idle_parity", 0.0, 0.002),
    ("outlier5", "outliers_5sd", 0.10, 0.0),
    // ours takes every outlier for a late update where nearly all match a flip by chance; theirs explains 73 to 98 % of
    // them: 1/0.73
    ("late_per_flip", "late_per_flip", 0.37, 0.0),
];
/// Largest difference of the taps h1, h2, h3.
const TAPS: f64 = 0.003;
/// The session with a cell that is not ±1. The independent analysis takes it for ±1: its residuals, outliers and taps
/// have what the cell adds, ours do not.
const OVERDRIVEN: &str = "trig";
const BIASED_THERE: [&str; 5] = ["resid_isi", "resid_robust", "outlier5", "late_per_flip", "isi_h123"];

/// Least share of the numbers of sessions that were left out in the 90 % spans of the other sessions.
const LEAST_INSIDE: f64 = 0.85;

fn calibrated(recordings: &Path, dir: &Path) -> Value {
    json(dir, &["calibrate", recordings.to_str().unwrap(), "--out", "skin.toml", "--json"])
}

fn number(report: &Value, session: &str, name: &str) -> f64 {
    let sessions = report["sessions"].as_array().unwrap();
    let found = sessions.iter().find(|s| s["session"] == session).unwrap();
    found["numbers"][name]["value"].as_f64().unwrap()
}

/// The shipped profile is what the command gives, and the estimators find what an independent analysis found.
#[test]
fn the_published_recordings_give_the_shipped_profile() {
    let Some(recordings) = recordings() else { return };
    let dir = tempfile::tempdir().unwrap();
    let report = calibrated(&recordings, dir.path());
    let text = std::fs::read_to_string(dir.path().join("skin.toml")).unwrap();
    assert_eq!(Profile::from_toml(&text).unwrap(), Profile::named("as_built").unwrap());

    // spans made for nine in ten: of forty numbers each left out, one in twenty fewer may be inside
    let predicted = &report["predicted_inside"];
    let share = predicted["share"].as_f64().unwrap();
    assert!(share >= LEAST_INSIDE, "{predicted}");
    assert_eq!(predicted["numbers"].as_array().unwrap().len(), 8);

    let Ok(text) = std::fs::read_to_string(recordings.join("reference.json")) else {
        return;
    };
    let reference: Value = serde_json::from_str(&text).unwrap();
    for session in SESSIONS {
        let known = &reference["forward"][session];
        let close = |name: &str, found: f64, expected: f64, most: f64| {
            eprintln!("{session} {name}: {found:.5}, independent {expected:.5}");
            assert!((found - expected).abs() <= most, "{session} {name}: {found}, expected {expected} ± {most}");
        };
        for (theirs, ours, share, most) in REFERENCE {
            if session == OVERDRIVEN && BIASED_THERE.contains(&theirs) {
                continue;
            }
            let expected = known[theirs].as_f64().unwrap();
            close(ours, number(&report, session, ours), expected, share * expected.abs() + most);
        }
        if session == OVERDRIVEN && BIASED_THERE.contains(&"isi_h123") {
            continue;
        }
        for (tap, expected) in ["h1", "h2", "h3"].into_iter().zip(known["isi_h123"].as_array().unwrap()) {
            close(tap, number(&report, session, tap), expected.as_f64().unwrap(), TAPS);
        }
    }
    // the cell of the trig session that took the mode byte, 2, for its seed
    let trig = report["sessions"].as_array().unwrap().iter().find(|s| s["session"] == "trig").unwrap();
    assert_eq!((&trig["overdriven"][0]["taxel"], &trig["overdriven"][0]["seed"]), (&56.into(), &2.into()));
}

#[test]
#[ignore = "replays five sessions: a quarter of a minute"]
fn the_twin_s_recordings_have_the_skin_s_statistics() {
    let Some(recordings) = recordings() else { return };
    let dir = tempfile::tempdir().unwrap();
    let report: Value = json(dir.path(), &["compare", recordings.to_str().unwrap(), "--no-curves", "--json"]);
    let statistics = report["statistics"].as_array().unwrap();
    assert_eq!(statistics.len(), 9 * SESSIONS.len());
    for statistic in statistics {
        assert_eq!(statistic["ok"], true, "{statistic}");
    }
    let not_modelled = report["not_modelled"].as_array().unwrap();
    assert_eq!(not_modelled.len(), 3 * SESSIONS.len());
    assert!(not_modelled.iter().all(|s| s["ok"].is_null()));
    assert!(dir.path().join("out/compare/figures/residuals.png").is_file());
}

#[test]
#[ignore = "scores twin and skin: two minutes"]
fn the_twin_s_scores_are_the_skin_s() {
    let Some(recordings) = recordings() else { return };
    let dir = tempfile::tempdir().unwrap();
    let report: Value = json(dir.path(), &["compare", recordings.to_str().unwrap(), "--json"]);
    let curves = report["curves"].as_array().unwrap();
    assert_eq!(curves.len(), 9);
    for curve in curves {
        assert_eq!(curve["ok"], true, "{curve}");
    }
}

/// Mean over the objects of |twin − real| of the IoU at M = 20, at most: decoder, images, bound. Measured with eight
/// skins: 0.053 and 0.086 for the twin. One simulated skin scatters about the mean of the others by 0.120 and 0.066; of
/// the mean of eight, √8 less, 0.04 and 0.02, is added. The skin's own compressive images leave what the electronics
/// do: 0.009 each, as one draw of the readout (0.012, 0.008), twice which is added.
const DISTANCES: [(&str, &str, f64); 4] = [
    ("matched", "twin", 0.10),
    ("nn_lmmse", "twin", 0.11),
    ("matched", "skin_compressive", 0.035),
    ("nn_lmmse", "skin_compressive", 0.03),
];

/// Object by object, errors of opposite sign do not cancel: the twin is as near as was measured, and the electronics
/// are not what is left.
#[test]
#[ignore = "presses seventeen objects on eight simulated skins, twice: five minutes"]
fn the_twin_s_objects_are_the_skin_s() {
    let Some(recordings) = recordings() else { return };
    let dir = tempfile::tempdir().unwrap();
    let source = recordings.to_str().unwrap();
    let arguments = ["compare", source, "--no-curves", "--skins", "8", "--causes", "--json"];
    let report: Value = json(dir.path(), &arguments);
    let distances = report["per_object"]["distances"].as_array().unwrap();
    for (decoder, images, most) in DISTANCES {
        let same = |d: &&Value| d["decoder"] == decoder && d["images"] == images && d["m"] == 20 && d["score"] == "iou";
        let found = distances.iter().find(same).unwrap();
        eprintln!("{found}");
        assert_eq!(found["objects"], SESSIONS.len());
        assert!(found["mean_abs_difference"].as_f64().unwrap() <= most, "{found}, at most {most}");
    }
    assert!(dir.path().join("out/compare/figures/per_object.svg").is_file());
}

/// The numbers of two sessions do not depend on the number of threads.
#[test]
#[ignore = "calibrates and replays two sessions twice: a minute"]
fn threads_do_not_show() {
    let dir = tempfile::tempdir().unwrap();
    let Some(two) = recordings_without(&["center", "eraser", "rec"], dir.path()) else { return };
    let source = two.to_str().unwrap();
    let told = |threads: &str| {
        let calibrated = succeeds(dir.path(), &["calibrate", source, "--json", "--threads", threads]);
        let compared = succeeds(dir.path(), &["compare", source, "--no-curves", "--json", "--threads", threads]);
        let table = std::fs::read(dir.path().join("out/compare/compare.csv")).unwrap();
        (calibrated.stdout, compared.stdout, table)
    };
    assert!(told("1") == told("2"), "one and two threads differ");
}

/// Sessions are new ones to a profile that was fitted to the others: of 35 numbers, nine in ten should lie in the band
/// of their twins. With four twins 32 do, with 24 twins 29.
#[test]
#[ignore = "replays the sessions of the real skin many times"]
fn sessions_are_predicted_by_the_others() {
    let Some(recordings) = recordings() else { return };
    let dir = tempfile::tempdir().unwrap();
    let others = ["compare", recordings.to_str().unwrap(), "--profile", "others", "--draws", "4", "--json"];
    let report: Value = json(dir.path(), &others);
    let rows = report["predicted"].as_array().unwrap();
    assert_eq!(rows.len(), 7 * SESSIONS.len());
    let inside = rows.iter().filter(|row| row["inside"] == true).count();
    assert!(inside as f64 >= LEAST_INSIDE * rows.len() as f64, "{inside} of {}", rows.len());
}

/// The skin's own images replaced by simulated ones: what the readout adds stays as it was, the output's range follows
/// from the simulated forces and gains alone.
#[test]
#[ignore = "replays the sessions of the real skin"]
fn simulated_images_go_through_the_readout() {
    let Some(recordings) = recordings() else { return };
    let dir = tempfile::tempdir().unwrap();
    let compare = ["compare", recordings.to_str().unwrap(), "--no-curves", "--images", "simulated", "--json"];
    let report: Value = json(dir.path(), &compare);
    let rows = report["statistics"].as_array().unwrap();
    for name in ["h1", "h2", "late_per_flip", "idle_noise", "step_v"] {
        let same: Vec<&Value> = rows.iter().filter(|row| row["name"] == name).collect();
        assert_eq!(same.len(), SESSIONS.len());
        assert!(same.iter().all(|row| row["ok"] == true), "{name}: {same:?}");
    }
    let gaps = rows.iter().filter(|row| row["name"] == "quantile_gap");
    for gap in gaps {
        // sessions of one object differ by .5 to 1.4 in amplitude, which is .2 of the range at most here
        assert!(gap["twin"].as_f64().unwrap() < 0.25, "{gap}");
    }
}
