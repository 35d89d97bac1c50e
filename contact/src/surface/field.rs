//! Foam on a surface of any shape.

use super::points::SurfacePoints;
use super::solid::{Beams, Group, LANES, Solid, Standing, into};
use crate::balance::Column;
use crate::field::{PosedMesh, Wrench};
use crate::foam::{Foam, FoamLaw};
use crate::mesh::span;
use crate::traction::velocity_at;
use parry3d_f64::math::Vector;
use spts_input::Refusal;
use std::ops::Range;

/// Independent columns of foam along the normals of a surface, under any number of bodies.
///
/// A column goes from its base on the link, one thickness below a sample point, outwards along the normal n to that
/// point on the free surface. A body touches it with what is inside it; what comes from behind the base, or lies
/// there, touches nothing. At depth δ, where the body's surface moves
/// with velocity v, its pressure is p = f(max(0, δ − τ v·n)), as in [`WinklerLayer`](crate::WinklerLayer), and friction
/// along the surface is t = −μ p v_t/√(|v_t|² + v_reg²). The force p·A·n + t·A acts at the end of the column, δ below
/// the point. A is the point's area on the free surface (valid to first order in δ over the radius of curvature).
/// Pressures of several bodies at one point add up.
///
/// The depth of a body that has gone through the foam grows on behind the base, up to two thicknesses.
///
/// ```
/// use spts_contact::{PosedMesh, Solid, Foam, SurfaceField, SurfacePoints, Winding, mesh::sphere};
///
/// // half a cylinder of 50 mm radius along z
/// let pi = std::f64::consts::PI;
/// let (arc_rad, span_m) = ([0.0, pi], [0.0, 0.09]);
/// let winding = Winding { shape: [6, 10], points_per_side: 4, axis: 2, centre_m: [0.0; 3], arc_rad, span_m };
/// let mut skin = SurfaceField::new(Foam::default(), SurfacePoints::on_cylinder(&winding, 0.05)?)?;
/// let ball = sphere(20e-3, 16, 32); // its centre is 20 mm above its origin
/// let wrench = skin.press(&Solid::new(&ball), &PosedMesh::at_rest(&ball, [0.0, 0.069, 0.025]));
/// assert!(wrench.force_n[1] > 0.1 && wrench.force_n[0].abs() < 1e-3, "pushed away from the cylinder");
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone)]
pub struct SurfaceField {
    config: Foam,
    points: SurfacePoints,
    /// Pressure at every point, Pa, and the points that have one.
    pressure_pa: Vec<f64>,
    touched: Vec<usize>,
    bottomed: bool,
    /// Lowest and highest corner of the foam, m.
    bounds_m: [[f64; 3]; 2],
    tree: Tree,
    nearby: Vec<Near>,
}

/// The columns that were near a body where it stood once, with those a little farther away: they hold as long as it has
/// hardly moved (L. Verlet, Physical Review 159 (1967) 98).
#[derive(Debug, Clone)]
struct Near {
    solid: Solid,
    /// How the body was turned, and where the middle of the skin was in its axes, m.
    rotation: [Vector; 3],
    middle_m: Vector,
    /// Distance up to which it was looked for points, m.
    reach_m: f64,
    /// Numbers of the columns' points, and the columns themselves.
    columns: Vec<u32>,
    beams: Beams,
    /// What they may meet of a mesh.
    groups: Vec<Group>,
    /// How deep the body reaches into them, m.
    depths_m: Vec<f64>,
}

/// Most bodies of which it is known what is near; with more, the oldest is looked for again. They are found one by one.
const KNOWN: usize = 32;

/// How far a body may move before it is looked for again, in thicknesses. From .1 to 1, a step of a humanoid that lies
/// still costs the same within the noise; what moves is looked for less often with a larger one.
const MARGIN: f64 = 0.3;

/// The points of a skin, neighbours together, in a tree of balls around them.
#[derive(Debug, Clone)]
struct Tree {
    /// Their numbers.
    order: Vec<u32>,
    /// Each before those below it.
    nodes: Vec<Node>,
}

/// Neighbouring points, and a ball and a box around them.
#[derive(Debug, Clone)]
struct Node {
    /// Its points, in the tree's order.
    points: Range<u32>,
    /// Number of the next node that is not below this one.
    after: u32,
    centre_m: Vector,
    radius_m: f64,
    /// Half sides of the box, m.
    half_m: Vector,
    /// Side of a square of the largest area of a point, m.
    side_m: f64,
}

/// Most points of a node without others below it.
const LEAF: usize = LANES;

