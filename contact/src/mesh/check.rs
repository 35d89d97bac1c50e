//! Checks every mesh from outside: repairs what is safe to repair, and refuses the rest with the reason.

use super::polygon::{Point, signed_area_m2, triangulate};
use super::tri_mesh::{
    MAX_COORDINATE_M, MAX_EXTENT_M, MAX_TRIANGLES, MAX_VERTICES, MIN_EXTENT_M, SOFT_MAX_TRIANGLES, Side, Sides,
    TriMesh, Unions, balance, cross, dot, index, span, sub,
};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use spts_input::Refusal;
use std::collections::BTreeMap;
use std::fmt::Display;

/// Why a mesh was refused. Every message names the file and the problem.
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
    /// Anything but the size.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// The size of the mesh is not plausible for an object that presses on a skin: its unit is probably another.
    #[error(
        "mesh `{file}`: largest extent = {} m after scale = {} is outside [{MIN_EXTENT_M}, {MAX_EXTENT_M}] m{}",
        short(*extent_m), short(*scale), advice(*extent_m / *scale)
    )]
    FarFromMetres {
        /// Path as given.
        file: String,
        /// Largest extent after scaling, m.
        extent_m: f64,
        /// Scale that was applied.
        scale: f64,
        /// Most probable unit of the file, and the scale for it; `None` if no usual unit fits.
        suggestion: Option<(&'static str, f64)>,
    },
}

/// The error of the mesh in `file`.
pub(super) fn refused(file: &str, why: impl Display) -> MeshError {
    Refusal::new(format!("mesh `{file}`: {why}")).into()
}

/// The error of a file whose content does not match its extension.
pub(super) fn malformed(file: &str, why: impl Display) -> MeshError {
    refused(file, format_args!("malformed: {why}"))
}

/// The error of a coordinate that is NaN or infinite.
pub(super) fn not_finite(file: &str, vertex: usize, axis: char, value: f64) -> MeshError {
    refused(file, format_args!("vertex {vertex}, coordinate {axis} = {value} is not a finite number"))
}

/// The error of the triangle `triangle` that uses a vertex that is not there.
pub(super) fn out_of_range(file: &str, triangle: usize, index: u32, vertices: usize) -> MeshError {
    refused(file, format_args!("triangle {triangle} uses vertex {index}, outside [0, {vertices})"))
}

/// The error of a file with more of something than is read.
pub(super) fn too_large(file: &str, what: &str, found: usize, most: usize) -> MeshError {
    refused(file, format_args!("{what} = {found} is outside [0, {most}]"))
}

/// `value` to six digits, without a row of zeros.
fn short(value: f64) -> String {
    let rounded = format!("{value:.5e}").parse().unwrap_or(value);
    if rounded != 0.0 && !(1e-3..1e6).contains(&rounded.abs()) { format!("{rounded:e}") } else { rounded.to_string() }
}

/// What to do about a wrong unit: the units that make an object of the size, the most probable first.
fn advice(raw_extent: f64) -> String {
    let mut out = String::new();
    for (k, (unit, scale)) in fitting_units(raw_extent).into_iter().enumerate() {
        let (size_mm, scale) = (1e3 * raw_extent * scale, short(scale));
        out += &match k {
            0 => format!(
                "; if its unit is {unit}, use scale = {scale} (`--scale {scale}`), which makes it {} mm wide",
                short(size_mm)
            ),
            _ => format!("; if {unit}, {scale}: {} mm", short(size_mm)),
        };
    }
    out
}

/// What to do with a mesh that cannot be closed.
const AS_IS: &str = "; to press it as it is, as a shell without thickness, use `--as-is` (in scenes and Python `repair = \
                     \"near_side\"`)";

/// What is done with a mesh that is not closed.
///
/// ```
/// use spts_contact::mesh::{MeshOptions, Repair, cuboid, read_obj};
///
/// // a box without its underside
/// let mut open = cuboid([0.04, 0.02, 0.01]);
/// open.triangles.retain(|t| t.iter().any(|i| open.vertices[*i as usize][2] > 0.0));
/// let open = open.to_obj("box");
/// let refused = read_obj(open.as_bytes(), 1.0, "box.obj").unwrap_err();
/// assert!(refused.to_string().contains("not closed"));
/// let options = MeshOptions { repair: Repair::NearSide, ..MeshOptions::from(1.0) };
/// let (_, report) = read_obj(open.as_bytes(), options, "box.obj")?;
/// assert!(report.notes()[0].contains("not closed"));
/// # Ok::<(), spts_contact::mesh::MeshError>(())
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Repair {
    /// It is closed where that changes nothing that touches a skin below, pressed as it is where none of its holes is
    /// seen from below, and refused otherwise.
    #[default]
    Strict,
    /// It is pressed as it is: whatever of it is nearest to the skin touches, and holes are holes.
    NearSide,
}

/// How a mesh is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshOptions {
    /// Number of metres in a unit of the file.
    pub scale: f64,
    /// What is done if it is not closed.
    pub repair: Repair,
    /// Whether its origin becomes the middle of its footprint, at the height of its lowest point.
    pub centre: bool,
}

impl From<f64> for MeshOptions {
    fn from(scale: f64) -> Self {
        Self { scale, repair: Repair::default(), centre: false }
    }
}

