//! Sample points of a skin: flat, around an axis, or on a mesh.

use super::solid::Solid;
use crate::mesh::TriMesh;
use parry3d_f64::math::Vector;
use spts_input::Refusal;
use spts_models::{SkinLayout, in_interval, in_range};
use std::f64::consts::TAU;

/// Sample points of a skin's free surface. Each has its outward normal, its area, and its taxel.
///
/// Lengths are in metres, in the skin's own axes.
///
/// ```
/// use spts_contact::SurfacePoints;
/// use spts_models::SkinLayout;
///
/// let points = SurfacePoints::flat(&SkinLayout::default(), 4)?;
/// assert_eq!((points.len(), points.taxels()), (1600, 100));
/// let (centre_m, normal) = points.taxel_centres()[0];
/// assert!((centre_m[0] + 67.5e-3).abs() < 1e-12 && (centre_m[1] - 67.5e-3).abs() < 1e-12);
/// assert_eq!(normal, [0.0, 0.0, 1.0]);
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SurfacePoints {
    pub(super) positions_m: Vec<[f64; 3]>,
    pub(super) normals: Vec<[f64; 3]>,
    pub(super) areas_m2: Vec<f64>,
    pub(super) taxels: Vec<u32>,
    /// Area of every taxel, m²: the sum over its points.
    taxel_areas_m2: Vec<f64>,
}

/// Most sample points of a skin.
const MOST_POINTS: usize = 1 << 24;

impl SurfacePoints {
    /// Points at `positions_m` with `normals` of any length but 0. Point i belongs to taxel `taxels[i]`; every taxel up
    /// to the largest number must have a point.
    ///
    /// # Errors
    /// [`Refusal`] for the first number that is not finite, normal of length 0, area that is not positive, list of
    /// another length, or taxel without a point.
    pub fn new(
        positions_m: Vec<[f64; 3]>,
        normals: Vec<[f64; 3]>,
        areas_m2: Vec<f64>,
        taxels: Vec<u32>,
    ) -> Result<Self, Refusal> {
        let count = positions_m.len();
        in_range("points", count as f64, (1..=MOST_POINTS).contains(&count), "[1, 2^24]")?;
        for (field, found) in [("normals", normals.len()), ("areas_m2", areas_m2.len()), ("taxels", taxels.len())] {
            in_range(field, found as f64, found == count, "as many as there are points")?;
        }
        for (i, p) in positions_m.iter().enumerate() {
            for v in p {
                in_interval(&format!("positions_m[{i}]"), *v, "[-1000, 1000] m")?;
            }
        }
        let mut units = normals;
        for (i, n) in units.iter_mut().enumerate() {
            let length = n.iter().map(|v| v * v).sum::<f64>().sqrt();
            let valid = length.is_finite() && length > 1e-12;
            in_range(&format!("normals[{i}]"), length, valid, "of a length above 1e-12")?;
            *n = n.map(|v| v / length);
        }
        for (i, area) in areas_m2.iter().enumerate() {
            in_interval(&format!("areas_m2[{i}]"), *area, "(0, 1] m²")?;
        }
        let taxel_count = taxels.iter().copied().max().map_or(0, |k| k as usize + 1);
        let (found, range) = (taxel_count as f64, "numbers below that of the points");
        in_range("taxels", found, taxel_count <= count, range)?;
        let mut taxel_areas_m2 = vec![0.0; taxel_count];
        for (taxel, area) in taxels.iter().zip(&areas_m2) {
            taxel_areas_m2[*taxel as usize] += area;
        }
        if let Some(k) = taxel_areas_m2.iter().position(|area| *area <= 0.0) {
            return Err(Refusal::range("taxels", k, "a point for every taxel up to the last one"));
        }
        Ok(Self { positions_m, normals: units, areas_m2, taxels, taxel_areas_m2 })
    }

