//! Progress of a long computation, reported without knowing of a terminal.

/// A listener to the progress of a computation.
///
/// A computation starts a stage, counts its items from any thread, and ends the stage. `()` ignores all reports.
pub trait Progress: Sync {
    /// Starts the stage `what` with `steps` items (`None` if their number is unknown). An earlier stage ends.
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
