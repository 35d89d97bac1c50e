//! Everything an algorithm may know before it sees a compressive measurement.

use super::training::{TrainingPresses, library, prior_images, templates, training_images};
use super::{layout, learn_dictionary};
use spts_models::{SkinLayout, Streams};
use spts_recon::classify::{Library, LibraryError};
use spts_recon::dictionary::{DictionaryError, Ksvd, Selection};
use spts_recon::recover::{Gaussian, ImagePrior, ParameterError, PriorError};
use spts_recon::{Matrix, MatrixView, RangeError, SignTables};
use std::sync::{Arc, OnceLock};

/// Why nothing could be learned.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LearnError {
    /// No raster image is strong enough for a dictionary.
    #[error("dictionary: {0}")]
    Dictionary(#[from] DictionaryError),
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
    /// The gains of the skin are not known.
    #[error("gains: {0}")]
    Gains(#[from] super::GainMapError),
    /// Gains make a sample infinite.
    #[error("gains: {0}")]
    Recording(#[from] spts_circuit::RecordingError),
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

    /// Rows of Φ·D for the rows `phi` of Φ, by look-ups where `signs` has the weights as bits.
    pub fn project(&self, phi: MatrixView<'_>, signs: Option<&[u64]>, out: &mut [f64]) {
        if let Some(signs) = signs {
            return self.tables.fill_rows(signs, out);
        }
        let (taxels, atoms) = (phi.ncols().max(1), self.sums.len().max(1));
        for (row, out) in phi.values().chunks_exact(taxels).zip(out.chunks_exact_mut(atoms)) {
            out.fill(0.0);
            self.atoms.accumulate_row(row, out);
        }
    }

    /// Turns rows of Φ·D with weights ±1 into those with weights {0, 1}.
    pub fn to_unit_weights(&self, rows: &mut [f64]) {
        for row in rows.chunks_exact_mut(self.sums.len().max(1)) {
            row.iter_mut().zip(&self.sums).for_each(|(a, s)| *a = 0.5 * (*a + s));
        }
    }
}

/// Dictionary, library, templates and images for priors.
#[derive(Debug, Clone)]
pub struct Lessons {
    /// Rows and columns of the sheet.
    pub shape: [usize; 2],
    /// Labelled images for the classifier by images.
    pub library: Library,
    /// One labelled mean image an object.
    pub templates: Library,
    /// Images for priors, taxels × images.
    pub images: Matrix,
    /// γ: relative standard deviation of the scored skin's gains from those of the skins learned from; 0 for the same skin.
    pub gain_sd: f64,
    /// Whether the images are of random shapes, which lie anywhere already.
    random_shapes: bool,
    candidates: Arc<Vec<Vec<f64>>>,
    streams: Streams,
    dictionary: OnceLock<Arc<Dictionary>>,
}

impl Lessons {
    /// Learns from `training` on a sheet of `cols` columns; the dictionary is learned with `streams` when it is asked for.
    ///
    /// # Errors
    /// [`LearnError::Library`] when there is nothing to learn from.
    pub fn new(
        training: &[TrainingPresses<'_>],
        cols: usize,
        gain_sd: f64,
        streams: Streams,
    ) -> Result<Self, LearnError> {
        let images = prior_images(training);
        Ok(Self {
            shape: [images.nrows() / cols.max(1), cols],
            library: library(training)?,
            templates: templates(training)?,
            images,
            gain_sd,
            random_shapes: false,
            candidates: Arc::new(training_images(training)),
            streams,
            dictionary: OnceLock::new(),
        })
    }

    /// What may be known of a skin of this layout when nothing was recorded of it: images of random shapes for priors, a dictionary
    /// of blobs, and no class.
    ///
    /// # Errors
    /// [`LearnError::Library`] when the images cannot be used.
    pub fn for_layout(skin: &SkinLayout, streams: Streams) -> Result<Self, LearnError> {
        let images = layout::images(skin, streams);
        let mean: Vec<f64> = (0..images.nrows()).map(|r| images.row(r).iter().sum()).collect();
        let library = Library::new(&Matrix::from_column_slices(images.nrows(), &[&mean]), &[0])?;
        Ok(Self {
            shape: [skin.rows(), skin.cols()],
            templates: library.clone(),
            library,
            images,
            gain_sd: 0.0,
            random_shapes: true,
            candidates: Arc::default(),
            streams,
            dictionary: OnceLock::from(Arc::new(Dictionary::new(layout::dictionary(skin)))),
        })
    }

    /// The same with a dictionary and a library that were given.
    #[must_use]
    pub fn with_published(mut self, dictionary: &Matrix, library: &Library) -> Self {
        self.dictionary = OnceLock::from(Arc::new(Dictionary::new(dictionary.clone())));
        self.library = library.clone();
        self
    }

    /// The dictionary that was given, or one by K-SVD with the published preprocessing.
    ///
    /// # Errors
    /// [`LearnError::Dictionary`].
    pub fn dictionary(&self) -> Result<Arc<Dictionary>, LearnError> {
        if let Some(dictionary) = self.dictionary.get() {
            return Ok(Arc::clone(dictionary));
        }
        let candidates = self.candidates.as_ref().clone();
        let atoms = learn_dictionary(candidates, &Selection::default(), &Ksvd::default(), self.streams)?;
        let learned = Arc::new(Dictionary::new(atoms));
        Ok(Arc::clone(self.dictionary.get_or_init(|| learned)))
    }

    /// Prior of images, cleaned and moved about as `how` says.
    ///
    /// # Errors
    /// [`LearnError::Prior`].
    pub fn prior(&self, how: ImagePrior) -> Result<Arc<Gaussian>, LearnError> {
        let how = if self.random_shapes {
            ImagePrior {
                reach: 0,
                stay: 1.0,
                threshold: 0.0,
                ..ImagePrior::UNSEEN
            }
        } else {
            how
        };
        Ok(Arc::new(how.learn(&self.images, self.shape[1])?))
    }
}
