//! Training data: everything that an algorithm may know before it gets a compressive measurement.

use super::gains::{gain_sds, on_skins_with};
use super::network::TrainedNetwork;
use super::presses::{TrainingPresses, library, prior_images, templates, training_images};
use super::shapes::{PosedObject, blobs, outline_images, shape_images, with_gains};
use crate::session::ScoredSession;
use rand::RngExt as _;
use rand::seq::SliceRandom as _;
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams, TaxelGains, fits_memory};
use spts_recon::classify::{Library, Src};
use spts_recon::dictionary::{Ksvd, Selection, select, shifted};
use spts_recon::recover::{Gaussian, ImagePrior, Unrolled};
use spts_recon::rows::{Expected, Tolerances};
use spts_recon::{Matrix, MatrixView, SignTables};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// Of so many poses one is in the library of the classifier by images.
const POSES_OF_A_LIBRARY: usize = 30;

/// Matrices of taxels × taxels that a Gaussian prior is learned with: moments, covariance and its factor and inverse.
const PRIOR_SQUARES: f64 = 4.0;

/// Dictionary, library, templates and images for priors.
///
/// ```
/// use spts_eval::training::TrainingData;
/// use spts_models::Streams;
/// use spts_recon::Matrix;
///
/// // one image of each of two classes, on a sheet of 2 × 2 taxels
/// let images = Matrix::from_columns(4, 2, &[1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0]).unwrap();
/// let data = TrainingData::of_images(images, &[1, 2], 2, Streams::new(1))?;
/// assert_eq!((data.shape, data.templates.labels()), ([2, 2], &[1, 2][..]));
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone)]
pub struct TrainingData {
    /// Rows and columns of the sheet.
    pub shape: [usize; 2],
    /// Labelled images for classification by images.
    pub library: Library,
    /// One labelled mean image for each object.
    pub templates: Library,
    /// Images for priors, taxels × images.
    pub images: Matrix,
    /// γ: relative standard deviation of the scored skin's gains compared with those of the training skins, one value a
    /// taxel; empty for the same skin.
    pub gain_sd: Vec<f64>,
    /// Whether the images show random shapes, which already lie anywhere.
    random_shapes: bool,
    /// Whether there is nothing to learn from.
    bare: bool,
    /// The same images with equal gains of all taxels, if a simulation knows them.
    alike: Option<Arc<Matrix>>,
    /// Labels of these images, if they show named objects in many poses.
    posed: Option<Arc<Vec<usize>>>,
    /// Kind of each of `images`: family of the shape, outline, object or class. Empty if nothing tells them apart.
    kinds: Arc<[Arc<str>]>,
    /// The requested network; `None` for the one shipped with the program.
    network: Option<TrainedNetwork>,
    candidates: Arc<Vec<Vec<f64>>>,
    streams: Streams,
    dictionary: OnceLock<Arc<Dictionary>>,
}

impl TrainingData {
    /// Largest number of taxels of a skin without recordings for which images are made to learn from: the sign tables
    /// of its dictionary take 1 GiB.
    pub const MOST_TAXELS: usize = 2048;

