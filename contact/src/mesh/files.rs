//! Reads OBJ, GLB and STL files; writes OBJ and GLB.

use super::check::{
    MeshError, MeshReport, checked, malformed, not_finite, out_of_range, refused, too_large, within_budget,
};
use super::tri_mesh::{MAX_FILE_BYTES, TriMesh, index};
use gltf::Semantic;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive};
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Index, Node, Root};
use gltf::scene::Transform;
use nalgebra::Matrix4;
use std::borrow::Cow;
use std::fmt::{Display, Write as _};
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
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
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
pub fn unknown_extension(file: &str, extension: &str) -> MeshError {
    refused(file, format_args!("extension `{extension}` is not one of obj, glb, stl"))
}

/// As [`load`], from the bytes of an OBJ file. `file` is the name in errors.
///
/// # Errors
/// As [`load`].
pub fn read_obj(bytes: &[u8], scale: f64, file: &str) -> Result<(TriMesh, MeshReport), MeshError> {
    let text = spts_input::text(bytes).map_err(|e| malformed(file, e))?;
    let options = tobj::LoadOptions {
        triangulate: true,
        ignore_lines: true,
        ignore_points: true,
        ..tobj::LoadOptions::default()
    };
    let no_materials = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let geometry = obj_geometry(text, file)?;
    let loaded = tobj::load_obj_buf(&mut geometry.as_bytes(), &options, no_materials);
    let (models, _) = loaded.map_err(|e| malformed(file, e))?;
    let mut raw = TriMesh::default();
    for tobj::Model { mesh, .. } in models {
        let base = index(raw.vertices.len());
        let (positions, corners) = (mesh.positions.as_chunks().0, mesh.indices.as_chunks().0);
        raw.vertices.extend(positions.iter().map(|p: &[f32; 3]| p.map(f64::from)));
        raw.triangles.extend(corners.iter().map(|t: &[u32; 3]| t.map(|i| i.saturating_add(base))));
    }
    checked(&raw, scale, file)
}

/// The `v` and `f` lines of an OBJ, with three coordinates of a vertex and only the position of a corner. What is wrong
/// with them is told by number, which the parser cannot.
fn obj_geometry(text: &str, file: &str) -> Result<String, MeshError> {
    let starts_with_v = |line: &&str| line.split_whitespace().next() == Some("v");
    // counted first: a face may name vertices that only follow later
    let all = text.lines().filter(starts_with_v).count();
    within_budget(all, 0, file)?;
    let mut out = String::with_capacity(text.len());
    let (mut vertices, mut triangles) = (0, 0);
    let mut write = |line: std::fmt::Arguments<'_>| {
        // a string takes whatever is written to it
        let _ = writeln!(out, "{line}");
    };
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let [x, y, z] = point(words, vertices, file)?;
                write(format_args!("v {x} {y} {z}"));
                vertices += 1;
            }
            Some("f") => {
                let count = words.clone().count();
                within_budget(all, triangles + count.saturating_sub(2), file)?;
                let corners = words.map(|word| Ok((obj_index(word, vertices, all, triangles, file)? + 1).to_string()));
                let corners: Vec<String> = corners.collect::<Result<_, MeshError>>()?;
                if count >= 3 {
                    write(format_args!("f {}", corners.join(" ")));
                    triangles += count - 2;
                }
            }
            _ => {}
        }
    }
    Ok(out)
}

/// The vertex that a corner such as `3/1/2` names. OBJ counts from 1, or backwards from −1 for the last vertex so far;
/// `seen` of `all` vertices precede the face.
fn obj_index(word: &str, seen: usize, all: usize, triangle: usize, file: &str) -> Result<u32, MeshError> {
    let number = word.split('/').next().unwrap_or(word);
    let given: i64 = number
        .parse()
        .map_err(|_| malformed(file, format_args!("triangle {triangle}: `{number}` is not a whole number")))?;
    let limit = |n: usize| i64::try_from(n).unwrap_or(i64::MAX);
    let from_0 = if given < 0 { limit(seen) + given } else { given - 1 };
    let vertex = usize::try_from(from_0).ok().filter(|vertex| *vertex < all);
    vertex.map(index).ok_or_else(|| {
        let why = format!("triangle {triangle} uses vertex {given}, outside [1, {all}] or [-{seen}, -1]");
        malformed(file, why)
    })
}

/// The three coordinates that `words` begin with, in the precision of files: f32. `vertex` is its number in errors.
fn point<'t>(mut words: impl Iterator<Item = &'t str>, vertex: usize, file: &str) -> Result<[f64; 3], MeshError> {
    let mut out = [0.0; 3];
    for (axis, to) in ['x', 'y', 'z'].into_iter().zip(&mut out) {
        let word = words.next().unwrap_or_default();
        let number: f32 = word.parse().map_err(|_| {
            let at = format_args!("vertex {vertex}, coordinate {axis} = `{word}` is not a number").to_string();
            malformed(file, at)
        })?;
        *to = f64::from(number);
        if !to.is_finite() {
            return Err(not_finite(file, vertex, axis, *to));
        }
    }
    Ok(out)
}

