//! Decoders that have learned.

use crate::args::{Array2, triples};
use crate::common::{refuse, released};
use numpy::{
    AllowTypeChange, IntoPyArray as _, PyArray1, PyArray2, PyArrayLike2, PyArrayMethods as _, PyReadonlyArray1,
    PyReadonlyArray2, PyReadonlyArray3,
};
use pyo3::prelude::*;
use pyo3::types::{PyTuple, PyType};
use spts::SkinLayout;
use spts::models::Streams;
use spts::recon::classify::{Library, Src};
use spts::recon::{Matrix, Workspace};
use spts_eval::algorithm::{Answer, Class, Trained};
use spts_eval::decoders::{DECODERS, Needs, auto, find};
use spts_eval::placed::Arrangement;
use spts_eval::training::TrainingData;
use spts_eval::{Press, PressRows};
use std::sync::Arc;

/// Most taxels of a skin.
const MOST_TAXELS: usize = 1 << 20;

/// Class of a window that is of none.
const NO_CLASS: i64 = -1;

/// Windows between two looks at whether Ctrl-C was pressed.
const SLICE: usize = 256;

/// A decoder that has learned what it needs, for one skin.
///
/// Parameters
/// ----------
/// name : str
///     One of `spts.decoders.names()`.
/// shape : (int, int)
///     Rows and columns of taxels.
/// images : ndarray (n, taxels), optional
///     Raster images to learn from, in any unit; default random shapes on the layout.
/// labels : ndarray (n,) of int, optional
///     Class of every image, from 0; default one class.
/// surface : (ndarray (taxels, 3), ndarray (taxels, 3)), optional
///     Places, m, and normals of the taxels, for a decoder that learns from no images: which taxels are neighbours then
///     follows from them and not from `shape`. At most 16,384 taxels.
#[pyclass(frozen, module = "spts._spts")]
pub(crate) struct Decoder {
    trained: Arc<dyn Trained>,
    /// Name of the algorithm.
    #[pyo3(get)]
    name: &'static str,
    /// Rows and columns of taxels.
    #[pyo3(get)]
    shape: (usize, usize),
    /// What it has learned from, for its copies in other processes: they learn again.
    images: Option<Py<PyArray2<f64>>>,
    labels: Option<Py<PyArray1<i64>>>,
    surface: Option<Surface>,
}

/// Places and normals of the taxels.
type Surface = (Py<PyArray2<f64>>, Py<PyArray2<f64>>);

#[pymethods]
impl Decoder {
    #[new]
    #[pyo3(signature = (name, shape, images = None, labels = None, surface = None))]
    fn new(
        py: Python<'_>,
        name: &str,
        shape: (usize, usize),
        images: Option<PyReadonlyArray2<'_, f64>>,
        labels: Option<PyReadonlyArray1<'_, i64>>,
        surface: Option<(PyArrayLike2<'_, f64, AllowTypeChange>, PyArrayLike2<'_, f64, AllowTypeChange>)>,
    ) -> PyResult<Self> {
        let Some(spec) = find(name) else {
            let known: Vec<&str> = DECODERS.iter().map(|spec| spec.name).collect();
            bail!("`decoder` = \"{name}\"; valid: {}", known.join(", "));
        };
        let taxels = shape.0.saturating_mul(shape.1);
        if taxels == 0 || taxels > MOST_TAXELS {
            bail!("`shape` = {shape:?}: its taxels are outside [1, {MOST_TAXELS}]");
        }
        let placed = match &surface {
            None => None,
            Some(_) if images.is_some() => bail!("`surface`: images are learned from taxel by taxel"),
            Some((places, normals)) => {
                let (places, normals) = (triples("places", places)?, triples("normals", normals)?);
                if places.len() != taxels {
                    bail!("`surface` has {} places; {taxels} are needed, one a taxel", places.len());
                }
                Some(released(py, || Arrangement::new(&places, &normals))?.map_err(refuse)?)
            }
        };
        let grid = placed.as_ref().map_or([shape.0, shape.1], Arrangement::shape);
        let learned = match &images {
            Some(images) => {
                let images = images_in(images, taxels)?;
                let labels = labels_in(labels.as_ref(), images.ncols())?;
                released(py, || TrainingData::of_images(images, &labels, shape.1, Streams::new(0)))?
            }
            None if spec.needs == Needs::Classes => {
                bail!("`images`: \"{name}\" learns from raster images of named objects");
            }
            None => {
                let layout = SkinLayout::with_pitch(grid[0], grid[1], 0.015).map_err(refuse)?;
                released(py, || match spec.needs {
                    Needs::Shapes => TrainingData::for_shapes(&layout, Streams::new(0)),
                    _ => TrainingData::for_layout(&layout, Streams::new(0)),
                })?
            }
        };
        let data = learned.map_err(refuse)?;
        let trained: Arc<dyn Trained> = released(py, || (spec.train)(&data))?.map_err(refuse)?.into();
        Ok(Self {
            trained: match placed {
                Some(placed) => placed.place(trained),
                None => trained,
            },
            name: spec.name,
            shape,
            images: images.map(|images| copied(py, &images)),
            labels: labels.map(|labels| copied(py, &labels)),
            surface: surface.map(|(places, normals)| (copied(py, &places), copied(py, &normals))),
        })
    }

