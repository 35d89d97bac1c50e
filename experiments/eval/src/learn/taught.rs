//! Raster presses that are learned from, and the images taken of them.

use crate::score::PLATEAU;
use crate::score::{Protocol, Session};
use spts_recon::Matrix;
use spts_recon::classify::{Library, LibraryError};
use std::ops::Range;

/// Taxels of the published skin, in whose frames the instants below are counted: a larger skin has fewer frames in the same
/// time.
pub const PUBLISHED_TAXELS: usize = 100;
/// Frames of a press that dictionary learning looks at: the rise, the plateau and the lift.
const TRAINING_FRAMES: Range<usize> = 250..800;
/// Every how manieth of them.
const TRAINING_STRIDE: usize = 10;
/// Plateau frames that enter the classifier's library.
const LIBRARY_FRAMES: Range<usize> = PLATEAU;
/// Library images of an object, as in the published library.
const LIBRARY_IMAGES: usize = 10;
/// Frames of a press that a prior is learned from: early, middle and late on the plateau.
const PRIOR_FRAMES: [usize; 3] = [520, 580, 640];

/// A raster session and those of its presses that are learned from.
#[derive(Debug, Clone)]
pub struct Taught<'a> {
    session: &'a Session,
    presses: Vec<usize>,
}

impl<'a> Taught<'a> {
    /// The presses `presses` of `session`, as far as there are any.
    #[must_use]
    pub fn within(session: &'a Session, presses: &Range<usize>) -> Self {
        let end = presses.end.min(session.raster.blocks().len());
        Self {
            session,
            presses: (presses.start.min(end)..end).collect(),
        }
    }

    /// All presses of `session` that `protocol` neither scores nor takes the truth from.
    #[must_use]
    pub fn unscored(session: &'a Session, protocol: &Protocol) -> Self {
        let scored = protocol.presses_of(&session.raster);
        let all = 0..session.raster.blocks().len();
        let truth = protocol.truth.0.min(all.end.saturating_sub(1));
        Self {
            session,
            presses: all.filter(|p| !scored.contains(p) && *p != truth).collect(),
        }
    }

    /// All presses of `session`.
    #[must_use]
    pub fn all(session: &'a Session) -> Self {
        Self::within(session, &(0..usize::MAX))
    }

    /// Image of `press` at the instant of `frame` of the published skin.
    fn image(&self, press: usize, frame: usize) -> &'a [f64] {
        let raster = &self.session.raster;
        raster.volts(press, self.own(frame).min(raster.frames() - 1))
    }

    fn own(&self, frame: usize) -> usize {
        frame * PUBLISHED_TAXELS / self.session.raster.measurements_per_frame()
    }

    /// Ten plateau images, spread evenly over presses and plateau.
    fn plateau_images(&self) -> impl Iterator<Item = &'a [f64]> {
        let frame = |k: usize| LIBRARY_FRAMES.start + k * LIBRARY_FRAMES.len() / LIBRARY_IMAGES;
        let press = |k: usize| self.presses.get(k % self.presses.len().max(1)).copied();
        (0..LIBRARY_IMAGES).filter_map(move |k| Some(self.image(press(k)?, frame(k))))
    }

    /// Mean over the plateau of all presses, negative values set to zero.
    fn mean_image(&self) -> Vec<f64> {
        let (mut image, mut count) = (vec![0.0; self.session.raster.taxels()], 0.0);
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

/// Candidates for a dictionary's training set, in the order presses, frames, sessions.
#[must_use]
pub fn training_images(taught: &[Taught<'_>]) -> Vec<Vec<f64>> {
    let most = taught.iter().map(|t| t.presses.len()).max().unwrap_or(0);
    let mut images = Vec::new();
    for k in 0..most {
        for frame in TRAINING_FRAMES.step_by(TRAINING_STRIDE) {
            for t in taught {
                if let Some(&press) = t.presses.get(k).filter(|_| t.own(frame) < t.session.raster.frames()) {
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
/// [`LibraryError`] when no image is different from zero.
pub fn library(taught: &[Taught<'_>]) -> Result<Library, LibraryError> {
    labelled(taught, |t| t.plateau_images().map(<[f64]>::to_vec).collect())
}

/// One mean image an object. An object without a press is left out.
///
/// # Errors
/// [`LibraryError`] when no image is different from zero.
pub fn templates(taught: &[Taught<'_>]) -> Result<Library, LibraryError> {
    labelled(taught, |t| vec![t.mean_image()])
}

fn labelled(taught: &[Taught<'_>], images_of: impl Fn(&Taught<'_>) -> Vec<Vec<f64>>) -> Result<Library, LibraryError> {
    let (mut images, mut labels) = (Vec::new(), Vec::new());
    for t in taught {
        for image in images_of(t) {
            images.push(image);
            labels.push(t.session.label);
        }
    }
    let slices: Vec<&[f64]> = images.iter().map(Vec::as_slice).collect();
    Library::new(&Matrix::from_column_slices(taxels(taught), &slices), &labels)
}

/// Images for priors, taxels × images.
#[must_use]
pub fn prior_images(taught: &[Taught<'_>]) -> Matrix {
    let mut columns: Vec<&[f64]> = Vec::new();
    for t in taught {
        for &press in &t.presses {
            columns.extend(PRIOR_FRAMES.iter().map(|&frame| t.image(press, frame)));
        }
    }
    Matrix::from_column_slices(taxels(taught), &columns)
}

fn taxels(taught: &[Taught<'_>]) -> usize {
    taught.first().map_or(0, |t| t.session.raster.taxels())
}
