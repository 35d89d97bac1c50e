//! Scenes from their name to a session.

use crate::common::{refuse, stoppable, table};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use spts::Mode;
use spts::Refusal;
use spts::assign::Assignment;
use spts::output::{OutputError, OutputFolder};
use spts::session::SessionWriter;
use spts::simulate::{Request, run};
use std::path::PathBuf;

/// Why a scene gives no session.
#[derive(Debug)]
enum Failure {
    Scene(Refusal),
    Output(OutputError),
}

impl From<Refusal> for Failure {
    fn from(error: Refusal) -> Self {
        Self::Scene(error)
    }
}

impl From<OutputError> for Failure {
    fn from(error: OutputError) -> Self {
        Self::Output(error)
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Scene(error) => error.fmt(f),
            Self::Output(error) => error.fmt(f),
        }
    }
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

fn simulated(request: &Request, step: &(dyn Fn() + Sync), out: PathBuf) -> Result<Vec<String>, Failure> {
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
        Ok::<(), Failure>(())
    });
    done.and_then(|_| Ok(writer.finish()?))
        .map_err(|failure| match failure {
            Failure::Output(error) => Failure::Output(folder.unstaged(error)),
            other => other,
        })?;
    folder.commit()?;
    Ok(prepared.notes)
}
