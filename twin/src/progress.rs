//! Progress of a long computation, reported without knowing of a terminal.

/// A listener to the progress of a computation.
///
/// A computation starts a stage, counts its items from any thread, and ends the stage. `()` ignores all reports.
///
/// ```
/// use spts::progress::Progress;
/// use std::sync::atomic::{AtomicUsize, Ordering};
///
/// /// Counts all items.
/// #[derive(Default)]
/// struct Counter(AtomicUsize);
///
/// impl Progress for Counter {
///     fn stage(&self, _what: &'static str, _steps: Option<usize>) {}
///     fn step(&self) {
///         self.0.fetch_add(1, Ordering::Relaxed);
///     }
///     fn end(&self) {}
/// }
/// let progress = Counter::default();
/// progress.stage("presses", Some(2));
/// (0..2).for_each(|_| progress.step());
/// assert_eq!(progress.0.into_inner(), 2);
/// ```
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
