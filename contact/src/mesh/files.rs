//! Reads OBJ, GLB and STL files; writes OBJ and GLB.

use super::check::{
    MeshError, MeshReport, checked, malformed, not_finite, out_of_range, refused, too_large, within_budget,
};
use super::tri_mesh::{MAX_FILE_BYTES, TriMesh, index};
use gltf::accessor::{DataType, Dimensions};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};
use nalgebra::Matrix4;
use std::fmt::{Display, Write as _};
use std::io::Cursor;
use std::path::Path;

/// The error of a file that is valid but uses what is not read here.
fn unsupported(file: &str, feature: impl Display) -> MeshError {
    refused(
        file,
        format_args!("{feature} is not supported; export plain indexed triangles"),
    )
}

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
        _ => return Err(unknown_extension(&file, &extension)),
    };
    let bytes =
        spts_input::read(path, MAX_FILE_BYTES).map_err(|e| refused(&file, format_args!("cannot be read: {e}")))?;
    read(&bytes, scale, &file)
}

/// The error of a mesh file of no known kind.
#[must_use]
pub fn unknown_extension(file: &str, extension: &str) -> MeshError {
    refused(
        file,
        format_args!("extension `{extension}` is not one of obj, glb, stl"),
    )
}

/// As [`load`], from the bytes of an OBJ file. `file` is the name in errors.
///
/// # Errors
/// As [`load`].
pub fn read_obj(bytes: &[u8], scale: f64, file: &str) -> Result<(TriMesh, MeshReport), MeshError> {
    let malformed = |why: String| malformed(file, why);
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
                        return Err(not_finite(file, vertices, axis, value));
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
    let why = format!("triangle {triangle} uses vertex {i}, outside [1, {all}] or [-{seen}, -1]");
    Err(malformed(file, why))
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

// Triangles of a GLB file, node transforms applied.

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
    let malformed = |why: String| malformed(file, why);
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
        let found = u32::from_le_bytes([a, b, c, d]) as usize;
        return Err(too_large(file, "bytes of the JSON chunk", found, MAX_JSON_BYTES));
    }
    let gltf = gltf::Gltf::from_slice_without_validation(bytes).map_err(|e| malformed(e.to_string()))?;
    let root = gltf.document.as_json();
    if let Some(extension) = root.extensions_required.first() {
        return Err(unsupported(file, format_args!("extension {extension}")));
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
        return Err(unsupported(file, format_args!("primitive mode {:?}", primitive.mode())));
    }
    let Some(accessor) = primitive.get(&gltf::Semantic::Positions) else {
        return Err(malformed(file, "a primitive lacks POSITION"));
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
        let why = format!("{} indices are not a multiple of 3", corners.len());
        return Err(malformed(file, why));
    }
    if let Some(k) = corners.iter().position(|&i| i as usize >= points.len()) {
        return Err(out_of_range(file, k / 3, corners[k], points.len()));
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

// Bounds-checked access to the numbers of a GLB file.

/// Start, stride and count of an accessor's elements of `size` bytes inside `blob`, or why it does not fit.
fn elements<'b>(
    accessor: &gltf::Accessor<'_>,
    blob: &'b [u8],
    size: usize,
    file: &str,
) -> Result<impl Iterator<Item = &'b [u8]> + use<'b>, MeshError> {
    let outside = || {
        let (index, count, bytes) = (accessor.index(), accessor.count(), blob.len());
        let why = format!(
            "accessor {index} ({count} elements of {size} bytes) reaches outside the {bytes} bytes of the BIN chunk"
        );
        malformed(file, why)
    };
    let unsupported = |feature: &str| unsupported(file, feature);
    if accessor.sparse().is_some() {
        return Err(unsupported("a sparse accessor"));
    }
    let view = accessor
        .view()
        .ok_or_else(|| unsupported("an accessor without buffer view"))?;
    if !matches!(view.buffer().source(), gltf::buffer::Source::Bin) {
        return Err(unsupported("a buffer outside the file"));
    }
    let stride = view.stride().unwrap_or(size);
    let count = accessor.count();
    let view_end = view.offset().checked_add(view.length()).ok_or_else(outside)?;
    let data = blob.get(view.offset()..view_end).ok_or_else(outside)?;
    let data = data.get(accessor.offset()..).ok_or_else(outside)?;
    let end = count
        .saturating_sub(1)
        .checked_mul(stride)
        .and_then(|last| last.checked_add(size))
        .ok_or_else(outside)?;
    if stride < size || (count > 0 && end > data.len()) {
        return Err(outside());
    }
    Ok((0..count).map(move |i| &data[i * stride..i * stride + size]))
}

/// Vertex positions: three f32 each.
pub(super) fn positions(accessor: &gltf::Accessor<'_>, blob: &[u8], file: &str) -> Result<Vec<[f32; 3]>, MeshError> {
    if (accessor.data_type(), accessor.dimensions()) != (DataType::F32, Dimensions::Vec3) {
        return Err(wrong_type(accessor, "three f32", file));
    }
    let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    Ok(elements(accessor, blob, 12, file)?
        .map(|b| [number(&b[..4]), number(&b[4..8]), number(&b[8..])])
        .collect())
}

