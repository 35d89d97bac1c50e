//! Reads OBJ, GLB and STL files; writes OBJ and GLB.

use super::check::{MeshError, MeshOptions, MeshReport, checked, malformed, refused, within_budget};
use super::glb::glb_mesh;
use super::obj::obj_mesh;
use super::tri_mesh::{MAX_FILE_BYTES, TriMesh, index, span};
use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::Path;

/// A reader of one format: bytes, options, name for errors.
type Reader = fn(&[u8], MeshOptions, &str) -> Result<(TriMesh, MeshReport), MeshError>;

/// Reads an OBJ, GLB or STL file, scales it to metres, and checks and repairs it with [`checked`]. The options may be
/// the scale alone, the number of metres in a unit of the file: 1 for GLB, whose unit is the metre; 1e-3 for a file in
/// millimetres, which is common for OBJ and STL. Axes stay as in the file; in GLB, node transforms are applied.
/// Polygons are cut into triangles; materials, normals and textures are ignored.
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
pub fn load(path: &Path, options: impl Into<MeshOptions>) -> Result<(TriMesh, MeshReport), MeshError> {
    let file = path.display().to_string();
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    let read: Reader = match extension.as_str() {
        "obj" => read_obj,
        "glb" => read_glb,
        "stl" => read_stl,
        _ => return Err(unknown_extension(&file, &extension)),
    };
    let bytes =
        spts_input::read(path, MAX_FILE_BYTES).map_err(|e| refused(&file, format_args!("cannot be read: {e}")))?;
    read(&bytes, options.into(), &file)
}

/// The error of a mesh file of no known kind.
pub fn unknown_extension(file: &str, extension: &str) -> MeshError {
    refused(file, format_args!("extension `{extension}` is not one of obj, glb, stl"))
}

/// As [`load`], from the bytes of an OBJ file. `file` is the name in errors.
///
/// # Errors
/// As [`load`].
pub fn read_obj<O: Into<MeshOptions>>(
    bytes: &[u8],
    options: O,
    file: &str,
) -> Result<(TriMesh, MeshReport), MeshError> {
    checked(&obj_mesh(bytes, file)?, options, file)
}

/// As [`load`], from the bytes of a GLB file. `file` is the name in errors.
///
/// # Errors
/// As [`load`].
pub fn read_glb<O: Into<MeshOptions>>(
    bytes: &[u8],
    options: O,
    file: &str,
) -> Result<(TriMesh, MeshReport), MeshError> {
    let (raw, skipped_primitives, posed) = glb_mesh(bytes, file)?;
    let (mesh, report) = checked(&raw, options, file)?;
    Ok((mesh, MeshReport { skipped_primitives, posed, ..report }))
}

/// As [`load`], from the bytes of an STL file, text or binary. `file` is the name in errors.
///
/// # Errors
/// As [`load`].
pub fn read_stl<O: Into<MeshOptions>>(
    bytes: &[u8],
    options: O,
    file: &str,
) -> Result<(TriMesh, MeshReport), MeshError> {
    let (raw, appended_bytes) = stl_mesh(bytes, file)?;
    let (mesh, report) = checked(&raw, options, file)?;
    // nothing was wrong with the corners: the format has none in common
    Ok((mesh, MeshReport { joined_vertices: 0, appended_bytes, ..report }))
}

// What text files have in common.

/// The text of a file whose keywords and numbers are ASCII. Its names and comments may be in any encoding that has
/// ASCII in it, such as Latin-1 or GBK.
pub(super) fn geometry_text<'t>(bytes: &'t [u8], file: &str) -> Result<Cow<'t, str>, MeshError> {
    spts_input::lossy_text(bytes).map_err(|e| malformed(file, e))
}

/// The lines of a text with their numbers, from 1 on. A line ends with LF, CR LF, or CR in a text without LF.
pub(super) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let end = if text.contains('\n') { '\n' } else { '\r' };
    (1..).zip(text.split(end))
}

