//! The letters A to Z as lines, in a box of height one and the width of the letter.

use super::stroke::arc;
use crate::mesh::polygon::Point;

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
        'A' => vec![
            line(&[[0.0, 0.0], [0.38, 1.0], [0.76, 0.0]]),
            line(&[[0.14, 0.33], [0.62, 0.33]]),
        ],
        'B' => vec![
            after(&[foot], bulge(0.5, 1.0, 0.52), &[]),
            after(&[], bulge(0.0, 0.5, 0.6), &[head]),
        ],
        'C' => vec![arc([0.42, 0.5], [0.42, 0.5], [45.0, 315.0], 12)],
        'D' => vec![after(&[foot], bulge(0.0, 1.0, 0.66), &[head])],
        'E' => vec![
            line(&[[0.58, 1.0], [0.0, 1.0], [0.0, 0.0], [0.58, 0.0]]),
            line(&[[0.0, 0.5], [0.5, 0.5]]),
        ],
        'F' => vec![
            line(&[[0.58, 1.0], [0.0, 1.0], [0.0, 0.0]]),
            line(&[[0.0, 0.52], [0.5, 0.52]]),
        ],
        'G' => {
            let mut path = arc([0.42, 0.5], [0.42, 0.5], [45.0, 345.0], 13);
            path.extend([[0.84, 0.46], [0.48, 0.46]]);
            vec![path]
        }
        'H' => vec![
            stem(),
            line(&[[0.66, 0.0], [0.66, 1.0]]),
            line(&[[0.0, 0.5], [0.66, 0.5]]),
        ],
        'I' => vec![stem()],
        'J' => {
            let mut path = vec![[0.5, 1.0]];
            path.extend(arc([0.25, 0.27], [0.25, 0.27], [0.0, -180.0], HALF));
            vec![path]
        }
        'K' => vec![
            stem(),
            line(&[[0.62, 1.0], [0.02, 0.42]]),
            line(&[[0.2, 0.56], [0.64, 0.0]]),
        ],
        'L' => vec![line(&[[0.0, 1.0], [0.0, 0.0], [0.56, 0.0]])],
        'M' => vec![line(&[[0.0, 0.0], [0.0, 1.0], [0.42, 0.3], [0.84, 1.0], [0.84, 0.0]])],
        'N' => vec![line(&[[0.0, 0.0], [0.0, 1.0], [0.68, 0.0], [0.68, 1.0]])],
        'O' => vec![round()],
        'P' => vec![after(&[foot], bulge(0.46, 1.0, 0.6), &[])],
        'Q' => vec![round(), line(&[[0.5, 0.3], [0.86, -0.08]])],
        'R' => vec![
            after(&[foot], bulge(0.46, 1.0, 0.6), &[]),
            line(&[[0.26, 0.46], [0.62, 0.0]]),
        ],
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
        'Y' => vec![
            line(&[[0.0, 1.0], [0.36, 0.46], [0.72, 1.0]]),
            line(&[[0.36, 0.5], [0.36, 0.0]]),
        ],
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
