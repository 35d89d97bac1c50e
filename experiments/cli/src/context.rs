//! What several commands share: thread count, progress bars, printing.

use super::error::CliError;
use super::options::whole;
use super::terminal::{one_line, plain};
use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use spts::output::{Manifest, OutputError, OutputFolder};
use std::io::{IsTerminal as _, Write as _};
use std::path::Path;
use std::time::Duration;

/// Options of every command that computes.
#[derive(Debug, Clone, Args)]
pub struct Common {
    /// Number of threads; results do not depend on it [default: all cores]
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1..=1024))]
    threads: Option<u16>,
    /// Print the numbers as JSON on standard output
    #[arg(long)]
    pub json: bool,
}

impl Common {
    /// Sets up the thread pool.
    ///
    /// # Errors
    /// [`CliError`] when the threads cannot be started.
    pub fn start(&self) -> Result<(), CliError> {
        let threads = self.threads.map_or(0, usize::from);
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .map_err(|e| CliError::usage(format!("`--threads` = {threads}: {e}")))
    }

    /// Prints `value` as JSON if `--json` was given, else `text`.
    ///
    /// # Errors
    /// [`CliError`] when standard output cannot be written to, or `value` has no JSON.
    pub(super) fn print(&self, value: &impl Serialize, text: impl FnOnce() -> String) -> Result<(), CliError> {
        if self.json { print_json(value) } else { print(&text()) }
    }
}

/// Opens the folder `path` for the results of a run that may write `files`, and says so when the results of an earlier
/// run lie in it.
///
/// # Errors
/// As for [`OutputFolder::open`].
pub(super) fn open_folder(path: &Path, files: &[&str]) -> Result<OutputFolder, OutputError> {
    let folder = OutputFolder::open(path, files)?;
    note_earlier(path);
    Ok(folder)
}

/// Says so when the results of an earlier run lie in the folder `path`.
pub(super) fn note_earlier(path: &Path) {
    if let Some(earlier) = Manifest::read(path) {
        let (path, files) = (path.display(), earlier.names().count());
        note(&format!(
            "note: {path} has the results of an earlier run; this run replaces them ({files} files) when it ends"
        ));
    }
}

/// Standard error, or nowhere when that is not a terminal.
fn target() -> ProgressDrawTarget {
    if std::io::stderr().is_terminal() {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    }
}

/// Spinner for a stage of unknown length, on standard error; silent when that is not a terminal. Gone when dropped.
#[must_use]
pub(crate) fn spinner(what: &'static str) -> Spinner {
    let bar = ProgressBar::with_draw_target(None, target());
    if let Ok(style) = ProgressStyle::with_template("{msg:24} {spinner} {elapsed}") {
        bar.set_style(style);
    }
    bar.set_message(what);
    bar.enable_steady_tick(TICK);
    Spinner(bar)
}

/// Time between two frames of a spinner.
pub(super) const TICK: Duration = Duration::from_millis(100);

/// A running [`spinner`].
pub(crate) struct Spinner(ProgressBar);

impl Drop for Spinner {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// Progress bar over `length` items on standard error; silent when that is not a terminal.
#[must_use]
pub(crate) fn progress(length: usize, what: &'static str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length as u64), target());
    if let Ok(style) = ProgressStyle::with_template("{msg:24} {bar:40} {pos}/{len} {elapsed} (left {eta})") {
        bar.set_style(style);
    }
    bar.set_message(what);
    bar
}

/// Writes `text` and a line end to standard output. A reader that went away is not an error.
///
/// # Errors
/// [`CliError`] when standard output cannot be written to, as on a full disk.
pub(super) fn print(text: &str) -> Result<(), CliError> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{}", plain(text)).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(CliError::usage(format!("standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// Writes `value` as indented JSON to standard output.
///
/// # Errors
/// [`CliError`] when it has no JSON, as a map with keys that are no strings, and as [`print`].
pub(super) fn print_json(value: &impl Serialize) -> Result<(), CliError> {
    let json = serde_json::to_string_pretty(value).map_err(|e| CliError::usage(e.to_string()))?;
    print(&json)
}

/// Writes `text` and a line end to standard error.
pub fn note(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{}", plain(text));
}

/// Writes an error to standard error, on one line.
pub fn note_error(text: &str) {
    note(&format!("error: {}", one_line(text)));
}
