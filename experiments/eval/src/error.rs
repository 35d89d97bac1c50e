//! Why there are no scores.

use crate::algorithm::{DecodeError, ExternalError};
use crate::decoders::DECODERS;
use crate::training::LearnError;
use spts_recon::RangeError;
use spts_recon::recover::ParameterError;

/// Why there are no scores.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ScoreError {
    /// Nothing to score.
    #[error("scoring needs an object with both a raster and a compressive recording; found: {found}")]
    NoSession {
        /// The sessions and what they have.
        found: String,
    },
    /// Every decoder that was asked for needs classes, and there is nothing to learn them from.
    #[error(
        "`--decoder` = {decoders}: learns classes from raster presses that are not scored, and the sessions have none; record \
         more raster presses, or use `--learn-from simulation`"
    )]
    NoClasses {
        /// The decoders.
        decoders: String,
    },
    /// A decoder that does not say how sure it is was asked when to stop.
    #[error("`--decoder` = {decoder}: does not say how sure it is; valid: {valid}")]
    NoConfidence {
        /// The decoder.
        decoder: String,
        /// Those that do.
        valid: String,
    },
    /// A decoder without a Gaussian prior was asked to follow a contact in time.
    #[error("`--decoder` = {decoder}: has no Gaussian prior to follow a contact with; valid: nn_lmmse")]
    NotInTime {
        /// The decoder.
        decoder: String,
    },
    /// A wanted confidence is outside its range.
    #[error(transparent)]
    Confidence(#[from] ParameterError),
    /// An object that has no compressive session.
    #[error("object {name:?} has no compressive session; valid: {valid}")]
    Object {
        /// The name.
        name: String,
        /// Those that have one.
        valid: String,
    },
    /// What was to be learned from is of another skin.
    #[error("{name}: the raster session of {object} has {taxels} taxels; the scored skin has {needed}")]
    Taxels {
        /// The source.
        name: String,
        /// An object of it.
        object: String,
        /// Its taxels.
        taxels: usize,
        /// Taxels of the scored skin.
        needed: usize,
    },
    /// Nothing could be learned.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// No rows can be chosen.
    #[error("rows: {0}")]
    Rows(#[from] spts_recon::rows::RowError),
    /// An external program cannot be started.
    #[error(transparent)]
    External(#[from] ExternalError),
    /// An algorithm failed.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// The sheet is no grid.
    #[error(transparent)]
    Place(#[from] RangeError),
}

impl ScoreError {
    /// The error of a `decoder` that cannot follow a contact in time.
    #[must_use]
    pub fn not_in_time(decoder: &str) -> Self {
        let decoder = decoder.to_owned();
        Self::NotInTime { decoder }
    }

    /// The error of a `decoder` that does not say how sure it is.
    #[must_use]
    pub fn no_confidence(decoder: &str) -> Self {
        let valid = DECODERS.iter().filter(|spec| spec.anytime).map(|spec| spec.name);
        Self::NoConfidence {
            decoder: decoder.to_owned(),
            valid: valid.collect::<Vec<_>>().join(", "),
        }
    }
}
