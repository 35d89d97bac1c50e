//! Errors of training.

use super::gains::SkinGainsError;
use super::network::NetworkError;
use super::shapes::ShapesError;
use spts_input::Refusal;

/// Why a decoder cannot be trained.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LearnError {
    /// The skin is too large for decoders that keep matrices of its taxels.
    #[error("taxels = {taxels} is outside [1, {most}]: the decoders keep matrices of taxels × taxels")]
    TooLarge {
        /// Number of taxels.
        taxels: usize,
        /// Largest number of taxels.
        most: usize,
    },
    /// What a decoder learns from, or one of its parameters, is refused.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// The gains of the skin are not known.
    #[error("gains: {0}")]
    Gains(#[from] SkinGainsError),
    /// No shapes can be pressed on the skin.
    #[error("shapes: {0}")]
    Shapes(#[source] Box<ShapesError>),
    /// The network cannot be used.
    #[error("{0}")]
    Network(#[source] Box<NetworkError>),
}

impl From<ShapesError> for LearnError {
    fn from(error: ShapesError) -> Self {
        Self::Shapes(Box::new(error))
    }
}

impl From<NetworkError> for LearnError {
    fn from(error: NetworkError) -> Self {
        Self::Network(Box::new(error))
    }
}

macro_rules! places {
    ($($name:ident, $place:literal;)*) => {$(
        #[doc = concat!("The refusal, said of \"", $place, "\".")]
        pub(crate) fn $name(refusal: Refusal) -> LearnError {
            refusal.at($place).into()
        }
    )*};
}

places! {
    in_dictionary, "dictionary";
    in_library, "library";
    in_prior, "prior";
    in_parameter, "parameter";
    in_templates, "templates";
    in_rows, "rows";
    in_range, "range";
    in_gains, "gains";
}
