//! Sessions: recordings of the real skin or of the twin.

use crate::args::{Array1, Array2, Array3, one_of, whole};
use crate::common::{refuse, released, warn};
use crate::wire::rows_of;
use numpy::{AllowTypeChange, IntoPyArray as _, PyArray4, PyArrayLikeDyn, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyList, PyTuple};
use spts::circuit::Recording as Samples;
use spts::data::{FrameArray, FrameOptions, Frames, SessionSet, wired};
use spts::session::{Event, PressFacts, Recorded, Session as Whole};
use spts::{Chain, ChainConfig, FrameUnit, SkinLayout};
use spts_eval::{Untouched, idle_mean};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Recordings of one object or event, and what is known of them.
#[pyclass(frozen, module = "spts")]
pub(crate) struct Session {
    whole: Arc<Whole>,
}

/// The samples of a session in one mode, block by block: a press or a drop each.
#[pyclass(frozen, module = "spts")]
pub(crate) struct Recording {
    whole: Arc<Whole>,
    raster: bool,
}

/// All sessions in a folder: of the twin, as `spts simulate` and `Session` write them, or recordings of the real skin.
///
/// Parameters
/// ----------
/// path : str or os.PathLike
///     A session, a folder of sessions, or the published recordings.
///
/// Returns
/// -------
/// list of Session
#[pyfunction]
pub(crate) fn load(py: Python<'_>, path: PathBuf) -> PyResult<Vec<Session>> {
    let set = released(py, || SessionSet::open(&path))?.map_err(refuse)?;
    set.note.iter().try_for_each(|note| warn(py, note))?;
    let sessions = set.sessions.into_iter();
    Ok(sessions.map(|session| Session { whole: Arc::new(session) }).collect())
}

#[pymethods]
impl Session {
    /// Name of the session.
    #[getter]
    fn name(&self) -> &str {
        &self.whole.name
    }

    /// What was pressed or dropped.
    #[getter]
    fn object(&self) -> &str {
        &self.whole.object
    }

