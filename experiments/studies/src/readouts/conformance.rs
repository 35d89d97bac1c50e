//! Properties that every readout must have.

use super::readout::ReadoutSkin;
use super::table::ReadoutLine;
use super::wire::WireSession;
use super::wiring::SkinWire;
use crate::touches::{Touch, TouchScore};
use spts_models::{ConductanceMap, SkinLayout, Streams};
use std::sync::Arc;

/// IoU with the most measurements, of a contact that stands out, at least: two thirds of the taxels are right.
const LEAST_IOU: f64 = 0.6;

/// Rows and columns of the skins: one that is decoded under a prior of whole images, and a larger one.
const SKINS: [[usize; 2]; 2] = [[12, 9], [24, 20]];

/// A plate of 4 × 3 taxels pressed on a skin, or nothing.
fn plate(layout: &SkinLayout, pressed_s: f64) -> Touch {
    let (rows, cols) = (layout.rows(), layout.cols());
    let inside = |k: usize| (5..9).contains(&(k / cols)) && (2..5).contains(&(k % cols));
    let values = (0..rows * cols)
        .map(|k| if inside(k) { pressed_s } else { 0.0 })
        .collect();
    Touch {
        name: Arc::from("plate"),
        conductance_s: ConductanceMap::from_values(rows, cols, values),
        support: (0..rows * cols).map(inside).collect(),
        centre_px: Some([6.5, 3.0]),
    }
}

/// Checks a readout on skins that are not square. Numbers of measurements must increase; images must have one finite
/// value ≥ 0 for each taxel; times must be positive and in order. A strong contact must be shown and noticed, and an
/// untouched skin must not be. Equal wires must give equal readings, in any order of touches.
///
/// # Panics
/// If a property fails; the message names the readout.
pub fn conformance(line: &ReadoutLine) {
    SKINS.iter().for_each(|skin| on_skin(line, *skin));
}

fn on_skin(line: &ReadoutLine, [rows, cols]: [usize; 2]) {
    let name = line.name;
    let layout = SkinLayout::with_pitch(rows, cols, 15e-3).expect("a skin");
    let taxels = u32::try_from(layout.taxels()).expect("few");
    let skin = ReadoutSkin::new(layout, 7);
    let readout = (line.build)().prepare(&skin).expect(name);
    let (touch, nothing) = (plate(&layout, 150e-6), plate(&layout, 0.0));
    let wire = SkinWire::new(taxels, touch.conductance_s.values()).expect(name);
    let pressed: Vec<f64> = touch.conductance_s.values().iter().map(|g| g + wire.idle_s).collect();
    let largest_sum_s = readout.largest_sum_s(&pressed);
    let all_s: f64 = pressed.iter().sum();
    assert!(
        largest_sum_s > 0.0 && largest_sum_s <= all_s + 1e-12,
        "{name}: {largest_sum_s} S of {all_s} S"
    );
    let device = Streams::new(11);
    let fitted = wire.fitted(largest_sum_s, device).expect(name);
    let session = || WireSession::new(&fitted, layout, device, wire.period_s, [wire.idle_s, wire.pressed_s()]);

    let mut first = session();
    let readings = readout.read(&mut first.hold(&touch, 0)).expect(name);
    assert!(!readings.is_empty(), "{name}: no reading");
    for pair in readings.windows(2) {
        assert!(pair[0].measurements < pair[1].measurements, "{name}: measurements rise");
    }
    for reading in &readings {
        assert!(
            reading.measurements > 0 && reading.image.len() == layout.taxels(),
            "{name}"
        );
        assert!(
            reading.image.iter().all(|v| v.is_finite() && *v >= 0.0),
            "{name}: {:?}",
            reading.image
        );
        if let (Some(noticed), Some(placed)) = (reading.noticed, reading.placed) {
            assert!(
                0.5 <= noticed && noticed <= placed,
                "{name}: noticed {noticed}, placed {placed}"
            );
        }
    }
    let best = readings.last().expect("one reading");
    let score = TouchScore::of(&best.image, &touch, &layout);
    assert!(score.iou >= LEAST_IOU, "{name}: IoU {}", score.iou);
    assert!(
        score.place_px.is_some_and(|place| place < 1.0),
        "{name}: place {:?}",
        score.place_px
    );
    assert!(best.noticed.is_some(), "{name}: a contact is not noticed");

    let idle = readout.read(&mut first.hold(&nothing, 1)).expect(name);
    assert_eq!(idle.len(), readings.len(), "{name}: as many readings of nothing");
    assert!(
        idle.iter().all(|reading| reading.noticed.is_none()),
        "{name}: noticed nothing"
    );

    let mut second = session();
    let before = readout.read(&mut second.hold(&nothing, 1)).expect(name);
    let again = readout.read(&mut second.hold(&touch, 0)).expect(name);
    assert!(
        before == idle && again == readings,
        "{name}: the order of touches shows"
    );
    let other = readout.read(&mut second.hold(&touch, 2)).expect(name);
    assert!(other != readings, "{name}: no noise");
}

#[cfg(test)]
mod tests {
    use super::super::table::READOUTS;
    use super::*;

    #[test]
    fn every_readout_conforms() {
        for line in READOUTS {
            conformance(line);
        }
    }
}
