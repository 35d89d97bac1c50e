//! Distance from a point to the surface of a mesh, by a tree of boxes.

use super::measure::{dot, sub};
use super::tri_mesh::{TriMesh, index};

/// Triangles in a leaf.
const LEAF: usize = 4;

/// A box around triangles `first..last` of the order, split in two at `middle` unless it is a leaf.
struct Node {
    low: [f64; 3],
    high: [f64; 3],
    first: u32,
    last: u32,
    /// The second child; the first follows its parent. 0 for a leaf.
    second: u32,
}

/// The triangles of a mesh, ready to be asked for the nearest.
pub(super) struct Nearest<'m> {
    mesh: &'m TriMesh,
    order: Vec<u32>,
    nodes: Vec<Node>,
}

/// A triangle while the tree is built: three times its centre, and its number.
type Item = ([f32; 3], u32);

impl<'m> Nearest<'m> {
    pub(super) fn new(mesh: &'m TriMesh) -> Self {
        let n = mesh.triangles.len();
        #[expect(clippy::cast_possible_truncation, reason = "only steers where the tree is split")]
        let mut items: Vec<Item> = (0..n)
            .map(|t| {
                let [a, b, c] = mesh.corners(t);
                ([0, 1, 2].map(|k| (a[k] + b[k] + c[k]) as f32), index(t))
            })
            .collect();
        let mut tree = Self {
            mesh,
            order: Vec::with_capacity(n),
            nodes: Vec::with_capacity(n),
        };
        tree.build(&mut items);
        tree
    }

    /// Node over `items` and everything below it.
    fn build(&mut self, items: &mut [Item]) {
        let at = self.nodes.len();
        let first = index(self.order.len());
        self.nodes.push(Node {
            low: [f64::INFINITY; 3],
            high: [f64::NEG_INFINITY; 3],
            first,
            last: first,
            second: 0,
        });
        if items.len() <= LEAF {
            for &(_, t) in &*items {
                self.order.push(t);
                for v in self.mesh.corners(t as usize) {
                    self.nodes[at].grow(v, v);
                }
            }
        } else {
            let axis = longest_axis(items);
            // halves of equal size: the depth is the logarithm of the number of triangles, whatever their shape
            let middle = items.len() / 2;
            items.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
            let (one, two) = items.split_at_mut(middle);
            self.build(one);
            let second = self.nodes.len();
            self.build(two);
            self.nodes[at].second = index(second);
            for child in [at + 1, second] {
                let (low, high) = (self.nodes[child].low, self.nodes[child].high);
                self.nodes[at].grow(low, high);
            }
        }
        self.nodes[at].last = index(self.order.len());
    }

    /// Largest distance of any of `points` to the surface, m; 0 without points.
    pub(super) fn farthest_m(&self, points: impl IntoIterator<Item = [f64; 3]>) -> f64 {
        let (mut most, mut hint) = (0.0, 0);
        for p in points {
            let (square, near) = self.nearest(p, most, hint);
            hint = near;
            most = f64::max(most, square);
        }
        most.sqrt()
    }

    /// Square of the distance of `p`, m², and the triangle there. Stops at any triangle within `enough`; starts at
    /// `hint`, which should be near.
    fn nearest(&self, p: [f64; 3], enough: f64, hint: usize) -> (f64, usize) {
        let distance = |t: usize| square_distance(p, self.mesh.corners(t));
        let (mut best, mut near) = (distance(hint), hint);
        let mut stack = [0_u32; 64];
        let mut depth = 1;
        while depth > 0 && best > enough {
            depth -= 1;
            let at = stack[depth] as usize;
            let node = &self.nodes[at];
            if box_distance(p, node) >= best {
                continue;
            }
            if node.second == 0 {
                for &t in &self.order[node.first as usize..node.last as usize] {
                    let d = distance(t as usize);
                    if d < best {
                        (best, near) = (d, t as usize);
                    }
                }
                continue;
            }
            let (one, two) = (index(at + 1), node.second);
            let nearer_last = if box_distance(p, &self.nodes[one as usize]) < box_distance(p, &self.nodes[two as usize])
            {
                [two, one]
            } else {
                [one, two]
            };
            stack[depth..depth + 2].copy_from_slice(&nearer_last);
            depth += 2;
        }
        (best, near)
    }
}

