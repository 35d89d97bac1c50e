//! Outlines that several families use, centred on the origin.

use super::dice::Dice;
use crate::mesh::polygon::{self, Point};
use std::f64::consts::{PI, TAU};

/// Number of sides of round things. A circle departs from 32 sides by 0.5 % of its radius.
pub(super) const ROUND: usize = 32;

/// Regular polygon of `sides` corners on a circle of 1, a corner or a side towards −y.
pub(super) fn regular(sides: usize, side_down: bool) -> Vec<Point> {
    let shift = if side_down { PI / sides as f64 } else { 0.0 };
    polygon::placed(&polygon::circle(1.0, sides), shift - 0.5 * PI, [0.0; 2])
}

/// Smooth random outline of mean radius 1, star-shaped about the origin, with its least radius.
pub(super) fn blob(dice: &mut Dice, waviness: f64) -> (Vec<Point>, f64) {
    let waves = [2.0, 3.0, 4.0, 5.0].map(|k: f64| {
        let amplitude = waviness * dice.between(-1.0, 1.0) / k.sqrt();
        (k, amplitude, dice.angle_rad())
    });
    let stretch = dice.between(0.65, 1.0);
    let mut least = f64::INFINITY;
    let points = polygon::circle(1.0, ROUND + 8).into_iter().map(|[c, s]| {
        let angle = s.atan2(c);
        let wave: f64 = waves.iter().map(|&(k, a, phase)| a * (k * angle + phase).cos()).sum();
        // e^wave is positive whatever the amplitudes
        let radius = wave.clamp(-1.2, 1.2).exp();
        let p = [radius * c, stretch * radius * s];
        least = least.min(p[0].hypot(p[1]));
        p
    });
    let points = points.collect();
    (points, least)
}

/// Star or gear of `teeth`, radius 1 at the tips and `root` between them. `pointed` or with flat tips.
pub(super) fn gear(teeth: usize, root: f64, pointed: bool) -> Vec<Point> {
    let pitch = TAU / teeth as f64;
    let corners: &[(f64, bool)] = if pointed {
        &[(0.0, true), (0.5, false)]
    } else {
        &[(-0.22, true), (0.22, true), (0.3, false), (0.7, false)]
    };
    (0..teeth)
        .flat_map(|i| corners.iter().map(move |&(at, tip)| (i as f64 + at, tip)))
        .map(|(at, tip)| {
            let (s, c) = (at * pitch + 0.5 * PI).sin_cos();
            let radius = if tip { 1.0 } else { root };
            [radius * c, radius * s]
        })
        .collect()
}

/// Stretched along y by `factor`.
pub(super) fn stretched(outline: Vec<Point>, factor: f64) -> Vec<Point> {
    outline.into_iter().map(|[x, y]| [x, factor * y]).collect()
}

/// Smaller by `factor` about the origin.
pub(super) fn shrunk(outline: &[Point], factor: f64) -> Vec<Point> {
    outline.iter().map(|[x, y]| [factor * x, factor * y]).collect()
}

/// A plain convex outline about 1 in radius and its least width: rectangle, polygon, trapezoid, ellipse.
pub(super) fn convex(dice: &mut Dice) -> (Vec<Point>, f64) {
    let stretch = dice.between(0.55, 1.0);
    match dice.whole(0, 4) {
        0 => (polygon::rectangle(2.0, 2.0 * stretch), 2.0 * stretch),
        1 => {
            let sides = dice.whole(3, 8);
            let width = if sides == 3 { 1.5 } else { 1.7 };
            (stretched(regular(sides, true), stretch), width * stretch)
        }
        2 => {
            let (top, shear) = (dice.between(0.35, 0.9), dice.between(-0.4, 0.4));
            let corners = [
                [-1.0, -stretch],
                [1.0, -stretch],
                [shear + top, stretch],
                [shear - top, stretch],
            ];
            (corners.to_vec(), 1.2 * stretch)
        }
        _ => (polygon::ellipse(1.0, stretch, ROUND), 2.0 * stretch),
    }
}