    /// Training data from `training`, for a sheet with `cols` columns. The dictionary is learned with `streams` on
    /// request.
    ///
    /// # Errors
    /// [`Refusal`] if there is no training image.
    pub fn new(
        training: &[TrainingPresses<'_>],
        cols: usize,
        gain_sd: Vec<f64>,
        streams: Streams,
    ) -> Result<Self, Refusal> {
        let (images, kinds) = prior_images(training);
        Ok(Self {
            kinds: kinds.into(),
            templates: templates(training).map_err(|e| e.at("library"))?,
            gain_sd,
            candidates: Arc::new(training_images(training)),
            ..Self::of_library(library(training).map_err(|e| e.at("library"))?, images, cols, streams)
        })
    }

    /// Training data from a `library`, which also serves as templates, and `images` for priors.
    fn of_library(library: Library, images: Matrix, cols: usize, streams: Streams) -> Self {
        Self {
            shape: [images.nrows() / cols.max(1), cols],
            templates: library.clone(),
            library,
            images,
            gain_sd: Vec::new(),
            random_shapes: false,
            bare: false,
            alike: None,
            posed: None,
            kinds: Arc::default(),
            network: None,
            candidates: Arc::default(),
            streams,
            dictionary: OnceLock::new(),
        }
    }

    /// Training data for a skin whose gains are known. `simulated` are sessions pressed on a median skin, whose taxels
    /// all have gain 1; `gains` turns them into what skins with these gains would record, each press with gains drawn
    /// anew within their uncertainty. `layout` is that of the skin.
    ///
    /// # Errors
    /// As [`Self::new`]; [`Refusal`] if a gain makes a sample infinite.
    pub fn of_skin(
        simulated: &[ScoredSession],
        gains: &TaxelGains,
        layout: &SkinLayout,
        streams: Streams,
    ) -> Result<Self, Refusal> {
        let shown = on_skins_with(gains, simulated, streams.child("calibrated", 0)).map_err(|e| e.at("gains"))?;
        let training: Vec<TrainingPresses<'_>> = shown.iter().filter_map(TrainingPresses::all).collect();
        Self::new(&training, layout.cols(), gain_sds(gains, layout), streams)
    }

    /// Training data from `images` (taxels × images) of a sheet with `cols` columns, and their `labels`. The dictionary
    /// is learned with `streams` on request. Negative values are used as they are.
    ///
    /// # Errors
    /// [`Refusal`] if all images are zero.
    ///
    /// # Panics
    /// If the number of labels differs from that of the images.
    pub fn of_images(images: Matrix, labels: &[usize], cols: usize, streams: Streams) -> Result<Self, Refusal> {
        assert_eq!(images.ncols(), labels.len(), "labels");
        let columns: Vec<Vec<f64>> = (0..images.ncols()).map(|k| images.column(k)).collect();
        let mut classes = labels.to_vec();
        classes.sort_unstable();
        classes.dedup();
        let means = classes.iter().map(|class| {
            let mut mean = vec![0.0; images.nrows()];
            let own: Vec<_> = columns.iter().zip(labels).filter(|(_, label)| *label == class).collect();
            for (column, _) in &own {
                let each = mean.iter_mut().zip(*column);
                each.for_each(|(mean, v)| *mean += v.max(0.0) / own.len() as f64);
            }
            mean
        });
        let means: Vec<Vec<f64>> = means.collect();
        Ok(Self {
            kinds: labels.iter().map(|label| format!("class {label}").into()).collect(),
            templates: Library::new(&Matrix::from_column_slices(images.nrows(), &means), &classes)
                .map_err(|e| e.at("library"))?,
            candidates: Arc::new(columns),
            ..Self::of_library(Library::new(&images, labels).map_err(|e| e.at("library"))?, images, cols, streams)
        })
    }

    /// Training data for a skin of this layout without any recording: images of random shapes for priors, a dictionary
    /// of blobs, and no classes. Of more than [`TrainingData::MOST_TAXELS`] nothing can be learned: there are no
    /// images, and decoders that need some are refused.
    ///
    /// # Errors
    /// [`Refusal`] if the images are not usable.
    pub fn for_layout(skin: &SkinLayout, streams: Streams) -> Result<Self, Refusal> {
        if skin.taxels() > Self::MOST_TAXELS {
            let one = Matrix::from_column_slices(skin.taxels(), &[vec![1.0; skin.taxels()]]);
            let library = Library::new(&one, &[0]).map_err(|e| e.at("library"))?;
            return Ok(Self { bare: true, ..Self::of_library(library, one, skin.cols(), streams) });
        }
        let (images, outlines) = outline_images(skin, streams);
        let mean: Vec<f64> = (0..images.nrows()).map(|r| images.row(r).iter().sum()).collect();
        let library =
            Library::new(&Matrix::from_column_slices(images.nrows(), &[&mean]), &[0]).map_err(|e| e.at("library"))?;
        Ok(Self {
            random_shapes: true,
            kinds: outlines.into(),
            dictionary: OnceLock::from(Arc::new(Dictionary::new(blobs(skin)))),
            ..Self::of_library(library, images, skin.cols(), streams)
        })
    }

    /// As [`Self::for_layout`], with images of procedural shapes instead of random outlines: pressed in the simulation,
    /// on taxels with the usual spread of gains. The images that [`Self::alike`] gives have the outlines too: shapes
    /// are pressed about the middle of the skin, outlines lie anywhere. A skin that is too small for the shapes has
    /// outlines alone.
    ///
    /// # Errors
    /// As [`Self::for_layout`].
    pub fn for_shapes(skin: &SkinLayout, streams: Streams) -> Result<Self, Refusal> {
        let data = Self::for_layout(skin, streams)?;
        data.check_learned()?;
        let Ok((shapes, families)) = shape_images(skin, streams.rng("shapes", 0).random()) else { return Ok(data) };
        let columns = [&shapes, &data.images].into_iter().flat_map(|of| (0..of.ncols()).map(|k| of.column(k)));
        let alike = Matrix::from_column_slices(skin.taxels(), &columns.collect::<Vec<_>>());
        let images = with_gains(&shapes, streams);
        Ok(Self { images, kinds: families.into(), alike: Some(Arc::new(alike)), ..data })
    }

    /// Training data from `objects`, each with its label, in all their poses, for a sheet with `cols` columns and
    /// unknown gains.
    ///
    /// # Errors
    /// As [`Self::of_images`].
    pub(crate) fn of_poses(objects: &[(usize, &PosedObject)], cols: usize, streams: Streams) -> Result<Self, Refusal> {
        let (mut columns, mut labels, mut kinds) = (Vec::new(), Vec::new(), Vec::new());
        for (label, object) in objects {
            columns.extend((0..object.images.ncols()).map(|k| object.images.column(k)));
            labels.resize(columns.len(), *label);
            kinds.resize(columns.len(), Arc::from(object.name));
        }
        let matrix = |columns: &[Vec<f64>]| Matrix::from_column_slices(columns.first().map_or(0, Vec::len), columns);
        let alike = matrix(&columns);
        let images = with_gains(&alike, streams);
        // the library and the dictionary take few images of every object
        let few: Vec<usize> = (0..labels.len()).step_by(POSES_OF_A_LIBRARY).collect();
        let of_library: Vec<Vec<f64>> = few.iter().map(|&k| images.column(k)).collect();
        let few_labels: Vec<usize> = few.iter().map(|&k| labels[k]).collect();
        let data = Self::of_images(matrix(&of_library), &few_labels, cols, streams)?;
        let (alike, posed) = (Some(Arc::new(alike)), Some(Arc::new(labels)));
        Ok(Self { images, alike, posed, kinds: kinds.into(), ..data })
    }

    /// Images of objects in many poses with equal gains of all taxels, and their labels; `None` if the poses are known.
    pub fn posed(&self) -> Option<(&Matrix, &[usize])> {
        Some((self.alike(), self.posed.as_ref()?.as_slice()))
    }

    /// The same training data with the network for decoders that use one.
    pub(crate) fn with_network(self, network: Option<TrainedNetwork>) -> Self {
        Self { network, ..self }
    }

    /// Images for mixtures, taxels × images; with equal gains of all taxels if a simulation knows them.
    pub fn alike(&self) -> &Matrix {
        self.alike.as_deref().unwrap_or(&self.images)
    }

    /// The network for this sheet.
    ///
    /// # Errors
    /// [`Refusal`] if there is no such sheet.
    pub fn network(&self) -> Result<Arc<Unrolled>, Refusal> {
        let network = self.network.clone().unwrap_or_else(TrainedNetwork::shipped);
        network.on(self.shape).map(Arc::new)
    }

    /// Training data with only the dictionary and library of `learned`. The library's images also serve as templates
    /// and as images for priors.
    pub fn given(learned: &Learned) -> Self {
        let library = learned.classifier.library().clone();
        let images = library.images().clone();
        Self {
            dictionary: OnceLock::from(Arc::clone(&learned.dictionary)),
            ..Self::of_library(library, images, learned.cols, Streams::new(0))
        }
    }

    /// The same training data with the given dictionary and library.
    pub(crate) fn with_published(mut self, dictionary: &Matrix, library: &Library) -> Self {
        self.dictionary = OnceLock::from(Arc::new(Dictionary::new(dictionary.clone())));
        self.library = library.clone();
        self
    }

    /// The given dictionary, or one learned by K-SVD with the published preprocessing.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn dictionary(&self) -> Result<Arc<Dictionary>, Refusal> {
        if let Some(dictionary) = self.dictionary.get() {
            return Ok(Arc::clone(dictionary));
        }
        self.check_learned()?;
        let candidates = self.candidates.as_ref().clone();
        let atoms = learn_dictionary(candidates, &(Selection::default(), Ksvd::default()), self.streams)
            .map_err(|e| e.at("dictionary"))?;
        let entries = SignTables::<f64>::entries(atoms.nrows(), atoms.ncols());
        let what = format!("tables of a dictionary of {} images of {} taxels", atoms.ncols(), atoms.nrows());
        fits_memory(&what, 8.0 * entries)?;
        let learned = Arc::new(Dictionary::new(atoms));
        Ok(Arc::clone(self.dictionary.get_or_init(|| learned)))
    }

