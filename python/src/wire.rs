//! The one wire: transducer and electronics, with their state.

use crate::refuse::refuse;
use crate::skin::{Skin, Touch};
use numpy::{IntoPyArray as _, PyArray1, PyArray2, PyArrayMethods as _};
use pyo3::prelude::*;
use spts::chain::SkinSession;
use spts::circuit::{Constant, Readout};
use spts::models::{ConductanceMap, PressureMap};
use spts::{Chain, ChainConfig, Mode};

/// Measurements of the untouched skin from which its output is known.
const IDLE: usize = 2000;

/// The wire of a skin: what its taxels conduct, and what the converter reads.
#[pyclass(module = "spts")]
pub(crate) struct Wire {
    session: SkinSession,
    compressive: Readout,
    raster: Readout,
    shape: (usize, usize),
    /// Output of the untouched skin, V.
    idle_v: f64,
    /// Number of the touch that the transducer has felt last.
    felt: u64,
    conductance: ConductanceMap,
    /// Row of Φ of the next measurement.
    row: u64,
}
