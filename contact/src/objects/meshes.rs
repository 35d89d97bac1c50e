//! The meshes of the objects. Lengths in metres; all but the tennis ball's are estimates.

use crate::mesh::polygon::{self, Point};
use crate::mesh::{TriMesh, extrude, extrude_recessed, revolve, sphere};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Distance from the centre at which a bow is quoted, m.
const BOW_AT_M: f64 = 40e-3;
/// Longest edge of a bowed face, m: a parabola that rises 1 mm at 40 mm departs from such chords by less than 16 µm.
const LONGEST_EDGE_M: f64 = 10e-3;

/// `mesh` bent by x²·b₀ + y²·b₁, where `bow_m` is the rise at ±40 mm along body x and y, then set down on z = 0.
/// Positive: the middle touches first. Negative: the rim does. Only the lowest face (z = 0) is refined to follow the
/// parabola closely.
pub(super) fn bowed(mesh: TriMesh, bow_m: [f64; 2]) -> TriMesh {
    let on_face = |v: [f64; 3]| v[2] <= 1e-9;
    mesh.refined(LONGEST_EDGE_M, |p, q| on_face(p) && on_face(q))
        .mapped(|[x, y, z]| {
            let rise = bow_m[0] * (x / BOW_AT_M).powi(2) + bow_m[1] * (y / BOW_AT_M).powi(2);
            [x, y, z + rise]
        })
        .grounded()
}

// Flat shapes: letters, plates, discs.

/// Thickness of the cut shapes, m. Not visible to the skin.
const THICKNESS_M: f64 = 10e-3;

/// Outline of a T that is `height` tall: a bar `bar` by `bar_width` on top, a stem `stem_width` wide; origin in the
/// middle of the box around it.
fn tee(bar: f64, bar_width: f64, height: f64, stem_width: f64) -> Vec<Point> {
    let (x, s, top, neck) = (0.5 * bar, 0.5 * stem_width, 0.5 * height, 0.5 * height - bar_width);
    vec![[-s, -top], [s, -top], [s, neck], [x, neck], [x, top], [-x, top], [-x, neck], [-s, neck]]
}

/// Two bars of `width` that cross in their middles: one of length `long` along x, one of length `short` along y.
fn cross(long: f64, short: f64, width: f64) -> Vec<Point> {
    let (a, b, w) = (0.5 * long, 0.5 * short, 0.5 * width);
    vec![[-a, -w], [-w, -w], [-w, -b], [w, -b], [w, -w], [a, -w], [a, w], [w, w], [w, b], [-w, b], [-w, w], [-a, w]]
}

/// Wide letter T.
pub(super) fn letter_t() -> TriMesh {
    bowed(extrude(&tee(60e-3, 29.5e-3, 97e-3, 16e-3), &[], THICKNESS_M), [-0.3e-3, -0.1e-3])
}

/// Narrow letter T.
pub(super) fn small_t() -> TriMesh {
    bowed(extrude(&tee(55e-3, 10e-3, 105.5e-3, 7.5e-3), &[], THICKNESS_M), [0.0, -0.25e-3])
}

/// Letter X.
pub(super) fn letter_x() -> TriMesh {
    bowed(extrude(&cross(96e-3, 96e-3, 5.5e-3), &[], THICKNESS_M), [-0.55e-3, 0.0])
}

/// Straight bar along x.
pub(super) fn line() -> TriMesh {
    bowed(extrude(&polygon::rectangle(96e-3, 8e-3), &[], THICKNESS_M), [-0.5e-3, 0.0])
}

/// An L: legs along −x and +y from the outer corner at the lower right; origin in the middle of the box around it.
pub(super) fn corner() -> TriMesh {
    let (x, y, w) = (22.75e-3, 26.25e-3, 19e-3);
    let outline = [[-x, -y], [x, -y], [x, y], [x - w, y], [x - w, w - y], [-x, w - y]];
    bowed(extrude(&outline, &[], THICKNESS_M), [-0.05e-3, 0.05e-3])
}

/// Rectangular plate, its long edges touching first.
pub(super) fn rec() -> TriMesh {
    bowed(extrude(&polygon::rectangle(82e-3, 62e-3), &[], THICKNESS_M), [0.0, -0.4e-3])
}

/// Round plate.
pub(super) fn circle() -> TriMesh {
    bowed(extrude(&polygon::circle(44e-3, 64), &[], THICKNESS_M), [0.05e-3, -0.15e-3])
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

// Household objects: brain, comb, eraser, fish, gel, perfume, tape, tennis ball.

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
    bowed(extrude(&polygon::rectangle(53e-3, 87e-3), &[], 25e-3), [0.2e-3, -0.15e-3])
}

/// Toy fish swimming in an S: body thickest in the middle, tail fin flared.
pub(super) fn fish() -> TriMesh {
    let (length, sway, width) = (80e-3, -3.5e-3, 15.5e-3);
    let spine = |x: f64| sway * (TAU * x / length).sin();
    let half_width = |x: f64| 0.5 * width * fish_width(x / length + 0.5);
    let outline =
        polygon::between([-0.5 * length, 0.5 * length], 24, |x| spine(x) - half_width(x), |x| spine(x) + half_width(x));
    bowed(extrude(&outline, &[], 15e-3), [-0.25e-3, -0.05e-3])
}

/// Width of the fish, as a part of the widest, at `s` from tail (0) to nose (1).
fn fish_width(s: f64) -> f64 {
    let body = (std::f64::consts::PI * ((s - 0.1) / 0.9).clamp(0.0, 1.0)).sin().max(0.0).sqrt();
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

/// Tip of a finger. Facets of 3.75° lie at most r (1 − cos 1.9°) = 4 µm inside the ball.
pub(super) fn fingertip() -> TriMesh {
    sphere(8e-3, 48, 96)
}
