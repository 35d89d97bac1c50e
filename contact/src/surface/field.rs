//! Foam on a surface of any shape.

use super::points::SurfacePoints;
use super::solid::Solid;
use crate::balance::Column;
use crate::field::{PosedMesh, Wrench};
use crate::foam::{Foam, FoamLaw};
use crate::mesh::span;
use crate::traction::velocity_at;
use parry3d_f64::math::Vector;
use spts_input::Refusal;

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
    pressure_pa: Vec<f64>,
    bottomed: bool,
    /// Lowest and highest corner of the foam, m.
    bounds_m: [[f64; 3]; 2],
    blocks: Vec<Block>,
}

/// Neighbouring points, by their numbers, and a ball around them.
#[derive(Debug, Clone)]
struct Block {
    points: Vec<usize>,
    centre_m: Vector,
    radius_m: f64,
    /// Side of a square of the largest area of a point, m.
    side_m: f64,
}

/// Most points of a block.
const BLOCK: usize = 32;

impl Block {
    /// Adds `points` in blocks to `out`: halves along the longest side of the box around them, over and over.
    fn divide(mut points: Vec<usize>, all: &SurfacePoints, out: &mut Vec<Self>) {
        if points.len() <= BLOCK {
            points.sort_unstable();
            out.push(Self::of(points, all));
            return;
        }
        let [low, high] = span(points.iter().map(|k| all.positions_m[*k]));
        let side = |k: &usize| high[*k] - low[*k];
        let axis = (0..3).max_by(|a, b| side(a).total_cmp(&side(b))).unwrap_or(0);
        let at = |k: &usize| all.positions_m[*k][axis];
        // those at one place in the order of their numbers, so that it does not depend on how they are sorted
        let half = points.len() / 2;
        points.select_nth_unstable_by(half, |a, b| at(a).total_cmp(&at(b)).then(a.cmp(b)));
        let upper = points.split_off(half);
        Self::divide(points, all, out);
        Self::divide(upper, all, out);
    }

    fn of(points: Vec<usize>, all: &SurfacePoints) -> Self {
        let places = || points.iter().map(|k| Vector::from(all.positions_m[*k]));
        let centre_m = places().fold(Vector::ZERO, |sum, p| sum + p) / points.len() as f64;
        let radius_m = places().map(|p| (p - centre_m).length()).fold(0.0, f64::max);
        let side_m = points.iter().map(|k| all.areas_m2[*k]).fold(0.0, f64::max).sqrt();
        Self { points, centre_m, radius_m, side_m }
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
        let mut blocks = Vec::new();
        Block::divide((0..points.len()).collect(), &points, &mut blocks);
        Ok(Self { pressure_pa: vec![0.0; points.len()], bottomed: false, bounds_m, blocks, config, points })
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
        let pressed = self.pressure_pa.iter().zip(&self.points.areas_m2);
        pressed.filter(|(p, _)| **p > 0.0).map(|(_, area)| area).sum()
    }

    /// Whether a body has gone through the foam since [`SurfaceField::clear`].
    pub fn bottomed(&self) -> bool {
        self.bottomed
    }

    /// Whether a place, m, lies in a column of foam, or beside it within half a thickness along the normal; and, where
    /// a body is pushed there, `along` (length 1), whether the foam could push it so.
    pub(crate) fn covers(&self, place_m: [f64; 3], along: Option<[f64; 3]>) -> bool {
        let (place, h, along) = (Vector::from(place_m), self.config.thickness_m, along.map(Vector::from));
        let p = &self.points;
        let near = |block: &&Block| {
            let reach_m = block.radius_m + 2.0 * (h + block.side_m);
            (place - block.centre_m).length_squared() <= reach_m * reach_m
        };
        self.blocks.iter().filter(near).flat_map(|block| &block.points).any(|&k| {
            let (away, normal, area_m2) =
                (place - Vector::from(p.positions_m[k]), Vector::from(p.normals[k]), p.areas_m2[k]);
            // within the side of a square of the point's area: what touches right on the rim is on the foam; between
            // points of a round skin, the surface is off their planes
            let (height, bend) = (away.dot(normal), along.map_or(0.0, |_| 0.5 * area_m2.sqrt()));
            (-1.5 * h - bend..=0.5 * h + bend).contains(&height)
                && (away - normal * height).length_squared() <= area_m2
                && along.is_none_or(|along| along.dot(normal) > 0.2)
        })
    }

