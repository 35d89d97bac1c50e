//! Reads GLB files: the triangles of their default scene, node transforms applied.

use super::check::{MeshError, malformed, out_of_range, refused, too_large, within_budget};
use super::files::{enough_digits, le_u32};
use super::tri_mesh::{TriMesh, index};
use gltf::Semantic;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::buffer::View;
use gltf::json::mesh::{Mode, Primitive};
use gltf::json::skin::Skin;
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Index, Node, Root, Value};
use gltf::scene::Transform;
use nalgebra::{Matrix4, Vector4};
use std::borrow::Cow;
use std::fmt::Display;

/// All triangles of the file, m; how many of its primitives are points and lines, which are left out; and whether bones
/// move one of its meshes.
pub(super) fn glb_mesh(bytes: &[u8], file: &str) -> Result<(TriMesh, usize, bool), MeshError> {
    let mut reading = Reading::default();
    Glb::new(bytes, file)?.read(&mut reading)?;
    Ok((reading.mesh, reading.skipped, reading.posed))
}

/// What was read so far.
#[derive(Default)]
struct Reading {
    mesh: TriMesh,
    skipped: usize,
    posed: bool,
}

/// Required extensions that change neither triangles nor their place, or that are read here. Others of a family in
/// [`PAINT_FAMILIES`] are as harmless.
const HARMLESS: [&str; 7] = [
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_animation_pointer",
    "EXT_lights_ies",
    "EXT_lights_image_based",
    "EXT_mesh_manifold",
    "MSFT_texture_dds",
];
/// Starts of the names of extensions that change the paint alone.
const PAINT_FAMILIES: [&str; 8] = [
    "KHR_materials_",
    "EXT_materials_",
    "ADOBE_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_xmp",
    "MSFT_packing_",
    "EXT_structural_metadata",
];
/// Extensions that pack the triangles, and what turns the packing off.
const PACKINGS: [(&str, &str); 3] = [
    ("KHR_draco_mesh_compression", "without Draco compression (Blender: untick Compression)"),
    ("EXT_meshopt_compression", "without meshopt compression (gltfpack: leave out -c and -cc)"),
    ("KHR_meshopt_compression", "without meshopt compression (gltfpack: leave out -c and -cc)"),
];