    /// A flat skin with `cells_per_taxel` × `cells_per_taxel` points a taxel, in the plane z = 0 and centred on the
    /// origin. Rows run from the largest y to the smallest, columns from the smallest x to the largest.
    ///
    /// # Errors
    /// [`Refusal`] for no points, or too many.
    pub fn flat(skin: &SkinLayout, cells_per_taxel: usize) -> Result<Self, Refusal> {
        let [rows, cols] = [skin.rows(), skin.cols()].map(|n| n.saturating_mul(cells_per_taxel));
        let count = rows.saturating_mul(cols);
        let valid = (1..=MOST_POINTS).contains(&count);
        in_range("rows × cols × cells_per_taxel²", count as f64, valid, "[1, 2^24]")?;
        let cell_m = skin.pitch_m() / cells_per_taxel as f64;
        let at = |i: usize, n: usize| (i as f64 + 0.5 - 0.5 * n as f64) * cell_m;
        let (mut positions_m, mut taxels) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for row in 0..rows {
            for col in 0..cols {
                positions_m.push([at(col, cols), -at(row, rows), 0.0]);
                let taxel = row / cells_per_taxel * skin.cols() + col / cells_per_taxel;
                taxels.push(u32::try_from(taxel).unwrap_or(u32::MAX));
            }
        }
        Self::new(positions_m, vec![[0.0, 0.0, 1.0]; count], vec![cell_m * cell_m; count], taxels)
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.positions_m.len()
    }

    /// Always `false`: there is at least one point.
    pub fn is_empty(&self) -> bool {
        self.positions_m.is_empty()
    }

    /// Number of taxels.
    pub fn taxels(&self) -> usize {
        self.taxel_areas_m2.len()
    }

    /// The same points with `normals` of length 1, which are taken as they are: [`SurfacePoints::new`] would divide
    /// them by their length once more.
    ///
    /// # Errors
    /// [`Refusal`] for a normal of another length than 1, or more or fewer than points.
    pub fn with_unit_normals(self, normals: Vec<[f64; 3]>) -> Result<Self, Refusal> {
        in_range("normals", normals.len() as f64, normals.len() == self.len(), "as many as there are points")?;
        for (i, n) in normals.iter().enumerate() {
            let length = n.iter().map(|v| v * v).sum::<f64>().sqrt();
            in_range(&format!("normals[{i}]"), length, (length - 1.0).abs() < 1e-9, "of length 1")?;
        }
        Ok(Self { normals, ..self })
    }

    /// Place of every point, m.
    pub fn positions_m(&self) -> &[[f64; 3]] {
        &self.positions_m
    }

    /// Taxel of every point.
    pub fn taxel_of_points(&self) -> &[u32] {
        &self.taxels
    }

    /// Outward unit normal at every point.
    pub fn normals(&self) -> &[[f64; 3]] {
        &self.normals
    }

    /// Area of every point, m².
    pub fn areas_m2(&self) -> &[f64] {
        &self.areas_m2
    }

    /// Area of every taxel, m².
    pub fn taxel_areas_m2(&self) -> &[f64] {
        &self.taxel_areas_m2
    }

    /// Centre of every taxel, m, and its mean normal, of length 1 unless the normals of its points cancel.
    pub fn taxel_centres(&self) -> Vec<([f64; 3], [f64; 3])> {
        let mut sums = vec![([0.0; 3], [0.0; 3]); self.taxels()];
        for (i, taxel) in self.taxels.iter().enumerate() {
            let (place, normal) = &mut sums[*taxel as usize];
            for k in 0..3 {
                place[k] += self.areas_m2[i] * self.positions_m[i][k];
                normal[k] += self.areas_m2[i] * self.normals[i][k];
            }
        }
        for ((place, normal), area) in sums.iter_mut().zip(&self.taxel_areas_m2) {
            let length = normal.iter().map(|v| v * v).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
            *place = place.map(|v| v / area);
            *normal = normal.map(|v| v / length);
        }
        sums
    }
}

// Grids of taxels around an axis, on a cylinder or on a mesh.

