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
mod duplicates;
mod error;
mod glb;
mod glb_check;
mod glb_view;
mod holes;
mod load;
mod measure;
mod nearest;
mod orient;
pub mod polygon;
mod refine;
mod report;
mod revolve;
mod sides;
mod size;
mod solid;
mod stl;
mod transform;
mod tri_mesh;
mod triangulate;
mod weld;
mod write;

pub use check::checked;
pub use decimate::MAX_DECIMATION_ERROR_M;
pub use error::MeshError;
pub use load::{load, read_glb, read_obj, read_stl};
pub use report::MeshReport;
pub use revolve::{revolve, revolve_ring, sphere};
pub use size::{MAX_EXTENT_M, MAX_FILE_BYTES, MIN_EXTENT_M, SOFT_MAX_TRIANGLES};
pub use solid::{cuboid, cylinder, extrude, extrude_recessed};
pub use tri_mesh::TriMesh;

#[cfg(test)]
mod decimate_tests;
#[cfg(test)]
mod repair_tests;
#[cfg(test)]
mod stl_tests;
#[cfg(test)]
mod tests;
