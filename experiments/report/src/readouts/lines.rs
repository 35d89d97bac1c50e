//! Lines of the benchmark's table.

use serde::Serialize;
use spts_recon::statistics::Band;
use spts_studies::readouts::{ReadoutRow, ReadoutTrial, ReadoutsReport};

/// A line of `readouts.csv`.
#[derive(Debug, Serialize)]
pub(super) struct TrialLine {
    readout: &'static str,
    wires: usize,
    taxels: usize,
    period_s: f64,
    feedback_ohm: f64,
    measurements: usize,
    frames_hz: f64,
    iou: Option<f64>,
    iou_low: Option<f64>,
    iou_high: Option<f64>,
    place_px: Option<f64>,
    place_px_low: Option<f64>,
    place_px_high: Option<f64>,
    accuracy: Option<f64>,
    accuracy_low: Option<f64>,
    accuracy_high: Option<f64>,
    noticed_s: Option<f64>,
    noticed_s_low: Option<f64>,
    noticed_s_high: Option<f64>,
    placed_s: Option<f64>,
    placed_s_low: Option<f64>,
    placed_s_high: Option<f64>,
    lost: f64,
    unnoticed: f64,
}

/// Mean and ends of a band.
fn ends(band: Option<Band>) -> [Option<f64>; 3] {
    [band.map(|b| b.mean), band.map(|b| b.low), band.map(|b| b.high)]
}

pub(super) fn lines(report: &ReadoutsReport) -> Vec<TrialLine> {
    let period_s = |row: &ReadoutRow| {
        let wire = report.wires.iter().find(|wire| wire.taxels == row.taxels);
        wire.map_or(0.0, |wire| wire.period_s)
    };
    let line = |(row, t): (&ReadoutRow, &ReadoutTrial)| {
        let [iou, iou_low, iou_high] = ends(t.iou);
        let [place_px, place_px_low, place_px_high] = ends(t.place_px);
        let [accuracy, accuracy_low, accuracy_high] = ends(t.accuracy);
        let [noticed_s, noticed_s_low, noticed_s_high] = ends(t.noticed_s);
        let [placed_s, placed_s_low, placed_s_high] = ends(t.placed_s);
        TrialLine {
            readout: row.readout,
            wires: row.wires,
            taxels: row.taxels,
            period_s: period_s(row),
            feedback_ohm: row.feedback_ohm,
            measurements: t.measurements,
            frames_hz: t.frames_hz,
            iou,
            iou_low,
            iou_high,
            place_px,
            place_px_low,
            place_px_high,
            accuracy,
            accuracy_low,
            accuracy_high,
            noticed_s,
            noticed_s_low,
            noticed_s_high,
            placed_s,
            placed_s_low,
            placed_s_high,
            lost: t.lost,
            unnoticed: t.unnoticed,
        }
    };
    let trials = report
        .rows
        .iter()
        .flat_map(|row| row.trials.iter().map(move |t| (row, t)));
    trials.map(line).collect()
}
