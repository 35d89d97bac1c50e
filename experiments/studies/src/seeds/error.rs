//! Errors of the seeds study.

use spts::data::DataError;
use spts_eval::ScoreError;
use spts_eval::training::LearnError;
use spts_recon::coherence::CoherenceError;
use spts_recon::dictionary::DictionaryError;
use std::path::PathBuf;

/// Why a set of seeds cannot be read or analysed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SeedError {
    /// A word that is not a seed.
    #[error("{source_name}, line {line}: seed = `{word}` is not one of the whole numbers in [0, 4294967295]")]
    NoSeed {
        /// File or option.
        source_name: String,
        /// Line, from 1.
        line: usize,
        /// The word.
        word: String,
    },
    /// The number of seeds is not that of a square skin.
    #[error("{source_name}: number of seeds = {seeds} is not one of the square numbers in [{least}, {most}]")]
    NotSquare {
        /// File or option.
        source_name: String,
        /// Number of seeds.
        seeds: usize,
        /// Smallest valid number.
        least: usize,
        /// Largest valid number.
        most: usize,
    },
    /// A file of seeds cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// File.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// The recordings cannot be used.
    #[error(transparent)]
    Recordings(#[from] DataError),
    /// The recordings are of a skin of another size.
    #[error("`--recordings` = {}: {taxels} taxels, but there are {seeds} seeds", path.display())]
    OtherSize {
        /// Folder of the recordings.
        path: PathBuf,
        /// Taxels of the recorded skin.
        taxels: usize,
        /// Number of seeds.
        seeds: usize,
    },
    /// The sensing matrix cannot be analysed.
    #[error("sensing matrix: {0}")]
    Matrix(#[from] CoherenceError),
    /// No dictionary can be learned from the synthetic images.
    #[error("dictionary: {0}")]
    Dictionary(#[from] DictionaryError),
    /// A decoder cannot use the dictionary.
    #[error(transparent)]
    Decoder(#[from] LearnError),
    /// The windows cannot be decoded.
    #[error(transparent)]
    Score(#[from] ScoreError),
}
