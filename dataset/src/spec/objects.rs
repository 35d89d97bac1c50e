//! The objects of a data set: from shape number to mesh.

use super::config::{ObjectConfig, ObjectSource, PoseOrigin};
use super::frames::{FramePress, FrameSource};
use rand::RngExt as _;
use sha2::{Digest as _, Sha256};
use spts::Refusal;
use spts_contact::PreparedMesh;
use spts_contact::mesh::{MeshOptions, load};
use spts_contact::objects::{OBJECTS, ObjectSpec};
use spts_contact::shapes::{SHAPE_FAMILIES, ShapeRanges, build_shape};
use spts_models::{Streams, in_range, in_section};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Why a specification is refused: its folder of meshes or a file there cannot be read, or anything else.
pub(crate) enum SpecError {
    Folder(Refusal),
    Mesh(Refusal),
    Refused(Refusal),
}

impl From<Refusal> for SpecError {
    fn from(refusal: Refusal) -> Self {
        Self::Refused(refusal)
    }
}

impl From<SpecError> for Refusal {
    fn from(error: SpecError) -> Self {
        match error {
            SpecError::Folder(refusal) | SpecError::Mesh(refusal) | SpecError::Refused(refusal) => refusal,
        }
    }
}

/// Name of the ball.
const BALL: &str = "ball";

/// The shapes of a data set. Number `n` is entry `n` modulo their count, so that each comes equally often.
#[derive(Debug, Clone)]
pub(crate) struct Choices {
    /// Those of procedural shapes have no mesh yet.
    entries: Vec<Choice>,
    ranges: ShapeRanges,
    source: ObjectSource,
    /// What was repaired in mesh files.
    pub(super) notes: Vec<String>,
}

/// One shape and what is known of it.
#[derive(Debug, Clone)]
pub(crate) struct Choice {
    /// Name of the object or mesh file, or name of the family.
    pub(crate) name: Arc<str>,
    /// Class label: the object's own label, or the position of the family or mesh file in the list, from 0.
    pub(crate) label: i32,
    /// The mesh in body axes; without a vertex for a ball, which is an exact sphere.
    pub(crate) mesh: PreparedMesh,
    /// The object, if it is one of the seventeen.
    pub(crate) object: Option<&'static ObjectSpec>,
    /// Parameters of a procedural shape.
    pub(crate) shape: Option<ShapeFacts>,
    /// The press of frames, if it is one.
    pub(crate) frames: Option<FramePress>,
}

/// Parameters of a procedural shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ShapeFacts {
    pub(crate) size_m: [f64; 2],
    pub(crate) relief_m: f64,
    pub(crate) edge_m: f64,
    pub(crate) area_m2: f64,
    pub(crate) holes: u32,
}

