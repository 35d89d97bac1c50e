//! Data sets: their folders, made and read.

use crate::common::{refuse, released, stoppable, table, warn};
use numpy::{IntoPyArray as _, PyArray2, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use spts::circuit::WeightRows;
use spts_dataset::{ColumnValues, Dataset, Part, Spec, columns, shard_rows};
use std::path::PathBuf;

/// The folder of a data set. `spts.Dataset` and `spts.dataset.make` are made of it.
#[pyclass(frozen, module = "spts._spts")]
pub(crate) struct DataFolder {
    dataset: Dataset,
}

#[pymethods]
impl DataFolder {
    /// Opens what was begun in `folder`; files that the spec names are looked for in `files`.
    #[staticmethod]
    fn open(py: Python<'_>, folder: PathBuf, files: PathBuf) -> PyResult<Self> {
        let dataset = released(py, || Dataset::open(&folder, &files))?.map_err(refuse)?;
        Ok(Self { dataset })
    }

    /// Begins the data set of `spec`, a file or a name, in `folder`, or goes on with it; `overrides` are other values.
    /// An empty `spec` has defaults alone.
    #[staticmethod]
    fn begin(py: Python<'_>, spec: &str, folder: PathBuf, overrides: &Bound<'_, PyDict>) -> PyResult<Self> {
        let overrides = table("overrides", overrides)?;
        let begun = released(py, || {
            let spec = match spec {
                "" => Spec::from_toml("", &overrides, ".".as_ref()),
                name => Spec::load(name, &overrides),
            };
            let spec = spec.map_err(refuse)?;
            Dataset::begin(&folder, spec).map_err(refuse)
        });
        let dataset = begun??;
        dataset.spec().notes().iter().try_for_each(|note| warn(py, note))?;
        Ok(Self { dataset })
    }

    /// Makes file number `shard` unless it is there; the number of rows that were made.
    fn make(&self, py: Python<'_>, shard: u64) -> PyResult<u64> {
        let of = self.dataset.spec().shards();
        let part = Part::parse(&format!("{shard}/{of}")).map_err(refuse)?;
        let made = released(py, || self.dataset.make(part, &()))?;
        Ok(made.map_err(refuse)?.rows)
    }

    /// Checks that every file is there and writes statistics, card and manifest; what the data set is, as JSON.
    fn finish(&self, py: Python<'_>) -> PyResult<String> {
        let finished = released(py, || self.dataset.finish(&()))?.map_err(refuse)?;
        serde_json::to_string(&finished).map_err(refuse)
    }

    /// How far it is, as JSON.
    fn info(&self) -> PyResult<String> {
        serde_json::to_string(&self.dataset.info()).map_err(refuse)
    }

    /// Its columns, as JSON.
    fn columns(&self) -> PyResult<String> {
        serde_json::to_string(&columns(self.dataset.spec())).map_err(refuse)
    }

    /// The spec, as TOML.
    #[getter]
    fn spec(&self) -> &str {
        self.dataset.spec().text()
    }

    /// Rows of file number `shard`: first, and one beyond the last.
    fn rows_of(&self, shard: u64) -> (u64, u64) {
        let rows = shard_rows(self.dataset.spec(), shard);
        (rows.start, rows.end)
    }

    /// Rows and columns of taxels.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        let skin = self.dataset.spec().skin();
        (skin.rows(), skin.cols())
    }

    /// The columns `names` of the rows `start` to `stop`: a dictionary of arrays, (n,) or (n, length).
    fn read<'py>(&self, py: Python<'py>, names: Vec<String>, start: u64, stop: u64) -> PyResult<Bound<'py, PyDict>> {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let found = stoppable(py, |step| {
            self.dataset.columns(&names, start..stop, || {
                step();
                Ok(())
            })
        })?;
        let dict = PyDict::new(py);
        for (column, values) in found.map_err(refuse)? {
            let shape = |values: usize| column.length.map(|length| [values / length.max(1), length]);
            macro_rules! put {
                ($values:expr) => {{
                    let count = $values.len();
                    let array = $values.into_pyarray(py);
                    match shape(count) {
                        Some(shape) => dict.set_item(&column.name, array.reshape(shape)?)?,
                        None => dict.set_item(&column.name, array)?,
                    }
                }};
            }
            match values {
                ColumnValues::Floats(values) => put!(values),
                ColumnValues::Integers(values) => put!(values),
                ColumnValues::Flags(values) => put!(values),
                ColumnValues::Texts(values) => dict.set_item(&column.name, values)?,
            }
        }
        Ok(dict)
    }

    /// Volts of codes of the converter.
    fn volts<'py>(
        &self,
        py: Python<'py>,
        codes: numpy::PyReadonlyArray2<'_, i64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let converter = self.dataset.spec().recording().converter;
        let converter = converter.ok_or_else(|| refuse("the readout has no converter"))?;
        let codes = codes.as_array();
        let volts = codes.mapv(|code| u32::try_from(code).map_or(f64::NAN, |code| converter.volts(code)));
        Ok(volts.into_pyarray(py))
    }

    /// Rows of Φ that begin at these rows: (n, M * taxels).
    fn phi<'py>(
        &self,
        py: Python<'py>,
        first_rows: Vec<i64>,
        measurements: usize,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let weights = &self.dataset.spec().recording().weights;
        let each = measurements.saturating_mul(weights.taxels());
        let mut phi = vec![0.0; first_rows.len() * each];
        py.detach(|| {
            for (out, first) in phi.chunks_exact_mut(each.max(1)).zip(&first_rows) {
                WeightRows::new(weights, u64::try_from(*first).unwrap_or_default(), measurements).fill(out);
            }
        });
        phi.into_pyarray(py).reshape([first_rows.len(), each])
    }
}
