//! What touches a skin.

use crate::refuse::refuse;
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods as _};
use pyo3::prelude::*;
use spts::contact::mesh::{TriMesh, load, sphere};
use spts::contact::{PreparedMesh, TouchBody};
use std::path::PathBuf;

/// A rigid or soft body: a triangle mesh in its own axes, in metres.
///
/// A body is a key: `skin.touch({cup: pose})`.
#[pyclass(frozen, module = "spts")]
pub(crate) struct Body {
    pub(crate) body: TouchBody,
    /// Stiffness of its surface, Pa/m.
    pub(crate) stiffness_pa_per_m: f64,
}

impl Body {
    fn new(mesh: TriMesh, stiffness: Option<f64>) -> PyResult<Self> {
        let stiffness_pa_per_m = stiffness.unwrap_or(f64::INFINITY);
        if !(stiffness_pa_per_m >= 1e4) {
            return Err(refuse(format!(
                "`stiffness` = {stiffness_pa_per_m} is outside [1e4, inf] Pa/m"
            )));
        }
        Ok(Self {
            body: PreparedMesh::from(mesh).into(),
            stiffness_pa_per_m,
        })
    }
}

#[pymethods]
impl Body {
    /// Body from a file that ends in .stl, .obj or .glb, times `scale` metres a unit.
    #[staticmethod]
    #[pyo3(signature = (path, scale = 1.0, stiffness = None))]
    fn from_mesh(path: PathBuf, scale: f64, stiffness: Option<f64>) -> PyResult<Self> {
        if !(scale > 0.0 && scale <= 1e3) {
            return Err(refuse(format!("`scale` = {scale} is outside (0, 1000]")));
        }
        let (mesh, _) = load(&path, scale).map_err(refuse)?;
        Self::new(mesh, stiffness)
    }

    /// Body from `vertices` (V, 3) in metres and `faces` (F, 3), counter-clockwise seen from outside.
    #[staticmethod]
    #[pyo3(signature = (vertices, faces, stiffness = None))]
    fn from_vertices(
        vertices: PyReadonlyArray2<'_, f64>,
        faces: PyReadonlyArray2<'_, i64>,
        stiffness: Option<f64>,
    ) -> PyResult<Self> {
        for (name, shape) in [("vertices", vertices.shape()), ("faces", faces.shape())] {
            if shape[1] != 3 || shape[0] == 0 {
                return Err(refuse(format!(
                    "`{name}` has shape {shape:?}; (n, 3) with n > 0 is needed"
                )));
            }
        }
        let rows = vertices.as_array();
        let vertices: Vec<[f64; 3]> = rows.rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect();
        if let Some(i) = vertices.iter().position(|v| !v.iter().all(|x| x.abs() <= 1e3)) {
            let v = vertices[i];
            return Err(refuse(format!("`vertices[{i}]` = {v:?} is outside [-1000, 1000] m")));
        }
        let mut triangles = Vec::with_capacity(faces.shape()[0]);
        for (i, row) in faces.as_array().rows().into_iter().enumerate() {
            let mut corners = [0; 3];
            for (corner, index) in corners.iter_mut().zip(row) {
                let known = u32::try_from(*index).ok().filter(|k| (*k as usize) < vertices.len());
                *corner = known.ok_or_else(|| {
                    let last = vertices.len() - 1;
                    refuse(format!("`faces[{i}]` names vertex {index}; valid: [0, {last}]"))
                })?;
            }
            triangles.push(corners);
        }
        let mesh = TriMesh { vertices, triangles };
        if mesh.volume_m3() < 0.0 {
            return Err(refuse(
                "`faces` run clockwise seen from outside: swap two of their columns",
            ));
        }
        Self::new(mesh, stiffness)
    }

    /// Ball of `radius` metres, its origin in its middle.
    #[staticmethod]
    #[pyo3(signature = (radius, stiffness = None))]
    fn sphere(radius: f64, stiffness: Option<f64>) -> PyResult<Self> {
        if !(radius > 0.0 && radius <= 10.0) {
            return Err(refuse(format!("`radius` = {radius} is outside (0, 10] m")));
        }
        Self::new(sphere(radius, 36, 64).translated([0.0, 0.0, -radius]), stiffness)
    }

    /// Number of triangles.
    #[getter]
    fn triangles(&self) -> usize {
        self.body.mesh.triangles.len()
    }

    fn __repr__(&self) -> String {
        format!("<spts.Body of {} triangles>", self.triangles())
    }
}
