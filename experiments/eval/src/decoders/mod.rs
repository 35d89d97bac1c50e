//! The table of algorithms. A new one has a file here and a line in [`DECODERS`].

mod amortised;
mod baselines;
mod evidence;
mod image;
mod patches;

pub use image::quarter;

use crate::algorithm::Trained;
use crate::training::{Learned, TrainingData};
use Needs::{Classes, Dictionary, Images, Network, Nothing, Shapes};
use spts_input::Refusal;
use spts_recon::classify::Src;
use std::sync::Arc;

/// Training data that a decoder needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// Nothing.
    Nothing,
    /// A dictionary: the published one, unless another source is requested or an object is left out.
    Dictionary,
    /// Raster images.
    Images,
    /// Raster images of named objects.
    Classes,
    /// Procedural shapes pressed in the simulation, for every source of training data.
    Shapes,
    /// Only the parameters of a network, which was trained on such shapes before.
    Network,
}

impl Needs {
    /// Whether the training data are procedural shapes, for every source of training data.
    pub fn shapes(self) -> bool {
        matches!(self, Self::Shapes | Self::Network)
    }
}

/// A decoder in the table [`DECODERS`]: its names, what it needs, and how it is trained.
///
/// ```
/// use spts_eval::decoders::{DECODERS, find};
///
/// let evidence = find("evidence").expect("in the table");
/// assert!(evidence.shown && evidence.anytime);
/// assert!(DECODERS.iter().all(|decoder| !decoder.about.is_empty()));
/// ```
#[derive(Clone, Copy)]
pub struct DecoderSpec {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// Name in plain words, on pages and in their figures.
    pub label: &'static str,
    /// Name where space is short: in printed tables, and in figures with many decoders.
    pub short: &'static str,
    /// Description.
    pub about: &'static str,
    /// Training data that it needs.
    pub needs: Needs,
    /// Whether the board shows it if none is named.
    pub shown: bool,
    /// Whether it states its confidence after every sample.
    pub anytime: bool,
    /// Colour, 0xRRGGBB, and marker of its curves; without one it is drawn as an external program is.
    pub look: Option<(u32, u8)>,
    /// Trains the algorithm.
    pub train: Train,
}

type Train = fn(&TrainingData) -> Result<Box<dyn Trained>, Refusal>;

const fn spec(name: &'static str, label: &'static str, needs: Needs, shown: bool, train: Train) -> DecoderSpec {
    DecoderSpec { name, label, short: label, about: "", needs, shown, anytime: false, look: None, train }
}

impl DecoderSpec {
    /// The line with a shorter label.
    const fn short(mut self, short: &'static str) -> Self {
        self.short = short;
        self
    }

    /// The line with what the algorithm is.
    const fn about(mut self, about: &'static str) -> Self {
        self.about = about;
        self
    }

    /// The line with the colour, 0xRRGGBB, and the marker of its curves: 0 disc, 1 square, 2 triangle, 3 diamond, 4
    /// triangle on its tip, 5 pentagon.
    const fn drawn(mut self, colour: u32, marker: u8) -> Self {
        self.look = Some((colour, marker));
        self
    }

    /// The line of an algorithm that says after every sample how sure it is.
    const fn anytime(mut self) -> Self {
        self.anytime = true;
        self
    }
}

