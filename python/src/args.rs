//! Numbers, poses and arrays of points that come from Python.

use crate::common::refuse;
use numpy::{AllowTypeChange, IntoPyArray as _, PyArray1, PyArray2, PyArray3, PyArrayLike2, PyArrayMethods as _};
use pyo3::prelude::*;

/// Arrays of numbers that go to Python.
pub(crate) type Array1<'py> = Bound<'py, PyArray1<f64>>;
pub(crate) type Array2<'py> = Bound<'py, PyArray2<f64>>;
pub(crate) type Array3<'py> = Bound<'py, PyArray3<f64>>;

/// The number `value` of the argument `field`, which must be a whole one from 0 on that `T` holds.
pub(crate) fn whole<T: TryFrom<i128>>(field: &str, value: i128) -> PyResult<T> {
    T::try_from(value).map_err(|_| {
        let bits = 8 * size_of::<T>();
        refuse(format!("`{field}` = {value} is outside [0, 2^{bits})"))
    })
}

/// What the text `value` of the argument `field` stands for in a table.
pub(crate) fn one_of<T: Clone>(field: &str, value: &str, table: &[(&str, T)]) -> PyResult<T> {
    let known = table.iter().find(|(name, _)| *name == value);
    known.map(|(_, meant)| meant.clone()).ok_or_else(|| {
        let valid: Vec<String> = table.iter().map(|(name, _)| format!("\"{name}\"")).collect();
        refuse(format!("`{field}` = \"{value}\"; valid: {}", valid.join(", ")))
    })
}

/// Position, m, and unit quaternion (w, x, y, z).
#[derive(Debug, Clone, Copy)]
pub(crate) struct PoseIn([f64; 3], [f64; 4]);

/// How far a quaternion's length may be from 1.
const UNIT: f64 = 1e-3;

impl PoseIn {
    /// The pose that `value` is.
    pub(crate) fn of(value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let pose = value.extract::<([f64; 3], [f64; 4])>();
        let (position, quaternion) = pose.map_err(|_| {
            refuse(format!("`pose` = {value}; a pair is needed: position (3,) m, unit quaternion (4,) w x y z"))
        })?;
        Ok(Self(position, quaternion))
    }

    /// Position, m, and rotation matrix, row-major.
    pub(crate) fn checked(self) -> PyResult<([f64; 3], [[f64; 3]; 3])> {
        let Self(position, quaternion) = self;
        let length = quaternion.iter().map(|v| v * v).sum::<f64>().sqrt();
        if !position.iter().all(|v| v.is_finite()) {
            bail!("`pose[0]` = {position:?}: finite numbers are needed, m");
        }
        if !(1.0 - UNIT..=1.0 + UNIT).contains(&length) {
            bail!("`pose[1]` = {quaternion:?} has length {length}; a unit quaternion (w, x, y, z) is needed");
        }
        let [w, x, y, z] = quaternion.map(|v| v / length);
        let rotation = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ];
        Ok((position, rotation))
    }
}

/// A twist: velocity of the body's origin, m/s, then angular velocity, rad/s, both in the skin's frame.
pub(crate) fn checked_twist(value: &Bound<'_, PyAny>) -> PyResult<([f64; 3], [f64; 3])> {
    let twist: [f64; 6] = value
        .extract()
        .map_err(|_| refuse(format!("`twist` = {value}; six numbers are needed: linear m/s, then angular rad/s")))?;
    if !twist.iter().all(|v| v.is_finite()) {
        bail!("`twist` = {twist:?}: finite numbers are needed, m/s and rad/s");
    }
    let [a, b, c, d, e, f] = twist;
    Ok(([a, b, c], [d, e, f]))
}

/// The rows of an array (n, 3) called `name`.
pub(crate) fn triples(name: &str, array: &PyArrayLike2<'_, f64, AllowTypeChange>) -> PyResult<Vec<[f64; 3]>> {
    let array = array.as_array();
    if array.ncols() != 3 {
        let shape = array.shape();
        bail!("`{name}` has shape {shape:?}; (n, 3) is needed");
    }
    Ok(array.rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect())
}

/// An array (n, 3) of `rows`.
pub(crate) fn triples_out(py: Python<'_>, rows: impl ExactSizeIterator<Item = [f64; 3]>) -> PyResult<Array2<'_>> {
    let count = rows.len();
    rows.flatten().collect::<Vec<f64>>().into_pyarray(py).reshape([count, 3])
}