/// What was repaired in a mesh when it was loaded, and the size of the mesh afterwards.
///
/// ```
/// use spts_contact::mesh::{cuboid, read_obj};
///
/// // a block in millimetres that has one triangle twice
/// let mut block = cuboid([40.0, 20.0, 10.0]);
/// block.triangles.push(block.triangles[0]);
/// let (mesh, report) = read_obj(block.to_obj("block").as_bytes(), 1e-3, "block.obj")?;
/// assert_eq!((report.duplicate_triangles, mesh.open_edges()), (1, 0));
/// assert!(!report.notes().is_empty(), "the repair is reported");
/// # Ok::<(), spts_contact::mesh::MeshError>(())
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct MeshReport {
    /// Vertices after repair.
    pub vertices: usize,
    /// Triangles after repair.
    pub triangles: usize,
    /// Vertices that coincided with another and were joined. Not counted for STL, where every triangle has its own
    /// corners.
    pub joined_vertices: usize,
    /// Dropped triangles without three distinct corners.
    pub dropped_triangles: usize,
    /// Dropped duplicate triangles.
    pub duplicate_triangles: usize,
    /// Triangles that were turned to agree with their neighbours.
    pub turned_triangles: usize,
    /// Whether the mesh, or a part of it, was inside out and has been turned.
    pub flipped: bool,
    /// Number of holes of at most 5 % of the mesh's size that were closed with a flat surface.
    pub filled_holes: usize,
    /// Number of large holes in the upper side of the mesh, as of a bowl, that were closed. From the rim of each hole,
    /// a wall goes straight up to a flat lid above the highest point of the mesh. While the mesh stands upright, walls
    /// and lid touch nothing; a tilted press of such a mesh is refused.
    pub lids: usize,
    /// Number of edges that lack a partner or have too many, in a mesh that is pressed as it is: closed where it could
    /// not be closed, only its side towards the skin is right. 0 for a closed mesh.
    pub open_edges: usize,
    /// A place on such an edge that is seen from below, m in the mesh's axes: what lies beyond it is not felt.
    pub open_below_m: Option<[f64; 3]>,
    /// Bytes after the last triangle of an STL file, which were left out.
    pub appended_bytes: usize,
    /// Points and lines of a GLB file, which were left out.
    pub skipped_primitives: usize,
    /// Whether bones move a mesh of a GLB file, which is read in the pose of the file.
    pub posed: bool,
    /// By how much the mesh was moved to have its origin in the middle of its footprint, m.
    pub centred_by_m: Option<[f64; 3]>,
    /// Number of triangles before decimation; `None` if the mesh was not decimated.
    pub decimated_from: Option<usize>,
    /// Largest distance between the surfaces before and after decimation, m; `None` without decimation.
    pub decimation_error_m: Option<f64>,
    /// Whether there are more than [`SOFT_MAX_TRIANGLES`] triangles, which makes contact slow.
    pub heavy: bool,
    /// Sides of the box around the mesh, m.
    pub extent_m: [f64; 3],
    /// Middle of the box around the mesh, relative to its origin, m.
    pub middle_m: [f64; 3],
    /// Enclosed volume, m³.
    pub volume_m3: f64,
}

impl MeshReport {
    /// Whether the origin, by which the object is held and placed, lies beside the box around the mesh in x or y.
    pub(super) fn is_off_centre(&self) -> bool {
        (0..2).any(|k| self.middle_m[k].abs() > 0.5 * self.extent_m[k])
    }

    /// Notes for the user, one a line; empty if the mesh needed no repair.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        let mut counted = |count: usize, one: &str, many: &str| match count {
            0 => {}
            1 => notes.push(format!("1 {one}")),
            n => notes.push(format!("{n} {many}")),
        };
        counted(
            self.joined_vertices,
            "vertex of the mesh coincided with another and was joined to it",
            "vertices of the mesh coincided with others and were joined to them",
        );
        counted(
            self.dropped_triangles,
            "triangle of the mesh without area was dropped",
            "triangles of the mesh without area were dropped",
        );
        counted(
            self.duplicate_triangles,
            "triangle of the mesh was there before and was dropped",
            "triangles of the mesh were there before and were dropped",
        );
        counted(
            self.turned_triangles,
            "triangle of the mesh was turned to agree with its neighbours",
            "triangles of the mesh were turned to agree with their neighbours",
        );
        counted(
            self.filled_holes,
            "small hole in the mesh was filled flat",
            "small holes in the mesh were filled flat",
        );
        counted(
            self.lids,
            "hole in the mesh opens upward and was closed above it, where nothing touches while the mesh stands upright",
            "holes in the mesh open upward and were closed above it, where nothing touches while the mesh stands upright",
        );
        counted(
            self.appended_bytes,
            "byte after the last triangle of the mesh file was left out",
            "bytes after the last triangle of the mesh file were left out",
        );
        counted(
            self.skipped_primitives,
            "group of points or lines in the mesh file was left out",
            "groups of points or lines in the mesh file were left out",
        );
        if self.posed {
            notes.push("bones move the mesh; it is read in the pose of the file".to_owned());
        }
        if let Some(moved_m) = self.centred_by_m {
            let [x, y, z] = moved_m.map(|m| 1e3 * m);
            notes.push(format!(
                "the mesh was moved by ({x:.1}, {y:.1}, {z:.1}) mm: its origin is the middle of its footprint now"
            ));
        }
        if self.open_edges > 0 {
            let count = self.open_edges;
            notes.push(match self.open_below_m.map(|m| m.map(|m| 1e3 * m)) {
                None => format!(
                    "the mesh is not closed ({count} open edges), but none of its holes is seen from below: its underside \
                     is pressed as it is; turned, it would press with its holes"
                ),
                Some([x, y, z]) => format!(
                    "the mesh is not closed ({count} open edges) and is open towards the skin, as at ({x:.1}, {y:.1}, \
                     {z:.1}) mm: it is pressed as a shell without thickness, and its holes press nothing"
                ),
            });
        }
        if self.flipped {
            notes.push("the mesh was inside out and has been turned".to_owned());
        }
        if let (Some(from), Some(error_m)) = (self.decimated_from, self.decimation_error_m) {
            notes.push(format!(
                "the mesh was decimated from {from} to {} triangles; the surface moved by at most {:.4} mm",
                self.triangles,
                1e3 * error_m
            ));
        }
        if self.heavy {
            notes.push(format!(
                "the mesh has {} triangles, more than {SOFT_MAX_TRIANGLES}: expect a slow contact",
                self.triangles
            ));
        }
        if self.is_off_centre() {
            let [x, y, _] = self.middle_m.map(|m| 1e3 * m);
            notes.push(format!(
                "the origin of the mesh, by which it is held and placed, lies beside it: the middle of the mesh is \
                 ({x:.1}, {y:.1}) mm from it; mind the lever, or centre the mesh (`--centre`, `centre = true`)"
            ));
        }
        notes
    }
}