/// As [`load`], from the bytes of a GLB file. `file` is the name in errors.
///
/// # Errors
/// As [`load`].
pub fn read_glb(bytes: &[u8], scale: f64, file: &str) -> Result<(TriMesh, MeshReport), MeshError> {
    checked(&Glb::new(bytes, file)?.mesh()?, scale, file)
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

/// A GLB file: its description, whose references are checked where they are followed, and its binary chunk. (The
/// validation of the `gltf` crate, version 1.4.1, indexes before it checks, so that a damaged file could end the
/// process.)
struct Glb<'a> {
    root: Root,
    blob: Cow<'a, [u8]>,
    file: &'a str,
}

impl<'a> Glb<'a> {
    fn new(bytes: &'a [u8], file: &'a str) -> Result<Self, MeshError> {
        let Some(declared) = bytes.get(8..12).map(|b| le_u32(b) as usize) else {
            return Err(malformed(file, format_args!("{} bytes, a GLB header has 12", bytes.len())));
        };
        if declared < 12 || declared > bytes.len() {
            let why = format!("header declares {declared} bytes, the file has {}", bytes.len());
            return Err(malformed(file, why));
        }
        if &bytes[..4] != b"glTF" {
            return Err(malformed(file, "does not start with the bytes `glTF`"));
        }
        if let Some(found) = bytes.get(12..16).map(|b| le_u32(b) as usize).filter(|n| *n > MAX_JSON_BYTES) {
            return Err(too_large(file, "bytes of the JSON chunk", found, MAX_JSON_BYTES));
        }
        let glb = gltf::Glb::from_slice(bytes).map_err(|e| malformed(file, e))?;
        let root: Root = gltf::json::deserialize::from_slice(&glb.json).map_err(|e| malformed(file, e))?;
        let blob = glb.bin.unwrap_or_default();
        Ok(Self { root, blob, file })
    }

    fn malformed(&self, why: impl Display) -> MeshError {
        malformed(self.file, why)
    }

    /// The error of a file that is valid but uses what is not read here.
    fn unsupported(&self, feature: impl Display) -> MeshError {
        let why = format_args!("{feature} is not supported; export plain indexed triangles").to_string();
        refused(self.file, why)
    }

    /// The `what` that `at` refers to.
    fn get<T>(&self, what: &str, at: Index<T>) -> Result<&T, MeshError>
    where
        Root: AsRef<[T]>,
    {
        let all = self.root.as_ref();
        let outside = || self.malformed(format_args!("{what} {} is outside [0, {})", at.value(), all.len()));
        all.get(at.value()).ok_or_else(outside)
    }

    /// All triangles of the default scene (or of the first, or of every node when there is none), in the file's unit.
    fn mesh(&self) -> Result<TriMesh, MeshError> {
        if let Some(extension) = self.root.extensions_required.first() {
            return Err(self.unsupported(format_args!("extension {extension}")));
        }
        let scene = match self.root.scene {
            Some(at) => Some(self.get("scene", at)?),
            None => self.root.scenes.first(),
        };
        let all = || (0..self.root.nodes.len()).map(index).map(Index::new).collect();
        let roots: Vec<Index<Node>> = scene.map_or_else(all, |scene| scene.nodes.clone());
        let mut visits = roots.len();
        let mut stack: Vec<_> = roots.into_iter().map(|at| (at, Matrix4::identity(), 0)).collect();
        let mut raw = TriMesh::default();
        while let Some((at, parent, depth)) = stack.pop() {
            let node = self.get("node", at)?;
            let mesh = node.mesh.map(|at| self.get("mesh", at)).transpose()?;
            let primitives = mesh.map_or(&[][..], |mesh| &mesh.primitives);
            let children = node.children.as_deref().unwrap_or_default();
            // counted before they are visited, so that nothing is kept of more than are allowed
            visits += children.len() + primitives.len();
            if depth > MAX_DEPTH || visits > MAX_VISITS {
                return Err(self.malformed(format_args!(
                    "node {} is more than {MAX_DEPTH} deep, or {visits} nodes and primitives are visited of at most \
                     {MAX_VISITS}: the node tree is cyclic, or its nodes are shared too often",
                    at.value()
                )));
            }
            let world: Matrix4<f64> = parent * transform(node);
            for primitive in primitives {
                self.append(&mut raw, primitive, &world)?;
            }
            stack.extend(children.iter().map(|child| (*child, world, depth + 1)));
        }
        Ok(raw)
    }

