//! Size limits of meshes.

/// Smallest plausible extent of an object that presses on a skin, m.
pub const MIN_EXTENT_M: f64 = 1e-3;
/// Largest plausible extent, m.
pub const MAX_EXTENT_M: f64 = 2.0;
/// Largest credible coordinate, m: 500,000 times [`MAX_EXTENT_M`] from the origin, beyond which f32 steps are 60 mm.
pub(super) const MAX_COORDINATE_M: f64 = 1e6;
/// Size of the largest mesh file that is read, bytes. A text STL has about 250 bytes a triangle.
pub const MAX_FILE_BYTES: u64 = 1 << 28;
/// Most triangles of a mesh before repair, which takes about 0.5 kB a triangle; scanners export fewer.
pub(super) const MAX_TRIANGLES: usize = 1_000_000;
/// Most vertices of a mesh: a format without shared corners has three a triangle.
pub(super) const MAX_VERTICES: usize = 3 * MAX_TRIANGLES;
/// Number of triangles above which a mesh is decimated: further triangles cost time but do not improve the contact.
pub const SOFT_MAX_TRIANGLES: usize = 5000;
