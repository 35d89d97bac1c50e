//! Which measurements of a recording form a window: consecutive ones, or those with selected rows.
//!
//! A held press contains thousands of random rows of a constant image. Any set of rows that a rule selects without
//! looking at the samples can therefore be scored on real samples. The order in time is lost: memory effects of the
//! cells, and changes during the press, are those of the recording and not of the window.

use crate::training::TrainingData;
use crate::windows::Press;
use serde::{Deserialize, Serialize};
use spts_input::Refusal;
use spts_recon::classify::{Component, TemplateModel};
use spts_recon::localise::WIDTHS_PX;
use spts_recon::recover::ImagePrior;
use spts_recon::rows::{Expected, RowTask, Tolerances, choose_for_classes, choose_for_images};
use spts_recon::{Matrix, MatrixView};

/// How the rows of a window are obtained.
///
/// ```
/// use spts_eval::Sensing;
///
/// assert_eq!(Sensing::ALL.map(Sensing::name), ["random", "chosen", "worst_kind"]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sensing {
    /// Consecutive measurements, with the rows that the cells put out.
    #[default]
    Random,
    /// Rows selected from those of a press for the decoder's training data, before any sample is used.
    Chosen,
    /// As [`Self::Chosen`], for the kind of the training images of which most is left ([`RowTask::kinds`]) in place of
    /// their mean. Rows for classes are those of [`Self::Chosen`], for the classes that are least apart.
    WorstKind,
}

impl Sensing {
    /// All ways.
    pub const ALL: [Self; 3] = [Self::Random, Self::Chosen, Self::WorstKind];

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Chosen => "chosen",
            Self::WorstKind => "worst_kind",
        }
    }
}

/// Windows of a press: candidates are every so many rows, beginning with each of the first so many.
const OFFSETS: usize = 3;

/// Share of the scored frames that candidates come from: the first 150 of 200 published ones, before a press yields.
const CANDIDATES: [usize; 2] = [3, 4];

/// Noise of a measurement that rows are chosen with, as a share of the root mean square of a random row's sum.
const NOISE: f64 = RowTask::NOISE;

/// Selects rows for the training data of a decoder. It knows neither the scored object nor any sample.
#[derive(Debug, Clone)]
pub struct RowChooser {
    images: Expected,
    kinds: Vec<Expected>,
    classes: Vec<Component>,
}

impl RowChooser {
    /// A chooser for images and classes like those of `data`; with `worst_kind`, for the worst kind of the images.
    ///
    /// # Errors
    /// [`Refusal`] if they make no prior, and with `worst_kind` if they are of fewer than two kinds.
    pub fn new(data: &TrainingData, worst_kind: bool) -> Result<Self, Refusal> {
        let (images, kinds) = data.expected(ImagePrior::UNSEEN, Tolerances::default(), worst_kind)?;
        let templates = &data.templates;
        let several = templates.labels().iter().any(|label| *label != templates.labels()[0]);
        let classes = if several {
            let model = TemplateModel::new(data.shape[1]);
            model.classes(templates).map_err(|e| e.at("templates"))?
        } else {
            Vec::new()
        };
        Ok(Self { images, kinds: kinds.expected, classes })
    }

    /// Three windows of `press`, each of up to `most` measurements in the order of their choice: for images, and for
    /// classes; without `classes`, those for images again.
    ///
    /// # Errors
    /// [`Refusal`] when the rows have another number of taxels than the images.
    pub(crate) fn windows(&self, press: &Press, most: usize, classes: bool) -> Result<[Vec<Press>; 2], Refusal> {
        let [share, of] = CANDIDATES;
        let pool = (press.len() * share / of).max(1).min(press.len());
        let task = RowTask { classes: &self.classes, noise: NOISE, ..RowTask::new(1, &self.images) };
        let of_images = RowTask { kinds: &self.kinds, ..task };
        let images = chosen(press, pool, most, |rows, m| choose_for_images(&RowTask { rows: m, ..of_images }, rows))?;
        let classes = if classes && !self.classes.is_empty() {
            chosen(press, pool, most, |rows, m| choose_for_classes(&RowTask { rows: m, ..task }, rows))?
        } else {
            images.clone()
        };
        Ok([images, classes])
    }
}

