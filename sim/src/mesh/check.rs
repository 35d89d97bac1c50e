//! The gate every foreign mesh passes: repair what is safe to repair, refuse the rest with the fact that is wrong.

use super::{MeshError, TriMesh};

/// Smallest credible extent of something that presses on a skin, m.
pub const MIN_EXTENT_M: f64 = 1e-3;
/// Largest credible extent, m.
pub const MAX_EXTENT_M: f64 = 2.0;
/// Triangles beyond this are accepted but reported: contact costs grow with them, its accuracy no longer does.
pub const SOFT_MAX_TRIANGLES: usize = 5000;

/// Vertices closer than this fraction of the extent are one vertex. f32 files carry 6e-8 of rounding per coordinate;
/// 1e-6 is 10× what two roundings of one point can differ by, and a thousandth of the finest feature that matters.
const WELD_FRACTION: f64 = 1e-6;
/// Least volume as a fraction of extent³; a sheet of paper (0.1 mm × 210 mm × 297 mm) has 2.4e-4, a folded surface
/// without inside has rounding, about 1e-7.
const LEAST_VOLUME_FRACTION: f64 = 1e-6;

/// What was repaired on the way in, and what the mesh is like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshReport {
    /// Vertices after repair.
    pub vertices: usize,
    /// Triangles after repair.
    pub triangles: usize,
    /// Vertices that coincided with another and were joined.
    pub joined_vertices: usize,
    /// Triangles without three distinct corners, dropped.
    pub dropped_triangles: usize,
    /// The mesh was inside out and has been turned.
    pub flipped: bool,
    /// More than [`SOFT_MAX_TRIANGLES`] triangles: expect slow contact.
    pub heavy: bool,
    /// Sides of the box around the mesh, m.
    pub extent_m: [f64; 3],
    /// Enclosed volume, m³.
    pub volume_m3: f64,
}

/// Scales `raw` to metres, repairs it (joins coinciding vertices, drops collapsed triangles, turns it outward) and
/// checks what is left: finite, 1 mm to 2 m across, closed, with an inside. `file` is the name the errors carry.
///
/// # Errors
/// [`MeshError`] with the first fact that is wrong.
pub fn checked(raw: &TriMesh, scale: f64, file: &str) -> Result<(TriMesh, MeshReport), MeshError> {
    let name = || file.to_owned();
    if !(scale > 0.0 && scale.is_finite()) {
        return Err(MeshError::Scale { file: name(), scale });
    }
    if raw.triangles.is_empty() {
        return Err(MeshError::NoTriangles {
            file: name(),
            dropped: 0,
        });
    }
    let vertices = raw.vertices.len();
    if u32::try_from(vertices).is_err() {
        return Err(MeshError::TooLarge { file: name(), vertices });
    }
    for (vertex, v) in raw.vertices.iter().enumerate() {
        for (axis, &value) in ['x', 'y', 'z'].into_iter().zip(v) {
            if !(value * scale).is_finite() {
                return Err(MeshError::NotFinite {
                    file: name(),
                    vertex,
                    axis,
                    value,
                });
            }
        }
    }
    for (triangle, t) in raw.triangles.iter().enumerate() {
        if let Some(&index) = t.iter().find(|&&i| i as usize >= vertices) {
            return Err(MeshError::IndexOutOfRange {
                file: name(),
                triangle,
                index,
                vertices,
            });
        }
    }
    let (mut mesh, joined_vertices, dropped_triangles) = raw
        .clone()
        .scaled([scale; 3])
        .welded(WELD_FRACTION * used_extent(raw) * scale);
    if mesh.triangles.is_empty() {
        return Err(MeshError::NoTriangles {
            file: name(),
            dropped: dropped_triangles,
        });
    }
    check_extent(mesh.extent_m(), scale, file)?;
    let open_edges = mesh.open_edges();
    if open_edges > 0 {
        return Err(MeshError::NotClosed {
            file: name(),
            open_edges,
            edges: mesh.edges(),
        });
    }
    let least_m3 = LEAST_VOLUME_FRACTION * mesh.extent_m().powi(3);
    let signed_m3 = mesh.volume_m3();
    if signed_m3.abs() < least_m3 {
        return Err(MeshError::NoVolume {
            file: name(),
            volume_m3: signed_m3,
            least_m3,
        });
    }
    let flipped = signed_m3 < 0.0;
    if flipped {
        mesh = mesh.flipped();
    }
    let (low, high) = mesh.bounds().unwrap_or_default();
    let report = MeshReport {
        vertices: mesh.vertices.len(),
        triangles: mesh.triangles.len(),
        joined_vertices,
        dropped_triangles,
        flipped,
        heavy: mesh.triangles.len() > SOFT_MAX_TRIANGLES,
        extent_m: [0, 1, 2].map(|k| high[k] - low[k]),
        volume_m3: signed_m3.abs(),
    };
    Ok((mesh, report))
}

/// Extent of the vertices that triangles use, so that a stray vertex does not set the weld distance.
fn used_extent(raw: &TriMesh) -> f64 {
    let used = TriMesh {
        vertices: raw
            .triangles
            .iter()
            .flatten()
            .map(|&i| raw.vertices[i as usize])
            .collect(),
        triangles: Vec::new(),
    };
    used.extent_m()
}

fn check_extent(extent_m: f64, scale: f64, file: &str) -> Result<(), MeshError> {
    let fits = |extent_m: f64| (MIN_EXTENT_M..=MAX_EXTENT_M).contains(&extent_m);
    if fits(extent_m) {
        return Ok(());
    }
    let raw_extent = extent_m / scale;
    let units = [
        ("metres", 1.0),
        ("millimetres", 1e-3),
        ("centimetres", 1e-2),
        ("inches", 25.4e-3),
        ("micrometres", 1e-6),
    ];
    let (unit, suggested_scale) = units
        .into_iter()
        .find(|&(_, s)| fits(raw_extent * s))
        .unwrap_or(("its own", 0.1 / raw_extent));
    Err(MeshError::FarFromMetres {
        file: file.to_owned(),
        extent_m,
        scale,
        unit,
        suggested_scale,
    })
}
