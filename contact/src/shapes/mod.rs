//! Procedural shapes: families of closed solids, which give thousands of different shapes for synthetic data sets.
//!
//! A family draws an outline with holes; size, relief and edge are drawn from ranges that all families share. The solid
//! has a flat top. Its underside is the sum of three parts: a rounded lower edge or a dome, a bow, and a few waves.
//! Points lie only where these parts need them and are joined by a constrained Delaunay triangulation, so a shape has
//! few triangles and is built in well under a millisecond.
//!
//! The rounded lower edge is a quarter circle in one chord (radii below 1 mm) or two. It is made of points inside the
//! outline, at their distance from it; no loop is offset. A neck narrower than two radii, which only `union` may have,
//! keeps its points on the outline alone and so stands back by up to a radius.
//!
//! ```
//! use spts_contact::shapes::{SHAPE_FAMILIES, ShapeRanges, build_shape};
//!
//! let ranges = ShapeRanges { size_m: [40e-3, 60e-3], ..ShapeRanges::default() };
//! for family in SHAPE_FAMILIES {
//!     let shape = build_shape(family.name, &ranges, 7)?;
//!     assert_eq!(shape.mesh.open_edges(), 0);
//!     assert!(shape.size_m[0] <= 60e-3 && shape.size_m[1] <= 60e-3 && shape.relief_m <= 0.6e-3);
//! }
//! # Ok::<(), spts_input::Refusal>(())
//! ```

mod families;
mod plan;
mod region;
mod shape;
mod solid;
#[cfg(test)]
mod tests;

pub use plan::{Dice, Dome, Plan};
pub use shape::{SHAPE_FAMILIES, Shape, ShapeFamily, ShapeRanges, build_shape};
