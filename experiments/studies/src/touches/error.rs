//! Errors of touches.

/// Why touches cannot be drawn or measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TouchError {
    /// The objects are not a valid data set.
    #[error(transparent)]
    Spec(#[from] spts_dataset::SpecError),
    /// A touch cannot be pressed.
    #[error(transparent)]
    Row(#[from] spts_dataset::RowError),
    /// The readout cannot be built.
    #[error(transparent)]
    Profile(#[from] spts_circuit::ProfileError),
    /// A touch cannot be measured.
    #[error(transparent)]
    Acquire(#[from] spts_circuit::AcquireError),
    /// The conductance of the taxels is not valid.
    #[error(transparent)]
    Source(#[from] spts_circuit::SourceError),
}