    /// Removes all bodies.
    pub fn clear(&mut self) {
        self.pressure_pa.fill(0.0);
        self.bottomed = false;
    }

    /// The columns under a body and up to `gap_m` below it, along their normals.
    pub(crate) fn columns_under(&self, body: &PosedMesh<'_>, solid: &Solid, gap_m: f64, out: &mut Vec<Column>) {
        out.clear();
        let (standing, h) = (solid.standing(body), self.config.thickness_m);
        if standing.is_apart([self.bounds_m[0].map(|v| v - gap_m), self.bounds_m[1].map(|v| v + gap_m)]) {
            return;
        }
        let p = &self.points;
        for block in self.blocks.iter().filter(|block| !standing.is_far(block.centre_m, block.radius_m + h + gap_m)) {
            for &k in &block.points {
                let (point, normal) = (Vector::from(p.positions_m[k]), Vector::from(p.normals[k]));
                if let Some(depth_m) = standing.front_m(point - normal * h, normal, h, gap_m) {
                    out.push(Column::new(k, point, normal, p.areas_m2[k], depth_m));
                }
            }
        }
    }

    /// The column nearest to a place, m.
    pub(crate) fn column_at(&self, place_m: Vector) -> Option<Column> {
        let away = |point: &[f64; 3]| (Vector::from(*point) - place_m).length_squared();
        let points = self.points.positions_m.iter().enumerate();
        let (index, point) = points.min_by(|(_, a), (_, b)| away(a).total_cmp(&away(b)))?;
        let normal = Vector::from(self.points.normals[index]);
        Some(Column::new(index, Vector::from(*point), normal, self.points.areas_m2[index], 0.0))
    }

    /// Adds the pressures of `columns` at their depths to those since [`SurfaceField::clear`], and their means over the
    /// taxels to `means`.
    pub(crate) fn carry(&mut self, columns: &[Column], law: &FoamLaw, means: &mut [f64]) {
        for c in columns {
            self.bottomed |= c.depth_m > self.config.thickness_m;
            let p = law.pressure_pa(c.depth_m);
            self.pressure_pa[c.index] += p;
            let (taxel, area_m2) = (self.points.taxels[c.index] as usize, self.points.areas_m2[c.index]);
            means[taxel] += p * area_m2 / self.points.taxel_areas_m2()[taxel];
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
        let c = &self.config;
        let law = c.law(body.stiffness_pa_per_m);
        let regular = c.friction_speed_m_per_s * c.friction_speed_m_per_s;
        let (mut force, mut torque) = (Vector::ZERO, Vector::ZERO);
        let centre = Vector::from(body.centre_of_mass_m);
        let points = self.points.positions_m.iter().zip(&self.points.normals);
        let loads = self.points.areas_m2.iter().zip(&mut self.pressure_pa);
        for ((point, normal), (area, pressure_pa)) in points.zip(loads) {
            let (point, normal) = (Vector::from(*point), Vector::from(*normal));
            let depth_m = standing.depth_m(point - normal * c.thickness_m, normal, c.thickness_m);
            if depth_m <= 0.0 {
                continue;
            }
            self.bottomed |= depth_m > c.thickness_m;
            let arm = point - normal * depth_m - centre;
            let velocity = Vector::from(velocity_at(body, arm.into()));
            let away = velocity.dot(normal);
            let p = law.pressure_pa(depth_m - c.damping_s * away);
            let slide = velocity - normal * away;
            let drag = -c.friction * p / (slide.length_squared() + regular).sqrt();
            let load = (normal * p + slide * drag) * *area;
            force += load;
            torque += arm.cross(load);
            *pressure_pa += p;
        }
        Wrench { force_n: force.into(), torque_nm: torque.into() }
    }
}