/// Windows of `press` whose rows tell places of blobs, of up to `most` measurements each. With `worst_kind`, the blobs
/// of every width are a kind.
///
/// # Errors
/// [`Refusal`] when the rows do not fill the sheet.
pub(crate) fn chosen_places(
    press: &Press,
    shape: [usize; 2],
    most: usize,
    worst_kind: bool,
) -> Result<Vec<Press>, Refusal> {
    let how = ImagePrior { reach: 0, stay: 1.0, threshold: 0.0, ..ImagePrior::UNSEEN };
    let like =
        |widths: &[f64]| Expected::like(&how.learn(&blobs(shape, widths), shape[1])?, shape, Tolerances::default());
    let expected = like(&WIDTHS_PX)?;
    let kinds = WIDTHS_PX.iter().filter(|_| worst_kind).map(|width| like(&[*width]));
    let kinds = kinds.collect::<Result<Vec<_>, _>>()?;
    let task = RowTask { kinds: &kinds, noise: NOISE, ..RowTask::new(1, &expected) };
    chosen(press, press.len(), most, |rows, m| choose_for_images(&RowTask { rows: m, ..task }, rows))
}

/// One round blob at every taxel, of each of the `widths`, taxels.
fn blobs(shape: [usize; 2], widths: &[f64]) -> Matrix {
    let [rows, cols] = shape;
    let blob = |width: f64, centre: usize| {
        let at = |k: usize| {
            let d = ((k / cols) as f64 - (centre / cols) as f64).hypot((k % cols) as f64 - (centre % cols) as f64);
            (-0.5 * (d / width).powi(2)).exp()
        };
        (0..rows * cols).map(at).collect::<Vec<f64>>()
    };
    let all = widths.iter().flat_map(|&width| (0..rows * cols).map(move |centre| (width, centre)));
    let images: Vec<Vec<f64>> = all.map(|(width, centre)| blob(width, centre)).collect();
    Matrix::from_column_slices(rows * cols, &images)
}