// Drops duplicate triangles.

impl TriMesh {
    /// Of triangles with the same three corners only the first is kept. Sheets of triangles that are there in both
    /// directions enclose nothing: they go altogether where that leaves every edge at their border with partners (a
    /// fin on a surface, the wall between two boxes), and are kept once where it would tear the surface. Also returns
    /// the number of triangles dropped. Where nothing is left, the mesh is a sheet; with `or_sheet`, it then keeps one
    /// of each.
    fn without_duplicates(&self, or_sheet: bool) -> (Self, usize) {
        let mut keyed: Vec<([u32; 3], u32)> = Vec::with_capacity(self.triangles.len());
        for (t, corners) in self.triangles.iter().enumerate() {
            let mut key = *corners;
            key.sort_unstable();
            keyed.push((key, index(t)));
        }
        keyed.sort_unstable();
        let mut keep = vec![true; self.triangles.len()];
        let mut two_sided = vec![false; self.triangles.len()];
        let mut any = false;
        for group in keyed.chunk_by(|a, b| a.0 == b.0).filter(|g| g.len() > 1) {
            let rising = |t: u32| is_rising(self.triangles[t as usize]);
            let first = group[0].1;
            two_sided[first as usize] = group.iter().any(|&(_, t)| rising(t) != rising(first));
            any |= two_sided[first as usize];
            group[1..].iter().for_each(|&(_, t)| keep[t as usize] = false);
        }
        if keep.iter().all(|&k| k) {
            return (self.clone(), 0);
        }
        let mut out = self.only(&keep);
        if any {
            let kept = keep.iter().zip(&two_sided).filter(|(k, _)| **k);
            let sheets: Vec<bool> = kept.map(|(_, &sheet)| sheet).collect();
            let solid = out.without_idle_sheets(&sheets);
            if !(solid.triangles.is_empty() && or_sheet) {
                out = solid;
            }
        }
        let dropped = self.triangles.len() - out.triangles.len();
        (out, dropped)
    }

    /// Without the connected regions of `sheets` whose removal leaves more of their border edges paired than keeping
    /// them does.
    fn without_idle_sheets(&self, sheets: &[bool]) -> Self {
        let sides = Sides::of(self);
        let mut regions = Unions::new(self.triangles.len());
        for edge in sides.edges() {
            if let [a, b] = edge
                && sheets[a.triangle as usize]
                && sheets[b.triangle as usize]
            {
                regions.join(a.triangle, b.triangle, a.rising == b.rising);
            }
        }
        let mut votes: BTreeMap<u32, i64> = BTreeMap::new();
        for edge in sides.edges() {
            let of_sheets: Vec<u32> = edge.iter().map(|s| s.triangle).filter(|&t| sheets[t as usize]).collect();
            if let [t] = of_sheets[..] {
                let others = edge.len() - 1;
                *votes.entry(regions.find(t).0).or_insert(0) += if others % 2 == 0 { 1 } else { -1 };
            }
        }
        let keep: Vec<bool> = (0..self.triangles.len())
            .map(|t| !sheets[t] || votes.get(&regions.find(index(t)).0).is_none_or(|&v| v <= 0))
            .collect();
        self.only(&keep)
    }
}

/// Whether the corners, from the smallest on, go up: the two directions around the same three corners differ in it.
fn is_rising([a, b, c]: [u32; 3]) -> bool {
    let smallest = a.min(b).min(c);
    let [_, second, third] = if a == smallest {
        [a, b, c]
    } else if b == smallest {
        [b, c, a]
    } else {
        [c, a, b]
    };
    second < third
}

// Orients the triangles of each part consistently, and outwards.

/// Evaluations of a triangle spent on asking what lies inside what; beyond them boxes decide, which can only mistake a
/// part beside a bent one for a cavity.
const MAX_EVALUATIONS: usize = 30_000_000;
/// Only so many of the largest bodies are asked what they contain.
const MAX_CONTAINERS: usize = 256;

/// Why a surface cannot be mended.
enum Broken {
    /// In words with `{at}` for the place; and the place, m.
    At { at_m: [f64; 3], why: String },
    /// It encloses nothing; the sides of its box, m.
    Sheet([f64; 3]),
}

impl Broken {
    /// The error, with the place in the unit of the file, in which the mesh was `away_m` from where it is.
    fn error(&self, scale: f64, away_m: [f64; 3], file: &str) -> MeshError {
        match self {
            Self::Sheet(sides_m) => no_volume(file, *sides_m),
            Self::At { at_m, why } => {
                let [x, y, z] = [0, 1, 2].map(|k| (at_m[k] + away_m[k]) / scale);
                let at = format!("({x:.4}, {y:.4}, {z:.4}) of the file");
                refused(file, format_args!("{}{AS_IS}", why.replace("{at}", &at)))
            }
        }
    }
}

