//! Triangles of an STL file, text or binary.

use super::check::within_budget;
use super::error::MeshError;
use super::tri_mesh::{TriMesh, index};
use std::io::Cursor;

/// Bytes before the first triangle of a binary STL: a free header and the number of triangles.
const HEADER: usize = 84;
/// Bytes of a triangle: normal, three corners (f32), an attribute word.
const TRIANGLE: usize = 50;

/// All triangles of the file, in its unit; each has corners of its own. The normals of the file are not used.
///
/// A file whose length is the one its header promises is binary, also when the header starts with `solid`, as those of
/// some exporters do.
pub(super) fn stl_mesh(bytes: &[u8], file: &str) -> Result<TriMesh, MeshError> {
    let malformed = |reason: String| MeshError::Malformed {
        file: file.to_owned(),
        reason,
    };
    let declared = bytes
        .get(HEADER - 4..HEADER)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let length = declared.map(|n| HEADER as u64 + TRIANGLE as u64 * u64::from(n));
    if length == Some(bytes.len() as u64) {
        within_budget(0, (bytes.len() - HEADER) / TRIANGLE, file)?;
        let mut binary = bytes.to_vec();
        // the reader takes every header that starts with `solid` for text
        binary[..5].fill(0);
        return triangles(binary, file);
    }
    if is_text(bytes) {
        let text = spts_input::text(bytes).map_err(|e| malformed(e.to_string()))?;
        return triangles(plain_text(text, file)?.into_bytes(), file);
    }
    Err(malformed(match (declared, length) {
        (Some(n), Some(length)) => {
            let found = bytes.len() as u64;
            let what = match found.checked_sub(length) {
                Some(more) => format!("{more} bytes too many: something was appended, or it is not STL"),
                None => "truncated, or not STL".to_owned(),
            };
            format!("header declares {n} triangles = {length} bytes, the file has {found} ({what})")
        }
        _ => format!("{} bytes, the header of a binary STL has {HEADER}", bytes.len()),
    }))
}

/// Whether the file starts like a text STL and has no zero byte, which a binary one always has.
fn is_text(bytes: &[u8]) -> bool {
    let start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    start.get(..5).is_some_and(|w| w.eq_ignore_ascii_case(b"solid")) && !bytes.contains(&0)
}

/// The text as the reader wants it: one solid, lower case, no normals (some exporters write `nan` for those of
/// triangles without area). Several solids become one. Finds coordinates that are not finite, and a missing end.
fn plain_text(text: &str, file: &str) -> Result<String, MeshError> {
    let mut out = String::with_capacity(text.len());
    out.push_str("solid x\n");
    let (mut vertex, mut facets, mut ended) = (0, 0, false);
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let Some(first) = words.next() else { continue };
        match first.to_ascii_lowercase().as_str() {
            "solid" => ended = false,
            "endsolid" => ended = true,
            "facet" => {
                facets += 1;
                within_budget(vertex, facets, file)?;
                out.push_str("facet normal 0 0 0\n");
            }
            "vertex" => {
                out.push_str("vertex");
                for (axis, word) in ['x', 'y', 'z', '?'].into_iter().zip(words) {
                    if let Some(value) = word.parse::<f64>().ok().filter(|x| !x.is_finite()) {
                        return Err(MeshError::NotFinite {
                            file: file.to_owned(),
                            vertex,
                            axis,
                            value,
                        });
                    }
                    out.push(' ');
                    out.push_str(word);
                }
                out.push('\n');
                vertex += 1;
                within_budget(vertex, facets, file)?;
            }
            other => {
                out.push_str(other);
                for word in words {
                    out.push(' ');
                    out.push_str(&word.to_ascii_lowercase());
                }
                out.push('\n');
            }
        }
    }
    if !ended {
        return Err(MeshError::Malformed {
            file: file.to_owned(),
            reason: "does not end with `endsolid` (truncated?)".to_owned(),
        });
    }
    out.push_str("endsolid x\n");
    Ok(out)
}

fn triangles(bytes: Vec<u8>, file: &str) -> Result<TriMesh, MeshError> {
    let mut mesh = TriMesh::default();
    let mut cursor = Cursor::new(bytes);
    let broken = |triangle: usize, e: &std::io::Error| MeshError::Malformed {
        file: file.to_owned(),
        reason: format!("triangle {triangle}: {e}"),
    };
    let reader = stl_io::create_stl_reader(&mut cursor).map_err(|e| broken(0, &e))?;
    for (t, triangle) in reader.enumerate() {
        let triangle = triangle.map_err(|e| broken(t, &e))?;
        let base = index(mesh.vertices.len());
        mesh.vertices
            .extend(triangle.vertices.iter().map(|v| v.0.map(f64::from)));
        mesh.triangles.push([0, 1, 2].map(|k| base.saturating_add(k)));
    }
    Ok(mesh)
}