/// A window for every offset: up to `most` of every third of the first `pool` measurements, chosen by `choose`. A
/// measurement that was lost is no candidate.
fn chosen(
    press: &Press,
    pool: usize,
    most: usize,
    choose: impl Fn(MatrixView<'_>, usize) -> Result<Vec<usize>, Refusal>,
) -> Result<Vec<Press>, Refusal> {
    let mut windows = Vec::with_capacity(OFFSETS);
    for offset in 0..OFFSETS {
        let candidates = (offset..pool).step_by(OFFSETS).filter(|k| press.window(*k, 1).is_some());
        let candidates: Vec<usize> = candidates.collect();
        if candidates.is_empty() {
            continue;
        }
        let there = press.picked(&candidates);
        let Some(all) = there.window(0, candidates.len()) else {
            continue;
        };
        let order = choose(all.phi, most.min(candidates.len()))?;
        windows.push(there.picked(&order));
    }
    Ok(windows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::windows::PressRows;
    use spts_recon::rows::{DesignRows as _, Random};
    use std::sync::Arc;

    const SHAPE: [usize; 2] = [4, 4];

    fn press(volts: Vec<f64>) -> Press {
        let expected = Expected::smooth(SHAPE, 1.0).unwrap();
        let rows = Random.design(&RowTask::new(volts.len(), &expected)).unwrap();
        Press::on(Arc::new(PressRows::of_matrix(&rows)), volts, 0.0)
    }

    fn windows(volts: Vec<f64>, most: usize) -> Vec<(Vec<f64>, Vec<f64>)> {
        let found = chosen_places(&press(volts), SHAPE, most, false).unwrap();
        let all = found.iter().map(|press| press.window(0, most).unwrap());
        all.map(|w| (w.phi.values().to_vec(), w.y.to_vec())).collect()
    }

    /// The measurement whose sample is its number.
    fn number(sample: f64) -> usize {
        (0..90).position(|k| f64::from(k).to_bits() == sample.to_bits()).unwrap()
    }

    /// Other samples at the same rows are no reason for another choice, and each sample stays with its row.
    #[test]
    fn the_choice_sees_no_sample() {
        let (count, most) = (90, 6);
        let first = windows((0..count).map(f64::from).collect(), most);
        let second = windows((0..count).map(|k| f64::from((k * 37) % 50) - 20.0).collect(), most);
        assert_eq!(first.len(), OFFSETS);
        let all = press((0..count).map(f64::from).collect());
        for (offset, ((phi, y), (other, _))) in first.iter().zip(&second).enumerate() {
            assert_eq!(phi, other);
            for (row, sample) in phi.chunks_exact(16).zip(y) {
                let at = number(*sample);
                assert_eq!(at % OFFSETS, offset);
                assert_eq!(all.window(at, 1).unwrap().phi.values(), row);
            }
        }
    }

    /// The seventeen families of shapes are much alike: the one of which most is left is seen no worse than at rows for
    /// the mean, and no family much worse. Training images of one kind are refused.
    #[test]
    fn rows_for_the_worst_family_lose_no_other() {
        use spts_models::{SkinLayout, Streams};
        use spts_recon::rows::posterior_trace;
        let data = TrainingData::for_shapes(&SkinLayout::default(), Streams::new(1)).unwrap();
        let (all, kinds) = data.expected(ImagePrior::UNSEEN, Tolerances::default(), true).unwrap();
        assert_eq!(kinds.names.len(), 17);
        let candidates = Random.design(&RowTask::new(150, &all)).unwrap();
        for m in [7, 20] {
            let left = |kinds_counted: &[Expected]| {
                let task = RowTask { kinds: kinds_counted, ..RowTask::new(m, &all) };
                let chosen = choose_for_images(&task, candidates.view()).unwrap();
                let rows: Vec<f64> = chosen.iter().flat_map(|&k| candidates.row(k)).copied().collect();
                let rows = Matrix::from_rows(m, 100, rows).unwrap();
                let of = |expected| posterior_trace(&RowTask { expected, ..RowTask::new(m, &all) }, &rows).unwrap();
                kinds.expected.iter().map(of).collect::<Vec<f64>>()
            };
            let (own, for_mean) = (left(&kinds.expected), left(&[]));
            let worst = |shares: &[f64]| shares.iter().copied().fold(0.0, f64::max);
            let each: Vec<_> = kinds.names.iter().zip(own.iter().zip(&for_mean)).collect();
            assert!(worst(&own) < worst(&for_mean) + 0.005, "M = {m}: {each:.3?}");
            assert!(own.iter().zip(&for_mean).all(|(own, mean)| *own < mean + 0.03), "M = {m}: {each:.3?}");
        }
        let one = TrainingData::of_images(Matrix::from_column_slices(4, &[vec![1.0; 4]]), &[1], 2, Streams::new(1));
        let refused = RowChooser::new(&one.unwrap(), true).unwrap_err().to_string();
        assert!(
            refused.contains("`--worst-kind`: the images to learn from have 1 kind; valid: at least 2"),
            "{refused}"
        );
    }

    /// A window of fewer measurements begins the longer one; a lost sample is in none.
    #[test]
    fn the_first_rows_are_a_choice_of_their_own_and_lost_samples_are_no_candidates() {
        let all: Vec<f64> = (0..90).map(f64::from).collect();
        let long = windows(all.clone(), 6);
        for (short, long) in windows(all.clone(), 3).iter().zip(&long) {
            assert_eq!((&short.0[..], &short.1[..]), (&long.0[..48], &long.1[..3]));
        }
        let mut lost = all;
        long.iter().for_each(|(_, y)| lost[number(y[0])] = f64::NAN);
        for ((_, y), (_, before)) in windows(lost, 6).iter().zip(&long) {
            assert!(y.iter().all(|v| v.is_finite() && v.to_bits() != before[0].to_bits()));
        }
        assert!(windows(vec![f64::NAN; 9], 4).is_empty());
    }
}
