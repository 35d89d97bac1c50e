//! Shapes, their ranges, and the table of the families that draw them.

use super::families;
use super::plan::{Dice, Plan};
use super::region::{Region, rounded};
use super::solid::{LEAST_RELIEF_M, Relief, Underside, solid};
use crate::mesh::TriMesh;
use serde::{Deserialize, Serialize};
use spts_input::Refusal;
use spts_models::{Streams, in_interval, in_range};

/// Ranges from which size, relief and edge of a shape are drawn uniformly. Each is `[lowest, highest]`; two equal
/// numbers fix the value. A missing range takes its value in [`ShapeRanges::default`].
///
/// ```
/// use spts_contact::shapes::ShapeRanges;
///
/// let ranges: ShapeRanges = toml::from_str("size_m = [0.04, 0.06]")?;
/// assert!(ranges.check().is_ok());
/// let wrong = ShapeRanges { size_m: [0.06, 0.04], ..ranges };
/// assert!(wrong.check().unwrap_err().to_string().contains("size_m"));
/// # Ok::<(), toml::de::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ShapeRanges {
    /// Largest horizontal extent along body x or y, m; within [5e-3, 0.3].
    pub size_m: [f64; 2],
    /// Difference between the highest and the lowest point of bow and waves on the underside, m; within [0, 5e-3].
    pub relief_m: [f64; 2],
    /// Radius of the outline's corners and of the lower edge, m; within [0, 20e-3]. It is smaller on narrow shapes.
    pub edge_m: [f64; 2],
}

impl Default for ShapeRanges {
    /// Objects of the size of a hand's grip: from just over a taxel's pitch to well within the skin. The published
    /// objects are bowed by up to 0.6 mm.
    fn default() -> Self {
        Self { size_m: [20e-3, 90e-3], relief_m: [0.0, 0.6e-3], edge_m: [0.0, 3e-3] }
    }
}

impl ShapeRanges {
    /// Checks that every limit is in its range, and that no lower limit is above the upper one.
    ///
    /// # Errors
    /// [`Refusal`] for the first field outside its range.
    pub fn check(&self) -> Result<(), Refusal> {
        let fields = [
            ("size_m", self.size_m, "[5e-3, 0.3] m"),
            ("relief_m", self.relief_m, "[0, 5e-3] m"),
            ("edge_m", self.edge_m, "[0, 20e-3] m"),
        ];
        for (field, [low, high], range) in fields {
            in_interval(&format!("{field}[0]"), low, range)?;
            in_interval(&format!("{field}[1]"), high, range)?;
            let name = format!("{field}[0]");
            in_range(&name, low, low <= high, "the range that ends at the second number")?;
        }
        Ok(())
    }
}

/// A closed solid and its parameters. All families have the same parameters, so that a data set can store them as
/// columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Name of the family.
    pub family: &'static str,
    /// Seed of the shape.
    pub seed: u64,
    /// The solid, m: contact face towards −z, lowest point at z = 0, centroid of the footprint at x = y = 0, flat top
    /// 10 mm above the highest point of the underside.
    pub mesh: TriMesh,
    /// Extent along x and along y, m. The larger one is the drawn size.
    pub size_m: [f64; 2],
    /// Difference between the highest and the lowest point of bow and waves, m; 0 if less than 1 µm.
    pub relief_m: f64,
    /// Radius of the outline's corners and of the lower edge, m: the drawn radius, or a third of `least_width_m` if
    /// that is less. 0 for domes, and if less than 0.1 mm.
    pub edge_m: f64,
    /// Height of a dome's rim above its middle, m; 0 for a flat underside.
    pub dome_m: f64,
    /// Area of the footprint seen from below, m².
    pub area_m2: f64,
    /// Width of the narrowest bar or gap of the plan, m.
    pub least_width_m: f64,
    /// Number of separate pieces.
    pub parts: u32,
    /// Number of holes through the solid.
    pub holes: u32,
}

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
/// use spts_contact::shapes::{Plan, ShapeFamily, ShapeRanges};
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
/// # Ok::<(), spts_input::Refusal>(())
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
    /// [`Refusal`] for a range that is not valid, or if the family's outlines cross themselves for all random numbers
    /// tried.
    pub fn build(&self, ranges: &ShapeRanges, seed: u64) -> Result<Shape, Refusal> {
        ranges.check()?;
        let streams = Streams::new(seed).child(self.name, 0);
        let tries = (0..TRIES).find_map(|attempt| {
            let mut dice = Dice::new(streams.rng("shape", attempt));
            self.attempt(ranges, seed, &mut dice)
        });
        tries.ok_or_else(|| {
            let name = self.name;
            Refusal::new(format!("shape family \"{name}\" has no closed solid for seed {seed} in {TRIES} tries"))
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
        let edge_m = if edge_m < LEAST_EDGE_M || plan.dome.is_some() { 0.0 } else { edge_m };
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

/// Every family of this crate.
pub const SHAPE_FAMILIES: &[ShapeFamily] = &[
    family("plate", "Rectangle, polygon of three to eight sides, trapezoid or ellipse", families::plate),
    family("perforated", "Plate with one to six round, square or slot-like holes", families::perforated),
    family("ring", "Round or angular ring, two rings one in the other, or a ring with a gap", families::ring),
    family("bar", "Straight or tapered bar, or two to four bars side by side", families::bar),
    family("junction", "Bars that meet: L, T, X, Y, Z, U, H or a star of arms", families::junction),
    family("letter", "Capital letter A to Z of random width, slant and weight", families::letter),
    family("polyline", "Thick line of two to six straight pieces, or a smoothly winding one", families::polyline),
    family("blob", "Smooth random outline, like a pebble or a puddle", families::blob),
    family("dome", "Part of a sphere or an ellipsoid, or a pebble, round side down", families::dome),
    family("comb", "Back with three to ten teeth on one side or on both", families::comb),
    family("gear", "Star or gear with five to twelve tips, with or without a bore", families::gear),
    family("studs", "Two to nine feet of one body, apart", families::studs),
    family("union", "Two to four plates, bars and blobs over one another, some with holes and bites", families::union),
    family(
        "pads",
        "Four to 24 small pads of one body, far apart: cross, lattice, circle, row or sprinkled",
        families::pads,
    ),
    family("foot", "Sole of a foot, shoe or paw: heel, ball, arch or none, toes apart or in one", families::foot),
    family("hand", "Palm and up to five fingers, spread or closed, or fingertips apart", families::hand),
    family("rods", "Thin rods: two or three that cross, a closed outline, a grid, a row or a bow", families::rods),
];

const fn family(name: &'static str, description: &'static str, plan: fn(&mut Dice) -> Plan) -> ShapeFamily {
    ShapeFamily { name, description, plan }
}

/// Builds the shape of `seed` in the family called `family`. The result depends only on the arguments, and has the same
/// bytes on any thread.
///
/// # Errors
/// [`Refusal`] if the name is unknown, a range is not valid, or the family has no solid for this seed.
pub fn build_shape(family: &str, ranges: &ShapeRanges, seed: u64) -> Result<Shape, Refusal> {
    let Some(known) = SHAPE_FAMILIES.iter().find(|known| known.name == family) else {
        let known: Vec<_> = SHAPE_FAMILIES.iter().map(|known| format!("\"{}\"", known.name)).collect();
        let known = known.join(", ");
        return Err(Refusal::new(format!("shape family \"{family}\" is not one of {known}")));
    };
    known.build(ranges, seed)
}
