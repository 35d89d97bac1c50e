//! Why no skin is designed.

use crate::electronics::ElectronicsError;
use crate::touches::TouchError;

/// Why there is no [`DesignReport`](super::DesignReport), or why a design cannot be checked.
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
        /// What it may be.
        range: &'static str,
    },
    /// Area and resolution make a skin that is too small or too large.
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
        /// Wires asked for.
        wires: usize,
        /// Rows of taxels.
        rows: usize,
    },
    /// Objects that nobody knows.
    #[error(
        "`objects` = {name:?}: {reason}; valid: small, large, the name of a data set's spec (presses-17, random-shapes, …), a spec file that ends in .toml, or the folder of a data set"
    )]
    Objects {
        /// What was asked for.
        name: String,
        /// Why it cannot be had.
        reason: String,
    },
    /// The latency does not hold the measurements of any image.
    #[error(
        "`latency` = {latency_s:.6} s is outside [{least_s:.6}, ∞): {least} measurements take that long at {rate_hz:.0} Hz"
    )]
    Latency {
        /// Latency asked for, s.
        latency_s: f64,
        /// Least latency, s.
        least_s: f64,
        /// Measurements of the smallest window.
        least: usize,
        /// Rate, Hz.
        rate_hz: f64,
    },
    /// The design in a folder is none.
    #[error("{what}: {reason}")]
    NoDesign {
        /// File.
        what: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The electronics of as_designed cannot be used.
    #[error(transparent)]
    Electronics(#[from] ElectronicsError),
    /// Touches that cannot be drawn or measured.
    #[error(transparent)]
    Touch(#[from] TouchError),
    /// A value that the skin, the amplifier or the readout does not take.
    #[error(transparent)]
    Config(#[from] spts_models::ConfigError),
    /// A readout that cannot be built.
    #[error(transparent)]
    Profile(#[from] spts_circuit::ProfileError),
    /// A profile without a stage that the design changes.
    #[error("profile {profile}: no `{name}`")]
    NoStage {
        /// Profile.
        profile: &'static str,
        /// What it lacks.
        name: &'static str,
    },
    /// A profile that has no text.
    #[error("profile: {0}")]
    ProfileText(#[from] toml::ser::Error),
    /// Rows that are no weights.
    #[error(transparent)]
    Weights(#[from] spts_circuit::WeightsError),
    /// Rows that cannot be designed.
    #[error(transparent)]
    Rows(#[from] spts_recon::rows::RowError),
    /// Images that make no prior.
    #[error(transparent)]
    Prior(#[from] spts_recon::recover::PriorError),
    /// Measurements that cannot be decoded.
    #[error(transparent)]
    Decode(#[from] spts_recon::matrix_free::SheetError),
    /// Templates that make no classes.
    #[error(transparent)]
    Library(#[from] spts_recon::classify::LibraryError),
    /// Classes that cannot be told apart.
    #[error(transparent)]
    Classes(#[from] spts_recon::classify::EvidenceError),
    /// Amplitudes of classes that are out of range.
    #[error(transparent)]
    Amplitudes(#[from] spts_recon::RangeError),
    /// More taxels on a wire than there are seeds.
    #[error("taxels of a wire: {0}")]
    Cells(#[from] std::num::TryFromIntError),
}
