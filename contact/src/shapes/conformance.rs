//! Properties that every family of shapes must have.

use super::family::ShapeFamily;
use super::ranges::ShapeRanges;
use super::shape::Shape;
use crate::mesh::{TriMesh, checked};

/// Largest number of triangles in a shape.
pub const MAX_TRIANGLES: usize = 6000;
/// Largest relative error of the drawn size and of the volume's lower bound: rounding of sums over a few hundred
/// points.
const ROUNDING: f64 = 1e-9;
/// Least height of a triangle over its longest side as a share of the shape's size: far above rounding, far below what
/// a field can see.
const LEAST_TRIANGLE: f64 = 1e-7;

/// A property of [`ShapeFamily`] that a shape lacks.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{family}, seed {seed}: {check}: got {actual}, expected {expected}")]
pub struct ShapeFault {
    /// Name of the family.
    pub family: &'static str,
    /// Seed of the shape.
    pub seed: u64,
    /// Name of the property.
    pub check: &'static str,
    /// Actual value.
    pub actual: String,
    /// Expected value.
    pub expected: String,
}

/// Checks the shapes of `family` for the given ranges and seeds. A shape must be a closed solid on z = 0 that needs no
/// repair, have the drawn size, relief and edge, and consist of few, well-formed triangles. The same seed must give the
/// same shape, and another seed another shape.
///
/// # Errors
/// The first [`ShapeFault`] found.
pub fn check_shape_family(
    family: &ShapeFamily,
    ranges: &ShapeRanges,
    seeds: std::ops::Range<u64>,
) -> Result<(), ShapeFault> {
    let mut last: Option<Shape> = None;
    for seed in seeds {
        let fault = |check, actual: String, expected: &str| ShapeFault {
            family: family.name,
            seed,
            check,
            actual,
            expected: expected.to_owned(),
        };
        let build = || {
            let built = family.build(ranges, seed);
            built.map_err(|error| fault("builds", error.to_string(), "a shape"))
        };
        let (shape, again) = (build()?, build()?);
        if shape != again {
            return Err(fault("a function of the seed", "two shapes".into(), "one"));
        }
        if last.is_some_and(|last| last.mesh == shape.mesh) {
            return Err(fault("differs", "the shape of the seed before".into(), "another"));
        }
        check_shape(&shape, ranges).map_err(|(check, actual, expected)| fault(check, actual, expected))?;
        last = Some(shape);
    }
    Ok(())
}

type Broken = (&'static str, String, &'static str);

fn check_shape(shape: &Shape, ranges: &ShapeRanges) -> Result<(), Broken> {
    let mesh = &shape.mesh;
    let need = |ok: bool, check, actual: &dyn std::fmt::Debug, expected| {
        if ok {
            Ok(())
        } else {
            Err((check, format!("{actual:?}"), expected))
        }
    };
    let count = mesh.triangles.len();
    need(count <= MAX_TRIANGLES, "few triangles", &count, "6000 at most")?;
    let (clean, report) = checked(mesh, 1.0, shape.family).map_err(|e| ("a solid", e.to_string(), "closed"))?;
    need(mesh.open_edges() == 0, "closed", &mesh.open_edges(), "no open edge")?;
    let mended = report.joined_vertices + report.dropped_triangles + report.duplicate_triangles;
    let turned = report.turned_triangles + report.filled_holes + report.lids + usize::from(report.flipped);
    need(
        mended + turned == 0 && clean.triangles.len() == count,
        "needs no repair",
        &report,
        "nothing to mend",
    )?;
    let (low, high) = mesh.bounds().unwrap_or_default();
    need(low[2].abs() <= 0.0, "on the ground", &low[2], "z = 0")?;
    let extent = [high[0] - low[0], high[1] - low[1]];
    let size_m = extent[0].max(extent[1]);
    let within = |x: f64, [low, high]: [f64; 2]| x >= low * (1.0 - ROUNDING) && x <= high * (1.0 + ROUNDING);
    need(within(size_m, ranges.size_m), "size", &size_m, "within its range")?;
    let same = (0..2).all(|k| (extent[k] - shape.size_m[k]).abs() <= ROUNDING * size_m);
    need(same, "extent", &extent, "as the shape says")?;
    let relief = shape.relief_m <= ranges.relief_m[1] && (shape.relief_m > 0.0 || ranges.relief_m[0] < 1e-6);
    need(relief, "relief", &shape.relief_m, "within its range")?;
    let edge = shape.edge_m <= ranges.edge_m[1];
    need(edge, "edge", &shape.edge_m, "at most its range's end")?;
    // the flat top is 10 mm above the highest point of the underside
    let (volume, least) = (mesh.volume_m3(), shape.area_m2 * 10e-3 * (1.0 - ROUNDING));
    need(volume >= least, "volume", &volume, "10 mm over the footprint or more")?;
    let inside = shape.area_m2 > 0.0 && shape.area_m2 <= extent[0] * extent[1] * (1.0 + ROUNDING);
    need(inside, "area", &shape.area_m2, "that of the box around it or less")?;
    let flattest = (0..count)
        .map(|t| height_over_longest(mesh, t))
        .fold(f64::INFINITY, f64::min);
    need(
        flattest > LEAST_TRIANGLE * size_m,
        "sound triangles",
        &flattest,
        "heights above 1e-7 of the size",
    )
}

/// Height of triangle `t` over its longest side, m.
fn height_over_longest(mesh: &TriMesh, t: usize) -> f64 {
    let [a, b, c] = mesh.corners(t);
    let minus = |p: [f64; 3], q: [f64; 3]| [0, 1, 2].map(|k| p[k] - q[k]);
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let (u, v) = (minus(b, a), minus(c, a));
    let normal = [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ];
    let longest = length(u).max(length(v)).max(length(minus(c, b)));
    length(normal) / longest
}
