//! The report: complete, within its promises, and the same for any number of threads.

use crate::command::{files, succeeds, words};
use crate::recordings::recordings_without;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A quick report in `out`; whether there are recordings for it.
fn report(dir: &Path, out: &Path, threads: &str) -> bool {
    // without three of the five objects whose samples take the time
    let real = recordings_without(&["center", "eraser", "rec"], &dir.join(threads));
    let mut arguments = vec!["reproduce", "--quick", "--threads", threads, "--out", out.to_str().unwrap()];
    if let Some(path) = &real {
        arguments.extend(["--recordings", path.to_str().unwrap()]);
    }
    succeeds(dir, &arguments);
    real.is_some()
}

#[test]
#[ignore = "two reports: two minutes"]
fn a_report_does_not_depend_on_the_threads() {
    let dir = tempfile::tempdir().unwrap();
    let reports = ["1", "2"].map(|threads| {
        let out = dir.path().join(threads).join("report");
        report(dir.path(), &out, threads);
        out
    });
    for folder in ["tables", "arrays"] {
        let [one, two] = reports.each_ref().map(|out| files(&out.join(folder)));
        assert!(!one.is_empty());
        assert_eq!(one.keys().collect::<Vec<_>>(), two.keys().collect::<Vec<_>>());
        for (name, bytes) in &one {
            assert!(bytes == &two[name], "{folder}/{name} depends on the number of threads");
        }
    }
}

#[test]
fn a_quick_report_is_complete() {
    let dir = tempfile::tempdir().unwrap();
    // where it is kept for the tests in a browser
    let out = std::env::var_os("SPTS_REPORT").map_or(dir.path().join("report"), PathBuf::from);
    let real = report(dir.path(), &out, "2");
    let summary: Value = serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    check_headline(&summary["headline"], real);
    for key in ["seed", "git_revision", "mujoco_version", "cpu", "threads", "scene_hash"] {
        assert!(!summary["provenance"][key].is_null(), "no provenance.{key}");
    }
    let page = std::fs::read_to_string(out.join("index.html")).unwrap();
    assert!(!page.contains("http://") && !page.contains("https://"), "the page needs a network");
    for figure in words(
        "s5_objects 3b_classification 3c_support 3d_frequency 3e_latency 4_adaptive 5b_change 5c_peak \
          6_localisation s4_examples s6_dictionary",
    ) {
        for ending in ["svg", "png"] {
            let size = std::fs::metadata(out.join("figures").join(format!("{figure}.{ending}"))).unwrap().len();
            assert!(size > 1000, "{figure}.{ending} has {size} bytes");
        }
        assert!(page.contains(figure), "{figure} is not on the page");
    }
    check_tables(&page, &out.join("tables"), real);
}

/// Every table that the page links is there, and the scores of every skin on it are linked.
fn check_tables(page: &str, folder: &Path, with_recordings: bool) {
    let links = page.split("href=\"tables/").skip(1);
    let linked: Vec<&str> = links.filter_map(|rest| rest.split('"').next()).collect();
    for file in &linked {
        assert!(folder.join(file).is_file(), "{file} is linked and not there");
    }
    for skin in ["twin", "real"].into_iter().take(if with_recordings { 2 } else { 1 }) {
        for name in ["scores", "baselines"] {
            let file = format!("{name}_{skin}.csv");
            assert!(linked.contains(&file.as_str()), "{file} is not on the page");
        }
    }
}

/// What the twin promises. Contact, restitution and correlation within the bounds set for the twin; the scores must
/// beat what an empty image (support 0.85, IoU 0), chance (1/17) and a guess at the middle of the sheet (1.5 taxels)
/// get by a clear margin, and decoding must be faster than acquiring 25 measurements at 64.3 kHz.
fn check_headline(h: &Value, with_recordings: bool) {
    let within = |key: &str, low: f64, high: f64| {
        let value = h[key].as_f64().unwrap_or_else(|| panic!("no {key}"));
        assert!((low..=high).contains(&value), "{key} = {value} is outside [{low}, {high}]");
    };
    within("press_plateau_n", 19.9, 20.1);
    within("press_plateau_error_max_n", 0.0, 0.1);
    assert_eq!(h["presses_off_target"], 0);
    within("force_imbalance_max", 0.0, 1e-9);
    within("bounce_contact_ms_twin", 7.8, 8.8);
    within("bounce_cor_twin", 0.65, 0.78);
    within("bounce_cor_max_twin", 0.0, 1.0);
    // an empty image scores .85 on support and 0 on IoU
    within("support_m20_matched_twin", 0.87, 1.0);
    within("iou_m20_matched_twin", 0.5, 1.0);
    within("class_vote20_m20_matched_twin", 0.9, 1.0);
    within("localisation_px_m25_twin", 0.0, 1.5);
    within("decode_us_m25_median", 0.0, 389.0);
    if with_recordings {
        within("raster_corr_mean", 0.80, 1.0);
        within("raster_corr_min", 0.60, 1.0);
        within("bounce_contact_ms_real", 7.8, 8.8);
        within("localisation_px_m25_real", 0.0, 1.5);
    }
}
