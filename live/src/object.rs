//! What presses: an object of the table, or a mesh that was dropped onto the page.

use serde::{Deserialize, Serialize};
use spts::Refusal;
use spts_contact::PreparedMesh;
use spts_contact::mesh::{MeshError, MeshReport, TriMesh, read_glb, read_obj, read_stl, unknown_extension};
use spts_contact::objects::pressable;

/// Side of a mesh that touches the skin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// −z of the file.
    #[default]
    Bottom,
    /// +z.
    Top,
    /// −y.
    Front,
    /// +y.
    Back,
    /// −x.
    Left,
    /// +x.
    Right,
}

impl Side {
    /// Rotation that turns the side downward.
    fn matrix(self) -> [[f64; 3]; 3] {
        match self {
            Self::Bottom => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            Self::Top => [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]],
            Self::Front => [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
            Self::Back => [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
            Self::Left => [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]],
            Self::Right => [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]],
        }
    }
}

/// An object that is ready to press.
#[derive(Debug, Clone)]
pub struct LiveObject {
    /// Name: of the table, or of the file.
    pub name: String,
    /// The mesh, contact face towards −z; its origin is where the mouse is.
    pub mesh: PreparedMesh,
    /// Stiffness of its own surface, Pa/m.
    pub stiffness_pa_per_m: f64,
    /// Angle at which it begins, degrees.
    pub degrees: f64,
}

impl LiveObject {
    /// The object of the table with this name.
    ///
    /// # Errors
    /// [`Refusal`] when there is none.
    pub fn named(name: &str) -> Result<Self, Refusal> {
        let Some(spec) = pressable().find(|spec| spec.name == name) else {
            let known: Vec<&str> = pressable().map(|spec| spec.name).collect();
            return Err(unknown("object", name, &known));
        };
        Ok(Self {
            name: spec.name.to_owned(),
            mesh: PreparedMesh::from((spec.build)()),
            stiffness_pa_per_m: spec.stiffness_pa_per_m.unwrap_or(f64::INFINITY),
            degrees: spec.placement.rotation_rad.to_degrees().round(),
        })
    }

    /// A rigid body of the shape of `mesh`, on `side`, held over the middle of its box.
    pub fn of_mesh(name: &str, mesh: &TriMesh, side: Side) -> Self {
        let turned = mesh.clone().rotated(side.matrix());
        let middle = [0, 1].map(|axis| {
            let values = turned.vertices.iter().map(|v| v[axis]);
            let [low, high] =
                values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
            0.5 * (low + high)
        });
        Self {
            name: name.to_owned(),
            mesh: PreparedMesh::from(turned.translated([-middle[0], -middle[1], 0.0])),
            stiffness_pa_per_m: f64::INFINITY,
            degrees: 0.0,
        }
    }

    /// What of it can be seen from below.
    pub fn shape(&self) -> Shape {
        Shape::of(&self.name, self.degrees, &self.mesh)
    }
}

/// The underside of an object, as the page draws it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "type", rename = "shape")]
pub struct Shape {
    /// Name of the object.
    pub name: String,
    /// Angle at which it begins, degrees.
    pub degrees: f64,
    /// x and y of every triangle's three corners, mm, before it is turned.
    pub corners_mm: Vec<[f32; 6]>,
    /// Height of every triangle's middle above the lowest point, mm.
    pub heights_mm: Vec<f32>,
}

