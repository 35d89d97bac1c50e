//! Triangles of a GLB file, node transforms applied.

use super::check::within_budget;
use super::error::MeshError;
use super::glb_check::broken_reference;
use super::glb_view::{indices, positions};
use super::tri_mesh::{TriMesh, index};
use nalgebra::Matrix4;

/// Deepest chain of nodes that is followed; real files have a handful, a cyclic one never ends.
const MAX_DEPTH: usize = 64;
/// Most visits of nodes and of their primitives: a node that many parents share is visited once for each.
const MAX_VISITS: usize = 100_000;
/// Largest description (the JSON chunk) that is read, bytes: parsed, it takes up to 200 times its size, and those of
/// models of many parts have some 100 kB.
const MAX_JSON_BYTES: usize = 1 << 21;
/// Bytes of the file's header, and of that of its first chunk, which begins with the chunk's length.
const HEADERS: std::ops::Range<usize> = 12..16;

/// All triangles of the default scene (or of the first, or of every root node when there is none), in the file's unit.
pub(super) fn glb_mesh(bytes: &[u8], file: &str) -> Result<TriMesh, MeshError> {
    let malformed = |reason: String| MeshError::Malformed {
        file: file.to_owned(),
        reason,
    };
    let declared = bytes.get(8..12).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    match declared {
        None => return Err(malformed(format!("{} bytes, a GLB header has 12", bytes.len()))),
        Some(length) if (length as usize) < 12 || length as usize > bytes.len() => {
            return Err(malformed(format!(
                "header declares {length} bytes, the file has {}",
                bytes.len()
            )));
        }
        Some(_) => {}
    }
    if &bytes[..4] != b"glTF" {
        return Err(malformed("does not start with the bytes `glTF`".to_owned()));
    }
    if let Some(&[a, b, c, d]) = bytes.get(HEADERS)
        && u32::from_le_bytes([a, b, c, d]) as usize > MAX_JSON_BYTES
    {
        return Err(MeshError::TooLarge {
            file: file.to_owned(),
            what: "bytes of the JSON chunk",
            found: u32::from_le_bytes([a, b, c, d]) as usize,
            most: MAX_JSON_BYTES,
        });
    }
    let gltf = gltf::Gltf::from_slice_without_validation(bytes).map_err(|e| malformed(e.to_string()))?;
    let root = gltf.document.as_json();
    if let Some(extension) = root.extensions_required.first() {
        let feature = format!("extension {extension}");
        return Err(MeshError::Unsupported {
            file: file.to_owned(),
            feature,
        });
    }
    if let Some(reason) = broken_reference(root) {
        return Err(malformed(reason));
    }
    let blob = gltf.blob.as_deref().unwrap_or(&[]);
    let scene = gltf.default_scene().or_else(|| gltf.scenes().next());
    let roots: Vec<gltf::Node<'_>> = scene.map_or_else(|| gltf.nodes().collect(), |s| s.nodes().collect());
    let mut visits = roots.len();
    let mut stack: Vec<(gltf::Node<'_>, Matrix4<f64>, usize)> =
        roots.into_iter().map(|node| (node, Matrix4::identity(), 0)).collect();
    let mut raw = TriMesh::default();
    while let Some((node, parent, depth)) = stack.pop() {
        // counted before they are visited, so that nothing is kept of more than are allowed
        visits += node.children().len() + node.mesh().map_or(0, |mesh| mesh.primitives().len());
        if depth > MAX_DEPTH || visits > MAX_VISITS {
            return Err(malformed(format!(
                "node {} is more than {MAX_DEPTH} deep, or {visits} nodes and primitives are visited of at most \
                 {MAX_VISITS}: the node tree is cyclic, or its nodes are shared too often",
                node.index()
            )));
        }
        // column-major, as nalgebra stores it
        let local = Matrix4::from_fn(|r, c| f64::from(node.transform().matrix()[c][r]));
        let world = parent * local;
        if let Some(mesh) = node.mesh() {
            for primitive in mesh.primitives() {
                append(&mut raw, &primitive, blob, &world, file)?;
            }
        }
        stack.extend(node.children().map(|child| (child, world, depth + 1)));
    }
    Ok(raw)
}

fn append(
    raw: &mut TriMesh,
    primitive: &gltf::Primitive<'_>,
    blob: &[u8],
    world: &Matrix4<f64>,
    file: &str,
) -> Result<(), MeshError> {
    if primitive.mode() != gltf::mesh::Mode::Triangles {
        return Err(MeshError::Unsupported {
            file: file.to_owned(),
            feature: format!("primitive mode {:?}", primitive.mode()),
        });
    }
    let Some(accessor) = primitive.get(&gltf::Semantic::Positions) else {
        return Err(MeshError::Malformed {
            file: file.to_owned(),
            reason: "a primitive lacks POSITION".to_owned(),
        });
    };
    let count = primitive.indices().map_or(accessor.count(), |indices| indices.count());
    within_budget(
        raw.vertices.len().saturating_add(accessor.count()),
        raw.triangles.len().saturating_add(count / 3),
        file,
    )?;
    let points = positions(&accessor, blob, file)?;
    let corners = match primitive.indices() {
        Some(accessor) => indices(&accessor, blob, file)?,
        None => (0..points.len()).map(index).collect(),
    };
    if corners.len() % 3 != 0 {
        return Err(MeshError::Malformed {
            file: file.to_owned(),
            reason: format!("{} indices are not a multiple of 3", corners.len()),
        });
    }
    if let Some(k) = corners.iter().position(|&i| i as usize >= points.len()) {
        return Err(MeshError::IndexOutOfRange {
            file: file.to_owned(),
            triangle: k / 3,
            index: corners[k],
            vertices: points.len(),
        });
    }
    let mirrors = world.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
    let base = index(raw.vertices.len());
    raw.vertices.extend(points.iter().map(|p| {
        let q = world * nalgebra::Vector4::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]), 1.0);
        [q.x, q.y, q.z]
    }));
    raw.triangles.extend(corners.chunks_exact(3).map(|t| {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| i.saturating_add(base));
        if mirrors { [a, c, b] } else { [a, b, c] }
    }));
    Ok(())
}