    /// Image of one window: `phi` (M, taxels), `y` (M,) V; (rows, cols).
    fn decode<'py>(
        &self,
        py: Python<'py>,
        phi: PyReadonlyArray2<'_, f64>,
        y: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Array2<'py>> {
        let rows = self.rows_of(phi.as_array().rows().into_iter().flatten().copied(), phi.as_array().dim())?;
        let y = measured(y.as_array().iter().copied(), rows.1)?;
        let image = released(py, || {
            let press = Press::on(Arc::new(PressRows::of_matrix(&rows.0)), y, 0.0);
            let window = press.window(0, rows.1).ok_or_else(|| refuse("`y` holds a value that is not finite"))?;
            let mut answer = Answer::default();
            self.trained.start().decode(&window, &mut answer).map_err(refuse)?;
            Ok::<_, PyErr>(answer.image)
        })??;
        self.image_out(image)?.into_pyarray(py).reshape([self.shape.0, self.shape.1])
    }

    /// Images and classes of n windows: `phi` (n, M, taxels), `y` (n, M); images (n, taxels), and classes (n,), -1 for
    /// none. A window that cannot be decoded has an empty image and no class.
    fn decode_all<'py>(
        &self,
        py: Python<'py>,
        phi: PyReadonlyArray3<'_, f64>,
        y: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<(Array2<'py>, Bound<'py, PyArray1<i64>>)> {
        let (count, m, taxels) = phi.as_array().dim();
        let found = y.as_array().dim();
        if found != (count, m) {
            bail!("`y` has shape {found:?}; ({count}, {m}) is needed, as `phi` has it");
        }
        let own = self.shape.0 * self.shape.1;
        let mut images = Vec::with_capacity(count * own);
        let mut classes = Vec::with_capacity(count);
        let mut windows = Vec::with_capacity(SLICE);
        for first in (0..count).step_by(SLICE) {
            windows.clear();
            for k in first..count.min(first + SLICE) {
                let phi = phi.as_array();
                let rows = phi.index_axis(numpy::ndarray::Axis(0), k);
                let rows = self.rows_of(rows.iter().copied(), (m, taxels))?;
                windows.push((rows.0, measured(y.as_array().row(k).iter().copied(), m)?));
            }
            let answers = released(py, || {
                let presses =
                    windows.drain(..).map(|(rows, y)| Press::on(Arc::new(PressRows::of_matrix(&rows)), y, 0.0));
                let presses: Vec<Press> = presses.collect();
                let windows: Vec<_> = presses.iter().filter_map(|press| press.window(0, m)).collect();
                self.trained.start().decode_all(&windows)
            })?;
            for answer in answers.map_err(refuse)? {
                let label = answer.class.and_then(Class::label);
                classes.push(label.and_then(|label| i64::try_from(label).ok()).unwrap_or(NO_CLASS));
                images.extend(self.image_out(answer.image)?);
            }
            py.check_signals()?;
        }
        Ok((images.into_pyarray(py).reshape([count, own])?, classes.into_pyarray(py)))
    }

    /// Nothing changes a decoder: a copy shares what was learned.
    fn __copy__(&self, py: Python<'_>) -> Self {
        Self {
            trained: Arc::clone(&self.trained),
            images: self.images.as_ref().map(|images| images.clone_ref(py)),
            labels: self.labels.as_ref().map(|labels| labels.clone_ref(py)),
            surface: self.surface.as_ref().map(|(places, normals)| (places.clone_ref(py), normals.clone_ref(py))),
            name: self.name,
            shape: self.shape,
        }
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> Self {
        self.__copy__(py)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyType>, Bound<'py, PyTuple>)> {
        let (py, own) = (slf.py(), slf.get());
        let arguments =
            (own.name, own.shape, own.images.as_ref(), own.labels.as_ref(), own.surface.as_ref()).into_pyobject(py)?;
        Ok((slf.get_type(), arguments))
    }

    fn __repr__(&self) -> String {
        format!("<spts decoder {} for {} x {} taxels>", self.name, self.shape.0, self.shape.1)
    }
}

