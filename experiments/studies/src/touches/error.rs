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
    /// The readout cannot be built, or cannot measure the conductance of the taxels.
    #[error(transparent)]
    Refused(#[from] spts_input::Refusal),
}
