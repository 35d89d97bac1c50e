//! What algorithms may learn from: raster presses that are not scored, the published dictionary and library, or the twin.

use super::plan::PUBLISHED;
use crate::calibrate::PLATEAU;
use crate::score::{Protocol, Session};
use rand::seq::SliceRandom as _;
use spts_models::Streams;
use spts_recon::classify::{Library, LibraryError};
use spts_recon::dictionary::{DictionaryError, Ksvd, Learner as _, Selection, select};
use spts_recon::recover::{ImagePrior, ParameterError, PriorError};
use spts_recon::{Matrix, RangeError, SignTables};
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// Frames of a press that a dictionary is learned from: rise, plateau and lift.
const TRAINING_FRAMES: Range<usize> = 250..800;
/// Every how manieth of them.
const TRAINING_STRIDE: usize = 10;
/// Frames that a prior is learned from: early, middle and late on the plateau.
const PRIOR_FRAMES: [usize; 3] = [520, 580, 640];
/// Images of an object in the library, as in the published one.
const LIBRARY_IMAGES: usize = 10;

/// Why nothing could be learned.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LearnError {
    /// No raster image is strong enough for a dictionary.
    #[error("dictionary: {0}")]
    Ksvd(#[from] DictionaryError),
    /// No raster image for the library.
    #[error("library: {0}")]
    Library(#[from] LibraryError),
    /// No raster image for the prior.
    #[error("prior: {0}")]
    Prior(#[from] PriorError),
    /// A parameter of a decoder is out of its range.
    #[error("parameter: {0}")]
    Parameter(#[from] ParameterError),
    /// The templates make no classifier.
    #[error("templates: {0}")]
    Evidence(#[from] spts_recon::classify::EvidenceError),
    /// A range is not one.
    #[error("range: {0}")]
    Range(#[from] RangeError),
    /// An external program cannot be started.
    #[error(transparent)]
    External(#[from] super::external::ExternalError),
}

/// A dictionary with its tables, by which rows of Φ·D are looked up.
#[derive(Debug, Clone)]
pub struct Dictionary {
    /// Atoms, taxels × K.
    pub atoms: Matrix,
    /// Look-up tables of the atoms.
    pub tables: SignTables<f64>,
    /// Σ over the taxels of every atom: Φ·D with weights {0, 1} is (Φ·D with ±1 + this) / 2.
    pub sums: Vec<f64>,
}

impl Dictionary {
    /// Dictionary of `atoms`, taxels × K.
    #[must_use]
    pub fn new(atoms: Matrix) -> Self {
        Self {
            tables: SignTables::new(atoms.view()),
            sums: atoms.column_sums(),
            atoms,
        }
    }

    /// Turns rows of Φ·D with weights ±1 into those with weights {0, 1}.
    pub(super) fn to_unit_weights(&self, rows: &mut [f64]) {
        for row in rows.chunks_exact_mut(self.sums.len().max(1)) {
            row.iter_mut().zip(&self.sums).for_each(|(a, s)| *a = 0.5 * (*a + s));
        }
    }
}

/// Everything an algorithm may know before it sees a compressive measurement.
#[derive(Debug, Clone)]
pub struct Lessons {
    /// Where it comes from, as the board names it.
    pub source: String,
    /// Object that was left out.
    pub left_out: Option<String>,
    /// Rows and columns of the sheet.
    pub shape: [usize; 2],
    /// Labelled images for the classifier by images.
    pub library: Library,
    /// One labelled mean image an object.
    pub templates: Library,
    /// Images for priors, taxels × images.
    pub images: Matrix,
    training: Training,
    dictionary: OnceLock<Arc<Dictionary>>,
}

/// What a dictionary is learned from.
#[derive(Debug, Clone)]
struct Training {
    images: Arc<Vec<Vec<f64>>>,
    streams: Streams,
}

impl Lessons {
    /// Learns from the raster presses of `sessions`, but for those that `scored` scores and the object `left_out`.
    ///
    /// # Errors
    /// [`LearnError`] when there is nothing to learn from.
    pub fn from_raster(
        source: &str,
        sessions: &[Session],
        left_out: Option<&str>,
        scored: Option<&Protocol>,
        cols: usize,
        streams: Streams,
    ) -> Result<Self, LearnError> {
        let kept: Vec<Unscored<'_>> = sessions
            .iter()
            .filter(|s| Some(s.object.as_str()) != left_out)
            .map(|s| Unscored::new(s, scored))
            .collect();
        let taxels = kept.first().map_or(0, |s| s.session.raster.taxels());
        Ok(Self {
            source: source.to_owned(),
            left_out: left_out.map(str::to_owned),
            shape: [taxels / cols.max(1), cols],
            library: labelled(&kept, taxels, |s| s.plateau_images(LIBRARY_IMAGES))?,
            templates: labelled(&kept, taxels, |s| vec![s.mean_image()])?,
            images: images(&kept, taxels),
            training: Training {
                images: Arc::new(training_images(&kept)),
                streams,
            },
            dictionary: OnceLock::new(),
        })
    }

    /// The same with a dictionary and a library that were given.
    #[must_use]
    pub fn with_published(mut self, dictionary: &Matrix, library: &Library) -> Self {
        PUBLISHED.clone_into(&mut self.source);
        self.dictionary = OnceLock::from(Arc::new(Dictionary::new(dictionary.clone())));
        self.library = library.clone();
        self
    }

    /// The published dictionary, or one by K-SVD with the published preprocessing, learned when it is first asked for.
    ///
    /// # Errors
    /// [`LearnError::Ksvd`].
    pub fn dictionary(&self) -> Result<Arc<Dictionary>, LearnError> {
        if let Some(dictionary) = self.dictionary.get() {
            return Ok(Arc::clone(dictionary));
        }
        let learned = Arc::new(Dictionary::new(self.training.learn()?));
        Ok(Arc::clone(self.dictionary.get_or_init(|| learned)))
    }

    /// Prior of images, cleaned and moved about as `how` says.
    ///
    /// # Errors
    /// [`LearnError::Prior`].
    pub fn prior(&self, how: ImagePrior) -> Result<Arc<spts_recon::recover::Gaussian>, LearnError> {
        Ok(Arc::new(how.learn(&self.images, self.shape[1])?))
    }
}

/// The raster presses of a session that are not scored.
struct Unscored<'a> {
    session: &'a Session,
    presses: Vec<usize>,
}

impl<'a> Unscored<'a> {
    fn new(session: &'a Session, scored: Option<&Protocol>) -> Self {
        let scored = scored.map_or(0..0, |protocol| protocol.presses_of(&session.raster));
        let presses = (0..session.raster.blocks().len()).filter(|p| !scored.contains(p));
        Self {
            session,
            presses: presses.collect(),
        }
    }

    fn image(&self, press: usize, frame: usize) -> &'a [f64] {
        let raster = &self.session.raster;
        raster.volts(press, frame.min(raster.frames() - 1))
    }

    /// Images spread evenly over presses and plateau.
    fn plateau_images(&self, count: usize) -> Vec<Vec<f64>> {
        let frame = |k: usize| PLATEAU.start + k * PLATEAU.len() / count;
        let press = |k: usize| self.presses.get(k % self.presses.len().max(1));
        (0..count)
            .filter_map(|k| Some(self.image(*press(k)?, frame(k)).to_vec()))
            .collect()
    }

    fn mean_image(&self) -> Vec<f64> {
        let mut image = vec![0.0; self.session.raster.taxels()];
        for &press in &self.presses {
            for frame in PLATEAU {
                let volts = self.image(press, frame);
                image.iter_mut().zip(volts).for_each(|(sum, v)| *sum += v.max(0.0));
            }
        }
        image
    }
}

fn labelled(
    sessions: &[Unscored<'_>],
    taxels: usize,
    images_of: impl Fn(&Unscored<'_>) -> Vec<Vec<f64>>,
) -> Result<Library, LibraryError> {
    let (mut images, mut labels) = (Vec::new(), Vec::new());
    for session in sessions {
        for image in images_of(session) {
            images.push(image);
            labels.push(session.session.label);
        }
    }
    let slices: Vec<&[f64]> = images.iter().map(Vec::as_slice).collect();
    Library::new(&Matrix::from_column_slices(taxels, &slices), &labels)
}

fn images(sessions: &[Unscored<'_>], taxels: usize) -> Matrix {
    let mut columns: Vec<&[f64]> = Vec::new();
    for session in sessions {
        for &press in &session.presses {
            columns.extend(PRIOR_FRAMES.iter().map(|&frame| session.image(press, frame)));
        }
    }
    Matrix::from_column_slices(taxels, &columns)
}

fn training_images(sessions: &[Unscored<'_>]) -> Vec<Vec<f64>> {
    let mut images = Vec::new();
    for session in sessions {
        for &press in &session.presses {
            let frames = TRAINING_FRAMES.step_by(TRAINING_STRIDE);
            images.extend(frames.map(|frame| session.image(press, frame).to_vec()));
        }
    }
    images
}

impl Training {
    fn learn(&self) -> Result<Matrix, DictionaryError> {
        let mut order: Vec<usize> = (0..self.images.len()).collect();
        // the limit on the number of images then treats all objects, presses and frames alike
        order.shuffle(&mut self.streams.rng("training", 0));
        let candidates: Vec<Vec<f64>> = order.into_iter().map(|i| self.images[i].clone()).collect();
        let chosen = select(&candidates, &Selection::default());
        let chosen: Vec<Vec<f64>> = chosen.into_iter().map(|i| candidates[i].clone()).collect();
        Ksvd::default().learn(&chosen, &mut self.streams.rng("ksvd", 0))
    }
}