impl Tree {
    fn of(points: &SurfacePoints) -> Self {
        let mut tree = Self { order: (0..).take(points.len()).collect(), nodes: Vec::new() };
        tree.divide(points, 0..points.len());
        tree.nodes.shrink_to_fit();
        tree
    }

    /// Adds a node with these points and, if they are many, one for either half along the longest side of the box
    /// around them.
    #[expect(clippy::cast_possible_truncation, reason = "a skin has at most 2^24 points")]
    fn divide(&mut self, points: &SurfacePoints, range: Range<usize>) {
        let order = &mut self.order[range.clone()];
        let at = |k: u32| points.positions_m[k as usize];
        let [low, high] = span(order.iter().map(|k| at(*k))).map(Vector::from);
        let (centre_m, half_m) = (0.5 * (low + high), 0.5 * (high - low));
        let radius_m = order.iter().map(|k| (Vector::from(at(*k)) - centre_m).length()).fold(0.0, f64::max);
        let side_m = order.iter().map(|k| points.areas_m2[*k as usize]).fold(0.0, f64::max).sqrt();
        let number = self.nodes.len();
        let (own, after) = (range.start as u32..range.end as u32, number as u32 + 1);
        self.nodes.push(Node { points: own, after, centre_m, radius_m, half_m, side_m });
        if order.len() <= LEAF {
            order.sort_unstable();
            return;
        }
        let axis = (0..3).max_by(|a, b| half_m[*a].total_cmp(&half_m[*b])).unwrap_or(0);
        // those at one place in the order of their numbers, so that it does not depend on how they are sorted
        let half = order.len() / 2;
        order.select_nth_unstable_by(half, |a, b| at(*a)[axis].total_cmp(&at(*b)[axis]).then(a.cmp(b)));
        self.divide(points, range.start..range.start + half);
        self.divide(points, range.start + half..range.end);
        self.nodes[number].after = self.nodes.len() as u32;
    }

    /// Calls `see` with the points of every node that is not far and has no others below it, until it returns `true`;
    /// whether it did.
    fn visit(&self, is_far: impl Fn(&Node) -> bool, mut see: impl FnMut(&[u32]) -> bool) -> bool {
        let mut number = 0;
        while let Some(node) = self.nodes.get(number as usize) {
            number += 1;
            if is_far(node) {
                number = node.after;
            } else if node.after == number {
                let Range { start, end } = node.points;
                if see(&self.order[start as usize..end as usize]) {
                    return true;
                }
            }
        }
        false
    }
}

impl SurfaceField {
    /// Foam at `points`, with nothing on it.
    ///
    /// # Errors
    /// [`Refusal`] if a parameter is outside its range.
    pub fn new(config: Foam, points: SurfacePoints) -> Result<Self, Refusal> {
        config.check()?;
        let mut bounds_m = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for (point, normal) in points.positions_m.iter().zip(&points.normals) {
            for k in 0..3 {
                let base_m = point[k] - normal[k] * config.thickness_m;
                bounds_m[0][k] = bounds_m[0][k].min(point[k]).min(base_m);
                bounds_m[1][k] = bounds_m[1][k].max(point[k]).max(base_m);
            }
        }
        let (tree, pressure_pa) = (Tree::of(&points), vec![0.0; points.len()]);
        Ok(Self {
            pressure_pa,
            touched: Vec::new(),
            bottomed: false,
            bounds_m,
            tree,
            nearby: Vec::new(),
            config,
            points,
        })
    }

    /// The sample points.
    pub fn points(&self) -> &SurfacePoints {
        &self.points
    }

    /// Pressure at every sample point, Pa: the sum over all bodies since [`SurfaceField::clear`].
    pub fn pressure_pa(&self) -> &[f64] {
        &self.pressure_pa
    }

    /// Area of the points under pressure, m².
    pub fn touched_m2(&self) -> f64 {
        self.touched.iter().map(|k| self.points.areas_m2[*k]).sum()
    }

    /// Whether a body has gone through the foam since [`SurfaceField::clear`].
    pub fn bottomed(&self) -> bool {
        self.bottomed
    }