    /// "press", "drop" or "touch".
    #[getter]
    fn event(&self) -> &'static str {
        match self.whole.event {
            Event::Press => "press",
            Event::Drop => "drop",
            Event::Touch => "touch",
        }
    }

    /// Span of a block in which the contact is steady, (start, end) s; None where it is not known.
    #[getter]
    fn hold(&self) -> Option<(f64, f64)> {
        self.whole.hold_s.map(|[start, end]| (start, end))
    }

    /// Rows and columns of taxels.
    #[getter]
    fn shape(&self) -> Option<(usize, usize)> {
        self.whole.layout().map(|layout| (layout.rows(), layout.cols()))
    }

    /// Whether the twin made it.
    #[getter]
    fn simulated(&self) -> bool {
        self.whole.provenance.is_some()
    }

    /// The raster recording: one taxel a measurement; None where there is none.
    #[getter]
    fn raster(&self) -> Option<Recording> {
        self.recording(true)
    }

    /// The compressive recording: sums of all taxels; None where there is none.
    #[getter]
    fn compressive(&self) -> Option<Recording> {
        self.recording(false)
    }

    /// A session of frames of any skin or simulator: they are its raster recording, unchanged, and its truth.
    ///
    /// What is found or assumed is said as warnings: idle frames, the hold, taxels that never change.
    ///
    /// Parameters
    /// ----------
    /// frames : ndarray (presses, frames, rows, cols) or (frames, rows, cols)
    ///     NaN marks a missing value. With `rows` and `cols`, also (frames, rows * cols).
    /// rate : float
    ///     Frames a second, [1e-3, 1e6] Hz.
    /// unit : str
    ///     "pressure", Pa; "conductance", S; "codes" of a converter, or "relative"; all grow with the load.
    /// rows, cols : int, optional
    ///     Taxels; default the last two dimensions.
    /// pitch : float
    ///     Distance of taxels, m.
    /// name, object : str
    ///     Name of the session, and what was pressed: its class; default the name.
    /// idle : int, optional
    ///     Frames at the start of every press in which nothing touches the skin; default those before the sum rises.
    /// hold : (float, float), optional
    ///     Span of a press in which the contact is steady, s; default where the sum stays at its largest.
    /// cut : bool
    ///     Make a press of every contact in the frames; what is not whole is left out.
    #[staticmethod]
    #[pyo3(signature = (frames, rate, unit = "relative", *, rows = None, cols = None, pitch = 0.015, name = "frames", object = None, idle = None, hold = None, cut = false))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn from_frames(
        py: Python<'_>,
        frames: PyArrayLikeDyn<'_, f64, AllowTypeChange>,
        rate: f64,
        unit: &str,
        rows: Option<usize>,
        cols: Option<usize>,
        pitch: f64,
        name: &str,
        object: Option<String>,
        idle: Option<usize>,
        hold: Option<(f64, f64)>,
        cut: bool,
    ) -> PyResult<Self> {
        let unit = one_of("unit", unit, &FrameUnit::ALL)?;
        let array = frames.as_array();
        let shape = array.shape().to_vec();
        let sheet = match (rows, cols, &shape[..]) {
            (Some(rows), Some(cols), _) => [rows, cols],
            (None, None, [.., _, rows, cols]) => [*rows, *cols],
            (None, None, _) => {
                bail!("`frames` has shape {shape:?}; (frames, rows, cols) is needed, or `rows` and `cols`");
            }
            _ => bail!("`rows` and `cols`: both or none of them may be given"),
        };
        let layout = SkinLayout::with_pitch(sheet[0], sheet[1], pitch).map_err(refuse)?;
        let array = FrameArray { shape, values: array.iter().copied().collect(), ..FrameArray::default() };
        let options = FrameOptions {
            object: object.unwrap_or_else(|| name.to_owned()),
            rate_hz: Some(rate),
            idle,
            hold_s: hold.map(|(start, end)| [start, end]),
            ..FrameOptions::new(name, layout, unit)
        };
        let made = py.detach(|| {
            let frames = Frames::new(array, sheet, None)?;
            let frames = if cut { frames.cut()? } else { frames };
            frames.session(&options)
        });
        // options of the command line, under the names that they have here
        let named = |text: String| {
            ["rate", "idle", "hold", "cut"].iter().fold(text, |text, name| text.replace(&format!("--{name}"), name))
        };
        let (whole, notes) = made.map_err(|error| refuse(named(error.to_string())))?;
        notes.into_iter().try_for_each(|note| warn(py, &named(note)))?;
        Ok(Self { whole: Arc::new(whole) })
    }

    /// The frames of the raster scan, (presses, frames, rows, cols), in their unit; None where there are none.
    #[getter]
    fn frames<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray4<f64>>>> {
        if self.whole.raster.is_none() {
            return Ok(None);
        }
        let frames = Frames::of_session(&self.whole).map_err(refuse)?;
        Ok(Some(frames.values().to_vec().into_pyarray(py).reshape(frames.shape())?))
    }

    /// This session of frames as a skin with one wire would record it: a session with both recordings.
    ///
    /// Idle frames are subtracted. Pressures go through the transducer; conductances are taken as they are; of codes
    /// and relative values the largest is taken for what `peak` gives. What is assumed is said as warnings.
    ///
    /// Parameters
    /// ----------
    /// readout : str
    ///     Profile of the electronics, as for `Wire`.
    /// seeds, rows : optional
    ///     As for `Wire`.
    /// seed : int
    ///     Root of everything random.
    /// session : int
    ///     Number of the session, [0, 2**32): another one has other noise on the same skin.
    /// peak : float
    ///     Pa, [100, 1e6].
    #[pyo3(signature = (readout = "as_built", *, seeds = None, rows = None, seed = 1, session = 0, peak = 30e3))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn wire(
        &self,
        py: Python<'_>,
        readout: &str,
        seeds: Option<Bound<'_, PyAny>>,
        rows: Option<Bound<'_, PyAny>>,
        seed: i128,
        session: i128,
        peak: f64,
    ) -> PyResult<Self> {
        let seed = whole("seed", seed)?;
        let number: u64 = u64::from(whole::<u32>("session", session)?);
        let config = ChainConfig {
            readout: Some(readout.to_owned()),
            rows: rows_of(seeds, None, rows)?,
            ..ChainConfig::default()
        };
        let Some(layout) = self.whole.layout().copied() else { bail!("the session has no frames") };
        let found = released(py, || {
            let chain = Chain::new(&config, &layout, seed, Path::new(""))?;
            wired(&self.whole, &chain, (peak, None), seed, number)
        })?;
        let found = found.map_err(|error| refuse(error.to_string().replace("--peak", "peak")))?;
        found.notes.iter().try_for_each(|note| warn(py, &note.replace("--peak", "peak")))?;
        Ok(Self { whole: Arc::new(found.session) })
    }

    /// Writes the session into a folder, which every command reads; all of its files, or none.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        released(py, || self.whole.write(&path))?.map_err(refuse)
    }

    /// Nothing changes a session: a copy shares its samples.
    fn __copy__(&self) -> Self {
        Self { whole: Arc::clone(&self.whole) }
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.__copy__()
    }

    /// A pickle holds the session's files.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let py = slf.py();
        let folder = tempfile::tempdir()?;
        let whole = &slf.get().whole;
        py.detach(|| whole.write_files(folder.path())).map_err(refuse)?;
        let files = PyList::empty(py);
        for entry in std::fs::read_dir(folder.path())? {
            let entry = entry?;
            files.append((entry.file_name(), PyBytes::new(py, &std::fs::read(entry.path())?)))?;
        }
        Ok((slf.get_type().getattr("_restored")?, (files,).into_pyobject(py)?))
    }

    /// The session that was pickled.
    #[staticmethod]
    fn _restored(py: Python<'_>, files: Vec<(PathBuf, Vec<u8>)>) -> PyResult<Self> {
        let folder = tempfile::tempdir()?;
        for (name, bytes) in &files {
            std::fs::write(folder.path().join(name.file_name().unwrap_or_default()), bytes)?;
        }
        let whole = py.detach(|| Whole::read(folder.path())).map_err(refuse)?;
        Ok(Self { whole: Arc::new(whole) })
    }

    fn __repr__(&self) -> String {
        let modes = [("raster", &self.whole.raster), ("compressive", &self.whole.compressive)];
        let modes = modes.iter().filter_map(|(name, recorded)| {
            let blocks = recorded.as_ref()?.recording.blocks().len();
            Some(format!("{name} {blocks} blocks"))
        });
        format!("<spts.Session {:?}: {}>", self.whole.name, modes.collect::<Vec<_>>().join(", "))
    }
}

