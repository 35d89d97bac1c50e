//! What touches a skin.

use crate::args::{Array2, triples};
use crate::common::{refuse, warn};
use numpy::{
    AllowTypeChange, IntoPyArray as _, PyArray2, PyArrayLike2, PyArrayMethods as _, PyUntypedArrayMethods as _,
};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use spts::contact::mesh::{MeshOptions, Repair, TriMesh, cuboid, load, revolve, sphere};
use spts::contact::{Part, PreparedMesh, Primitive, TouchBody};
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::PathBuf;

/// A rigid or soft body: a triangle mesh in its own axes, in metres.
///
/// A body is a key: `skin.touch({cup: pose})`.
#[pyclass(frozen, module = "spts")]
pub(crate) struct Body {
    pub(crate) body: TouchBody,
    /// Stiffness of its surface, Pa/m.
    pub(crate) stiffness_pa_per_m: f64,
    /// How far its surface is at most from that of the mesh that was given, m: as `tolerance` allowed.
    #[pyo3(get, name = "error")]
    error_m: f64,
}

/// Rings and segments of a ball.
const RINGS: usize = 96;
const SEGMENTS: usize = 192;

/// Mesh of a body of revolution about z with the volume of the body itself: its corners lie a little outside, the
/// middles of its faces a little inside, by 1e-4 of the radius.
fn round(profile: &[[f64; 2]], volume_m3: f64) -> TriMesh {
    let mesh = revolve(profile, SEGMENTS);
    let wider = (volume_m3 / mesh.volume_m3()).sqrt();
    mesh.scaled([wider, wider, 1.0])
}

/// Profile of a half ball of `radius_m` from its widest to its tip, above `z_m`.
fn cap(radius_m: f64, z_m: f64) -> impl DoubleEndedIterator<Item = [f64; 2]> {
    let quarter = RINGS / 2;
    (0..quarter).map(move |k| {
        let (sin, cos) = (FRAC_PI_2 * k as f64 / quarter as f64).sin_cos();
        [radius_m * cos, z_m + radius_m * sin]
    })
}

impl Body {
    /// `mesh`, with fewer triangles if its surface may err by `tolerance` metres.
    fn simpler(mesh: TriMesh, tolerance: Option<f64>) -> PyResult<(TriMesh, f64)> {
        let Some(tolerance_m) = tolerance else {
            return Ok((mesh, 0.0));
        };
        if !(0.0..=1.0).contains(&tolerance_m) {
            bail!("`tolerance` = {tolerance_m} is outside [0, 1] m");
        }
        Ok(mesh.within(tolerance_m).unwrap_or((mesh, 0.0)))
    }

    fn new(mesh: TriMesh, parts: Vec<Part>, stiffness: Option<f64>) -> PyResult<Self> {
        let stiffness_pa_per_m = stiffness.unwrap_or(f64::INFINITY);
        if !(1e4..=f64::INFINITY).contains(&stiffness_pa_per_m) {
            bail!("`stiffness` = {stiffness_pa_per_m} is outside [1e4, inf] Pa/m");
        }
        let mesh = PreparedMesh::from(mesh);
        let body = if parts.is_empty() { mesh.into() } else { TouchBody::of_parts(mesh, parts) };
        Ok(Self { body, stiffness_pa_per_m, error_m: 0.0 })
    }

    /// One convex shape in its own axes, with the mesh of its surface.
    fn shaped(mesh: TriMesh, shape: Primitive, stiffness: Option<f64>) -> PyResult<Self> {
        let rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Self::new(mesh, vec![Part { shape, rotation, position_m: [0.0; 3] }], stiffness)
    }
}

#[pymethods]
impl Body {
    /// Body from a file that ends in .stl, .obj or .glb, times `scale` metres a unit.
    ///
    /// `repair` says what is done with a mesh that is not closed. "strict": it is closed where that is clear, used as
    /// it is where no hole shows from below (-z), and refused otherwise. "near_side": it is used as it is, as a shell
    /// without thickness. With `centre`, its origin becomes the middle of its footprint. A warning names every repair.
    /// With `tolerance`, its surface may err by so many metres, for fewer triangles: `error` says by how much it does.
    #[staticmethod]
    #[pyo3(signature = (path, scale = 1.0, stiffness = None, repair = "strict", centre = false, tolerance = None))]
    fn from_mesh(
        py: Python<'_>,
        path: PathBuf,
        scale: f64,
        stiffness: Option<f64>,
        repair: &str,
        centre: bool,
        tolerance: Option<f64>,
    ) -> PyResult<Self> {
        if !(scale > 0.0 && scale <= 1e3) {
            bail!("`scale` = {scale} is outside (0, 1000]");
        }
        let repair = match repair {
            "strict" => Repair::Strict,
            "near_side" => Repair::NearSide,
            _ => bail!("`repair` = \"{repair}\"; valid: \"strict\", \"near_side\""),
        };
        let (mesh, report) = load(&path, MeshOptions { scale, repair, centre }).map_err(refuse)?;
        for note in report.notes() {
            warn(py, &note)?;
        }
        let (mesh, error_m) = Self::simpler(mesh, tolerance)?;
        Ok(Self { error_m, ..Self::new(mesh, Vec::new(), stiffness)? })
    }