    fn append(&self, raw: &mut TriMesh, primitive: &Primitive, world: &Matrix4<f64>) -> Result<(), MeshError> {
        match primitive.mode {
            Checked::Valid(Mode::Triangles) => {}
            Checked::Valid(mode) => return Err(self.unsupported(format_args!("primitive mode {mode:?}"))),
            Checked::Invalid => return Err(self.malformed("a primitive has an unknown mode")),
        }
        let Some(at) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) else {
            return Err(self.malformed("a primitive lacks POSITION"));
        };
        let points = Elements::new(self, *at)?;
        let corners = primitive.indices.map(|at| Elements::new(self, at)).transpose()?;
        let count = corners.as_ref().map_or(points.count, |corners| corners.count);
        within_budget(
            raw.vertices.len().saturating_add(points.count),
            raw.triangles.len().saturating_add(count / 3),
            self.file,
        )?;
        let points: Vec<[f32; 3]> = points.read(&[(ComponentType::F32, 12)], Type::Vec3, le_point)?;
        const INDICES: [(ComponentType, usize); 3] =
            [(ComponentType::U8, 1), (ComponentType::U16, 2), (ComponentType::U32, 4)];
        let corners: Vec<u32> = match corners {
            Some(corners) => corners.read(&INDICES, Type::Scalar, le_u32)?,
            None => (0..points.len()).map(index).collect(),
        };
        let (corners, rest) = corners.as_chunks::<3>();
        if !rest.is_empty() {
            return Err(self.malformed(format_args!("{count} indices are not a multiple of 3")));
        }
        if let Some(k) = corners.as_flattened().iter().position(|&i| i as usize >= points.len()) {
            return Err(out_of_range(self.file, k / 3, corners.as_flattened()[k], points.len()));
        }
        let mirrors = world.fixed_view::<3, 3>(0, 0).determinant() < 0.0;
        let base = index(raw.vertices.len());
        raw.vertices.extend(points.iter().map(|p| {
            let [x, y, z] = p.map(f64::from);
            let q = world * nalgebra::Vector4::new(x, y, z, 1.0);
            [q.x, q.y, q.z]
        }));
        raw.triangles.extend(corners.iter().map(|t| {
            let [a, b, c] = t.map(|i| i.saturating_add(base));
            if mirrors { [a, c, b] } else { [a, b, c] }
        }));
        Ok(())
    }
}

/// From the axes of `node` to those of its parent.
fn transform(node: &Node) -> Matrix4<f64> {
    let matrix = node.matrix.unwrap_or_else(|| {
        let transform = Transform::Decomposed {
            translation: node.translation.unwrap_or_default(),
            rotation: node.rotation.unwrap_or_default().0,
            scale: node.scale.unwrap_or([1.0; 3]),
        };
        let mut flat = [0.0; 16];
        flat.copy_from_slice(transform.matrix().as_flattened());
        flat
    });
    // column-major, as nalgebra stores it
    Matrix4::from_column_slice(&matrix.map(f64::from))
}

/// The elements of an accessor.
struct Elements<'g> {
    glb: &'g Glb<'g>,
    at: Index<Accessor>,
    accessor: &'g Accessor,
    count: usize,
}

impl<'g> Elements<'g> {
    fn new(glb: &'g Glb<'g>, at: Index<Accessor>) -> Result<Self, MeshError> {
        let accessor = glb.get("accessor", at)?;
        let count = usize::try_from(accessor.count.0).unwrap_or(usize::MAX);
        Ok(Self { glb, at, accessor, count })
    }