impl Session {
    fn recording(&self, raster: bool) -> Option<Recording> {
        let there = if raster { &self.whole.raster } else { &self.whole.compressive };
        there.as_ref().map(|_| Recording { whole: Arc::clone(&self.whole), raster })
    }
}

#[pymethods]
impl Recording {
    /// Measurements a second, Hz.
    #[getter]
    fn sample_rate(&self) -> f64 {
        self.samples().sample_rate_hz()
    }

    /// Number of blocks at the beginning that only condition the skin.
    #[getter]
    fn conditioning(&self) -> usize {
        self.recorded().conditioning
    }

    /// All samples, V, (blocks, measurements); NaN where one was lost.
    #[getter]
    fn volts<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py>> {
        let blocks = self.samples().blocks();
        let all: Vec<f64> = blocks.iter().flat_map(|block| block.volts.iter().copied()).collect();
        all.into_pyarray(py).reshape([blocks.len(), blocks[0].volts.len()])
    }

    /// Output of the untouched skin before each block, V, (blocks,); of several wires their mean.
    #[getter]
    fn idle<'py>(&self, py: Python<'py>) -> Array1<'py> {
        let samples = self.samples();
        let idle: Vec<f64> = (0..samples.blocks().len()).map(|block| idle_mean(samples, block)).collect();
        idle.into_pyarray(py)
    }

    /// Rows of Φ of consecutive measurements.
    ///
    /// Parameters
    /// ----------
    /// block : int
    /// start, count : int
    ///     Measurements of the block, from 0.
    ///
    /// Returns
    /// -------
    /// ndarray (count, taxels)
    fn phi<'py>(&self, py: Python<'py>, block: usize, start: usize, count: usize) -> PyResult<Array2<'py>> {
        self.check(block, start, count)?;
        let rows = self.samples().rows(block, start..start + count);
        rows.to_vec().into_pyarray(py).reshape([count, rows.taxels()])
    }

    /// Windows of M consecutive measurements that follow each other, without the output of the untouched skin.
    ///
    /// Parameters
    /// ----------
    /// block : int
    /// measurements : int
    ///     M.
    /// start : float, optional
    ///     Time in the block, s; default the beginning of the hold, or of the block.
    /// count : int
    ///     Number of windows.
    ///
    /// Returns
    /// -------
    /// phi : ndarray (count, M, taxels)
    /// y : ndarray (count, M)
    ///     V; NaN where a sample was lost.
    #[pyo3(signature = (block, measurements, start = None, count = 1))]
    fn windows<'py>(
        &self,
        py: Python<'py>,
        block: i128,
        measurements: i128,
        start: Option<f64>,
        count: i128,
    ) -> PyResult<(Array3<'py>, Array2<'py>)> {
        let (block, count): (usize, usize) = (whole("block", block)?, whole("count", count)?);
        let measurements: usize = whole("measurements", measurements)?;
        let start_s = start.or(self.whole.hold_s.map(|[start_s, _]| start_s)).unwrap_or(0.0);
        if !(0.0..1e9).contains(&start_s) {
            bail!("`start` = {start_s} is outside [0, 1e9] s");
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked above")]
        let first = (start_s * self.sample_rate()).round() as usize;
        let total = measurements.saturating_mul(count);
        self.check(block, first, total)?;
        if total == 0 {
            bail!("`measurements` = {measurements} and `count` = {count}: at least 1 is needed of both");
        }
        let samples = self.samples();
        let untouched = Untouched::flat(samples, block);
        let y = untouched.without(samples, block, first..first + total);
        let rows = samples.rows(block, first..first + total);
        let phi = rows.to_vec().into_pyarray(py).reshape([count, measurements, rows.taxels()])?;
        Ok((phi, y.into_pyarray(py).reshape([count, measurements])?))
    }

    /// True pressure of every block at its hold or largest force, Pa, (blocks, rows, cols); None where it is not known.
    #[getter]
    fn pressure<'py>(&self, py: Python<'py>) -> PyResult<Option<Array3<'py>>> {
        self.maps(py, |facts| facts.pressure.as_ref().map(|map| map.values()))
    }

    /// True conductance of every block at that time, S, (blocks, rows, cols); None where it is not known.
    #[getter]
    fn conductance<'py>(&self, py: Python<'py>) -> PyResult<Option<Array3<'py>>> {
        self.maps(py, |facts| facts.conductance.as_ref().map(|map| map.values()))
    }

    /// Normal force of every block at that time, N, (blocks,); NaN where it is not known.
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> Array1<'py> {
        self.each(py, |facts| facts.force_n)
    }

    /// That time, s from the beginning of the block, (blocks,); NaN where it is not known.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Array1<'py> {
        self.each(py, |facts| facts.time_s)
    }

    fn __copy__(&self) -> Self {
        Self { whole: Arc::clone(&self.whole), raster: self.raster }
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.__copy__()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let session = Session { whole: Arc::clone(&self.whole) };
        let name = if self.raster { "raster" } else { "compressive" };
        Ok((py.import("builtins")?.getattr("getattr")?, (session, name).into_pyobject(py)?))
    }

    fn __len__(&self) -> usize {
        self.samples().blocks().len()
    }

    fn __repr__(&self) -> String {
        let samples = self.samples();
        let (blocks, each) = (samples.blocks().len(), samples.blocks()[0].volts.len());
        format!("<spts.Recording of {blocks} blocks of {each} measurements, {} taxels>", samples.taxels())
    }
}

