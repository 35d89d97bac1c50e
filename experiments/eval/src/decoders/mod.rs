//! The table of algorithms. A new one has a file here and a line in [`DECODERS`].

mod amortised;
mod bank;
mod correlate;
mod evidence;
mod image;
mod labels;
mod mixture;
mod published;
mod sure;
mod trained;
mod trivial;

pub use labels::{label, short_label};
pub use published::{PublishedDecode, quarter};
pub use trained::TrainedDecoder;

use crate::algorithm::Trained;
use crate::training::{LearnError, TrainingData};
use Needs::{Classes, Dictionary, Images, Network, Nothing, Shapes};

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
    #[must_use]
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
    /// Trains the algorithm.
    pub train: Train,
}

type Train = fn(&TrainingData) -> Result<Box<dyn Trained>, LearnError>;

const fn spec(name: &'static str, label: &'static str, needs: Needs, shown: bool, train: Train) -> DecoderSpec {
    DecoderSpec {
        name,
        label,
        short: label,
        about: "",
        needs,
        shown,
        anytime: false,
        train,
    }
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

    /// The line of an algorithm that says after every sample how sure it is.
    const fn anytime(mut self) -> Self {
        self.anytime = true;
        self
    }
}

// The decodes of the published evaluation, which [`PublishedDecode`] names.
const SCRIPT_S20: DecoderSpec = spec("script_s20", "published script", Dictionary, true, image::script_s20)
    .short("script, 20 atoms")
    .about("the published script: weights {0, 1}, no offset, 20 atoms");
const SCRIPT_M4: DecoderSpec = spec(
    "script_m4",
    "published script, M/4 atoms",
    Dictionary,
    false,
    image::script_m4,
)
.short("script, M/4 atoms")
.about("the published text: weights {0, 1}, no offset, M/4 atoms");
const MATCHED: DecoderSpec = spec(
    "matched",
    "published pursuit, matched to ±1",
    Dictionary,
    true,
    image::matched,
)
.short("matched")
.about("the published pursuit with weights ±1 and the idle output removed");

/// Every algorithm: name, label, training data, whether it is shown by default, training function, shorter label,
/// description.
pub const DECODERS: &[DecoderSpec] = &[
    spec("empty", "empty image", Nothing, true, trivial::empty).about("baseline: an empty image"),
    spec("mean_image", "mean image", Images, true, trivial::mean_image)
        .about("baseline: the mean of all images learned from"),
    spec("correlate", "best correlated", Classes, true, correlate::train)
        .about("baseline: the object's mean image that correlates best with y"),
    SCRIPT_S20,
    SCRIPT_M4,
    MATCHED,
    spec("omp", "OMP", Dictionary, true, image::omp).about("orthogonal matching pursuit, columns normalised"),
    spec("nn_omp", "non-negative OMP", Dictionary, true, image::nn_omp)
        .about("non-negative orthogonal matching pursuit"),
    spec("nn_lasso", "non-negative lasso", Dictionary, true, image::nn_lasso)
        .about("non-negative lasso on normalised columns"),
    spec("lmmse", "LMMSE", Images, false, image::lmmse)
        .about("linear minimum mean square error, prior of images like those seen"),
    spec("nn_lmmse", "non-negative LMMSE", Images, true, image::nn_lmmse)
        .about("linear minimum mean square error with non-negative taxels, prior for unseen objects")
        .anytime(),
    spec(
        "nn_lmmse_seen",
        "non-negative LMMSE, objects seen",
        Images,
        false,
        image::nn_lmmse_seen,
    )
    .short("NN LMMSE, objects seen")
    .about("as nn_lmmse, prior for the objects that were seen"),
    spec("mixture", "mixture of shapes", Shapes, false, mixture::train)
        .about("thirty clusters of simulated shapes weighed by the evidence of y, non-negative taxels"),
    spec("amortised", "trained network", Network, false, amortised::train)
        .short("amortised")
        .about("network trained on simulated shapes: image and the probability that a taxel is touched")
        .anytime(),
    spec("tv", "total variation", Nothing, false, image::tv).about("total variation with non-negative taxels"),
    spec("evidence", "evidence", Classes, true, evidence::train)
        .about("Gaussian classes weighed by the evidence of y; the image is the posterior mean")
        .anytime(),
];

/// The decoder called `name` in [`DECODERS`]; `None` if there is none.
#[must_use]
pub fn find(name: &str) -> Option<&'static DecoderSpec> {
    DECODERS.iter().find(|spec| spec.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_described() {
        for (k, spec) in DECODERS.iter().enumerate() {
            let twice = DECODERS[..k].iter().any(|before| before.name == spec.name);
            assert!(!twice && !spec.about.is_empty(), "{}", spec.name);
        }
    }
}
