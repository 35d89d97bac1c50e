//! Moving, turning, scaling, warping and joining meshes.

use super::tri_mesh::{TriMesh, index};

impl TriMesh {
    /// The same mesh with `f` applied to every vertex. `f` must keep handedness (see [`TriMesh::flipped`]).
    #[must_use]
    pub fn mapped(mut self, f: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        for v in &mut self.vertices {
            *v = f(*v);
        }
        self
    }

    /// Moved by `offset_m`.
    #[must_use]
    pub fn translated(self, offset_m: [f64; 3]) -> Self {
        self.mapped(|v| [v[0] + offset_m[0], v[1] + offset_m[1], v[2] + offset_m[2]])
    }

    /// Scaled along each axis about the origin; an odd number of negative factors mirrors, and the triangles are
    /// turned to stay outward.
    #[must_use]
    pub fn scaled(self, factor: [f64; 3]) -> Self {
        let scaled = self.mapped(|v| [v[0] * factor[0], v[1] * factor[1], v[2] * factor[2]]);
        if factor.iter().product::<f64>() < 0.0 {
            scaled.flipped()
        } else {
            scaled
        }
    }

    /// Multiplied by a row-major rotation matrix.
    #[must_use]
    pub fn rotated(self, matrix: [[f64; 3]; 3]) -> Self {
        self.mapped(|v| matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2]))
    }

    /// Turned by `angle_rad` about the body axis x.
    #[must_use]
    pub fn rotated_x(self, angle_rad: f64) -> Self {
        let (s, c) = angle_rad.sin_cos();
        self.rotated([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    }

    /// Shifted along z so that the lowest vertex lies at z = 0, m.
    #[must_use]
    pub fn grounded(self) -> Self {
        let low = self.bounds().map_or(0.0, |(low, _)| low[2]);
        self.translated([0.0, 0.0, -low])
    }

    /// Every triangle turned over: inside becomes outside.
    #[must_use]
    pub fn flipped(mut self) -> Self {
        for t in &mut self.triangles {
            t.swap(1, 2);
        }
        self
    }

    /// Both meshes in one; vertices are not shared (see [`TriMesh::welded`]).
    #[must_use]
    pub fn merged(mut self, other: &TriMesh) -> Self {
        let base = index(self.vertices.len());
        self.vertices.extend_from_slice(&other.vertices);
        self.triangles
            .extend(other.triangles.iter().map(|t| t.map(|i| i.saturating_add(base))));
        self
    }
}
