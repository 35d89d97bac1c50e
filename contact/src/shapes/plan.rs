//! What outlines are drawn with: random numbers, plans, thick lines, and figures that several families use.

use crate::mesh::polygon::{self, Point};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};

/// The random numbers of one shape.
#[derive(Debug, Clone)]
pub struct Dice(ChaCha8Rng);

impl Dice {
    pub(super) fn new(rng: ChaCha8Rng) -> Self {
        Self(rng)
    }

    /// A uniform number in [`low`, `high`).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// A uniform whole number in [`low`, `high`].
    pub fn whole(&mut self, low: usize, high: usize) -> usize {
        self.0.random_range(low..=high.max(low))
    }

    /// `true` with the probability `share`.
    pub fn chance(&mut self, share: f64) -> bool {
        self.0.random::<f64>() < share
    }

    /// A uniform angle in [0, 2π), rad.
    pub fn angle_rad(&mut self) -> f64 {
        self.between(0.0, TAU)
    }

    /// −1 or 1, with equal probability.
    pub fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }
}

/// An outline with holes, and the form of the underside. Lengths are in any unit: the shape is scaled to its drawn
/// size.
///
/// ```
/// use spts_contact::mesh::polygon::{circle, rectangle};
/// use spts_contact::shapes::{ShapeFamily, ShapeRanges};
///
/// let washer = ShapeFamily {
///     name: "washer",
///     description: "Square with a round hole",
///     plan: |_| spts_contact::shapes::Plan::apart(vec![rectangle(1.0, 1.0)], vec![circle(0.25, 32)], 0.25),
/// };
/// let shape = washer.build(&ShapeRanges::default(), 1)?;
/// assert_eq!((shape.holes, shape.parts), (1, 1));
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Plan {
    /// Closed counter-clockwise loops whose union is the footprint. Loops of a [`Plan::union`] may overlap and cross
    /// themselves.
    pub add: Vec<Vec<Point>>,
    /// Closed counter-clockwise loops that are cut out of the footprint.
    pub cut: Vec<Vec<Point>>,
    /// Whether loops may overlap. If not, each loop is simple, holes lie inside, and no loop touches another.
    pub overlapping: bool,
    /// Width of the narrowest bar or gap. Edge radii are at most a third of it.
    pub least_width: f64,
    /// A rounded underside; `None` for a flat one.
    pub dome: Option<Dome>,
}

/// A rounded underside: a cap of an ellipsoid, stretched to one outline without holes that is star-shaped about the
/// origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dome {
    /// Angle of the cap from its middle to its rim, rad; (0, π/2]. π/2 is half an ellipsoid.
    pub cap_rad: f64,
    /// Height of the rim above the middle, relative to the outline's width.
    pub rise: f64,
    /// Radius of the flat middle, relative to the outline's; [0, 1).
    pub flat: f64,
}

impl Plan {
    /// A plan with one simple, counter-clockwise outline and no holes. `least_width` as in [`Plan::apart`].
    pub fn simple(outline: Vec<Point>, least_width: f64) -> Self {
        Self { add: vec![outline], least_width, ..Self::default() }
    }

    /// A plan with the union of the loops `add` as footprint, minus the holes `cut`. Loops must be simple and
    /// counter-clockwise, and must not touch each other. `least_width` is the width of the narrowest bar or gap, in the
    /// unit of the points.
    pub fn apart(add: Vec<Vec<Point>>, cut: Vec<Vec<Point>>, least_width: f64) -> Self {
        Self { add, cut, least_width, ..Self::default() }
    }

    /// The union of overlapping outlines.
    pub fn union(add: Vec<Vec<Point>>, cut: Vec<Vec<Point>>, least_width: f64) -> Self {
        Self { add, cut, overlapping: true, least_width, dome: None }
    }
}

// Thick lines.

/// Longest tip of a mitred corner, in half widths; sharper corners are cut off.
const MITRE_LIMIT: f64 = 1.6;

/// Outline of a line along `path`, `width` wide, with mitred corners and straight ends. It overlaps itself where the
/// path crosses or closes, or where a side is shorter than the corners at its ends need: a union makes it simple.
pub(super) fn stroke(path: &[Point], width: f64) -> Vec<Point> {
    let half = 0.5 * width;
    let (mut left, mut right) = (Vec::with_capacity(path.len() + 4), Vec::with_capacity(path.len() + 4));
    let normals: Vec<Point> = path.windows(2).map(|ab| normal(ab[0], ab[1])).collect();
    for (i, &p) in path.iter().enumerate() {
        let before = normals[i.saturating_sub(1).min(normals.len() - 1)];
        let after = normals[i.min(normals.len() - 1)];
        let sum = [before[0] + after[0], before[1] + after[1]];
        let square = sum[0] * sum[0] + sum[1] * sum[1];
        // the mitre ends at p ± half · 2 sum / |sum|²
        let mitre = [0, 1].map(|k| 2.0 * half * sum[k] / square.max(0.04));
        let turn = before[0] * after[1] - before[1] * after[0];
        let cut = 2.0 / square.sqrt() > MITRE_LIMIT;
        let push = |side: &mut Vec<Point>, sign: f64| {
            let outer = sign * turn < 0.0;
            if cut && outer {
                side.extend([before, after].map(|n| [p[0] + sign * half * n[0], p[1] + sign * half * n[1]]));
            } else {
                side.push([p[0] + sign * mitre[0], p[1] + sign * mitre[1]]);
            }
        };
        push(&mut left, 1.0);
        push(&mut right, -1.0);
    }
    // right side forward, left side back: counter-clockwise
    left.reverse();
    right.extend(left);
    right
}

/// Points on an arc of an ellipse about `centre` with half axes `radii`, from `from_deg` to `to_deg` (degrees,
/// counter-clockwise from +x), in `steps`.
pub(super) fn arc(centre: Point, radii: Point, [from_deg, to_deg]: [f64; 2], steps: usize) -> Vec<Point> {
    (0..=steps)
        .map(|i| {
            let angle = from_deg + (to_deg - from_deg) * i as f64 / steps as f64;
            let (s, c) = angle.to_radians().sin_cos();
            [centre[0] + radii[0] * c, centre[1] + radii[1] * s]
        })
        .collect()
}

/// Unit normal of a → b, to its left.
fn normal(a: Point, b: Point) -> Point {
    let d = [b[0] - a[0], b[1] - a[1]];
    let length = d[0].hypot(d[1]).max(f64::MIN_POSITIVE);
    [-d[1] / length, d[0] / length]
}

// Outlines that several families use, centred on the origin.

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
    let corners: &[(f64, bool)] =
        if pointed { &[(0.0, true), (0.5, false)] } else { &[(-0.22, true), (0.22, true), (0.3, false), (0.7, false)] };
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
            let corners = [[-1.0, -stretch], [1.0, -stretch], [shear + top, stretch], [shear - top, stretch]];
            (corners.to_vec(), 1.2 * stretch)
        }
        _ => (polygon::ellipse(1.0, stretch, ROUND), 2.0 * stretch),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::polygon::signed_area_m2;
    use approx::assert_relative_eq;

    /// A right angle of two arms of length 4 along their middles, 2 wide: two arms of 4 × 2, of which the outer half of
    /// the corner is added and the inner half is shared.
    #[test]
    fn mitred_corner() {
        let corner = stroke(&[[4.0, 0.0], [0.0, 0.0], [0.0, 4.0]], 2.0);
        assert_eq!(corner.len(), 6);
        assert_relative_eq!(signed_area_m2(&corner), 16.0, max_relative = 1e-12);
    }
}
