//! Drops duplicate triangles.

use super::sides::{Sides, Unions};
use super::tri_mesh::{TriMesh, index};
use std::collections::BTreeMap;

impl TriMesh {
    /// Of triangles with the same three corners only the first is kept. Sheets of triangles that are there in both
    /// directions enclose nothing: they go altogether where that leaves every edge at their border with partners (a
    /// fin on a surface, the wall between two boxes), and are kept once where it would tear the surface. Also returns
    /// the number of triangles dropped.
    pub(super) fn without_duplicates(&self) -> (Self, usize) {
        let mut keyed: Vec<([u32; 3], u32)> = Vec::with_capacity(self.triangles.len());
        for (t, corners) in self.triangles.iter().enumerate() {
            let mut key = *corners;
            key.sort_unstable();
            keyed.push((key, index(t)));
        }
        keyed.sort_unstable();
        let mut keep = vec![true; self.triangles.len()];
        let mut two_sided = vec![false; self.triangles.len()];
        let mut any = false;
        for group in keyed.chunk_by(|a, b| a.0 == b.0).filter(|g| g.len() > 1) {
            let rising = |t: u32| is_rising(self.triangles[t as usize]);
            let first = group[0].1;
            two_sided[first as usize] = group.iter().any(|&(_, t)| rising(t) != rising(first));
            any |= two_sided[first as usize];
            group[1..].iter().for_each(|&(_, t)| keep[t as usize] = false);
        }
        if keep.iter().all(|&k| k) {
            return (self.clone(), 0);
        }
        let mut out = self.only(&keep);
        if any {
            let kept = keep.iter().zip(&two_sided).filter(|(k, _)| **k);
            let sheets: Vec<bool> = kept.map(|(_, &sheet)| sheet).collect();
            out = out.without_idle_sheets(&sheets);
        }
        let dropped = self.triangles.len() - out.triangles.len();
        (out, dropped)
    }

    /// Without the connected regions of `sheets` whose removal leaves more of their border edges paired than keeping
    /// them does.
    fn without_idle_sheets(&self, sheets: &[bool]) -> Self {
        let sides = Sides::of(self);
        let mut regions = Unions::new(self.triangles.len());
        for edge in sides.edges() {
            if let [a, b] = edge
                && sheets[a.triangle as usize]
                && sheets[b.triangle as usize]
            {
                regions.join(a.triangle, b.triangle, a.rising == b.rising);
            }
        }
        let mut votes: BTreeMap<u32, i64> = BTreeMap::new();
        for edge in sides.edges() {
            let of_sheets: Vec<u32> = edge
                .iter()
                .map(|s| s.triangle)
                .filter(|&t| sheets[t as usize])
                .collect();
            if let [t] = of_sheets[..] {
                let others = edge.len() - 1;
                *votes.entry(regions.find(t).0).or_insert(0) += if others % 2 == 0 { 1 } else { -1 };
            }
        }
        let keep: Vec<bool> = (0..self.triangles.len())
            .map(|t| !sheets[t] || votes.get(&regions.find(index(t)).0).is_none_or(|&v| v <= 0))
            .collect();
        self.only(&keep)
    }

    /// Only the triangles that `keep` marks, and the vertices they use.
    pub(super) fn only(&self, keep: &[bool]) -> Self {
        let marked = self.triangles.iter().zip(keep).filter(|(_, k)| **k);
        let triangles: Vec<[u32; 3]> = marked.map(|(&t, _)| t).collect();
        self.with_triangles(&triangles)
    }

    /// `triangles` on the vertices of this mesh, without those that nothing uses.
    pub(super) fn with_triangles(&self, triangles: &[[u32; 3]]) -> Self {
        let mut out = Self {
            vertices: Vec::new(),
            triangles: Vec::with_capacity(triangles.len()),
        };
        let mut renumbered: Vec<Option<u32>> = vec![None; self.vertices.len()];
        for t in triangles {
            out.triangles.push(t.map(|i| {
                *renumbered[i as usize].get_or_insert_with(|| {
                    out.vertices.push(self.vertices[i as usize]);
                    index(out.vertices.len() - 1)
                })
            }));
        }
        out
    }
}

/// Whether the corners, from the smallest on, go up: the two directions around the same three corners differ in it.
fn is_rising([a, b, c]: [u32; 3]) -> bool {
    let smallest = a.min(b).min(c);
    let [_, second, third] = if a == smallest {
        [a, b, c]
    } else if b == smallest {
        [b, c, a]
    } else {
        [c, a, b]
    };
    second < third
}