    /// Whether a place, m, lies in a column of foam, or beside it within half a thickness along the normal; and, where
    /// a body is pushed there, `along` (length 1), whether the foam could push it so.
    pub(crate) fn covers(&self, place_m: [f64; 3], along: Option<[f64; 3]>) -> bool {
        let (place, h, along) = (Vector::from(place_m), self.config.thickness_m, along.map(Vector::from));
        let is_far = |node: &Node| {
            // beside it by a side, and above by as much as below
            let reach_m = node.radius_m + 1.5 * (h + node.side_m);
            (place - node.centre_m).length_squared() > reach_m * reach_m
        };
        self.tree.visit(is_far, |points| {
            points.iter().map(|k| column(&self.points, *k)).any(|c| {
                let (away, normal) = (place - c.point_m, c.normal);
                // within the side of a square of the point's area: what touches right on the rim is on the foam;
                // between points of a round skin, the surface is off their planes
                let (height, bend) = (away.dot(normal), along.map_or(0.0, |_| 0.5 * c.area_m2.sqrt()));
                (-1.5 * h - bend..=0.5 * h + bend).contains(&height)
                    && (away - normal * height).length_squared() <= c.area_m2
                    && along.is_none_or(|along| along.dot(normal) > 0.2)
            })
        })
    }

    /// Removes all bodies.
    pub fn clear(&mut self) {
        self.touched.drain(..).for_each(|k| self.pressure_pa[k] = 0.0);
        self.bottomed = false;
    }