    /// The elements as `number` makes them of their bytes, when they are `kind` of one of the component types in
    /// `types`, each with the bytes of an element.
    fn read<T>(
        &self,
        types: &[(ComponentType, usize)],
        kind: Type,
        number: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, MeshError> {
        let (glb, accessor, at) = (self.glb, self.accessor, self.at.value());
        let (Checked::Valid(found), Checked::Valid(shape)) = (&accessor.component_type, &accessor.type_) else {
            return Err(glb.malformed(format_args!("accessor {at} has an unknown type")));
        };
        let fits = types.iter().find(|(component, _)| *component == found.0 && *shape == kind);
        let Some(&(_, size)) = fits else {
            let expected: Vec<String> = types.iter().map(|(component, _)| format!("{component:?}")).collect();
            let expected = expected.join(" or ");
            let why = format!("accessor {at} holds {shape:?} {:?}, {kind:?} {expected} expected", found.0);
            return Err(glb.malformed(why));
        };
        if accessor.sparse.is_some() {
            return Err(glb.unsupported("a sparse accessor"));
        }
        let Some(view) = accessor.buffer_view else {
            return Err(glb.unsupported("an accessor without buffer view"));
        };
        let view = glb.get("buffer view", view)?;
        if glb.get("buffer", view.buffer)?.uri.is_some() {
            return Err(glb.unsupported("a buffer outside the file"));
        }
        let bytes = |offset: Option<USize64>| offset.map_or(Some(0), |n| usize::try_from(n.0).ok());
        let stride = view.byte_stride.map_or(size, |stride| stride.0);
        let data = bytes(view.byte_offset).zip(bytes(Some(view.byte_length))).and_then(|(start, length)| {
            let data = glb.blob.get(start..start.checked_add(length)?)?.get(bytes(accessor.byte_offset)?..)?;
            let end = self.count.saturating_sub(1).checked_mul(stride)?.checked_add(size)?;
            (stride >= size && (self.count == 0 || end <= data.len())).then_some(data)
        });
        let Some(data) = data else {
            let (count, length) = (self.count, glb.blob.len());
            let why = format!(
                "accessor {at} ({count} elements of {size} bytes) reaches outside the {length} bytes of the BIN chunk"
            );
            return Err(glb.malformed(why));
        };
        let element = |i: usize| number(&data[i * stride..i * stride + size]);
        Ok((0..self.count).map(element).collect())
    }
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
fn stl_mesh(bytes: &[u8], file: &str) -> Result<TriMesh, MeshError> {
    let declared = bytes.get(HEADER - 4..HEADER).map(|b| u64::from(le_u32(b)));
    let length = declared.map(|n| HEADER as u64 + TRIANGLE as u64 * n);
    let found = bytes.len() as u64;
    if length == Some(found) {
        return binary_stl(&bytes[HEADER..], file);
    }
    if is_text(bytes) {
        return text_stl(spts_input::text(bytes).map_err(|e| malformed(file, e))?, file);
    }
    let why = match (declared, length) {
        (Some(n), Some(length)) => {
            let what = match found.checked_sub(length) {
                Some(more) => format!("{more} bytes too many: something was appended, or it is not STL"),
                None => "truncated, or not STL".to_owned(),
            };
            format!("header declares {n} triangles = {length} bytes, the file has {found} ({what})")
        }
        _ => format!("{found} bytes, the header of a binary STL has {HEADER}"),
    };
    Err(malformed(file, why))
}

/// Whether the file starts like a text STL and has no zero byte, which a binary one always has.
fn is_text(bytes: &[u8]) -> bool {
    let start = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    start.get(..5).is_some_and(|w| w.eq_ignore_ascii_case(b"solid")) && !bytes.contains(&0)
}

/// A mesh of triangles that share no corners: three of `vertices` each.
fn soup(vertices: Vec<[f64; 3]>) -> TriMesh {
    let corners = (0..vertices.len() / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2].map(index));
    TriMesh { triangles: corners.collect(), vertices }
}

fn binary_stl(records: &[u8], file: &str) -> Result<TriMesh, MeshError> {
    within_budget(0, records.len() / TRIANGLE, file)?;
    let corners = records.chunks_exact(TRIANGLE).flat_map(|record| record[12..48].chunks_exact(12));
    Ok(soup(corners.map(|b| le_point(b).map(f64::from)).collect()))
}

/// What the lines of a triangle start with.
const FACET: [&str; 7] = ["facet", "outer", "vertex", "vertex", "vertex", "endloop", "endfacet"];

/// Any number of solids, which become one. Normals are not read: some exporters write `nan` for those of triangles
/// without area.
fn text_stl(text: &str, file: &str) -> Result<TriMesh, MeshError> {
    let last = text.lines().rev().find_map(|line| line.split_whitespace().next());
    if !last.is_some_and(|word| word.eq_ignore_ascii_case("endsolid")) {
        return Err(malformed(file, "does not end with `endsolid` (truncated?)"));
    }
    let (mut vertices, mut step) = (Vec::new(), 0);
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let Some(first) = words.next() else { continue };
        let is = |word: &str| first.eq_ignore_ascii_case(word);
        if step == 0 && (is("solid") || is("endsolid")) {
            continue;
        }
        // the corners of the present one are there already at its last two lines
        let triangle = (vertices.len() - usize::from(step > 4)) / 3;
        let wanted = FACET[step];
        if !is(wanted) {
            let why = format!("triangle {triangle}: `{wanted}` expected, found `{}`", line.trim());
            return Err(malformed(file, why));
        }
        if wanted == "vertex" {
            within_budget(vertices.len() + 1, triangle + 1, file)?;
            vertices.push(point(words, vertices.len(), file)?);
        }
        step = (step + 1) % FACET.len();
    }
    Ok(soup(vertices))
}

/// The number in four bytes, the least significant first.
fn le_u32(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
}

/// Three f32 in twelve bytes.
fn le_point(bytes: &[u8]) -> [f32; 3] {
    [0, 4, 8].map(|start| f32::from_bits(le_u32(&bytes[start..start + 4])))
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