/// The three coordinates that `words` begin with. `line` is where they are.
pub(super) fn point<'t>(
    mut words: impl Iterator<Item = &'t str>,
    line: usize,
    file: &str,
) -> Result<[f64; 3], MeshError> {
    let mut out = [0.0; 3];
    for (axis, to) in ['x', 'y', 'z'].into_iter().zip(&mut out) {
        let Some(word) = words.next() else {
            return Err(malformed(file, format_args!("line {line}: coordinate {axis} is missing")));
        };
        let number: Option<f64> = word.parse().ok();
        *to = number.filter(|number| number.is_finite()).ok_or_else(|| {
            let what = if number.is_some() { "a finite number" } else { "a number" };
            let hint = if word.contains(',') { "; write decimal points, not commas" } else { "" };
            malformed(file, format_args!("line {line}: coordinate {axis} = `{}` is not {what}{hint}", start(word)))
        })?;
    }
    Ok(out)
}

/// The start of a word, for errors.
pub(super) fn start(word: &str) -> Cow<'_, str> {
    const SHOWN: usize = 40;
    match word.char_indices().nth(SHOWN) {
        None => Cow::Borrowed(word),
        Some((end, _)) => Cow::Owned(format!("{}…", &word[..end])),
    }
}

/// Refuses points whose digits, those of f32, are too few for where they are: a shape becomes steps.
pub(super) fn enough_digits(points: &[[f64; 3]], file: &str) -> Result<(), MeshError> {
    /// Coarsest step of the coordinates, as a part of the extent.
    const COARSEST: f64 = 2e-3;
    let [low, high] = span(points.iter().copied());
    let extent = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
    let farthest = low.iter().chain(&high).fold(0.0, |most: f64, x| most.max(x.abs()));
    let step = farthest * f64::from(f32::EPSILON);
    if farthest.is_finite() && step > COARSEST * extent && extent > 0.0 {
        return Err(refused(
            file,
            format_args!(
                "its coordinates go up to {farthest}, where 32-bit numbers have steps of {step:.1e}, too coarse for a \
                 mesh of {extent:.1e} across; move it to the origin before the export"
            ),
        ));
    }
    Ok(())
}

// Triangles of an STL file, text or binary.

/// Bytes before the first triangle of a binary STL: a free header and the number of triangles.
const HEADER: usize = 84;
/// Bytes of a triangle: normal, three corners (f32), an attribute word.
const TRIANGLE: usize = 50;

/// All triangles of the file, in its unit, each with corners of its own; and the bytes after the last of them. The
/// normals of the file are not used.
///
/// A file whose length is the one its header promises is binary, also when the header starts with `solid`, as those of
/// some exporters do.
fn stl_mesh(bytes: &[u8], file: &str) -> Result<(TriMesh, usize), MeshError> {
    let declared = bytes.get(HEADER - 4..HEADER).map(|b| le_u32(b) as usize);
    let length = declared.and_then(|n| n.checked_mul(TRIANGLE)?.checked_add(HEADER));
    if let Some(length) = length
        && declared != Some(0)
        && let Some((records, tail)) = bytes.split_at_checked(length)
        && is_padding(tail)
    {
        return Ok((binary_stl(&records[HEADER..], file)?, tail.len()));
    }
    if is_text(bytes) {
        return Ok((text_stl(&geometry_text(bytes, file)?, file)?, 0));
    }
    let found = bytes.len();
    let why = match (declared, length) {
        (Some(0), _) => format!(
            "header declares 0 triangles, the file has {found} bytes, which are {} triangles; export it again",
            (found - HEADER) / TRIANGLE
        ),
        (Some(n), Some(length)) => {
            let what = match found.checked_sub(length) {
                Some(more) => format!("{more} bytes too many: more triangles were appended, or it is not STL"),
                None => "truncated, or not STL".to_owned(),
            };
            format!("header declares {n} triangles = {length} bytes, the file has {found} ({what})")
        }
        _ => format!("{found} bytes, the header of a binary STL has {HEADER}"),
    };
    Err(malformed(file, why))
}

/// Whether what follows the last triangle may be left out: it is too short for another solid and no row of triangles,
/// or filled with one byte.
fn is_padding(tail: &[u8]) -> bool {
    let short = tail.len() < HEADER + TRIANGLE && (tail.is_empty() || !tail.len().is_multiple_of(TRIANGLE));
    short || tail.iter().all(|&byte| byte == tail[0])
}

