//! A fingertip, which touches the skin but is not one of the classified objects.

use super::spec::{ObjectSpec, Placement};
use crate::mesh::{TriMesh, sphere};

/// Radius of a finger's tip, m.
const RADIUS_M: f64 = 8e-3;
/// Stiffness of its pulp, Pa/m: about 80 kPa over 5 mm (estimate).
const PULP_PA_PER_M: f64 = 1.6e7;

/// A fingertip: a ball of 8 mm radius with a soft surface. It has no label. Scenes select it with `press.object =
/// "finger"`.
pub const FINGER: ObjectSpec = ObjectSpec {
    name: "finger",
    label: 0,
    description: "Tip of a finger",
    build: tip,
    stiffness_pa_per_m: Some(PULP_PA_PER_M),
    placement: Placement {
        row: 4.5,
        col: 4.5,
        rotation_rad: 0.0,
        tilt_x_rad: 0.0,
        tilt_y_rad: 0.0,
    },
};

/// Facets of 3.75° lie at most r (1 − cos 1.9°) = 4 µm inside the ball.
fn tip() -> TriMesh {
    sphere(RADIUS_M, 48, 96)
}
