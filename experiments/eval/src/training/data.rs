//! Everything an algorithm may know before it sees a compressive measurement.

use super::dictionary::{Dictionary, learn_dictionary};
use super::error::LearnError;
use super::gains::{gain_sds, on_skins_with};
use super::layout;
use super::learned::Learned;
use super::network::TrainedNetwork;
use super::poses::PosedObject;
use super::presses::{TrainingPresses, library, prior_images, templates, training_images};
use super::shapes::shape_images;
use crate::session::ScoredSession;
use rand::RngExt as _;
use spts_models::{SkinLayout, Streams, TaxelGains};
use spts_recon::Matrix;
use spts_recon::classify::Library;
use spts_recon::dictionary::{Ksvd, Selection};
use spts_recon::recover::{Gaussian, ImagePrior, Unrolled};
use std::sync::{Arc, OnceLock};

/// Of so many poses one is in the library of the classifier by images.
const POSES_OF_A_LIBRARY: usize = 30;

/// Dictionary, library, templates and images for priors.
#[derive(Debug, Clone)]
pub struct TrainingData {
    /// Rows and columns of the sheet.
    pub shape: [usize; 2],
    /// Labelled images for the classifier by images.
    pub library: Library,
    /// One labelled mean image an object.
    pub templates: Library,
    /// Images for priors, taxels × images.
    pub images: Matrix,
    /// γ: relative standard deviation of the scored skin's gains from those of the skins learned from, one value a
    /// taxel; empty for the same skin.
    pub gain_sd: Vec<f64>,
    /// Whether the images are of random shapes, which lie anywhere already.
    random_shapes: bool,
    /// The same images, all taxels with the same gain, where a simulation knows them.
    alike: Option<Arc<Matrix>>,
    /// Labels of these images, where they are of named objects in many poses.
    posed: Option<Arc<Vec<usize>>>,
    /// The network that was named; the one that ships otherwise.
    network: Option<TrainedNetwork>,
    candidates: Arc<Vec<Vec<f64>>>,
    streams: Streams,
    dictionary: OnceLock<Arc<Dictionary>>,
}

impl TrainingData {
    /// Most taxels of a skin of which nothing was recorded: the sums of signs of its dictionary take 1 GiB.
    pub const MOST_TAXELS: usize = 2048;

