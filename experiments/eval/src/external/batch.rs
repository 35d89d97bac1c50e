//! A program that runs once for every press and M, and exchanges files.

use super::answers::refused;
use super::exchange::{Exchange, shell};
use super::process::{Process, in_words};
use super::{Settings, broken, in_file};
use crate::algorithm::{Algorithm, Answer, DecodeError, ExternalError};
use crate::npz::{self, NpzArray};
use crate::windows::Window;
use std::path::Path;
use std::process::Stdio;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Instant;

/// Numbers the exchange files, so that threads do not share one.
static NEXT: AtomicUsize = AtomicUsize::new(0);

/// Names of the arrays of answers.
const IMAGES: &str = "images";
const LABELS: &str = "labels";
/// Label of an unknown class.
const UNKNOWN: f64 = -1.0;

pub(super) struct Files<'a> {
    pub(super) settings: &'a Settings,
    pub(super) exchange: &'a Exchange,
    pub(super) learn: &'a Path,
    /// The first error of any thread; it ends the runs of the others.
    pub(super) failure: &'a OnceLock<ExternalError>,
}

impl Files<'_> {
    fn run(&self, windows: &[Window<'_>]) -> Result<Vec<Answer>, ExternalError> {
        if let Some(failure) = self.failure.get() {
            return Err(failure.clone());
        }
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let [asked, answered] = ["windows", "answers"].map(|name| self.exchange.path(&format!("{name}-{number}.npz")));
        let answers = write_windows(&asked, windows)
            .and_then(|()| self.wait(&asked, &answered, windows.len()))
            .and_then(|()| self.read_answers(&answered, windows.len()));
        for path in [asked, answered] {
            // the folder goes at the end in any case
            let _ = std::fs::remove_file(path);
        }
        answers.map_err(|error| self.failure.get_or_init(|| error).clone())
    }

    /// Runs the program to its end.
    fn wait(&self, asked: &Path, answered: &Path, windows: usize) -> Result<(), ExternalError> {
        let command = &self.settings.command;
        let deadline = Instant::now() + self.settings.limit;
        let mut shell = shell(command, &[Some(self.learn), Some(asked), Some(answered)]);
        let shell = shell.stdin(Stdio::null()).stdout(Stdio::null());
        let mut process = Process::start(shell).map_err(|e| broken(command, e))?;
        if !process.ends_by(deadline, || self.failure.get().is_some()) {
            let waited = format!("its run on {windows} windows");
            return Err(self.settings.late(waited));
        }
        match process.end() {
            Ok(status) if status.success() => Ok(()),
            status => Err(ExternalError::Ended {
                command: command.clone(),
                how: format!("ended ({})", in_words(&status)),
                waited: format!("{windows} windows"),
            }),
        }
    }

    fn read_answers(&self, path: &Path, windows: usize) -> Result<Vec<Answer>, ExternalError> {
        let command = &self.settings.command;
        let valid = &self.settings.valid;
        let failed = |source| ExternalError::AnswersFile {
            command: command.clone(),
            path: path.to_owned(),
            source: Arc::new(source),
        };
        npz::check_names(path, &[IMAGES, LABELS]).map_err(failed)?;
        let images = npz::read(path, IMAGES, &[windows, valid.taxels]).map_err(failed)?;
        let labels = npz::read(path, LABELS, &[windows]).map_err(failed)?;
        (0..windows)
            .map(|w| {
                let image = images.as_ref().map(|v| v[w * valid.taxels..][..valid.taxels].to_vec());
                let label = labels
                    .as_ref()
                    .map(|v| v[w].total_cmp(&UNKNOWN).is_ne().then(|| valid.label(v[w])));
                let label = label.map(Option::transpose).transpose();
                label.and_then(|label| valid.answer(image, label)).map_err(|problem| {
                    let window = format!("window {} of {windows}", w + 1);
                    refused(command, &window, &problem)
                })
            })
            .collect()
    }
}

fn write_windows(path: &Path, windows: &[Window<'_>]) -> Result<(), ExternalError> {
    let m = windows.first().map_or(0, |w| w.y.len());
    let taxels = windows.first().map_or(0, |w| w.phi.ncols());
    let weights: Vec<f64> = windows.iter().flat_map(|w| w.phi.values().iter().copied()).collect();
    #[expect(clippy::cast_possible_truncation, reason = "only used where weights are ±1")]
    let signs: Vec<i8> = weights.iter().map(|w| *w as i8).collect();
    let shape = [windows.len(), m, taxels];
    let phi = if windows.iter().all(|w| w.signs.is_some()) {
        NpzArray::Signs(&shape, &signs)
    } else {
        NpzArray::Doubles(&shape, &weights)
    };
    let all = |of: fn(&Window<'_>) -> Vec<f64>| -> Vec<f64> { windows.iter().flat_map(of).collect() };
    let (y, volts) = (all(|w| w.y.to_vec()), all(|w| w.volts.to_vec()));
    npz::write(
        path,
        &[
            ("phi", phi),
            ("y", NpzArray::Doubles(&[windows.len(), m], &y)),
            ("volts", NpzArray::Doubles(&[windows.len(), m], &volts)),
        ],
    )
    .map_err(|source| in_file(path, source))
}

impl Algorithm for Files<'_> {
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
        *answer = self.run(&[*window])?.pop().unwrap_or_default();
        Ok(())
    }

    fn batched(&self) -> bool {
        true
    }

    fn decode_all(&mut self, windows: &[Window<'_>]) -> Result<Vec<Answer>, DecodeError> {
        if windows.is_empty() {
            return Ok(Vec::new());
        }
        Ok(self.run(windows)?)
    }
}
