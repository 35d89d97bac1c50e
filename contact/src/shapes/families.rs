//! The outlines of the shape families.

use super::plan::{self, Dice, Dome, Plan, ROUND, arc, convex, regular, shrunk, stretched, stroke};
use super::region::{Side, depth_m, sides};
use crate::mesh::polygon::{self, Point};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Steps of half a turn of a curve.
const HALF: usize = 8;

/// The strokes of a capital letter; a closed one goes on past its beginning. Empty for any other character.
pub(super) fn strokes(letter: char) -> Vec<Vec<Point>> {
    let line = |points: &[Point]| points.to_vec();
    let bowl = |x: f64, y: f64, r: Point| arc([x, y], r, [90.0, -90.0], HALF);
    // from a corner of the stem along the top, around and back to the stem
    let bulge = |low: f64, high: f64, reach: f64| {
        let r = 0.5 * (high - low);
        let mut path = vec![[0.0, high]];
        path.extend(bowl(reach - r.min(0.3), low + r, [r.min(0.3), r]));
        path.push([0.0, low]);
        path
    };
    let after = |start: &[Point], path: Vec<Point>, end: &[Point]| [start, &path, end].concat();
    let (foot, head) = ([0.0, 0.0], [0.0, 1.0]);
    match letter {
        'A' => vec![line(&[[0.0, 0.0], [0.38, 1.0], [0.76, 0.0]]), line(&[[0.14, 0.33], [0.62, 0.33]])],
        'B' => vec![after(&[foot], bulge(0.5, 1.0, 0.52), &[]), after(&[], bulge(0.0, 0.5, 0.6), &[head])],
        'C' => vec![arc([0.42, 0.5], [0.42, 0.5], [45.0, 315.0], 12)],
        'D' => vec![after(&[foot], bulge(0.0, 1.0, 0.66), &[head])],
        'E' => vec![line(&[[0.58, 1.0], [0.0, 1.0], [0.0, 0.0], [0.58, 0.0]]), line(&[[0.0, 0.5], [0.5, 0.5]])],
        'F' => vec![line(&[[0.58, 1.0], [0.0, 1.0], [0.0, 0.0]]), line(&[[0.0, 0.52], [0.5, 0.52]])],
        'G' => {
            let mut path = arc([0.42, 0.5], [0.42, 0.5], [45.0, 345.0], 13);
            path.extend([[0.84, 0.46], [0.48, 0.46]]);
            vec![path]
        }
        'H' => vec![stem(), line(&[[0.66, 0.0], [0.66, 1.0]]), line(&[[0.0, 0.5], [0.66, 0.5]])],
        'I' => vec![stem()],
        'J' => {
            let mut path = vec![[0.5, 1.0]];
            path.extend(arc([0.25, 0.27], [0.25, 0.27], [0.0, -180.0], HALF));
            vec![path]
        }
        'K' => vec![stem(), line(&[[0.62, 1.0], [0.02, 0.42]]), line(&[[0.2, 0.56], [0.64, 0.0]])],
        'L' => vec![line(&[[0.0, 1.0], [0.0, 0.0], [0.56, 0.0]])],
        'M' => vec![line(&[[0.0, 0.0], [0.0, 1.0], [0.42, 0.3], [0.84, 1.0], [0.84, 0.0]])],
        'N' => vec![line(&[[0.0, 0.0], [0.0, 1.0], [0.68, 0.0], [0.68, 1.0]])],
        'O' => vec![round()],
        'P' => vec![after(&[foot], bulge(0.46, 1.0, 0.6), &[])],
        'Q' => vec![round(), line(&[[0.5, 0.3], [0.86, -0.08]])],
        'R' => vec![after(&[foot], bulge(0.46, 1.0, 0.6), &[]), line(&[[0.26, 0.46], [0.62, 0.0]])],
        'S' => {
            let mut path = arc([0.3, 0.75], [0.3, 0.25], [30.0, 270.0], 9);
            path.extend(arc([0.3, 0.25], [0.3, 0.25], [90.0, -150.0], 9).split_off(1));
            vec![path]
        }
        'T' => vec![line(&[[0.0, 1.0], [0.7, 1.0]]), line(&[[0.35, 1.0], [0.35, 0.0]])],
        'U' => {
            let mut path = vec![[0.0, 1.0]];
            path.extend(arc([0.33, 0.33], [0.33, 0.33], [180.0, 360.0], HALF));
            path.push([0.66, 1.0]);
            vec![path]
        }
        'V' => vec![line(&[[0.0, 1.0], [0.38, 0.0], [0.76, 1.0]])],
        'W' => vec![line(&[[0.0, 1.0], [0.26, 0.0], [0.52, 0.8], [0.78, 0.0], [1.04, 1.0]])],
        'X' => vec![line(&[[0.0, 0.0], [0.7, 1.0]]), line(&[[0.0, 1.0], [0.7, 0.0]])],
        'Y' => vec![line(&[[0.0, 1.0], [0.36, 0.46], [0.72, 1.0]]), line(&[[0.36, 0.5], [0.36, 0.0]])],
        'Z' => vec![line(&[[0.0, 1.0], [0.66, 1.0], [0.0, 0.0], [0.66, 0.0]])],
        _ => Vec::new(),
    }
}

