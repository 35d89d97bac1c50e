//! What a family draws.

use crate::mesh::polygon::Point;

/// An outline with holes and what is below it, in any unit of length: the shape is scaled to its drawn size.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Plan {
    /// Closed loops whose union is the footprint, counter-clockwise. Those of a [`Plan::union`] may overlap and cross
    /// themselves.
    pub add: Vec<Vec<Point>>,
    /// Closed loops that are cut out of the footprint, counter-clockwise.
    pub cut: Vec<Vec<Point>>,
    /// Whether loops may overlap. If not, each is simple, the cut ones lie inside and none touches another.
    pub overlapping: bool,
    /// Width of the narrowest bar or gap. Radii are at most a third of it.
    pub least_width: f64,
    /// A rounded underside; `None` for a flat one.
    pub dome: Option<Dome>,
}

/// A rounded underside over one outline without holes that is star-shaped about the origin: a cap of an ellipsoid,
/// stretched to the outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dome {
    /// Angle of the cap from its middle to its rim, rad; (0, π/2], where π/2 is half an ellipsoid.
    pub cap_rad: f64,
    /// Rise of the rim over the middle, as a multiple of the outline's width.
    pub rise: f64,
    /// Radius of the flat middle, as a share of the outline's; [0, 1).
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

    /// A simple outline with holes inside, or several outlines apart.
    #[must_use]
    pub fn apart(add: Vec<Vec<Point>>, cut: Vec<Vec<Point>>, least_width: f64) -> Self {
        Self {
            add,
            cut,
            least_width,
            ..Self::default()
        }
    }

    /// The union of outlines that overlap.
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
