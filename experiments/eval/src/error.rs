//! Errors of scoring.

use crate::algorithm::{DecodeError, ExternalError};
use crate::decoders::DECODERS;
use crate::training::LearnError;
use spts_input::Refusal;

/// Why there are no scores.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ScoreError {
    /// There is nothing to score.
    #[error("scoring needs an object with both a raster and a compressive recording; found: {found}")]
    NoSession {
        /// The sessions and their recordings.
        found: String,
    },
    /// All requested decoders need classes, and there is no training data with classes.
    #[error(
        "`--decoder` = {decoders}: learns classes from raster presses that are not scored, but the sessions have none; record \
         more raster presses, or use `--learn-from simulation`"
    )]
    NoClasses {
        /// The decoders.
        decoders: String,
    },
    /// A decoder that states no confidence cannot be stopped by it.
    #[error("`--decoder` = {decoder}: states no confidence; valid: {valid}")]
    NoConfidence {
        /// The decoder.
        decoder: String,
        /// Decoders that state one.
        valid: String,
    },
    /// A decoder without a Gaussian prior cannot track a contact in time.
    #[error("`--decoder` = {decoder}: has no Gaussian prior to track a contact with; valid: nn_lmmse")]
    NotInTime {
        /// The decoder.
        decoder: String,
    },
    /// An object without a compressive session.
    #[error("object {name:?} has no compressive session; valid: {valid}")]
    Object {
        /// The name.
        name: String,
        /// Objects that have one.
        valid: String,
    },
    /// Training data of another skin.
    #[error("{name}: the raster session of {object} has {taxels} taxels; the scored skin has {needed}")]
    Taxels {
        /// Name of the source of training data.
        name: String,
        /// One of its objects.
        object: String,
        /// Number of its taxels.
        taxels: usize,
        /// Taxels of the scored skin.
        needed: usize,
    },
    /// The training data are not usable.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// No rows can be chosen.
    #[error("rows: {0}")]
    Rows(#[source] Refusal),
    /// An external program cannot be started.
    #[error(transparent)]
    External(#[from] ExternalError),
    /// An algorithm failed.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// A wanted confidence outside its range, or no valid grid for the localisation.
    #[error(transparent)]
    Refused(#[from] Refusal),
}

impl ScoreError {
    /// The error for a `decoder` that cannot track a contact in time.
    #[must_use]
    pub fn not_in_time(decoder: &str) -> Self {
        let decoder = decoder.to_owned();
        Self::NotInTime { decoder }
    }

    /// The error for a `decoder` that states no confidence.
    #[must_use]
    pub fn no_confidence(decoder: &str) -> Self {
        let valid = DECODERS.iter().filter(|spec| spec.anytime).map(|spec| spec.name);
        Self::NoConfidence {
            decoder: decoder.to_owned(),
            valid: valid.collect::<Vec<_>>().join(", "),
        }
    }
}
