//! A mesh prepared for contact fields.

use crate::mesh::{Rim, TriMesh, span};
use std::ops::{Deref, Range};
use std::sync::Arc;

/// Most triangles of a block.
pub(crate) const BLOCK: usize = 16;

/// A mesh whose triangles are sorted into blocks of neighbours, as contact fields need. It is immutable. A clone shares
/// the data, so any number of contact fields, scenes and threads can use one mesh. It dereferences to
/// [`TriMesh`](crate::mesh::TriMesh).
///
/// ```
/// use spts_contact::{ContactField, PosedMesh, PreparedMesh, Foam, WinklerLayer, mesh::sphere};
/// use spts_models::SkinLayout;
///
/// let ball = PreparedMesh::from(sphere(33.4e-3, 24, 48));
/// let mut field = WinklerLayer::new(Foam::default(), &SkinLayout::default())?;
/// field.expect(&ball);
/// let answer = field.respond(&PosedMesh::at_rest(&ball, [0.0, 0.0, -2e-3]));
/// assert!(answer.wrench.force_n[2] > 1.0);
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct PreparedMesh(Arc<Sorted>);

/// A mesh and a copy of it in blocks.
#[derive(Debug, Default)]
pub(crate) struct Sorted {
    source: TriMesh,
    pub(crate) blocks: Vec<Block>,
    /// Corners of the triangles in body axes, m. Each block has its own.
    pub(crate) points_m: Vec<[f64; 3]>,
    /// Triangles, as indices into the corners of their block.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Edges at which the surface turns or ends, the sharpest first.
    pub(crate) rims: Vec<Rim>,
    /// Whether the mesh is closed and its triangles face outwards. Triangles that face up are then never the lowest.
    pub(crate) solid: bool,
}

/// Triangles that lie together, and the box around them.
#[derive(Debug)]
pub(crate) struct Block {
    pub(crate) centre_m: [f64; 3],
    pub(crate) half_m: [f64; 3],
    pub(crate) points: Range<usize>,
    pub(crate) triangles: Range<usize>,
}

impl From<TriMesh> for PreparedMesh {
    fn from(mesh: TriMesh) -> Self {
        let centre = |t: &[u32; 3]| [0, 1, 2].map(|k| t.iter().map(|i| mesh.vertices[*i as usize][k]).sum::<f64>());
        let mut order: Vec<_> = (0..).zip(&mesh.triangles).map(|(i, t)| (centre(t), i)).collect();
        let mut sorted = Sorted { solid: mesh.is_solid(), rims: mesh.rims(), source: mesh, ..Sorted::default() };
        sorted.split(&mut order);
        Self(Arc::new(sorted))
    }
}

impl Deref for PreparedMesh {
    type Target = TriMesh;

    fn deref(&self) -> &TriMesh {
        &self.0.source
    }
}

impl PartialEq for PreparedMesh {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl PreparedMesh {
    /// Whether both share their data, which cannot change.
    pub(crate) fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    pub(crate) fn sorted(&self) -> &Sorted {
        &self.0
    }
}

impl Sorted {
    /// Halves the triangles, each with three times its centre, along the longest side of the box around their centres
    /// until they make a block.
    fn split(&mut self, triangles: &mut [([f64; 3], u32)]) {
        if triangles.len() <= BLOCK {
            self.push(triangles);
            return;
        }
        let [low, high] = span(triangles.iter().map(|(centre, _)| *centre));
        let sides = [0, 1, 2].map(|k| high[k] - low[k]);
        let longest = (0..3).max_by(|&i, &j| sides[i].total_cmp(&sides[j])).unwrap_or(0);
        let middle = triangles.len() / 2;
        triangles.select_nth_unstable_by(middle, |(s, _), (t, _)| s[longest].total_cmp(&t[longest]));
        let (below, above) = triangles.split_at_mut(middle);
        self.split(below);
        self.split(above);
    }

    fn push(&mut self, triangles: &[([f64; 3], u32)]) {
        let (first_point, first_triangle) = (self.points_m.len(), self.triangles.len());
        let mut known: Vec<u32> = Vec::with_capacity(3 * BLOCK);
        for (_, t) in triangles {
            let local = self.source.triangles[*t as usize].map(|i| {
                let at = known.iter().position(|&k| k == i).unwrap_or_else(|| {
                    known.push(i);
                    self.points_m.push(self.source.vertices[i as usize]);
                    known.len() - 1
                });
                u32::try_from(at).unwrap_or(u32::MAX)
            });
            self.triangles.push(local);
        }
        let [low, high] = span(self.points_m[first_point..].iter().copied());
        self.blocks.push(Block {
            centre_m: [0, 1, 2].map(|k| 0.5 * (low[k] + high[k])),
            half_m: [0, 1, 2].map(|k| 0.5 * (high[k] - low[k])),
            points: first_point..self.points_m.len(),
            triangles: first_triangle..self.triangles.len(),
        });
    }
}
