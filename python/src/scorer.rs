//! Scores: estimators of the user on the board, beside its own decoders, and how good images are.

use crate::args::{Array1, one_of};
use crate::common::{refuse, stoppable, warn};
use numpy::{IntoPyArray as _, PyArrayMethods as _, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use spts::Refusal;
use spts::recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
use spts_eval::algorithm::{Algorithm, Answer, Class, Contender, DecodeError, Trained};
use spts_eval::board::{BoardSettings, DECODERS, Window, find, table};
use spts_eval::training::{PUBLISHED, RASTER, SHAPES, TrainingData, TrainingSource};
use spts_eval::{Labels, Sensing, Source};
use std::path::PathBuf;
use std::sync::Arc;

/// An object of Python with a method `learn(images, labels, names, shape, left_out)`, which answers a function
/// `(phi, y) -> (images or None, labels or None)`.
struct Given {
    name: String,
    object: Py<PyAny>,
}

/// That function.
struct Learned {
    name: String,
    answers: Py<PyAny>,
    taxels: usize,
    classes: usize,
}

impl Contender for Given {
    fn name(&self) -> &str {
        &self.name
    }

    fn learn(&self, data: &TrainingData, labels: &Labels, left_out: Option<&str>) -> Result<Arc<dyn Trained>, Refusal> {
        let (images, numbers) = (data.library.images(), data.library.labels());
        let taxels = images.nrows();
        let values: Vec<f64> = (0..images.ncols()).flat_map(|k| images.column(k)).collect();
        let numbers: Vec<i64> = numbers.iter().filter_map(|number| i64::try_from(*number).ok()).collect();
        let answers = Python::attach(|py| {
            let images = values.into_pyarray(py).reshape([numbers.len(), taxels])?;
            let names = labels.names().to_vec();
            let arguments = (images, numbers.into_pyarray(py), names, data.shape, left_out);
            self.object.call_method1(py, "learn", arguments)
        });
        Ok(Arc::new(Learned {
            name: self.name.clone(),
            answers: answers.map_err(|e| failed(&self.name, &e))?,
            taxels,
            classes: labels.names().len(),
        }))
    }
}

fn failed(name: &str, error: &PyErr) -> Refusal {
    Refusal::new(error.to_string()).at(name)
}

impl Trained for Learned {
    fn start(&self) -> Box<dyn Algorithm + '_> {
        Box::new(Asked(self))
    }
}

struct Asked<'a>(&'a Learned);

impl Algorithm for Asked<'_> {
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
        if let Some(found) = self.decode_all(std::slice::from_ref(window))?.pop() {
            *answer = found;
        }
        Ok(())
    }

    fn decode_all(&mut self, windows: &[Window<'_>]) -> Result<Vec<Answer>, DecodeError> {
        let Some(first) = windows.first() else {
            return Ok(Vec::new());
        };
        let (count, m, taxels) = (windows.len(), first.y.len(), first.phi.ncols());
        let mut phi = Vec::with_capacity(count * m * taxels);
        let mut y = Vec::with_capacity(count * m);
        let mut rows = Vec::new();
        for window in windows {
            phi.extend_from_slice(window.with_rows(&mut rows).phi.values());
            y.extend_from_slice(window.y);
        }
        let found = Python::attach(|py| {
            let phi = phi.into_pyarray(py).reshape([count, m, taxels])?;
            let y = y.into_pyarray(py).reshape([count, m])?;
            self.0.answered(self.0.answers.bind(py).call1((phi, y))?, count)
        });
        found.map_err(|e| DecodeError::External(failed(&self.0.name, &e)))
    }

    fn batched(&self) -> bool {
        true
    }
}