impl Shape {
    #[expect(clippy::cast_possible_truncation, reason = "millimetres on a screen")]
    fn of(name: &str, degrees: f64, mesh: &TriMesh) -> Self {
        let tenth = |m: f64| ((1e4 * m).round() / 10.0) as f32;
        let low_m = mesh.vertices.iter().map(|v| v[2]).fold(f64::INFINITY, f64::min);
        let mut seen: Vec<(f32, [f32; 6])> = Vec::new();
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.vertices[i as usize]);
            let up = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            if up < 0.0 {
                let height = tenth((a[2] + b[2] + c[2]) / 3.0 - low_m);
                let corners = [a[0], a[1], b[0], b[1], c[0], c[1]].map(tenth);
                seen.push((height, corners));
            }
        }
        // far ones first, so that near ones cover them
        seen.sort_by(|a, b| b.0.total_cmp(&a.0));
        Self {
            name: name.to_owned(),
            degrees,
            heights_mm: seen.iter().map(|(height, _)| *height).collect(),
            corners_mm: seen.into_iter().map(|(_, corners)| corners).collect(),
        }
    }
}

/// The name of something that is not in its table.
pub(crate) fn unknown(field: &str, name: &str, known: &[&str]) -> Refusal {
    Refusal::new(format!("`{field}` = {name:?}; valid: {}", known.join(", ")))
}

/// Largest mesh file, bytes: a million triangles of a binary STL have 50 MB.
pub(crate) const MOST_MESH_BYTES: usize = 1 << 26;
/// Longest name of a file, characters.
const MOST_NAME: usize = 120;

/// Unit of a mesh file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MeshUnit {
    /// The one in which it is as large as a thing: metres for GLB, else millimetres, else the most plausible of the
    /// usual ones.
    #[default]
    Guess,
    /// Millimetres.
    Millimetres,
    /// Centimetres.
    Centimetres,
    /// Metres.
    Metres,
    /// Inches.
    Inches,
}

/// A mesh of a file, ready to press on any of its sides.
#[derive(Debug, Clone)]
pub struct UploadedMesh {
    /// Name of the file.
    pub name: String,
    mesh: TriMesh,
    /// It lying on its bottom.
    pub object: LiveObject,
    /// What was repaired, and its size: a line each.
    pub notes: Vec<String>,
}

type Read = fn(&[u8], f64, &str) -> Result<(TriMesh, MeshReport), MeshError>;

impl UploadedMesh {
    /// Reads the file `name`, whose ending says whether it is STL, OBJ or GLB.
    ///
    /// # Errors
    /// [`Refusal`] for a mesh that cannot press.
    pub fn read(name: &str, unit: MeshUnit, bytes: &[u8]) -> Result<Self, Refusal> {
        let extension = name.rsplit_once('.').map_or("", |(_, end)| end).to_ascii_lowercase();
        let shown = |text: &str| -> String { text.chars().filter(|c| !c.is_control()).take(MOST_NAME).collect() };
        let (name, extension) = (shown(name), shown(&extension));
        let read: Read = match extension.as_str() {
            "stl" => read_stl,
            "obj" => read_obj,
            "glb" => read_glb,
            _ => return Err(Refusal::from_error(unknown_extension(&name, &extension))),
        };
        let scale = match unit {
            MeshUnit::Guess if extension == "glb" => 1.0,
            MeshUnit::Guess | MeshUnit::Millimetres => 1e-3,
            MeshUnit::Centimetres => 1e-2,
            MeshUnit::Metres => 1.0,
            MeshUnit::Inches => 25.4e-3,
        };
        let (mesh, report) = match read(bytes, scale, &name) {
            Err(MeshError::FarFromMetres { suggestion: Some((_, fits)), .. }) if unit == MeshUnit::Guess => {
                read(bytes, fits, &name)
            }
            read => read,
        }
        .map_err(Refusal::from_error)?;
        let [x, y, z] = report.extent_m.map(|m| 1e3 * m);
        let mut notes = vec![format!("{name}: {x:.0} × {y:.0} × {z:.0} mm, {} triangles", report.triangles)];
        // it is held over its middle, wherever its origin is
        let centred = MeshReport { middle_m: [0.0; 3], ..report };
        notes.extend(centred.notes());
        Ok(Self { object: LiveObject::of_mesh(&name, &mesh, Side::Bottom), mesh, notes, name })
    }

