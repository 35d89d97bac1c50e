//! The objects of a data set: from shape number to mesh.

use super::config::{ObjectConfig, ObjectSource, PoseOrigin};
use super::error::SpecError;
use rand::RngExt as _;
use sha2::{Digest as _, Sha256};
use spts_contact::PreparedMesh;
use spts_contact::mesh::load;
use spts_contact::objects::{OBJECTS, ObjectSpec};
use spts_contact::shapes::{SHAPE_FAMILIES, ShapeRanges, build_shape};
use spts_input::Refusal;
use spts_models::{Streams, in_range, in_section};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Name of the ball.
const BALL: &str = "ball";

/// The shapes of a data set. Number `n` is entry `n` modulo their count, so that each comes equally often.
#[derive(Debug, Clone)]
pub(crate) struct Choices {
    entries: Vec<Entry>,
    ranges: ShapeRanges,
    source: ObjectSource,
}

#[derive(Debug, Clone)]
enum Entry {
    Family(&'static str),
    Object(&'static ObjectSpec, PreparedMesh),
    Mesh { name: Arc<str>, mesh: PreparedMesh },
    Ball,
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
    pub(crate) fn new(config: &ObjectConfig, about: PoseOrigin, folder: &Path) -> Result<Self, SpecError> {
        let source = config.from;
        if about == PoseOrigin::Placement && source != ObjectSource::Objects {
            return Err(SpecError::Choice(
                "`pose.about` = \"placement\": only the seventeen objects have one (`object.from` = \"objects\")"
                    .to_owned(),
            ));
        }
        for (field, given, of) in [
            ("object.folder", config.folder.is_some(), ObjectSource::Meshes),
            ("object.size_m", config.size_m.is_some(), ObjectSource::Shapes),
            ("object.relief_m", config.relief_m.is_some(), ObjectSource::Shapes),
            ("object.edge_m", config.edge_m.is_some(), ObjectSource::Shapes),
        ] {
            if given && of != source {
                return Err(SpecError::Choice(format!("`{field}` is not for this `object.from`")));
            }
        }
        in_range(
            "object.scale",
            config.scale,
            config.scale > 0.0 && config.scale <= 1e3,
            "(0, 1000]",
        )?;
        let mut ranges = ShapeRanges::default();
        ranges.size_m = config.size_m.unwrap_or(ranges.size_m);
        ranges.relief_m = config.relief_m.unwrap_or(ranges.relief_m);
        ranges.edge_m = config.edge_m.unwrap_or(ranges.edge_m);
        ranges
            .check()
            .map_err(|error| Refusal::new(in_section("object", &error.to_string())))?;
        let entries = match source {
            ObjectSource::Shapes => {
                let known: Vec<&str> = SHAPE_FAMILIES.iter().map(|family| family.name).collect();
                let chosen = chosen(config, &known)?;
                chosen
                    .into_iter()
                    .map(|k| Entry::Family(SHAPE_FAMILIES[k].name))
                    .collect()
            }
            ObjectSource::Objects => {
                let known: Vec<&str> = OBJECTS.iter().map(|object| object.name).collect();
                chosen(config, &known)?
                    .into_iter()
                    .map(|k| Entry::Object(&OBJECTS[k], (OBJECTS[k].build)().into()))
                    .collect()
            }
            ObjectSource::Meshes => meshes(config, folder)?,
            ObjectSource::Ball => {
                chosen(config, &[BALL])?;
                vec![Entry::Ball]
            }
        };
        Ok(Self {
            entries,
            ranges,
            source,
        })
    }

    /// Names of the classes, in the order of their labels.
    pub(crate) fn classes(&self) -> Vec<(i32, Arc<str>)> {
        (0..)
            .zip(&self.entries)
            .map(|(place, entry)| (entry.label(place), entry.name()))
            .collect()
    }

    /// Whether every number is another shape.
    pub(crate) fn are_procedural(&self) -> bool {
        self.source == ObjectSource::Shapes
    }

    /// Shape number `number`.
    pub(crate) fn shape(&self, streams: Streams, number: u64) -> Result<Choice, SpecError> {
        let count = self.entries.len() as u64;
        let place = usize::try_from(number % count).unwrap_or_default();
        let entry = &self.entries[place];
        let (mesh, shape) = match entry {
            Entry::Family(family) => {
                let seed = streams.rng("shape", number).random();
                let shape = build_shape(family, &self.ranges, seed).map_err(|e| SpecError::Choice(e.to_string()))?;
                let facts = ShapeFacts {
                    size_m: shape.size_m,
                    relief_m: shape.relief_m,
                    edge_m: shape.edge_m,
                    area_m2: shape.area_m2,
                    holes: shape.holes,
                };
                (shape.mesh.into(), Some(facts))
            }
            Entry::Object(_, mesh) | Entry::Mesh { mesh, .. } => (mesh.clone(), None),
            Entry::Ball => (PreparedMesh::default(), None),
        };
        Ok(Choice {
            name: entry.name(),
            label: entry.label(i32::try_from(place).unwrap_or(i32::MAX)),
            mesh,
            object: match entry {
                Entry::Object(object, _) => Some(object),
                _ => None,
            },
            shape,
        })
    }

    /// Adds the meshes that were read from files.
    pub(crate) fn digest(&self, digest: &mut Sha256) {
        for entry in &self.entries {
            if let Entry::Mesh { name, mesh } = entry {
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
}

impl Entry {
    fn name(&self) -> Arc<str> {
        match self {
            Self::Family(name) => Arc::from(*name),
            Self::Object(object, _) => Arc::from(object.name),
            Self::Mesh { name, .. } => Arc::clone(name),
            Self::Ball => Arc::from(BALL),
        }
    }

    fn label(&self, place: i32) -> i32 {
        match self {
            Self::Object(object, _) => i32::from(object.label),
            Self::Family(_) | Self::Mesh { .. } | Self::Ball => place,
        }
    }
}

/// Places in `known` of the names that `config` takes.
fn chosen(config: &ObjectConfig, known: &[&str]) -> Result<Vec<usize>, SpecError> {
    let Some(names) = &config.names else {
        return Ok((0..known.len()).collect());
    };
    if names.is_empty() {
        return Err(SpecError::Choice(
            "`object.names` = []: at least one name is needed".to_owned(),
        ));
    }
    let place = |name: &String| {
        known.iter().position(|known| known == name).ok_or_else(|| {
            let (name, known) = (name.escape_debug(), known.join(", "));
            SpecError::Choice(format!("`object.names` = \"{name}\"; known: {known}"))
        })
    };
    names.iter().map(place).collect()
}

/// The mesh files of the folder, or those of them that are named.
fn meshes(config: &ObjectConfig, folder: &Path) -> Result<Vec<Entry>, SpecError> {
    let Some(named) = &config.folder else {
        return Err(SpecError::Choice(
            "`object.folder` is needed with `object.from` = \"meshes\"".to_owned(),
        ));
    };
    let path = folder.join(named);
    let failed = |source| SpecError::Folder {
        path: path.clone(),
        source,
    };
    let mut files: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(&path).map_err(failed)? {
        let file = entry.map_err(failed)?.path();
        let extension = file.extension().map(|e| e.to_ascii_lowercase());
        if extension.is_some_and(|e| ["obj", "glb", "stl"].iter().any(|known| e == *known)) {
            files.push(file);
        }
    }
    files.sort();
    let names: Vec<String> = files
        .iter()
        .map(|f| f.file_stem().unwrap_or_default().to_string_lossy().into_owned())
        .collect();
    if files.is_empty() {
        let (path, needed) = (path.display(), "no file that ends in `.obj`, `.glb` or `.stl`");
        return Err(SpecError::Choice(format!("`object.folder`: {path}: {needed}")));
    }
    let known: Vec<&str> = names.iter().map(String::as_str).collect();
    let read = |k: usize| {
        let (mesh, _) = load(&files[k], config.scale)?;
        Ok(Entry::Mesh {
            name: Arc::from(known[k]),
            mesh: mesh.into(),
        })
    };
    chosen(config, &known)?.into_iter().map(read).collect()
}
