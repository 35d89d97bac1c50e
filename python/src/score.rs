//! How good images are.

use crate::refuse::refuse;
use numpy::{IntoPyArray as _, PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use spts::recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};

/// Support accuracy and intersection over union, each (n,), of `images` against `truths`, both (n, taxels).
#[pyfunction]
#[expect(clippy::type_complexity, reason = "a pair of arrays")]
pub(crate) fn support_scores<'py>(
    py: Python<'py>,
    images: PyReadonlyArray2<'_, f64>,
    truths: PyReadonlyArray2<'_, f64>,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
    let (images, truths) = (images.as_array(), truths.as_array());
    let (found, needed) = (images.dim(), truths.dim());
    if found != needed {
        return Err(refuse(format!(
            "`images` has shape {found:?}; {needed:?} is needed, as `truths` has it"
        )));
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