/// Corner indices: unsigned 8, 16 or 32 bits.
pub(super) fn indices(accessor: &gltf::Accessor<'_>, blob: &[u8], file: &str) -> Result<Vec<u32>, MeshError> {
    let size = match (accessor.data_type(), accessor.dimensions()) {
        (DataType::U8, Dimensions::Scalar) => 1,
        (DataType::U16, Dimensions::Scalar) => 2,
        (DataType::U32, Dimensions::Scalar) => 4,
        _ => return Err(wrong_type(accessor, "one u8, u16 or u32", file)),
    };
    let number = |b: &[u8]| b.iter().rev().fold(0_u32, |n, &byte| n << 8 | u32::from(byte));
    Ok(elements(accessor, blob, size, file)?.map(number).collect())
}

fn wrong_type(accessor: &gltf::Accessor<'_>, expected: &str, file: &str) -> MeshError {
    let (index, dimensions, kind) = (accessor.index(), accessor.dimensions(), accessor.data_type());
    malformed(
        file,
        format_args!("accessor {index} holds {dimensions:?} {kind:?}, {expected} expected"),
    )
}

// Checks that every reference in a GLB file that the mesh reader follows is valid.
//
// The validation of the `gltf` crate (version 1.4.1) indexes before it checks, so a damaged file could end the
// process. This check runs in its place.

/// First reference or enumeration of `root` that is wrong, in words.
pub(super) fn broken_reference(root: &Root) -> Option<String> {
    let nodes = root.scenes.iter().flat_map(|s| &s.nodes);
    let children = root.nodes.iter().filter_map(|n| n.children.as_ref()).flatten();
    let scene = root.scene.iter().map(|i| ("scene", i.value(), root.scenes.len()));
    let nodes = nodes.chain(children).map(|i| ("node", i.value(), root.nodes.len()));
    let meshes = root.nodes.iter().filter_map(|n| n.mesh);
    let meshes = meshes.map(|i| ("mesh", i.value(), root.meshes.len()));
    let views = root.accessors.iter().filter_map(|a| a.buffer_view);
    let views = views.map(|i| ("buffer view", i.value(), root.buffer_views.len()));
    let buffers = root.buffer_views.iter();
    let buffers = buffers.map(|v| ("buffer", v.buffer.value(), root.buffers.len()));
    let mut indices = scene.chain(nodes).chain(meshes).chain(views).chain(buffers);
    let outside = |(what, i, n): (&str, usize, usize)| (i >= n).then(|| format!("{what} {i} is outside [0, {n})"));
    let unreadable = || root.accessors.iter().position(|a| !is_readable(a));
    let mut primitives = root.meshes.iter().flat_map(|m| &m.primitives);
    indices
        .find_map(outside)
        .or_else(|| primitives.find_map(|p| broken_primitive(root, p)))
        .or_else(|| unreadable().map(|i| format!("accessor {i} has an unknown type")))
}

fn broken_primitive(root: &Root, primitive: &gltf::json::mesh::Primitive) -> Option<String> {
    let n = root.accessors.len();
    let outside = |i: &Index<gltf::json::Accessor>| {
        (i.value() >= n).then(|| format!("accessor {} is outside [0, {n})", i.value()))
    };
    if matches!(primitive.mode, Checked::Invalid) {
        return Some("a primitive has an unknown mode".to_owned());
    }
    primitive
        .attributes
        .get(&Checked::Valid(gltf::Semantic::Positions))
        .and_then(outside)
        .or_else(|| primitive.indices.as_ref().and_then(outside))
}

fn is_readable(accessor: &gltf::json::Accessor) -> bool {
    matches!(accessor.component_type, Checked::Valid(_)) && matches!(accessor.type_, Checked::Valid(_))
}

// Triangles of an STL file, text or binary.

/// Bytes before the first triangle of a binary STL: a free header and the number of triangles.
const HEADER: usize = 84;
/// Bytes of a triangle: normal, three corners (f32), an attribute word.
const TRIANGLE: usize = 50;

/// All triangles of the file, in its unit; each has corners of its own. The normals of the file are not used.
///
/// A file whose length is the one its header promises is binary, also when the header starts with `solid`, as those of
/// some exporters do.
pub(super) fn stl_mesh(bytes: &[u8], file: &str) -> Result<TriMesh, MeshError> {
    let malformed = |why: String| malformed(file, why);
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
                        return Err(not_finite(file, vertex, axis, value));
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
        return Err(malformed(file, "does not end with `endsolid` (truncated?)"));
    }
    out.push_str("endsolid x\n");
    Ok(out)
}

