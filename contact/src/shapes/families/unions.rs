//! Random unions.

use crate::mesh::polygon::{self, Point};
use crate::shapes::dice::Dice;
use crate::shapes::outlines::{self, convex, shrunk};
use crate::shapes::plan::Plan;

/// Two to four plates, bars and blobs over one another, some with holes and bites.
pub(crate) fn union(dice: &mut Dice) -> Plan {
    let mut add: Vec<Vec<Point>> = Vec::new();
    for i in 0..dice.whole(2, 4) {
        let outline = match dice.whole(0, 3) {
            0 => outlines::blob(dice, 0.2).0,
            1 => polygon::rectangle(2.6, dice.between(0.35, 0.7)),
            _ => convex(dice).0,
        };
        let scale = dice.between(0.5, 1.0);
        let (s, c) = dice.angle_rad().sin_cos();
        // within the first one, so that most are one piece
        let reach = if i == 0 { 0.0 } else { dice.between(0.3, 0.9) };
        add.push(polygon::placed(
            &shrunk(&outline, scale),
            dice.angle_rad(),
            [reach * c, reach * s],
        ));
    }
    let cuts = if dice.chance(0.6) { dice.whole(1, 2) } else { 0 };
    let cut = (0..cuts).map(|_| {
        let at = [dice.between(-0.9, 0.9), dice.between(-0.9, 0.9)];
        let scale = dice.between(0.15, 0.4);
        polygon::placed(&shrunk(&convex(dice).0, scale), dice.angle_rad(), at)
    });
    let cut = cut.collect();
    Plan::union(add, cut, 0.25)
}