fn stem() -> Vec<Point> {
    vec![[0.0, 0.0], [0.0, 1.0]]
}

/// An O: once around and two steps more, so that its ends overlap.
fn round() -> Vec<Point> {
    let mut path = arc([0.42, 0.5], [0.42, 0.5], [90.0, 450.0], 2 * HALF);
    path.extend_from_within(1..3);
    path
}

// Bars and junctions of bars.

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
        5 => vec![vec![[0.0, a], [0.0, -b]], vec![[far, c], [far, -d]], vec![[0.0, 0.0], [far, 0.0]]],
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

// Smooth random outlines, flat and rounded.

/// A smooth random outline, like a pebble or a puddle.
pub(crate) fn blob(dice: &mut Dice) -> Plan {
    let waviness = dice.between(0.1, 0.32);
    let (outline, least) = plan::blob(dice, waviness);
    Plan::simple(outline, 0.5 * least)
}

/// Part of a sphere or an ellipsoid, or a pebble, with its round side down; some have a flat middle.
pub(crate) fn dome(dice: &mut Dice) -> Plan {
    let outline = if dice.chance(0.65) {
        polygon::ellipse(1.0, dice.between(0.45, 1.0), ROUND)
    } else {
        let waviness = dice.between(0.03, 0.12);
        plan::blob(dice, waviness).0
    };
    let cap_rad = dice.between(0.3, FRAC_PI_2);
    // the rise of a cap of a sphere over its width, higher or lower
    let rise = 0.5 * (0.5 * cap_rad).tan() * dice.between(0.6, 1.0);
    let flat = if dice.chance(0.3) { dice.between(0.1, 0.6) } else { 0.0 };
    let dome = Some(Dome { cap_rad, rise, flat });
    Plan { dome, ..Plan::simple(outline, 1.0) }
}

// Teeth in a row and around a circle.

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
    let root = if pointed { dice.between(0.4, 0.75) } else { dice.between(0.6, 0.82) };
    let outline = plan::gear(teeth, root, pointed);
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

// Letters and thick lines.

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

// Plates with and without holes.

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

// Rings and frames.

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

// Bodies with several feet.

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

/// Four to 24 small round or square pads of one body, far apart: in a cross, a lattice with or without gaps, a circle,
/// a row, or sprinkled.
pub(crate) fn pads(dice: &mut Dice) -> Plan {
    let places = match dice.whole(0, 6) {
        0 | 1 => cross(dice),
        2 | 3 => lattice(dice),
        4 => circle(dice),
        5 => (0..dice.whole(4, 8)).map(|i| [i as f64, 0.0]).collect(),
        _ => sprinkle(dice),
    };
    let loose = if dice.chance(0.4) { 0.1 } else { 0.0 };
    let width = dice.between(0.2, 0.6);
    let pad = if dice.chance(0.5) { polygon::circle(0.5 * width, 12) } else { polygon::rectangle(width, width) };
    // of all, and of every pad about its middle
    let [turn, own_turn] = [0.5, 0.4].map(|share| if dice.chance(share) { dice.angle_rad() } else { 0.0 });
    let pads = polygon::placed(&places, turn, [0.0; 2]).into_iter().map(|[x, y]| {
        let at = [x + loose * dice.between(-0.5, 0.5), y + loose * dice.between(-0.5, 0.5)];
        polygon::placed(&shrunk(&pad, dice.between(1.0 - loose, 1.0)), turn + own_turn, at)
    });
    Plan::apart(pads.collect(), Vec::new(), width.min(1.0 - width))
}

