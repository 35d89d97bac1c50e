//! A mesh that was dropped onto the page.

use crate::error::LiveError;
use crate::object::{LiveObject, Side};
use serde::Deserialize;
use spts_contact::mesh::{MeshError, MeshReport, TriMesh, read_glb, read_obj, read_stl};

/// Largest mesh file, bytes: a million triangles of a binary STL have 50 MB.
pub(crate) const MOST_MESH_BYTES: usize = 1 << 26;
/// Longest name of a file, characters.
const MOST_NAME: usize = 120;

/// Unit of a mesh file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MeshUnit {
    /// The one in which it is as large as a thing: metres for GLB, else millimetres, else the first usual one that
    /// fits.
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
    /// [`LiveError::Mesh`] for a mesh that cannot press.
    pub fn read(name: &str, unit: MeshUnit, bytes: &[u8]) -> Result<Self, LiveError> {
        let extension = name.rsplit_once('.').map_or("", |(_, end)| end).to_ascii_lowercase();
        let shown = |text: &str| -> String { text.chars().filter(|c| !c.is_control()).take(MOST_NAME).collect() };
        let (name, extension) = (shown(name), shown(&extension));
        let read: Read = match extension.as_str() {
            "stl" => read_stl,
            "obj" => read_obj,
            "glb" => read_glb,
            _ => return Err(MeshError::UnknownExtension { file: name, extension }.into()),
        };
        let scale = match unit {
            MeshUnit::Guess if extension == "glb" => 1.0,
            MeshUnit::Guess | MeshUnit::Millimetres => 1e-3,
            MeshUnit::Centimetres => 1e-2,
            MeshUnit::Metres => 1.0,
            MeshUnit::Inches => 25.4e-3,
        };
        let (mesh, report) = match read(bytes, scale, &name) {
            Err(MeshError::FarFromMetres {
                suggestion: Some((_, fits)),
                ..
            }) if unit == MeshUnit::Guess => read(bytes, fits, &name)?,
            read => read?,
        };
        let [x, y, z] = report.extent_m.map(|m| 1e3 * m);
        let mut notes = vec![format!(
            "{name}: {x:.0} × {y:.0} × {z:.0} mm, {} triangles",
            report.triangles
        )];
        // it is held over its middle, wherever its origin is
        let centred = MeshReport {
            middle_m: [0.0; 3],
            ..report
        };
        notes.extend(centred.notes());
        Ok(Self {
            object: LiveObject::of_mesh(&name, &mesh, Side::Bottom),
            mesh,
            notes,
            name,
        })
    }

    /// It lying on `side`.
    #[must_use]
    pub fn on(&self, side: Side) -> LiveObject {
        LiveObject::of_mesh(&self.name, &self.mesh, side)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_contact::mesh::cuboid;

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
            assert!(
                (2.0 * f64::from(far) - wide_mm).abs() < 0.11,
                "{size:?} {unit:?}: {far}"
            );
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
            (
                "cup.obj",
                b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3",
                "not a finite number",
            ),
        ] {
            let message = UploadedMesh::read(name, MeshUnit::Guess, bytes)
                .unwrap_err()
                .to_string();
            assert!(message.contains(fact), "{name}: {message}");
        }
    }
}
