//! Reading meshes from files.

use super::check::{checked, within_budget};
use super::error::MeshError;
use super::glb::glb_mesh;
use super::report::MeshReport;
use super::size::MAX_FILE_BYTES;
use super::stl::stl_mesh;
use super::tri_mesh::{TriMesh, index};
use std::path::Path;

/// A reader of one format: bytes, scale, name for errors.
type Reader = fn(&[u8], f64, &str) -> Result<(TriMesh, MeshReport), MeshError>;

/// Reads an OBJ, GLB or STL file, scales it to metres, and checks and repairs it with [`checked`]. `scale` is the
/// number of metres in a unit of the file: 1 for GLB, whose unit is the metre; 1e-3 for a file in millimetres, which is
/// common for OBJ and STL. Axes stay as in the file; in GLB, node transforms are applied. Polygons become triangle
/// fans; materials, normals and textures are ignored.
///
/// ```
/// use spts_contact::mesh::{cuboid, load};
/// let path = std::env::temp_dir().join(format!("spts-doc-{}.obj", std::process::id()));
/// std::fs::write(&path, cuboid([20.0, 30.0, 40.0]).to_obj("block"))?;
/// let (mesh, report) = load(&path, 1e-3)?;
/// assert_eq!((mesh.triangles.len(), report.flipped), (12, false));
/// # std::fs::remove_file(&path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`MeshError`] if the file cannot be read, is not OBJ, GLB or STL, or fails a check.
pub fn load(path: &Path, scale: f64) -> Result<(TriMesh, MeshReport), MeshError> {
    let file = path.display().to_string();
    let extension = path
        .extension()
        .and_then(|e| e.to_str())
        .unwrap_or("")
        .to_ascii_lowercase();
    let read: Reader = match extension.as_str() {
        "obj" => read_obj,
        "glb" => read_glb,
        "stl" => read_stl,
        _ => return Err(MeshError::UnknownExtension { file, extension }),
    };
    let bytes = spts_input::read(path, MAX_FILE_BYTES).map_err(|e| MeshError::Unreadable {
        file: file.clone(),
        reason: e.to_string(),
    })?;
    read(&bytes, scale, &file)
}

/// As [`load`], from the bytes of an OBJ file. `file` is the name in errors.
///
/// # Errors
/// As [`load`].
pub fn read_obj(bytes: &[u8], scale: f64, file: &str) -> Result<(TriMesh, MeshReport), MeshError> {
    let malformed = |reason: String| MeshError::Malformed {
        file: file.to_owned(),
        reason,
    };
    let text = spts_input::text(bytes).map_err(|e| malformed(e.to_string()))?;
    let geometry = obj_geometry(text, file)?;
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_lines: true,
        ignore_points: true,
        ..tobj::LoadOptions::default()
    };
    let no_materials = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) =
        tobj::load_obj_buf(&mut geometry.as_bytes(), &options, no_materials).map_err(|e| malformed(e.to_string()))?;
    let mut raw = TriMesh::default();
    for model in models {
        let base = index(raw.vertices.len());
        let positions = model.mesh.positions.chunks_exact(3);
        raw.vertices
            .extend(positions.map(|p| [p[0], p[1], p[2]].map(f64::from)));
        let corners = model.mesh.indices.chunks_exact(3);
        raw.triangles
            .extend(corners.map(|t| [t[0], t[1], t[2]].map(|i| i.saturating_add(base))));
    }
    checked(&raw, scale, file)
}

/// The `v` and `f` lines of an OBJ, with only the position index of each corner. Finds what the reader would not
/// report by number: a coordinate that is not finite, an index out of range.
fn obj_geometry(text: &str, file: &str) -> Result<String, MeshError> {
    // counted first: a face may name vertices that only follow later
    let all = text
        .lines()
        .filter(|l| l.split_whitespace().next() == Some("v"))
        .count();
    within_budget(all, 0, file)?;
    let mut out = String::with_capacity(text.len());
    let (mut vertices, mut triangle) = (0_usize, 0_usize);
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                for (axis, word) in ['x', 'y', 'z'].into_iter().zip(words.clone()) {
                    if let Some(value) = word.parse::<f64>().ok().filter(|x| !x.is_finite()) {
                        return Err(MeshError::NotFinite {
                            file: file.to_owned(),
                            vertex: vertices,
                            axis,
                            value,
                        });
                    }
                }
                vertices += 1;
                out.push('v');
                words
                    .take(3)
                    .for_each(|w| [" ", w].into_iter().for_each(|s| out.push_str(s)));
                out.push('\n');
            }
            Some("f") => {
                within_budget(all, triangle + words.clone().count().saturating_sub(2), file)?;
                let corners: Vec<&str> = words.map(|w| w.split('/').next().unwrap_or(w)).collect();
                for corner in &corners {
                    check_obj_index(corner, vertices, all, triangle, file)?;
                }
                if corners.len() >= 3 {
                    out.push_str("f ");
                    out.push_str(&corners.join(" "));
                    out.push('\n');
                    triangle += corners.len() - 2;
                }
            }
            _ => {}
        }
    }
    Ok(out)
}

/// OBJ counts from 1, or backwards from −1 for the last vertex so far; `seen` of `all` vertices precede the face.
fn check_obj_index(word: &str, seen: usize, all: usize, triangle: usize, file: &str) -> Result<(), MeshError> {
    // what is not a number is reported by the parser
    let Ok(i) = word.parse::<i64>() else { return Ok(()) };
    let limit = |n: usize| i64::try_from(n).unwrap_or(i64::MAX);
    if (1..=limit(all)).contains(&i) || (-limit(seen)..=-1).contains(&i) {
        return Ok(());
    }
    Err(MeshError::Malformed {
        file: file.to_owned(),
        reason: format!("triangle {triangle} uses vertex {i}, outside [1, {all}] or [-{seen}, -1]"),
    })
}

/// As [`load`], from the bytes of a GLB file. `file` is the name in errors.
///
/// # Errors
/// As [`load`].
pub fn read_glb(bytes: &[u8], scale: f64, file: &str) -> Result<(TriMesh, MeshReport), MeshError> {
    checked(&glb_mesh(bytes, file)?, scale, file)
}

/// As [`load`], from the bytes of an STL file, text or binary. `file` is the name in errors.
///
/// # Errors
/// As [`load`].
pub fn read_stl(bytes: &[u8], scale: f64, file: &str) -> Result<(TriMesh, MeshReport), MeshError> {
    let (mesh, mut report) = checked(&stl_mesh(bytes, file)?, scale, file)?;
    // nothing was wrong: the format has no shared corners
    report.joined_vertices = 0;
    Ok((mesh, report))
}
