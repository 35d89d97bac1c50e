//! Decoders of the real skin that have seen simulated presses only, beside the same learned from the real raster
//! presses that are not scored. The twin was fitted to the skin before (`scripts/fit_objects.py`): sizes and places of
//! the objects to recorded raster images, the transducer's law to them and to sums of compressive presses, scored ones
//! among both. Beyond that "simulation" knows nothing of the skin. "Calibrated" also knows the gains of its taxels,
//! from unscored raster presses of the OTHER objects.

use crate::score::score;
use serde_json::Value;

/// Most that single-shot classification may lose at M = 20, and an image's IoU: what the twin has to be good for.
const GAPS: [(&str, f64); 2] = [("class_single", 0.03), ("iou", 0.05)];

#[test]
#[ignore = "presses 17 objects on 32 skins and decodes every window of fifty presses three times"]
fn decoders_of_the_real_skin_learn_from_simulation() {
    let dir = tempfile::tempdir().unwrap();
    let sources = ["--learn-from", "raster,simulation,calibrated", "--no-ball"];
    let decoders = ["--decoder", "evidence", "--measurements", "7,13,20"];
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
        let gap = of("raster", score) - of("simulation", score);
        assert!(gap <= most, "{score} loses {gap:.4}, at most {most}");
    }
    // gains that the other objects tell must not make it worse for classes; images of few contacts they do not help
    let gap = of("simulation", "class_single") - of("calibrated", "class_single");
    assert!(gap <= 0.01, "gains cost {gap:.4}");
}
