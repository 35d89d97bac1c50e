//! Raster presses for training, and the images made from them.

use crate::protocol::{PLATEAU, PUBLISHED_RATE_HZ, PUBLISHED_TAXELS};
use crate::session::ScoredSession;
use spts_circuit::Recording;
use spts_input::Refusal;
use spts_recon::Matrix;
use spts_recon::classify::Library;
use std::ops::Range;
use std::sync::Arc;

/// Frames of a press that dictionary learning looks at: the rise, the plateau and the lift.
const TRAINING_FRAMES: Range<usize> = 250..800;
/// Step between these frames.
const TRAINING_STRIDE: usize = 10;
/// Plateau frames that enter the classifier's library.
const LIBRARY_FRAMES: Range<usize> = PLATEAU;
/// Library images of an object, as in the published library.
const LIBRARY_IMAGES: usize = 10;
/// Frames of a press that a prior is learned from: early, middle and late on the plateau.
const PRIOR_FRAMES: [usize; 3] = [520, 580, 640];

/// A raster recording, and which of its presses are used for training.
#[derive(Debug, Clone)]
pub struct TrainingPresses<'a> {
    label: usize,
    /// Name of the object.
    object: &'a str,
    raster: &'a Recording,
    /// Frames of the hold of this recording; in the published recordings it begins with [`PLATEAU`].
    hold: Range<usize>,
    presses: Vec<usize>,
}

impl<'a> TrainingPresses<'a> {
    /// The presses `presses` of `session`, as far as they exist; `None` without a raster recording.
    pub fn within(session: &'a ScoredSession, presses: &Range<usize>) -> Option<Self> {
        let raster = session.raster.as_ref().filter(|_| !session.shared_raster)?;
        let end = presses.end.min(raster.blocks().len());
        let first = session.raster_protocol.first_frame;
        Some(Self {
            label: session.label,
            object: &session.object,
            raster,
            hold: first..first + session.raster_protocol.frames,
            presses: (presses.start.min(end)..end).collect(),
        })
    }

    /// All presses of `session` that are neither scored nor ground truth; `None` without a raster recording.
    pub fn unscored(session: &'a ScoredSession) -> Option<Self> {
        let all = Self::all(session)?;
        let protocol = &session.raster_protocol;
        let scored = protocol.presses_of(all.raster);
        let truth = protocol.truth.0.min(all.raster.blocks().len().saturating_sub(1));
        let presses = all.presses.iter().copied();
        Some(Self { presses: presses.filter(|p| !scored.contains(p) && *p != truth).collect(), ..all })
    }

    /// All presses of `session`; `None` without a raster recording.
    pub fn all(session: &'a ScoredSession) -> Option<Self> {
        Self::within(session, &(0..usize::MAX))
    }

    /// The same presses, with the class `label`.
    pub fn labelled(self, label: usize) -> Self {
        Self { label, ..self }
    }

    /// Whether there is no press.
    pub fn is_empty(&self) -> bool {
        self.presses.is_empty()
    }

    /// Image of `press` at the instant of `frame` of the published skin.
    fn image(&self, press: usize, frame: usize) -> &'a [f64] {
        self.raster.volts(press, self.own(frame).min(self.raster.frames() - 1))
    }

    /// Frame at the same time before or after the beginning of the hold as `frame` of the published skin; the last of
    /// the hold for one on the published plateau where the hold is shorter.
    fn own(&self, frame: usize) -> usize {
        let relative_rate = self.raster.sample_rate_hz() / PUBLISHED_RATE_HZ;
        let per_frame = self.raster.measurements_per_frame() as f64;
        #[expect(clippy::cast_possible_truncation, reason = "no press has so many frames")]
        let scaled = |frames: usize| ((frames * PUBLISHED_TAXELS) as f64 * relative_rate / per_frame) as usize;
        let own = (self.hold.start + scaled(frame)).saturating_sub(scaled(PLATEAU.start));
        if PLATEAU.contains(&frame) { own.min(self.hold.end - 1) } else { own }
    }

    /// Ten plateau images, spread evenly over presses and plateau.
    fn plateau_images(&self) -> impl Iterator<Item = &'a [f64]> {
        let frame = |k: usize| LIBRARY_FRAMES.start + k * LIBRARY_FRAMES.len() / LIBRARY_IMAGES;
        let press = |k: usize| self.presses.get(k % self.presses.len().max(1)).copied();
        (0..LIBRARY_IMAGES).filter_map(move |k| Some(self.image(press(k)?, frame(k))))
    }

    /// Mean over the plateau of all presses, negative values set to zero.
    fn mean_image(&self) -> Vec<f64> {
        let (mut image, mut count) = (vec![0.0; self.raster.taxels()], 0.0);
        for &press in &self.presses {
            for frame in LIBRARY_FRAMES {
                let volts = self.image(press, frame);
                image.iter_mut().zip(volts).for_each(|(sum, v)| *sum += v.max(0.0));
                count += 1.0;
            }
        }
        image.iter_mut().for_each(|v| *v /= f64::max(count, 1.0));
        image
    }
}

/// Candidates for a dictionary's training images, in order of press, frame, session.
pub fn training_images(training: &[TrainingPresses<'_>]) -> Vec<Vec<f64>> {
    let most = training.iter().map(|t| t.presses.len()).max().unwrap_or(0);
    let mut images = Vec::new();
    for k in 0..most {
        for frame in TRAINING_FRAMES.step_by(TRAINING_STRIDE) {
            for t in training {
                if let Some(&press) = t.presses.get(k).filter(|_| t.own(frame) < t.raster.frames()) {
                    images.push(t.image(press, frame).to_vec());
                }
            }
        }
    }
    images
}

/// Ten plateau images of every object.
///
/// # Errors
/// [`Refusal`] if all images are zero.
pub fn library(training: &[TrainingPresses<'_>]) -> Result<Library, Refusal> {
    class_library(training, |t| t.plateau_images().map(<[f64]>::to_vec).collect())
}

/// One mean image for each object. An object without a press is left out.
///
/// # Errors
/// [`Refusal`] if all images are zero.
pub fn templates(training: &[TrainingPresses<'_>]) -> Result<Library, Refusal> {
    class_library(training, |t| vec![t.mean_image()])
}

fn class_library(
    training: &[TrainingPresses<'_>],
    images_of: impl Fn(&TrainingPresses<'_>) -> Vec<Vec<f64>>,
) -> Result<Library, Refusal> {
    let (mut images, mut labels) = (Vec::new(), Vec::new());
    for t in training {
        for image in images_of(t) {
            images.push(image);
            labels.push(t.label);
        }
    }
    Library::new(&Matrix::from_column_slices(taxels(training), &images), &labels)
}

/// Images that a decoder's prior is learned from, taxels × images, V: three raster images of every press, from early,
/// middle and late in the hold; and the object of each image.
pub fn prior_images(training: &[TrainingPresses<'_>]) -> (Matrix, Vec<Arc<str>>) {
    let mut columns: Vec<&[f64]> = Vec::new();
    let mut objects = Vec::new();
    for t in training {
        for &press in &t.presses {
            columns.extend(PRIOR_FRAMES.iter().map(|&frame| t.image(press, frame)));
        }
        objects.resize(columns.len(), Arc::from(t.object));
    }
    (Matrix::from_column_slices(taxels(training), &columns), objects)
}

fn taxels(training: &[TrainingPresses<'_>]) -> usize {
    training.first().map_or(0, |t| t.raster.taxels())
}