    /// It lying on `side`.
    pub fn on(&self, side: Side) -> LiveObject {
        LiveObject::of_mesh(&self.name, &self.mesh, side)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_contact::mesh::cuboid;

    /// Every side of a box whose six sides differ in their middles is the one that ends below.
    #[test]
    fn sides_face_down() {
        let axes = [
            (Side::Bottom, 2, -1.0),
            (Side::Top, 2, 1.0),
            (Side::Front, 1, -1.0),
            (Side::Back, 1, 1.0),
            (Side::Left, 0, -1.0),
            (Side::Right, 0, 1.0),
        ];
        for (side, axis, sign) in axes {
            let mut point = [0.0; 3];
            point[axis] = sign;
            let turned = side.matrix().map(|row| (0..3).map(|k| row[k] * point[k]).sum::<f64>());
            assert!((turned[2] + 1.0).abs() < 1e-15, "{side:?}: {turned:?}");
            let m = side.matrix();
            let det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
                - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
                + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
            assert!((det - 1.0).abs() < 1e-15, "{side:?} mirrors");
        }
    }

    #[test]
    fn a_box_shows_its_lower_side() {
        let mesh = cuboid([0.04, 0.02, 0.01]).translated([0.1, 0.0, 0.0]);
        let shape = LiveObject::of_mesh("box.stl", &mesh, Side::Bottom).shape();
        assert_eq!(shape.corners_mm.len(), 2);
        assert!(shape.heights_mm.iter().all(|h| *h < 0.01));
        let far = shape.corners_mm.iter().flatten().fold(0.0_f32, |far, v| far.max(v.abs()));
        assert!((far - 20.0).abs() < 1e-6, "{far}");
    }

    #[test]
    fn every_object_can_be_chosen() {
        for spec in pressable() {
            let object = LiveObject::named(spec.name).unwrap();
            assert!(!object.shape().corners_mm.is_empty(), "{}", spec.name);
        }
        let message = LiveObject::named("teapot").unwrap_err().to_string();
        assert!(message.contains("`object` = \"teapot\"") && message.contains("tennis"), "{message}");
    }

    #[test]
    fn the_unit_is_found_where_it_is_not_said() {
        for (size, unit, wide_mm) in [
            ([40.0, 30.0, 20.0], MeshUnit::Guess, 40.0),
            ([0.04, 0.03, 0.02], MeshUnit::Guess, 40.0),
            ([4.0, 3.0, 2.0], MeshUnit::Centimetres, 40.0),
            ([0.04, 0.03, 0.02], MeshUnit::Metres, 40.0),
            ([2.0, 1.0, 1.0], MeshUnit::Inches, 50.8),
        ] {
            let obj = cuboid(size).to_obj("box");
            let mesh = UploadedMesh::read("box.OBJ", unit, obj.as_bytes()).unwrap();
            let corners = mesh.object.shape().corners_mm;
            let far = corners.iter().flatten().fold(0.0_f32, |far, v| far.max(v.abs()));
            assert!((2.0 * f64::from(far) - wide_mm).abs() < 0.11, "{size:?} {unit:?}: {far}");
        }
    }

    #[test]
    fn what_is_no_mesh_is_refused_with_its_name() {
        let cut = &cuboid([40.0; 3]).to_obj("box")[..60];
        for (name, bytes, fact) in [
            ("cup.step", &b""[..], "extension `step`"),
            ("cup", b"", "extension ``"),
            ("cup.stl", b"solid nothing", "cup.stl"),
            ("cup.glb", b"glTF", "cup.glb"),
            ("cup.obj", cut.as_bytes(), "cup.obj"),
            ("cup.obj", b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3", "not a finite number"),
        ] {
            let message = UploadedMesh::read(name, MeshUnit::Guess, bytes).unwrap_err().to_string();
            assert!(message.contains(fact), "{name}: {message}");
        }
    }
}
