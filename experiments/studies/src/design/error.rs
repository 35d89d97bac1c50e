//! Errors of the design study.

use crate::touches::TouchError;
use spts_input::Refusal;

/// Why there is no [`DesignReport`](super::DesignReport), or a design cannot be checked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DesignError {
    /// An input outside its range.
    #[error("`{field}` = {value} is outside {range}")]
    Range {
        /// Option.
        field: &'static str,
        /// Its value.
        value: f64,
        /// Valid range.
        range: &'static str,
    },
    /// Area and resolution give a skin that is too small or too large.
    #[error("`area` / `resolution`: {rows:.0} × {cols:.0} taxels are outside [2, 256] a side")]
    Taxels {
        /// Rows of taxels.
        rows: f64,
        /// Columns of taxels.
        cols: f64,
    },
    /// More wires than rows of taxels.
    #[error("`wires` = {wires} is outside [1, {rows}]: every wire reads whole rows of the skin")]
    Wires {
        /// Requested number of wires.
        wires: usize,
        /// Rows of taxels.
        rows: usize,
    },
    /// Objects that are not known.
    #[error(
        "`objects` = {name:?}: {reason}; valid: small, large, the name of a data set's spec (presses-17, random-shapes, …), a spec file that ends in .toml, or the folder of a data set"
    )]
    Objects {
        /// Requested name.
        name: String,
        /// Cause.
        reason: String,
    },
    /// The latency is too short for the measurements of any image.
    #[error(
        "`latency` = {latency_s:.6} s is outside [{least_s:.6}, ∞): {least} measurements take that long at {rate_hz:.0} Hz"
    )]
    Latency {
        /// Requested latency, s.
        latency_s: f64,
        /// Smallest possible latency, s.
        least_s: f64,
        /// Number of measurements of the smallest window.
        least: usize,
        /// Rate, Hz.
        rate_hz: f64,
    },
    /// The design in a folder is not valid.
    #[error("{what}: {reason}")]
    NoDesign {
        /// File.
        what: String,
        /// Cause.
        reason: String,
    },
    /// The electronics of as_designed cannot be used.
    #[error(transparent)]
    Electronics(#[from] Refusal),
    /// Touches that cannot be drawn or measured.
    #[error(transparent)]
    Touch(#[from] TouchError),
    /// A value outside the range of the skin, the amplifier, the readout or the weights.
    #[error(transparent)]
    Config(#[from] spts_models::ConfigError),
    /// A profile lacks a stage that the design changes.
    #[error("profile {profile}: no `{name}`")]
    NoStage {
        /// Profile.
        profile: &'static str,
        /// Name of the missing stage.
        name: &'static str,
    },
    /// A profile cannot be written as text.
    #[error("profile: {0}")]
    ProfileText(#[from] toml::ser::Error),
    /// Rows that cannot be designed.
    #[error(transparent)]
    Rows(#[from] spts_recon::rows::RowError),
    /// Images from which no prior can be made.
    #[error(transparent)]
    Prior(#[from] spts_recon::recover::PriorError),
    /// Measurements that cannot be decoded.
    #[error(transparent)]
    Decode(#[from] spts_recon::matrix_free::SheetError),
    /// Templates from which no classes can be made.
    #[error(transparent)]
    Library(#[from] spts_recon::classify::LibraryError),
    /// Classes that cannot be distinguished.
    #[error(transparent)]
    Classes(#[from] spts_recon::classify::EvidenceError),
    /// Amplitudes of classes that are out of range.
    #[error(transparent)]
    Amplitudes(#[from] spts_recon::RangeError),
    /// More taxels on a wire than there are seeds.
    #[error("taxels of a wire: {0}")]
    Cells(#[from] std::num::TryFromIntError),
}