/// A grid of rows × cols taxels around an axis. Rows run from the largest coordinate along the axis to the smallest;
/// columns follow the angle about it. Seen from outside with the axis pointing up, columns run from left to right.
///
/// For the z axis the angle is 0 along x and π/2 along y; for the x axis it is 0 along y; for the y axis, 0 along z.
///
/// ```
/// use spts_contact::{SurfacePoints, Winding};
///
/// let (shape, span_m) = ([4, 12], [0.0, 0.06]);
/// let whole = [0.0, std::f64::consts::TAU];
/// let winding = Winding { shape, points_per_side: 3, axis: 2, centre_m: [0.0; 3], arc_rad: whole, span_m };
/// let points = SurfacePoints::on_cylinder(&winding, 0.05)?;
/// let area_m2: f64 = points.areas_m2().iter().sum();
/// assert!((area_m2 / (std::f64::consts::TAU * 0.05 * 0.06) - 1.0).abs() < 1e-9);
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Winding {
    /// Rows and columns of taxels.
    pub shape: [usize; 2],
    /// Sample points along each side of a taxel; [1, 64].
    pub points_per_side: usize,
    /// Number of the axis: 0 for x, 1 for y, 2 for z.
    pub axis: usize,
    /// A point on the axis, m.
    pub centre_m: [f64; 3],
    /// First and last angle, rad; at most 2π apart.
    pub arc_rad: [f64; 2],
    /// Lowest and highest coordinate along the axis, m.
    pub span_m: [f64; 2],
}

/// Smallest cosine between the normal of a mesh and the way out from the axis.
const STEEPEST: f64 = 0.1;

impl SurfacePoints {
    /// Points on a cylinder of `radius_m` around the axis of `winding`.
    ///
    /// # Errors
    /// [`Refusal`] for a value outside its range.
    pub fn on_cylinder(winding: &Winding, radius_m: f64) -> Result<Self, Refusal> {
        in_interval("radius", radius_m, "(1e-4, 100] m")?;
        winding.points(|_, _, _| Ok((radius_m, None)))
    }

    /// Points where rays towards the axis of `winding` first meet `mesh`.
    ///
    /// # Errors
    /// [`Refusal`] for a value outside its range, a ray that misses the mesh, or a surface parallel to its ray.
    pub fn wrapped(winding: &Winding, mesh: &TriMesh) -> Result<Self, Refusal> {
        let solid = Solid::new(mesh);
        let centre = Vector::from(winding.centre_m);
        let along = axis(winding.axis);
        let away = |v: &[f64; 3]| {
            let r = Vector::from(*v) - centre;
            (r - along * r.dot(along)).length()
        };
        let reach_m = 1.001 * mesh.vertices.iter().map(away).fold(0.0, f64::max);
        winding.points(|on_axis, outward, taxel| {
            let met = solid.surface(on_axis + outward * reach_m, -outward, reach_m);
            let field = format!("mesh under taxel {taxel}");
            let Some((distance_m, normal)) = met else {
                let range = "a surface between each point of the axis and its outside";
                return Err(Refusal::range(&field, 0, range));
            };
            let cosine = normal.dot(outward);
            let range = "a normal within 84° of the way out from the axis";
            in_range(&field, cosine, cosine >= STEEPEST, range)?;
            Ok((reach_m - distance_m, Some(normal)))
        })
    }
}

impl Winding {
    /// Points at the radius, and with the normal, that `at` gives for a point of the axis, the way out from there, and
    /// a taxel; without a normal it is the way out.
    fn points(
        &self,
        at: impl Fn(Vector, Vector, usize) -> Result<(f64, Option<Vector>), Refusal>,
    ) -> Result<SurfacePoints, Refusal> {
        let [rows, cols] = self.shape;
        let side = self.points_per_side;
        in_interval("rows", rows as f64, "[1, 131072]")?;
        in_interval("cols", cols as f64, "[1, 131072]")?;
        in_interval("points", side as f64, "[1, 64]")?;
        let count = rows * cols * side * side;
        in_range("rows × cols × points²", count as f64, count <= MOST_POINTS, "[1, 2^24]")?;
        let [first, last] = self.arc_rad;
        let arc = last - first;
        let range = "(0, 2π] rad from its first angle to its last";
        in_range("arc", arc, arc > 0.0 && arc <= TAU + 1e-9, range)?;
        let [low, high] = self.span_m;
        let range = "above 0 m from its lowest to its highest";
        in_range("span", high - low, high > low && (high - low).is_finite(), range)?;
        let along = axis(self.axis);
        let (across, beyond) = (axis((self.axis + 1) % 3), axis((self.axis + 2) % 3));
        let (lines, rays) = (rows * side, cols * side);
        let (height_m, angle_rad) = ((high - low) / lines as f64, arc / rays as f64);
        let centre = Vector::from(self.centre_m);
        let (mut positions, mut normals) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let (mut areas, mut taxels) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for line in 0..lines {
            let on_axis = centre + along * (high - (line as f64 + 0.5) * height_m - centre.dot(along));
            for ray in 0..rays {
                let (sin, cos) = (first + (ray as f64 + 0.5) * angle_rad).sin_cos();
                let outward = across * cos + beyond * sin;
                let taxel = line / side * cols + ray / side;
                let (radius_m, normal) = at(on_axis, outward, taxel)?;
                let normal = normal.unwrap_or(outward);
                positions.push((on_axis + outward * radius_m).into());
                normals.push(normal.into());
                areas.push(radius_m * angle_rad * height_m / normal.dot(outward));
                taxels.push(u32::try_from(taxel).unwrap_or(u32::MAX));
            }
        }
        SurfacePoints::new(positions, normals, areas, taxels)
    }
}

