//! Skins of any shape: sample points with normals and areas, and the foam under each of them.

mod field;
mod points;
mod solid;
#[cfg(test)]
mod tests;

pub use field::SurfaceField;
pub use points::{SurfacePoints, Winding};
pub(crate) use solid::Standing;
pub use solid::{Part, Primitive, Solid};