/// Turns triangles so that neighbours agree; in each connected part those in the minority. Returns the part of each
/// triangle, numbered from 0, and the number turned. Edges of more than two triangles do not connect.
fn agree(mesh: &mut TriMesh, sides: &Sides) -> Result<(Vec<u32>, usize), Broken> {
    let mut unions = Unions::new(mesh.triangles.len());
    for edge in sides.edges() {
        if let [a, b] = edge {
            if !unions.join(a.triangle, b.triangle, a.rising == b.rising) {
                // on a closed path over the surface, a triangle meets itself turned over
                return Err(Broken::At {
                    at_m: mesh.middle_m(a.edge),
                    why: "the surface has one side only (noticed at {at}): it has no outside".to_owned(),
                });
            }
        } else if edge.len() > 1 && edge.len() % 2 == 1 {
            return Err(branching(mesh, edge));
        }
    }
    let n = mesh.triangles.len();
    let found: Vec<(u32, bool)> = (0..n).map(|t| unions.find(index(t))).collect();
    // members and turned members of the part that each triangle leads
    let mut counts = vec![[0_usize; 2]; n];
    for &(lead, turned) in &found {
        counts[lead as usize][0] += 1;
        counts[lead as usize][1] += usize::from(turned);
    }
    let mut number = vec![u32::MAX; n];
    let mut parts = Vec::with_capacity(n);
    let (mut next, mut changed) = (0, 0);
    for (t, &(lead, turned)) in found.iter().enumerate() {
        let lead = lead as usize;
        if number[lead] == u32::MAX {
            number[lead] = next;
            next += 1;
        }
        parts.push(number[lead]);
        let [all, against] = counts[lead];
        if turned == (2 * against <= all) {
            mesh.triangles[t].swap(1, 2);
            changed += 1;
        }
    }
    Ok((parts, changed))
}

fn branching(mesh: &TriMesh, edge: &[Side]) -> Broken {
    let count = edge.len();
    Broken::At {
        at_m: mesh.middle_m(edge[0].edge),
        why: format!(
            "{count} triangles meet in an edge at {{at}}, with no outside that all agree on; a solid has 2, export without \
             inner walls"
        ),
    }
}

/// Turns every closed part that is inside out, together with what it contains. A part that is inside out within another
/// is a cavity and stays. Returns the number of parts turned.
fn turn_outward(mesh: &mut TriMesh, parts: &[u32]) -> usize {
    let bodies = bodies(mesh, parts);
    if bodies.iter().all(|b| b.volume_m3 >= 0.0) {
        return 0;
    }
    let turned: Vec<bool> = outermost(mesh, &bodies).into_iter().map(|outer| bodies[outer].volume_m3 < 0.0).collect();
    for (t, &part) in mesh.triangles.iter_mut().zip(parts) {
        if turned[part as usize] {
            t.swap(1, 2);
        }
    }
    turned.into_iter().filter(|&t| t).count()
}

struct Body {
    triangles: Vec<u32>,
    volume_m3: f64,
    low: [f64; 3],
    high: [f64; 3],
}

fn bodies(mesh: &TriMesh, parts: &[u32]) -> Vec<Body> {
    let mut bodies: Vec<Body> = Vec::new();
    for (t, &part) in parts.iter().enumerate() {
        let corners = mesh.corners(t);
        if part as usize == bodies.len() {
            bodies.push(Body { triangles: Vec::new(), volume_m3: 0.0, low: corners[0], high: corners[0] });
        }
        let body = &mut bodies[part as usize];
        let first = body.triangles.first().map_or(corners[0], |&f| mesh.corners(f as usize)[0]);
        let [a, b, c] = corners.map(|v| sub(v, first));
        body.volume_m3 += dot(a, cross(b, c)) / 6.0;
        body.triangles.push(index(t));
        for v in corners {
            body.low = [0, 1, 2].map(|k| body.low[k].min(v[k]));
            body.high = [0, 1, 2].map(|k| body.high[k].max(v[k]));
        }
    }
    bodies
}

/// For each body the largest that contains it, or itself.
fn outermost(mesh: &TriMesh, bodies: &[Body]) -> Vec<usize> {
    let mut by_size: Vec<usize> = (0..bodies.len()).collect();
    by_size.sort_by(|&a, &b| bodies[b].volume_m3.abs().total_cmp(&bodies[a].volume_m3.abs()));
    let mut left = MAX_EVALUATIONS;
    let mut out: Vec<usize> = (0..bodies.len()).collect();
    // bodies that no other contains, largest first
    let mut roots: Vec<usize> = Vec::new();
    for &i in &by_size {
        let inner = &bodies[i];
        let [a, b, c] = mesh.corners(inner.triangles[0] as usize);
        let point = [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0);
        let container = roots.iter().copied().take(MAX_CONTAINERS).find(|&j| {
            let outer = &bodies[j];
            let boxed = (0..3).all(|k| outer.low[k] <= inner.low[k] && inner.high[k] <= outer.high[k]);
            if !boxed || left < outer.triangles.len() {
                return boxed;
            }
            left -= outer.triangles.len();
            winding(mesh, &outer.triangles, point).abs() > 0.5
        });
        match container {
            Some(j) => out[i] = j,
            None => roots.push(i),
        }
    }
    out
}

/// How often the closed surface of `triangles` goes around `point`: ±1 inside, 0 outside.
///
/// Source: van Oosterom and Strackee, *The solid angle of a plane triangle*, IEEE Trans. Biomed. Eng. 30 (1983).
fn winding(mesh: &TriMesh, triangles: &[u32], point: [f64; 3]) -> f64 {
    let solid: f64 = triangles
        .iter()
        .map(|&t| {
            let [a, b, c] = mesh.corners(t as usize).map(|v| sub(v, point));
            let [la, lb, lc] = [a, b, c].map(|v| dot(v, v).sqrt());
            let below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
            2.0 * dot(a, cross(b, c)).atan2(below)
        })
        .sum();
    solid / (4.0 * std::f64::consts::PI)
}