    /// Learns from `training` on a sheet of `cols` columns; the dictionary is learned with `streams` when it is asked
    /// for.
    ///
    /// # Errors
    /// [`LearnError::Library`] when there is nothing to learn from.
    pub fn new(
        training: &[TrainingPresses<'_>],
        cols: usize,
        gain_sd: Vec<f64>,
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
            alike: None,
            posed: None,
            network: None,
            candidates: Arc::new(training_images(training)),
            streams,
            dictionary: OnceLock::new(),
        })
    }

    /// Learns from `simulated` presses at gain 1 as skins with these `gains` show them.
    ///
    /// # Errors
    /// As [`Self::new`]; [`LearnError::Recording`] when a gain makes a sample infinite.
    pub fn of_skin(
        simulated: &[ScoredSession],
        gains: &TaxelGains,
        cols: usize,
        streams: Streams,
    ) -> Result<Self, LearnError> {
        let shown = on_skins_with(gains, simulated, streams.child("calibrated", 0))?;
        let training: Vec<TrainingPresses<'_>> = shown.iter().filter_map(TrainingPresses::all).collect();
        Self::new(&training, cols, gain_sds(gains), streams)
    }

    /// What the `images` (taxels × images) of a sheet of `cols` columns and their `labels` tell; the dictionary is
    /// learned from them, with `streams`, when it is asked for. Negative values count as they are.
    ///
    /// # Errors
    /// [`LearnError::Library`] when no image is different from zero.
    ///
    /// # Panics
    /// When there is not one label an image.
    pub fn of_images(images: Matrix, labels: &[usize], cols: usize, streams: Streams) -> Result<Self, LearnError> {
        assert_eq!(images.ncols(), labels.len(), "labels");
        let columns: Vec<Vec<f64>> = (0..images.ncols()).map(|k| images.column(k)).collect();
        let mut classes = labels.to_vec();
        classes.sort_unstable();
        classes.dedup();
        let means = classes.iter().map(|class| {
            let mut mean = vec![0.0; images.nrows()];
            let own = columns.iter().zip(labels).filter(|(_, label)| *label == class);
            let count = own.clone().count() as f64;
            for (column, _) in own {
                mean.iter_mut()
                    .zip(column)
                    .for_each(|(mean, v)| *mean += v.max(0.0) / count);
            }
            mean
        });
        let means: Vec<Vec<f64>> = means.collect();
        let slices: Vec<&[f64]> = means.iter().map(Vec::as_slice).collect();
        Ok(Self {
            shape: [images.nrows() / cols.max(1), cols],
            library: Library::new(&images, labels)?,
            templates: Library::new(&Matrix::from_column_slices(images.nrows(), &slices), &classes)?,
            images,
            gain_sd: Vec::new(),
            random_shapes: false,
            alike: None,
            posed: None,
            network: None,
            candidates: Arc::new(columns),
            streams,
            dictionary: OnceLock::new(),
        })
    }

    /// What may be known of a skin of this layout when nothing was recorded of it: images of random shapes for priors,
    /// a dictionary of blobs, and no class.
    ///
    /// # Errors
    /// [`LearnError::TooLarge`] for more than [`TrainingData::MOST_TAXELS`], [`LearnError::Library`] when the images
    /// cannot be used.
    pub fn for_layout(skin: &SkinLayout, streams: Streams) -> Result<Self, LearnError> {
        let (taxels, most) = (skin.taxels(), Self::MOST_TAXELS);
        if taxels > most {
            return Err(LearnError::TooLarge { taxels, most });
        }
        let images = layout::images(skin, streams);
        let mean: Vec<f64> = (0..images.nrows()).map(|r| images.row(r).iter().sum()).collect();
        let library = Library::new(&Matrix::from_column_slices(images.nrows(), &[&mean]), &[0])?;
        Ok(Self {
            shape: [skin.rows(), skin.cols()],
            templates: library.clone(),
            library,
            images,
            gain_sd: Vec::new(),
            random_shapes: true,
            alike: None,
            posed: None,
            network: None,
            candidates: Arc::default(),
            streams,
            dictionary: OnceLock::from(Arc::new(Dictionary::new(layout::dictionary(skin)))),
        })
    }

    /// The same with images of the procedural shapes in place of random outlines: pressed in the simulation on taxels
    /// whose gains scatter as a skin's do.
    ///
    /// # Errors
    /// As [`Self::for_layout`]; [`LearnError::Shapes`] when no shape can be pressed on the skin.
    pub fn for_shapes(skin: &SkinLayout, streams: Streams) -> Result<Self, LearnError> {
        let data = Self::for_layout(skin, streams)?;
        let alike = shape_images(skin, streams.rng("shapes", 0).random())?;
        Ok(Self {
            images: layout::with_gains(&alike, streams),
            alike: Some(Arc::new(alike)),
            ..data
        })
    }

    /// What the `objects`, each with its label, tell in all their poses, on a sheet of `cols` columns whose gains
    /// nobody knows.
    ///
    /// # Errors
    /// As [`Self::of_images`].
    pub fn of_poses(objects: &[(usize, &PosedObject)], cols: usize, streams: Streams) -> Result<Self, LearnError> {
        let (mut columns, mut labels) = (Vec::new(), Vec::new());
        for (label, object) in objects {
            columns.extend((0..object.images.ncols()).map(|k| object.images.column(k)));
            labels.resize(columns.len(), *label);
        }
        let matrix = |columns: &[Vec<f64>]| {
            let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
            Matrix::from_column_slices(columns.first().map_or(0, Vec::len), &slices)
        };
        let alike = matrix(&columns);
        let images = layout::with_gains(&alike, streams);
        // the library and the dictionary take few images of every object
        let few: Vec<usize> = (0..labels.len()).step_by(POSES_OF_A_LIBRARY).collect();
        let of_library: Vec<Vec<f64>> = few.iter().map(|&k| images.column(k)).collect();
        let few_labels: Vec<usize> = few.iter().map(|&k| labels[k]).collect();
        let data = Self::of_images(matrix(&of_library), &few_labels, cols, streams)?;
        Ok(Self {
            images,
            alike: Some(Arc::new(alike)),
            posed: Some(Arc::new(labels)),
            ..data
        })
    }

    /// Images of objects in many poses, all taxels of the same gain, with their labels; `None` where the poses are
    /// known.
    #[must_use]
    pub fn posed(&self) -> Option<(&Matrix, &[usize])> {
        Some((self.alike(), self.posed.as_ref()?.as_slice()))
    }

    /// The same with the network that decoders are to use.
    #[must_use]
    pub fn with_network(self, network: Option<TrainedNetwork>) -> Self {
        Self { network, ..self }
    }

    /// Images for mixtures, taxels × images: without the gains of single taxels where a simulation knows them.
    #[must_use]
    pub fn alike(&self) -> &Matrix {
        self.alike.as_deref().unwrap_or(&self.images)
    }

    /// The network for this sheet.
    ///
    /// # Errors
    /// [`LearnError::Network`] when it is for another one.
    pub fn network(&self) -> Result<Arc<Unrolled>, LearnError> {
        let network = self.network.clone().unwrap_or_else(TrainedNetwork::shipped);
        Ok(network.on(self.shape)?)
    }

    /// Dictionary and library of `learned` and nothing else: its images also stand for the templates and the images of
    /// priors.
    #[must_use]
    pub fn given(learned: &Learned) -> Self {
        let library = learned.classifier.library().clone();
        Self {
            shape: [learned.dictionary.atoms.nrows() / learned.cols.max(1), learned.cols],
            templates: library.clone(),
            images: library.images().clone(),
            library,
            gain_sd: Vec::new(),
            random_shapes: false,
            alike: None,
            posed: None,
            network: None,
            candidates: Arc::default(),
            streams: Streams::new(0),
            dictionary: OnceLock::from(Arc::clone(&learned.dictionary)),
        }
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
        let atoms = learn_dictionary(candidates, &(Selection::default(), Ksvd::default()), self.streams)?;
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