impl Recording {
    fn recorded(&self) -> &Recorded {
        let there = if self.raster { &self.whole.raster } else { &self.whole.compressive };
        let Some(recorded) = there else {
            unreachable!("a recording is only made of one that is there");
        };
        recorded
    }

    fn samples(&self) -> &Samples {
        &self.recorded().recording
    }

    fn check(&self, block: usize, start: usize, count: usize) -> PyResult<()> {
        let blocks = self.samples().blocks();
        let Some(samples) = blocks.get(block) else {
            bail!("`block` = {block} is outside [0, {}]", blocks.len() - 1);
        };
        let most = samples.volts.len();
        if start.saturating_add(count) <= most {
            return Ok(());
        }
        Err(refuse(format!(
            "`start` and `count`: measurements {start} to {} of block {block}, which has {most}",
            start.saturating_add(count)
        )))
    }

    fn each<'py>(&self, py: Python<'py>, of: impl Fn(&PressFacts) -> Option<f64>) -> Array1<'py> {
        let recorded = self.recorded();
        let blocks = 0..recorded.recording.blocks().len();
        let values: Vec<f64> = blocks.map(|k| recorded.facts(k).and_then(&of).unwrap_or(f64::NAN)).collect();
        values.into_pyarray(py)
    }

    fn maps<'py>(&self, py: Python<'py>, of: impl Fn(&PressFacts) -> Option<&[f64]>) -> PyResult<Option<Array3<'py>>> {
        let recorded = self.recorded();
        let (blocks, layout) = (recorded.recording.blocks().len(), recorded.recording.layout());
        let mut all = Vec::with_capacity(blocks * layout.taxels());
        for block in 0..blocks {
            match recorded.facts(block).and_then(&of) {
                Some(values) => all.extend_from_slice(values),
                None => return Ok(None),
            }
        }
        Ok(Some(all.into_pyarray(py).reshape([blocks, layout.rows(), layout.cols()])?))
    }
}