    /// Body from `vertices` (V, 3) in metres and `faces` (F, 3), counter-clockwise seen from outside. Faces that run
    /// clockwise are turned, with a warning.
    ///
    /// `parts` are the convex shapes that it is made of, if they are known: (kind, size (3,), position (3,), rotation
    /// matrix (9,)), with the kinds and sizes of MuJoCo's geoms. On skins that are not flat they press in place of the
    /// mesh. `tolerance` is as of `from_mesh`.
    #[staticmethod]
    #[pyo3(signature = (vertices, faces, stiffness = None, parts = Vec::new(), tolerance = None))]
    fn from_vertices(
        py: Python<'_>,
        vertices: PyArrayLike2<'_, f64, AllowTypeChange>,
        faces: PyArrayLike2<'_, i64, AllowTypeChange>,
        stiffness: Option<f64>,
        parts: Vec<PartIn>,
        tolerance: Option<f64>,
    ) -> PyResult<Self> {
        let vertices = triples("vertices", &vertices)?;
        if faces.shape()[1] != 3 || faces.shape()[0] == 0 || vertices.is_empty() {
            let (points, shape) = (vertices.len(), faces.shape());
            bail!("`faces` has shape {shape:?} and `vertices` {points} rows; (n, 3) with n > 0 is needed of both");
        }
        if let Some(i) = vertices.iter().position(|v| !v.iter().all(|x| x.abs() <= 1e3)) {
            let v = vertices[i];
            bail!("`vertices[{i}]` = {v:?} is outside [-1000, 1000] m");
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
        let mut mesh = TriMesh { vertices, triangles };
        if mesh.volume_m3() < 0.0 {
            warn(py, "`faces` ran clockwise seen from outside; they have been turned")?;
            mesh = mesh.flipped();
        }
        let parts = parts.into_iter().map(part).collect::<PyResult<_>>()?;
        let (mesh, error_m) = Self::simpler(mesh, tolerance)?;
        Ok(Self { error_m, ..Self::new(mesh, parts, stiffness)? })
    }

    /// Ball of `radius` metres, its origin in its middle.
    #[staticmethod]
    #[pyo3(signature = (radius, stiffness = None))]
    fn sphere(radius: f64, stiffness: Option<f64>) -> PyResult<Self> {
        in_metres("radius", radius)?;
        let ball = sphere(radius, RINGS, SEGMENTS).translated([0.0, 0.0, -radius]);
        let wider = (4.0 / 3.0 * PI * radius.powi(3) / ball.volume_m3()).cbrt();
        Self::shaped(ball.scaled([wider; 3]), Primitive::Ellipsoid([radius; 3]), stiffness)
    }

    /// Box with sides of `size` metres along its axes, its origin in its middle.
    #[staticmethod]
    #[pyo3(signature = (size, stiffness = None), name = "box")]
    fn cuboid(size: [f64; 3], stiffness: Option<f64>) -> PyResult<Self> {
        for side in size {
            in_metres("size", side)?;
        }
        let mesh = cuboid(size).translated([0.0, 0.0, -0.5 * size[2]]);
        Self::shaped(mesh, Primitive::Cuboid(size.map(|side| 0.5 * side)), stiffness)
    }

    /// Cylinder of `radius` and `length` metres along z, its origin in its middle.
    #[staticmethod]
    #[pyo3(signature = (radius, length, stiffness = None))]
    fn cylinder(radius: f64, length: f64, stiffness: Option<f64>) -> PyResult<Self> {
        in_metres("radius", radius)?;
        in_metres("length", length)?;
        let wall = [[0.0, -0.5], [1.0, -0.5], [1.0, 0.5], [0.0, 0.5]].map(|[r, z]| [r * radius, z * length]);
        let mesh = round(&wall, PI * radius * radius * length);
        Self::shaped(mesh, Primitive::Cylinder(radius, 0.5 * length), stiffness)
    }

    /// Capsule along z: a cylinder of `radius` and `length` metres with half balls on its ends, its origin in its
    /// middle.
    #[staticmethod]
    #[pyo3(signature = (radius, length, stiffness = None))]
    fn capsule(radius: f64, length: f64, stiffness: Option<f64>) -> PyResult<Self> {
        in_metres("radius", radius)?;
        in_metres("length", length)?;
        let half_m = 0.5 * length;
        let lower = cap(radius, half_m).rev().map(|[r, z]| [r, -z]);
        let tip = half_m + radius;
        let profile = [[0.0, -tip]].into_iter().chain(lower).chain(cap(radius, half_m)).chain([[0.0, tip]]);
        let volume = PI * radius * radius * (length + 4.0 / 3.0 * radius);
        let mesh = round(&profile.collect::<Vec<_>>(), volume);
        Self::shaped(mesh, Primitive::Capsule(radius, half_m), stiffness)
    }

    /// Vertices (V, 3), m, and faces (F, 3), counter-clockwise seen from outside.
    #[getter]
    fn mesh<'py>(&self, py: Python<'py>) -> PyResult<(Array2<'py>, Bound<'py, PyArray2<i64>>)> {
        let mesh = &self.body.mesh;
        let vertices: Vec<f64> = mesh.vertices.iter().flatten().copied().collect();
        let faces: Vec<i64> = mesh.triangles.iter().flatten().map(|k| i64::from(*k)).collect();
        let vertices = vertices.into_pyarray(py).reshape([mesh.vertices.len(), 3])?;
        Ok((vertices, faces.into_pyarray(py).reshape([mesh.triangles.len(), 3])?))
    }

