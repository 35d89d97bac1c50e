//! The seventeen objects that were pressed on the published skin, as closed solids, each with the place where it is
//! pressed.
//!
//! The published text names the objects but gives no sizes. Sizes and places are estimates: a static contact model was
//! fitted to the published raster recordings (`scripts/fit_objects.py` at the tag `before-halving`), within plausible
//! sizes of each object.
//!
//! ```
//! use spts_contact::objects::by_name;
//! let tape = by_name("tape").unwrap();
//! let mesh = (tape.build)();
//! assert_eq!((tape.label, mesh.open_edges()), (14, 0));
//! ```

mod meshes;
#[cfg(test)]
mod tests;

use crate::mesh::TriMesh;

/// Every object that can be pressed by name: those of [`OBJECTS`], and [`FINGER`].
pub fn pressable() -> impl Iterator<Item = &'static ObjectSpec> {
    OBJECTS.iter().chain([&FINGER])
}

/// The object of [`OBJECTS`] called `name`; `None` if there is none.
pub fn by_name(name: &str) -> Option<&'static ObjectSpec> {
    OBJECTS.iter().find(|o| o.name == name)
}

/// The placements as CSV text, for scripts in other languages.
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
    /// Label for classifiers, 1 to 17 in the order of [`OBJECTS`]; 0 for an object that is not
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

/// The eraser's felt pad: a modulus of 1 MPa over 4 mm (estimate).
const ERASER_PAD_PA_PER_M: f64 = 1e6 / 4e-3;

/// Stiffness of a tennis ball's surface in series with the skin, Pa/m. For a sphere on springs, F = π K R δ². The ITF's
/// forward deformation test (80 N at 5.6–7.4 mm) then gives K = 1.4–2.4e7 Pa/m.
pub const BALL_STIFFNESS_PA_PER_M: f64 = 2e7;

/// All objects, in order of label. The last five numbers are those of a [`Placement`]: row, col, rotation about the
/// skin's normal, tilts about x and y.
pub const OBJECTS: &[ObjectSpec] = &[
    object(
        1,
        "brain",
        "Toy brain of the size of a fist: an ellipsoid with furrows",
        meshes::brain,
        [4.51, 4.34, -0.601, 0.0023, -0.0019],
    ),
    object(
        2,
        "center",
        "Square lid with rounded corners and a round opening near its middle",
        meshes::center,
        [4.78, 5.36, 0.118, 0.006, -0.0097],
    ),
    object(3, "circle", "Round plate, like a coaster", meshes::circle, [4.53, 4.25, 0.0, -0.004, -0.0012]),
    object(
        4,
        "comb",
        "Tail comb lying flat: toothed blade and thin tail",
        meshes::comb,
        [6.53, 4.82, -1.03, -0.002, 0.005],
    ),
    object(5, "corner", "L-shaped corner piece", meshes::corner, [5.17, 5.29, 0.086, -0.0105, -0.0061]),
    soft(
        ERASER_PAD_PA_PER_M,
        object(
            6,
            "eraser",
            "Block eraser for a whiteboard, pad down",
            meshes::eraser,
            [4.92, 4.59, 0.122, 0.0012, -0.0056],
        ),
    ),
    object(7, "fish", "Toy fish in an S curve", meshes::fish, [5.01, 3.17, 0.949, -0.004, 0.0204]),
    object(
        8,
        "gel",
        "Tube of gel on its side, longer than the skin leaves room for",
        meshes::gel,
        [5.8, 4.48, 0.0, -0.0007, 0.0002],
    ),
    object(9, "line", "Straight bar, pressed along the diagonal", meshes::line, [4.58, 4.58, -0.786, 0.001, 0.0028]),
    object(
        10,
        "perfume",
        "Perfume bottle standing on the rim of its hollow bottom",
        meshes::perfume,
        [5.02, 4.28, 0.028, 0.0061, -0.0097],
    ),
    object(11, "rec", "Rectangular plate", meshes::rec, [5.07, 4.24, -0.101, -0.0033, -0.0009]),
    object(
        12,
        "smallT",
        "Narrow letter T, pressed along the diagonal",
        meshes::small_t,
        [4.73, 4.31, 2.378, 0.0246, 0.0339],
    ),
    object(13, "T", "Wide letter T", meshes::letter_t, [4.6, 4.68, 0.012, 0.0022, -0.0036]),
    object(
        14,
        "tape",
        "Roll of adhesive tape lying flat, with its open core",
        meshes::tape,
        [4.11, 4.2, 0.0, 0.0206, -0.0119],
    ),
    soft(BALL_STIFFNESS_PA_PER_M, object(15, "tennis", "Tennis ball", meshes::tennis, [5.05, 5.03, 0.0, 0.0, 0.0])),
    object(16, "trig", "Triangular block with rounded corners", meshes::trig, [4.83, 3.92, 0.103, -0.0285, -0.0047]),
    object(17, "X", "Letter X: two crossed bars", meshes::letter_x, [6.01, 3.91, 0.799, 0.0091, -0.0275]),
];

const fn object(
    label: u8,
    name: &'static str,
    description: &'static str,
    build: fn() -> TriMesh,
    [row, col, rotation_rad, tilt_x_rad, tilt_y_rad]: [f64; 5],
) -> ObjectSpec {
    ObjectSpec {
        name,
        label,
        description,
        build,
        stiffness_pa_per_m: None,
        placement: Placement { row, col, rotation_rad, tilt_x_rad, tilt_y_rad },
    }
}

/// `object` with a surface of this stiffness, Pa/m.
const fn soft(stiffness_pa_per_m: f64, object: ObjectSpec) -> ObjectSpec {
    ObjectSpec { stiffness_pa_per_m: Some(stiffness_pa_per_m), ..object }
}

/// Stiffness of a finger's pulp, Pa/m: about 80 kPa over 5 mm (estimate).
const PULP_PA_PER_M: f64 = 1.6e7;

/// A fingertip: a ball of 8 mm radius with a soft surface. It has no label. Scenes select it with `press.object =
/// "finger"`.
pub const FINGER: ObjectSpec =
    soft(PULP_PA_PER_M, object(0, "finger", "Tip of a finger", meshes::fingertip, [4.5, 4.5, 0.0, 0.0, 0.0]));