impl Learned {
    /// One answer a window out of a pair of images and labels.
    fn answered(&self, found: Bound<'_, PyAny>, count: usize) -> PyResult<Vec<Answer>> {
        type Pair<'py> = (Option<PyReadonlyArray2<'py, f64>>, Option<PyReadonlyArray1<'py, i64>>);
        let (images, labels): Pair<'_> = found.extract()?;
        let mut answers = vec![Answer::default(); count];
        if let Some(images) = &images {
            let images = images.as_array();
            let needed = (count, self.taxels);
            if images.dim() != needed {
                bail!("images of shape {:?}; {needed:?} is needed", images.dim());
            }
            for (answer, image) in answers.iter_mut().zip(images.rows()) {
                if !image.iter().all(|v| v.is_finite()) {
                    bail!("an image with a value that is not finite");
                }
                answer.image = image.to_vec();
            }
        }
        if let Some(labels) = &labels {
            let labels = labels.as_array();
            if labels.len() != count {
                bail!("{} labels for {count} windows", labels.len());
            }
            for (answer, label) in answers.iter_mut().zip(labels) {
                let known = usize::try_from(*label).ok().filter(|label| *label < self.classes);
                answer.class = Some(known.map_or(Class::Unknown, Class::Known));
            }
        }
        Ok(answers)
    }
}

/// Scores decoders and estimators on sessions; the board as JSON and as text.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub(crate) fn score_sessions(
    py: Python<'_>,
    path: PathBuf,
    decoders: Vec<String>,
    given: Vec<(String, Py<PyAny>)>,
    measurements: Vec<usize>,
    objects: Vec<String>,
    left_out: bool,
    learn_from: &str,
    sensing: Vec<String>,
    times: bool,
    seed: u64,
) -> PyResult<(String, String)> {
    let named = decoders.iter().map(|name| {
        find(name).ok_or_else(|| {
            let known: Vec<&str> = DECODERS.iter().map(|spec| spec.name).collect();
            refuse(format!("`estimator` = \"{name}\"; valid: an estimator, or {}", known.join(", ")))
        })
    });
    let decoders = named.collect::<PyResult<Vec<_>>>()?;
    if let Some(m) = measurements.iter().find(|m| !(1..=10_000).contains(*m)) {
        bail!("`measurements` = {m} is outside [1, 10000]");
    }
    let sources =
        [(PUBLISHED, TrainingSource::Published), (RASTER, TrainingSource::Raster), (SHAPES, TrainingSource::Shapes)];
    let training = vec![one_of("learn_from", learn_from, &sources)?];
    let sensing = sensing.iter().map(|name| {
        let known = Sensing::ALL.into_iter().find(|sensing| sensing.name() == name);
        known.ok_or_else(|| {
            refuse(format!("`sensing` = \"{name}\"; valid: {}", Sensing::ALL.map(Sensing::name).join(", ")))
        })
    });
    let sensing = sensing.collect::<PyResult<Vec<_>>>()?;
    let external = given.into_iter().map(|(name, object)| Arc::new(Given { name, object }) as Arc<dyn Contender>);
    let settings = BoardSettings {
        decoders,
        external: external.collect(),
        measurements,
        objects,
        localisation: Vec::new(),
        left_out,
        sensing,
        training,
        network: None,
        times,
        seed,
    };
    let (board, note) = stoppable(py, |step| {
        let source = Source::open(&path).map_err(refuse)?;
        step();
        let ready = settings.learn(&source).map_err(refuse)?;
        step();
        ready.score(step).map_err(refuse).map(|board| (board, source.note))
    })??;
    note.iter().try_for_each(|note| warn(py, note))?;
    Ok((serde_json::to_string(&board).map_err(refuse)?, table(&board)))
}

/// Support accuracy and intersection over union, each (n,), of `images` against `truths`, both (n, taxels).
#[pyfunction]
pub(crate) fn support_scores<'py>(
    py: Python<'py>,
    images: PyReadonlyArray2<'_, f64>,
    truths: PyReadonlyArray2<'_, f64>,
) -> PyResult<(Array1<'py>, Array1<'py>)> {
    let (images, truths) = (images.as_array(), truths.as_array());
    let (found, needed) = (images.dim(), truths.dim());
    if found != needed {
        bail!("`images` has shape {found:?}; {needed:?} is needed, as `truths` has it");
    }
    let (mut own, mut truth) = (Vec::new(), Vec::new());
    let scores = images.rows().into_iter().zip(truths.rows()).map(|(image, wanted)| {
        support(&image.to_vec(), SUPPORT_THRESHOLD, &mut own);
        support(&wanted.to_vec(), SUPPORT_THRESHOLD, &mut truth);
        let score = SupportScore::new(&own, &truth);
        (score.accuracy, score.iou)
    });
    let (accuracy, iou): (Vec<f64>, Vec<f64>) = scores.unzip();
    Ok((accuracy.into_pyarray(py), iou.into_pyarray(py)))
}
