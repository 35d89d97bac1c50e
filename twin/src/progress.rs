//! Progress of a long computation, reported without knowing of a terminal.

/// A listener to the progress of a computation.
///
/// A computation starts a stage, counts its items from any thread, and ends the stage. `()` ignores all reports.
pub trait Progress: Sync {
    /// Begins the stage `what` of `steps` items; `None` where their number is not known beforehand. Ends the one
    /// before.
    fn stage(&self, what: &'static str, steps: Option<usize>);

    /// Counts one item of the stage.
    fn step(&self);

    /// Ends the stage.
    fn end(&self);
}

impl Progress for () {
    fn stage(&self, _: &'static str, _: Option<usize>) {}

    fn step(&self) {}

    fn end(&self) {}
}
