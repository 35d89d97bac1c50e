//! Triangulates a region with points inside.

use crate::mesh::polygon::Point;
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation as _};

/// Points of loops, followed by points inside them, and the edges between points.
#[derive(Debug, Clone, Default)]
pub(super) struct Plane {
    pub(super) points: Vec<Point>,
    /// For every point of a loop, the next one; the inside is on the left.
    pub(super) next: Vec<usize>,
    /// Edges between inner points that the triangulation should have unless they cross others.
    pub(super) creases: Vec<[usize; 2]>,
}

/// Largest shift of a point while the triangles are sought, as a share of the extent.
const SHAKE: f64 = 1e-9;

impl Plane {
    /// The points of `loops`, and nothing inside yet.
    pub(super) fn of(loops: &[Vec<Point>]) -> Self {
        let mut plane = Self::default();
        for outline in loops {
            let (base, n) = (plane.points.len(), outline.len());
            plane.points.extend_from_slice(outline);
            plane.next.extend((0..n).map(|i| base + (i + 1) % n));
        }
        plane
    }

    /// The points, each shifted a little: regular figures have many points on one circle or line, for which the
    /// predicates of the triangulation would need exact arithmetic, at three times the cost of all else.
    fn shaken(&self) -> Vec<Point2<f64>> {
        let reach_m = self.points.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        // multiples of an irrational number, here in steps of 2⁻⁶⁴, are spread evenly over [−½, ½)
        let shift = |i: usize, step: u64| {
            let spread = (i as u64).wrapping_mul(step).cast_signed();
            SHAKE * reach_m * (spread as f64) * 0.5_f64.powi(64)
        };
        let shaken = self.points.iter().enumerate().map(|(i, p)| {
            let x = p[0] + shift(i, 0xc13f_a9a9_02a6_328f);
            Point2::new(x, p[1] + shift(i, 0x91e1_0da5_c79e_7b1d))
        });
        shaken.collect()
    }

    /// Counter-clockwise triangles over the inside, by a constrained Delaunay triangulation. `None` when loops touch or
    /// cross, or when two points coincide.
    pub(super) fn triangles(&self) -> Option<Vec<[usize; 3]>> {
        let points = self.shaken();
        let sides: Vec<[usize; 2]> = self.next.iter().enumerate().map(|(i, &j)| [i, j]).collect();
        let mut crossed = false;
        let mut net = ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(points, sides, |_| {
            crossed = true;
        })
        .ok()?;
        if crossed || net.num_vertices() != self.points.len() {
            return None;
        }
        let vertex = FixedVertexHandle::from_index;
        for &[a, b] in &self.creases {
            net.try_add_constraint(vertex(a), vertex(b));
        }
        let is_side = |a: usize, b: usize| self.next.get(a) == Some(&b) || self.next.get(b) == Some(&a);
        let mut inside = vec![false; net.num_all_faces()];
        let (mut open, mut outside) = (Vec::new(), Vec::new());
        for (i, &j) in self.next.iter().enumerate() {
            let edge = net.get_edge_from_neighbors(vertex(i), vertex(j))?;
            open.push(edge.face().as_inner()?);
            outside.push(edge.rev().face().fix().index());
        }
        let mut triangles = Vec::with_capacity(2 * self.points.len());
        while let Some(face) = open.pop() {
            if std::mem::replace(&mut inside[face.fix().index()], true) {
                continue;
            }
            triangles.push(face.vertices().map(|v| v.fix().index()));
            for edge in face.adjacent_edges() {
                let [from, to] = edge.vertices().map(|v| v.fix().index());
                if !is_side(from, to) {
                    // the outer face lies beyond sides alone
                    open.push(edge.rev().face().as_inner()?);
                }
            }
        }
        let apart = outside.iter().all(|&face| !inside[face]);
        apart.then_some(triangles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::polygon::{circle, rectangle};

    /// n points on h + 1 loops and m inside give n + 2 m + 2 h − 2 triangles.
    #[test]
    fn tiles_a_ring_and_refuses_loops_that_cross() {
        let mut hole = circle(1.0, 12);
        hole.reverse();
        let mut plane = Plane::of(&[rectangle(6.0, 4.0), hole]);
        plane.points.extend([[2.0, 0.5], [2.0, -0.5]]);
        plane.creases.push([16, 17]);
        assert_eq!(plane.triangles().unwrap().len(), 16 + 4 + 2 - 2);
        let crossed = Plane::of(&[vec![[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]]);
        assert!(crossed.triangles().is_none());
    }
}
