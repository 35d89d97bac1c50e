//! The sides of the triangles, sorted by edge.

use super::tri_mesh::{TriMesh, index};

/// A side of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Side {
    /// Ends of the edge, the smaller index first.
    pub(super) edge: [u32; 2],
    /// The triangle.
    pub(super) triangle: u32,
    /// Whether the triangle runs along the edge from the smaller index to the larger.
    pub(super) rising: bool,
}

impl Side {
    /// Start and end, as the triangle runs.
    pub(super) fn directed(self) -> [u32; 2] {
        let [low, high] = self.edge;
        if self.rising { [low, high] } else { [high, low] }
    }
}

/// All sides, those on one edge next to each other, in the order of their triangles.
pub(super) struct Sides(Vec<Side>);

impl Sides {
    pub(super) fn of(mesh: &TriMesh) -> Self {
        let mut sides = Vec::with_capacity(3 * mesh.triangles.len());
        for (t, &[a, b, c]) in mesh.triangles.iter().enumerate() {
            sides.extend([[a, b], [b, c], [c, a]].map(|[p, q]| Side {
                edge: [p.min(q), p.max(q)],
                triangle: index(t),
                rising: p < q,
            }));
        }
        sides.sort_unstable();
        Self(sides)
    }

    /// Edge by edge, its sides.
    pub(super) fn edges(&self) -> impl Iterator<Item = &[Side]> {
        self.0.chunk_by(|a, b| a.edge == b.edge)
    }
}

/// Sides along an edge minus sides against it: 0 where a surface is closed and agrees about its outside.
pub(super) fn balance(edge: &[Side]) -> i64 {
    edge.iter().map(|side| if side.rising { 1 } else { -1 }).sum()
}

/// Sets that are joined pair by pair, each member knowing whether it is turned against its set's first.
pub(super) struct Unions {
    parent: Vec<u32>,
    /// Whether the triangle is turned against its parent.
    turned: Vec<bool>,
}

impl Unions {
    pub(super) fn new(n: usize) -> Self {
        Self {
            parent: (0..n).map(index).collect(),
            turned: vec![false; n],
        }
    }

    /// First member of the set of `i`, and whether `i` is turned against it.
    pub(super) fn find(&mut self, i: u32) -> (u32, bool) {
        let (mut root, mut turned) = (i, false);
        while self.parent[root as usize] != root {
            turned ^= self.turned[root as usize];
            root = self.parent[root as usize];
        }
        let (mut at, mut rest) = (i, turned);
        while self.parent[at as usize] != root && at != root {
            let (next, step) = (self.parent[at as usize], self.turned[at as usize]);
            self.parent[at as usize] = root;
            self.turned[at as usize] = rest;
            rest ^= step;
            at = next;
        }
        (root, turned)
    }

    /// Joins the sets of `a` and `b`, which are `turned` against each other. `false` if they are known to be otherwise.
    pub(super) fn join(&mut self, a: u32, b: u32, turned: bool) -> bool {
        let ((ra, ta), (rb, tb)) = (self.find(a), self.find(b));
        if ra == rb {
            return ta ^ tb == turned;
        }
        // the smaller index leads, so that the numbering follows the file
        let (lead, follow) = (ra.min(rb), ra.max(rb));
        self.parent[follow as usize] = lead;
        self.turned[follow as usize] = ta ^ tb ^ turned;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of turned pairs: member k is turned against member 0 if k is odd; a pair that says otherwise is found.
    #[test]
    fn unions_know_who_is_turned() {
        let mut unions = Unions::new(100);
        for k in (1..100).rev() {
            assert!(unions.join(k - 1, k, true));
        }
        for k in 0..100 {
            assert_eq!(unions.find(k), (0, k % 2 == 1));
        }
        assert!(unions.join(3, 10, true) && !unions.join(3, 10, false));
    }
}
