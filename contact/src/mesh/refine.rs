//! Splits long edges, so that a flat face can be bent.

use super::tri_mesh::{TriMesh, index};
use std::collections::HashMap;

impl TriMesh {
    /// Halves every edge that is longer than `longest_m` and for which `bends` (called with both ends, m) returns
    /// `true`, until none is left. Neighbours share the new vertices, so a closed mesh stays closed. There are at most
    /// 12 rounds: an edge ends at 1/4096 of its length or at `longest_m`, whichever is longer.
    ///
    /// # Panics
    /// If an index is out of range, which cannot happen for a mesh that passed [`super::checked`].
    #[must_use]
    pub fn refined(mut self, longest_m: f64, bends: impl Fn([f64; 3], [f64; 3]) -> bool) -> Self {
        for _ in 0..12 {
            let mut middle: HashMap<[u32; 2], u32> = HashMap::new();
            let mut triangles = Vec::with_capacity(self.triangles.len());
            for t in std::mem::take(&mut self.triangles) {
                let mids = [0, 1, 2].map(|k| self.middle_of(t[k], t[(k + 1) % 3], longest_m, &bends, &mut middle));
                self.split(t, mids, &mut triangles);
            }
            self.triangles = triangles;
            if middle.is_empty() {
                break;
            }
        }
        self
    }

    fn middle_of(
        &mut self,
        a: u32,
        b: u32,
        longest_m: f64,
        bends: &impl Fn([f64; 3], [f64; 3]) -> bool,
        middle: &mut HashMap<[u32; 2], u32>,
    ) -> Option<u32> {
        let key = [a.min(b), a.max(b)];
        if let Some(&m) = middle.get(&key) {
            return Some(m);
        }
        let (p, q) = (self.vertices[key[0] as usize], self.vertices[key[1] as usize]);
        if !bends(p, q) || square_distance(p, q) <= longest_m * longest_m {
            return None;
        }
        let m = index(self.vertices.len());
        self.vertices.push([0, 1, 2].map(|k| 0.5 * (p[k] + q[k])));
        middle.insert(key, m);
        Some(m)
    }

    /// Pieces of triangle `t` whose edges `k → k+1` have the middles `mids[k]`, where split.
    fn split(&self, t: [u32; 3], mids: [Option<u32>; 3], out: &mut Vec<[u32; 3]>) {
        // turned so that the split edges come first
        let first = (0..3)
            .find(|&k| mids[k].is_some() && mids[(k + 2) % 3].is_none())
            .unwrap_or(0);
        let [a, b, c] = [0, 1, 2].map(|k| t[(first + k) % 3]);
        match [0, 1, 2].map(|k| mids[(first + k) % 3]) {
            [Some(ab), Some(bc), Some(ca)] => out.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]),
            [Some(ab), Some(bc), None] => {
                out.push([ab, b, bc]);
                let at = |i: u32| self.vertices[i as usize];
                // the quadrangle a, ab, bc, c is cut along its shorter diagonal
                if square_distance(at(a), at(bc)) < square_distance(at(ab), at(c)) {
                    out.extend([[a, ab, bc], [a, bc, c]]);
                } else {
                    out.extend([[a, ab, c], [ab, bc, c]]);
                }
            }
            [Some(ab), ..] => out.extend([[a, ab, c], [ab, b, c]]),
            _ => out.push(t),
        }
    }
}

fn square_distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    (0..3).map(|k| (p[k] - q[k]).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use crate::mesh::cuboid;
    use approx::assert_relative_eq;

    #[test]
    fn refining_keeps_the_solid() {
        let block = cuboid([0.1, 0.05, 0.02]);
        let fine = block.clone().refined(4e-3, |p, q| p[2].max(q[2]) <= 0.0);
        assert_eq!(fine.open_edges(), 0);
        assert!(fine.triangles.len() > 300, "{}", fine.triangles.len());
        assert_relative_eq!(fine.volume_m3(), block.volume_m3(), max_relative = 1e-12);
        assert_relative_eq!(fine.area_m2(), block.area_m2(), max_relative = 1e-12);
    }
}
