//! The mesh itself.

/// Triangle mesh in metres, body axes; triangles are counter-clockwise seen from outside.
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
