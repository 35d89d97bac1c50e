//! The mesh itself.

/// Triangle mesh in metres, body axes; triangles are counter-clockwise seen from outside.
///
/// ```
/// use spts_contact::mesh::cuboid;
///
/// let block = cuboid([40e-3, 20e-3, 10e-3]);
/// let tilted = block.clone().rotated_x(0.1).grounded();
/// assert!((tilted.volume_m3() - block.volume_m3()).abs() < 1e-15);
/// assert!(tilted.bounds().unwrap().0[2].abs() < 1e-15, "its lowest point is at z = 0");
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriMesh {
    /// Vertex positions, m.
    pub vertices: Vec<[f64; 3]>,
    /// Indices into `vertices`.
    pub triangles: Vec<[u32; 3]>,
}

/// A position in a list as a 32-bit index. Saturates beyond 2³² entries, far beyond the budget of
/// [`checked`](super::checked).
pub(super) fn index(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}
