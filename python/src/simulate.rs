//! Scenes from their name to a session.

use crate::common::{refuse, stoppable, table};
use pyo3::exceptions::PyImportError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use spts::Mode;
use spts::Refusal;
use spts::assign::Assignment;
use spts::output::OutputFolder;
use spts::session::SessionWriter;
use spts::sim::engine;
use spts::simulate::{Request, run};
use std::path::PathBuf;

/// Looks for MuJoCo's library in `folder`, too.
#[pyfunction]
pub(crate) fn look_in(folder: PathBuf) {
    engine::look_in(folder);
}

/// Opens MuJoCo's library; an `ImportError` where there is none of its version.
#[pyfunction]
pub(crate) fn open_mujoco() -> PyResult<()> {
    engine::open().map_err(|error| PyImportError::new_err(error.to_string()))
}

/// Simulates `scene`, changed by `set`, and writes its session into `out`; notes that the user should read.
#[pyfunction]
pub(crate) fn simulate(py: Python<'_>, scene: String, set: &Bound<'_, PyDict>, out: PathBuf) -> PyResult<Vec<String>> {
    let assignments = table("set", set)?.into_iter().map(|(key, value)| {
        let assignment: Result<Assignment, _> = format!("{key}={value}").parse();
        assignment.map_err(|e| refuse(format!("`set`: {e}")))
    });
    let assignments = assignments.collect::<PyResult<_>>()?;
    stoppable(py, |step| simulated(&Request { scene, assignments }, step, out))?.map_err(refuse)
}

fn simulated(request: &Request, step: &(dyn Fn() + Sync), out: PathBuf) -> Result<Vec<String>, Refusal> {
    let prepared = request.prepare()?;
    let folder = OutputFolder::open(&out)?;
    let mut writer = SessionWriter::create(&folder.path(""), &prepared.session())?;
    let done = run(&prepared, true, step, |piece| {
        step();
        for (mode, recorded) in [(Mode::Raster, &piece.raster), (Mode::Compressive, &piece.compressive)] {
            if let Some(recorded) = recorded {
                writer.push(mode, recorded, piece.of)?;
            }
        }
        Ok(())
    });
    done.and_then(|_| writer.finish()).map_err(|error| folder.unstaged(error))?;
    folder.commit()?;
    Ok(prepared.notes)
}
