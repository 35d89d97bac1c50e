//! Why nothing could be learned.

use super::gains::SkinGainsError;
use super::network::NetworkError;
use super::shapes::ShapesError;
use spts_recon::RangeError;
use spts_recon::classify::LibraryError;
use spts_recon::dictionary::DictionaryError;
use spts_recon::recover::{ParameterError, PriorError, SequentialError};

/// Why nothing could be learned.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LearnError {
    /// A skin that is too large for decoders that keep matrices of its taxels.
    #[error("taxels = {taxels} is outside [1, {most}]: the decoders keep matrices of taxels × taxels")]
    TooLarge {
        /// Number of taxels.
        taxels: usize,
        /// Most that they take.
        most: usize,
    },
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
    /// The prior makes no sequential estimate.
    #[error("prior: {0}")]
    Sequential(#[from] SequentialError),
    /// No rows can be chosen for what was learned.
    #[error("rows: {0}")]
    Rows(#[from] spts_recon::rows::RowError),
    /// A range is not one.
    #[error("range: {0}")]
    Range(#[from] RangeError),
    /// The gains of the skin are not known.
    #[error("gains: {0}")]
    Gains(#[from] SkinGainsError),
    /// No shapes can be pressed on the skin.
    #[error("shapes: {0}")]
    Shapes(#[source] Box<ShapesError>),
    /// The network that was trained cannot be used.
    #[error("{0}")]
    Network(#[source] Box<NetworkError>),
    /// Gains make a sample infinite.
    #[error("gains: {0}")]
    Recording(#[from] spts_circuit::RecordingError),
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
