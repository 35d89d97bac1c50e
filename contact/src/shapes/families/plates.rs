//! Plates with and without holes.

use crate::mesh::polygon::{self, Point};
use crate::shapes::boundary::{Side, depth_m, sides};
use crate::shapes::dice::Dice;
use crate::shapes::outlines::{convex, regular};
use crate::shapes::plan::Plan;

/// Rectangle, polygon of three to eight sides, trapezoid or ellipse.
pub(crate) fn plate(dice: &mut Dice) -> Plan {
    let (outline, width) = convex(dice);
    Plan::simple(outline, width)
}

/// A plate with one to six round, square or slot-like holes.
pub(crate) fn perforated(dice: &mut Dice) -> Plan {
    /// Least width of what is left between two holes or a hole and the rim; the plate is about 2 across.
    const WEB: f64 = 0.12;
    let (outline, _) = convex(dice);
    let rim: Vec<Side> = sides(std::slice::from_ref(&outline)).collect();
    let wanted = dice.whole(1, 6);
    let mut placed: Vec<(Point, f64)> = Vec::new();
    for _ in 0..24 {
        if placed.len() == wanted {
            break;
        }
        let at = [dice.between(-0.9, 0.9), dice.between(-0.9, 0.9)];
        let room = |(c, r): &(Point, f64)| (at[0] - c[0]).hypot(at[1] - c[1]) - r;
        let free = placed.iter().map(room).fold(depth_m(&rim, at), f64::min) - WEB;
        let largest = if wanted == 1 { 0.6 } else { 0.36 };
        let radius = free.min(dice.between(0.14, largest));
        if radius > 0.12 {
            placed.push((at, radius));
        }
    }
    if placed.is_empty() {
        placed.push(([0.0, 0.0], 0.5 * depth_m(&rim, [0.0, 0.0])));
    }
    let cut: Vec<Vec<Point>> = placed.iter().map(|&(at, radius)| hole(dice, at, radius)).collect();
    Plan::apart(vec![outline], cut, WEB)
}

/// A hole inside the circle of `radius` about `at`.
fn hole(dice: &mut Dice, at: Point, radius: f64) -> Vec<Point> {
    let outline = match dice.whole(0, 3) {
        0 => regular(dice.whole(3, 6), true),
        1 => polygon::rectangle(1.9, dice.between(0.4, 0.6)),
        _ => polygon::circle(1.0, 20),
    };
    let outline: Vec<Point> = outline.iter().map(|p| [radius * p[0], radius * p[1]]).collect();
    polygon::placed(&outline, dice.angle_rad(), at)
}
