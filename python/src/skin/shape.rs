//! The shape and the foam of a skin that is not flat, from arguments of Python; arrays of points, in and out.

use crate::count::whole;
use crate::refuse::refuse;
use numpy::{AllowTypeChange, IntoPyArray as _, PyArray2, PyArrayLike2, PyArrayMethods as _};
use pyo3::prelude::*;
use spts::contact::{Foam, Winding};

/// The foam of a curved skin; what is not given is the default.
pub(super) fn surface(
    stiffness: Option<f64>,
    thickness: Option<f64>,
    damping: Option<f64>,
    friction: Option<f64>,
) -> Foam {
    let default = Foam::default();
    Foam {
        stiffness_pa_per_m: stiffness.unwrap_or(default.stiffness_pa_per_m),
        thickness_m: thickness.unwrap_or(default.thickness_m),
        damping_s: damping.unwrap_or(default.damping_s),
        friction: friction.unwrap_or(default.friction),
        ..default
    }
}

/// How the taxels of a skin wind around an axis.
pub(super) fn winding(
    [rows, cols]: [i128; 2],
    points: i128,
    axis: &str,
    centre_m: [f64; 3],
    arc: (f64, f64),
    span_m: [f64; 2],
) -> PyResult<Winding> {
    let names = ["x", "y", "z"];
    let number = names.iter().position(|name| *name == axis);
    Ok(Winding {
        shape: [whole("rows", rows)?, whole("cols", cols)?],
        points_per_side: whole("points", points)?,
        axis: number.ok_or_else(|| refuse(format!("`axis` = \"{axis}\"; valid: \"x\", \"y\", \"z\"")))?,
        centre_m,
        arc_rad: [arc.0, arc.1],
        span_m,
    })
}

/// The rows of an array (n, 3) called `name`.
pub(crate) fn triples(name: &str, array: &PyArrayLike2<'_, f64, AllowTypeChange>) -> PyResult<Vec<[f64; 3]>> {
    let array = array.as_array();
    if array.ncols() != 3 {
        let shape = array.shape();
        return Err(refuse(format!("`{name}` has shape {shape:?}; (n, 3) is needed")));
    }
    Ok(array.rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect())
}

/// An array (n, 3) of `rows`.
pub(super) fn triples_out(
    py: Python<'_>,
    rows: impl ExactSizeIterator<Item = [f64; 3]>,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let count = rows.len();
    rows.flatten()
        .collect::<Vec<f64>>()
        .into_pyarray(py)
        .reshape([count, 3])
}