/// Two rows of three to seven places that meet in one of them: a cross with equal arms, or any cross, T or L.
fn cross(dice: &mut Dice) -> Vec<Point> {
    let equal = dice.chance(0.6);
    let mut row = || {
        let count = if equal { 2 * dice.whole(1, 3) + 1 } else { dice.whole(3, 7) };
        let middle = if equal { count / 2 } else { dice.whole(0, count - 1) };
        (0..count).map(move |i| i as f64 - middle as f64)
    };
    let (along, across) = (row(), row());
    along.map(|x| [x, 0.0]).chain(across.filter(|y| y.abs() > 0.5).map(|y| [0.0, y])).collect()
}

/// Two to six rows and columns of places, some with every second row half a place on, some with places left out. At
/// most 24 are left.
fn lattice(dice: &mut Dice) -> Vec<Point> {
    let (rows, cols) = (dice.whole(2, 6), dice.whole(2, 6));
    let (shift, height) = if dice.chance(0.3) { (0.5, 0.75_f64.sqrt()) } else { (0.0, 1.0) };
    let place = |i: usize| [(i % cols) as f64 + shift * (i / cols % 2) as f64, height * (i / cols) as f64];
    let mut places: Vec<Point> = (0..rows * cols).map(place).collect();
    let all = places.len();
    let left = if dice.chance(0.5) { all } else { dice.whole(all.div_ceil(2).max(4), all) };
    while places.len() > left.min(24) {
        places.swap_remove(dice.whole(0, places.len() - 1));
    }
    places
}

/// Six to fourteen places around a circle, some with one in the middle.
fn circle(dice: &mut Dice) -> Vec<Point> {
    let count = dice.whole(6, 14);
    let mut places = polygon::circle(0.5 / (PI / count as f64).sin(), count);
    if dice.chance(0.3) {
        places.push([0.0; 2]);
    }
    places
}

/// Four to twenty places within a circle, at least 1 apart.
fn sprinkle(dice: &mut Dice) -> Vec<Point> {
    let wanted = dice.whole(4, 20);
    let reach = 0.75 * (wanted as f64).sqrt();
    let mut places: Vec<Point> = Vec::new();
    for _ in 0..50 * wanted {
        let at = [dice.between(-reach, reach), dice.between(-reach, reach)];
        let free = places.iter().all(|p| (p[0] - at[0]).hypot(p[1] - at[1]) > 1.0);
        if free && at[0].hypot(at[1]) < reach && places.len() < wanted {
            places.push(at);
        }
    }
    places
}

// Feet and hands.

/// Sole of a left or right foot, shoe or paw: heel and ball, a narrow arch between them or none, toes apart or in one.
pub(crate) fn foot(dice: &mut Dice) -> Plan {
    /// Width of the gaps between ball and toes; the heel is about 0.6 wide.
    const GAP: f64 = 0.06;
    let side = dice.sign();
    let (heel, ball) = (dice.between(0.26, 0.36), dice.between(0.36, 0.5));
    let (length, lean) = (dice.between(1.1, 1.5), dice.between(0.0, 0.12));
    let (paw, arched) = (dice.chance(0.2), dice.chance(0.7));
    let toes = if paw { 0.0 } else { dice.between(0.0, 1.0) };
    // a shoe has a longer front and no toes
    let reach = ball * if toes < 0.7 { dice.between(0.7, 1.0) } else { dice.between(1.0, 1.6) };
    let front = [length, lean];
    let mut width = heel;
    let mut pieces = Vec::new();
    if !paw && arched {
        let least = dice.between(0.14, 0.5);
        let (outline, narrow) = sole([heel, ball, reach], front, least);
        pieces.push(outline);
        width = width.min(narrow);
    } else {
        pieces.push(polygon::placed(&polygon::ellipse(reach, ball, ROUND), 0.0, front));
        if !paw {
            pieces.push(polygon::ellipse(1.1 * heel, heel, ROUND));
        }
    }
    if toes < 0.5 {
        let share: &[f64] = if paw { &[1.0; 4] } else { &[1.5, 1.0, 1.0, 0.9, 0.8] };
        let (from, span) = if paw { (1.35, 2.7) } else { (1.2, 2.1) };
        let fill = dice.between(0.6, 0.85);
        let whole: f64 = share.iter().sum();
        let mut angle = from;
        for part in share {
            let slot = span * part / whole;
            let radius = 0.5 * fill * slot * (GAP + reach.min(ball));
            let (s, c) = (angle - 0.5 * slot).sin_cos();
            angle -= slot;
            if dice.chance(0.08) {
                continue;
            }
            let off = GAP + 1.25 * radius;
            let at = [front[0] + (reach + off) * c, front[1] + (ball + off) * s];
            pieces.push(polygon::placed(&polygon::ellipse(1.25 * radius, radius, 12), s.atan2(c), at));
            width = width.min(2.0 * radius);
        }
    } else if toes < 0.7 {
        let band = dice.between(0.14, 0.22);
        let off = GAP + 0.5 * band;
        let path = arc(front, [reach + off, ball + off], [-50.0, 65.0], 10);
        pieces.push(stroke(&path, band));
        width = width.min(band);
    }
    let turned = pieces.iter().map(|piece| stretched(piece.clone(), side));
    Plan::apart(turned.collect(), Vec::new(), width)
}

