//! Evidence on the real skin: classes and places from few measurements, learned from raster presses that are not scored.

use crate::recordings::recordings;
use spts_experiments::real::{Real, load};
use spts_experiments::score::{EvidenceRow, EvidenceTask, Protocol, learn_evidence, score_evidence};

/// The five objects whose compressive sessions the numbers below are means of.
const OBJECTS: [&str; 5] = ["brain", "center", "eraser", "rec", "trig"];

fn real() -> Option<Real> {
    recordings().map(|path| load(&path).unwrap())
}

/// Rows of every object at every M, learned for `task`, or for the task without the object itself when `left_out`.
fn rows(
    real: &Real,
    task: EvidenceTask<'_>,
    left_out: bool,
    protocol: &Protocol,
    measurements: &[usize],
) -> Vec<Vec<EvidenceRow>> {
    let learn = |task: &EvidenceTask<'_>| learn_evidence(task, &real.arm.sessions, protocol, real.arm.cols).unwrap();
    let all = learn(&task);
    let objects = OBJECTS.iter().map(|object| {
        let session = real.arm.sessions.iter().find(|s| s.object == *object).unwrap();
        let without = left_out.then(|| {
            learn(&EvidenceTask {
                left_out: Some(object),
                ..task
            })
        });
        score_evidence(session, without.as_ref().unwrap_or(&all), protocol, measurements)
    });
    objects.collect()
}

/// Mean of one score over the objects, for every M.
fn mean(rows: &[Vec<EvidenceRow>], score: fn(&EvidenceRow) -> f64) -> Vec<f64> {
    let count = rows.iter().map(Vec::len).min().unwrap();
    (0..count)
        .map(|i| rows.iter().map(|r| score(&r[i])).sum::<f64>() / rows.len() as f64)
        .collect()
}

/// Floors, not values: what an evidence classifier written independently in numpy reached on the same windows was .902, .982, .997
/// single at M = 7, 13, 20, and every vote.
#[test]
#[ignore = "a minute on every window of fifty presses"]
fn classes_of_the_real_skin() {
    let Some(real) = real() else { return };
    let measurements = [5, 7, 10, 13, 20, 25, 50];
    let open = EvidenceTask {
        unknown: true,
        ..EvidenceTask::default()
    };
    let protocol = real.arm.protocol;
    let closed = rows(&real, EvidenceTask::default(), false, &protocol, &measurements);
    let known = rows(&real, open, false, &protocol, &measurements);
    let left_out = rows(&real, open, true, &protocol, &measurements);
    eprintln!(
        "  M: single, vote, summed, calibration, support, IoU, F1; with unknown: single, taken for it, vote, summed, calibration; left out: found unknown"
    );
    let columns: [Vec<f64>; 13] = [
        mean(&closed, |r| r.class_single),
        mean(&closed, |r| r.class_vote20),
        mean(&closed, |r| r.class_evidence),
        mean(&closed, |r| r.calibration_error),
        mean(&closed, |r| r.support),
        mean(&closed, |r| r.iou),
        mean(&closed, |r| r.f1),
        mean(&known, |r| r.class_single),
        mean(&known, |r| r.unknown),
        mean(&known, |r| r.class_vote20),
        mean(&known, |r| r.class_evidence),
        mean(&known, |r| r.calibration_error),
        mean(&left_out, |r| r.unknown),
    ];
    for (i, m) in measurements.iter().enumerate() {
        let line: Vec<String> = columns.iter().map(|c| format!("{:.4}", c[i])).collect();
        eprintln!("{m:>3}: {}", line.join("  "));
    }
    for (m, least) in [(13, 0.96), (20, 0.985), (25, 0.985)] {
        let at = measurements.iter().position(|n| *n == m).unwrap();
        for (what, column) in [("closed", 0), ("with unknown", 7)] {
            let got = columns[column][at];
            assert!(got >= least, "single at M = {m}, {what}: {got:.4}, at least {least}");
        }
        assert!(
            columns[1][at] >= 0.99 && columns[2][at] >= 0.99,
            "M = {m}: vote and sum"
        );
    }
}

/// A library that is one taxel off in both directions, on the first frames of every press: templates that may move make up for it.
#[test]
#[ignore = "a minute with every template at 25 places"]
fn shifted_templates_on_the_real_skin() {
    let Some(real) = real() else { return };
    let protocol = Protocol {
        frames: 10,
        ..real.arm.protocol
    };
    let single = |reach| {
        let task = EvidenceTask {
            moved: [1, 1],
            reach,
            ..EvidenceTask::default()
        };
        mean(&rows(&real, task, false, &protocol, &[20]), |r| r.class_single)[0]
    };
    let (still, moving) = (single(0), single(2));
    eprintln!("library off by one taxel each way, M = 20, single: {still:.4} as it is, {moving:.4} with 5 × 5 places");
    assert!(moving >= 0.9, "{moving:.4}");
}
