//! Shape families, and how their shapes are built.

use super::corners::rounded;
use super::dice::Dice;
use super::error::ShapeError;
use super::plan::Plan;
use super::ranges::ShapeRanges;
use super::region::Region;
use super::relief::{LEAST_RELIEF_M, Relief};
use super::shape::Shape;
use super::solid::solid;
use super::underside::Underside;
use spts_models::Streams;

/// Drawings until a family is given up. Less than one in a thousand fails.
const TRIES: u64 = 16;
/// Largest radius of corners and edges as a share of the narrowest bar or gap.
const MOST_OF_WIDTH: f64 = 0.33;
/// Below this a rounded edge is a sharp one, m.
const LEAST_EDGE_M: f64 = 0.1e-3;
/// Spacing of the points that carry a relief, m, and as a share of the size, whichever is more. A parabola that rises
/// 1 mm at 40 mm departs from chords of 10 mm by 16 µm.
const RELIEF_SPACING: (f64, f64) = (10e-3, 0.08);

/// A family of solids. A seed selects one of them. A program may define families of its own:
///
/// ```
/// use spts_contact::mesh::polygon::rectangle;
/// use spts_contact::shapes::{Plan, ShapeFamily, ShapeRanges, check_shape_family};
///
/// let tile = ShapeFamily {
///     name: "tile",
///     description: "Rectangle, half to wholly as high as wide",
///     plan: |dice| {
///         let height = dice.between(0.5, 1.0);
///         Plan::simple(rectangle(1.0, height), height)
///     },
/// };
/// let shape = tile.build(&ShapeRanges::default(), 1)?;
/// assert!(shape.size_m[1] >= 0.49 * shape.size_m[0]);
/// check_shape_family(&tile, &ShapeRanges::default(), 0..10).unwrap();
/// # Ok::<(), spts_contact::shapes::ShapeError>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ShapeFamily {
    /// Name, as used in data sets.
    pub name: &'static str,
    /// What the shapes look like, in everyday words.
    pub description: &'static str,
    /// Draws the outline. It must depend only on the random numbers.
    pub plan: fn(&mut Dice) -> Plan,
}

impl ShapeFamily {
    /// Builds the shape of `seed`. The result depends only on the family's name and plan, the ranges and the seed.
    ///
    /// # Errors
    /// [`ShapeError::Ranges`] for a range that is not valid; [`ShapeError::NoSolid`] if the family's outlines cross
    /// themselves for all random numbers tried.
    pub fn build(&self, ranges: &ShapeRanges, seed: u64) -> Result<Shape, ShapeError> {
        ranges.check()?;
        let streams = Streams::new(seed).child(self.name, 0);
        let tries = (0..TRIES).find_map(|attempt| {
            let mut dice = Dice::new(streams.rng("shape", attempt));
            self.attempt(ranges, seed, &mut dice)
        });
        tries.ok_or(ShapeError::NoSolid {
            family: self.name,
            seed,
            tries: TRIES,
        })
    }

    fn attempt(&self, ranges: &ShapeRanges, seed: u64, dice: &mut Dice) -> Option<Shape> {
        let mut draw = |[low, high]: [f64; 2]| dice.between(low, high);
        let (size_m, relief_m, edge_m) = (draw(ranges.size_m), draw(ranges.relief_m), draw(ranges.edge_m));
        let relief_m = if relief_m < LEAST_RELIEF_M { 0.0 } else { relief_m };
        let relief = Relief::draw(dice, size_m);
        let plan = (self.plan)(dice);
        let sharp = Region::of(&plan, size_m)?;
        if plan.dome.is_some() && sharp.loops.len() != 1 {
            return None;
        }
        let edge_m = edge_m.min(MOST_OF_WIDTH * plan.least_width * sharp.unit_m);
        let edge_m = if edge_m < LEAST_EDGE_M || plan.dome.is_some() {
            0.0
        } else {
            edge_m
        };
        let round = || {
            let mut round = sharp.clone();
            for outline in &mut round.loops {
                *outline = rounded(outline, edge_m);
            }
            round.fit(size_m)?;
            Some(round)
        };
        let relief = (relief_m > 0.0).then_some((&relief, relief_m));
        // an arc may cross a spike of the outline that points into its corner; such corners stay sharp
        let regions = [(edge_m > 0.0).then(round).flatten(), Some(sharp.clone())];
        let built = regions.into_iter().flatten().find_map(|region| {
            let spacing_m = relief.map(|_| RELIEF_SPACING.0.max(RELIEF_SPACING.1 * size_m));
            let (loops, places) = region.divided(spacing_m.unwrap_or(f64::INFINITY));
            let below = match &plan.dome {
                Some(dome) => {
                    let [width_m, depth_m] = region.extent_m();
                    Underside::domed(loops.first()?, region.centre, width_m.min(depth_m), dome)
                }
                None => Underside::flat(&loops, edge_m, spacing_m),
            };
            Some((solid(&region.loops, &below, &places, relief)?, region))
        });
        let (mesh, region) = built?;
        let (parts, holes) = region.parts_and_holes();
        Some(Shape {
            family: self.name,
            seed,
            mesh,
            size_m: region.extent_m(),
            relief_m,
            edge_m,
            dome_m: plan.dome.map_or(0.0, |dome| {
                let [width_m, depth_m] = region.extent_m();
                dome.rise * width_m.min(depth_m)
            }),
            area_m2: region.area_and_centroid().0,
            least_width_m: plan.least_width * region.unit_m,
            parts,
            holes,
        })
    }
}
