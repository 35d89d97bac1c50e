//! Skins of any shape: sample points with normals and areas, and the foam under each of them.

mod field;
mod points;
#[cfg(test)]
mod tests;

pub use field::SurfaceField;
pub use points::{Solid, SurfacePoints, Winding};
