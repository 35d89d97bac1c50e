//! The table of shape families.

use super::error::ShapeError;
use super::families;
use super::family::ShapeFamily;
use super::ranges::ShapeRanges;
use super::shape::Shape;

/// Every family of this crate.
pub const SHAPE_FAMILIES: &[ShapeFamily] = &[
    ShapeFamily {
        name: "plate",
        description: "Rectangle, polygon of three to eight sides, trapezoid or ellipse",
        plan: families::plate,
    },
    ShapeFamily {
        name: "perforated",
        description: "Plate with one to six round, square or slot-like holes",
        plan: families::perforated,
    },
    ShapeFamily {
        name: "ring",
        description: "Round or angular ring, two rings one in the other, or a ring with a gap",
        plan: families::ring,
    },
    ShapeFamily {
        name: "bar",
        description: "Straight or tapered bar, or two to four bars side by side",
        plan: families::bar,
    },
    ShapeFamily {
        name: "junction",
        description: "Bars that meet: L, T, X, Y, Z, U, H or a star of arms",
        plan: families::junction,
    },
    ShapeFamily {
        name: "letter",
        description: "Capital letter A to Z of random width, slant and weight",
        plan: families::letter,
    },
    ShapeFamily {
        name: "polyline",
        description: "Thick line of two to six straight pieces, or a smoothly winding one",
        plan: families::polyline,
    },
    ShapeFamily {
        name: "blob",
        description: "Smooth random outline, like a pebble or a puddle",
        plan: families::blob,
    },
    ShapeFamily {
        name: "dome",
        description: "Part of a sphere or an ellipsoid, or a pebble, round side down",
        plan: families::dome,
    },
    ShapeFamily {
        name: "comb",
        description: "Back with three to ten teeth on one side or on both",
        plan: families::comb,
    },
    ShapeFamily {
        name: "gear",
        description: "Star or gear with five to twelve tips, with or without a bore",
        plan: families::gear,
    },
    ShapeFamily {
        name: "studs",
        description: "Two to nine feet of one body, apart",
        plan: families::studs,
    },
    ShapeFamily {
        name: "union",
        description: "Two to four plates, bars and blobs over one another, some with holes and bites",
        plan: families::union,
    },
];

/// Builds the shape of `seed` in the family called `family`. The result depends only on the arguments, and has the same
/// bytes on any thread.
///
/// # Errors
/// [`ShapeError`] if the name is unknown, a range is not valid, or the family has no solid for this seed.
pub fn build_shape(family: &str, ranges: &ShapeRanges, seed: u64) -> Result<Shape, ShapeError> {
    let Some(known) = SHAPE_FAMILIES.iter().find(|known| known.name == family) else {
        let names: Vec<_> = SHAPE_FAMILIES
            .iter()
            .map(|known| format!("\"{}\"", known.name))
            .collect();
        return Err(ShapeError::Unknown {
            name: family.to_owned(),
            known: names.join(", "),
        });
    };
    known.build(ranges, seed)
}