/// Every algorithm: name, label, training data, whether it is shown by default, training function, shorter label,
/// description, look.
pub const DECODERS: &[DecoderSpec] = &[
    spec("empty", "empty image", Nothing, true, baselines::empty)
        .about("baseline: an empty image")
        .drawn(0x8a_8f_98, 3),
    spec("mean_image", "mean image", Images, true, baselines::mean_image)
        .about("baseline: the mean of all images learned from")
        .drawn(0x5f_66_70, 1),
    spec("correlate", "best correlated", Classes, true, baselines::correlate)
        .about("baseline: the object's mean image that correlates best with y")
        .drawn(0x9c_86_5a, 2),
    spec("script_s20", "published script", Dictionary, true, image::script_s20)
        .short("script, 20 atoms")
        .about("the published script: weights {0, 1}, no offset, 20 atoms")
        .drawn(0x56_b4_e9, 2),
    spec("script_m4", "published script, M/4 atoms", Dictionary, false, image::script_m4)
        .short("script, M/4 atoms")
        .about("the published text: weights {0, 1}, no offset, M/4 atoms")
        .drawn(0x2c_3f_8f, 5),
    spec("matched", "published pursuit, matched to ±1", Dictionary, true, image::matched)
        .short("matched")
        .about("the published pursuit with weights ±1 and the idle output removed")
        .drawn(0x00_72_b2, 0),
    spec("omp", "OMP", Dictionary, true, image::omp)
        .about("orthogonal matching pursuit, columns normalised")
        .drawn(0x6a_3d_9a, 0),
    spec("nn_omp", "non-negative OMP", Dictionary, true, image::nn_omp)
        .about("non-negative orthogonal matching pursuit")
        .drawn(0xcc_79_a7, 1),
    spec("nn_lasso", "non-negative lasso", Dictionary, true, image::nn_lasso)
        .about("non-negative lasso on normalised columns")
        .drawn(0xe6_9f_00, 2),
    spec("lmmse", "LMMSE", Images, false, image::lmmse)
        .about("linear minimum mean square error, prior of images like those seen")
        .drawn(0x66_a6_1e, 0),
    spec("nn_lmmse", "non-negative LMMSE", Images, true, image::nn_lmmse)
        .about("linear minimum mean square error with non-negative taxels, prior for unseen objects")
        .anytime()
        .drawn(0x00_9e_73, 3),
    spec("nn_lmmse_seen", "non-negative LMMSE, objects seen", Images, false, image::nn_lmmse_seen)
        .short("NN LMMSE, objects seen")
        .about("as nn_lmmse, prior for the objects that were seen")
        .drawn(0x00_5f_45, 1),
    spec("mixture", "mixture of shapes", Shapes, false, evidence::mixture)
        .about("thirty clusters of shapes, simulated and drawn, weighed by the evidence of y, non-negative taxels")
        .drawn(0x1b_9a_aa, 5),
    spec("amortised", "trained network", Network, false, amortised::train)
        .short("amortised")
        .about("network trained on simulated shapes: image and the probability that a taxel is touched")
        .anytime()
        .drawn(0x1a_1a_1a, 2),
    spec("tv", "total variation", Nothing, false, image::tv)
        .about("total variation with non-negative taxels")
        .drawn(0x4a_4a_4a, 4),
    spec("patches", "patches", Nothing, false, patches::patches).about(
        "patches of a few taxels, or total variation on coarser cells, whichever predicts a ninth of y; for any size",
    ),
    spec("evidence", "evidence", Classes, true, evidence::train)
        .about("Gaussian classes weighed by the evidence of y; the image is the posterior mean")
        .anytime()
        .drawn(0xd5_5e_00, 1),
];

/// The decoder called `name` in [`DECODERS`]; `None` if there is none.
pub fn find(name: &str) -> Option<&'static DecoderSpec> {
    DECODERS.iter().find(|spec| spec.name == name)
}

/// Name that stands for the decoder that [`auto`] chooses.
pub const AUTO: &str = "auto";

/// The decoder for images of anything on a skin of `shape` (rows and columns), when nothing is known of the objects:
/// `amortised` on up to 2,048 taxels, and where a network is given (`own_network`), `patches` on more, where the others
/// take seconds and gigabytes.
///
/// docs/python.md has the measurements behind the rule.
///
/// ```
/// use spts_eval::decoders::auto;
///
/// assert_eq!((auto([10, 10], false).name, auto([1, 600], false).name), ("amortised", "amortised"));
/// assert_eq!((auto([100, 100], false).name, auto([100, 100], true).name), ("patches", "amortised"));
/// ```
pub fn auto([rows, cols]: [usize; 2], own_network: bool) -> &'static DecoderSpec {
    let large = rows.saturating_mul(cols) > TrainingData::MOST_TAXELS;
    let name = if large && !own_network { "patches" } else { "amortised" };
    find(name).unwrap_or(&DECODERS[0])
}

/// A trained algorithm, with an image classifier for algorithms that find no class themselves.
#[derive(Clone)]
pub struct TrainedDecoder {
    pub(crate) trained: Arc<dyn Trained>,
    pub(crate) classifier: Arc<Src>,
}

impl TrainedDecoder {
    /// Trains the algorithm `spec` with `data`.
    ///
    /// # Errors
    /// [`Refusal`] if `data` is not usable.
    pub fn new(spec: &DecoderSpec, data: &TrainingData) -> Result<Self, Refusal> {
        Ok(Self::of(Arc::from((spec.train)(data)?), data))
    }

    /// `trained`, which has learned from `data`.
    pub fn of(trained: Arc<dyn Trained>, data: &TrainingData) -> Self {
        let classifier = Src::new(data.library.clone(), Src::PUBLISHED_SPARSITY);
        Self { trained, classifier: Arc::new(classifier) }
    }

