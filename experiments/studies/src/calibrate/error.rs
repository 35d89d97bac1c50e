//! Errors of calibration.

use super::profile_text::FittedError;
use spts::data::DataError;

/// Why recordings cannot be used for calibration.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// The recordings cannot be used.
    #[error(transparent)]
    Data(#[from] DataError),
    /// The requested session does not exist.
    #[error("`--session` = {name}: no compressive session of it; there are: {known}")]
    NoSession {
        /// Requested name.
        name: String,
        /// Existing sessions.
        known: String,
    },
    /// The sessions differ in a value that a profile has only once.
    #[error(
        "{session} compressive: `{field}` = {value}; {first} has {first_value}, and one profile has one: choose a \
         session with `--session`"
    )]
    Differ {
        /// Name of the value.
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
    /// None of the requested presses determines an image.
    #[error("{session} compressive: no press of {first}-{last} can be fitted; the session has presses 1-{presses}")]
    NoPress {
        /// Name of the session.
        session: String,
        /// First requested press, from 1.
        first: usize,
        /// Last requested press.
        last: usize,
        /// Number of presses of the session.
        presses: usize,
    },
    /// The gains of the skin cannot be estimated.
    #[error("gains of the skin: {0}")]
    Skin(String),
    /// The fitted values are not a valid profile.
    #[error("the fitted profile: {0}")]
    Fitted(#[from] FittedError),
}