    /// Refuses a skin that nothing can be learned for.
    ///
    /// # Errors
    /// [`Refusal`] with what is valid.
    pub(crate) fn check_learned(&self) -> Result<(), Refusal> {
        if !self.bare {
            return Ok(());
        }
        let (taxels, most) = (self.images.nrows(), Self::MOST_TAXELS);
        Err(Refusal::new(format!(
            "taxels = {taxels} is outside [1, {most}], for which images can be made to learn from; valid for any number: \
             patches, tv, empty; or scan fifteen presses to learn from"
        )))
    }

    /// Checks that there is memory for `what` with so many matrices of taxels × taxels.
    ///
    /// # Errors
    /// [`Refusal`] with the size if there is none.
    pub(crate) fn fits_squares(&self, what: &str, matrices: f64) -> Result<(), Refusal> {
        let taxels = self.images.nrows();
        fits_memory(&format!("{what} of {taxels} × {taxels} taxels"), 8.0 * matrices * (taxels as f64).powi(2))
    }

    /// How images are cleaned and shifted that are to be as `how` says: random shapes are used as they are.
    fn how(&self, how: ImagePrior) -> ImagePrior {
        if self.random_shapes {
            return ImagePrior { reach: 0, stay: 1.0, threshold: 0.0, ..ImagePrior::UNSEEN };
        }
        how
    }

