//! Bodies with several feet.

use crate::mesh::polygon::{self, Point};
use crate::shapes::dice::Dice;
use crate::shapes::outlines::{regular, shrunk, stretched};
use crate::shapes::plan::Plan;

/// Two to nine round, square or hexagonal feet in a regular or a loose grid, as under one body: pieces apart.
pub(crate) fn studs(dice: &mut Dice) -> Plan {
    let (rows, cols) = (dice.whole(1, 3), dice.whole(2, 3));
    let loose = if dice.chance(0.5) { 0.0 } else { 0.2 };
    let radius = dice.between(0.2, 0.42);
    let sides = [4, 6, 16][dice.whole(0, 2)];
    let (turn, flat) = (dice.angle_rad(), dice.between(0.7, 1.0));
    let foot = polygon::placed(&stretched(regular(sides, true), flat), turn, [0.0; 2]);
    let missing = if rows * cols > 3 { 0.2 } else { 0.0 };
    let mut feet: Vec<Vec<Point>> = Vec::new();
    for row in 0..rows {
        for col in 0..cols {
            let shift = [dice.between(-0.5, 0.5) * loose, dice.between(-0.5, 0.5) * loose];
            let scale = dice.between(1.0 - loose, 1.0) * radius;
            // two stay whatever happens
            if dice.chance(missing) && rows * cols - row * cols - col + feet.len() > 2 {
                continue;
            }
            let at = [col as f64 + shift[0], row as f64 + shift[1]];
            feet.push(polygon::placed(&shrunk(&foot, scale), 0.0, at));
        }
    }
    Plan::apart(feet, Vec::new(), radius)
}
