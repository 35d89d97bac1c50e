//! The recordings of the real skin, scored: `spts validate` must find what an independent analysis found in them.

use crate::command::{json, spts};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Directory of the recordings: `SPTS_RECORDINGS`, or the folder beside the checkout. `None`, with a message, when
/// there is none: they are not part of this project.
pub(crate) fn recordings() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/recordings");
    let path = std::env::var_os("SPTS_RECORDINGS").map_or(beside, PathBuf::from);
    let found = path.canonicalize().ok().filter(|p| p.join("presses").is_dir());
    if found.is_none() {
        eprintln!("skipped: no recordings of the real skin; set SPTS_RECORDINGS to their directory");
    }
    found
}

/// The recordings, if the robot's arm is among them.
pub(crate) fn recordings_with_arm() -> Option<PathBuf> {
    let found = recordings().filter(|root| root.join("robot_arm").is_dir());
    if found.is_none() {
        eprintln!("skipped: no recordings of the robot's arm");
    }
    found
}

/// The recordings without the presses of the objects `left_out`, which are linked into `folder`.
pub(crate) fn recordings_without(left_out: &[&str], folder: &Path) -> Option<PathBuf> {
    let all = recordings()?;
    let link = |from: &Path, to: &Path| {
        std::fs::create_dir_all(to).unwrap();
        for entry in std::fs::read_dir(from).unwrap().map(Result::unwrap) {
            let name = entry.file_name();
            if name != "presses" && !left_out.iter().any(|object| name == *object) {
                std::os::unix::fs::symlink(entry.path(), to.join(name)).unwrap();
            }
        }
    };
    let some = folder.join("recordings");
    link(&all, &some);
    link(&all.join("presses"), &some.join("presses"));
    Some(some)
}

/// Numbers of measurements of the table.
const M: [u64; 6] = [5, 10, 20, 25, 50, 100];

/// Means over brain, center, eraser, rec and trig (presses 6–15, published dictionary and library), from an independent
/// analysis of the same recordings in numpy, rounded to three decimals: decode, score, value at each M.
const SCORES: [(&str, &str, [f64; 6]); 8] = [
    ("script_s20", "support", [0.845, 0.866, 0.880, 0.884, 0.918, 0.939]),
    ("script_m4", "support", [0.798, 0.865, 0.889, 0.895, 0.917, 0.942]),
    ("matched", "support", [0.838, 0.898, 0.925, 0.935, 0.957, 0.967]),
    ("script_s20", "iou", [0.269, 0.363, 0.449, 0.469, 0.604, 0.691]),
    ("matched", "iou", [0.301, 0.506, 0.625, 0.666, 0.765, 0.803]),
    ("script_s20", "class_vote20", [0.377, 0.727, 0.859, 0.887, 0.961, 0.956]),
    ("script_m4", "class_vote20", [0.000, 0.853, 0.978, 0.985, 0.973, 0.938]),
    ("matched", "class_vote20", [0.661, 0.972, 0.999, 1.0, 1.0, 1.0]),
];

/// Both analyses follow the same rules on the same windows; what may differ is how ties and rounding end a pursuit, and
/// over which idle frames the mean is taken. 0.01 is a twelfth of what the two readings of the weights differ by.
const SUPPORT_TOLERANCE: f64 = 0.01;
/// A vote flips on one of 20 windows: 750 votes, so 0.02 is 15 of them.
const VOTE_TOLERANCE: f64 = 0.02;

#[test]
fn the_real_skin_scores_what_it_is_known_to_score() {
    are_known(|m| m == 20);
}

#[test]
#[ignore = "every window at six numbers of measurements: half a minute"]
fn the_real_skin_scores_what_it_is_known_to_score_at_any_number() {
    are_known(|_| true);
}

