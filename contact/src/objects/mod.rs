//! The seventeen objects that were pressed on the published skin, as closed solids, with the place where each is pressed.
//!
//! The published text names the objects but gives no size. Sizes and places here were found by fitting a static
//! contact model to the published raster recordings (`scripts/fit_objects.py`), within what is believable for the
//! thing; they are estimates.
//!
//! ```
//! use spts_contact::objects::by_name;
//! let tape = by_name("tape").unwrap();
//! let mesh = (tape.build)();
//! assert_eq!((tape.label, mesh.open_edges()), (14, 0));
//! ```

mod bow;
mod household;
mod plates;
mod table;

use crate::mesh::TriMesh;
pub use table::{BALL_STIFFNESS_PA_PER_M, OBJECTS};

/// One object: what it is and how it is pressed.
#[derive(Debug, Clone, Copy)]
pub struct ObjectSpec {
    /// Name, as in the published recordings.
    pub name: &'static str,
    /// Label of the classifier, 1 to 17 in the order of [`OBJECTS`].
    pub label: u8,
    /// What the object is, in everyday words.
    pub description: &'static str,
    /// Builds the mesh: metres, contact face towards −z, lowest point at z = 0, origin at the point that is placed at
    /// `placement`. Body x points to increasing columns and body y to decreasing rows when the rotation is zero.
    pub build: fn() -> TriMesh,
    /// Stiffness of its own surface in series with the skin, Pa/m; `None` for what is rigid beside the foam.
    pub stiffness_pa_per_m: Option<f64>,
    /// Where and how it is pressed.
    pub placement: Placement,
}

/// Pose of an object on the skin, up to its height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Row of the body origin, in taxels; row 0 is the far edge, whole numbers are taxel centres.
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

/// The object of that name, or `None`.
#[must_use]
pub fn by_name(name: &str) -> Option<&'static ObjectSpec> {
    OBJECTS.iter().find(|o| o.name == name)
}

/// The object of that label, or `None`.
#[must_use]
pub fn by_label(label: u8) -> Option<&'static ObjectSpec> {
    OBJECTS.iter().find(|o| o.label == label)
}

/// The placements as CSV text, for scripts in other languages.
#[must_use]
pub fn placements_csv() -> String {
    let mut out = String::from("name,label,row,col,rotation_rad,tilt_x_rad,tilt_y_rad\n");
    for o in OBJECTS {
        let p = o.placement;
        let line = format!(
            "{},{},{},{},{},{},{}\n",
            o.name, o.label, p.row, p.col, p.rotation_rad, p.tilt_x_rad, p.tilt_y_rad
        );
        out.push_str(&line);
    }
    out
}

#[cfg(test)]
mod tests;
