//! Why recordings cannot be calibrated from.

use super::profile_text::FittedError;
use spts::data::DataError;

/// Why recordings cannot be calibrated from.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// The recordings cannot be used.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A session that is not there.
    #[error("`--session` = {name}: no compressive session of it; there are: {known}")]
    NoSession {
        /// Name that was asked for.
        name: String,
        /// Sessions that are there.
        known: String,
    },
    /// Sessions that one profile cannot describe.
    #[error(
        "{session} compressive: `{field}` = {value}; {first} has {first_value}, and one profile has one: choose a \
         session with `--session`"
    )]
    Differ {
        /// What differs.
        field: &'static str,
        /// Session that differs from the first one.
        session: String,
        /// Its value.
        value: String,
        /// First session.
        first: String,
        /// Its value.
        first_value: String,
    },
    /// None of the presses that were asked for determines an image.
    #[error("{session} compressive: no press of {first}-{last} can be fitted; the session has presses 1-{presses}")]
    NoPress {
        /// Name of the session.
        session: String,
        /// First press that was asked for, 1-based.
        first: usize,
        /// Last one.
        last: usize,
        /// Number of presses of the session.
        presses: usize,
    },
    /// The gains of the skin cannot be found.
    #[error("gains of the skin: {0}")]
    Skin(String),
    /// The fitted numbers are not a profile.
    #[error("the fitted profile: {0}")]
    Fitted(#[from] FittedError),
}
