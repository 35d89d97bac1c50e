//! Bounds, area, volume and closedness of a mesh.

use super::sides::{Sides, Unions, balance};
use super::tri_mesh::TriMesh;

pub(super) fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl TriMesh {
    /// Corners of triangle `t`, m.
    ///
    /// # Panics
    /// If `t` or one of its indices is out of range, which cannot happen for a mesh that passed [`super::checked`].
    #[must_use]
    pub fn corners(&self, t: usize) -> [[f64; 3]; 3] {
        self.triangles[t].map(|i| self.vertices[i as usize])
    }

    /// Smallest box around the vertices, m: `(low, high)`. `None` for a mesh without vertices.
    #[must_use]
    pub fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        let first = *self.vertices.first()?;
        Some(self.vertices.iter().fold((first, first), |(mut low, mut high), v| {
            for k in 0..3 {
                low[k] = low[k].min(v[k]);
                high[k] = high[k].max(v[k]);
            }
            (low, high)
        }))
    }

    /// Longest side of the box around the vertices, m; 0 for a mesh without vertices.
    #[must_use]
    pub fn extent_m(&self) -> f64 {
        self.bounds().map_or(0.0, |(low, high)| {
            (0..3).fold(0.0, |most: f64, k| most.max(high[k] - low[k]))
        })
    }

    /// Normal of triangle `t` times twice its area, m².
    ///
    /// # Panics
    /// As [`TriMesh::corners`].
    #[must_use]
    pub fn area_vector_m2(&self, t: usize) -> [f64; 3] {
        let [a, b, c] = self.corners(t);
        cross(sub(b, a), sub(c, a))
    }

    /// Surface area, m².
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        (0..self.triangles.len())
            .map(|t| {
                let n = self.area_vector_m2(t);
                0.5 * dot(n, n).sqrt()
            })
            .sum()
    }

    /// Enclosed volume, m³: positive when the triangles face outwards, negative when the mesh is inside out.
    ///
    /// The divergence theorem on tetrahedra from the first vertex; exact for a closed mesh.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        let Some(&o) = self.vertices.first() else { return 0.0 };
        (0..self.triangles.len())
            .map(|t| {
                let [a, b, c] = self.corners(t).map(|v| sub(v, o));
                dot(a, cross(b, c)) / 6.0
            })
            .sum()
    }

    /// Whether the surface is closed and every connected part of it faces outward: whatever is seen of it from below
    /// faces down. A part that is the wall of a cavity faces inward.
    pub(crate) fn is_solid(&self) -> bool {
        let sides = Sides::of(self);
        let mut parts = Unions::new(self.triangles.len());
        for edge in sides.edges() {
            if balance(edge) != 0 {
                return false;
            }
            for pair in edge.windows(2) {
                // which way a triangle runs does not matter here
                parts.join(pair[0].triangle, pair[1].triangle, false);
            }
        }
        let mut volumes_m3 = vec![0.0; self.triangles.len()];
        for (t, corners) in (0..).zip(&self.triangles) {
            let [a, b, c] = corners.map(|i| self.vertices[i as usize]);
            let (first, _) = parts.find(t);
            volumes_m3[first as usize] += dot(a, cross(b, c)) / 6.0;
        }
        let mut firsts = (0..).zip(&volumes_m3).filter(|(t, _)| parts.find(*t).0 == *t);
        firsts.all(|(_, volume_m3)| *volume_m3 > 0.0)
    }

    /// Number of edges without a partner in the opposite direction: 0 for a closed, consistently oriented surface.
    /// Bodies that touch along an edge count as closed.
    #[must_use]
    pub fn open_edges(&self) -> usize {
        Sides::of(self).edges().filter(|edge| balance(edge) != 0).count()
    }
}
