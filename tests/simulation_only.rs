//! Decoders of the real skin that have seen simulated presses only, beside the same learned from the real raster
//! presses that are not scored. "Simulation" knows the objects' shapes, their places to half a taxel, their rotations to
//! 15° and nothing of their tilts. "Simulation, fitted" has them placed as `scripts/fit_objects.py` fitted them to
//! recorded raster images. "Calibrated" also knows the gains of the skin's taxels, from unscored raster presses of the
//! OTHER objects. Parameters of transducer and electronics were fitted to the recordings for all three.

use crate::score::score;
use serde_json::Value;

/// Most that single-shot classification may lose at M = 20, and an image's IoU: what the twin has to be good for.
const GAPS: [(&str, f64); 2] = [("class_single", 0.03), ("iou", 0.05)];

#[test]
#[ignore = "presses 17 objects on 32 skins and decodes every window of fifty presses three times"]
fn decoders_of_the_real_skin_learn_from_simulation() {
    let dir = tempfile::tempdir().unwrap();
    let sources = [
        "--learn-from",
        "raster,simulation,simulation_fitted,calibrated",
        "--no-ball",
        "--no-times",
    ];
    let decoders = ["--decoder", "evidence", "--measurements", "20"];
    let Some(board) = score(dir.path(), &[&sources[..], &decoders].concat()) else {
        return;
    };
    let of = |from: &str, score: &str| {
        let same = |r: &&Value| r["learned_from"] == from && r["m"] == 20;
        board["rows"].as_array().unwrap().iter().find(same).unwrap()[score]
            .as_f64()
            .unwrap()
    };
    for (score, most) in GAPS {
        let gap = of("raster", score) - of("simulation_fitted", score);
        assert!(gap <= most, "{score} loses {gap:.4}, at most {most}");
    }
    // what was asked for of templates that do not know the pose
    for (score, least) in [("class_single", 0.93), ("class_vote20", 0.99)] {
        let found = of("simulation", score);
        assert!(
            found >= least,
            "{score} without fitted places: {found:.4}, at least {least}"
        );
    }
    // gains that the other objects tell must not make it worse for classes; images of few contacts they do not help
    let gap = of("simulation_fitted", "class_single") - of("calibrated", "class_single");
    assert!(gap <= 0.01, "gains cost {gap:.4}");
}
