//! Why the report cannot be made.

use crate::ReportError;
use crate::animation::MotionError;
use spts::data::DataError;
use spts::output::OutputError;
use spts_eval::ScoreError;
use spts_eval::training::LearnError;
use spts_input::Refusal;

/// Why the report cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReproduceError {
    /// The recordings of the real skin cannot be used.
    #[error(transparent)]
    Data(#[from] DataError),
    /// The animations cannot be made.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// Nothing is learned from the twin's raster images.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// A skin cannot be scored.
    #[error(transparent)]
    Score(#[from] ScoreError),
    /// The twin cannot be run, or not be compared with the skin.
    #[error(transparent)]
    Compare(#[from] Refusal),
    /// The report's folder or one of its tables cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The report cannot be written.
    #[error(transparent)]
    Report(#[from] ReportError),
}
