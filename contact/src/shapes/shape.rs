//! A shape and its drawn parameters.

use crate::mesh::TriMesh;

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