/// Whether the file starts like a text STL and has no zero byte, which a binary one always has; or is UTF-16, which
/// has them and is told by its text.
fn is_text(bytes: &[u8]) -> bool {
    let start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let solid = start.get(..5).is_some_and(|w| w.eq_ignore_ascii_case(b"solid"));
    (solid && !bytes.contains(&0)) || spts_input::is_utf16(bytes)
}

/// A mesh of triangles that share no corners: three of `vertices` each.
fn soup(vertices: Vec<[f64; 3]>) -> TriMesh {
    let corners = (0..vertices.len() / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2].map(index));
    TriMesh { triangles: corners.collect(), vertices }
}

fn binary_stl(records: &[u8], file: &str) -> Result<TriMesh, MeshError> {
    within_budget(0, records.len() / TRIANGLE, file)?;
    let corners = records.chunks_exact(TRIANGLE).flat_map(|record| record[12..48].chunks_exact(12));
    let number = |bytes: &[u8]| f64::from(f32::from_bits(le_u32(bytes)));
    let points: Vec<[f64; 3]> = corners.map(|b| [0, 4, 8].map(|at| number(&b[at..at + 4]))).collect();
    enough_digits(&points, file)?;
    Ok(soup(points))
}

/// What the lines of a triangle start with.
const FACET: [&str; 7] = ["facet", "outer", "vertex", "vertex", "vertex", "endloop", "endfacet"];

/// Any number of solids, which become one. Normals are not read: some exporters write `nan` for those of triangles
/// without area.
fn text_stl(text: &str, file: &str) -> Result<TriMesh, MeshError> {
    let last = text.trim_end().rsplit(['\n', '\r']).next().unwrap_or_default();
    if !last.split_whitespace().next().is_some_and(|word| word.eq_ignore_ascii_case("endsolid")) {
        let (line, found) = (lines(text.trim_end()).count(), start(last.trim()));
        let why = format!("line {line}: it ends with `{found}`, not with `endsolid` (truncated?)");
        return Err(malformed(file, why));
    }
    let (mut vertices, mut step) = (Vec::new(), 0);
    for (line, content) in lines(text) {
        let mut words = content.split_whitespace();
        let Some(first) = words.next() else { continue };
        let is = |word: &str| first.eq_ignore_ascii_case(word);
        if step == 0 && (is("solid") || is("endsolid")) {
            continue;
        }
        let wanted = FACET[step];
        if !is(wanted) {
            let found = start(content.trim());
            return Err(malformed(file, format_args!("line {line}: `{wanted}` expected, found `{found}`")));
        }
        if wanted == "vertex" {
            within_budget(vertices.len() + 1, vertices.len() / 3 + 1, file)?;
            vertices.push(point(words, line, file)?);
        }
        step = (step + 1) % FACET.len();
    }
    Ok(soup(vertices))
}

/// The number in up to four bytes, the least significant first.
pub(super) fn le_u32(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
}

// Writers: OBJ text, GLB.

/// Nearest f32, the precision of GLB: 4 nm on a 60 mm object.
#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is the file's precision")]
fn f32_of(v: [f64; 3]) -> [f32; 3] {
    v.map(|x| x as f32)
}

impl TriMesh {
    /// Wavefront OBJ text: positions in metres with 9 decimals (1 nm), triangles 1-based, `name` as the object's name.
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
        let name: String = name.chars().filter(|c| c.is_ascii_alphanumeric() || "-_. ".contains(*c)).collect();
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
        let document = gltf::Gltf::from_slice(&block.to_glb("block \"quoted\"")).unwrap();
        let primitive = document.meshes().next().unwrap().primitives().next().unwrap();
        let reader = primitive.reader(|_| document.blob.as_deref());
        assert_eq!(reader.read_positions().unwrap().count(), 8);
        assert_eq!(reader.read_indices().unwrap().into_u32().max(), Some(7));
        let high = primitive.bounding_box().max;
        assert!((high[0] - 0.01).abs() < 1e-9 && (high[2] - 0.04).abs() < 1e-8, "{high:?}");
    }

    #[test]
    fn obj_has_no_negative_zero() {
        let mesh = TriMesh { vertices: vec![[-1e-12, 0.0, 0.0]], triangles: vec![] };
        assert!(!mesh.to_obj("x").contains("-0.0"));
    }
}
