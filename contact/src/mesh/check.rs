//! Checks every mesh from outside: repairs what is safe to repair, and refuses the rest with the reason.

use super::error::MeshError;
use super::holes::{Closed, Hole, close_holes};
use super::orient::{Disagreement, agree, turn_outward};
use super::report::MeshReport;
use super::sides::{Sides, balance};
use super::size::{MAX_COORDINATE_M, MAX_EXTENT_M, MAX_TRIANGLES, MAX_VERTICES, MIN_EXTENT_M, SOFT_MAX_TRIANGLES};
use super::tri_mesh::TriMesh;

/// Vertices closer than this fraction of the extent are one vertex. f32 files carry 6e-8 of rounding per coordinate;
/// 1e-6 is 10× what two roundings of one point can differ by, and a thousandth of the finest feature that matters.
const WELD_FRACTION: f64 = 1e-6;
/// Least volume as a fraction of extent³; a sheet of paper (0.1 mm × 210 mm × 297 mm) has 2.4e-4, a folded surface
/// without inside has rounding, about 1e-7.
const LEAST_VOLUME_FRACTION: f64 = 1e-6;

/// Scales `raw` to metres, repairs and checks it (1 mm to 2 m across, closed, with an inside), and decimates it if it
/// has more than [`SOFT_MAX_TRIANGLES`] triangles. `file` is the name in errors.
///
/// Repairs: coinciding vertices are joined. Degenerate and duplicate triangles are dropped. Triangles that face against
/// their neighbours and parts that are inside out are turned (a cavity is not inside out). Small holes are filled flat.
/// Holes that open upwards are closed above everything, which leaves the underside unchanged. Parts may overlap: only
/// the underside of their union touches.
///
/// These are refused: coordinates that are not finite, other sizes, larger holes that open downwards or sideways,
/// surfaces with branches or with one side, and surfaces without an inside.
///
/// The unit is never guessed: an object 40 units wide may be 40 mm, 40 cm or 40 inches wide, and each of these could
/// press on a skin. The error suggests a scale that would fit.
///
/// # Errors
/// [`MeshError`] with the first problem.
pub fn checked(raw: &TriMesh, scale: f64, file: &str) -> Result<(TriMesh, MeshReport), MeshError> {
    check_numbers(raw, scale, file)?;
    let raw_extent = used_extent(raw);
    // vertices of a mesh far too small all coincide, which would hide that its scale is wrong
    if raw_extent > 0.0 && raw_extent * scale < MIN_EXTENT_M {
        return Err(far_from_metres(raw_extent * scale, raw_extent, scale, file));
    }
    let tolerance_m = WELD_FRACTION * raw_extent * scale;
    let (mesh, joined_vertices, dropped_triangles) = raw.clone().scaled([scale; 3]).welded(tolerance_m);
    let (mut mesh, duplicate_triangles) = mesh.without_duplicates();
    if mesh.triangles.is_empty() {
        return Err(MeshError::NoTriangles {
            file: file.to_owned(),
            dropped: dropped_triangles + duplicate_triangles,
        });
    }
    let extent_m = mesh.extent_m();
    if !fits(extent_m) {
        return Err(far_from_metres(extent_m, extent_m / scale, scale, file));
    }
    let mended = mend(&mut mesh).map_err(|broken| broken.error(scale, file))?;
    let volume_m3 = mesh.volume_m3();
    let least_m3 = LEAST_VOLUME_FRACTION * mesh.extent_m().powi(3);
    if volume_m3 < least_m3 {
        return Err(MeshError::NoVolume {
            file: file.to_owned(),
            volume_m3,
            least_m3,
        });
    }
    let mut report = MeshReport {
        joined_vertices,
        dropped_triangles,
        duplicate_triangles,
        ..mended
    };
    if mesh.triangles.len() > SOFT_MAX_TRIANGLES
        && let Some((fewer, error_m)) = mesh.decimated()
    {
        report.decimated_from = Some(mesh.triangles.len());
        report.decimation_error_m = Some(error_m);
        mesh = fewer;
    }
    let (low, high) = mesh.bounds().unwrap_or_default();
    report.vertices = mesh.vertices.len();
    report.triangles = mesh.triangles.len();
    report.heavy = mesh.triangles.len() > SOFT_MAX_TRIANGLES;
    report.extent_m = [0, 1, 2].map(|k| high[k] - low[k]);
    report.middle_m = [0, 1, 2].map(|k| 0.5 * (low[k] + high[k]));
    report.volume_m3 = mesh.volume_m3();
    Ok((mesh, report))
}

/// Why a surface could not be mended.
enum Broken {
    Disagreement(Disagreement),
    Hole { hole: Hole, edges: usize },
}

