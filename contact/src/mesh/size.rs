//! Sizes of the meshes that may press on a skin.

/// Smallest credible extent of something that presses on a skin, m.
pub const MIN_EXTENT_M: f64 = 1e-3;
/// Largest credible extent, m.
pub const MAX_EXTENT_M: f64 = 2.0;
/// Meshes of more triangles are decimated: contact costs grow with them, its accuracy no longer does.
pub const SOFT_MAX_TRIANGLES: usize = 5000;
