//! Poses and twists that come from Python.

use crate::refuse::refuse;
use pyo3::prelude::*;

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
            refuse(format!(
                "`pose` = {value}; a pair is needed: position (3,) m, unit quaternion (4,) w x y z"
            ))
        })?;
        Ok(Self(position, quaternion))
    }

    /// Position, m, and rotation matrix, row-major.
    pub(crate) fn checked(self) -> PyResult<([f64; 3], [[f64; 3]; 3])> {
        let Self(position, quaternion) = self;
        let length = quaternion.iter().map(|v| v * v).sum::<f64>().sqrt();
        if !position.iter().all(|v| v.is_finite()) {
            return Err(refuse(format!(
                "`pose[0]` = {position:?}: finite numbers are needed, m"
            )));
        }
        if !(1.0 - UNIT..=1.0 + UNIT).contains(&length) {
            return Err(refuse(format!(
                "`pose[1]` = {quaternion:?} has length {length}; a unit quaternion (w, x, y, z) is needed"
            )));
        }
        let [w, x, y, z] = quaternion.map(|v| v / length);
        let rotation = [
            [
                1.0 - 2.0 * (y * y + z * z),
                2.0 * (x * y - w * z),
                2.0 * (x * z + w * y),
            ],
            [
                2.0 * (x * y + w * z),
                1.0 - 2.0 * (x * x + z * z),
                2.0 * (y * z - w * x),
            ],
            [
                2.0 * (x * z - w * y),
                2.0 * (y * z + w * x),
                1.0 - 2.0 * (x * x + y * y),
            ],
        ];
        Ok((position, rotation))
    }
}

/// A twist: velocity of the body's origin, m/s, then angular velocity, rad/s, both in the skin's frame.
pub(crate) fn checked_twist(value: &Bound<'_, PyAny>) -> PyResult<([f64; 3], [f64; 3])> {
    let twist: [f64; 6] = value.extract().map_err(|_| {
        refuse(format!(
            "`twist` = {value}; six numbers are needed: linear m/s, then angular rad/s"
        ))
    })?;
    if !twist.iter().all(|v| v.is_finite()) {
        return Err(refuse(format!(
            "`twist` = {twist:?}: finite numbers are needed, m/s and rad/s"
        )));
    }
    let [a, b, c, d, e, f] = twist;
    Ok(([a, b, c], [d, e, f]))
}
