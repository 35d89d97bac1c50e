//! Progress on the terminal.

use super::context::{Spinner, progress, spinner};
use indicatif::ProgressBar;
use spts::progress::Progress;
use std::sync::{Mutex, PoisonError};

/// Progress bars on standard error, one a stage; silent when that is not a terminal.
#[derive(Default)]
pub struct Bars(Mutex<Stage>);

#[derive(Default)]
enum Stage {
    #[default]
    None,
    Counted(ProgressBar),
    Open {
        #[expect(dead_code, reason = "turns until it is dropped")]
        spinner: Spinner,
    },
}

impl Bars {
    fn set(&self, next: Stage) {
        let mut stage = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Stage::Counted(bar) = std::mem::replace(&mut *stage, next) {
            bar.finish_and_clear();
        }
    }
}

impl Progress for Bars {
    fn stage(&self, what: &'static str, steps: Option<usize>) {
        self.set(Stage::None);
        self.set(match steps {
            Some(steps) => Stage::Counted(progress(steps, what)),
            None => Stage::Open { spinner: spinner(what) },
        });
    }

    fn step(&self) {
        if let Stage::Counted(bar) = &*self.0.lock().unwrap_or_else(PoisonError::into_inner) {
            bar.inc(1);
        }
    }

    fn end(&self) {
        self.set(Stage::None);
    }
}
