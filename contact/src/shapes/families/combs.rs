//! Teeth in a row and around a circle.

use crate::mesh::polygon::Point;
use crate::shapes::dice::Dice;
use crate::shapes::outlines;
use crate::shapes::plan::Plan;

/// A back with three to ten teeth on one side or on both.
pub(crate) fn comb(dice: &mut Dice) -> Plan {
    let teeth = dice.whole(3, 10);
    let (duty, back) = (dice.between(0.35, 0.65), dice.between(0.2, 0.5));
    let pitch = 2.0 / (teeth as f64 - 1.0 + duty);
    let tooth = duty * pitch;
    let (down, up) = (dice.between(0.4, 1.2), dice.between(0.4, 1.0));
    // of the lengths of the teeth, from the first to the last
    let slope = dice.between(-0.5, 0.0);
    let length = |i: usize| 1.0 + slope * i as f64 / (teeth as f64 - 1.0);
    let row = |start: f64, sign: f64, reach: f64| {
        (0..teeth).flat_map(move |i| {
            let x = i as f64 * pitch - 1.0;
            let tip = start + sign * reach * length(i);
            [[x, start], [x, tip], [x + tooth, tip], [x + tooth, start]]
        })
    };
    let mut outline: Vec<Point> = row(-0.5 * back, -1.0, down).collect();
    // the outer teeth go on from the ends of the back
    if dice.chance(0.3) {
        outline.extend(row(0.5 * back, 1.0, up).collect::<Vec<_>>().into_iter().rev());
    } else {
        outline.extend([[1.0, 0.5 * back], [-1.0, 0.5 * back]]);
    }
    drop_straight(&mut outline);
    Plan::simple(outline, tooth.min(pitch - tooth).min(back))
}

/// Star or gear with five to twelve tips; some gears have a bore.
pub(crate) fn gear(dice: &mut Dice) -> Plan {
    let (teeth, pointed) = (dice.whole(5, 12), dice.chance(0.5));
    let root = if pointed {
        dice.between(0.4, 0.75)
    } else {
        dice.between(0.6, 0.82)
    };
    let outline = outlines::gear(teeth, root, pointed);
    let width = 2.0 / teeth as f64;
    if dice.chance(0.35) {
        let bore = root * dice.between(0.3, 0.65);
        let hole = crate::mesh::polygon::circle(bore, 24);
        return Plan::apart(vec![outline], vec![hole], width.min(0.6 * (root - bore)));
    }
    Plan::simple(outline, width)
}

/// Leaves out corners between two sides in line.
fn drop_straight(outline: &mut Vec<Point>) {
    let n = outline.len();
    let straight = |i: usize| {
        let (a, b, c) = (outline[(i + n - 1) % n], outline[i], outline[(i + 1) % n]);
        ((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])).abs() < 1e-9
    };
    let kept: Vec<Point> = (0..n).filter(|&i| !straight(i)).map(|i| outline[i]).collect();
    *outline = kept;
}