// Closes holes where this does not change the surface that touches the skin.

/// Holes of at most this part of the mesh's extent are filled flat: 3 mm on an object of 60 mm, a fifth of a taxel.
/// What was lost there can stand out from the filling by about half of it.
const SMALL_FRACTION: f64 = 0.05;
/// Most of the surface that such fillings may make up, so that a sieve is not taken for a solid.
const MOST_FILLED_FRACTION: f64 = 0.02;
/// Holes narrower than this part of the extent, along a straight line, are slits beside a vertex that lies on a
/// neighbour's edge (T-junctions), and are filled whatever their length: 6 µm on 60 mm.
const SLIT_FRACTION: f64 = 1e-4;
/// Least cosine between up and the normal of the filling for a hole that counts as opening upward: 60°.
const UPWARD_COSINE: f64 = 0.5;
/// Height of the lid over a mesh that opens upward, above its highest point, as part of its extent: out of reach of a
/// press.
const LID_FRACTION: f64 = 0.25;
/// Longest hole that is triangulated, in edges. The time grows with the cube; several holes may take as long as one of
/// this length.
pub(super) const MAX_EDGES: usize = 2000;

/// What was closed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Closed {
    /// Small holes and slits, filled flat.
    filled: usize,
    /// Holes that open upwards, closed by walls and a lid above everything.
    lids: usize,
}

/// Closes the holes of a mesh whose triangles agree: small ones are filled flat; around one that opens upward, walls go
/// straight up to a lid above everything.
///
/// Walls and lid do not change the lower envelope of a mesh that stands upright: the walls are vertical, and below each
/// point of the lid lies some triangle of the mesh, because a closed surface crosses each vertical line an even number
/// of times. When the mesh leans by θ, so do the walls: what sinks in by d then reaches d tan θ beyond the rim.
fn close_holes(mesh: &mut TriMesh, sides: &Sides) -> Result<Closed, Broken> {
    let missing: Vec<[u32; 2]> = sides
        .edges()
        .filter_map(|edge| match edge {
            // the partner that is missing runs the other way
            [side] => Some(side.directed()).map(|[a, b]| [b, a]),
            _ => None,
        })
        .collect();
    let mut closed = Closed::default();
    let Some(&first) = missing.first() else {
        return Ok(closed);
    };
    let open = |edge: [u32; 2], why: &str, mesh: &TriMesh| {
        let (found, all) = (missing.len(), sides.edges().count());
        Broken::At {
            at_m: mesh.middle_m(edge),
            why: format!("not closed: {found} of {all} edges lack a partner, one at {{at}}: {why}"),
        }
    };
    let Some(loops) = loops(&missing, mesh.vertices.len()) else {
        return Err(open(first, "its border does not close", mesh));
    };
    let extent_m = mesh.extent_m();
    let lid_m = mesh.bounds().map_or(0.0, |(_, high)| high[2]) + LID_FRACTION * extent_m;
    let most_filled_m2 = MOST_FILLED_FRACTION * mesh.area_m2();
    let mut filled_m2 = 0.0;
    let mut cubes = 0.0;
    for ring in loops {
        let outline = Outline::of(mesh, &ring);
        let edge = [ring[0], ring[1]];
        cubes += cube(ring.len());
        if cubes > cube(MAX_EDGES) {
            return Err(open(
                edge,
                "its holes are as long to fill as one of more than 2000 edges; close them, or simplify their borders",
                mesh,
            ));
        }
        let slit = outline.width_m <= SLIT_FRACTION * extent_m;
        if slit || outline.extent_m <= SMALL_FRACTION * extent_m {
            filled_m2 += if slit { 0.0 } else { outline.area_m2() };
            if filled_m2 > most_filled_m2 {
                return Err(open(edge, "its small holes make up more than 2 % of the surface", mesh));
            }
            fill(mesh, &ring, &outline);
            closed.filled += 1;
        } else if outline.normal_m2[2] >= UPWARD_COSINE * outline.area_m2() {
            cover(mesh, &ring, lid_m);
            closed.lids += 1;
        } else {
            return Err(open(
                edge,
                "a hole wider than 5 % of the mesh opens sideways or downward, where it may touch (only one that opens \
                 upward can be closed without guessing)",
                mesh,
            ));
        }
    }
    Ok(closed)
}

/// n³, which is how the time to fill a hole of `edges` edges grows.
pub(super) fn cube(edges: usize) -> f64 {
    (edges as f64).powi(3)
}

/// Simple closed loops of `edges`; `None` if some edge is in none. Where loops touch they are taken apart.
fn loops(edges: &[[u32; 2]], vertices: usize) -> Option<Vec<Vec<u32>>> {
    let mut sorted = edges.to_vec();
    sorted.sort_unstable();
    // the next unused edge of each vertex: they are used in their order
    let mut next = vec![usize::MAX; vertices];
    for (k, edge) in sorted.iter().enumerate().rev() {
        next[edge[0] as usize] = k;
    }
    let mut place: Vec<Option<usize>> = vec![None; vertices];
    let mut out = Vec::new();
    for start in 0..sorted.len() {
        let first = sorted[start][0] as usize;
        if next[first] > start {
            continue;
        }
        next[first] += 1;
        let mut path = vec![sorted[start][0]];
        place[path[0] as usize] = Some(0);
        let mut at = sorted[start][1];
        loop {
            if let Some(from) = place[at as usize] {
                let ring = path.split_off(from);
                ring.iter().for_each(|&v| place[v as usize] = None);
                if ring.len() < 3 {
                    return None;
                }
                out.push(ring);
                if path.is_empty() {
                    break;
                }
            }
            place[at as usize] = Some(path.len());
            path.push(at);
            let edge = sorted.get(next[at as usize]).filter(|edge| edge[0] == at)?;
            next[at as usize] += 1;
            at = edge[1];
        }
    }
    Some(out)
}