    /// A prior of the images, cleaned and shifted as `how` says.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn prior(&self, how: ImagePrior) -> Result<Arc<Gaussian>, Refusal> {
        self.check_learned()?;
        self.fits_squares("a prior", PRIOR_SQUARES)?;
        let how = self.how(how);
        Ok(Arc::new(how.learn(&self.images, self.shape[1]).map_err(|e| e.at("prior"))?))
    }

    /// What rows are designed or chosen for: the images of [`Self::prior`] with `tolerances`, and, if the worst kind is
    /// to count and not the mean (`worst_kind`), every kind of them by its name, in alphabetical order. A kind is what
    /// the training data tells apart: a family of the procedural shapes, an outline, an object, or a class of images.
    /// The moments of its own images are drawn towards those of all ([`Expected::drawn_towards`]).
    ///
    /// # Errors
    /// As [`Self::prior`]; [`Refusal`] for tolerances out of range, and with `worst_kind` for fewer than two kinds.
    pub fn expected(
        &self,
        how: ImagePrior,
        tolerances: Tolerances,
        worst_kind: bool,
    ) -> Result<(Expected, Kinds), Refusal> {
        let expected = |prior: &Gaussian| Expected::like(prior, self.shape, tolerances).map_err(|e| e.at("rows"));
        let all = expected(&*self.prior(how)?)?;
        if !worst_kind {
            return Ok((all, Kinds::default()));
        }
        let mut columns: BTreeMap<&str, Vec<Vec<f64>>> = BTreeMap::new();
        for (k, kind) in self.kinds.iter().enumerate() {
            columns.entry(kind).or_default().push(self.images.column(k));
        }
        if columns.len() < 2 {
            return Err(Refusal::new(format!(
                "`--worst-kind`: the images to learn from have {} kind; valid: at least 2, such as families of shapes or \
                 objects",
                columns.len()
            )));
        }
        self.fits_squares("priors of all kinds", PRIOR_SQUARES * columns.len() as f64)?;
        let mut kinds = Kinds::default();
        for (name, columns) in columns {
            let images = Matrix::from_column_slices(self.images.nrows(), &columns);
            let own = self.how(how).learn(&images, self.shape[1]).map_err(|e| e.at(format!("kind {name}")))?;
            kinds.expected.push(expected(&own)?.drawn_towards(&all, columns.len())?);
            kinds.names.push(name.to_owned());
        }
        Ok((all, kinds))
    }
}

