//! Errors of meshes.

use super::size::{MAX_COORDINATE_M, MAX_EXTENT_M, MIN_EXTENT_M};

/// Why a mesh was refused. Every variant names the file and the problem.
///
/// ```
/// use spts_contact::mesh::{cuboid, read_obj};
///
/// let in_millimetres = cuboid([40.0, 20.0, 10.0]).to_obj("block");
/// let error = read_obj(in_millimetres.as_bytes(), 1.0, "block.obj").unwrap_err();
/// assert!(error.to_string().starts_with("mesh `block.obj`: largest extent = 40 m after scale = 1 is outside"));
/// ```
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The file cannot be read.
    #[error("mesh `{file}`: cannot be read: {reason}")]
    Unreadable {
        /// Path as given.
        file: String,
        /// Reason given by the operating system.
        reason: String,
    },
    /// The file has an extension that is not supported.
    #[error("mesh `{file}`: extension `{extension}` is not one of obj, glb, stl")]
    UnknownExtension {
        /// Path as given.
        file: String,
        /// Extension without the dot; empty if there is none.
        extension: String,
    },
    /// The scale is not a positive number.
    #[error("mesh `{file}`: scale = {scale} is outside (0, ∞)")]
    Scale {
        /// Path as given.
        file: String,
        /// Scale as given.
        scale: f64,
    },
    /// The content does not match the extension.
    #[error("mesh `{file}`: malformed: {reason}")]
    Malformed {
        /// Path as given.
        file: String,
        /// What the reader found.
        reason: String,
    },
    /// The file is valid but uses a feature that is not read here.
    #[error("mesh `{file}`: {feature} is not supported; export plain indexed triangles")]
    Unsupported {
        /// Path as given.
        file: String,
        /// The feature.
        feature: String,
    },
    /// The file has more elements than are read.
    #[error("mesh `{file}`: {what} = {found} is outside [0, {most}]")]
    TooLarge {
        /// Path as given.
        file: String,
        /// Kind of the elements.
        what: &'static str,
        /// Number of elements, or the number counted before counting stopped.
        found: usize,
        /// Largest number that is read.
        most: usize,
    },
    /// A coordinate that is too far from the origin.
    #[error(
        "mesh `{file}`: vertex {vertex} has {axis} = {} = {} m after scale, outside [-{MAX_COORDINATE_M}, {MAX_COORDINATE_M}] m",
        short(*value), short(*metres)
    )]
    FarAway {
        /// Path as given.
        file: String,
        /// Vertex, from 0.
        vertex: usize,
        /// Axis.
        axis: char,
        /// Coordinate in the unit of the file.
        value: f64,
        /// Coordinate after scaling, m.
        metres: f64,
    },
    /// The mesh has no triangle of non-zero size.
    #[error("mesh `{file}`: 0 triangles of non-zero size ({dropped} degenerate ones dropped); at least 4 are needed")]
    NoTriangles {
        /// Path as given.
        file: String,
        /// Degenerate triangles that were dropped.
        dropped: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("mesh `{file}`: vertex {vertex}, coordinate {axis} = {value} is not a finite number")]
    NotFinite {
        /// Path as given.
        file: String,
        /// Vertex, 0-based.
        vertex: usize,
        /// Axis: x, y or z.
        axis: char,
        /// Offending value.
        value: f64,
    },
    /// A triangle refers to a vertex that does not exist.
    #[error("mesh `{file}`: triangle {triangle} uses vertex {index}, outside [0, {vertices})")]
    IndexOutOfRange {
        /// Path as given.
        file: String,
        /// Triangle, 0-based.
        triangle: usize,
        /// Offending index.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// The size of the mesh is not plausible for an object that presses on a skin: its unit is probably not the metre.
    #[error(
        "mesh `{file}`: largest extent = {} m after scale = {} is outside [{MIN_EXTENT_M}, {MAX_EXTENT_M}] m{}",
        short(*extent_m), short(*scale), advice(*suggestion)
    )]
    FarFromMetres {
        /// Path as given.
        file: String,
        /// Largest extent after scaling, m.
        extent_m: f64,
        /// Scale that was applied.
        scale: f64,
        /// Probable unit of the file, and the scale for it; `None` if no usual unit fits.
        suggestion: Option<(&'static str, f64)>,
    },
    /// The surface has a hole that cannot be closed without guessing.
    #[error(
        "mesh `{file}`: not closed: {open_edges} of {edges} edges lack a partner, one at ({:.4}, {:.4}, {:.4}) of the file: {why}",
        at[0], at[1], at[2]
    )]
    NotClosed {
        /// Path as given.
        file: String,
        /// Number of edges without a partner.
        open_edges: usize,
        /// Number of edges.
        edges: usize,
        /// Middle of an edge of the hole, in the unit of the file.
        at: [f64; 3],
        /// Why it is not closed.
        why: &'static str,
    },
    /// Surfaces meet along an edge in a way that leaves no consistent inside and outside.
    #[error(
        "mesh `{file}`: {triangles} triangles meet in an edge at ({:.4}, {:.4}, {:.4}) of the file, with no outside that all agree on; \
         a solid has 2, export without inner walls",
        at[0], at[1], at[2]
    )]
    Branching {
        /// Path as given.
        file: String,
        /// Middle of the edge, in the unit of the file.
        at: [f64; 3],
        /// Number of triangles at the edge.
        triangles: usize,
    },
    /// The surface has only one side, like a Möbius band.
    #[error("mesh `{file}`: the surface has one side only (noticed at ({:.4}, {:.4}, {:.4}) of the file): it has no outside", at[0], at[1], at[2])]
    OneSided {
        /// Path as given.
        file: String,
        /// Middle of an edge on the surface, in the unit of the file.
        at: [f64; 3],
    },
    /// The surface is closed but has no inside.
    #[error("mesh `{file}`: encloses {volume_m3} m³; a solid of its extent encloses at least {least_m3} m³")]
    NoVolume {
        /// Path as given.
        file: String,
        /// Enclosed volume, m³.
        volume_m3: f64,
        /// Smallest accepted volume, m³.
        least_m3: f64,
    },
}

/// `value` without a row of zeros.
fn short(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e6).contains(&value.abs()) {
        format!("{value:e}")
    } else {
        value.to_string()
    }
}

/// What to do about a wrong unit.
fn advice(suggestion: Option<(&'static str, f64)>) -> String {
    suggestion.map_or_else(String::new, |(unit, scale)| {
        format!("; if its unit is {unit}, use scale = {}", short(scale))
    })
}
