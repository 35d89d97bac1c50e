//! Letters and thick lines.

use crate::mesh::polygon::Point;
use crate::shapes::dice::Dice;
use crate::shapes::font::strokes;
use crate::shapes::plan::Plan;
use crate::shapes::stroke::stroke;

/// A capital letter A to Z of random width, slant and weight.
pub(crate) fn letter(dice: &mut Dice) -> Plan {
    let letters = b'A'..=b'Z';
    let nth = dice.whole(0, letters.len() - 1);
    let letter = letters.map(char::from).nth(nth).unwrap_or('A');
    let (weight, wide, slant) = (dice.between(0.1, 0.2), dice.between(0.8, 1.3), dice.between(-0.15, 0.2));
    let place = |[x, y]: Point| [wide * x + slant * y, y];
    let lines = strokes(letter).into_iter().map(|line| {
        let line: Vec<Point> = line.into_iter().map(place).collect();
        stroke(&line, weight)
    });
    Plan::union(lines.collect(), Vec::new(), weight)
}

/// A thick line of two to six straight pieces, or a smoothly winding one.
pub(crate) fn polyline(dice: &mut Dice) -> Plan {
    let winding = dice.chance(0.4);
    let mut heading = dice.angle_rad();
    let mut path = vec![[0.0, 0.0]];
    let (pieces, shortest, width) = if winding {
        (dice.whole(9, 18), 0.36, dice.between(0.25, 0.6))
    } else {
        (dice.whole(2, 6), 0.7, dice.between(0.18, 0.42))
    };
    let mut bend = 0.0;
    for _ in 0..pieces {
        let length = if winding { shortest } else { dice.between(shortest, 1.6) };
        let [x, y] = path[path.len() - 1];
        path.push([x + length * heading.cos(), y + length * heading.sin()]);
        if winding {
            bend = (bend + dice.between(-0.3, 0.3)).clamp(-0.55, 0.55);
            heading += bend;
        } else {
            heading += dice.sign() * dice.between(0.4, 1.9);
        }
    }
    Plan::union(vec![stroke(&path, width)], Vec::new(), width)
}