/// Kinds of images, by [`TrainingData::expected`]; empty where the mean of all images counts.
#[derive(Debug, Clone, Default)]
pub struct Kinds {
    /// Names.
    pub names: Vec<String>,
    /// Second moments of each kind.
    pub expected: Vec<Expected>,
}

/// Reach of the shifted dictionary if none is published, taxels.
pub const SHIFT_REACH: usize = 2;

/// What the published decoder has learned from raster presses: dictionary and classifier.
#[derive(Debug, Clone)]
pub struct Learned {
    /// Dictionary.
    pub dictionary: Arc<Dictionary>,
    /// The dictionary with shifted copies, for contacts at untrained places, taxels × atoms.
    pub shifted: Matrix,
    /// Classifier.
    pub classifier: Arc<Src>,
    /// Columns of the array.
    pub cols: usize,
}

impl Learned {
    /// Combines a dictionary (taxels × atoms), its shifted copies (computed if not given) and a library, for an array
    /// with `cols` columns.
    pub fn new(dictionary: Matrix, shifted_copies: Option<Matrix>, library: Library, cols: usize) -> Self {
        Self {
            shifted: shifted_copies.unwrap_or_else(|| shifted(&dictionary, cols, SHIFT_REACH)),
            dictionary: Arc::new(Dictionary::new(dictionary)),
            classifier: Arc::new(Src::new(library, Src::PUBLISHED_SPARSITY)),
            cols,
        }
    }

    /// Learns a dictionary by K-SVD (published preprocessing) and a library from the raster recordings of `sessions`,
    /// for an array with `cols` columns.
    ///
    /// # Errors
    /// [`Refusal`] if no raster image is strong enough.
    pub fn learn(
        sessions: &[ScoredSession],
        learning: &Learning,
        cols: usize,
        streams: Streams,
    ) -> Result<Self, Refusal> {
        let training: Vec<TrainingPresses<'_>> =
            sessions.iter().filter_map(|s| TrainingPresses::within(s, &learning.presses)).collect();
        let dictionary = learn_dictionary(training_images(&training), &learning.dictionary(), streams)
            .map_err(|e| e.at("dictionary"))?;
        Ok(Self::new(dictionary, None, library(&training).map_err(|e| e.at("library"))?, cols))
    }

    /// The same with the shifted dictionary in place of the dictionary.
    pub fn at_all_places(&self) -> Self {
        Self { dictionary: Arc::new(Dictionary::new(self.shifted.clone())), ..self.clone() }
    }
}

