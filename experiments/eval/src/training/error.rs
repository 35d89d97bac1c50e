//! Errors of training.

use super::gains::SkinGainsError;
use super::network::NetworkError;
use super::shapes::ShapesError;
use spts_recon::RangeError;
use spts_recon::classify::LibraryError;
use spts_recon::dictionary::DictionaryError;
use spts_recon::recover::{ParameterError, PriorError, SequentialError};

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
    /// No raster image is strong enough for a dictionary.
    #[error("dictionary: {0}")]
    Dictionary(#[from] DictionaryError),
    /// There is no raster image for the library.
    #[error("library: {0}")]
    Library(#[from] LibraryError),
    /// There is no raster image for the prior.
    #[error("prior: {0}")]
    Prior(#[from] PriorError),
    /// A parameter of a decoder is out of its range.
    #[error("parameter: {0}")]
    Parameter(#[from] ParameterError),
    /// No classifier can be made from the templates.
    #[error("templates: {0}")]
    Evidence(#[from] spts_recon::classify::EvidenceError),
    /// No sequential estimate can be made from the prior.
    #[error("prior: {0}")]
    Sequential(#[from] SequentialError),
    /// No rows can be selected for the training data.
    #[error("rows: {0}")]
    Rows(#[from] spts_recon::rows::RowError),
    /// A range is not valid.
    #[error("range: {0}")]
    Range(#[from] RangeError),
    /// The gains of the skin are not known.
    #[error("gains: {0}")]
    Gains(#[from] SkinGainsError),
    /// No shapes can be pressed on the skin.
    #[error("shapes: {0}")]
    Shapes(#[source] Box<ShapesError>),
    /// The network cannot be used.
    #[error("{0}")]
    Network(#[source] Box<NetworkError>),
    /// A gain makes a sample infinite.
    #[error("gains: {0}")]
    Recording(#[from] spts_input::Refusal),
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
