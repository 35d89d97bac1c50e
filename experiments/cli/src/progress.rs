//! Progress on the terminal.

use super::context::{Spinner, note, progress, spinner};
use indicatif::ProgressBar;
use spts::progress::Progress;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

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
    #[must_use]
    pub fn with_lines() -> Self {
        Self {
            lines: true,
            ..Self::default()
        }
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
