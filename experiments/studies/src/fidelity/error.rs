//! Errors of the fidelity study.

use spts::chain::ChainError;
use spts::output::OutputError;
use spts::record::TwinError;
use spts_eval::ScoreError;
use spts_eval::training::LearnError;
use spts_recon::classify::LibraryError;
use spts_recon::dictionary::DictionaryError;

/// Why a fidelity study cannot be done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FidelityError {
    /// The scene does not exist.
    #[error("`--scene {name}` is not one of {known}, or a file that ends in .toml")]
    UnknownScene {
        /// Requested name.
        name: String,
        /// All known names.
        known: String,
    },
    /// A scene is named twice.
    #[error("`--scene {name}`: named twice")]
    RepeatedScene {
        /// Name or file of the scene.
        name: String,
    },
    /// Scenes of different skins, which need different decoders.
    #[error("`--scene`: `{first}` and `{other}` have different skins; study them one at a time")]
    DifferentSkins {
        /// First scene.
        first: String,
        /// First scene with another skin.
        other: String,
    },
    /// A scene cannot be run.
    #[error(transparent)]
    Twin(#[from] TwinError),
    /// A recording cannot be made.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// The mesh of a scene cannot be written.
    #[error(transparent)]
    Mesh(#[from] OutputError),
    /// No dictionary can be learned from the reference's images.
    #[error("no training data for the dictionary: {0}")]
    Dictionary(#[from] DictionaryError),
    /// No library can be made from the reference's images.
    #[error("no training data for the library: {0}")]
    Library(#[from] LibraryError),
    /// The decoder cannot use the training data.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// A recording cannot be scored.
    #[error(transparent)]
    Score(#[from] ScoreError),
}
