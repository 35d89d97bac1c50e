//! Joining vertices that coincide and dropping triangles that collapse.

use super::{TriMesh, index};
use std::collections::HashMap;

/// Cell of the search grid that holds `v`. Saturation far outside the grid only makes the search slower.
#[expect(clippy::cast_possible_truncation, reason = "float-to-int casts saturate")]
fn cell(v: [f64; 3], side_m: f64) -> [i64; 3] {
    v.map(|x| (x / side_m).floor() as i64)
}

impl TriMesh {
    /// Vertices closer than `tolerance_m` joined to the first of them, triangles that lose a corner dropped, unused
    /// vertices removed. Also returns `(vertices joined, triangles dropped)`.
    ///
    /// A thin triangle that keeps three distinct corners stays, even with no area: taking it out would open the
    /// surface.
    ///
    /// # Panics
    /// When an index is out of range; [`super::checked`] looks before it welds.
    #[must_use]
    pub fn welded(&self, tolerance_m: f64) -> (Self, usize, usize) {
        let side_m = tolerance_m.max(f64::MIN_POSITIVE.sqrt());
        let mut grid: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
        let mut kept: Vec<[f64; 3]> = Vec::new();
        let mut target = Vec::with_capacity(self.vertices.len());
        for &v in &self.vertices {
            let home = cell(v, side_m);
            let mut found: Option<usize> = None;
            for d in 0..27_i64 {
                let near = [
                    home[0].saturating_add(d % 3 - 1),
                    home[1].saturating_add(d / 3 % 3 - 1),
                    home[2].saturating_add(d / 9 - 1),
                ];
                for &k in grid.get(&near).into_iter().flatten() {
                    let close = (0..3).map(|a| (kept[k][a] - v[a]).powi(2)).sum::<f64>() <= tolerance_m.powi(2);
                    if close && found.is_none_or(|best| k < best) {
                        found = Some(k);
                    }
                }
            }
            target.push(found.unwrap_or_else(|| {
                grid.entry(home).or_default().push(kept.len());
                kept.push(v);
                kept.len() - 1
            }));
        }
        let joined = self.vertices.len() - kept.len();
        let mut out = Self::default();
        let mut renumbered: Vec<Option<u32>> = vec![None; kept.len()];
        for t in &self.triangles {
            let [a, b, c] = t.map(|i| target[i as usize]);
            if a == b || b == c || c == a {
                continue;
            }
            out.triangles.push([a, b, c].map(|k| {
                *renumbered[k].get_or_insert_with(|| {
                    out.vertices.push(kept[k]);
                    index(out.vertices.len() - 1)
                })
            }));
        }
        let dropped = self.triangles.len() - out.triangles.len();
        (out, joined, dropped)
    }
}