impl Decoder {
    /// The rows of Φ, checked, and their number.
    fn rows_of(&self, values: impl Iterator<Item = f64>, dim: (usize, usize)) -> PyResult<(Matrix, usize)> {
        let taxels = self.shape.0 * self.shape.1;
        if dim.0 == 0 || dim.1 != taxels {
            bail!("`phi` has shape {dim:?}; (M, {taxels}) with M > 0 is needed");
        }
        let values: Vec<f64> = values.collect();
        if let Some(k) = values.iter().position(|v| !v.is_finite()) {
            bail!("`phi[{}, {}]` = {} is not finite", k / taxels, k % taxels, values[k]);
        }
        Ok((Matrix::from_rows(dim.0, taxels, values).map_err(refuse)?, dim.0))
    }

    /// The image of an answer; zeros for a decoder that makes none.
    fn image_out(&self, image: Vec<f64>) -> PyResult<Vec<f64>> {
        let taxels = self.shape.0 * self.shape.1;
        match image.len() {
            0 => Ok(vec![0.0; taxels]),
            found if found == taxels => Ok(image),
            found => Err(refuse(format!("the image has {found} values in place of {taxels}"))),
        }
    }
}

/// An array of our own: what others do to theirs does not show.
fn copied<T: numpy::Element + Clone, D: numpy::ndarray::Dimension>(
    py: Python<'_>,
    array: &numpy::PyReadonlyArray<'_, T, D>,
) -> Py<numpy::PyArray<T, D>> {
    array.as_array().to_owned().into_pyarray(py).unbind()
}

/// Measurements, checked; `m` are needed.
fn measured(values: impl ExactSizeIterator<Item = f64>, m: usize) -> PyResult<Vec<f64>> {
    if values.len() != m {
        bail!("`y` has {} values; {m} are needed, one a row of Φ", values.len());
    }
    let values: Vec<f64> = values.collect();
    if let Some(k) = values.iter().position(|v| !v.is_finite()) {
        bail!("`y[{k}]` = {} is not finite", values[k]);
    }
    Ok(values)
}

/// Images (n, taxels) as taxels × images.
fn images_in(images: &PyReadonlyArray2<'_, f64>, taxels: usize) -> PyResult<Matrix> {
    let images = images.as_array();
    let dim = images.dim();
    if dim.0 == 0 || dim.1 != taxels {
        bail!("`images` has shape {dim:?}; (n, {taxels}) with n > 0 is needed");
    }
    if let Some(((k, taxel), v)) = images.indexed_iter().find(|(_, v)| !v.is_finite()) {
        bail!("`images[{k}, {taxel}]` = {v} is not finite");
    }
    let columns: Vec<Vec<f64>> = images.rows().into_iter().map(|row| row.to_vec()).collect();
    Ok(Matrix::from_column_slices(taxels, &columns))
}