/// Outline from a round heel about the origin to the ball about `front`, and the width of the arch between them, which
/// is at least `least` and dented on the side of +y. The ball is `ball` in half width and reaches on by `reach`.
fn sole([heel, ball, reach]: [f64; 3], front: Point, least: f64) -> (Vec<Point>, f64) {
    /// Steps of a flank.
    const STEPS: usize = 12;
    let middle = heel + ball;
    let dent = (middle - least).max(0.0);
    let flank = |i: usize, sign: f64| {
        let t = i as f64 / STEPS as f64;
        let smooth = t * t * (3.0 - 2.0 * t);
        let wave = (PI * t).sin().powi(2);
        // the inner side has most of the dent
        let share = if sign > 0.0 { 0.8 } else { 0.2 };
        let half = heel + (ball - heel) * smooth - share * dent * wave;
        [t * front[0], smooth * front[1] + sign * half]
    };
    let mut outline = arc([0.0; 2], [heel; 2], [90.0, 270.0], 12);
    outline.extend((1..STEPS).map(|i| flank(i, -1.0)));
    outline.extend(arc(front, [reach, ball], [-90.0, 90.0], 14));
    outline.extend((1..STEPS).rev().map(|i| flank(i, 1.0)));
    (outline, middle - dent)
}

/// A left or right hand: palm and up to five fingers, spread or closed, or fingertips apart with or without the palm.
pub(crate) fn hand(dice: &mut Dice) -> Plan {
    /// Distance of neighbouring fingers at the palm, which is 1 wide.
    const PITCH: f64 = 0.25;
    let side = dice.sign();
    let (tips, closed) = (dice.chance(0.35), dice.chance(0.35));
    let closed = closed && !tips;
    let palm = !tips || dice.chance(0.5);
    let width = if closed { dice.between(0.26, 0.29) } else { dice.between(0.15, 0.2) };
    let spread = if closed { 0.0 } else { dice.between(0.04, 0.25) };
    let length = dice.between(0.75, 1.15);
    // root, angle from +y to +x, length and width of four fingers and the thumb
    let relative = [0.9, 1.0, 0.92, 0.72];
    let mut fingers = Vec::new();
    for (i, relative) in relative.into_iter().enumerate() {
        let nth = 1.5 - i as f64;
        let angle = if closed { 0.0 } else { spread * nth + dice.between(-0.03, 0.03) };
        fingers.push(([PITCH * nth, 0.3], angle, length * relative, width));
    }
    let thumb = if closed { dice.between(0.5, 0.8) } else { dice.between(0.7, 1.1) };
    fingers.push(([0.2, -0.25], thumb, 0.85, 1.2 * width.min(0.22)));
    let missing = if palm { 0.15 } else { 0.05 };
    let mut pieces = Vec::new();
    for (root, angle, length, width) in fingers {
        // three stay where there is no palm
        if dice.chance(missing) && (palm || pieces.len() > 2) {
            continue;
        }
        let radius = 0.5 * width;
        let (s, c) = angle.sin_cos();
        let end = [root[0] + length * s, root[1] + length * c];
        let upright = angle - FRAC_PI_2;
        pieces.push(if tips {
            polygon::placed(&polygon::ellipse(1.35 * radius, radius, 16), -upright, end)
        } else {
            let deg = -angle.to_degrees();
            let mut finger = arc(end, [radius; 2], [deg, deg + 180.0], 8);
            finger.extend([-1.0, 1.0].map(|across| [root[0] + across * radius * c, root[1] - across * radius * s]));
            finger
        });
    }
    if palm {
        let wrist = dice.between(0.36, 0.46);
        // closed outer fingers go on from the sides
        let knuckles = if closed { 1.5 * PITCH + 0.5 * width } else { 0.52 };
        let corners =
            [[-wrist, -0.55], [wrist, -0.55], [knuckles, 0.1], [knuckles, 0.45], [-knuckles, 0.45], [-knuckles, 0.1]];
        pieces.push(polygon::rounded(&corners, dice.between(0.08, 0.25), 4));
    }
    let pieces: Vec<_> =
        pieces.into_iter().map(|piece| piece.into_iter().map(|[x, y]| [side * x, y]).collect()).collect();
    if tips { Plan::apart(pieces, Vec::new(), width) } else { Plan::union(pieces, Vec::new(), width) }
}

