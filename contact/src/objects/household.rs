//! Household objects: brain, comb, eraser, fish, gel, perfume, tape, tennis ball. Lengths in metres; all but the ball's
//! are estimates.

use super::bow::bowed;
use crate::mesh::polygon::{self, Point};
use crate::mesh::{TriMesh, extrude, extrude_recessed, revolve, sphere};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Toy brain: an ellipsoid with a furrowed underside.
pub(super) fn brain() -> TriMesh {
    let (a, b, c) = (20e-3, 29.5e-3, 20e-3);
    let (ridge_m, pitch_m) = (1.6e-3, 14e-3);
    sphere(1.0, 40, 56)
        .mapped(|[x, y, z]| {
            let (x, y, z) = (a * x, b * y, c * z);
            let fold = (TAU * x / pitch_m).cos() * (TAU * y / pitch_m).cos();
            // the furrows fade out towards the equator
            let depth = (1.0 - z / c).max(0.0);
            [x, y, z - ridge_m * depth * fold]
        })
        .grounded()
}

/// Tail comb, slightly bent: a toothed blade with its back along +y, a thin tail along −x.
pub(super) fn comb() -> TriMesh {
    let (blade, back, teeth, tail, tail_width) = (61.5e-3, 7.5e-3, 12e-3, 75e-3, 6e-3);
    let (pitch, tooth) = (5e-3, 3e-3);
    let x0 = -0.5 * blade;
    let mut outline: Vec<Point> = vec![[x0, 0.0]];
    let mut x = x0;
    while x + tooth <= 0.5 * blade + 1e-9 {
        let right = x + tooth;
        if x > x0 {
            outline.push([x, 0.0]);
        }
        outline.extend([[x, -teeth], [right, -teeth], [right, 0.0]]);
        x += pitch;
    }
    outline.remove(0);
    outline.extend([
        [0.5 * blade, 0.0],
        [0.5 * blade, back],
        [x0, back],
        [x0 - tail, back],
        [x0 - tail, back - 0.5 * tail_width],
        [x0, back - tail_width],
        [x0, 0.0],
    ]);
    outline.dedup();
    bowed(extrude(&outline, &[], 4e-3), [0.55e-3, 0.05e-3])
}

/// Block eraser, its felt pad slightly bowed.
pub(super) fn eraser() -> TriMesh {
    bowed(
        extrude(&polygon::rectangle(53e-3, 87e-3), &[], 25e-3),
        [0.2e-3, -0.15e-3],
    )
}

/// Toy fish swimming in an S: body thickest in the middle, tail fin flared.
pub(super) fn fish() -> TriMesh {
    let (length, sway, width) = (80e-3, -3.5e-3, 15.5e-3);
    let spine = |x: f64| sway * (TAU * x / length).sin();
    let half_width = |x: f64| 0.5 * width * fish_width(x / length + 0.5);
    let outline = polygon::between(
        [-0.5 * length, 0.5 * length],
        24,
        |x| spine(x) - half_width(x),
        |x| spine(x) + half_width(x),
    );
    bowed(extrude(&outline, &[], 15e-3), [-0.25e-3, -0.05e-3])
}

/// Width of the fish, as a part of the widest, at `s` from tail (0) to nose (1).
fn fish_width(s: f64) -> f64 {
    let body = (std::f64::consts::PI * ((s - 0.1) / 0.9).clamp(0.0, 1.0))
        .sin()
        .max(0.0)
        .sqrt();
    let fin = 0.8 * (1.0 - s / 0.2).max(0.0);
    body.max(fin).max(0.15)
}

/// Tube of gel on its side, along y: a cylinder with bevelled ends.
pub(super) fn gel() -> TriMesh {
    let (radius, length, edge) = (20.5e-3, 140e-3, 2e-3);
    let half = 0.5 * length;
    let profile = [
        [0.0, -half],
        [radius - edge, -half],
        [radius - 0.3 * edge, 0.3 * edge - half],
        [radius, edge - half],
        [radius, half - edge],
        [radius - 0.3 * edge, half - 0.3 * edge],
        [radius - edge, half],
        [0.0, half],
    ];
    revolve(&profile, 96).rotated_x(FRAC_PI_2).grounded()
}

/// Perfume bottle standing on the rim of its hollow bottom.
pub(super) fn perfume() -> TriMesh {
    let (width, height, rim) = (64e-3, 82.5e-3, 7.5e-3);
    let outer = polygon::rounded(&polygon::rectangle(width, height), 12e-3, 6);
    let inner = polygon::rounded(&polygon::rectangle(width - 2.0 * rim, height - 2.0 * rim), 6e-3, 4);
    bowed(extrude_recessed(&outer, &inner, 30e-3, 4e-3), [0.2e-3, -0.45e-3])
}

/// Roll of adhesive tape lying flat, with its open core.
pub(super) fn tape() -> TriMesh {
    let hole = polygon::circle(8e-3, 40);
    bowed(extrude(&polygon::circle(28e-3, 64), &[hole], 19e-3), [0.3e-3, 0.3e-3])
}

/// Tennis ball: diameter within 65.4 to 68.6 mm (International Tennis Federation, *Rules of Tennis*, appendix I).
pub(super) fn tennis() -> TriMesh {
    sphere(33.4e-3, 40, 60)
}