/// Checks the scores at the numbers of measurements that are `asked` for.
fn are_known(asked: impl Fn(u64) -> bool) {
    let Some(recordings) = recordings() else { return };
    let dir = tempfile::tempdir().unwrap();
    let measurements: Vec<String> = M.into_iter().filter(|m| asked(*m)).map(|m| m.to_string()).collect();
    let path = recordings.to_str().unwrap();
    let report: Value = json(dir.path(), &["validate", path, "--measurements", &measurements.join(","), "--json"]);
    for (decode, score, expected) in SCORES {
        for (m, expected) in M.into_iter().zip(expected).filter(|(m, _)| asked(*m)) {
            let row = row(&report, "mean", decode, m);
            let found = row[score].as_f64().unwrap();
            let tolerance = if score == "class_vote20" { VOTE_TOLERANCE } else { SUPPORT_TOLERANCE };
            assert!(
                (found - expected).abs() <= tolerance,
                "{decode} {score} at M = {m}: {found:.4}, expected {expected:.3} ± {tolerance}"
            );
        }
    }
    // an empty image scores 1 − contact area, which the recordings' ground truth fixes exactly
    let empty = report["baselines"].as_array().unwrap().iter();
    let mean = empty.clone().find(|b| b["object"] == "mean" && b["baseline"] == "empty").unwrap();
    assert!((mean["support"].as_f64().unwrap() - 0.848).abs() < 0.0005);
    assert!(report["missing"].as_array().is_some());
    assert!(report["localisation"].as_array().is_some_and(|rows| !rows.is_empty()));
}

fn row<'a>(report: &'a Value, object: &str, decode: &str, m: u64) -> &'a Value {
    let rows = report["rows"].as_array().unwrap();
    rows.iter()
        .find(|r| r["object"] == object && r["decode"] == decode && r["m"] == m)
        .unwrap_or_else(|| panic!("no row for {object}, {decode}, M = {m}"))
}

/// A single object is enough, and the root of a clone of the original repository is read as this layout is.
#[test]
fn any_subset_in_the_original_layout_will_do() {
    let Some(recordings) = recordings() else { return };
    let dir = tempfile::tempdir().unwrap();
    let (own, clone) = (dir.path().join("own"), dir.path().join("clone/Data_Analysis"));
    for (here, there) in [
        ("presses/brain/brain_raster.mat", "Measurements_Collected/brain/brain_raster.mat"),
        ("presses/brain/brain_random2.mat", "Measurements_Collected/brain/brain_random2.mat"),
        ("presses/brain/brain_random2_time.mat", "Measurements_Collected/brain/brain_random2_time.mat"),
        ("dictionary.mat", "Dictionary_Learning/dictionary.mat"),
        ("SRC_lib.mat", "SRC_Library/SRC_lib.mat"),
    ] {
        for to in [own.join(here), clone.join(there)] {
            std::fs::create_dir_all(to.parent().unwrap()).unwrap();
            std::fs::copy(recordings.join(here), to).unwrap();
        }
    }
    let validate = |root: &str| json(dir.path(), &["validate", root, "--measurements", "20", "--json"]);
    let report = validate("clone");
    assert_eq!(report, validate("own"));
    assert_eq!(report, validate("clone/Data_Analysis"));
    assert_eq!(row(&report, "mean", "matched", 20)["iou"], row(&report, "brain", "matched", 20)["iou"]);
    let missing = report["missing"].as_array().unwrap();
    assert!(missing.iter().any(|m| m.as_str().unwrap().contains("center")), "{missing:?}");
    assert!(missing.iter().any(|m| m.as_str().unwrap().contains("ball")), "{missing:?}");
}

/// A published file that was cut short, as by an interrupted download: one line that says so.
#[test]
fn a_truncated_recording_is_one_clear_error() {
    let Some(recordings) = recordings() else { return };
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("cut/presses/brain");
    std::fs::create_dir_all(&folder).unwrap();
    let whole = std::fs::read(recordings.join("presses/brain/brain_raster.mat")).unwrap();
    for share in [0.001, 0.5, 0.999] {
        #[expect(clippy::cast_possible_truncation, reason = "a share of a file's length")]
        let length = (whole.len() as f64 * share) as usize;
        std::fs::write(folder.join("brain_raster.mat"), &whole[..length]).unwrap();
        let output = spts(dir.path(), &["validate", "cut"]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
        let expected = format!("the file ends after {length} bytes");
        assert!(said.contains("brain_raster.mat") && said.contains(&expected), "{said}");
    }
}