// Thin rods.

/// Thin rods, about 4 to 12 % of the size in width: two or three that cross, a closed outline, a grid, a few side by
/// side, or a bow.
pub(crate) fn rods(dice: &mut Dice) -> Plan {
    let share = dice.between(0.04, 0.12);
    let width = 2.0 * share;
    let line = |from: Point, to: Point, width: f64| stroke(&[from, to], width);
    match dice.whole(0, 5) {
        0 => {
            let meet = [dice.between(-0.4, 0.4), 0.0];
            let mut rods = vec![line([-1.0, 0.0], [1.0, 0.0], width)];
            let count = dice.whole(1, 2);
            let turn = if count == 1 && dice.chance(0.5) { FRAC_PI_2 } else { dice.between(0.7, 1.2) };
            for i in 0..count {
                let (s, c) = (turn * (1 + i) as f64).sin_cos();
                let (ahead, back) = (dice.between(0.5, 1.0), dice.between(0.3, 1.0));
                rods.push(line([meet[0] + ahead * c, ahead * s], [meet[0] - back * c, -back * s], width));
            }
            Plan::union(rods, Vec::new(), width)
        }
        1 | 2 => {
            let outline = if dice.chance(0.3) { plan::blob(dice, 0.15).0 } else { convex(dice).0 };
            let around = |outline: &[Point]| {
                let path = [outline, &outline[..2]].concat();
                stroke(&path, width)
            };
            let mut rods = vec![around(&outline)];
            if dice.chance(0.25) {
                rods.push(around(&shrunk(&outline, 0.5)));
            } else if dice.chance(0.3) {
                rods.push(line(outline[0], outline[outline.len() / 2], width));
            }
            Plan::union(rods, Vec::new(), width)
        }
        3 => {
            let (rows, cols) = (dice.whole(2, 5), dice.whole(2, 5));
            let (x, y) = (0.5 * (cols as f64 - 1.0), 0.5 * (rows as f64 - 1.0));
            // flush, or well beyond the outer rods: a shorter end would be narrower than its edges
            let end = if dice.chance(0.5) { 0.0 } else { dice.between(0.35, 0.6) };
            let width = 2.0 * share * (x.max(y) + end) / (1.0 - share);
            let (far, high) = (x + end + 0.5 * width, y + end + 0.5 * width);
            let across = (0..rows).map(|i| i as f64 - y).map(|at| line([-far, at], [far, at], width));
            let along = (0..cols).map(|i| i as f64 - x).map(|at| line([at, -high], [at, high], width));
            Plan::union(across.chain(along).collect(), Vec::new(), width.min(1.0 - width))
        }
        4 => {
            let count = dice.whole(2, 5);
            let pitch = dice.between(2.0 * width, 2.0 / (count as f64 - 1.0));
            let rods = (0..count).map(|i| {
                let half = if i == 0 { 1.0 } else { dice.between(0.6, 1.0) };
                let y = pitch * i as f64;
                line([-half, y], [half, y], width)
            });
            Plan::apart(rods.collect(), Vec::new(), width.min(pitch - width))
        }
        _ => {
            let half_deg = dice.between(110.0, 160.0);
            let path = arc([0.0; 2], [1.0, dice.between(0.75, 1.0)], [-half_deg, half_deg], 24);
            Plan::simple(stroke(&path, width), width)
        }
    }
}

// Random unions.

/// Two to four plates, bars and blobs over one another, some with holes and bites.
pub(crate) fn union(dice: &mut Dice) -> Plan {
    let mut add: Vec<Vec<Point>> = Vec::new();
    for i in 0..dice.whole(2, 4) {
        let outline = match dice.whole(0, 3) {
            0 => plan::blob(dice, 0.2).0,
            1 => polygon::rectangle(2.6, dice.between(0.35, 0.7)),
            _ => convex(dice).0,
        };
        let scale = dice.between(0.5, 1.0);
        let (s, c) = dice.angle_rad().sin_cos();
        // within the first one, so that most are one piece
        let reach = if i == 0 { 0.0 } else { dice.between(0.3, 0.9) };
        add.push(polygon::placed(&shrunk(&outline, scale), dice.angle_rad(), [reach * c, reach * s]));
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
