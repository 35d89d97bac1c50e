//! A shape and what was drawn for it.

use crate::mesh::TriMesh;

/// A closed solid and its parameters, the same ones for every family, so that a data set can keep them as columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Name of the family.
    pub family: &'static str,
    /// Seed that picked the shape.
    pub seed: u64,
    /// The solid: metres, contact face towards −z, lowest point at z = 0, centroid of the footprint at x = y = 0, flat
    /// top 10 mm above the highest point of the underside.
    pub mesh: TriMesh,
    /// Extent along x and along y, m; the larger one is the drawn size.
    pub size_m: [f64; 2],
    /// Difference between the highest and the lowest point of the bow and bumps, m; 0 for less than 1 µm.
    pub relief_m: f64,
    /// Radius of the corners of the outline and of the lower edge, m: the drawn one, or a third of `least_width_m` if
    /// that is less. 0 for domes and for less than 0.1 mm.
    pub edge_m: f64,
    /// Rise of a dome's rim over its middle, m; 0 for a flat underside.
    pub dome_m: f64,
    /// Area of the footprint, m²: of all that is seen from below.
    pub area_m2: f64,
    /// Width of the narrowest bar or gap of the plan, m.
    pub least_width_m: f64,
    /// Number of pieces that do not touch one another.
    pub parts: u32,
    /// Number of holes through the solid.
    pub holes: u32,
}
