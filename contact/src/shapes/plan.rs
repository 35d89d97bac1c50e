//! The drawing from which a shape is built.

use crate::mesh::polygon::Point;

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
/// # Ok::<(), spts_contact::shapes::ShapeError>(())
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
    /// A simple outline without holes.
    #[must_use]
    pub fn simple(outline: Vec<Point>, least_width: f64) -> Self {
        Self {
            add: vec![outline],
            least_width,
            ..Self::default()
        }
    }

    /// A simple outline with holes, or several separate outlines.
    #[must_use]
    pub fn apart(add: Vec<Vec<Point>>, cut: Vec<Vec<Point>>, least_width: f64) -> Self {
        Self {
            add,
            cut,
            least_width,
            ..Self::default()
        }
    }

    /// The union of overlapping outlines.
    #[must_use]
    pub fn union(add: Vec<Vec<Point>>, cut: Vec<Vec<Point>>, least_width: f64) -> Self {
        Self {
            add,
            cut,
            overlapping: true,
            least_width,
            dome: None,
        }
    }
}
