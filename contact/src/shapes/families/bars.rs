//! Bars and junctions of bars.

use crate::mesh::polygon::{self, Point};
use crate::shapes::dice::Dice;
use crate::shapes::plan::Plan;
use crate::shapes::stroke::{arc, stroke};
use std::f64::consts::TAU;

/// One straight or tapered bar with square or round ends, or two to four of them side by side.
pub(crate) fn bar(dice: &mut Dice) -> Plan {
    if dice.chance(0.3) {
        let (count, width) = (dice.whole(2, 4), dice.between(0.08, 0.2));
        let pitch = width * dice.between(1.7, 3.0);
        let bars = (0..count).map(|i| {
            let y = pitch * (i as f64 - 0.5 * (count as f64 - 1.0));
            polygon::placed(&polygon::rectangle(dice.between(1.2, 2.0), width), 0.0, [0.0, y])
        });
        return Plan::apart(bars.collect(), Vec::new(), 0.7 * width);
    }
    let width = dice.between(0.1, 0.6);
    let (low, high) = (0.5 * width * dice.between(0.4, 1.0), 0.5 * width);
    let outline = if dice.chance(0.35) {
        let mut ends = arc([1.0 - high, 0.0], [high, high], [-90.0, 90.0], 8);
        ends.extend(arc([low - 1.0, 0.0], [low, low], [90.0, 270.0], 8));
        ends
    } else {
        vec![[-1.0, -low], [1.0, -high], [1.0, high], [-1.0, low]]
    };
    Plan::simple(outline, 2.0 * low)
}

/// L, T, X, Y, Z, U, H or a star of up to six arms, with arms of random lengths.
pub(crate) fn junction(dice: &mut Dice) -> Plan {
    let width = dice.between(0.14, 0.42);
    let mut length = |low: f64| dice.between(low.max(1.4 * width), 1.2);
    let (a, b, c, d) = (length(0.5), length(0.5), length(0.5), length(0.5));
    let far = 2.2 * width + 0.6 * c;
    let paths: Vec<Vec<Point>> = match dice.whole(0, 7) {
        0 => vec![vec![[a, 0.0], [0.0, 0.0], [0.0, b]]],
        1 => vec![vec![[-a, 0.0], [b, 0.0]], vec![[0.0, 0.0], [0.0, -c]]],
        2 => vec![vec![[-a, 0.0], [b, 0.0]], vec![[0.0, d], [0.0, -c]]],
        3 => vec![vec![[-a, far], [0.0, far], [0.0, 0.0], [b, 0.0]]],
        4 => vec![vec![[0.0, a], [0.0, 0.0], [far, 0.0], [far, b]]],
        5 => vec![
            vec![[0.0, a], [0.0, -b]],
            vec![[far, c], [far, -d]],
            vec![[0.0, 0.0], [far, 0.0]],
        ],
        arms => {
            let arms = if arms == 6 { 3 } else { dice.whole(4, 6) };
            let start = dice.angle_rad();
            let lengths = [a, b, c, d, a, b];
            let arm = |i: usize| {
                let (s, c) = (start + TAU * i as f64 / arms as f64).sin_cos();
                vec![[0.0, 0.0], [lengths[i] * c, lengths[i] * s]]
            };
            (0..arms).map(arm).collect()
        }
    };
    let strokes = paths.iter().map(|path| stroke(path, width)).collect();
    Plan::union(strokes, Vec::new(), width)
}