    /// The same body once more: a key of its own for a second pose.
    fn copy(&self) -> Self {
        Self { body: self.body.clone(), ..*self }
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let py = slf.py();
        let (body, (vertices, faces)) = (slf.get(), slf.get().mesh(py)?);
        let parts: Vec<PartIn> = body.body.parts().iter().map(part_out).collect();
        let arguments = (vertices, faces, body.stiffness_pa_per_m, parts, body.error_m).into_pyobject(py)?;
        Ok((slf.get_type().getattr("_restored")?, arguments))
    }

    /// The body that was pickled.
    #[staticmethod]
    fn _restored(
        py: Python<'_>,
        vertices: PyArrayLike2<'_, f64, AllowTypeChange>,
        faces: PyArrayLike2<'_, i64, AllowTypeChange>,
        stiffness: f64,
        parts: Vec<PartIn>,
        error_m: f64,
    ) -> PyResult<Self> {
        Ok(Self { error_m, ..Self::from_vertices(py, vertices, faces, Some(stiffness), parts, None)? })
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

/// Kind, size, position and rotation matrix of a convex part.
type PartIn = (String, [f64; 3], [f64; 3], [f64; 9]);

fn part((kind, [x, y, z], position_m, turn): PartIn) -> PyResult<Part> {
    let shape = match kind.as_str() {
        "sphere" => Primitive::Ellipsoid([x; 3]),
        "ellipsoid" => Primitive::Ellipsoid([x, y, z]),
        "box" => Primitive::Cuboid([x, y, z]),
        "cylinder" => Primitive::Cylinder(x, y),
        "capsule" => Primitive::Capsule(x, y),
        "plane" => Primitive::HalfSpace,
        _ => bail!("`parts`: \"{kind}\"; valid: sphere, ellipsoid, box, cylinder, capsule, plane"),
    };
    let rotation = std::array::from_fn(|i| std::array::from_fn(|j| turn[3 * i + j]));
    if !([x, y, z].iter().chain(&position_m).chain(&turn).all(|v| v.is_finite()) && x.min(y).min(z) >= 0.0) {
        bail!("`parts`: a {kind} has sizes {:?} at {position_m:?}; finite numbers are needed", [x, y, z]);
    }
    Ok(Part { shape, rotation, position_m })
}

fn part_out(part: &Part) -> PartIn {
    let (kind, size) = match part.shape {
        Primitive::Ellipsoid(half_m) => ("ellipsoid", half_m),
        Primitive::Cuboid(half_m) => ("box", half_m),
        Primitive::Cylinder(radius_m, half_m) => ("cylinder", [radius_m, half_m, 0.0]),
        Primitive::Capsule(radius_m, half_m) => ("capsule", [radius_m, half_m, 0.0]),
        Primitive::HalfSpace => ("plane", [0.0; 3]),
    };
    let turn = std::array::from_fn(|k| part.rotation[k / 3][k % 3]);
    (kind.to_owned(), size, part.position_m, turn)
}

fn in_metres(name: &str, value: f64) -> PyResult<()> {
    if (1e-5..=100.0).contains(&value) {
        return Ok(());
    }
    Err(refuse(format!("`{name}` = {value} is outside [1e-5, 100] m")))
}
