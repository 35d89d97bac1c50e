//! Report on the check and repair of a mesh.

use super::size::SOFT_MAX_TRIANGLES;
use serde::Serialize;

/// What was repaired in a mesh when it was loaded, and the size of the mesh afterwards.
///
/// ```
/// use spts_contact::mesh::{cuboid, read_obj};
///
/// // a block in millimetres that has one triangle twice
/// let mut block = cuboid([40.0, 20.0, 10.0]);
/// block.triangles.push(block.triangles[0]);
/// let (mesh, report) = read_obj(block.to_obj("block").as_bytes(), 1e-3, "block.obj")?;
/// assert_eq!((report.duplicate_triangles, mesh.open_edges()), (1, 0));
/// assert!(!report.notes().is_empty(), "the repair is reported");
/// # Ok::<(), spts_contact::mesh::MeshError>(())
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct MeshReport {
    /// Vertices after repair.
    pub vertices: usize,
    /// Triangles after repair.
    pub triangles: usize,
    /// Vertices that coincided with another and were joined. Not counted for STL, where every triangle has its own
    /// corners.
    pub joined_vertices: usize,
    /// Dropped triangles without three distinct corners.
    pub dropped_triangles: usize,
    /// Dropped duplicate triangles.
    pub duplicate_triangles: usize,
    /// Triangles that were turned to agree with their neighbours.
    pub turned_triangles: usize,
    /// Whether the mesh, or a part of it, was inside out and has been turned.
    pub flipped: bool,
    /// Number of holes of at most 5 % of the mesh's size that were closed with a flat surface.
    pub filled_holes: usize,
    /// Number of large holes in the upper side of the mesh, as of a bowl, that were closed. From the rim of each hole,
    /// a wall goes straight up to a flat lid above the highest point of the mesh. While the mesh stands upright, walls
    /// and lid touch nothing; a tilted press of such a mesh is refused.
    pub lids: usize,
    /// Number of triangles before decimation; `None` if the mesh was not decimated.
    pub decimated_from: Option<usize>,
    /// Largest distance between the surfaces before and after decimation, m; `None` without decimation.
    pub decimation_error_m: Option<f64>,
    /// Whether there are more than [`SOFT_MAX_TRIANGLES`] triangles, which makes contact slow.
    pub heavy: bool,
    /// Sides of the box around the mesh, m.
    pub extent_m: [f64; 3],
    /// Middle of the box around the mesh, relative to its origin, m.
    pub middle_m: [f64; 3],
    /// Enclosed volume, m³.
    pub volume_m3: f64,
}

impl MeshReport {
    /// Whether the origin, by which the object is held and placed, lies beside the box around the mesh in x or y.
    #[must_use]
    pub(super) fn is_off_centre(&self) -> bool {
        (0..2).any(|k| self.middle_m[k].abs() > 0.5 * self.extent_m[k])
    }

    /// Notes for the user, one a line; empty if the mesh needed no repair.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        let mut counted = |count: usize, one: &str, many: &str| match count {
            0 => {}
            1 => notes.push(format!("1 {one}")),
            n => notes.push(format!("{n} {many}")),
        };
        counted(
            self.joined_vertices,
            "vertex of the mesh coincided with another and was joined to it",
            "vertices of the mesh coincided with others and were joined to them",
        );
        counted(
            self.dropped_triangles,
            "triangle of the mesh without area was dropped",
            "triangles of the mesh without area were dropped",
        );
        counted(
            self.duplicate_triangles,
            "triangle of the mesh was there before and was dropped",
            "triangles of the mesh were there before and were dropped",
        );
        counted(
            self.turned_triangles,
            "triangle of the mesh was turned to agree with its neighbours",
            "triangles of the mesh were turned to agree with their neighbours",
        );
        counted(
            self.filled_holes,
            "small hole in the mesh was filled flat",
            "small holes in the mesh were filled flat",
        );
        counted(
            self.lids,
            "hole in the mesh opens upward and was closed above it, where nothing touches while the mesh stands upright",
            "holes in the mesh open upward and were closed above it, where nothing touches while the mesh stands upright",
        );
        if self.flipped {
            notes.push("the mesh was inside out and has been turned".to_owned());
        }
        if let (Some(from), Some(error_m)) = (self.decimated_from, self.decimation_error_m) {
            notes.push(format!(
                "the mesh was decimated from {from} to {} triangles; the surface moved by at most {:.4} mm",
                self.triangles,
                1e3 * error_m
            ));
        }
        if self.heavy {
            notes.push(format!(
                "the mesh has {} triangles, more than {SOFT_MAX_TRIANGLES}: expect a slow contact",
                self.triangles
            ));
        }
        if self.is_off_centre() {
            let [x, y, _] = self.middle_m.map(|m| 1e3 * m);
            notes.push(format!(
                "the origin of the mesh, by which it is held and placed, lies beside it: the middle of the mesh is \
                 ({x:.1}, {y:.1}) mm from it; move the mesh in its file, or mind the lever"
            ));
        }
        notes
    }
}
