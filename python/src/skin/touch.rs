//! Touches: bodies on a skin, and what it feels of them.

use super::Skin;
use crate::body::Body;
use crate::refuse::refuse;
use numpy::{IntoPyArray as _, PyArray1, PyArray2, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use spts::PressureMap;
use spts::contact::{PosedMesh, Wrench};

/// What the skin feels at one moment.
#[pyclass(frozen, module = "spts")]
pub(crate) struct Touch {
    /// Mean pressure over every taxel, Pa, (rows, cols).
    #[pyo3(get)]
    pressure: Py<PyArray2<f64>>,
    /// Wrench on every body about its origin, in the skin's frame: (force (3,) N, torque (3,) N m).
    #[pyo3(get)]
    wrenches: Py<PyDict>,
    /// Area that is pressed, m².
    #[pyo3(get)]
    area: f64,
    /// Time of the touch, s: the sum of every `dt` up to it.
    #[pyo3(get)]
    pub(crate) time: f64,
    /// Number of the touch, from 1.
    #[pyo3(get)]
    pub(crate) number: u64,
    /// What the transducer feels.
    pub(crate) felt: PressureMap,
    /// Which skin.
    pub(crate) skin: u64,
}

/// Where a body is and how it moves, in the skin's frame.
pub(crate) struct Placed {
    pub(crate) position_m: [f64; 3],
    pub(crate) rotation: [[f64; 3]; 3],
    /// Velocity of its origin.
    pub(crate) velocity_m_per_s: [f64; 3],
    pub(crate) spin_rad_per_s: [f64; 3],
}

impl Skin {
    /// Puts `bodies` on the skin; what it feels, and the wrenches on them.
    pub(crate) fn touched(
        &self,
        py: Python<'_>,
        bodies: &[Py<Body>],
        placed: &[Placed],
        dt: f64,
    ) -> PyResult<(Touch, Vec<Wrench>)> {
        if !(0.0..=1e9).contains(&dt) {
            return Err(refuse(format!("`dt` = {dt} is outside [0, 1e9] s")));
        }
        let pairs: Vec<_> = bodies.iter().map(Py::get).zip(placed).collect();
        let (wrenches, values, felt, [area, time], number) = py.detach(|| {
            let posed = pairs.iter().map(|(body, placed)| {
                let posed = PosedMesh {
                    rotation: placed.rotation,
                    velocity_m_per_s: placed.velocity_m_per_s,
                    angular_velocity_rad_per_s: placed.spin_rad_per_s,
                    stiffness_pa_per_m: body.stiffness_pa_per_m,
                    ..PosedMesh::at_rest(&body.body.mesh, placed.position_m)
                };
                (&body.body, posed)
            });
            let posed: Vec<_> = posed.collect();
            let mut wrenches: Vec<Wrench> = Vec::with_capacity(posed.len());
            let mut state = self.locked();
            state.skin.touch(&posed, &mut wrenches);
            state.touches += 1;
            state.time_s += dt;
            let values = state.skin.pressure().values().to_vec();
            let felt = state.skin.electrode_pressure().clone();
            let scalars = [state.skin.touched_m2(), state.time_s];
            (wrenches, values, felt, scalars, state.touches)
        });
        let found = PyDict::new(py);
        for (key, wrench) in bodies.iter().zip(&wrenches) {
            let pair = [wrench.force_n, wrench.torque_nm].map(|v| PyArray1::from_slice(py, &v));
            found.set_item(key, PyTuple::new(py, pair)?)?;
        }
        let touch = Touch {
            pressure: values.into_pyarray(py).reshape([felt.rows(), felt.cols()])?.unbind(),
            wrenches: found.unbind(),
            area,
            time,
            number,
            felt,
            skin: self.id,
        };
        Ok((touch, wrenches))
    }
}
