//! Flat shapes: letters, plates, discs. Lengths in metres; all are estimates (see the module above).

use super::bow::bowed;
use crate::mesh::polygon::{self, Point};
use crate::mesh::{TriMesh, extrude};

/// Thickness of the cut shapes, m. Not visible to the skin.
const THICKNESS_M: f64 = 10e-3;

/// Outline of a T that is `height` tall: a bar `bar` by `bar_width` on top, a stem `stem_width` wide; origin in the
/// middle of the box around it.
fn tee(bar: f64, bar_width: f64, height: f64, stem_width: f64) -> Vec<Point> {
    let (x, s, top, neck) = (0.5 * bar, 0.5 * stem_width, 0.5 * height, 0.5 * height - bar_width);
    vec![
        [-s, -top],
        [s, -top],
        [s, neck],
        [x, neck],
        [x, top],
        [-x, top],
        [-x, neck],
        [-s, neck],
    ]
}

/// Two bars of `width` that cross in their middles: one of length `long` along x, one of length `short` along y.
fn cross(long: f64, short: f64, width: f64) -> Vec<Point> {
    let (a, b, w) = (0.5 * long, 0.5 * short, 0.5 * width);
    vec![
        [-a, -w],
        [-w, -w],
        [-w, -b],
        [w, -b],
        [w, -w],
        [a, -w],
        [a, w],
        [w, w],
        [w, b],
        [-w, b],
        [-w, w],
        [-a, w],
    ]
}

/// Wide letter T.
pub(super) fn letter_t() -> TriMesh {
    bowed(
        extrude(&tee(60e-3, 29.5e-3, 97e-3, 16e-3), &[], THICKNESS_M),
        [-0.3e-3, -0.1e-3],
    )
}

/// Narrow letter T.
pub(super) fn small_t() -> TriMesh {
    bowed(
        extrude(&tee(55e-3, 10e-3, 105.5e-3, 7.5e-3), &[], THICKNESS_M),
        [0.0, -0.25e-3],
    )
}

/// Letter X.
pub(super) fn letter_x() -> TriMesh {
    bowed(extrude(&cross(96e-3, 96e-3, 5.5e-3), &[], THICKNESS_M), [-0.55e-3, 0.0])
}

/// Straight bar along x.
pub(super) fn line() -> TriMesh {
    bowed(
        extrude(&polygon::rectangle(96e-3, 8e-3), &[], THICKNESS_M),
        [-0.5e-3, 0.0],
    )
}

/// An L: legs along −x and +y from the outer corner at the lower right; origin in the middle of the box around it.
pub(super) fn corner() -> TriMesh {
    let (x, y, w) = (22.75e-3, 26.25e-3, 19e-3);
    let outline = [[-x, -y], [x, -y], [x, y], [x - w, y], [x - w, w - y], [-x, w - y]];
    bowed(extrude(&outline, &[], THICKNESS_M), [-0.05e-3, 0.05e-3])
}

/// Rectangular plate, its long edges touching first.
pub(super) fn rec() -> TriMesh {
    bowed(
        extrude(&polygon::rectangle(82e-3, 62e-3), &[], THICKNESS_M),
        [0.0, -0.4e-3],
    )
}

/// Round plate.
pub(super) fn circle() -> TriMesh {
    bowed(
        extrude(&polygon::circle(44e-3, 64), &[], THICKNESS_M),
        [0.05e-3, -0.15e-3],
    )
}

/// Equilateral triangle with rounded corners, apex along +y.
pub(super) fn trig() -> TriMesh {
    let outline = polygon::rounded(&polygon::triangle(68e-3), 3e-3, 4);
    bowed(extrude(&outline, &[], THICKNESS_M), [0.0, 0.0])
}

/// Square lid with rounded corners and a round opening.
pub(super) fn center() -> TriMesh {
    let outline = polygon::rounded(&polygon::rectangle(64.5e-3, 64.5e-3), 10e-3, 6);
    let hole = polygon::placed(&polygon::circle(13.5e-3, 32), 0.0, [-2.5e-3, 4e-3]);
    bowed(extrude(&outline, &[hole], THICKNESS_M), [-0.25e-3, 0.6e-3])
}
