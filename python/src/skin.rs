//! Skins and touches.

use crate::body::Body;
use crate::pose::{PoseIn, checked_twist};
use crate::refuse::refuse;
use numpy::{IntoPyArray as _, PyArray1, PyArray2, PyArrayMethods as _, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use spts::contact::{PosedMesh, SurfaceConfig, SurfacePoints, TouchSkin, WinklerConfig, Wrench};
use spts::{PressureMap, SkinLayout};

/// A tactile skin: taxels, and the foam on them.
///
/// Frame of a flat skin: origin in the middle of its surface, z outward, x along columns; row 0 has the largest y.
#[pyclass(module = "spts")]
pub(crate) struct Skin {
    skin: TouchSkin,
    touches: u64,
    time_s: f64,
}

/// What the skin feels at one moment.
#[pyclass(frozen, module = "spts", get_all)]
pub(crate) struct Touch {
    /// Mean pressure over every taxel, Pa, (rows, cols).
    pressure: Py<PyArray2<f64>>,
    /// Wrench on every body about its origin, in the skin's frame: (force (3,) N, torque (3,) N m).
    wrenches: Py<PyDict>,
    /// Area that is pressed, m².
    area: f64,
    /// Time of the touch, s: the sum of `dt` up to it.
    time: f64,
    /// Number of the touch, from 1.
    number: u64,
    /// Time since the touch before, s.
    dt: f64,
    /// What the transducer feels.
    #[pyo3(get = false)]
    pub(crate) felt: PressureMap,
}

#[pymethods]
impl Skin {
    #[new]
    #[pyo3(signature = (rows = 10, cols = 10, pitch = 0.015, *, electrode = None, cells = 6, stiffness = None, thickness = None, damping = None, friction = None))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn new(
        rows: usize,
        cols: usize,
        pitch: f64,
        electrode: Option<f64>,
        cells: usize,
        stiffness: Option<f64>,
        thickness: Option<f64>,
        damping: Option<f64>,
        friction: Option<f64>,
    ) -> PyResult<Self> {
        let layout = SkinLayout::new(rows, cols, pitch, electrode.unwrap_or(pitch * 2.0 / 3.0)).map_err(refuse)?;
        let default = WinklerConfig::default();
        let config = WinklerConfig {
            stiffness_pa_per_m: stiffness.unwrap_or(default.stiffness_pa_per_m),
            thickness_m: thickness.unwrap_or(default.thickness_m),
            damping_s: damping.unwrap_or(default.damping_s),
            friction: friction.unwrap_or(default.friction),
            cells_per_taxel: cells,
            ..default
        };
        Ok(Self::of(TouchSkin::flat(layout, config).map_err(refuse)?))
    }

    /// Rows and columns of taxels.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        (self.skin.layout().rows(), self.skin.layout().cols())
    }

    /// Puts bodies on the skin and takes all others off.
    ///
    /// `poses` maps a body to (position (3,) m, quaternion (4,) w x y z), `twists` to its velocity (6,), linear (m/s, of
    /// its origin) then angular (rad/s); a body without a twist is at rest. `dt` is the time since the touch before, s.
    #[pyo3(signature = (poses, twists = None, dt = 0.0))]
    fn touch(
        &mut self,
        py: Python<'_>,
        poses: &Bound<'_, PyDict>,
        twists: Option<&Bound<'_, PyDict>>,
        dt: f64,
    ) -> PyResult<Touch> {
        if !(dt >= 0.0 && dt.is_finite()) {
            return Err(refuse(format!("`dt` = {dt} is outside [0, inf) s")));
        }
        let (mut keys, mut placed) = (Vec::with_capacity(poses.len()), Vec::with_capacity(poses.len()));
        for (key, pose) in poses {
            let body: Bound<'_, Body> = key.cast_into()?;
            let (position, rotation) = pose.extract::<PoseIn>()?.checked()?;
            let twist = twists.map(|twists| twists.get_item(&body)).transpose()?.flatten();
            let (velocity, spin) = twist.map_or(Ok(Default::default()), |twist| checked_twist(twist.extract()?))?;
            keys.push(body.unbind());
            placed.push((position, rotation, velocity, spin));
        }
        let bodies: Vec<_> = keys.iter().map(Py::get).zip(placed).collect();
        let skin = &mut self.skin;
        let wrenches: Vec<Wrench> = py.detach(|| {
            let posed: Vec<_> = bodies
                .iter()
                .map(|(body, (position_m, rotation, velocity_m_per_s, spin))| {
                    let posed = PosedMesh {
                        rotation: *rotation,
                        velocity_m_per_s: *velocity_m_per_s,
                        angular_velocity_rad_per_s: *spin,
                        stiffness_pa_per_m: body.stiffness_pa_per_m,
                        ..PosedMesh::at_rest(&body.body.mesh, *position_m)
                    };
                    (&body.body, posed)
                })
                .collect();
            let mut wrenches = Vec::with_capacity(posed.len());
            skin.touch(&posed, &mut wrenches);
            wrenches
        });
        self.touches += 1;
        self.time_s += dt;
        let found = PyDict::new(py);
        for (key, wrench) in keys.iter().zip(&wrenches) {
            let pair = [wrench.force_n, wrench.torque_nm].map(|v| PyArray1::from_slice(py, &v));
            found.set_item(key, PyTuple::new(py, pair)?)?;
        }
        let (rows, cols) = self.shape();
        let pressure = self.skin.pressure().values().to_vec();
        Ok(Touch {
            pressure: pressure.into_pyarray(py).reshape([rows, cols])?.unbind(),
            wrenches: found.unbind(),
            area: self.skin.touched_m2(),
            time: self.time_s,
            number: self.touches,
            dt,
            felt: self.skin.electrode_pressure().clone(),
        })
    }

    /// Skin of any shape from sample points: `positions` (P, 3) m, outward `normals` (P, 3), `areas` (P,) m², and the
    /// taxel of every point (P,), which has to be one of rows × cols; without them every point is a taxel.
    #[staticmethod]
    #[pyo3(signature = (positions, normals, areas, *, taxels = None, rows = 1, cols = None, thickness = None, stiffness = None))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn from_points(
        positions: PyReadonlyArray2<'_, f64>,
        normals: PyReadonlyArray2<'_, f64>,
        areas: PyReadonlyArray1<'_, f64>,
        taxels: Option<PyReadonlyArray1<'_, i64>>,
        rows: usize,
        cols: Option<usize>,
        thickness: Option<f64>,
        stiffness: Option<f64>,
    ) -> PyResult<Self> {
        let triples = |name: &str, array: &PyReadonlyArray2<'_, f64>| {
            let array = array.as_array();
            if array.ncols() != 3 {
                let shape = array.shape();
                return Err(refuse(format!("`{name}` has shape {shape:?}; (n, 3) is needed")));
            }
            Ok(array.rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect::<Vec<_>>())
        };
        let (positions, normals) = (triples("positions", &positions)?, triples("normals", &normals)?);
        let count = positions.len();
        let number = |k: i64| u32::try_from(k).map_err(|_| refuse(format!("`taxels` names taxel {k}; numbers from 0 are needed")));
        let taxels: Vec<u32> = match taxels {
            Some(taxels) => taxels.as_array().iter().map(|k| number(*k)).collect::<PyResult<_>>()?,
            None => (0..count as i64).map(number).collect::<PyResult<_>>()?,
        };
        let points = SurfacePoints::new(positions, normals, areas.as_array().to_vec(), taxels).map_err(refuse)?;
        let cols = cols.unwrap_or_else(|| points.taxels() / rows.max(1));
        let mean_area_m2 = points.taxel_areas_m2().iter().sum::<f64>() / points.taxels() as f64;
        let pitch_m = mean_area_m2.sqrt();
        let layout = SkinLayout::new(rows, cols, pitch_m, pitch_m * 2.0 / 3.0).map_err(refuse)?;
        let default = SurfaceConfig::default();
        let config = SurfaceConfig {
            thickness_m: thickness.unwrap_or(default.thickness_m),
            stiffness_pa_per_m: stiffness.unwrap_or(default.stiffness_pa_per_m),
            ..default
        };
        Ok(Self::of(TouchSkin::curved(layout, points, config).map_err(refuse)?))
    }

    fn __repr__(&self) -> String {
        let (rows, cols) = self.shape();
        format!("<spts.Skin of {rows} x {cols} taxels>")
    }
}

impl Skin {
    fn of(skin: TouchSkin) -> Self {
        Self {
            skin,
            touches: 0,
            time_s: 0.0,
        }
    }

    pub(crate) fn layout(&self) -> &SkinLayout {
        self.skin.layout()
    }
}