impl Broken {
    /// The error, with places in the unit of the file.
    fn error(self, scale: f64, file: &str) -> MeshError {
        let file = file.to_owned();
        let place = |at_m: [f64; 3]| at_m.map(|x| x / scale);
        match self {
            Self::Disagreement(Disagreement::Branching { at_m, triangles }) => MeshError::Branching {
                file,
                at: place(at_m),
                triangles,
            },
            Self::Disagreement(Disagreement::OneSided { at_m }) => MeshError::OneSided { file, at: place(at_m) },
            Self::Hole { hole, edges } => MeshError::NotClosed {
                file,
                open_edges: hole.open_edges,
                edges,
                at: place(hole.at_m),
                why: hole.why,
            },
        }
    }
}

/// Makes the triangles agree, closes what may be closed and turns the parts outward. Reports what it did.
fn mend(mesh: &mut TriMesh) -> Result<MeshReport, Broken> {
    let sides = Sides::of(mesh);
    let (mut parts, turned_triangles) = agree(mesh, &sides).map_err(Broken::Disagreement)?;
    let sides = if turned_triangles > 0 { Sides::of(mesh) } else { sides };
    let branches = sides.edges().any(|edge| edge.len() > 2);
    let closed = close_holes(mesh, &sides).map_err(|hole| Broken::Hole {
        hole,
        edges: sides.edges().count(),
    })?;
    if closed != Closed::default() {
        (parts, _) = agree(mesh, &Sides::of(mesh)).map_err(Broken::Disagreement)?;
    }
    let flipped = turn_outward(mesh, &parts) > 0;
    // edges of two triangles agree by now; those of four and more have not been looked at
    let sides = (branches || closed != Closed::default()).then(|| Sides::of(mesh));
    let unbalanced = |sides: &Sides| sides.edges().find(|edge| balance(edge) != 0).map(<[_]>::to_vec);
    if let Some(edge) = sides.as_ref().and_then(unbalanced) {
        let at_m = mesh.middle_m(edge[0].edge);
        let triangles = edge.len();
        return Err(Broken::Disagreement(Disagreement::Branching { at_m, triangles }));
    }
    Ok(MeshReport {
        turned_triangles,
        flipped,
        filled_holes: closed.filled,
        lids: closed.lids,
        ..MeshReport::default()
    })
}

/// Finite coordinates, indices in range, a scale that can be used.
fn check_numbers(raw: &TriMesh, scale: f64, file: &str) -> Result<(), MeshError> {
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
    let (vertices, triangles) = (raw.vertices.len(), raw.triangles.len());
    within_budget(vertices, triangles, file)?;
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
        // only those of triangles: a stray vertex does no harm
        for &i in t {
            let vertex = i as usize;
            for (axis, value) in ['x', 'y', 'z'].into_iter().zip(raw.vertices[vertex]) {
                let metres = value * scale;
                if metres.abs() > MAX_COORDINATE_M {
                    let file = name();
                    return Err(MeshError::FarAway {
                        file,
                        vertex,
                        axis,
                        value,
                        metres,
                    });
                }
            }
        }
    }
    Ok(())
}

/// Refuses a mesh of more `vertices` or `triangles` than can be repaired in the memory of a small machine. Readers ask
/// before they make room for them.
pub(super) fn within_budget(vertices: usize, triangles: usize, file: &str) -> Result<(), MeshError> {
    let counts = [
        ("number of triangles", triangles, MAX_TRIANGLES),
        ("number of vertices", vertices, MAX_VERTICES),
    ];
    match counts.into_iter().find(|(_, found, most)| found > most) {
        None => Ok(()),
        Some((what, found, most)) => Err(MeshError::TooLarge {
            file: file.to_owned(),
            what,
            found,
            most,
        }),
    }
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

/// Whether something of this extent may press on a skin.
fn fits(extent_m: f64) -> bool {
    (MIN_EXTENT_M..=MAX_EXTENT_M).contains(&extent_m)
}

/// The error for a mesh of the wrong size, `raw_extent` in the unit of the file, with the first usual unit that fits.
fn far_from_metres(extent_m: f64, raw_extent: f64, scale: f64, file: &str) -> MeshError {
    let units = [
        ("metres", 1.0),
        ("millimetres", 1e-3),
        ("centimetres", 1e-2),
        ("inches", 25.4e-3),
        ("micrometres", 1e-6),
    ];
    MeshError::FarFromMetres {
        file: file.to_owned(),
        extent_m,
        scale,
        suggestion: units.into_iter().find(|&(_, s)| fits(raw_extent * s)),
    }
}
