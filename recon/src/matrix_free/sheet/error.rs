//! Errors of the decoder of sheets.

use crate::checks::RangeError;
use crate::problem::RecoverError;
use crate::recover::{ParameterError, PriorError};

/// Why no image can be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SheetError {
    /// A noise level outside its range.
    #[error(transparent)]
    Noise(#[from] RangeError),
    /// Rows or measurements of the wrong size.
    #[error(transparent)]
    Recover(#[from] RecoverError),
    /// The selected taxels have no valid prior.
    #[error(transparent)]
    Prior(#[from] PriorError),
    /// A noise level that the non-negative estimate does not accept.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
}
