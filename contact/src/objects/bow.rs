//! Faces with a slight bow.

use crate::mesh::TriMesh;

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
