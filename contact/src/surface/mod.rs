//! Skins of any shape: sample points with normals and areas, and the foam under each of them.

mod field;
mod points;
mod solid;
#[cfg(test)]
mod tests;
mod wrap;

pub use field::{SurfaceConfig, SurfaceField};
pub use points::SurfacePoints;
pub use solid::Solid;
pub use wrap::Winding;
