//! Rings and frames.

use crate::mesh::polygon;
use crate::shapes::dice::Dice;
use crate::shapes::outlines::{ROUND, convex, shrunk, stretched};
use crate::shapes::plan::Plan;
use crate::shapes::stroke::{arc, stroke};

/// Round or angular ring, two rings one in the other, or a ring with a gap.
pub(crate) fn ring(dice: &mut Dice) -> Plan {
    let opening = dice.between(0.35, 0.8);
    match dice.whole(0, 4) {
        0 => {
            let (outline, width) = convex(dice);
            let inner = shrunk(&outline, opening);
            Plan::apart(vec![outline], vec![inner], 0.35 * width * (1.0 - opening))
        }
        1 => {
            let gap_deg = dice.between(25.0, 170.0);
            let width = (1.0 - opening).min(0.5);
            let half = 0.5 * gap_deg;
            let path = arc([0.0; 2], [1.0, dice.between(0.75, 1.0)], [half, 360.0 - half], 30);
            Plan::simple(stroke(&path, width), width)
        }
        2 => {
            let stretch = dice.between(0.7, 1.0);
            let round = stretched(polygon::circle(1.0, ROUND), stretch);
            // outer ring, gap and inner ring
            let (gap, inner) = (dice.between(0.7, 0.82), dice.between(0.45, 0.58));
            let core = dice.between(0.2, 0.3);
            let loops = [gap, inner, core].map(|share| shrunk(&round, share));
            let [gap, inner, core] = loops;
            Plan::apart(vec![round, inner], vec![gap, core], 0.12)
        }
        _ => {
            let stretch = dice.between(0.6, 1.0);
            let outline = polygon::ellipse(1.0, stretch, ROUND);
            let inner = shrunk(&outline, opening);
            Plan::apart(vec![outline], vec![inner], stretch * (1.0 - opening))
        }
    }
}
