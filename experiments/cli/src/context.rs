//! What several commands share: thread count, progress bars, printing.

use crate::error::{CliError, one_line};
use crate::options::whole;
use clap::Args;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use serde::Serialize;
use spts::output::{Manifest, OutputFolder};
use spts::progress::Progress;
use spts_input::Refusal;
use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::{IsTerminal as _, Write as _};
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Options of every command that computes.
#[derive(Debug, Clone, Args)]
pub struct Common {
    /// Number of threads, at most four a core of this machine; results do not depend on it [default: all cores]
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1..=1024))]
    threads: Option<u16>,
    /// Print the numbers as JSON on standard output
    #[arg(long)]
    pub json: bool,
}

/// Most threads a core.
const THREADS_A_CORE: usize = 4;

impl Common {
    /// Sets up the thread pool where a number of threads is asked for. Otherwise the first work that needs threads
    /// starts them: a program that runs several commands in one process has only one pool.
    ///
    /// # Errors
    /// [`CliError`] when the threads cannot be started.
    pub fn start(&self) -> Result<(), CliError> {
        let Some(threads) = self.threads.map(usize::from) else {
            return Ok(());
        };
        // each takes memory, and more of them no less time
        let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        let most = THREADS_A_CORE * cores;
        if threads > most {
            note(&format!("note: `--threads` = {threads}: {most} are used, as this machine has {cores} cores"));
        }
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads.min(most))
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

/// Opens the folder `path` for the results of a run, and says so when the results of an earlier run lie in it.
///
/// # Errors
/// As for [`OutputFolder::open`].
pub(super) fn open_folder(path: &Path) -> Result<OutputFolder, Refusal> {
    let folder = OutputFolder::open(path)?;
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

/// A run that writes more than this says so before it starts, bytes.
const LARGE: u64 = 1_000_000_000;

/// Refuses to write `bytes` in the folder `out` where the disk has no room for them, and says how many there will be
/// where they are many. `what` names the run.
pub(super) fn check_room(out: &Path, what: &str, bytes: u64) -> Result<(), Refusal> {
    let there = out.ancestors().find(|above| above.is_dir()).unwrap_or(Path::new("."));
    let mb = |bytes: u64| bytes as f64 / 1e6;
    // a file system that does not say is tried
    if let Ok(found) = rustix::fs::statvfs(there) {
        let free = found.f_bavail.saturating_mul(found.f_frsize);
        if bytes > free {
            let problem = format!("{what} needs {:.0} MB; {:.0} MB are free", mb(bytes), mb(free));
            return Err(Refusal::new(problem).at(out.display()));
        }
    }
    if bytes > LARGE {
        note(&format!("note: {what} takes about {:.1} GB in {}", mb(bytes) / 1e3, out.display()));
    }
    Ok(())
}

/// Standard error, or nowhere when that is not a terminal.
fn target() -> ProgressDrawTarget {
    if std::io::stderr().is_terminal() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() }
}

/// Spinner for a stage of unknown length, on standard error; silent when that is not a terminal. Gone when dropped.
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
pub(crate) fn progress(length: usize, what: &'static str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length as u64), target());
    if let Ok(style) = ProgressStyle::with_template("{msg:24} {bar:40} {pos}/{len} {elapsed} (left {left})") {
        // before the first item there is nothing to go by
        let left = |state: &ProgressState, out: &mut dyn std::fmt::Write| {
            let _ = match state.pos() {
                0 => out.write_str("?"),
                _ => write!(out, "{:#}", HumanDuration(state.eta())),
            };
        };
        bar.set_style(style.with_key("left", left));
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
    let json = serde_json::to_string_pretty(value)?;
    print(&json)
}

/// Writes `text` and a line end to standard error.
pub fn note(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{}", plain(text));
}

/// Writes each of `texts` to standard error, as something that a user should know of a result.
pub(super) fn notes<'a>(texts: impl IntoIterator<Item = &'a String>) {
    texts.into_iter().for_each(|text| note(&format!("note: {text}")));
}

/// Writes an error to standard error, on one line.
pub fn note_error(text: &str) {
    note(&format!("error: {}", shortened(&one_line(text))));
}

/// Most characters of a word of an error, and of all of it. An error repeats what the user gave, which may be long.
const MOST_OF_WORD: usize = 160;
const MOST_OF_ERROR: usize = 800;

/// `text` without the middle of what is too long.
fn shortened(text: &str) -> String {
    let cut = |text: &str, most: usize| {
        let count = text.chars().count();
        if count <= most {
            return text.to_owned();
        }
        let start: String = text.chars().take(most / 2).collect();
        let end: String = text.chars().skip(count - most / 4).collect();
        format!("{start}…{end}")
    };
    let words: Vec<String> = text.split(' ').map(|word| cut(word, MOST_OF_WORD)).collect();
    cut(&words.join(" "), MOST_OF_ERROR)
}

/// Progress bars on standard error, one a stage; silent when that is not a terminal.
#[derive(Default)]
pub struct Bars {
    stage: Mutex<Stage>,
    /// Whether a line says of every stage how long it took, terminal or not.
    lines: bool,
}

/// A shorter stage gets no line.
const WORTH_A_LINE: Duration = Duration::from_millis(100);

#[derive(Default)]
struct Stage {
    shown: Shown,
    /// What is done, and since when.
    running: Option<(&'static str, Instant)>,
}

#[derive(Default)]
enum Shown {
    #[default]
    None,
    Counted(ProgressBar),
    Open {
        #[expect(dead_code, reason = "turns until it is dropped")]
        spinner: Spinner,
    },
}

impl Bars {
    /// Bars that leave a line of every stage, with the time that it took: for runs of minutes.
    pub fn with_lines() -> Self {
        Self { lines: true, ..Self::default() }
    }