/// Size and direction of a loop.
struct Outline {
    /// Area times normal of the flat surface it spans, m² (Newell's formula).
    normal_m2: [f64; 3],
    /// Longest side of its box, m.
    extent_m: f64,
    /// Largest distance from the line between two points far apart, m.
    width_m: f64,
}

impl Outline {
    fn of(mesh: &TriMesh, ring: &[u32]) -> Self {
        let at = |i: usize| mesh.vertices[ring[i % ring.len()] as usize];
        let points = || (0..ring.len()).map(at);
        let mut normal_m2 = [0.0; 3];
        for i in 0..ring.len() {
            let n = cross(sub(at(i), at(0)), sub(at(i + 1), at(0)));
            for k in 0..3 {
                normal_m2[k] += 0.5 * n[k];
            }
        }
        let [low, high] = span(points());
        let farthest = |from: [f64; 3]| {
            let square = |p: [f64; 3]| dot(sub(p, from), sub(p, from));
            points().fold(from, |best, p| if square(p) > square(best) { p } else { best })
        };
        let one = farthest(at(0));
        let other = farthest(one);
        let along = sub(other, one);
        let length_m = dot(along, along).sqrt().max(f64::MIN_POSITIVE);
        let aside = |p: [f64; 3]| {
            let n = cross(sub(p, one), along);
            dot(n, n).sqrt() / length_m
        };
        Self {
            normal_m2,
            extent_m: (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max),
            width_m: points().map(aside).fold(0.0, f64::max),
        }
    }

    fn area_m2(&self) -> f64 {
        dot(self.normal_m2, self.normal_m2).sqrt()
    }
}

/// Fills a loop with triangles between its own corners, seen along the normal of the surface it spans.
fn fill(mesh: &mut TriMesh, ring: &[u32], outline: &Outline) {
    if let [a, b, c] = *ring {
        mesh.triangles.push([a, b, c]);
        return;
    }
    // the two axes across the normal's largest component, in the order that keeps the direction
    let n = outline.normal_m2;
    let up = (0..3).fold(0, |best, k| if n[k].abs() > n[best].abs() { k } else { best });
    let (mut u, mut v) = ((up + 1) % 3, (up + 2) % 3);
    if n[up] < 0.0 {
        (u, v) = (v, u);
    }
    let points: Vec<Point> = ring.iter().map(|&i| mesh.vertices[i as usize]).map(|p| [p[u], p[v]]).collect();
    append(mesh, ring, &points);
}

/// Triangles of the polygon `points`, whose corners are the vertices `ring`, in the direction of the loop.
fn append(mesh: &mut TriMesh, ring: &[u32], points: &[Point]) {
    let along = signed_area_m2(points) > 0.0;
    for corners in triangulate(points, &[]) {
        let [a, b, c] = corners.map(|i| ring[i]);
        mesh.triangles.push(if along { [a, b, c] } else { [a, c, b] });
    }
}

/// Walls from a loop straight up to `lid_m`, and a lid between them.
fn cover(mesh: &mut TriMesh, ring: &[u32], lid_m: f64) {
    let n = ring.len();
    let base = mesh.vertices.len();
    let points: Vec<[f64; 3]> = ring.iter().map(|&i| mesh.vertices[i as usize]).collect();
    mesh.vertices.extend(points.iter().map(|p| [p[0], p[1], lid_m]));
    let lid: Vec<u32> = (base..base + n).map(index).collect();
    for i in 0..n {
        let j = (i + 1) % n;
        let [p, q, above_p, above_q] = [ring[i], ring[j], lid[i], lid[j]];
        mesh.triangles.extend([[p, q, above_q], [p, above_q, above_p]]);
    }
    let flat: Vec<Point> = points.iter().map(|p| [p[0], p[1]]).collect();
    append(mesh, &lid, &flat);
}

/// How many extents from the origin the middle of a mesh may be before it is moved there to be mended.
const FAR_EXTENTS: f64 = 100.0;
/// Vertices closer than this fraction of the extent are one vertex. f32 files carry 6e-8 of rounding per coordinate;
/// 1e-6 is 10× what two roundings of one point can differ by, and a thousandth of the finest feature that matters.
const WELD_FRACTION: f64 = 1e-6;
/// Least volume as a fraction of extent³; a sheet of paper (0.1 mm × 210 mm × 297 mm) has 2.4e-4, a folded surface
/// without inside has rounding, about 1e-7.
const LEAST_VOLUME_FRACTION: f64 = 1e-6;
/// An open surface no thicker than this part of its extent is a sheet: half a millimetre on 50 mm.
const FLAT_FRACTION: f64 = 1e-2;

