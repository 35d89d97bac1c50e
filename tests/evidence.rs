//! Evidence on the real skin: classes and places from few measurements, learned from raster presses that are not scored.

use crate::recordings::recordings;
use spts_experiments::real::{Real, load};
use spts_experiments::score::{find_bounces, learn_evidence, localise_blobs, score_evidence};

/// The five objects whose compressive sessions the numbers below are means of.
const OBJECTS: [&str; 5] = ["brain", "center", "eraser", "rec", "trig"];

fn real() -> Option<Real> {
    recordings().map(|path| load(&path).unwrap())
}

/// Means over the objects, for every M: single, vote, summed, unknown, calibration error, support, IoU, F1.
fn means(real: &Real, unknown: bool, measurements: &[usize]) -> Vec<[f64; 8]> {
    let classifier = learn_evidence(&real.arm.sessions, &real.arm.protocol, real.arm.cols, unknown).unwrap();
    let mut means = vec![[0.0; 8]; measurements.len()];
    for object in OBJECTS {
        let session = real.arm.sessions.iter().find(|s| s.object == object).unwrap();
        let rows = score_evidence(session, &classifier, &real.arm.protocol, measurements);
        for (mean, r) in means.iter_mut().zip(rows) {
            let scores = [
                r.class_single,
                r.class_vote20,
                r.class_evidence,
                r.unknown,
                r.calibration_error,
                r.support,
                r.iou,
                r.f1,
            ];
            mean.iter_mut().zip(scores).for_each(|(m, s)| *m += s / 5.0);
        }
    }
    means
}

/// Floors, not values: what an evidence classifier written independently in numpy reached on the same windows was .902, .982, .997
/// single at M = 7, 13, 20, and every vote.
#[test]
#[ignore = "a minute on every window of fifty presses"]
fn classes_of_the_real_skin() {
    let Some(real) = real() else { return };
    let measurements = [5, 7, 10, 13, 20, 25, 50];
    let [closed, open] = [false, true].map(|unknown| means(&real, unknown, &measurements));
    eprintln!("  M single   vote summed calibration support   IoU    F1 | with unknown: single  taken for it");
    for ((m, s), o) in measurements.iter().zip(&closed).zip(&open) {
        eprintln!(
            "{m:>3}  {:.4}  {:.3}  {:.3}      {:.4}   {:.3} {:.3} {:.3} | {:.4} {:.4}",
            s[0], s[1], s[2], s[4], s[5], s[6], s[7], o[0], o[3]
        );
    }
    for (m, least) in [(13, 0.96), (20, 0.985), (25, 0.985)] {
        let at = measurements.iter().position(|n| *n == m).unwrap();
        assert!(
            closed[at][0] >= least,
            "single at M = {m}: {:.4}, at least {least}",
            closed[at][0]
        );
        assert!(
            closed[at][1] >= 0.99 && closed[at][2] >= 0.99,
            "M = {m}: {:?}",
            closed[at]
        );
    }
}

/// Relabelled, because the middle of the sheet is a good guess for the drops as recorded.
#[test]
#[ignore = "half a minute on all places of six drops"]
fn places_of_the_real_ball() {
    let Some(real) = real() else { return };
    let recording = real.arm.bounces.unwrap();
    let bounces = find_bounces(&recording);
    let measurements = [5, 7, 10, 15, 20, 25];
    for relabelled in [false, true] {
        let rows = localise_blobs(&recording, &bounces, &measurements, real.arm.cols, relabelled).unwrap();
        for r in &rows {
            eprintln!(
                "{:<16} {:>3}  {:.2} px  {:.3} under 1 px",
                r.decode, r.m, r.mean_px, r.share_under_1px
            );
        }
        if relabelled {
            assert!(rows[2].mean_px < 1.0, "M = 10: {:.3} px", rows[2].mean_px);
            assert!(
                rows[3].share_under_1px >= 0.95,
                "M = 15: {:.4} under 1 px",
                rows[3].share_under_1px
            );
        }
    }
}