/// Deepest chain of nodes that is followed; real files have a handful, a cyclic one never ends.
const MAX_DEPTH: usize = 64;
/// Most visits of nodes, of their primitives and of their joints: a node that many parents share is visited once for
/// each.
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
        let root: Root = Root::from_slice(&glb.json).map_err(|e| malformed(file, e))?;
        let blob = glb.bin.unwrap_or_default();
        Ok(Self { root, blob, file })
    }

    fn malformed(&self, why: impl Display) -> MeshError {
        malformed(self.file, why)
    }

    /// The error of a file that is valid but uses what is not read here.
    fn unsupported(&self, feature: impl Display) -> MeshError {
        refused(self.file, format_args!("{feature} is not supported; export plain triangles"))
    }

    /// Refuses a required extension without which the triangles cannot be read, or lie elsewhere.
    fn check_extensions(&self) -> Result<(), MeshError> {
        let paint = |name: &str| PAINT_FAMILIES.iter().any(|family| name.starts_with(family));
        let needed = |name: &&String| !HARMLESS.contains(&name.as_str()) && !paint(name);
        match self.root.extensions_required.iter().find(needed) {
            None => Ok(()),
            Some(name) => Err(self.packed(name).unwrap_or_else(|| {
                self.unsupported(format_args!(
                    "extension {name}, which the file requires and which may move triangles,"
                ))
            })),
        }
    }

    /// The error of the extension `name` if it packs triangles.
    fn packed(&self, name: &str) -> Option<MeshError> {
        let (_, how) = PACKINGS.iter().find(|(packing, _)| *packing == name)?;
        Some(refused(
            self.file,
            format_args!("its triangles are packed with {name}, which is not read; export it {how}"),
        ))
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

    /// Reads all triangles of the default scene (or of the first, or of every node when there is none).
    fn read(&self, out: &mut Reading) -> Result<(), MeshError> {
        self.check_extensions()?;
        let scene = match self.root.scene {
            Some(at) => Some(self.get("scene", at)?),
            None => self.root.scenes.first(),
        };
        let all = || (0..self.root.nodes.len()).map(index).map(Index::new).collect();
        let roots: Vec<Index<Node>> = scene.map_or_else(all, |scene| scene.nodes.clone());
        let mut parents = vec![None; self.root.nodes.len()];
        for (k, node) in self.root.nodes.iter().enumerate() {
            for child in node.children.iter().flatten() {
                if let Some(parent) = parents.get_mut(child.value()) {
                    *parent = Some(k);
                }
            }
        }
        let mut visits = roots.len();
        let mut stack: Vec<_> = roots.into_iter().map(|at| (at, Matrix4::identity(), 0)).collect();
        while let Some((at, parent, depth)) = stack.pop() {
            let node = self.get("node", at)?;
            let mesh = node.mesh.map(|at| self.get("mesh", at)).transpose()?;
            let skin = node.skin.filter(|_| mesh.is_some()).map(|at| self.get("skin", at)).transpose()?;
            let primitives = mesh.map_or(&[][..], |mesh| &mesh.primitives);
            let children = node.children.as_deref().unwrap_or_default();
            // counted before they are visited, so that nothing is kept of more than are allowed
            visits += children.len() + primitives.len() + skin.map_or(0, |skin| skin.joints.len());
            if depth > MAX_DEPTH || visits > MAX_VISITS {
                return Err(self.malformed(format_args!(
                    "node {} is more than {MAX_DEPTH} deep, or {visits} nodes, primitives and joints are visited of at most \
                     {MAX_VISITS}: the node tree is cyclic, or its nodes are shared too often",
                    at.value()
                )));
            }
            let morphs = node.weights.as_ref().or(mesh.and_then(|mesh| mesh.weights.as_ref()));
            if mesh.is_some() && morphs.is_some_and(|weights| weights.iter().any(|w| *w != 0.0)) {
                return Err(self.unsupported(format_args!("node {} in a morphed shape", at.value())));
            }
            let world: Matrix4<f64> = parent * transform(node);
            let bones = skin.map(|skin| self.bones(skin, &parents)).transpose()?;
            out.posed |= bones.is_some();
            for primitive in primitives {
                self.append(out, primitive, &world, bones.as_deref())?;
            }
            stack.extend(children.iter().map(|child| (*child, world, depth + 1)));
        }
        Ok(())
    }

    /// What each joint of a skin does to the vertices that follow it, in the pose of the file.
    fn bones(&self, skin: &Skin, parents: &[Option<usize>]) -> Result<Vec<Matrix4<f64>>, MeshError> {
        let joints = skin.joints.len();
        let inverse = match skin.inverse_bind_matrices {
            None => None,
            Some(at) => {
                let all = Elements::new(self, at)?;
                if all.count < joints {
                    let why = format!("a skin has {joints} joints and {} inverse bind matrices", all.count);
                    return Err(self.malformed(why));
                }
                Some(Elements { count: joints, ..all }.read::<16>(Type::Mat4, &[ComponentType::F32])?)
            }
        };
        let bone = |(k, joint): (usize, &Index<Node>)| {
            let mut world = transform(self.get("node", *joint)?);
            let mut at = parents[joint.value()];
            for _ in 0..MAX_DEPTH {
                let Some(parent) = at else { break };
                world = transform(&self.root.nodes[parent]) * world;
                at = parents[parent];
            }
            Ok(world * inverse.as_ref().map_or_else(Matrix4::identity, |all| Matrix4::from_column_slice(&all[k])))
        };
        skin.joints.iter().enumerate().map(bone).collect()
    }

    /// The transform of every vertex that `bones` move: of each the weighted mean of its joints'.
    fn skinned(
        &self,
        primitive: &Primitive,
        bones: &[Matrix4<f64>],
        count: usize,
    ) -> Result<Vec<Matrix4<f64>>, MeshError> {
        let mut out = vec![Matrix4::zeros(); count];
        let mut any = false;
        for set in 0.. {
            let of = |semantic| primitive.attributes.get(&Checked::Valid(semantic));
            let (Some(joints), Some(weights)) = (of(Semantic::Joints(set)), of(Semantic::Weights(set))) else { break };
            let (joints, weights) = (Elements::new(self, *joints)?, Elements::new(self, *weights)?);
            if joints.count != count || weights.count != count {
                let (joints, weights) = (joints.count, weights.count);
                let why = format!("{count} vertices of a skin have {joints} joints and {weights} weights");
                return Err(self.malformed(why));
            }
            let joints = joints.read::<4>(Type::Vec4, &[ComponentType::U8, ComponentType::U16])?;
            let kinds = [ComponentType::F32, ComponentType::U8, ComponentType::U16];
            let weights = weights.read::<4>(Type::Vec4, &kinds)?;
            for ((to, joints), weights) in out.iter_mut().zip(&joints).zip(&weights) {
                for (joint, weight) in joints.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
                    let Some(bone) = bones.get(whole(*joint) as usize) else {
                        let why = format!("a vertex follows joint {joint}, outside [0, {})", bones.len());
                        return Err(self.malformed(why));
                    };
                    *to += bone * *weight;
                }
            }
            any = true;
        }
        // the mean, whatever the weights add up to; a vertex that follows nothing stays
        let mean = |m: Matrix4<f64>| if m[(3, 3)] > 0.0 { m / m[(3, 3)] } else { Matrix4::identity() };
        Ok(if any { out.into_iter().map(mean).collect() } else { vec![Matrix4::identity(); count] })
    }

    fn append(
        &self,
        out: &mut Reading,
        primitive: &Primitive,
        world: &Matrix4<f64>,
        bones: Option<&[Matrix4<f64>]>,
    ) -> Result<(), MeshError> {
        let mode = match primitive.mode {
            Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
            Checked::Valid(_) => {
                out.skipped += 1;
                return Ok(());
            }
            Checked::Invalid => return Err(self.malformed("a primitive has an unknown mode")),
        };
        let Some(at) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) else {
            return Err(self.malformed("a primitive lacks POSITION"));
        };
        let points = Elements::new(self, *at)?;
        let corners = primitive.indices.map(|at| Elements::new(self, at)).transpose()?;
        let count = corners.as_ref().map_or(points.count, |corners| corners.count);
        let raw = &mut out.mesh;
        let triangles = if mode == Mode::Triangles { count / 3 } else { count.saturating_sub(2) };
        within_budget(
            raw.vertices.len().saturating_add(points.count),
            raw.triangles.len().saturating_add(triangles),
            self.file,
        )?;
        let points = points.read::<3>(Type::Vec3, &POSITIONS)?;
        enough_digits(&points, self.file)?;
        let corners: Vec<u32> = match corners {
            Some(corners) => {
                let kinds = [ComponentType::U8, ComponentType::U16, ComponentType::U32];
                corners.read::<1>(Type::Scalar, &kinds)?.into_iter().map(|[corner]| whole(corner)).collect()
            }
            None => (0..points.len()).map(index).collect(),
        };
        if let Some(k) = corners.iter().position(|&i| i as usize >= points.len()) {
            return Err(out_of_range(self.file, k / 3, corners[k], points.len()));
        }
        let triangles: Vec<[u32; 3]> = match mode {
            Mode::TriangleStrip => {
                let ahead = corners.windows(3).enumerate();
                ahead.map(|(k, t)| if k % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] }).collect()
            }
            Mode::TriangleFan => corners.windows(2).skip(1).map(|edge| [edge[0], edge[1], corners[0]]).collect(),
            _ => {
                let (triangles, rest) = corners.as_chunks::<3>();
                if !rest.is_empty() {
                    return Err(self.malformed(format_args!("{count} indices are not a multiple of 3")));
                }
                triangles.to_vec()
            }
        };
        let moved = match bones {
            // bones move a mesh, not the node that it hangs on
            Some(bones) => self.skinned(primitive, bones, points.len())?,
            None => vec![*world],
        };
        let by = |vertex: usize| moved.get(vertex).unwrap_or(&moved[0]);
        let base = index(raw.vertices.len());
        raw.vertices.extend(points.iter().enumerate().map(|(k, [x, y, z])| {
            let q = by(k) * Vector4::new(*x, *y, *z, 1.0);
            [q.x, q.y, q.z]
        }));
        raw.triangles.extend(triangles.into_iter().map(|[a, b, c]| {
            let mirrors = by(a as usize).fixed_view::<3, 3>(0, 0).determinant() < 0.0;
            let [a, b, c] = [a, b, c].map(|i| i.saturating_add(base));
            if mirrors { [a, c, b] } else { [a, b, c] }
        }));
        Ok(())
    }
}