impl Choices {
    pub(super) fn new(
        config: &ObjectConfig,
        about: PoseOrigin,
        folder: &Path,
        frames: Option<&FrameSource>,
    ) -> Result<Self, SpecError> {
        let source = config.from;
        if about == PoseOrigin::Placement && source != ObjectSource::Objects {
            let problem =
                "`pose.about` = \"placement\": only the seventeen objects have one (`object.from` = \"objects\")";
            return Err(Refusal::new(problem).into());
        }
        for (field, given, of) in [
            ("folder", config.folder.is_some() && frames.is_none(), ObjectSource::Meshes),
            ("peak_pa", config.peak_pa.is_some(), ObjectSource::Frames),
            ("repair", config.repair.is_some(), ObjectSource::Meshes),
            ("centre", config.centre.is_some(), ObjectSource::Meshes),
            ("size_m", config.size_m.is_some(), ObjectSource::Shapes),
            ("relief_m", config.relief_m.is_some(), ObjectSource::Shapes),
            ("edge_m", config.edge_m.is_some(), ObjectSource::Shapes),
        ] {
            if given && of != source {
                return Err(Refusal::new(format!("`object.{field}` is not for this `object.from`")).into());
            }
        }
        let is_valid = config.scale > 0.0 && config.scale <= 1e3;
        in_range("object.scale", config.scale, is_valid, "(0, 1000]")?;
        let default = ShapeRanges::default();
        let ranges = ShapeRanges {
            size_m: config.size_m.unwrap_or(default.size_m),
            relief_m: config.relief_m.unwrap_or(default.relief_m),
            edge_m: config.edge_m.unwrap_or(default.edge_m),
        };
        ranges.check().map_err(|e| Refusal::new(in_section("object", &e.to_string())))?;
        let entry = |name: &str, mesh: PreparedMesh| Choice {
            name: Arc::from(name),
            label: 0,
            mesh,
            object: None,
            shape: None,
            frames: None,
        };
        let mut notes = Vec::new();
        let mut entries: Vec<Choice> = match source {
            ObjectSource::Shapes => {
                let known: Vec<&str> = SHAPE_FAMILIES.iter().map(|family| family.name).collect();
                let chosen = chosen(config, &known)?.into_iter();
                chosen.map(|k| entry(known[k], PreparedMesh::default())).collect()
            }
            ObjectSource::Objects => {
                let known: Vec<&str> = OBJECTS.iter().map(|object| object.name).collect();
                let chosen = chosen(config, &known)?.into_iter().map(|k| &OBJECTS[k]);
                let object = |object: &'static ObjectSpec| Choice {
                    object: Some(object),
                    ..entry(object.name, (object.build)().into())
                };
                chosen.map(object).collect()
            }
            ObjectSource::Meshes => {
                let files = mesh_files(config, folder)?;
                let known: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
                let options = MeshOptions {
                    scale: config.scale,
                    repair: config.repair.unwrap_or_default(),
                    centre: config.centre.unwrap_or_default(),
                };
                let read = |k: usize| {
                    let path = &files[k].1;
                    let (mesh, report) =
                        load(path, options).map_err(|error| SpecError::Mesh(Refusal::from_error(error)))?;
                    notes.extend(report.notes().into_iter().map(|note| format!("{}: {note}", path.display())));
                    Ok(entry(known[k], mesh.into()))
                };
                let read = chosen(config, &known)?.into_iter().map(read);
                read.collect::<Result<_, SpecError>>()?
            }
            ObjectSource::Ball => {
                chosen(config, &[BALL])?;
                vec![entry(BALL, PreparedMesh::default())]
            }
            ObjectSource::Frames => {
                let presses = frames.map(|frames| frames.presses(config.names.as_deref())).transpose()?;
                let press = |(name, frames): (Arc<str>, FramePress)| Choice {
                    frames: Some(frames),
                    ..entry(&name, PreparedMesh::default())
                };
                notes.extend(frames.iter().flat_map(|frames| frames.notes.iter().cloned()));
                presses.unwrap_or_default().into_iter().map(press).collect()
            }
        };
        let mut names: Vec<Arc<str>> = Vec::new();
        for entry in &mut entries {
            // presses of frames share the names of their objects
            let place = names.iter().position(|name| *name == entry.name).unwrap_or(names.len());
            if place == names.len() {
                names.push(Arc::clone(&entry.name));
            }
            let place = i32::try_from(place).unwrap_or(i32::MAX);
            entry.label = entry.object.map_or(place, |object| object.label.into());
        }
        Ok(Self { entries, ranges, source, notes })
    }

    /// Number of different objects or files, or of families.
    pub(crate) fn count(&self) -> u64 {
        self.entries.len() as u64
    }

    /// Class label of shape number `number`.
    pub(crate) fn label(&self, number: u64) -> i32 {
        self.entries[usize::try_from(number % self.count()).unwrap_or_default()].label
    }

    /// Whether every number is another shape.
    pub(crate) fn are_procedural(&self) -> bool {
        self.source == ObjectSource::Shapes
    }

    /// Shape number `number`.
    pub(crate) fn shape(&self, streams: Streams, number: u64) -> Result<Choice, Refusal> {
        let place = usize::try_from(number % self.count()).unwrap_or_default();
        let mut choice = self.entries[place].clone();
        if self.are_procedural() {
            let seed = streams.rng("shape", number).random();
            let shape = build_shape(&choice.name, &self.ranges, seed)?;
            choice.shape = Some(ShapeFacts {
                size_m: shape.size_m,
                relief_m: shape.relief_m,
                edge_m: shape.edge_m,
                area_m2: shape.area_m2,
                holes: shape.holes,
            });
            choice.mesh = shape.mesh.into();
        }
        Ok(choice)
    }

    /// Adds the meshes that were read from files.
    pub(super) fn digest(&self, digest: &mut Sha256) {
        let files = self.entries.iter().filter(|_| self.source == ObjectSource::Meshes);
        for Choice { name, mesh, .. } in files {
            digest.update(name.as_bytes());
            for vertex in mesh.vertices.as_flattened() {
                digest.update(vertex.to_le_bytes());
            }
            for corner in mesh.triangles.as_flattened() {
                digest.update(corner.to_le_bytes());
            }
        }
    }
}

/// Places in `known` of the names that `config` takes.
fn chosen(config: &ObjectConfig, known: &[&str]) -> Result<Vec<usize>, Refusal> {
    let Some(names) = &config.names else {
        return Ok((0..known.len()).collect());
    };
    if names.is_empty() {
        return Err(Refusal::new("`object.names` = []: at least one name is needed"));
    }
    let place = |name: &String| {
        known.iter().position(|known| known == name).ok_or_else(|| {
            let (name, known) = (name.escape_debug(), known.join(", "));
            Refusal::new(format!("`object.names` = \"{name}\"; known: {known}"))
        })
    };
    names.iter().map(place).collect()
}

/// The mesh files of the folder, in order, each with its name.
fn mesh_files(config: &ObjectConfig, folder: &Path) -> Result<Vec<(String, PathBuf)>, SpecError> {
    let Some(named) = &config.folder else {
        let problem = "`object.folder` is needed with `object.from` = \"meshes\"";
        return Err(Refusal::new(problem).into());
    };
    let path = folder.join(named);
    let at = format!("`object.folder`: {}", path.display());
    let failed = |error| SpecError::Folder(Refusal::from_error(error).at(&at));
    let mut files: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(&path).map_err(failed)? {
        let file = entry.map_err(failed)?.path();
        let extension = file.extension().map(|e| e.to_ascii_lowercase());
        if extension.is_some_and(|e| ["obj", "glb", "stl"].iter().any(|known| e == *known)) {
            files.push(file);
        }
    }
    if files.is_empty() {
        return Err(Refusal::new("no file that ends in `.obj`, `.glb` or `.stl`").at(at).into());
    }
    files.sort();
    let name = |file: &PathBuf| file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut named = BTreeMap::new();
    for file in &files {
        if let Some(other) = named.insert(name(file).to_lowercase(), file) {
            let (first, second) = (other.display(), file.display());
            let problem = format!("{first} and {second} would be one object, `{}`: rename one of them", name(file));
            return Err(Refusal::new(problem).at(at).into());
        }
    }
    Ok(files.into_iter().map(|file| (name(&file), file)).collect())
}