/// Images (atoms) that a sparse decoder composes its image of, with look-up tables for their sums under rows of ±1.
///
/// ```
/// use spts_eval::training::Dictionary;
/// use spts_recon::Matrix;
///
/// let dictionary = Dictionary::new(Matrix::from_columns(3, 1, &[1.0, 2.0, 4.0]).unwrap());
/// let phi = Matrix::from_rows(1, 3, vec![1.0, -1.0, 1.0]).unwrap();
/// let mut row = [0.0];
/// dictionary.project(phi.view(), None, &mut row);
/// assert_eq!(row, [3.0]);
/// dictionary.to_unit_weights(&mut row); // the weights {1, 0, 1}
/// assert_eq!(row, [5.0]);
/// ```
#[derive(Debug, Clone)]
pub struct Dictionary {
    /// Atoms, taxels × K.
    pub atoms: Matrix,
    /// Look-up tables of the atoms.
    pub tables: SignTables<f64>,
    /// Sum over the taxels of every atom. Φ·D with weights {0, 1} is (Φ·D with ±1 + this sum) / 2.
    pub sums: Vec<f64>,
}

impl Dictionary {
    /// The dictionary of `atoms`, taxels × K.
    pub fn new(atoms: Matrix) -> Self {
        Self { tables: SignTables::new(atoms.view()), sums: atoms.column_sums(), atoms }
    }

    /// Computes rows of Φ·D for the rows `phi` of Φ, by look-up if `signs` holds the weights as bits.
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

    /// Converts rows of Φ·D in place, from weights ±1 to weights {0, 1}: −1 becomes 0. `rows` is row-major, one value
    /// for each atom.
    pub fn to_unit_weights(&self, rows: &mut [f64]) {
        for row in rows.chunks_exact_mut(self.sums.len().max(1)) {
            row.iter_mut().zip(&self.sums).for_each(|(a, s)| *a = 0.5 * (*a + s));
        }
    }
}

/// How much the published decoder learns from: presses, images, and sweeps of the dictionary learning.
#[derive(Debug, Clone)]
pub struct Learning {
    /// Raster presses of every object that are used for training.
    pub presses: Range<usize>,
    /// Largest number of training images of the dictionary.
    pub training_images: usize,
    /// Number of sweeps of the dictionary learning.
    pub sweeps: usize,
}

impl Learning {
    /// Which images a dictionary is learned from, and how.
    pub(super) fn dictionary(&self) -> (Selection, Ksvd) {
        let selection = Selection { max_images: self.training_images, ..Selection::default() };
        let ksvd = Ksvd { n_iter: self.sweeps, ..Ksvd::default() };
        (selection, ksvd)
    }
}

/// K-SVD on what `selection` keeps of the `candidates`.
pub(super) fn learn_dictionary(
    mut candidates: Vec<Vec<f64>>,
    (selection, ksvd): &(Selection, Ksvd),
    streams: Streams,
) -> Result<Matrix, Refusal> {
    // the limit on their number then treats all objects, presses and frames alike
    candidates.shuffle(&mut streams.rng("training", 0));
    let chosen: Vec<Vec<f64>> = select(&candidates, selection).into_iter().map(|i| candidates[i].clone()).collect();
    ksvd.learn(&chosen, &mut streams.rng("ksvd", 0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 400,000 taxels: a prior would take terabytes.
    #[test]
    #[cfg(target_os = "linux")]
    fn what_does_not_fit_is_told_by_its_size() {
        let images = Matrix::from_column_slices(400_000, &[vec![1.0; 400_000]]);
        let data = TrainingData::of_images(images, &[1], 400, Streams::new(1)).unwrap();
        let said = |of: Result<(), Refusal>| of.unwrap_err().to_string();
        let prior = said(data.prior(ImagePrior::SEEN).map(drop));
        assert!(prior.starts_with("a prior of 400000 × 400000 taxels takes 5120.0 GB of memory, and "), "{prior}");
        for spec in ["evidence", "mixture", "nn_lmmse"] {
            let spec = crate::decoders::find(spec).unwrap();
            let error = said((spec.train)(&data).map(drop));
            assert!(error.contains("GB of memory, and "), "{}: {error}", spec.name);
        }
    }
}
