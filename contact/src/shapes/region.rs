//! Turns the loops of a plan into simple loops of the drawn size.

use super::plan::Plan;
use crate::mesh::polygon::{Point, signed_area_m2};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::single::SingleFloatOverlay as _;

/// Points of a union closer than this share of the extent are one: crossings leave sides of any shortness.
const SHORTEST_SIDE: f64 = 4e-3;
/// Holes of a union with less than this share of the extent squared are left out.
const LEAST_HOLE: f64 = 1e-3;
/// Pieces of a union with less than this share of the extent squared are left out.
const LEAST_PIECE: f64 = 0.02;

/// Simple loops, m, with the inside on their left: outlines counter-clockwise, holes clockwise.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Region {
    pub(super) loops: Vec<Vec<Point>>,
    /// Length of the plan's unit, m.
    pub(super) unit_m: f64,
    /// Position of the plan's origin, m.
    pub(super) centre: Point,
}

impl Region {
    /// The footprint of `plan`, its larger extent `size_m` and its centroid at the origin. `None` if nothing is left.
    pub(super) fn of(plan: &Plan, size_m: f64) -> Option<Self> {
        let loops = if plan.overlapping {
            united(plan)
        } else {
            let outer = plan.add.iter().map(|l| directed(l.clone(), true));
            outer
                .chain(plan.cut.iter().map(|l| directed(l.clone(), false)))
                .collect()
        };
        let mut region = Self {
            loops,
            unit_m: 1.0,
            centre: [0.0; 2],
        };
        region.fit(size_m)?;
        Some(region)
    }

    /// Scales to the larger extent `size_m` and moves the centroid to the origin.
    pub(super) fn fit(&mut self, size_m: f64) -> Option<()> {
        let [width, height] = self.extent_m();
        let scale = size_m / width.max(height);
        let (area, centre) = self.area_and_centroid();
        if !(scale.is_finite() && scale > 0.0 && area > 0.0) {
            return None;
        }
        for p in self.loops.iter_mut().flatten().chain([&mut self.centre]) {
            *p = [(p[0] - centre[0]) * scale, (p[1] - centre[1]) * scale];
        }
        self.unit_m *= scale;
        Some(())
    }

    /// Extent along x and y, m.
    pub(super) fn extent_m(&self) -> [f64; 2] {
        [0, 1].map(|k| {
            let along = self.loops.iter().flatten().map(|p| p[k]);
            let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            (high - low).max(0.0)
        })
    }

    /// Area of the footprint, m², and its centroid, m.
    pub(super) fn area_and_centroid(&self) -> (f64, Point) {
        let (mut area, mut moment) = (0.0, [0.0; 2]);
        for outline in &self.loops {
            let n = outline.len();
            for i in 0..n {
                let (a, b) = (outline[i], outline[(i + 1) % n]);
                let double = a[0] * b[1] - b[0] * a[1];
                area += 0.5 * double;
                for k in 0..2 {
                    moment[k] += double * (a[k] + b[k]) / 6.0;
                }
            }
        }
        (area, moment.map(|m| m / area))
    }

    /// Number of outlines and of holes.
    pub(super) fn parts_and_holes(&self) -> (u32, u32) {
        let count = |outline: bool| {
            let loops = self.loops.iter().filter(|l| (signed_area_m2(l) > 0.0) == outline);
            u32::try_from(loops.count()).unwrap_or(u32::MAX)
        };
        (count(true), count(false))
    }

    /// The loops with sides longer than `longest_m` cut into equal ones, and of every point of this region its place
    /// among all points of the new loops.
    pub(super) fn divided(&self, longest_m: f64) -> (Vec<Vec<Point>>, Vec<usize>) {
        let mut places = Vec::new();
        let mut base = 0;
        let divide = |outline: &Vec<Point>| {
            let mut out: Vec<Point> = Vec::with_capacity(2 * outline.len());
            for (i, &a) in outline.iter().enumerate() {
                let b = outline[(i + 1) % outline.len()];
                let length_m = ((b[0] - a[0]).powi(2) + (b[1] - a[1]).powi(2)).sqrt();
                let pieces = (length_m / longest_m).ceil().max(1.0);
                places.push(base + out.len());
                out.push(a);
                let mut k = 1.0;
                while k < pieces {
                    let t = k / pieces;
                    out.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
                    k += 1.0;
                }
            }
            base += out.len();
            out
        };
        (self.loops.iter().map(divide).collect(), places)
    }
}

/// `outline` in the given direction.
fn directed(mut outline: Vec<Point>, counter_clockwise: bool) -> Vec<Point> {
    if (signed_area_m2(&outline) > 0.0) != counter_clockwise {
        outline.reverse();
    }
    outline
}

/// Union of the added loops less the union of the cut ones, in the plan's unit, without short sides and small loops.
/// The boolean operation is exact on a grid of 2⁻³⁰ of the extent.
fn united(plan: &Plan) -> Vec<Vec<Point>> {
    let shapes = plan.add.overlay(&plan.cut, OverlayRule::Difference, FillRule::NonZero);
    let all = || shapes.iter().flatten().flatten();
    let extent = [0, 1].map(|k| {
        let (low, high) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| {
            (l.min(p[k]), h.max(p[k]))
        });
        high - low
    });
    let extent = extent[0].max(extent[1]);
    let mut loops = Vec::new();
    for shape in &shapes {
        for (i, outline) in shape.iter().enumerate() {
            let mut outline = outline.clone();
            merge_close(&mut outline, SHORTEST_SIDE * extent);
            let least = if i == 0 { LEAST_PIECE } else { LEAST_HOLE };
            let large = outline.len() > 2 && signed_area_m2(&outline).abs() > least * extent * extent;
            if !large && i == 0 {
                break;
            }
            if large {
                loops.push(directed(outline, i == 0));
            }
        }
    }
    loops
}

/// Leaves out points closer than `least` to the one kept before.
fn merge_close(outline: &mut Vec<Point>, least: f64) {
    let close = |a: Point, b: Point| (a[0] - b[0]).hypot(a[1] - b[1]) < least;
    outline.dedup_by(|b, a| close(*a, *b));
    while outline.len() > 1 && close(outline[0], outline[outline.len() - 1]) {
        outline.pop();
    }
}
