//! Grids of taxels around an axis, on a cylinder or on a mesh.

use super::points::SurfacePoints;
use super::solid::Solid;
use crate::mesh::TriMesh;
use parry3d_f64::math::Vector;
use spts_models::{ConfigError, in_range};
use std::f64::consts::TAU;

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
/// # Ok::<(), spts_models::ConfigError>(())
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
    /// [`ConfigError`] for a value outside its range.
    pub fn on_cylinder(winding: &Winding, radius_m: f64) -> Result<Self, ConfigError> {
        in_range(
            "radius",
            radius_m,
            radius_m > 1e-4 && radius_m <= 100.0,
            "(1e-4, 100] m",
        )?;
        winding.points(|_, _, _| Ok((radius_m, None)))
    }

    /// Points where rays towards the axis of `winding` first meet `mesh`.
    ///
    /// # Errors
    /// [`ConfigError`] for a value outside its range, a ray that misses the mesh, or a surface parallel to its ray.
    pub fn wrapped(winding: &Winding, mesh: &TriMesh) -> Result<Self, ConfigError> {
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
                in_range(
                    &field,
                    0.0,
                    false,
                    "a surface between each point of the axis and its outside",
                )?;
                return Ok((0.0, None));
            };
            let cosine = normal.dot(outward);
            in_range(
                &field,
                cosine,
                cosine >= STEEPEST,
                "a normal within 84° of the way out from the axis",
            )?;
            Ok((reach_m - distance_m, Some(normal)))
        })
    }
}

impl Winding {
    /// Points at the radius, and with the normal, that `at` gives for a point of the axis, the way out from there, and
    /// a taxel; without a normal it is the way out.
    fn points(
        &self,
        at: impl Fn(Vector, Vector, usize) -> Result<(f64, Option<Vector>), ConfigError>,
    ) -> Result<SurfacePoints, ConfigError> {
        let [rows, cols] = self.shape;
        let side = self.points_per_side;
        in_range("rows", rows as f64, (1..=1 << 17).contains(&rows), "[1, 131072]")?;
        in_range("cols", cols as f64, (1..=1 << 17).contains(&cols), "[1, 131072]")?;
        in_range("points", side as f64, (1..=64).contains(&side), "[1, 64]")?;
        in_range(
            "rows × cols × points²",
            (rows * cols * side * side) as f64,
            rows * cols * side * side <= 1 << 24,
            "[1, 2^24]",
        )?;
        let [first, last] = self.arc_rad;
        let arc = last - first;
        in_range(
            "arc",
            arc,
            arc > 0.0 && arc <= TAU + 1e-9,
            "(0, 2π] rad from its first angle to its last",
        )?;
        let [low, high] = self.span_m;
        in_range(
            "span",
            high - low,
            high > low && (high - low).is_finite(),
            "above 0 m from its lowest to its highest",
        )?;
        let along = axis(self.axis);
        let (across, beyond) = (axis((self.axis + 1) % 3), axis((self.axis + 2) % 3));
        let (lines, rays) = (rows * side, cols * side);
        let (height_m, angle_rad) = ((high - low) / lines as f64, arc / rays as f64);
        let centre = Vector::from(self.centre_m);
        let count = lines * rays;
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
            let winding = Winding {
                axis,
                span_m: [low, low + 0.08],
                ..HALF
            };
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
        let above = Winding {
            span_m: [0.0, 0.3],
            ..HALF
        };
        let error = SurfacePoints::wrapped(&above, &mesh).unwrap_err().to_string();
        assert!(error.contains("mesh under taxel 0"), "{error}");
    }

    #[test]
    fn what_cannot_be_wound_is_refused() {
        let cases: [(&str, Winding); 5] = [
            ("rows", Winding { shape: [0, 6], ..HALF }),
            (
                "arc",
                Winding {
                    arc_rad: [1.0, 1.0],
                    ..HALF
                },
            ),
            (
                "arc",
                Winding {
                    arc_rad: [0.0, 7.0],
                    ..HALF
                },
            ),
            (
                "span",
                Winding {
                    span_m: [0.1, f64::NAN],
                    ..HALF
                },
            ),
            (
                "points",
                Winding {
                    points_per_side: 0,
                    ..HALF
                },
            ),
        ];
        for (field, winding) in cases {
            let error = SurfacePoints::on_cylinder(&winding, 0.05).unwrap_err().to_string();
            assert!(error.contains(field), "{error}");
        }
        assert!(SurfacePoints::on_cylinder(&HALF, f64::NAN).is_err());
    }
}