    fn set(&self, next: Shown, running: Option<(&'static str, Instant)>) {
        let mut stage = self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        let before = std::mem::replace(&mut *stage, Stage { shown: next, running });
        drop(stage);
        if let Shown::Counted(bar) = before.shown {
            bar.finish_and_clear();
        }
        let running = before.running.map(|(what, since)| (what, since.elapsed()));
        if let Some((what, took)) = running.filter(|(_, took)| self.lines && *took > WORTH_A_LINE) {
            note(&format!("{what}: {:.1} s", took.as_secs_f64()));
        }
    }
}

impl Progress for Bars {
    fn stage(&self, what: &'static str, steps: Option<usize>) {
        self.end();
        let shown = match steps {
            Some(steps) => Shown::Counted(progress(steps, what)),
            None => Shown::Open { spinner: spinner(what) },
        };
        self.set(shown, Some((what, Instant::now())));
    }

    fn step(&self) {
        if let Shown::Counted(bar) = &self.stage.lock().unwrap_or_else(PoisonError::into_inner).shown {
            bar.inc(1);
        }
    }

    fn end(&self) {
        self.set(Shown::None, None);
    }
}

/// `text` with every character that a terminal would act on written out, as in `\u{1b}`. Line ends and tabs stay.
pub(crate) fn plain(text: &str) -> Cow<'_, str> {
    if !text.contains(acts) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        if acts(character) {
            // writing to a string cannot fail
            let _ = write!(out, "{}", character.escape_unicode());
        } else {
            out.push(character);
        }
    }
    Cow::Owned(out)
}

/// Whether a terminal acts on the character in place of showing it: control characters, and those that turn the
/// direction of the text.
fn acts(character: char) -> bool {
    let layout = matches!(character, '\n' | '\t');
    let turns = matches!(character, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    (character.is_control() && !layout) || turns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_short() {
        assert_eq!(shortened("`--set` a.b: no"), "`--set` a.b: no");
        let long = shortened(&format!("`--set` {}: no", "a.".repeat(50_000)));
        assert!(long.len() < 200 && long.starts_with("`--set` a.a.") && long.ends_with(".a.: no"), "{long}");
        assert!(shortened(&"a b ".repeat(50_000)).len() < 900);
    }

    #[test]
    fn what_a_terminal_would_act_on_is_written_out() {
        for (text, shown) in [
            ("T\tµS ± 0.1\n× 10²", "T\tµS ± 0.1\n× 10²"),
            ("a\u{1b}[31mb", "a\\u{1b}[31mb"),
            ("a\r\u{7}\u{8}\u{7f}", "a\\u{d}\\u{7}\\u{8}\\u{7f}"),
            ("\u{9b}2J", "\\u{9b}2J"),
            ("\u{202e}txt.exe", "\\u{202e}txt.exe"),
        ] {
            assert_eq!(plain(text), shown);
        }
    }
}