    /// Called after all windows are decoded, as [`Trained::finish`].
    ///
    /// # Errors
    /// [`Refusal`] of an external program that did not end well.
    pub fn finish(&self) -> Result<(), Refusal> {
        Ok(self.trained.finish()?)
    }
}

/// Name of the control on the board: the raster session, reduced to M pixels a frame.
pub const RASTER: &str = "raster";

/// Label and short label of the control, which is scored beside the decoders of the table and is none of them.
const CONTROL: [&str; 2] = ["raster scan of M taxels", "raster"];

/// Label of the decoder or control `name`, in plain words, on pages and in their figures. An external program is
/// labelled by its name.
///
/// ```
/// use spts_eval::decoders::{label, short_label};
///
/// assert_eq!(label("amortised"), "trained network");
/// assert_eq!(short_label("amortised"), "amortised");
/// assert_eq!(label("my program"), "my program");
/// ```
pub fn label(name: &str) -> &str {
    match find(name) {
        Some(spec) => spec.label,
        None if name == RASTER => CONTROL[0],
        None => name,
    }
}

/// Label of the decoder or control `name` where space is short: in printed tables, and in figures with many decoders.
/// An external program is labelled by its name.
pub fn short_label(name: &str) -> &str {
    match find(name) {
        Some(spec) => spec.short,
        None if name == RASTER => CONTROL[1],
        None => name,
    }
}

/// The decodes of the published evaluation: the published script (weights {0, 1}, no offset, 20 atoms), the text of the
/// paper (the same with M/4 atoms), and the pursuit adapted to the device (weights ±1, the idle mean subtracted, M/4
/// atoms).
///
/// ```
/// use spts_eval::decoders::{PUBLISHED_DECODES, find, quarter};
///
/// assert_eq!((quarter(20), quarter(50), quarter(1)), (5, 13, 1));
/// assert!(PUBLISHED_DECODES.iter().all(|name| find(name).is_some()));
/// ```
pub const PUBLISHED_DECODES: [&str; 3] = ["script_s20", "script_m4", "matched"];

/// The decoder called `name`, with dictionary and library of `learned`.
///
/// # Errors
/// [`Refusal`] if there is no such decoder, or `learned` is not usable.
pub fn published(name: &str, learned: &Learned) -> Result<TrainedDecoder, Refusal> {
    let spec = find(name).ok_or_else(|| Refusal::new(format!("no decoder is called {name:?}")))?;
    TrainedDecoder::new(spec, &TrainingData::given(learned))
}

/// All [`PUBLISHED_DECODES`], each beside its name.
///
/// # Errors
/// As for [`published`].
pub fn published_decodes(learned: &Learned) -> Result<Vec<(&'static str, TrainedDecoder)>, Refusal> {
    let each = PUBLISHED_DECODES.into_iter();
    each.map(|name| Ok((name, published(name, learned)?))).collect()
}

/// Why `decoder` cannot be stopped by its confidence.
pub fn no_confidence(decoder: &str) -> Refusal {
    let valid = DECODERS.iter().filter(|spec| spec.anytime).map(|spec| spec.name);
    let valid = valid.collect::<Vec<_>>().join(", ");
    Refusal::new(format!("`--decoder` = {decoder}: states no confidence; valid: {valid}"))
}

/// Why `decoder` cannot track a contact in time.
pub fn not_in_time(decoder: &str) -> Refusal {
    Refusal::new(format!("`--decoder` = {decoder}: has no Gaussian prior to track a contact with; valid: nn_lmmse"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_described() {
        for (k, spec) in DECODERS.iter().enumerate() {
            let twice = DECODERS[..k].iter().any(|before| before.name == spec.name);
            assert!(!twice && spec.name != AUTO && !spec.about.is_empty(), "{}", spec.name);
        }
    }

    /// Width of the column of decoders in the printed tables of the board.
    const WIDTH: usize = 22;

    /// No two decoders share a label or a short label, the control included, and short labels fit into their columns.
    #[test]
    fn every_decoder_has_labels_of_its_own() {
        let names: Vec<&str> = DECODERS.iter().map(|spec| spec.name).chain([RASTER]).collect();
        for (k, name) in names.iter().enumerate() {
            let (long, short) = (label(name), short_label(name));
            assert!(!long.trim().is_empty() && !short.trim().is_empty(), "{name}");
            assert!(short.chars().count() <= long.chars().count().min(WIDTH), "{name}: {short}");
            for before in &names[..k] {
                assert_ne!(label(before), long, "{before} and {name}");
                assert_ne!(short_label(before), short, "{before} and {name}");
            }
        }
    }
}