/// One class an image.
fn labels_in(labels: Option<&PyReadonlyArray1<'_, i64>>, count: usize) -> PyResult<Vec<usize>> {
    let Some(labels) = labels else {
        return Ok(vec![0; count]);
    };
    let labels = labels.as_array();
    if labels.len() != count {
        bail!("`labels` has {} values; {count} are needed, one an image", labels.len());
    }
    let label = |label: &i64| usize::try_from(*label).map_err(|_| refuse(format!("`labels` = {label} is below 0")));
    labels.iter().map(label).collect()
}

/// Classifier of images by their sparsest representation among labelled ones.
///
/// Parameters
/// ----------
/// images : ndarray (n, pixels)
/// labels : ndarray (n,) of int, from 0
#[pyclass(frozen, module = "spts._spts")]
pub(crate) struct ImageClassifier {
    learned: Arc<Src>,
    images: Py<PyArray2<f64>>,
    labels: Py<PyArray1<i64>>,
    sparsity: usize,
}

#[pymethods]
impl ImageClassifier {
    #[new]
    #[pyo3(signature = (images, labels, sparsity = Src::PUBLISHED_SPARSITY))]
    fn new(
        py: Python<'_>,
        images: PyReadonlyArray2<'_, f64>,
        labels: PyReadonlyArray1<'_, i64>,
        sparsity: usize,
    ) -> PyResult<Self> {
        let pixels = images.as_array().ncols();
        let own = (copied(py, &images), copied(py, &labels));
        let images = images_in(&images, pixels)?;
        let labels = labels_in(Some(&labels), images.ncols())?;
        if !(1..=1024).contains(&sparsity) {
            bail!("`sparsity` = {sparsity} is outside [1, 1024]");
        }
        let library = Library::new(&images, &labels).map_err(refuse)?;
        Ok(Self { learned: Arc::new(Src::new(library, sparsity)), images: own.0, labels: own.1, sparsity })
    }

    /// Nothing changes a classifier: a copy shares what was learned.
    fn __copy__(&self, py: Python<'_>) -> Self {
        Self {
            learned: Arc::clone(&self.learned),
            images: self.images.clone_ref(py),
            labels: self.labels.clone_ref(py),
            sparsity: self.sparsity,
        }
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> Self {
        self.__copy__(py)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyType>, Bound<'py, PyTuple>)> {
        let own = slf.get();
        Ok((slf.get_type(), (&own.images, &own.labels, own.sparsity).into_pyobject(slf.py())?))
    }

    /// Classes of `images` (n, pixels), (n,); -1 for an empty image.
    fn classify<'py>(&self, py: Python<'py>, images: PyReadonlyArray2<'_, f64>) -> PyResult<Bound<'py, PyArray1<i64>>> {
        let images = images_in(&images, self.learned.library().images().nrows())?;
        let classes = released(py, || {
            let mut work = Workspace::default();
            let classes = (0..images.ncols()).map(|k| {
                let class = self.learned.classify(&images.column(k), &mut work).map_err(refuse)?;
                Ok(class.and_then(|c| i64::try_from(c).ok()).unwrap_or(NO_CLASS))
            });
            classes.collect::<PyResult<Vec<i64>>>()
        })?;
        Ok(classes?.into_pyarray(py))
    }
}

/// Name of the decoder for images of anything on a skin of rows x columns of taxels.
#[pyfunction]
pub(crate) fn auto_decoder(rows: usize, cols: usize) -> &'static str {
    auto([rows, cols], false).name
}

/// Name of every decoder, what it is, and what it learns from: "nothing", "dictionary", "images", "classes" or
/// "shapes".
#[pyfunction]
pub(crate) fn decoder_table() -> Vec<(&'static str, &'static str, &'static str)> {
    let needs = |needs| match needs {
        Needs::Nothing => "nothing",
        Needs::Dictionary => "dictionary",
        Needs::Images => "images",
        Needs::Classes => "classes",
        Needs::Shapes | Needs::Network => "shapes",
    };
    DECODERS.iter().map(|spec| (spec.name, spec.about, needs(spec.needs))).collect()
}
