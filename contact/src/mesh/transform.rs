//! Moves, rotates, scales, warps and joins meshes.

use super::tri_mesh::{TriMesh, index};

impl TriMesh {
    /// Applies `f` to every vertex. `f` must keep handedness (see [`TriMesh::flipped`]).
    #[must_use]
    pub fn mapped(mut self, f: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        for v in &mut self.vertices {
            *v = f(*v);
        }
        self
    }

    /// Moves the mesh by `offset_m`.
    #[must_use]
    pub fn translated(self, offset_m: [f64; 3]) -> Self {
        self.mapped(|v| [v[0] + offset_m[0], v[1] + offset_m[1], v[2] + offset_m[2]])
    }

    /// Scales along each axis about the origin. An odd number of negative factors mirrors the mesh; its triangles are
    /// then turned to face outwards again.
    #[must_use]
    pub fn scaled(self, factor: [f64; 3]) -> Self {
        let scaled = self.mapped(|v| [v[0] * factor[0], v[1] * factor[1], v[2] * factor[2]]);
        if factor.iter().product::<f64>() < 0.0 {
            scaled.flipped()
        } else {
            scaled
        }
    }

    /// Multiplies every vertex by a row-major rotation matrix.
    #[must_use]
    pub fn rotated(self, matrix: [[f64; 3]; 3]) -> Self {
        self.mapped(|v| matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2]))
    }

    /// Rotates by `angle_rad` about the body axis x.
    #[must_use]
    pub fn rotated_x(self, angle_rad: f64) -> Self {
        let (s, c) = angle_rad.sin_cos();
        self.rotated([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    }

    /// Moves the mesh along z so that its lowest vertex is at z = 0.
    #[must_use]
    pub fn grounded(self) -> Self {
        let low = self.bounds().map_or(0.0, |(low, _)| low[2]);
        self.translated([0.0, 0.0, -low])
    }

    /// Turns every triangle over: inside becomes outside.
    #[must_use]
    pub fn flipped(mut self) -> Self {
        for t in &mut self.triangles {
            t.swap(1, 2);
        }
        self
    }

    /// Joins both meshes into one. They share no vertices (see [`TriMesh::welded`]).
    #[must_use]
    pub fn merged(mut self, other: &TriMesh) -> Self {
        let base = index(self.vertices.len());
        self.vertices.extend_from_slice(&other.vertices);
        self.triangles
            .extend(other.triangles.iter().map(|t| t.map(|i| i.saturating_add(base))));
        self
    }
}