/// What positions may be made of: those of KHR_mesh_quantization beside plain ones.
const POSITIONS: [ComponentType; 5] =
    [ComponentType::F32, ComponentType::I8, ComponentType::U8, ComponentType::I16, ComponentType::U16];

/// A whole number of at most 32 bits that was read as f64.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "exact")]
fn whole(number: f64) -> u32 {
    number as u32
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

    /// The elements, each of `N` numbers, when they are `kind` of one of the component types in `types`. Whole numbers
    /// that stand for parts of one are divided by their largest.
    fn read<const N: usize>(&self, kind: Type, types: &[ComponentType]) -> Result<Vec<[f64; N]>, MeshError> {
        let (glb, accessor, at) = (self.glb, self.accessor, self.at.value());
        let (Checked::Valid(found), Checked::Valid(shape)) = (&accessor.component_type, &accessor.type_) else {
            return Err(glb.malformed(format_args!("accessor {at} has an unknown type")));
        };
        let component = found.0;
        if *shape != kind || !types.contains(&component) {
            let expected: Vec<String> = types.iter().map(|component| format!("{component:?}")).collect();
            let expected = expected.join(" or ");
            let why = format!("accessor {at} holds {shape:?} {component:?}, {kind:?} {expected} expected");
            return Err(glb.malformed(why));
        }
        within_budget(self.count, 0, glb.file)?;
        let size = component.size();
        let number = |bytes: &[u8]| {
            let value = decoded(component, bytes);
            if accessor.normalized { (value / largest(component)).max(-1.0) } else { value }
        };
        let element = |bytes: &[u8]| std::array::from_fn(|k| number(&bytes[k * size..(k + 1) * size]));
        let mut out: Vec<[f64; N]> = match accessor.buffer_view {
            Some(view) => {
                let data = self.bytes(view, accessor.byte_offset, self.count, N * size)?;
                data.map(element).collect()
            }
            None if accessor.sparse.is_none() => {
                // what a packing extension unpacks has no bytes of its own
                if let Some(error) = glb.root.extensions_used.iter().find_map(|name| glb.packed(name)) {
                    return Err(error);
                }
                vec![[0.0; N]; self.count]
            }
            None => vec![[0.0; N]; self.count],
        };
        if let Some(sparse) = &accessor.sparse {
            let count = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
            if count > self.count {
                let why = format!("the sparse accessor {at} changes {count} of {} elements", self.count);
                return Err(glb.malformed(why));
            }
            let Checked::Valid(kind) = sparse.indices.component_type else {
                return Err(glb.malformed(format_args!("the sparse accessor {at} has indices of an unknown type")));
            };
            let (indices, values) = (&sparse.indices, &sparse.values);
            let places = self.bytes(indices.buffer_view, Some(indices.byte_offset), count, kind.0.size())?;
            let values = self.bytes(values.buffer_view, Some(values.byte_offset), count, N * size)?;
            for (place, value) in places.zip(values) {
                let (place, all) = (le_u32(place), out.len());
                let Some(to) = out.get_mut(place as usize) else {
                    let why = format!("the sparse accessor {at} changes element {place}, outside [0, {all})");
                    return Err(glb.malformed(why));
                };
                *to = element(value);
            }
            if !accessor.normalized {
                self.check_span(&out)?;
            }
        }
        Ok(out)
    }

    /// Refuses a sparse accessor whose elements are not in the span that it declares for each of their numbers, to a
    /// thousandth of it: which of the two is meant cannot be told.
    fn check_span<const N: usize>(&self, elements: &[[f64; N]]) -> Result<(), MeshError> {
        let (glb, accessor, at) = (self.glb, self.accessor, self.at.value());
        let bound = |declared: &Option<Value>, k: usize| declared.as_ref()?.get(k)?.as_f64();
        for k in 0..N {
            let (Some(low), Some(high)) = (bound(&accessor.min, k), bound(&accessor.max, k)) else { continue };
            let margin = 1e-3 * (high - low).abs();
            if let Some(e) = elements.iter().find(|e| !(low - margin..=high + margin).contains(&e[k])) {
                return Err(glb.malformed(format_args!(
                    "the sparse accessor {at} declares [{low}, {high}] for number {k} of its elements, and one has {}: \
                     export it without sparse accessors",
                    e[k]
                )));
            }
        }
        Ok(())
    }

    /// The bytes of `count` elements of `size` bytes each.
    fn bytes(
        &self,
        view: Index<View>,
        offset: Option<USize64>,
        count: usize,
        size: usize,
    ) -> Result<impl Iterator<Item = &'g [u8]> + use<'g>, MeshError> {
        let (glb, at) = (self.glb, self.at.value());
        let view = glb.get("buffer view", view)?;
        if glb.get("buffer", view.buffer)?.uri.is_some() {
            return Err(glb.unsupported("a buffer outside the file"));
        }
        let bytes = |offset: Option<USize64>| offset.map_or(Some(0), |n| usize::try_from(n.0).ok());
        let stride = view.byte_stride.map_or(size, |stride| stride.0);
        let data = bytes(view.byte_offset).zip(bytes(Some(view.byte_length))).and_then(|(start, length)| {
            let data = glb.blob.get(start..start.checked_add(length)?)?.get(bytes(offset)?..)?;
            let end = count.saturating_sub(1).checked_mul(stride)?.checked_add(size)?;
            (stride >= size && (count == 0 || end <= data.len())).then_some(data)
        });
        let Some(data) = data else {
            let length = glb.blob.len();
            return Err(glb.malformed(format_args!(
                "accessor {at} ({count} elements of {size} bytes) reaches outside the {length} bytes of the BIN chunk"
            )));
        };
        Ok((0..count).map(move |i| &data[i * stride..i * stride + size]))
    }
}

/// The number in the bytes of a component.
fn decoded(component: ComponentType, bytes: &[u8]) -> f64 {
    let bits = le_u32(bytes);
    match component {
        ComponentType::F32 => f64::from(f32::from_bits(bits)),
        ComponentType::I8 => f64::from(bytes[0].cast_signed()),
        ComponentType::I16 => f64::from(i16::from_le_bytes([bytes[0], bytes[1]])),
        ComponentType::U8 | ComponentType::U16 | ComponentType::U32 => f64::from(bits),
    }
}

/// What a normalised component is divided by.
fn largest(component: ComponentType) -> f64 {
    match component {
        ComponentType::I8 => 127.0,
        ComponentType::U8 => 255.0,
        ComponentType::I16 => 32_767.0,
        ComponentType::U16 => 65_535.0,
        ComponentType::U32 | ComponentType::F32 => 1.0,
    }
}
