//! The table of algorithms. A new one is a file here and a line in [`DECODERS`].

mod correlate;
mod evidence;
mod image;
mod published;
mod trained;
mod trivial;

pub use published::{PublishedDecode, quarter};
pub use trained::TrainedDecoder;

use crate::algorithm::Trained;
use crate::training::{LearnError, TrainingData};

/// What an algorithm learns from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Needs {
    /// Nothing.
    Nothing,
    /// A dictionary: the published one, unless another source is asked for or an object is left out.
    Dictionary,
    /// Raster images.
    Images,
    /// Raster images of named objects.
    Classes,
}

/// One line of the table of algorithms.
#[derive(Clone, Copy)]
pub struct DecoderSpec {
    /// Name on the board.
    pub name: &'static str,
    /// What it is.
    pub about: &'static str,
    /// What it learns from.
    pub needs: Needs,
    /// Whether the board shows it when none is named.
    pub shown: bool,
    /// Learns.
    pub train: Train,
}

type Train = fn(&TrainingData) -> Result<Box<dyn Trained>, LearnError>;

const fn spec(name: &'static str, about: &'static str, needs: Needs, shown: bool, train: Train) -> DecoderSpec {
    DecoderSpec {
        name,
        about,
        needs,
        shown,
        train,
    }
}

/// Every algorithm: name, what it is, what it learns from, whether it is shown when none is named.
pub const DECODERS: &[DecoderSpec] = &[
    spec(
        "empty",
        "baseline: an empty image",
        Needs::Nothing,
        true,
        trivial::empty,
    ),
    spec(
        "mean_image",
        "baseline: the mean of all images learned from",
        Needs::Images,
        true,
        trivial::mean_image,
    ),
    spec(
        "correlate",
        "baseline: the object's mean image that correlates best with y",
        Needs::Classes,
        true,
        correlate::train,
    ),
    spec(
        "script_s20",
        "the published script: weights {0, 1}, no offset, 20 atoms",
        Needs::Dictionary,
        true,
        image::script_s20,
    ),
    spec(
        "script_m4",
        "the published text: weights {0, 1}, no offset, M/4 atoms",
        Needs::Dictionary,
        false,
        image::script_m4,
    ),
    spec(
        "matched",
        "the published pursuit with weights ±1 and the idle output removed",
        Needs::Dictionary,
        true,
        image::matched,
    ),
    spec(
        "omp",
        "orthogonal matching pursuit, columns normalised",
        Needs::Dictionary,
        true,
        image::omp,
    ),
    spec("ols", "orthogonal least squares", Needs::Dictionary, false, image::ols),
    spec(
        "nn_omp",
        "non-negative orthogonal matching pursuit",
        Needs::Dictionary,
        true,
        image::nn_omp,
    ),
    spec(
        "cosamp",
        "compressive sampling matching pursuit",
        Needs::Dictionary,
        false,
        image::cosamp,
    ),
    spec(
        "iht",
        "normalised iterative hard thresholding",
        Needs::Dictionary,
        false,
        image::iht,
    ),
    spec(
        "nn_lasso",
        "non-negative lasso on normalised columns",
        Needs::Dictionary,
        true,
        image::nn_lasso,
    ),
    spec("sbl", "sparse Bayesian learning", Needs::Dictionary, false, image::sbl),
    spec(
        "lmmse",
        "linear minimum mean square error, prior of images like those seen",
        Needs::Images,
        false,
        image::lmmse,
    ),
    spec(
        "nn_lmmse",
        "the same with non-negative taxels, prior for unseen objects",
        Needs::Images,
        true,
        image::nn_lmmse,
    ),
    spec(
        "nn_lmmse_seen",
        "the same, prior for the objects that were seen",
        Needs::Images,
        false,
        image::nn_lmmse_seen,
    ),
    spec(
        "tv",
        "total variation with non-negative taxels",
        Needs::Nothing,
        false,
        image::tv,
    ),
    spec(
        "evidence",
        "Gaussian classes weighed by the evidence of y; image: the posterior mean",
        Needs::Classes,
        true,
        evidence::train,
    ),
];

/// The algorithm called `name`.
#[must_use]
pub fn find(name: &str) -> Option<&'static DecoderSpec> {
    DECODERS.iter().find(|spec| spec.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_decodes_are_lines_of_the_table() {
        for decode in PublishedDecode::ALL {
            assert!(find(decode.name()).is_some(), "{}", decode.name());
        }
    }
}