impl Node {
    fn grow(&mut self, low: [f64; 3], high: [f64; 3]) {
        self.low = [0, 1, 2].map(|k| self.low[k].min(low[k]));
        self.high = [0, 1, 2].map(|k| self.high[k].max(high[k]));
    }
}

fn longest_axis(items: &[Item]) -> usize {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for (centre, _) in items {
        low = [0, 1, 2].map(|k| low[k].min(centre[k]));
        high = [0, 1, 2].map(|k| high[k].max(centre[k]));
    }
    let side = |k: usize| high[k] - low[k];
    (0..3).fold(0, |best, k| if side(k) > side(best) { k } else { best })
}

fn box_distance(p: [f64; 3], node: &Node) -> f64 {
    (0..3)
        .map(|k| (node.low[k] - p[k]).max(p[k] - node.high[k]).max(0.0).powi(2))
        .sum()
}

/// Square of the distance from `p` to the triangle, m².
///
/// Source: C. Ericson, *Real-Time Collision Detection* (2005), §5.1.5: the region of the plane in which the projection
/// of `p` lies.
fn square_distance(p: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> f64 {
    let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(p, a));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    let (bp, cp) = (sub(p, b), sub(p, c));
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    let on = |from: [f64; 3], along: [f64; 3], share: f64| {
        let away = [0, 1, 2].map(|k| p[k] - from[k] - share * along[k]);
        dot(away, away)
    };
    if d1 <= 0.0 && d2 <= 0.0 {
        return dot(ap, ap);
    }
    if d3 >= 0.0 && d4 <= d3 {
        return dot(bp, bp);
    }
    if d6 >= 0.0 && d5 <= d6 {
        return dot(cp, cp);
    }
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return on(a, ab, d1 / (d1 - d3));
    }
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return on(a, ac, d2 / (d2 - d6));
    }
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return on(b, sub(c, b), (d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    let (v, w) = (vb / sum, vc / sum);
    let away = [0, 1, 2].map(|k| ap[k] - v * ab[k] - w * ac[k]);
    dot(away, away)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{cuboid, sphere};
    use approx::assert_relative_eq;

    /// Outside a block the distance is that to a box: through face, edge and corner regions, on a refined surface.
    #[test]
    fn distance_to_a_block() {
        let block = cuboid([2.0, 2.0, 2.0]).refined(0.3, |_, _| true);
        let tree = Nearest::new(&block);
        for (point, expected) in [
            ([0.1, 0.2, 5.0], 3.0),
            ([4.0, 0.3, 1.1], 3.0),
            ([4.0, 5.0, 1.3], 5.0),
            ([2.0, 3.0, 4.0], 3.0),
            ([0.2, 0.1, 1.0], 0.8),
            ([1.0, 0.3, 0.4], 0.0),
        ] {
            // exact geometry; rounding of a few ulp of the coordinates
            assert!((tree.farthest_m([point]) - expected).abs() < 1e-12, "{point:?}");
        }
    }

    /// Centre and shells of a sphere: between the facets' inner radius and the outer one.
    #[test]
    fn distance_to_a_sphere() {
        let ball = sphere(1.0, 40, 80);
        let tree = Nearest::new(&ball);
        // facets lie within 1 − cos(π/40) of the sphere along meridians, the same along the equator's 80
        let sagitta = 2.0 * (1.0 - (std::f64::consts::PI / 80.0).cos());
        assert_relative_eq!(tree.farthest_m([[0.0, 0.0, 1.0]]), 1.0, epsilon = sagitta);
        assert_relative_eq!(
            tree.farthest_m([[3.0, 0.0, 1.0], [0.0, 0.0, 1.0]]),
            2.0,
            epsilon = sagitta
        );
    }
}