/// Scales `raw` to metres, repairs and checks it (1 mm to 2 m across, closed, with an inside), and decimates it if it
/// has more than [`SOFT_MAX_TRIANGLES`] triangles. `file` is the name in errors.
///
/// Repairs: coinciding vertices are joined. Degenerate and duplicate triangles are dropped. Triangles that face against
/// their neighbours and parts that are inside out are turned (a cavity is not inside out). Small holes are filled flat.
/// Holes that open upwards are closed above everything, which leaves the underside unchanged. Parts may overlap: only
/// the underside of their union touches.
///
/// A mesh that cannot be closed this way is pressed as it is if none of its holes is seen from below, or if
/// [`Repair::NearSide`] asks for it.
///
/// These are refused: coordinates that are not finite, other sizes, other meshes that are not closed, and surfaces
/// without an inside.
///
/// The unit is never guessed: an object 40 units wide may be 40 mm, 40 cm or 40 inches wide, and each of these could
/// press on a skin. The error suggests scales that would fit.
///
/// # Errors
/// [`MeshError`] with the first problem.
pub fn checked(raw: &TriMesh, options: impl Into<MeshOptions>, file: &str) -> Result<(TriMesh, MeshReport), MeshError> {
    let MeshOptions { scale, repair, centre } = options.into();
    check_numbers(raw, scale, file)?;
    let [low, high] = span(raw.triangles.iter().flatten().map(|&i| raw.vertices[i as usize]));
    let raw_extent = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
    // vertices of a mesh far too small all coincide, which would hide that its scale is wrong
    if raw_extent > 0.0 && raw_extent * scale < MIN_EXTENT_M {
        return Err(far_from_metres(raw_extent * scale, raw_extent, scale, file));
    }
    let tolerance_m = WELD_FRACTION * raw_extent * scale;
    // what is far away is mended at the origin, where its digits suffice
    let middle = [0, 1, 2].map(|k| 0.5 * (low[k] + high[k]));
    let is_far = middle.iter().any(|x| x.abs() > FAR_EXTENTS * raw_extent);
    let away = if is_far { middle } else { [0.0; 3] };
    let near = raw.clone().translated(away.map(|x| -x)).scaled([scale; 3]);
    let away_m = away.map(|x| x * scale);
    let (mesh, joined_vertices, dropped_triangles) = near.welded(tolerance_m);
    let as_is = repair == Repair::NearSide;
    let (mut mesh, duplicate_triangles) = mesh.without_duplicates(as_is);
    if mesh.triangles.is_empty() {
        return Err(match duplicate_triangles {
            0 => no_triangles(file, dropped_triangles),
            _ => no_volume(file, [0, 1, 2].map(|k| (high[k] - low[k]) * scale)),
        });
    }
    let extent_m = mesh.extent_m();
    if !fits(extent_m) {
        return Err(far_from_metres(extent_m, raw_extent, scale, file));
    }
    let mut closed = mesh.clone();
    let mended = mend(&mut closed).and_then(|mended| {
        let sides_m = closed.sides_m();
        let least_m3 = LEAST_VOLUME_FRACTION * closed.extent_m().powi(3);
        if closed.volume_m3() < least_m3 { Err(Broken::Sheet(sides_m)) } else { Ok(mended) }
    });
    let mended = match mended {
        // a lid is no part of a mesh that is to be pressed as it is
        Ok(mended) if !(as_is && mended.lids > 0) => {
            mesh = closed;
            mended
        }
        unmended => {
            let open_below = mesh.edge_open_below();
            if let Err(broken) = unmended
                && !as_is
                && (open_below.is_some() || matches!(broken, Broken::Sheet(_)))
            {
                let broken = if mesh.is_flat() { Broken::Sheet(mesh.sides_m()) } else { broken };
                return Err(broken.error(scale, away_m, file));
            }
            // which way an open surface faces says nothing about what touches
            if mesh.volume_m3() < 0.0 {
                mesh = mesh.flipped();
            }
            MeshReport {
                open_edges: mesh.open_edges(),
                open_below_m: open_below.map(|edge| mesh.middle_m(edge)),
                ..MeshReport::default()
            }
        }
    };
    let mut report = MeshReport { joined_vertices, dropped_triangles, duplicate_triangles, ..mended };
    if mesh.triangles.len() > SOFT_MAX_TRIANGLES
        && let Some((fewer, error_m)) = mesh.decimated()
    {
        report.decimated_from = Some(mesh.triangles.len());
        report.decimation_error_m = Some(error_m);
        mesh = fewer;
    }
    let mut move_m = away_m;
    if centre {
        let (low, high) = mesh.bounds().unwrap_or_default();
        move_m = [-0.5 * (low[0] + high[0]), -0.5 * (low[1] + high[1]), -low[2]];
        report.centred_by_m = Some([0, 1, 2].map(|k| move_m[k] - away_m[k]));
    }
    if is_far || centre {
        mesh = mesh.translated(move_m);
        report.open_below_m = report.open_below_m.map(|at| [0, 1, 2].map(|k| at[k] + move_m[k]));
    }
    let (low, high) = mesh.bounds().unwrap_or_default();
    report.vertices = mesh.vertices.len();
    report.triangles = mesh.triangles.len();
    report.heavy = mesh.triangles.len() > SOFT_MAX_TRIANGLES;
    report.extent_m = mesh.sides_m();
    report.middle_m = [0, 1, 2].map(|k| 0.5 * (low[k] + high[k]));
    report.volume_m3 = mesh.volume_m3();
    Ok((mesh, report))
}

/// Makes the triangles agree, closes what may be closed and turns the parts outward. Reports what it did.
fn mend(mesh: &mut TriMesh) -> Result<MeshReport, Broken> {
    let sides = Sides::of(mesh);
    let (mut parts, turned_triangles) = agree(mesh, &sides)?;
    let sides = if turned_triangles > 0 { Sides::of(mesh) } else { sides };
    let branches = sides.edges().any(|edge| edge.len() > 2);
    let closed = close_holes(mesh, &sides)?;
    if closed != Closed::default() {
        (parts, _) = agree(mesh, &Sides::of(mesh))?;
    }
    let flipped = turn_outward(mesh, &parts) > 0;
    // edges of two triangles agree by now; those of four and more have not been looked at
    let sides = (branches || closed != Closed::default()).then(|| Sides::of(mesh));
    let unbalanced = |sides: &Sides| sides.edges().find(|edge| balance(edge) != 0).map(<[_]>::to_vec);
    if let Some(edge) = sides.as_ref().and_then(unbalanced) {
        return Err(branching(mesh, &edge));
    }
    Ok(MeshReport {
        turned_triangles,
        flipped,
        filled_holes: closed.filled,
        lids: closed.lids,
        ..MeshReport::default()
    })
}

