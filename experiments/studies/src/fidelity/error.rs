//! Why the contact models cannot be compared.

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
    /// A scene that does not exist.
    #[error("`--scene {name}` is not one of {known}, or a file that ends in .toml")]
    UnknownScene {
        /// Name that was asked for.
        name: String,
        /// All known names.
        known: String,
    },
    /// A scene that is asked for twice.
    #[error("`--scene {name}`: named twice")]
    RepeatedScene {
        /// Its name or file.
        name: String,
    },
    /// Scenes that no decoder can have in common.
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
    /// The references' images make no dictionary.
    #[error("nothing to learn from: {0}")]
    Dictionary(#[from] DictionaryError),
    /// The references' images make no library.
    #[error("nothing to learn from: {0}")]
    Library(#[from] LibraryError),
    /// The decoder cannot use what was learned.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// A recording cannot be scored.
    #[error(transparent)]
    Score(#[from] ScoreError),
}