    /// The taxels of the points under pressure, those of several points several times.
    pub(crate) fn touched_taxels(&self) -> impl Iterator<Item = usize> + '_ {
        self.touched.iter().map(|k| self.points.taxels[*k] as usize)
    }

    /// Adds the mean pressure over every taxel's area to `means`.
    pub(crate) fn add_means(&self, means: &mut [f64]) {
        for k in &self.touched {
            let (taxel, area_m2) = (self.points.taxels[*k] as usize, self.points.areas_m2[*k]);
            means[taxel] += self.pressure_pa[*k] * area_m2 / self.points.taxel_areas_m2()[taxel];
        }
    }

    /// The columns under a body and up to `gap_m` below it, along their normals.
    pub(crate) fn columns_under(&mut self, body: &PosedMesh<'_>, solid: &Solid, gap_m: f64, out: &mut Vec<Column>) {
        out.clear();
        let (standing, h) = (solid.standing(body), self.config.thickness_m);
        if standing.is_apart([self.bounds_m[0].map(|v| v - gap_m), self.bounds_m[1].map(|v| v + gap_m)]) {
            return;
        }
        let k = self.near(body, &standing, h + gap_m);
        let Near { columns, beams, groups, depths_m, .. } = &mut self.nearby[k];
        standing.fronts_m(beams, groups, h, gap_m, depths_m);
        let there = columns.iter().zip(depths_m).filter(|(_, depth_m)| **depth_m > f64::NEG_INFINITY);
        out.extend(there.map(|(k, depth_m)| Column { depth_m: *depth_m, ..column(&self.points, *k) }));
    }

    /// Which of `self.nearby` has the columns whose points may be within `reach_m` of a body.
    fn near(&mut self, body: &PosedMesh<'_>, standing: &Standing<'_>, reach_m: f64) -> usize {
        let [low, high] = self.bounds_m.map(Vector::from);
        let rotation = body.rotation.map(Vector::from);
        let middle_m = into(&rotation, 0.5 * (low + high) - Vector::from(body.position_m));
        let known = self.nearby.iter().position(|near| near.solid.is(standing.solid()));
        if let Some(known) = known {
            let near = &self.nearby[known];
            // by the Frobenius norm of the difference, no point has moved farther
            let turned: f64 = (0..3).map(|k| (rotation[k] - near.rotation[k]).length_squared()).sum();
            let moved_m = (middle_m - near.middle_m).length() + turned.sqrt() * 0.5 * (high - low).length();
            // a longer reach than is asked for means columns in vain
            let same = near.groups.is_empty() || moved_m <= MARGIN * self.config.thickness_m;
            if same && moved_m + reach_m <= near.reach_m && near.reach_m <= 4.0 * reach_m {
                return known;
            }
        }
        let known = known.unwrap_or_else(|| {
            if self.nearby.len() == KNOWN {
                self.nearby.remove(0);
            }
            let (solid, columns) = (standing.solid().clone(), Vec::new());
            let (beams, groups, depths_m) = (Beams::default(), Vec::new(), Vec::new());
            self.nearby.push(Near { solid, rotation, middle_m, reach_m, columns, beams, groups, depths_m });
            self.nearby.len() - 1
        });
        let near = &mut self.nearby[known];
        (near.rotation, near.middle_m) = (rotation, middle_m);
        let margin_m = MARGIN * self.config.thickness_m;
        near.reach_m = reach_m + margin_m;
        near.columns.clear();
        near.beams.clear();
        near.groups.clear();
        let (reach_m, is_mesh) = (near.reach_m, standing.parts().is_empty());
        self.tree.visit(
            |node| standing.is_far(node.centre_m, node.radius_m, node.half_m, reach_m),
            |points| {
                let begin = near.columns.len();
                let base_m = |c: &Column| c.point_m - c.normal * self.config.thickness_m;
                let columns = || points.iter().map(|k| column(&self.points, *k));
                for (k, c) in points.iter().zip(columns()) {
                    if is_mesh || !standing.is_far(c.point_m, 0.0, Vector::ZERO, reach_m) {
                        near.columns.push(*k);
                        near.beams.push(base_m(&c), c.normal);
                    }
                }
                if is_mesh {
                    let middles = [0.0, self.config.thickness_m].map(|h| {
                        let places = || columns().map(|c| c.point_m - c.normal * h);
                        let middle_m = places().sum::<Vector>() / points.len() as f64;
                        (middle_m, places().map(|at| (at - middle_m).length()).fold(0.0, f64::max))
                    });
                    let radius_m = middles[0].1.max(middles[1].1);
                    let lanes = begin..near.columns.len();
                    let centres_m = middles.map(|(middle_m, _)| middle_m);
                    near.groups.push(standing.look(lanes, centres_m, radius_m, [reach_m, margin_m]));
                }
                false
            },
        );
        known
    }

    /// The column nearest to a place, m.
    pub(crate) fn column_at(&self, place_m: Vector) -> Option<Column> {
        let away = |k: usize| (Vector::from(self.points.positions_m[k]) - place_m).length_squared();
        let nearest = (0..self.points.len()).min_by(|a, b| away(*a).total_cmp(&away(*b)))?;
        Some(column(&self.points, u32::try_from(nearest).ok()?))
    }

    /// Adds the pressures of `columns` at their depths to those since [`SurfaceField::clear`].
    pub(crate) fn carry(&mut self, columns: &[Column], law: &FoamLaw) {
        for c in columns {
            self.bottomed |= c.depth_m > self.config.thickness_m;
            add(&mut self.pressure_pa, &mut self.touched, c.index, law.pressure_pa(c.depth_m));
        }
    }

    /// Presses `body` on the skin, in addition to the bodies pressed since [`SurfaceField::clear`]. `solid` is made
    /// from the mesh of `body`. Returns the wrench on `body` about its centre of mass. If a pose or velocity is not
    /// finite, the wrench is NaN and nothing is pressed.
    pub fn press(&mut self, solid: &Solid, body: &PosedMesh<'_>) -> Wrench {
        if !body.is_finite() {
            return Wrench::UNKNOWN;
        }
        let standing = solid.standing(body);
        if standing.is_apart(self.bounds_m) {
            return Wrench::NONE;
        }
        let k = self.near(body, &standing, self.config.thickness_m);
        let c = &self.config;
        let law = c.law(body.stiffness_pa_per_m);
        let regular = c.friction_speed_m_per_s * c.friction_speed_m_per_s;
        let (mut force, mut torque) = (Vector::ZERO, Vector::ZERO);
        let centre = Vector::from(body.centre_of_mass_m);
        let Near { columns, beams, groups, depths_m, .. } = &mut self.nearby[k];
        standing.fronts_m(beams, groups, c.thickness_m, 0.0, depths_m);
        for (place, depth_m) in columns.iter().zip(depths_m) {
            let depth_m = *depth_m;
            if depth_m <= 0.0 {
                continue;
            }
            let Column { index, point_m, normal, area_m2, .. } = column(&self.points, *place);
            self.bottomed |= depth_m > c.thickness_m;
            let arm = point_m - normal * depth_m - centre;
            let velocity = Vector::from(velocity_at(body, arm.into()));
            let away = velocity.dot(normal);
            let p = law.pressure_pa(depth_m - c.damping_s * away);
            let slide = velocity - normal * away;
            let drag = -c.friction * p / (slide.length_squared() + regular).sqrt();
            let load = (normal * p + slide * drag) * area_m2;
            force += load;
            torque += arm.cross(load);
            add(&mut self.pressure_pa, &mut self.touched, index, p);
        }
        Wrench { force_n: force.into(), torque_nm: torque.into() }
    }
}

/// The column under a point, without a depth.
#[inline]
fn column(points: &SurfacePoints, number: u32) -> Column {
    let k = number as usize;
    Column::new(k, points.positions_m[k].into(), points.normals[k].into(), points.areas_m2[k], 0.0)
}

/// Adds `p` to the pressure of a point, and the point to those that have one.
fn add(pressure_pa: &mut [f64], touched: &mut Vec<usize>, index: usize, p: f64) {
    if p > 0.0 {
        if pressure_pa[index] <= 0.0 {
            touched.push(index);
        }
        pressure_pa[index] += p;
    }
}