fn axis(number: usize) -> Vector {
    let unit: [f64; 3] = std::array::from_fn(|k| f64::from(u8::from(k == number)));
    unit.into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cylinder;
    use approx::assert_relative_eq;

    const HALF: Winding = Winding {
        shape: [4, 6],
        points_per_side: 2,
        axis: 2,
        centre_m: [0.01, -0.02, 0.0],
        arc_rad: [0.0, TAU / 2.0],
        span_m: [0.02, 0.1],
    };

    #[test]
    fn a_cylinder_has_the_area_of_one() {
        for (axis, low) in [(0, 0.02), (1, -0.03), (2, 0.4)] {
            let winding = Winding { axis, span_m: [low, low + 0.08], ..HALF };
            let points = SurfacePoints::on_cylinder(&winding, 0.05).unwrap();
            assert_eq!((points.len(), points.taxels()), (96, 24));
            let area: f64 = points.taxel_areas_m2().iter().sum();
            assert_relative_eq!(area, 0.05 * TAU / 2.0 * 0.08, max_relative = 1e-12);
            for (p, n) in points.positions_m.iter().zip(&points.normals) {
                let r: Vec<f64> = (0..3).filter(|k| *k != axis).map(|k| p[k] - HALF.centre_m[k]).collect();
                assert_relative_eq!(r[0].hypot(r[1]), 0.05, max_relative = 1e-12);
                assert!(n[axis].abs() < 1e-12 && p[axis] > low && p[axis] < low + 0.08);
            }
            // the first taxel is the highest, at the smallest angle
            assert!(points.positions_m[0][axis] > points.positions_m[95][axis]);
        }
    }

    /// On a prism of many sides the points are those of its cylinder, but for the sagitta 1 − cos(π/n) of 2e-4.
    #[test]
    fn a_mesh_of_a_cylinder_is_one() {
        let mesh = cylinder(0.05, 0.2, 180).translated([0.01, -0.02, -0.05]);
        let found = SurfacePoints::wrapped(&HALF, &mesh).unwrap();
        let wanted = SurfacePoints::on_cylinder(&HALF, 0.05).unwrap();
        for i in 0..found.len() {
            for k in 0..3 {
                assert!((found.positions_m[i][k] - wanted.positions_m[i][k]).abs() < 1e-5);
                assert!((found.normals[i][k] - wanted.normals[i][k]).abs() < 0.02);
            }
            assert_relative_eq!(found.areas_m2[i], wanted.areas_m2[i], max_relative = 1e-3);
        }
        let above = Winding { span_m: [0.0, 0.3], ..HALF };
        let error = SurfacePoints::wrapped(&above, &mesh).unwrap_err().to_string();
        assert!(error.contains("mesh under taxel 0"), "{error}");
    }

    #[test]
    fn what_cannot_be_wound_is_refused() {
        let with = |change: fn(&mut Winding)| {
            let mut winding = HALF;
            change(&mut winding);
            winding
        };
        for (field, winding) in [
            ("rows", with(|w| w.shape = [0, 6])),
            ("arc", with(|w| w.arc_rad = [1.0, 1.0])),
            ("arc", with(|w| w.arc_rad = [0.0, 7.0])),
            ("span", with(|w| w.span_m = [0.1, f64::NAN])),
            ("points", with(|w| w.points_per_side = 0)),
        ] {
            let error = SurfacePoints::on_cylinder(&winding, 0.05).unwrap_err().to_string();
            assert!(error.contains(field), "{error}");
        }
        assert!(SurfacePoints::on_cylinder(&HALF, f64::NAN).is_err());
    }
}
