//! Specification of an object and of its place on the skin.

use crate::mesh::TriMesh;

/// One object: its shape, and how it is pressed.
///
/// ```
/// use spts_contact::objects::by_name;
///
/// let tape = by_name("tape").expect("one of the seventeen objects");
/// let mesh = (tape.build)();
/// assert_eq!(mesh.open_edges(), 0);
/// assert!(mesh.extent_m() < 0.15, "smaller than the skin");
/// ```
#[derive(Debug, Clone, Copy)]
pub struct ObjectSpec {
    /// Name, as in the published recordings.
    pub name: &'static str,
    /// Label for classifiers, 1 to 17 in the order of [`OBJECTS`](super::OBJECTS); 0 for an object that is not
    /// classified.
    pub label: u8,
    /// What the object is, in everyday words.
    pub description: &'static str,
    /// Builds the mesh: metres, contact face towards −z, lowest point at z = 0, origin at the point that `placement`
    /// positions. At zero rotation, body x points towards increasing columns and body y towards decreasing rows.
    pub build: fn() -> TriMesh,
    /// Stiffness of the object's surface in series with the skin, Pa/m; `None` if it is rigid compared with the foam.
    pub stiffness_pa_per_m: Option<f64>,
    /// Where and at which angles the object is pressed.
    pub placement: Placement,
}

/// Pose of an object on the skin, except its height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Row of the body origin, in taxels. Row 0 is the far edge; whole numbers are taxel centres.
    pub row: f64,
    /// Column of the body origin, in taxels.
    pub col: f64,
    /// Rotation about the skin's normal, counter-clockwise seen from above, rad.
    pub rotation_rad: f64,
    /// Tilt about the skin's x axis, after the rotation, rad. Positive lifts the side of small rows.
    pub tilt_x_rad: f64,
    /// Tilt about the skin's y axis, after the tilt about x, rad. Positive lowers the side of large columns.
    pub tilt_y_rad: f64,
}

impl Placement {
    /// Rotation matrix from body to skin axes, row-major: R = `R_y(tilt_y)` · `R_x(tilt_x)` · `R_z(rotation)`.
    #[must_use]
    pub fn matrix(&self) -> [[f64; 3]; 3] {
        let (sz, cz) = self.rotation_rad.sin_cos();
        let (sx, cx) = self.tilt_x_rad.sin_cos();
        let (sy, cy) = self.tilt_y_rad.sin_cos();
        [
            [cy * cz + sy * sx * sz, sy * sx * cz - cy * sz, sy * cx],
            [cx * sz, cx * cz, -sx],
            [cy * sx * sz - sy * cz, sy * sz + cy * sx * cz, cy * cx],
        ]
    }
}