fn triangles(bytes: Vec<u8>, file: &str) -> Result<TriMesh, MeshError> {
    let mut mesh = TriMesh::default();
    let mut cursor = Cursor::new(bytes);
    let broken = |triangle: usize, e: &std::io::Error| malformed(file, format_args!("triangle {triangle}: {e}"));
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

// Writers: OBJ text, GLB.

/// Nearest f32, the precision of GLB: 4 nm on a 60 mm object.
#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is the file's precision")]
fn f32_of(v: [f64; 3]) -> [f32; 3] {
    v.map(|x| x as f32)
}

impl TriMesh {
    /// Wavefront OBJ text: positions in metres with 9 decimals (1 nm), triangles 1-based, `name` as the object's name.
    #[must_use]
    pub fn to_obj(&self, name: &str) -> String {
        let mut out = format!("# metres; contact face towards -z\no {name}\n");
        for v in &self.vertices {
            // + 0.0 turns a negative zero positive
            let [x, y, z] = v.map(|c| (c * 1e9).round() / 1e9 + 0.0);
            let _ = writeln!(out, "v {x:.9} {y:.9} {z:.9}");
        }
        for t in &self.triangles {
            let [a, b, c] = t.map(|i| u64::from(i) + 1);
            let _ = writeln!(out, "f {a} {b} {c}");
        }
        out
    }

    /// glTF 2.0 binary: one mesh in one node, positions (f32, m) and 32-bit indices.
    ///
    /// Source: Khronos, *glTF 2.0 Specification*, §4.4 (GLB layout), §3.6.2 (accessors).
    #[must_use]
    pub fn to_glb(&self, name: &str) -> Vec<u8> {
        let positions: Vec<[f32; 3]> = self.vertices.iter().map(|&v| f32_of(v)).collect();
        let (mut low, mut high) = ([0.0_f32; 3], [0.0_f32; 3]);
        if let Some(&first) = positions.first() {
            (low, high) = (first, first);
        }
        for p in &positions {
            for k in 0..3 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let mut bin: Vec<u8> = positions.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let position_bytes = bin.len();
        bin.extend(self.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()));
        let index_bytes = bin.len() - position_bytes;
        let name: String = name
            .chars()
            .filter(|c| c.is_ascii_alphanumeric() || "-_. ".contains(*c))
            .collect();
        let mut json = format!(
            concat!(
                r#"{{"asset":{{"version":"2.0","generator":"spts-sim"}},"scene":0,"scenes":[{{"nodes":[0]}}],"#,
                r#""nodes":[{{"name":"{name}","mesh":0}}],"#,
                r#""meshes":[{{"name":"{name}","primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],"#,
                r#""accessors":[{{"bufferView":0,"componentType":5126,"count":{vertices},"type":"VEC3","min":{low:?},"max":{high:?}}},"#,
                r#"{{"bufferView":1,"componentType":5125,"count":{indices},"type":"SCALAR"}}],"#,
                r#""bufferViews":[{{"buffer":0,"byteLength":{position_bytes},"target":34962}},"#,
                r#"{{"buffer":0,"byteOffset":{position_bytes},"byteLength":{index_bytes},"target":34963}}],"#,
                r#""buffers":[{{"byteLength":{bytes}}}]}}"#
            ),
            name = name,
            vertices = positions.len(),
            indices = self.triangles.len() * 3,
            low = low,
            high = high,
            position_bytes = position_bytes,
            index_bytes = index_bytes,
            bytes = bin.len(),
        )
        .into_bytes();
        while json.len() % 4 != 0 {
            json.push(b' ');
        }
        let mut out = Vec::with_capacity(28 + json.len() + bin.len());
        out.extend(b"glTF");
        out.extend(2_u32.to_le_bytes());
        out.extend(index(28 + json.len() + bin.len()).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &bin)] {
            out.extend(index(chunk.len()).to_le_bytes());
            out.extend(kind);
            out.extend(chunk);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use crate::mesh::{TriMesh, cuboid};

    #[test]
    fn glb_is_read_by_the_gltf_crate() {
        let block = cuboid([0.02, 0.03, 0.04]);
        let (document, buffers, _) = gltf::import_slice(block.to_glb("block \"quoted\"")).unwrap();
        let primitive = document.meshes().next().unwrap().primitives().next().unwrap();
        let reader = primitive.reader(|b| Some(&buffers[b.index()]));
        assert_eq!(reader.read_positions().unwrap().count(), 8);
        assert_eq!(reader.read_indices().unwrap().into_u32().max(), Some(7));
        let high = primitive.bounding_box().max;
        assert!(
            (high[0] - 0.01).abs() < 1e-9 && (high[2] - 0.04).abs() < 1e-8,
            "{high:?}"
        );
    }

    #[test]
    fn obj_has_no_negative_zero() {
        let mesh = TriMesh {
            vertices: vec![[-1e-12, 0.0, 0.0]],
            triangles: vec![],
        };
        assert!(!mesh.to_obj("x").contains("-0.0"));
    }
}
