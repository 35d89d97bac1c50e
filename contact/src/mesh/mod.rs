//! Triangle meshes: measure, shape, move, repair, check, read and write.
//!
//! ```
//! use spts_contact::mesh::{extrude, polygon};
//! let block = extrude(&polygon::rectangle(40e-3, 20e-3), &[], 10e-3);
//! assert!((block.volume_m3() - 8e-6).abs() < 1e-15);
//! assert_eq!(block.open_edges(), 0);
//! ```

mod check;
mod decimate;
mod files;
mod glb;
mod near_side;
mod obj;
pub mod polygon;
mod solid;
#[cfg(test)]
mod tests;
mod tri_mesh;

pub use check::{MeshError, MeshOptions, MeshReport, Repair, checked};
pub use decimate::MAX_DECIMATION_ERROR_M;
pub use files::{load, read_glb, read_obj, read_stl, unknown_extension};
pub use solid::{cuboid, cylinder, extrude, extrude_recessed, revolve, revolve_ring, sphere};
pub use tri_mesh::{MAX_EXTENT_M, MAX_FILE_BYTES, MIN_EXTENT_M, SOFT_MAX_TRIANGLES, TriMesh};
pub(crate) use tri_mesh::{Rim, span};