/// The error of a surface that encloses nothing.
fn no_volume(file: &str, sides_m: [f64; 3]) -> MeshError {
    let [x, y, z] = sides_m.map(|m| format!("{:.4e}", 1e3 * m).parse::<f64>().unwrap_or_default());
    refused(
        file,
        format_args!(
            "encloses no volume: it is a sheet of {x} × {y} × {z} mm, whatever its unit; give it a thickness where it was \
             drawn{AS_IS}"
        ),
    )
}

impl TriMesh {
    /// Sides of the box around the vertices, m.
    fn sides_m(&self) -> [f64; 3] {
        self.bounds().map_or([0.0; 3], |(low, high)| [0, 1, 2].map(|k| high[k] - low[k]))
    }

    /// Whether all vertices lie near one plane, in whatever direction.
    fn is_flat(&self) -> bool {
        let points = || self.vertices.iter().map(|v| Vector3::from(*v));
        let mean = points().sum::<Vector3<f64>>() / self.vertices.len().max(1) as f64;
        let spread: Matrix3<f64> = points().map(|p| (p - mean) * (p - mean).transpose()).sum();
        let eigen = spread.symmetric_eigen();
        let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        let [[low], [high]] = span(points().map(|p| [normal.dot(&(p - mean))]));
        high - low <= FLAT_FRACTION * self.extent_m()
    }
}

fn no_triangles(file: &str, dropped: usize) -> MeshError {
    let why = format!("0 triangles of non-zero size ({dropped} degenerate ones dropped); at least 4 are needed");
    refused(file, why)
}

/// Finite coordinates, indices in range, a scale that can be used.
fn check_numbers(raw: &TriMesh, scale: f64, file: &str) -> Result<(), MeshError> {
    if !(scale > 0.0 && scale.is_finite()) {
        return Err(refused(file, format_args!("scale = {scale} is outside (0, ∞)")));
    }
    if raw.triangles.is_empty() {
        return Err(no_triangles(file, 0));
    }
    let (vertices, triangles) = (raw.vertices.len(), raw.triangles.len());
    within_budget(vertices, triangles, file)?;
    let far = |vertex: usize, axis: char, value: f64| {
        let (value, metres) = (short(value), short(value * scale));
        let range = format_args!("outside [-{MAX_COORDINATE_M}, {MAX_COORDINATE_M}] m");
        Err(refused(file, format_args!("vertex {vertex} has {axis} = {value} = {metres} m after scale, {range}")))
    };
    for (vertex, v) in raw.vertices.iter().enumerate() {
        for (axis, &value) in ['x', 'y', 'z'].into_iter().zip(v) {
            if !value.is_finite() {
                return Err(not_finite(file, vertex, axis, value));
            }
            if !(value * scale).is_finite() {
                return far(vertex, axis, value);
            }
        }
    }
    for (triangle, t) in raw.triangles.iter().enumerate() {
        if let Some(&index) = t.iter().find(|&&i| i as usize >= vertices) {
            return Err(out_of_range(file, triangle, index, vertices));
        }
        // only those of triangles: a stray vertex does no harm
        for &i in t {
            let vertex = i as usize;
            for (axis, value) in ['x', 'y', 'z'].into_iter().zip(raw.vertices[vertex]) {
                if (value * scale).abs() > MAX_COORDINATE_M {
                    return far(vertex, axis, value);
                }
            }
        }
    }
    Ok(())
}

/// Refuses a mesh of more `vertices` or `triangles` than can be repaired in the memory of a small machine. Readers ask
/// before they make room for them.
pub(super) fn within_budget(vertices: usize, triangles: usize, file: &str) -> Result<(), MeshError> {
    let counts = [("number of triangles", triangles, MAX_TRIANGLES), ("number of vertices", vertices, MAX_VERTICES)];
    match counts.into_iter().find(|(_, found, most)| found > most) {
        None => Ok(()),
        Some((what, found, most)) => Err(too_large(file, what, found, most)),
    }
}

/// Whether something of this extent may press on a skin.
fn fits(extent_m: f64) -> bool {
    (MIN_EXTENT_M..=MAX_EXTENT_M).contains(&extent_m)
}

/// The usual units in which an object of `raw_extent` units may press on a skin, those first that make it as large as
/// things that are held.
fn fitting_units(raw_extent: f64) -> Vec<(&'static str, f64)> {
    let units =
        [("metres", 1.0), ("millimetres", 1e-3), ("inches", 25.4e-3), ("centimetres", 1e-2), ("micrometres", 1e-6)];
    let mut fitting: Vec<_> = units.into_iter().filter(|(_, scale)| fits(raw_extent * scale)).collect();
    fitting.sort_by_key(|(_, scale)| !(0.01..=0.5).contains(&(raw_extent * scale)));
    fitting
}

/// The error for a mesh of the wrong size, `raw_extent` in the unit of the file.
fn far_from_metres(extent_m: f64, raw_extent: f64, scale: f64, file: &str) -> MeshError {
    let suggestion = fitting_units(raw_extent).first().copied();
    MeshError::FarFromMetres { file: file.to_owned(), extent_m, scale, suggestion }
}
